"""Python values as options of a question and as values of a case file."""

from collections.abc import Mapping
from os import PathLike, fspath
from typing import Any

from bondline import _bondline

#: Options of commands that are no part of a question, and those that a method takes in another way, with what to do.
_ELSEWHERE = {
    "set": "give the values to Case.with_",
    "backend": "give it to Case.on",
    "precision": "give it to Case.on",
    "device": "give it to Case.on",
    "instruction_set": "it is for tests of the command",
    "out": "write the report with the method report of the answer",
    "force": "give it to the method report of the answer",
    "json": "the answer is an object; its report has summary.json",
    "quiet": "no progress is shown without progress=True",
    "limit_time": "only the command ends after a time",
    "resume": "only the command keeps finished work",
    "checkpoint_interval": "only the command keeps finished work",
    "max_failed": "it sets the exit code of the command; the answer counts failed members",
    "members": "the number of members is n; bondline.dask marches parts of a sweep",
    "part": "bondline.dask marches parts of a sweep",
    "piece": "bondline.dask marches parts of a sweep",
    "study": "Case.coverage takes the number of data sets",
    "truth": "only the command writes a single synthetic data set",
}


#: Names of questions, where the method has another.
_METHODS = {"twin": "coverage"}


def question(name: str, options: Mapping[str, object], own: Mapping[str, object]) -> dict[str, Any]:
    """The options of the question of a name from keywords of the user and those of a method.

    An option that is ``None`` or ``False`` is left out. A mapping is a list of pairs: ``start={"a": 1.1}`` is
    ``["a=1.1"]``.

    Raises
    ------
    OptionError
        There is no such option, or it is given elsewhere; the message says where.
    """
    known = [option for option in _bondline.options_of(name, {}) if option not in _ELSEWHERE]
    # Both have the keyword n.
    known += ["n"] if own.keys() & {"members", "study"} else []
    for option in options:
        reason = _ELSEWHERE.get(option)
        if reason is not None:
            raise _bondline.OptionError(f"{option} has no effect here: {reason}")
    for option in options:
        if option not in known:
            method = _METHODS.get(name, name)
            others = f"it has {', '.join(known)}" if known else "it has none"
            raise _bondline.OptionError(f"{option}: {method} has no such option; {others}")
    given = {**options, **own}
    return {name: _value(value) for name, value in given.items() if value is not None and value is not False}


def _value(value: object) -> object:
    if isinstance(value, Mapping):
        return [f"{name}={_joined(item)}" for name, item in value.items()]
    if isinstance(value, (list, tuple)):
        return [_value(item) for item in value]
    if hasattr(value, "magnitude") and hasattr(value, "units") or isinstance(value, PathLike):
        return fspath(value) if isinstance(value, PathLike) else text(value)
    return _plain(value)


def _joined(value: object) -> str:
    return ",".join(text(item) for item in value) if isinstance(value, (list, tuple)) else text(value)


def text(value: object) -> str:
    """A number, a text such as ``"3 kPa"``, or a pint quantity, as a case file has it."""
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        return f"{float(value.magnitude)!r} {value.units:~C}".replace("**", "^")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return repr(_plain(value))


def _toml(value: object) -> str:
    written = text(value)
    if isinstance(value, str) or hasattr(value, "magnitude"):
        return '"' + written.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return written


def _plain(value: Any) -> Any:
    """A NumPy scalar as a number of Python."""
    return value.item() if hasattr(value, "item") else value


def content(value: Any, key: str = "") -> Any:
    """The content of a case with pint quantities as text and arrays as lists; messages name its key."""
    if value is None:
        raise _bondline.CaseError(f"{key}: expected a value, found None: leave the key out to have its default")
    if isinstance(value, Mapping):
        return {str(name): content(item, f"{key}.{name}" if key else str(name)) for name, item in value.items()}
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        return text(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [content(item, f"{key}[{place}]") for place, item in enumerate(value)]
    return value
