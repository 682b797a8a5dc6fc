"""Python values as words of the command and as values of a case file."""

from collections.abc import Mapping
from typing import Any

from bondline import _bondline

#: Options of commands that a method of a case takes in another way, or not at all, with what to do.
_WITHOUT_EFFECT = {
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
    "depth_profiles": "only the command computes profiles",
    "max_failed": "it sets the exit code of the command; the answer counts failed members",
    "members": "bondline.dask marches parts of a sweep",
    "piece": "bondline.dask marches parts of a sweep",
    "compare": "only the command compares two cases",
}


def refuse_without_effect(options: Mapping[str, object]) -> None:
    """Refuse options of the command that would be taken and have no effect.

    Raises
    ------
    OptionError
        There is such an option; the message names what to do.
    """
    for name in options:
        reason = _WITHOUT_EFFECT.get(name.replace("-", "_"))
        if reason is not None:
            raise _bondline.OptionError(f"{name} has no effect here: {reason}")


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


def content(value: Any) -> Any:
    """The content of a case with pint quantities as text and arrays as lists."""
    if isinstance(value, Mapping):
        return {str(key): content(item) for key, item in value.items() if item is not None}
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        return text(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [content(item) for item in value]
    return value


def words(options: Mapping[str, object]) -> list[str]:
    """Options of a command, such as ``thickness_range=("3 mm", "20 mm")``, as its words.

    An option that is ``None`` or ``False`` is left out, and one that is ``True`` has no value. Names and pairs are
    joined as the command has them: ``factors=["a", "b"]``, ``window=(0, 80)``, ``start={"a": 1.1}``.
    """
    found = []
    for name, value in options.items():
        if value is None or value is False:
            continue
        option = "--" + name.replace("_", "-")
        if value is True:
            found.append(option)
        elif isinstance(value, Mapping):
            found.append(f"{option}=" + ",".join(f"{key}={text(item)}" for key, item in value.items()))
        elif isinstance(value, tuple):
            found.append(f"{option}=" + ":".join(text(item) for item in value))
        elif isinstance(value, list):
            found.append(f"{option}=" + ",".join(text(item) for item in value))
        else:
            found.append(f"{option}={text(value)}")
    return found
