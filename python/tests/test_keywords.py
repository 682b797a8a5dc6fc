"""Every keyword of every public function and method has an effect or is refused with the reason.

Functions, methods and keywords come from the package itself: one that has no entry in the table fails the test. The
options that a method passes on to a question are in ``test_questions.py``.
"""

from __future__ import annotations

import importlib
import inspect
import json
import socket
import threading
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bondline
import numpy as np
import pandas
import pytest
from conftest import CASES
from distributed import Client

#: Modules with public functions beside those of the package.
MODULES = ["bondline", "bondline.dask", "bondline.driver", "bondline.umbridge"]
TOML = """
initial_temperature = "300 K"
duration = "10 s"
ply = [{ name = "A", material = "mine", thickness = "3 mm" }]
sensor = [{ name = "BACK", below = "A" }]
hot_face = { kind = "heated", flux = "5 kW/m^2" }
back_face = { kind = "insulated" }
"""


def material(conductivity: str) -> dict[str, Any]:
    """The content of a material file."""
    values: dict[str, Any] = {
        "density": {"value": "200 kg/m^3"},
        "heat_capacity": {"value": "900 J/kg/K"},
        "conductivity": {"value": conductivity},
        "emissivity": {"value": 0.9},
    }
    return {"name": "Mine"} | values


def material_text(conductivity: str) -> str:
    """The same as the text of the file."""
    lines = ['name = "Mine"']
    for name, entry in material(conductivity).items():
        if isinstance(entry, dict):
            lines += [f"[{name}]", f"value = {json.dumps(entry['value'])}"]
    return "\n".join(lines)


def values() -> dict[str, Any]:
    """The content of a case that refers to a material in memory."""
    return {
        "initial_temperature": "300 K",
        "duration": "10 s",
        "ply": [{"name": "A", "material": "mine", "thickness": "3 mm"}],
        "sensor": [{"name": "BACK", "below": "A"}],
        "hot_face": {"kind": "heated", "flux": "5 kW/m^2"},
        "back_face": {"kind": "insulated"},
        "observations": {"sigma": "1 K"},
    }


@dataclass
class Refused:
    """A value that is refused, and what the message has."""

    value: object
    message: str


@dataclass
class Entry:
    """A function, keywords with which it is called, and another value of each keyword. ``**`` has further keywords."""

    function: Callable[..., Any]
    base: dict[str, Any]
    other: dict[str, Any]
    #: What a call without the keyword raises.
    base_raises: tuple[type[Exception], ...] = ()


class CountingClient:
    """A client of Dask that records what is submitted."""

    def __init__(self, client: Client, events: list[object]) -> None:
        self._client, self._events = client, events

    def submit(self, *args: Any, **more: Any) -> Any:
        self._events.append(("submitted", more["retries"]))
        return self._client.submit(*args, **more)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._client, name)


@dataclass
class World:
    """What calls are made of."""

    slab: bondline.Case
    lcat: bondline.Case
    client: Client
    folder: Path
    capture: pytest.CaptureFixture[str]
    #: What happened in a call beside its answer.
    events: list[object]

    def progress(self, *of: Any) -> None:
        """A callback of progress."""
        self.events.append("progress")

    def printed(self, function: Callable[..., int]) -> Callable[..., Any]:
        """A program: its exit code, what it prints, and what it writes."""

        def call(words: list[str]) -> Any:
            code = function(words)
            files = sorted(str(path) for path in self.folder.rglob("*"))
            return code, self.capture.readouterr().err, files

        return call


def served(case: bondline.Case, host: str, port: int) -> Any:
    """A server that is asked for the sizes of a model."""
    import bondline.umbridge

    server = bondline.umbridge.server(case, host, port)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        body = json.dumps({"name": "peaks", "input": [[1.0] * len(case.factors)]}).encode()
        request = urllib.request.Request(f"http://{host}:{server.server_port}/Evaluate", body)
        with urllib.request.urlopen(request, timeout=30) as answer:
            return json.load(answer), server.server_port == port
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def free_port() -> int:
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        return int(bound.getsockname()[1])


def reported(result: bondline.Result, folder: Path, force: bool = False) -> Path:
    """A report into a folder that may have one of another case."""
    return result.report(folder, force)


POINT = {"points": [[1.0, 1.0]]}
AT = {"x": [1.0, 1.0]}
SIZED = {"ply": "INS", "limit": "TC4 < 800 K", "n": 30, "probability": 0.85}
TRADED = {"choices": {"INS": ["pyrogel3350"]}, "size": "INS", "limit": "TC4 < 800 K", "n": 30, "probability": 0.85}
PARAMETERS = " 1 variables\n 1.02 f_k\n 1 functions\n 1 ASV_1:peak_BACK\n"


def of_dask(world: World, function: str, base: dict[str, Any], other: dict[str, Any]) -> Entry:
    """A function of the cluster. The base counts its tasks and calls of the progress."""
    base = {"case": world.slab, "client": CountingClient(world.client, world.events), "retries": 1} | base
    other = {"case": world.slab.with_(f_k=1.02), "client": world.client, "retries": 2} | other
    return Entry(getattr(importlib.import_module("bondline.dask"), function), base, other)


def of_driver(function: str) -> Any:
    return getattr(importlib.import_module("bondline.driver"), function)


def table(w: World) -> dict[str, Callable[[], Entry]]:
    """How each function is called, and another value of each keyword."""
    progress = {"progress": w.progress}
    other_files = {"materials/mine.toml": material_text("0.05 W/m/K")}
    files = {"materials/mine.toml": material_text("0.04 W/m/K")}
    frame = pandas.DataFrame({"BACK": [300.0, 310.0]}, index=[0.0, 10.0])
    in_memory = {"case": values(), "materials": {"mine": material("0.04 W/m/K")}, "observations": frame}
    cut = {"pieces": 2, "progress": w.progress}
    recut = {"pieces": 3, "progress": None}
    pest = ["--pest", str(w.folder / "a"), str(CASES / "slab")]
    return {
        "study": lambda: Entry(bondline.study, {"case": w.slab, "n": 30}, {"case": w.lcat, "**": {"seed": 5}}),
        "Case.load": lambda: Entry(bondline.Case.load, {"path": CASES / "slab"}, {"path": CASES / "lamp-test"}),
        "Case.from_toml": lambda: Entry(
            bondline.Case.from_toml,
            {"text": TOML, "files": files},
            {"text": TOML.replace("3 mm", "4 mm"), "files": other_files, "id": "mine"},
        ),
        "Case.from_dict": lambda: Entry(
            bondline.Case.from_dict,
            in_memory,
            {
                "case": values() | {"duration": "20 s"},
                "materials": {"mine": material("0.05 W/m/K")},
                "observations": frame + 1.0,
                "files": Refused(files, "materials: 'mine' is stated twice: files has 'materials/mine.toml' too"),
                "id": "mine",
            },
        ),
        "Case.with_": lambda: Entry(w.slab.with_, {}, {"changes": {"f_k": 1.1}, "**": {"f_cp": 1.1}}),
        "Case.on": lambda: Entry(w.slab.on, {}, {"backend": "gpu", "precision": "f32", "device": "H200"}),
        "Case.salib_problem": lambda: Entry(w.slab.salib_problem, {}, {"bounds": "large"}),
        "Case.instants_s": lambda: Entry(w.slab.instants_s, {}, {}),
        "Case.march": lambda: Entry(w.slab.march, POINT, {"points": [[1.1, 1.0]]} | progress),
        "Case.peaks": lambda: Entry(w.slab.peaks, POINT, {"points": [[1.1, 1.0]]} | progress),
        "Case.tangents": lambda: Entry(
            w.slab.tangents, POINT, {"points": [[1.1, 1.0]], "factors": ["f_cp"]} | progress
        ),
        "Case.residuals": lambda: Entry(w.slab.residuals, AT, {"x": [1.1, 1.0]}),
        "Case.jacobian": lambda: Entry(w.slab.jacobian, AT, {"x": [1.1, 1.0]}),
        "Case.log_prob": lambda: Entry(w.slab.log_prob, AT, {"x": [1.01, 1.0]}),
        "Case.predict": lambda: Entry(w.slab.predict, {}, progress | {"**": {"depth_profiles": ["10 s"]}}),
        "Case.uncertainty": lambda: Entry(
            w.slab.uncertainty, {"n": 30}, {"n": 31, "keep": "members", "**": {"seed": 5}} | progress
        ),
        "Case.sensitivity": lambda: Entry(w.slab.sensitivity, {}, progress | {"**": {"window": (0, 40)}}),
        "Case.estimate": lambda: Entry(w.slab.estimate, {}, progress | {"**": {"factors": ["f_k"]}}),
        "Case.study": lambda: Entry(w.slab.study, {"n": 30}, {"n": 31, "**": {"seed": 5}} | progress),
        "Case.size": lambda: Entry(
            w.lcat.size,
            SIZED,
            {"ply": "GB", "limit": "TC4 < 750 K", "n": 31, "**": {"probability": 0.8}} | progress,
        ),
        "Case.trade": lambda: Entry(
            w.lcat.trade,
            TRADED,
            {
                "choices": {"INS": ["saffil-96"]},
                "size": "OF",
                "limit": "TC4 < 750 K",
                "n": 31,
                "exposures": [CASES / "lcat-2330"],
                "**": {"seed": 5},
            }
            | progress,
        ),
        "Case.design": lambda: Entry(
            w.lcat.design,
            {"n": 4, "sensors": 2, "estimate": ["f_k_INS"]},
            {"estimate": ["f_k_OF"], "sensors": 1, "n": 5, "**": {"noise": "5 K"}} | progress,
        ),
        "Case.history": lambda: Entry(w.lcat.history, {"knots": 6}, progress | {"**": {"knots": 5}}),
        "Case.observations": lambda: Entry(w.slab.observations, {}, {}),
        "Case.coverage": lambda: Entry(
            w.slab.coverage, {"n": 2, "noise": "2 K"}, {"n": 3, "**": {"seed": 5}} | progress
        ),
        "Result.summary": lambda: Entry(w.slab.predict().summary, {}, {}),
        "Result.report": lambda: Entry(
            w.slab.predict().report,
            {"folder": w.lcat.predict().report(w.folder / "a").parent},
            {"folder": w.folder / "b", "force": True},
            base_raises=(bondline.BondlineError,),
        ),
        # Its draws go to another package: a test of its own.
        "Estimate.to_arviz": lambda: Entry(lambda: None, {}, {}),
        "bondline.dask.uncertainty": lambda: of_dask(
            w,
            "uncertainty",
            {"n": 40, "interval_s": 0.0} | cut,
            {"n": 41, "interval_s": 1e9, "**": {"seed": 5}, "pieces": 3, "progress": Refused(None, "interval_s has")},
        ),
        "bondline.dask.estimate": lambda: of_dask(
            w, "estimate", {"starts": 4} | cut, {"starts": 5, "**": {"factors": ["f_k"]}} | recut
        ),
        "bondline.dask.coverage": lambda: of_dask(
            w, "coverage", {"n": 4, "noise": "2 K"} | cut, {"n": 5, "**": {"seed": 5}} | recut
        ),
        "bondline.dask.posterior": lambda: of_dask(
            w,
            "posterior",
            {"seeds": [1, 2], "walkers": 24, "mcmc_iterations": 20},
            {"seeds": [1, 3], "**": {"factors": ["f_k"]}},
        ),
        "bondline.driver.respond": lambda: Entry(
            of_driver("respond"),
            {"case": w.slab, "factors": {"f_k": 1.02}},
            {"case": w.slab.with_(f_cp=1.1), "factors": {"f_k": 1.03}, "by": ["f_k"]},
        ),
        "bondline.driver.drive": lambda: Entry(
            of_driver("drive"),
            {"case": w.slab, "parameters": PARAMETERS},
            {"case": w.slab.with_(f_cp=1.1), "parameters": PARAMETERS.replace("1.02", "1.03")},
        ),
        "bondline.driver.pest_files": lambda: Entry(
            of_driver("pest_files"),
            {"case": w.slab, "command": "a"},
            {"case": w.slab.with_({"observations.sigma": "3 K"}), "command": "b"},
        ),
        "bondline.driver.main": lambda: Entry(
            w.printed(of_driver("main")), {"words": pest}, {"words": ["none", "in", str(w.folder / "out")]}
        ),
        "bondline.umbridge.server": lambda: Entry(
            served,
            {"case": w.slab, "host": "127.0.0.1", "port": 0},
            # An address of no machine.
            {"case": w.slab.with_({"ply.SLAB.thickness": "12 mm"}), "host": Refused("192.0.2.1", "address"),
             "port": free_port()},
        ),
        "bondline.umbridge.main": lambda: Entry(
            w.printed(importlib.import_module("bondline.umbridge").main), {"words": ["none"]}, {"words": ["nope"]}
        ),
    }


def public_functions() -> dict[str, Callable[..., Any]]:
    """Functions and methods by their names. Those of a class are named after the class that defines them."""
    found: dict[str, Callable[..., Any]] = {}
    for name in bondline.__all__:
        of_package = getattr(bondline, name)
        if inspect.isfunction(of_package):
            found[name] = of_package
        elif inspect.isclass(of_package):
            for method, function in inspect.getmembers(of_package, inspect.isroutine):
                is_own = inspect.isfunction(function) or inspect.ismethod(function)
                if is_own and not method.startswith("_"):
                    found[function.__qualname__] = function
    for module in map(importlib.import_module, MODULES[1:]):
        for name, function in inspect.getmembers(module, inspect.isfunction):
            if function.__module__ == module.__name__ and not name.startswith("_"):
                found[f"{module.__name__}.{name}"] = function
    return found


def keywords(function: Callable[..., Any]) -> list[str]:
    """The keywords of a function; ``**`` for any others."""
    parameters = inspect.signature(function).parameters.values()
    named = ["**" if found.kind == found.VAR_KEYWORD else found.name for found in parameters]
    return [name for name in named if name != "self"]


ALL = [(name, keyword) for name, function in public_functions().items() for keyword in keywords(function)]


def shown(value: Any) -> Any:
    """What an answer has, without what differs from run to run."""
    if isinstance(value, bondline.Result):
        numbers = {key: item for key, item in value.record.items() if key not in {"timing", "run"}}
        return repr(numbers), shown(value._members)
    if isinstance(value, bondline.Case):
        return value.id, value._core.fingerprint(), repr(value._session)
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if isinstance(value, dict):
        return {key: shown(item) for key, item in value.items()}
    return [shown(item) for item in value] if isinstance(value, (list, tuple)) else repr(value)


def called(world: World, entry: Entry, given: dict[str, Any], may_raise: tuple[type[Exception], ...] = ()) -> Any:
    """What a call gives, and what happened meanwhile."""
    world.events.clear()
    try:
        answer = shown(entry.function(**given))
    except may_raise as error:
        answer = f"raised {error}"
    return answer, list(world.events)


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with Client(processes=False, n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as client:
        yield client


@pytest.fixture(scope="module")
def lcat() -> bondline.Case:
    return bondline.Case.load(CASES / "lcat-2259").on(backend="cpu").with_({"resolution.tolerance": "5 K"})


@pytest.fixture
def world(
    slab: bondline.Case, lcat: bondline.Case, client: Client, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> World:
    return World(slab, lcat, client, tmp_path, capsys, [])


def test_the_table_has_every_function_and_keyword_and_no_others(world: World) -> None:
    functions, entries = public_functions(), table(world)
    assert sorted(entries) == sorted(functions)
    for name, function in functions.items():
        if name != "Estimate.to_arviz":
            assert sorted(entries[name]().other) == sorted(keywords(function)), name
    assert len(ALL) > 80


@pytest.mark.parametrize(("name", "keyword"), ALL)
def test_a_keyword_has_an_effect_or_is_refused(world: World, name: str, keyword: str) -> None:
    entry = table(world)[name]()
    value = entry.other[keyword]
    if isinstance(value, Refused):
        with pytest.raises((bondline.BondlineError, ValueError, OSError), match=value.message):
            entry.function(**entry.base | {keyword: value.value})
        return
    before = called(world, entry, entry.base, entry.base_raises)
    more = value if keyword == "**" else {keyword: value}
    assert called(world, entry, entry.base | more) != before, f"{name}({keyword}={value!r}) has no effect"
    if keyword == "**":
        with pytest.raises((bondline.OptionError, bondline.CaseError), match="nope"):
            entry.function(**entry.base | {"nope": 1})


def test_a_call_without_a_change_has_the_same_answer(world: World) -> None:
    entries = table(world)
    for name in ("Case.march", "Case.uncertainty", "Case.with_", "bondline.dask.uncertainty", "bondline.driver.drive"):
        entry = entries[name]()
        assert called(world, entry, entry.base) == called(world, entry, entry.base), name


def test_values_that_cannot_have_an_effect_are_refused(slab: bondline.Case, client: Client) -> None:
    dask: Any = importlib.import_module("bondline.dask")
    two = [[1.0, 1.0], [1.1, 1.0]]
    no_file = values() | {"observations": {"file": "mine.csv"}}
    frame = pandas.DataFrame({"BACK": [300.0]}, index=[0.0])
    wrong: list[tuple[Callable[[], Any], type[Exception], str]] = [
        (lambda: slab.jacobian(two), ValueError, "x: expected one point, found 2"),
        (lambda: slab.salib_problem("wide"), ValueError, "bounds: expected 'small' or 'large', found 'wide'"),
        (lambda: slab.with_({"f_k": 1.1}, f_k=1.2), bondline.OptionError, "f_k is stated twice"),
        (lambda: slab.march([[1.0, 1.0]], progress="yes"), TypeError, "progress: expected True, False"),  # type: ignore
        (lambda: bondline.Case.from_dict(no_file, observations=frame), ValueError, "observations: they are stated"),
        (lambda: dask.posterior(slab, [1], client=client, seed=2), bondline.OptionError, "seed has no effect here"),
        (lambda: dask.posterior(slab, [1], client=client, nope=2), bondline.OptionError, "nope: estimate has no such"),
        (lambda: dask.uncertainty(slab, client=client, interval_s=2.0), bondline.OptionError, "interval_s has no eff"),
        (lambda: bondline.Case.from_dict(values() | {"pressure": None}), bondline.CaseError, "^pressure: expected a v"),
        (lambda: bondline.Case.from_dict(values() | {"ply": [{"name": None}]}), bondline.CaseError, r"^ply\[0\].name:"),
        (lambda: bondline.Case.from_dict(values(), {"mine": {"name": None}}), bondline.CaseError, "^materials.mine"),
        (lambda: slab.uncertainty(n=1), bondline.OptionError, "^n"),
        (lambda: slab.with_(duration="x"), bondline.CaseError, "^duration=x: "),
        (lambda: slab.with_(presure="3 kPa"), bondline.CaseError, "^presure=3 kPa: unknown key"),
    ]
    for call, error, message in wrong:
        with pytest.raises(error, match=message):
            call()


def test_messages_have_no_options_of_the_command_line(slab: bondline.Case) -> None:
    calls: list[Callable[[], Any]] = [
        lambda: slab.with_(nope=1),
        lambda: slab.history(quantity="gas"),
        lambda: slab.estimate(factors=[]),
        lambda: slab.uncertainty(n=1),
        lambda: slab.coverage(0),
        lambda: slab.size("NOPE", "BACK < 700 K"),
        lambda: slab.on(backend="cpu", device="H200").predict(),
        lambda: slab.uncertainty(n=20, nope=1),
    ]
    raised = 0
    for call in calls:
        try:
            call()
        except bondline.BondlineError as error:
            raised += 1
            assert "--" not in str(error), str(error)
    assert raised >= 6
