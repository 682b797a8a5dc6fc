"""A question from Python and by the command has the same answer, to the last bit."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bondline
import pytest
from conftest import CASES

#: Keys whose values differ from run to run.
VARYING = {"seconds", "provenance", "checksum"}

Ask = Callable[[bondline.Case], bondline.Result]
QUESTIONS: dict[str, tuple[Ask, list[str]]] = {
    "predict": (lambda case: case.predict(), []),
    "uncertainty": (lambda case: case.uncertainty(n=40, seed=7), ["-n", "40", "--seed", "7"]),
    "sensitivity": (lambda case: case.sensitivity(), []),
    "estimate": (lambda case: case.estimate(), []),
}
NAMES = sorted(path.parent.name for path in CASES.glob("*/case.toml"))
ALL = [(name, question) for name in NAMES for question in QUESTIONS]
#: Without BONDLINE_ALL one question for each case, and all questions for one of them.
CHOSEN = [
    pair for place, pair in enumerate(ALL) if "BONDLINE_ALL" in os.environ or pair[0] == "slab" or place % 5 == 0
]


def steady(value: Any) -> Any:
    """A summary without what differs from run to run."""
    if isinstance(value, dict):
        return {key: steady(item) for key, item in value.items() if key not in VARYING}
    return [steady(item) for item in value] if isinstance(value, list) else value


@pytest.mark.parametrize(("name", "question"), CHOSEN)
def test_a_question_has_the_answer_of_the_command(name: str, question: str, tmp_path: Path) -> None:
    ask, words = QUESTIONS[question]
    command = [sys.executable, "-m", "bondline", question, str(CASES / name), "--backend", "cpu", *words]
    run = subprocess.run([*command, "--json", "--quiet", "--out", str(tmp_path / "a")], capture_output=True, text=True)
    case = bondline.Case.load(CASES / name).on(backend="cpu")
    if run.returncode == 2:
        with pytest.raises(bondline.OptionError):
            ask(case)
        return
    assert run.returncode == 0, run.stderr
    folder = ask(case).report(tmp_path / "b").parent
    mine = json.loads((folder / "summary.json").read_text())
    assert steady(mine) == steady(json.loads(run.stdout))
    changed = steady(mine)
    changed["case"] = "another"
    assert changed != steady(mine)


def test_the_command_exits_with_the_code_of_its_failure(tmp_path: Path) -> None:
    run = subprocess.run([sys.executable, "-m", "bondline", "predict", str(tmp_path)], capture_output=True, text=True)
    assert run.returncode == 2 and "case.toml" in run.stderr
