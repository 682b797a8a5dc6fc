"""Cases from files, text and Python values."""

import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bondline
import numpy as np
import pandas
import pytest
from conftest import CASES

STATED = {"mark": "estimated", "source": "a test", "uncertainty": "10 %"}
MATERIAL = {
    "name": "Mine",
    "density": {"value": "200 kg/m^3"} | STATED,
    "heat_capacity": {"value": "900 J/kg/K"} | STATED,
    "conductivity": {"value": "0.04 W/m/K"} | STATED,
    "emissivity": {"value": 0.9} | STATED,
}


def content() -> dict[str, Any]:
    """A case that refers to a material in memory."""
    return {
        "initial_temperature": "300 K",
        "duration": "60 s",
        "ply": [{"name": "A", "material": "pyrogel3350", "thickness": "3 mm"}],
        "sensor": [{"name": "BACK", "below": "A"}],
        "hot_face": {"kind": "heated", "flux": "5 kW/m^2"},
        "back_face": {"kind": "insulated"},
        "factor": [
            {
                "name": "f_k",
                "group": "A",
                "property": "conductivity",
                "small": [0.9, 1.1],
                "large": [0.5, 1.5],
            }
        ],
    }


def test_a_case_from_values_marches_as_the_same_case_from_text() -> None:
    written = """
        initial_temperature = "300 K"
        duration = "60 s"
        ply = [{ name = "A", material = "pyrogel3350", thickness = "3 mm" }]
        sensor = [{ name = "BACK", below = "A" }]
        hot_face = { kind = "heated", flux = "5 kW/m^2" }
        back_face = { kind = "insulated" }
        [[factor]]
        name = "f_k"
        group = "A"
        property = "conductivity"
        small = [0.9, 1.1]
        large = [0.5, 1.5]
    """
    one, other = bondline.Case.from_dict(content()), bondline.Case.from_toml(written)
    assert np.array_equal(one.march([[1.05]]), other.march([[1.05]]))
    assert not np.array_equal(one.march([[1.05]]), other.march([[1.06]]))


def test_a_material_of_a_case_may_be_in_memory() -> None:
    values = content()
    values["ply"][0]["material"] = "mine"
    one = bondline.Case.from_dict(values, materials={"mine": MATERIAL})
    other = bondline.Case.from_dict(
        values, materials={"mine": MATERIAL | {"density": {"value": "210 kg/m^3"} | STATED}}
    )
    assert one.march([[1.0]])[0, 0, -1] > other.march([[1.0]])[0, 0, -1] > 300.0
    with pytest.raises(bondline.CaseError, match="mine"):
        bondline.Case.from_dict(values)


@pytest.mark.parametrize("name", ["pyrogel3350", "nextel440-bf20", "nextel440_bf20", "saffil-96"])
def test_a_material_in_memory_wins_over_one_of_the_database(name: str) -> None:
    values = content()
    values["ply"][0]["material"] = name
    found = bondline.Case.from_dict(values, materials={name: MATERIAL})
    built_in = bondline.Case.from_dict(values)
    assert not np.array_equal(found.march([[1.0]]), built_in.march([[1.0]]))
    values["ply"][0]["material"] = "mine"
    mine = bondline.Case.from_dict(values, materials={"mine": MATERIAL})
    assert np.array_equal(found.march([[1.0]]), mine.march([[1.0]]))


def test_quantities_of_pint_and_arrays_of_numpy_are_values_of_a_case() -> None:
    pint = pytest.importorskip("pint")
    unit = pint.UnitRegistry()
    values = content()
    values["ply"][0]["thickness"] = 3000 * unit.um
    values["hot_face"]["flux"] = unit.Quantity(0.5, "W/cm**2")
    values["factor"][0]["small"] = np.array([0.9, 1.1])
    same = bondline.Case.from_dict(values).march([[1.0]])
    assert np.array_equal(same, bondline.Case.from_dict(content()).march([[1.0]]))


def test_observations_of_a_data_frame_are_fitted_and_gaps_are_left_out() -> None:
    truth = bondline.Case.from_dict(content())
    times_s = truth.instants_s()
    readings_k = truth.march([[1.08]])[0, 0]
    readings_k[3] = np.nan
    frame = pandas.DataFrame({"BACK": readings_k}, index=times_s)
    values = content() | {"observations": {"sigma": "0.5 K"}, "estimate": {"factors": ["f_k"]}}
    case = bondline.Case.from_dict(values, observations=frame)
    found = case.estimate()
    assert found.values == pytest.approx([1.08], abs=1e-4)
    assert found.record["estimated"]["samples"] == len(times_s) - 1
    low, high = found.table[["low", "high"]].to_numpy()[0]
    assert low <= 1.08 <= high


def test_a_changed_case_marches_as_a_case_that_was_written_so(slab: bondline.Case) -> None:
    changed = slab.with_({"ply.SLAB.thickness": "12 mm"}, f_k=1.1)
    assert changed.nominal.tolist() == [1.1, 1.0]
    assert slab.nominal.tolist() == [1.0, 1.0]
    text = (CASES / "slab" / "case.toml").read_text().replace('"10 mm"', '"12 mm"')
    text = text.replace('name = "f_k"', 'name = "f_k"\nnominal = 1.1')
    names = ["exact.csv", "materials/constant.toml"]
    files = {name: (CASES / "slab" / name).read_text() for name in names}
    written = bondline.Case.from_toml(text, files).on(backend="cpu")
    assert np.array_equal(changed.march([[1.1, 1.0]]), written.march([[1.1, 1.0]]))


def test_every_error_of_a_case_is_a_line_of_one_exception(tmp_path: Path) -> None:
    values = content()
    values["duration"] = "60 parsecs"
    values["ply"][0]["thickness"] = "-3 mm"
    with pytest.raises(bondline.CaseError) as raised:
        bondline.Case.from_dict(values)
    duration, thickness, count = str(raised.value).splitlines()
    assert "parsecs" in duration and 'duration = "60 parsecs"' in duration
    assert "above 0" in thickness and 'thickness = "-3 mm"' in thickness
    assert count == "2 errors"
    with pytest.raises(bondline.CaseError, match="no such file"):
        bondline.Case.load(tmp_path / "none")


def test_a_wrong_option_is_named(slab: bondline.Case) -> None:
    with pytest.raises(bondline.OptionError, match='no factor is called "f_nope"; there are f_k, f_cp'):
        slab.estimate(factors=["f_nope"])
    with pytest.raises(bondline.OptionError, match="nope: estimate has no such option; it has"):
        slab.estimate(nope=1)
    with pytest.raises(bondline.OptionError, match="at least 2 members"):
        slab.uncertainty(n=1)


def test_names_of_a_case_cannot_be_changed_by_accident(slab: bondline.Case) -> None:
    for names in (slab.sensors, slab.factors, slab.estimated, slab.notes):
        assert isinstance(names, tuple)


def test_a_data_frame_goes_by_the_names_of_its_columns_and_other_names_are_refused(slab: bondline.Case) -> None:
    x = np.array([[1.05, 0.97], [0.95, 1.02]])
    frame = pandas.DataFrame(x, columns=list(slab.estimated))
    turned = frame[frame.columns[::-1]]
    assert np.array_equal(slab.march(turned), slab.march(x))
    assert np.array_equal(slab.residuals(turned), slab.residuals(x))
    assert np.array_equal(slab.log_prob(turned), slab.log_prob(x))
    assert np.array_equal(slab.jacobian(turned[:1]), slab.jacobian(x[0]))
    fitted: list[Callable[..., Any]] = [slab.residuals, slab.log_prob, slab.jacobian]
    for function in fitted:
        with pytest.raises(ValueError, match="expected the columns f_k, f_cp, found f_k"):
            function(frame[["f_k"]])
    twice = pandas.concat([frame, frame[["f_k"]]], axis=1)
    array = pytest.importorskip("xarray").DataArray(x, dims=("member", "factor"))
    marched: list[Callable[..., Any]] = [slab.march, slab.peaks, slab.tangents]
    for function in marched + fitted:
        with pytest.raises(ValueError, match="two columns have one name"):
            function(twice)
        for named in (array, frame.iloc[0]):
            with pytest.raises(TypeError, match="expected a data frame whose columns are factors, or an array"):
                function(named)


def test_the_chains_of_arviz_are_the_walkers(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}
    arviz = types.ModuleType("arviz")
    arviz.from_dict = lambda posterior: given.update(posterior)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "arviz", arviz)
    case = bondline.Case.load(CASES / "lamp-test").on(backend="cpu")
    found = case.estimate(posterior=True, walkers=32, mcmc_iterations=60, seed=1)
    found.to_arviz()
    for place, name in enumerate(found.names):
        chains = given[name]
        assert chains.shape == (32, len(found.draws) // 32)
        # The stored traces have every iteration of some walkers.
        traces = found.record["posterior"]["chains"]
        for walker, trace in zip(traces["walkers"], traces["values"][place], strict=True):
            assert np.isin(chains[walker], trace).all()
            assert not np.isin(chains[walker - 1], trace).all()


def test_a_rare_probability_is_sampled_until_its_interval_is_narrow() -> None:
    case = bondline.Case.load(CASES / "slab")
    found = case.uncertainty(n=100_000, until="P(BACK > 770 K) ± 20 %").precision_reached
    last = found["looks"][-1]
    assert found["is_reached"] and found["importance"] is not None
    assert last["low"] < 8.805e-4 < last["high"]  # of 40 million members of the exact solution
    with pytest.raises(ValueError, match="keep"):
        case.uncertainty(keep="members", until="BACK P90 ± 2 K")


def test_a_trade_study_ranks_layups_by_mass() -> None:
    case = bondline.Case.load(CASES / "lcat-2259")
    choices = {"OF": ["nextel440-bf20"], "INS": ["pyrogel3350", "saffil-96"]}
    found = case.trade(choices, size="INS", limit="TC4 < 700 K", n=60, probability=0.9)
    layups = found.layups
    assert list(layups["INS"]) == ["pyrogel3350", "saffil_96"] and list(layups["rank"]) == [1, 2]
    sized = case.size(ply="INS", limit="TC4 < 700 K", n=60, probability=0.9).record["sizing"]
    assert layups["thickness_m"][0] == sized["required"]["At"]
    assert {change["material"] for change in found.rank_changes} >= {"pyrogel3350"}
    both = case.trade(choices, "INS", "TC4 < 700 K", n=60, exposures=[CASES / "lcat-2330"], probability=0.9)
    assert (both.layups["mass_kg_m2"] >= layups["mass_kg_m2"] - 1e-4).all()
    with pytest.raises(bondline.OptionError, match="named twice"):
        case.trade({"INS": ["apa", "apa"]}, size="INS", limit="TC4 < 700 K")


def test_a_design_has_its_depths_and_expected_errors() -> None:
    case = bondline.Case.load(CASES / "slab")
    found = case.design(["f_k", "f_cp"], sensors=2, n=20, noise="1 K")
    assert len(found.depths_m) == 2 and list(found.standard_errors) == ["f_k", "f_cp"]
    double = case.design(["f_k", "f_cp"], sensors=2, n=20, noise="2 K")
    assert np.isclose(double.standard_errors["f_k"], 2.0 * found.standard_errors["f_k"])
