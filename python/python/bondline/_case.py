"""Cases, and the questions about them."""

from __future__ import annotations

import functools
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondline import _bondline
from bondline._options import content, question, text
from bondline._results import (
    Coverage,
    Design,
    Estimate,
    History,
    ObservationCheck,
    Prediction,
    Result,
    Sensitivity,
    Sizing,
    Study,
    Trade,
    Uncertainty,
)
from bondline._source import Disk, Memory

if TYPE_CHECKING:
    import pandas

Array = NDArray[np.float64]
#: ``True`` for a bar on standard error, or a function of the members marched and of their number.
ProgressOption = bool | Callable[[int, int | None], object]

_R = TypeVar("_R", bound=Result)


class Case:
    """A validated case: plies, sensors, exposure, factors and observations.

    A case does not change. Use :meth:`load`, :meth:`from_toml` or :meth:`from_dict` to make one, and :meth:`with_` for
    one with other values.
    """

    def __init__(self, core: _bondline.Case, source: Disk | Memory) -> None:
        self._core = core
        self._source = source
        self._overrides: dict[str, str] = {}
        self._session: dict[str, str] = {}

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Case:
        """Read a case from its file, or from a folder with a ``case.toml``.

        Raises
        ------
        CaseError
            The file, or a file that it names, has errors; the message has a line for each of them.
        """
        return cls._read(Disk(path))

    @classmethod
    def from_toml(cls, text: str, files: Mapping[str, str | bytes] | None = None, id: str = "case") -> Case:
        """Make a case from the text of a case file.

        Parameters
        ----------
        text
            The case file.
        files
            Contents of the files that it names, by path; files on disk are not read.
        id
            Name of the case in messages and reports.
        """
        contents = {
            path: content.encode() if isinstance(content, str) else content for path, content in (files or {}).items()
        }
        return cls._read(Memory(text, id, contents))

    @classmethod
    def from_dict(
        cls,
        case: Mapping[str, Any],
        materials: Mapping[str, Mapping[str, Any]] | None = None,
        observations: pandas.DataFrame | None = None,
        files: Mapping[str, str | bytes] | None = None,
        id: str = "case",
    ) -> Case:
        """Make a case from values with the keys of a case file.

        Parameters
        ----------
        case
            Content of the case file; a value is a number, a text with a unit, a pint quantity, or an array.
        materials
            Contents of material files by name: ``material = "mine"`` in a ply is ``materials["mine"]``.
        observations
            Measured temperatures, K: one column a sensor, with its name, and the times in s as index. ``nan`` is a gap.
        files
            Contents of further files that the case names, by path.
        id
            Name of the case in messages and reports.
        """
        found: dict[str, str | bytes] = dict(files or {})
        root = content(case)
        for name, material in (materials or {}).items():
            path = f"materials/{name}.toml"
            if path in found:
                raise ValueError(f"materials: {name!r} is stated twice: files has {path!r} too")
            found[path] = _bondline.to_toml(content(material, f"materials.{name}"))
        if observations is not None:
            stated = root.get("observations", {})
            if "observations.csv" in found or isinstance(stated, Mapping) and "file" in stated:
                raise ValueError("observations: they are stated twice: as a data frame and as a file")
            columns = observations.rename(columns=lambda name: f"{name}_k")
            found["observations.csv"] = columns.to_csv(index_label="time_s")
            root.setdefault("observations", {})["file"] = "observations.csv"
        text = _bondline.to_toml(root)
        try:
            return cls.from_toml(text, found, id)
        except _bondline.CaseError as error:
            raise _bondline.CaseError(_with_lines(str(error), id, text)) from None

    @classmethod
    def _read(cls, source: Disk | Memory) -> Case:
        return cls(source.read([]), source)

    def __reduce__(self) -> tuple[Any, ...]:
        source, mark = self._source.in_memory(self._core), self._core.fingerprint()
        return _unpickled, (source, self._overrides, self._session, mark)

    def with_(self, changes: Mapping[str, object] | None = None, **more: object) -> Case:
        """The case with other values.

        Parameters
        ----------
        changes, more
            New values by factor, whose nominal value is set, or by key of the case file, such as ``pressure="3 kPa"``
            or ``{"ply.OF1.thickness": "3 mm"}``.
        """
        for name in more:
            if name in (changes or {}):
                raise _bondline.OptionError(f"{name} is stated twice: in changes and as a keyword")
        overrides = self._overrides | {
            name: text(value) for name, value in ({**(changes or {})} | more).items()
        }
        found = Case(self._source.read(list(overrides.items())), self._source)
        found._overrides, found._session = overrides, self._session
        return found

    def on(
        self, backend: str | None = None, precision: str | None = None, device: str | None = None
    ) -> Case:
        """The case with another backend (``"auto"``, ``"cpu"``, ``"gpu"``), precision (``"f32"``, ``"f64"``) or device.

        Parameters
        ----------
        backend
            Where members are marched.
        precision
            Floating-point precision; f64 on the processor and f32 on a device by default.
        device
            Part of the name of a Vulkan device.
        """
        given = {"backend": backend, "precision": precision, "device": device}
        found = Case(self._core, self._source)
        found._overrides = self._overrides
        found._session = self._session | {name: value for name, value in given.items() if value is not None}
        return found

    @functools.cached_property
    def _content(self) -> dict[str, Any]:
        return self._core.content()

    @property
    def id(self) -> str:
        """Name of the folder or file."""
        return str(self._content["id"])

    @property
    def name(self) -> str:
        """Title given by the analyst."""
        return str(self._content["name"])

    @property
    def notes(self) -> tuple[str, ...]:
        """What the files hold and the case does not use, one sentence each."""
        return tuple(self._core.notes())

    @functools.cached_property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors."""
        return tuple(str(sensor["name"]) for sensor in self._content["sensors"])

    @functools.cached_property
    def factors(self) -> tuple[str, ...]:
        """Names of the factors, in the order of the columns of :meth:`march`."""
        return tuple(str(factor["name"]) for factor in self._content["factors"])

    @property
    def nominal(self) -> Array:
        """Nominal values of the factors."""
        return np.array([factor["nominal"] for factor in self._content["factors"]], dtype=float)

    @functools.cached_property
    def estimated(self) -> tuple[str, ...]:
        """Names of the factors that :meth:`residuals` and :meth:`estimate` vary."""
        return tuple(self.factors[place] for place in self._content["estimate"]["factors"])

    @property
    def nominal_estimated(self) -> Array:
        """Nominal values of :attr:`estimated`: a start for minimisers and samplers."""
        return self.nominal[[self.factors.index(name) for name in self.estimated]]

    @property
    def has_observations(self) -> bool:
        """Whether there are samples to compare with."""
        return bool(self._core.samples(self._session))

    @property
    def ndim(self) -> int:
        """Number of factors that :meth:`residuals` varies."""
        return len(self.estimated)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the estimated factors: those that the case estimates within."""
        kind = str(self._content["estimate"]["bounds"]).lower()
        both = [self._factor(name)[kind] for name in self.estimated]
        return np.array([low for low, _ in both], dtype=float), np.array([high for _, high in both], dtype=float)

    def salib_problem(self, bounds: str = "small") -> dict[str, Any]:
        """The factors as a problem of SALib: uniform between their small or large bounds."""
        if bounds not in ("small", "large"):
            raise ValueError(f"bounds: expected 'small' or 'large', found {bounds!r}")
        return {
            "num_vars": len(self.factors),
            "names": list(self.factors),
            "bounds": [list(self._factor(name)[bounds]) for name in self.factors],
        }

    def _factor(self, name: str) -> dict[str, Any]:
        found: dict[str, Any] = self._content["factors"][self.factors.index(name)]
        return found

    def instants_s(self) -> Array:
        """Instants of all traces, s."""
        return self._core.instants_s(self._session)

    def march(self, points: ArrayLike | pandas.DataFrame, progress: ProgressOption = False) -> Array:
        """Temperatures of members with stated values of the factors.

        Parameters
        ----------
        points
            A row for each member, with a value for each factor; or a data frame, whose columns are factors and in which
            factors that are missing are nominal.
        progress
            Whether to show the progress, or a function of the members marched and of their number.

        Returns
        -------
        numpy.ndarray
            Temperatures, K: member × sensor × instant. A member that fails has ``nan``.
        """
        return self._march(points, progress)[0]

    def _march(self, points: ArrayLike | pandas.DataFrame, progress: ProgressOption = False) -> tuple[Array, Array]:
        """Temperatures, and peaks: member × sensor × (temperature, time)."""
        return self._core.march(self._points(points), self._session, _report(progress))

    def peaks(
        self, points: ArrayLike | pandas.DataFrame, progress: ProgressOption = False
    ) -> tuple[Array, Array]:
        """Peaks of members with stated values of the factors, over the whole march, whatever the output instants.

        Parameters
        ----------
        points
            As in :meth:`march`.
        progress
            As in :meth:`march`.

        Returns
        -------
        tuple of numpy.ndarray
            Highest temperatures, K, and their times, s: member × sensor. A member that fails has ``nan``.
        """
        found = self._core.peaks(self._points(points), self._session, _report(progress))
        return found[..., 0], found[..., 1]

    def tangents(
        self,
        points: ArrayLike | pandas.DataFrame,
        factors: Iterable[str] | None = None,
        progress: ProgressOption = False,
    ) -> tuple[Array, Array]:
        """Temperatures of members, and their exact derivatives with respect to factors.

        Parameters
        ----------
        points
            As in :meth:`march`.
        factors
            Names of the factors to differentiate by; by default all.
        progress
            As in :meth:`march`.

        Returns
        -------
        tuple of numpy.ndarray
            Temperatures, K: member × sensor × instant; derivatives, K: member × factor × sensor × instant.
        """
        both, _ = self._tangents(points, factors, progress)
        return both[:, 0], both[:, 1:]

    def _tangents(
        self,
        points: ArrayLike | pandas.DataFrame,
        factors: Iterable[str] | None = None,
        progress: ProgressOption = False,
    ) -> tuple[Array, Array]:
        """Temperatures, and peaks, each of a member and its derivatives."""
        chosen = self.factors if factors is None else list(factors)
        places = [self._place(name) for name in chosen]
        return self._core.tangents(self._points(points), places, self._session, _report(progress))

    def _place(self, name: str) -> int:
        if name not in self.factors:
            raise _bondline.OptionError(f"no factor is called {name!r}; there are {', '.join(self.factors)}")
        return self.factors.index(name)

    def _points(self, points: ArrayLike | pandas.DataFrame) -> Array:
        count = len(self.factors)
        named = _named_columns("points", points)
        if named is not None:
            rows = len(next(iter(named.values()), ()))
            found = np.tile(self.nominal, (rows, 1))
            for name, column in named.items():
                found[:, self._place(name)] = column
            return found
        found = np.ascontiguousarray(points, dtype=np.float64)
        if found.ndim != 2 or found.shape[1] != count:
            shape = " × ".join(str(length) for length in found.shape) or "a single number"
            raise ValueError(
                f"points: expected member × factor with {count} factors ({', '.join(self.factors)}), found {shape}"
            )
        return found

    @functools.cached_property
    def _samples(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Array, Array]:
        samples = self._core.samples(self._session)
        if not samples:
            raise _bondline.OptionError("the case has no observations to compare with")
        sensors, instants, measured_k, sigma_k = zip(*samples, strict=True)
        return np.array(sensors), np.array(instants), np.array(measured_k), np.array(sigma_k)

    def _estimated_values(self, x: ArrayLike | pandas.DataFrame) -> Array:
        """Values of the estimated factors, member × factor: those of a data frame by the names of its columns."""
        named = _named_columns("x", x)
        if named is not None:
            if set(named) != set(self.estimated):
                raise ValueError(f"x: expected the columns {', '.join(self.estimated)}, found {', '.join(named)}")
            return np.column_stack([named[name] for name in self.estimated])
        values = np.atleast_2d(np.asarray(x, dtype=np.float64))
        if values.ndim != 2 or values.shape[-1] != self.ndim:
            shape = " × ".join(str(length) for length in values.shape)
            raise ValueError(f"x: expected {self.ndim} values ({', '.join(self.estimated)}), found {shape}")
        return values

    def _rows(self, x: ArrayLike | pandas.DataFrame) -> Array:
        values = self._estimated_values(x)
        rows = np.tile(self.nominal, (len(values), 1))
        rows[:, [self.factors.index(name) for name in self.estimated]] = values
        return rows

    def residuals(self, x: ArrayLike | pandas.DataFrame) -> Array:
        """Predicted minus measured temperatures over their standard deviations, for values of the estimated factors.

        Parameters
        ----------
        x
            A value for each of :attr:`estimated`, or a row of them for each member, or a data frame with these columns.

        Returns
        -------
        numpy.ndarray
            A residual for each sample, or member × sample.
        """
        sensors, instants, measured_k, sigma_k = self._samples
        temperatures_k = self.march(self._rows(x))
        found: Array = (temperatures_k[:, sensors, instants] - measured_k) / sigma_k
        return found if np.ndim(x) == 2 else found[0]

    def jacobian(self, x: ArrayLike) -> Array:
        """Exact derivatives of :meth:`residuals` at one point: sample × estimated factor."""
        sensors, instants, _, sigma_k = self._samples
        rows = self._rows(x)
        if len(rows) != 1:
            raise ValueError(f"x: expected one point, found {len(rows)}: tangents takes several")
        _, slopes_k = self.tangents(rows, self.estimated)
        found: Array = (slopes_k[0][:, sensors, instants] / sigma_k).T
        return found

    def log_prob(self, x: ArrayLike | pandas.DataFrame) -> Array | float:
        """Logarithm of the posterior density, but for a constant: independent normal noise, and a uniform prior between
        :attr:`bounds`.

        Parameters
        ----------
        x
            A value for each of :attr:`estimated`, or a row of them for each member, or a data frame with these columns.

        Returns
        -------
        float or numpy.ndarray
            One number, or one for each row; minus infinity outside the bounds.
        """
        rows = self._estimated_values(x)
        low, high = self.bounds
        inside = np.all((rows >= low) & (rows <= high), axis=1)
        found = np.full(len(rows), -np.inf)
        if inside.any():
            squares = np.sum(self.residuals(rows[inside]) ** 2, axis=1)
            found[inside] = np.where(np.isfinite(squares), -0.5 * squares, -np.inf)
        return found if np.ndim(x) == 2 else float(found[0])

    def predict(self, progress: ProgressOption = False, **options: object) -> Prediction:
        """Temperatures and heat balance at nominal factors, compared with the observations.

        Options are those of the command ``bondline predict``: ``depth_profiles=["10s", "40s"]``.
        """
        return self._ask(Prediction, "predict", options, progress)

    def uncertainty(
        self, n: int | None = None, keep: str | None = None, progress: ProgressOption = False, **options: object
    ) -> Uncertainty:
        """A Monte Carlo sweep over the factors.

        Parameters
        ----------
        n
            Number of members; by default that of the command.
        keep
            ``"members"`` keeps factors and temperatures of all members.
        progress
            As in :meth:`march`.
        options
            Options of the command ``bondline uncertainty``: ``seed``, ``sampling``, ``sampling_bounds``,
            ``depth_profiles``, and ``until``, such as ``"TC4 P99 ± 2 K"`` or ``"P(TC4 > 623 K) ± 10 %"``, which draws
            at most ``n`` members: :attr:`Uncertainty.precision_reached`.
        """
        if keep not in (None, "members"):
            raise ValueError(f"keep: expected 'members' or None, found {keep!r}")
        if keep is not None and options.get("until") is not None:
            raise ValueError("keep: members are not kept with until")
        return self._ask(Uncertainty, "uncertainty", options, progress, keep is not None, members=n)

    def sensitivity(self, progress: ProgressOption = False, **options: object) -> Sensitivity:
        """Derivatives with respect to the factors, and which factors can be estimated together.

        Options are those of the command ``bondline sensitivity``: ``method``, ``step``, ``sensors``, ``window``.
        """
        return self._ask(Sensitivity, "sensitivity", options, progress)

    def estimate(self, progress: ProgressOption = False, **options: object) -> Estimate:
        """Factors fitted to the observations by least squares, with 95 % confidence intervals.

        Options are those of the command ``bondline estimate``: ``factors=["f_k_INS"]``, ``start={"f_k_INS": 1.2}``,
        ``bounds``, ``sensors``, ``window=(0, 80)``, ``loss``, ``prior``, ``starts``, ``profile``, ``posterior=True``,
        ``seed``, ``compare="cases/other"``, ``others=["cases/second"]`` and others.
        """
        return self._ask(Estimate, "estimate", options, progress)

    def study(self, n: int | None = None, progress: ProgressOption = False, **options: object) -> Study:
        """Prediction, uncertainty, sensitivity, and an estimate where there are observations."""
        return self._ask(Study, "study", options, progress, members=n)

    def size(
        self,
        ply: str,
        limit: str | None = None,
        n: int | None = None,
        progress: ProgressOption = False,
        **options: object,
    ) -> Sizing:
        """The thickness of a ply for a temperature limit such as ``"TC4 < 623 K"``; without it that of the case."""
        return self._ask(Sizing, "size", options, progress, ply=ply, limit=limit, members=n)

    def trade(
        self,
        choices: Mapping[str, Sequence[str]],
        size: str,
        limit: str | None = None,
        n: int | None = None,
        exposures: Sequence[str | PathLike[str]] = (),
        progress: ProgressOption = False,
        **options: object,
    ) -> Trade:
        """The layups of all choices of materials, each sized for a temperature limit, by their mass per area.

        Parameters
        ----------
        choices
            Plies or groups, each with the ids of its materials: ``{"INS": ["pyrogel3350", "saffil-96"]}``.
        size
            The ply or group whose thickness is sized.
        limit
            Such as ``"TC4 < 623 K"``; without it that of the case.
        n
            Number of members, the same for all layups; by default that of the command.
        exposures
            Paths of further cases, whose exposures every layup must hold too.
        progress
            As in :meth:`march`.
        options
            Options of the command ``bondline trade``: ``probability``, ``thickness_range=("3 mm", "20 mm")``, ``seed``,
            ``sampling``, ``sampling_bounds``.
        """
        return self._ask(
            Trade, "trade", options, progress,
            choices=choices, size=size, limit=limit, members=n, exposures=list(exposures),
        )

    def design(
        self,
        estimate: Sequence[str] | None = None,
        sensors: int | None = None,
        n: int | None = None,
        progress: ProgressOption = False,
        **options: object,
    ) -> Design:
        """The depths of thermocouples and the run length from which factors are estimated best.

        Options are those of the command ``bondline design``: ``criterion``, ``worst=True``, ``target``, ``grid``,
        ``least_distance="0.5 mm"``, ``position_tolerance``, ``sampling``, ``noise``, ``correlation_time="5 s"``,
        ``run_lengths=["60s", "200s"]``, ``others=["cases/second"]``, ``seed`` and ``sampling_bounds``. Noise that is
        not stated is that of the residuals of the case, and factors are those that it estimates.
        """
        factors = None if estimate is None else list(estimate)
        return self._ask(Design, "design", options, progress, estimate=factors, sensors=sensors, members=n)

    def history(self, progress: ProgressOption = False, **options: object) -> History:
        """The heating of the hot face over time, from the observations (inverse heat conduction)."""
        return self._ask(History, "history", options, progress)

    def observations(self) -> ObservationCheck:
        """What was read of the measured data: rate, gaps, noise, spikes, stuck and open channels, drift."""
        return self._ask(ObservationCheck, "observations", {}, False)

    def coverage(self, n: int, progress: ProgressOption = False, **options: object) -> Coverage:
        """How often the 95 % intervals of estimates contain the truth, over synthetic data sets that are fitted.

        Parameters
        ----------
        n
            Number of data sets, each with random true factors.
        progress
            As in :meth:`march`.
        options
            Options of the command ``bondline twin --study``: ``noise="2 K"``, ``correlation_time="5 s"``, ``seed``, and
            those of :meth:`estimate`.
        """
        return self._ask(Coverage, "twin", options, progress, study=n)

    def _ask(
        self,
        kind: type[_R],
        name: str,
        options: Mapping[str, object],
        progress: ProgressOption,
        keeps_members: bool = False,
        **own: object,
    ) -> _R:
        asked = question(name, options, own)
        answers, members = self._core.ask(name, asked, self._session, keeps_members, _report(progress))
        return kind(self, answers, members)

    def __repr__(self) -> str:
        return f"<bondline.Case {self.id!r}: {len(self.sensors)} sensors, {len(self.factors)} factors>"


def _unpickled(source: Memory, overrides: dict[str, str], session: dict[str, str], mark: str) -> Case:
    """A case of another process, with all that its files hold."""
    case = Case(source.read(list(overrides.items())), source)
    if case._core.fingerprint() != mark:
        raise _bondline.BondlineError(f"the case {case.id!r} is not the one that was sent: use one version of bondline")
    case._overrides, case._session = overrides, session
    return case


def _named_columns(argument: str, values: Any) -> dict[str, Array] | None:
    """The columns of a data frame by name; ``None`` for plain numbers. Other values with names are refused, as their
    order may not be that of the case."""
    if hasattr(values, "columns"):
        names = [str(name) for name in values.columns]
        if len(set(names)) < len(names):
            raise ValueError(f"{argument}: two columns have one name: {', '.join(names)}")
        return {name: np.asarray(values[column], dtype=np.float64) for name, column in zip(names, values.columns)}
    if hasattr(values, "index") and not isinstance(values, Sequence) or hasattr(values, "dims"):
        kind = type(values).__name__
        raise TypeError(f"{argument}: a {kind} has names: expected a data frame whose columns are factors, or an array")
    return None


def _with_lines(message: str, id: str, text: str) -> str:
    """Errors of a text that the caller has not seen, each with its line of the text in place of the position."""
    lines = text.splitlines()
    return re.sub(
        rf"^{re.escape(id)}:(\d+):\d+: (.*)$",
        lambda found: f"{id}: {found[2]} in `{lines[int(found[1]) - 1]}`",
        message,
        flags=re.MULTILINE,
    )


def _report(progress: ProgressOption) -> Callable[[int, int | None], object] | None:
    if callable(progress):
        return progress
    if not isinstance(progress, bool):
        raise TypeError(f"progress: expected True, False or a function, found {progress!r}")
    return _show if progress else None


def _show(marched: int, expected: int | None) -> None:
    share = f" of {expected}" if expected is not None else ""
    print(f"\r{marched}{share} members", end="", file=sys.stderr, flush=True)
