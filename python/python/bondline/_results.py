"""Answers of questions."""

from __future__ import annotations

import functools
import html
import tempfile
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas
    import xarray

    from bondline import _bondline
    from bondline._case import Case

Array = NDArray[np.float64]
_Members = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]

#: The percentiles of a sweep.
PERCENTILES = (2.5, 25.0, 50.0, 75.0, 97.5)


class Result:
    """The answers of a question.

    Attributes
    ----------
    case
        The case of the question.
    """

    def __init__(self, case: Case, answers: _bondline.Answers, members: _Members | None) -> None:
        self.case = case
        self._answers = answers
        self._members = members

    @functools.cached_property
    def record(self) -> dict[str, Any]:
        """All numbers, with the names and units of the Rust library."""
        return self._answers.record()

    def summary(self) -> str:
        """The text that the command prints."""
        return self._answers.summary()

    def report(self, folder: str | PathLike[str], force: bool = False) -> Path:
        """Write the page, figures, tables and ``summary.json`` into a folder, and return the path of the page.

        Parameters
        ----------
        folder
            The folder, which is made where there is none.
        force
            Whether the report of another case may be overwritten.
        """
        files = [Path(file) for file in self._answers.report(folder, force)]
        return next((file for file in files if file.name == "report.html"), files[-1])

    def _part(self, name: str) -> dict[str, Any]:
        found = self.record[name]
        if found is None:
            raise AttributeError(f"the answers have no {name.replace('_', ' ')}")
        return dict(found)

    @property
    def traces(self) -> xarray.DataArray:
        """Temperatures at nominal factors, K: sensor × time."""
        import xarray

        nominal = self._part("nominal")
        return xarray.DataArray(
            np.array(nominal["temperatures_k"]),
            dims=("sensor", "time"),
            coords={
                "sensor": list(self.case.sensors),
                "time": ("time", np.array(nominal["instants_s"]), {"units": "s"}),
            },
            name="temperature",
            attrs={"units": "K", **self._provenance()},
        )

    def _provenance(self) -> dict[str, str]:
        run, backend = self.record["run"], self.record["backend"]
        return {
            "case": self.case.id,
            "bondline": str(run["version"]),
            "date": str(run["date"]),
            "backend": f"{backend['kind']} {backend['precision']}",
        }

    def __repr__(self) -> str:
        return f"<bondline.{type(self).__name__} of {self.case.id!r}>\n{self.summary()}"

    def _repr_html_(self) -> str:
        with tempfile.TemporaryDirectory() as folder:
            page = self.report(Path(folder) / "report")
            figures = sorted(page.parent.rglob("*.svg"), key=lambda figure: (figure.stem != "nominal", figure.stem))
            chart = figures[0].read_text(encoding="utf-8") if figures else ""
        return f"<pre style='font-family: monospace'>{html.escape(self.summary())}</pre>{chart}"


class Prediction(Result):
    """Temperatures and heat balance at nominal factors."""

    @property
    def peaks(self) -> pandas.DataFrame:
        """Peak temperature in K and its time in s, one row for each sensor."""
        import pandas

        rows = [(peak["temperature_k"], peak["time_s"]) for peak in self._part("nominal")["peaks"]]
        return pandas.DataFrame(rows, columns=["temperature_k", "time_s"], index=self._index())

    def _index(self) -> pandas.Index[Any]:
        import pandas

        return pandas.Index(self.case.sensors, name="sensor")


class Uncertainty(Prediction):
    """Distribution of the temperatures over the members of a sweep."""

    @property
    def requested(self) -> int:
        """Members of the whole sweep."""
        return int(self._part("uncertainty")["requested"])

    @property
    def completed(self) -> int:
        """Members that have completed and are counted; fewer than requested where the answer is partial."""
        return int(self._part("uncertainty")["completed"])

    @property
    def precision_reached(self) -> dict[str, Any]:
        """The percentile or probability of ``until``: its ``target``, the ``looks`` at its interval, whether it
        ``is_reached``, and the ``importance_sampling`` of a rare probability, after which there is no sweep, or the
        ``plain_reason`` why there was none.
        """
        return self._part("precision_reached")

    @property
    def percentiles(self) -> xarray.DataArray:
        """Percentiles of the temperatures, K: sensor × percentile × time."""
        import xarray

        found = self._part("uncertainty")
        return xarray.DataArray(
            np.array([spread["percentiles_k"] for spread in found["spreads"]]),
            dims=("sensor", "percentile", "time"),
            coords={
                "sensor": list(self.case.sensors),
                "percentile": list(PERCENTILES),
                "time": ("time", np.array(found["instants_s"]), {"units": "s"}),
            },
            name="temperature",
            attrs={"units": "K", **self._provenance()},
        )

    @property
    def peak_percentiles(self) -> pandas.DataFrame:
        """Percentiles of the peak temperatures, K, one row for each sensor."""
        import pandas

        rows = [peak["percentiles_k"] for peak in self._part("uncertainty")["peaks"]]
        columns = pandas.Index(list(PERCENTILES), name="percentile")
        return pandas.DataFrame(rows, columns=columns, index=self._index())

    @property
    def shares(self) -> pandas.DataFrame:
        """Shares of the variance of each sensor's peak, one column for each factor."""
        import pandas

        rows = [peak["temperature_indices"]["shares"] for peak in self._part("uncertainty")["peaks"]]
        return pandas.DataFrame(rows, columns=pandas.Index(self.case.factors, name="factor"), index=self._index())

    @property
    def members(self) -> pandas.DataFrame:
        """The members, if they were kept: factors, peak temperature of each sensor in K, and whether it completed."""
        import pandas

        factors, _, peaks, completed = self._kept()
        columns = {name: factors[:, place] for place, name in enumerate(self.case.factors)}
        columns |= {f"{name}_peak_k": peaks[:, place, 0] for place, name in enumerate(self.case.sensors)}
        index = pandas.RangeIndex(len(factors), name="member")
        return pandas.DataFrame(columns | {"completed": completed}, index=index)

    @property
    def member_traces(self) -> Array:
        """Temperatures of the members, if they were kept, K: member × sensor × instant."""
        return self._kept()[1]

    def _kept(self) -> _Members:
        if self._members is None:
            raise AttributeError("the members were not kept: ask with keep='members'")
        return self._members


class Sensitivity(Prediction):
    """Derivatives of the temperatures with respect to the factors."""

    @property
    def derivatives(self) -> xarray.DataArray:
        """Derivatives of the temperatures by the factors, K: factor × sensor × time."""
        import xarray

        found = self._part("sensitivity")
        return xarray.DataArray(
            np.array(found["derivatives_k"]),
            dims=("factor", "sensor", "time"),
            coords={
                "factor": list(self.case.factors),
                "sensor": list(self.case.sensors),
                "time": ("time", np.array(self._part("nominal")["instants_s"]), {"units": "s"}),
            },
            name="derivative",
            attrs={"units": "K", **self._provenance()},
        )


class Estimate(Prediction):
    """Factors fitted to observations."""

    @property
    def names(self) -> list[str]:
        """Names of the estimated factors."""
        return [str(estimand["factor"]["name"]) for estimand in self._part("estimated")["factors"]]

    @property
    def values(self) -> Array:
        """The estimates, in the order of :attr:`names`."""
        return np.array(self._part("estimated")["values"], dtype=float)

    @property
    def converged(self) -> bool:
        """Whether the minimisation ended at a minimum."""
        return bool(self._part("estimated")["converged"])

    @property
    def table(self) -> pandas.DataFrame:
        """Estimate, standard error and 95 % interval of each factor; they allow for correlated noise and for the
        discretisation error of the march."""
        import pandas

        found = self._part("estimated")
        low, high = zip(*found["intervals"], strict=True)
        columns = {"estimate": found["values"], "standard_error": found["standard_errors"], "low": low, "high": high}
        return pandas.DataFrame(columns, index=pandas.Index(self.names, name="factor"), dtype=float)

    @property
    def draws(self) -> pandas.DataFrame:
        """Draws from the posterior, one column for each factor.

        At most two thousand, spread over walkers and iterations.
        """
        import pandas

        return pandas.DataFrame(self._part("posterior")["draws"], columns=self.names)

    def to_arviz(self) -> Any:
        """The draws as ``arviz.InferenceData``: a chain for each walker, with its draws in the order of the iterations.

        Draws are thinned, so that an effective sample size from them is at most that of :meth:`summary`.
        """
        import arviz

        walkers = int(self._part("posterior")["walkers"]["number"])
        # Draws alternate between the walkers.
        draws = self.draws.iloc[: len(self.draws) // walkers * walkers]
        return arviz.from_dict(
            posterior={name: draws[name].to_numpy().reshape(-1, walkers).T for name in self.names}
        )


class Study(Uncertainty, Sensitivity, Estimate):
    """Prediction, uncertainty, sensitivity and estimate."""


class Sizing(Prediction):
    """The thickness of a ply that holds a temperature limit."""


class Trade(Prediction):
    """Layups by the mass per area that holds a temperature limit."""

    @property
    def layups(self) -> pandas.DataFrame:
        """The layups by rank, with a column for the material of each choice; those without a rank are last.

        Masses in kg/m², thicknesses in m; NaN where no allowed thickness suffices.
        """
        import pandas

        found = self._part("trade")
        choices = found["request"]["choices"]
        rows = []
        for layup in found["layups"]:
            row = {ply: ids[at] for (ply, ids), at in zip(choices, layup["candidates"], strict=True)}
            rank, required = layup["rank"], layup["required"]
            resampled = (rank or {}).get("resampled")
            thickness = required.get("At", required.get("AtMost", np.nan))
            row |= {
                "rank": rank["rank"] if rank else np.nan,
                "mass_kg_m2": layup["fixed_mass_kg_m2"] + layup["density_kg_m3"] * thickness,
                "thickness_m": thickness,
                "rank_low": resampled["interval"][0] if resampled else np.nan,
                "rank_high": resampled["interval"][1] if resampled else np.nan,
                "first_share": resampled["first_share"] if resampled else np.nan,
            }
            rows.append(row)
        return pandas.DataFrame(rows)

    @property
    def rank_changes(self) -> list[dict[str, Any]]:
        """How far each property would have to change for another layup to come first, the likeliest change first."""
        return list(self._part("trade")["rank_changes"] or [])


class Design(Prediction):
    """The depths of thermocouples from which factors are estimated best."""

    @property
    def depths_m(self) -> Array:
        """The depths of the best design, m."""
        best = self._part("experiment_design")["scenarios"][0]
        return np.array([best["candidates"][index]["depth_m"] for index in best["designs"][0]["candidates"]])

    @property
    def standard_errors(self) -> dict[str, float]:
        """The expected standard error of each factor."""
        found = self._part("experiment_design")
        errors = found["scenarios"][0]["designs"][0]["standard_errors"]
        return dict(zip(found["request"]["question"]["estimate"], errors, strict=True))


class History(Prediction):
    """The heating of the hot face over time."""


class ObservationCheck(Result):
    """What was read of the measured data."""


class Coverage(Prediction):
    """How often the intervals of estimates contain the truth."""

    @property
    def table(self) -> pandas.DataFrame:
        """Bias, root mean square error and mean half-width of the intervals of each factor; ``covered`` of ``total``
        intervals contain the truth."""
        import pandas

        found = self._part("coverage_study")["factors"]
        rows = [
            [factor[name] for name in ("bias", "rms", "half_width")]
            + [factor["covered"][name] for name in ("count", "total")]
            for factor in found
        ]
        index = pandas.Index([str(factor["name"]) for factor in found], name="factor")
        return pandas.DataFrame(rows, columns=["bias", "rms", "half_width", "covered", "total"], index=index)
