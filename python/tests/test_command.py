"""A question from Python and by the command has the same answer, to the last bit."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from operator import methodcaller
from pathlib import Path
from typing import Any

import bondline
import numpy as np
import pytest
from bondline import _bondline
from conftest import CASES

#: Keys whose values differ from run to run.
VARYING = {"seconds", "provenance", "checksum"}

Ask = Callable[[bondline.Case], bondline.Result]


def size(case: bondline.Case) -> tuple[str, str]:
    """A ply to size, and a limit that some thickness of it holds or none does."""
    return str(case._content["layup"]["plies"][-1]["name"]), f"{case.sensors[-1]} < 700 K"


#: Questions with options in Python, and the words of the command; those of a sizing depend on the case.
WITH_OPTIONS: dict[str, tuple[Ask, list[str]]] = {
    "uncertainty": (lambda case: case.uncertainty(n=40, seed=7), ["-n", "40", "--seed", "7"]),
    "history": (lambda case: case.history(knots=6), ["--knots", "6"]),
    "study": (lambda case: bondline.study(case, n=40), ["-n", "40"]),
    "size": (lambda case: case.size(*size(case), n=30), ["-n", "30"]),
    "twin": (lambda case: case.coverage(3, noise="2 K"), ["--study", "3", "--noise", "2 K"]),
}
#: All but trade studies and designs, which need materials or sensors of a case. Others are asked without options.
QUESTIONS: dict[str, tuple[Ask, list[str]]] = {
    name: WITH_OPTIONS.get(name, (methodcaller(name), []))
    for name in _bondline.QUESTIONS
    if name not in ("trade", "design")
}
NAMES = sorted(path.parent.name for path in CASES.glob("*/case.toml"))
ALL = [(name, question) for name in NAMES for question in QUESTIONS]
#: Without BONDLINE_ALL all questions for one case, and a question for others that march in a moment.
QUICK = [("lamp-test", "estimate"), ("permeation", "predict"), ("twin-tc3", "uncertainty")]
CHOSEN = [both for both in ALL if "BONDLINE_ALL" in os.environ or both[0] == "slab" or both in QUICK]


def steady(value: Any) -> Any:
    """A summary without what differs from run to run."""
    if isinstance(value, dict):
        return {key: steady(item) for key, item in value.items() if key not in VARYING}
    return [steady(item) for item in value] if isinstance(value, list) else value


@pytest.mark.parametrize(("name", "question"), CHOSEN)
def test_a_question_has_the_answer_of_the_command(name: str, question: str, tmp_path: Path) -> None:
    ask, words = QUESTIONS[question]
    case = bondline.Case.load(CASES / name).on(backend="cpu")
    if question == "size":
        ply, limit = size(case)
        words = [*words, "--ply", ply, "--limit", limit]
    command = [sys.executable, "-m", "bondline", question, str(CASES / name), "--backend", "cpu", *words]
    run = subprocess.run([*command, "--json", "--quiet", "--out", str(tmp_path / "a")], capture_output=True, text=True)
    if run.returncode == 2:
        with pytest.raises(bondline.OptionError):
            ask(case)
        return
    # 1: the minimisation did not converge, or too many members failed.
    assert run.returncode in (0, 1), run.stderr
    folder = ask(case).report(tmp_path / "b").parent
    mine = json.loads((folder / "summary.json").read_text())
    assert steady(mine) == steady(json.loads(run.stdout))
    changed = steady(mine)
    changed["case"] = "another"
    assert changed != steady(mine)


@pytest.mark.parametrize("name", NAMES if "BONDLINE_ALL" in os.environ else ["slab"])
def test_arrays_have_the_numbers_of_the_answers(name: str) -> None:
    case = bondline.Case.load(CASES / name).on(backend="cpu")
    nominal = case.predict().record["nominal"]
    row = [case.nominal]
    assert np.array_equal(case.march(row)[0], nominal["temperatures_k"])
    assert np.array_equal(case.instants_s(), nominal["instants_s"])
    if not case.factors:
        return
    at, slopes = case.tangents(row)
    assert np.array_equal(slopes[0], case.sensitivity().record["sensitivity"]["derivatives_k"])
    assert np.array_equal(at[0], nominal["temperatures_k"]) and not np.array_equal(slopes[0], 1.01 * slopes[0])


def test_the_command_exits_with_the_code_of_its_failure(tmp_path: Path) -> None:
    run = subprocess.run([sys.executable, "-m", "bondline", "predict", str(tmp_path)], capture_output=True, text=True)
    assert run.returncode == 2 and "case.toml" in run.stderr


def test_the_command_starts_without_numpy() -> None:
    imported = "import sys, bondline.__main__; print('numpy' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", imported], check=True, capture_output=True, text=True)
    assert run.stdout == "False\n"
    used = imported.replace(";", "; bondline.Case;")
    run = subprocess.run([sys.executable, "-c", used], check=True, capture_output=True, text=True)
    assert run.stdout == "True\n"
