"""Marches and derivatives as arrays, and their use by SciPy."""

import bondline
import numpy as np
import pandas
import pytest
from conftest import CASES
from scipy.optimize import least_squares


def test_members_are_the_exact_solution_of_a_slab(slab: bondline.Case) -> None:
    temperatures_k = slab.march([[1.0, 1.0], [1.0, 1.1]])
    assert temperatures_k.shape == (2, len(slab.sensors), len(slab.instants_s()))
    # Once the profile is steady, all of it rises at the flux over the heat capacity of the slab.
    rise_k = temperatures_k[:, :, -1] - temperatures_k[:, :, -51]
    assert rise_k[0] == pytest.approx(rise_k[0, 0], rel=1e-3)
    assert rise_k[0] / rise_k[1] == pytest.approx(1.1, rel=1e-3)


def test_a_data_frame_names_its_factors_and_the_others_are_nominal(slab: bondline.Case) -> None:
    frame = pandas.DataFrame({"f_cp": [0.9, 1.1]})
    assert np.array_equal(slab.march(frame), slab.march([[1.0, 0.9], [1.0, 1.1]]))
    with pytest.raises(bondline.OptionError, match="no factor is called 'f_cq'; there are f_k, f_cp"):
        slab.march(frame.rename(columns={"f_cp": "f_cq"}))


def test_points_of_a_wrong_shape_are_refused_by_name(slab: bondline.Case) -> None:
    with pytest.raises(ValueError, match=r"2 factors \(f_k, f_cp\), found 2 × 3"):
        slab.march(np.ones((2, 3)))
    with pytest.raises(ValueError, match=r"points\[1, 0\] is NaN: expected finite numbers"):
        slab.march([[1.0, 1.0], [np.nan, 1.0]])


def test_peaks_do_not_depend_on_the_instants(slab: bondline.Case) -> None:
    # The front face falls once the flux ends, between two instants.
    points = "[['0 s', '2 kW/m^2'], ['123.4 s', '2 kW/m^2'], ['123.4 s', '0 W/m^2']]"
    flux = {"hot_face.flux": "{points = " + points + ", outside = 'zero'}"}
    pulsed = [slab.with_(flux | {"resolution.output_interval": f"{every} s"}) for every in (1, 100)]
    front = slab.sensors.index("FACE")
    (fine_k, fine_s), (rough_k, rough_s) = (case.peaks([[1.0, 1.0], [1.0, 1.1]]) for case in pulsed)
    assert fine_k.shape == (2, len(slab.sensors))
    assert rough_k == pytest.approx(fine_k, abs=0.1)
    assert fine_s[:, front] == pytest.approx(123.4) and rough_s[:, front] == pytest.approx(123.4)
    assert pulsed[1].march([[1.0, 1.0]])[0, front].max() < rough_k[0, front] - 1.0


def test_derivatives_agree_with_differences(slab: bondline.Case) -> None:
    step = 1e-5
    at, slopes = slab.tangents([[1.0, 1.0]])
    assert slopes.shape == (1, 2, *at.shape[1:])
    around = slab.march([[1.0 - step, 1.0], [1.0 + step, 1.0], [1.0, 1.0 - step], [1.0, 1.0 + step]])
    differences = (around[1::2] - around[::2]) / (2 * step)
    assert np.abs(slopes[0] - differences).max() < 1e-4 * np.abs(slopes).max()
    assert np.abs(slopes[0] - 1.01 * differences).max() > 1e-4 * np.abs(slopes).max()


def test_scipy_finds_the_estimate_of_the_command(slab: bondline.Case) -> None:
    found = least_squares(slab.residuals, [1.2, 0.8], jac=slab.jacobian, bounds=slab.bounds, xtol=1e-12)
    assert found.x == pytest.approx(slab.estimate().values, abs=5e-6)


def test_the_density_of_the_posterior_is_zero_outside_the_bounds(slab: bondline.Case) -> None:
    low, high = slab.bounds
    inside, outside = np.asarray(slab.log_prob(np.array([(low + high) / 2, high + 0.01])))
    residuals = slab.residuals((low + high) / 2)
    assert inside == pytest.approx(-0.5 * np.sum(residuals**2))
    assert outside == -np.inf


def test_members_of_a_sweep_have_the_percentiles_of_the_answer(slab: bondline.Case) -> None:
    found = slab.uncertainty(n=400, seed=3, keep="members")
    assert np.array_equal(found.member_traces, slab.march(found.members[list(slab.factors)]))
    median = found.percentiles.sel(percentile=50.0)
    assert np.abs(np.median(found.member_traces, axis=0) - median.to_numpy()).max() < 2.0
    assert found.members["completed"].all()
    assert found.shares.sum(axis=1).to_numpy() == pytest.approx(1.0, abs=0.05)
    with pytest.raises(AttributeError, match="keep='members'"):
        slab.uncertainty(n=10).members


def test_traces_have_names_units_and_their_origin(slab: bondline.Case) -> None:
    traces = slab.predict().traces
    assert traces.dims == ("sensor", "time")
    assert traces.attrs["units"] == "K" and traces.attrs["case"] == "slab"
    assert traces.sel(sensor="BACK").to_numpy()[0] == 300.0


def test_a_result_shows_a_table_and_a_chart(slab: bondline.Case) -> None:
    shown = slab.predict()._repr_html_()
    assert "BACK" in shown and "<svg" in shown


def test_a_shipped_case_with_a_posterior_gives_its_draws() -> None:
    case = bondline.Case.load(CASES / "slab").on(backend="cpu")
    found = case.estimate(factors=["f_k", "f_cp"], posterior=True, walkers=24, mcmc_iterations=100)
    assert list(found.draws.columns) == ["f_k", "f_cp"]
    assert found.draws["f_cp"].mean() == pytest.approx(found.values[1], abs=0.01)
