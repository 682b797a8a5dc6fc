"""Every option of every question has an effect or is refused. The options come from the library, not from a list."""

from typing import Any

import bondline
import pytest
from bondline import _bondline
from bondline._options import question
from conftest import CASES

#: A value for each option that is not its default. An option without a value here fails the test.
VALUES: dict[str, Any] = {
    "bounds": "large",
    "choices": {"INS": ["saffil-96"]},
    "compare": CASES / "lcat-2330",
    "correlation_time": "3 s",
    "criterion": "a",
    "depth_profiles": 3,
    "estimate": ["f_k_INS"],
    "exposures": [CASES / "lcat-2330"],
    "factors": ["f_k_INS"],
    "grid": "0.4 mm",
    "knots": 5,
    "least_distance": "1.5 mm",
    "limit": "TC4 < 700 K",
    "loss": "huber",
    "max_iterations": 1,
    "mcmc_iterations": 24,
    "members": 31,
    "method": "difference",
    "minimiser": "paper",
    "noise": "3 K",
    "others": [CASES / "lcat-2330"],
    "part": "0..5",
    "piece": "1/4",
    "ply": "OF",
    "position_tolerance": "0.2 mm",
    "posterior": True,
    "prior": "small",
    "probability": 0.8,
    "profile": ["f_k_INS"],
    "quantity": "gas",
    "run_lengths": ["60 s"],
    "sampling": "uniform",
    "sampling_bounds": "large",
    "seed": 5,
    "sensors": ["TC3"],
    "size": "OF",
    "smoothing": 1.0,
    "start": {"f_k_INS": 1.1},
    "starts": 4,
    "step": 1e-3,
    "study": 3,
    "target": "TC3",
    "thickness_range": ("2 mm", "9 mm"),
    "truth": {"f_k_INS": 1.1},
    "until": "TC4 P95 ± 50 K",
    "walkers": 32,
    "window": (10, 60),
    "worst": True,
}
#: Options in the context of which the others may have an effect, beside those that a question needs.
CONTEXTS: dict[str, list[dict[str, Any]]] = {
    "estimate": [{}, {"posterior": True, "walkers": 24, "mcmc_iterations": 20}],
    "study": [{}, {"posterior": True, "walkers": 24, "mcmc_iterations": 20}],
    "twin": [{}, {"max_iterations": 1}],
    "design": [{}, {"noise": "2 K"}],
}
NEEDED: dict[str, dict[str, Any]] = {
    "uncertainty": {"members": 30},
    "study": {"members": 30},
    "size": {"ply": "INS", "limit": "TC4 < 800 K", "members": 30, "probability": 0.85},
    "trade": {
        "choices": {"INS": ["pyrogel3350", "saffil-96"]}, "size": "INS", "limit": "TC4 < 800 K", "members": 30,
        "probability": 0.85,
    },
    "design": {"members": 4, "sensors": 2},
    "twin": {"study": 2, "noise": "2 K"},
}
ALL = [(name, option) for name in _bondline.QUESTIONS for option in _bondline.options_of(name, {})]


def answer(case: bondline.Case, name: str, options: dict[str, Any]) -> dict[str, Any]:
    """All numbers of an answer, without what differs from run to run."""
    answers, _ = case._core.ask(name, question(name, {}, options), case._session)
    return {key: value for key, value in answers.record().items() if key not in {"timing", "run"}}


@pytest.fixture(scope="module")
def lcat() -> bondline.Case:
    case = bondline.Case.load(CASES / "lcat-2259").on(backend="cpu")
    return case.with_({"resolution.tolerance": "5 K", "f_k_INS.large": [0.5, 2.0]})


@pytest.fixture(scope="module")
def known() -> dict[str, Any]:
    """Answers so far, by their questions."""
    return {}


@pytest.mark.parametrize(("name", "option"), ALL)
def test_an_option_changes_the_answer_or_is_refused(
    lcat: bondline.Case, known: dict[str, Any], name: str, option: str
) -> None:
    needed = NEEDED.get(name, {})
    value = 3 if (name, option) == ("design", "sensors") else VALUES[option]
    if (name, option) == ("design", "sampling"):
        value = "9 s"
    refusals = []
    for more in CONTEXTS.get(name, [{}]):
        base = needed | more
        try:
            changed = answer(lcat, name, base | {option: value})
        except (bondline.OptionError, bondline.BondlineError) as error:
            refusals.append(str(error))
            continue
        if repr(base) not in known:
            known[repr(base)] = answer(lcat, name, base)
        if changed != known[repr(base)]:
            return
        refusals.append("")
    assert all(refusals), f"{name} takes {option}={value!r}, and its answer is the same"


def test_an_unknown_option_is_refused_with_those_that_there_are(slab: bondline.Case) -> None:
    for name in _bondline.QUESTIONS:
        with pytest.raises(bondline.OptionError, match="nope: "):
            slab._ask(bondline.Result, name, {"nope": 1}, False)


def test_options_that_are_no_part_of_a_question_say_where_they_are_given(slab: bondline.Case) -> None:
    for option in ("backend", "set", "out", "resume", "part", "piece"):
        with pytest.raises(bondline.OptionError, match=f"{option} has no effect here: "):
            slab._ask(bondline.Result, "uncertainty", {"n": 10, option: "1"}, False)


def test_defaults_are_those_of_the_library() -> None:
    for name, members in {"uncertainty": 5000, "trade": 2000, "design": 1000}.items():
        assert _bondline.options_of(name, {})["members"] == members
