"""Piecewise linear functions as a file states them: properties over temperature, schedules over time."""

import bisect
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quantities import Refused

Array = NDArray[np.float64]

# Temperatures at which tables are closed on both sides, K.
LOWEST_K, HIGHEST_K = 1e-3, 2e4


@dataclass(frozen=True)
class Table:
    """A property over temperature: linear between points; a temperature stated twice is a jump."""

    temperatures_k: tuple[float, ...]
    values: tuple[float, ...]
    outside: str = "clamp"

    @staticmethod
    def constant(value: float) -> "Table":
        return Table((300.0,), (value,))

    def times(self, factor: float) -> "Table":
        return Table(self.temperatures_k, tuple(factor * value for value in self.values), self.outside)

    @cached_property
    def segments(self) -> tuple[Array, Array, Array]:
        """Start of each segment, the value there, and the slope; the first starts at LOWEST_K, the last at the last
        bend."""
        t, v = list(self.temperatures_k), list(self.values)
        if any(b < a for a, b in zip(t, t[1:])):
            raise Refused("temperatures of a table decrease")
        if len(t) == 1 or self.outside != "extrapolate":
            t, v = [LOWEST_K, *t, HIGHEST_K], [v[0], *v, v[-1]]
        else:
            low_slope = (v[1] - v[0]) / (t[1] - t[0])
            high_slope = (v[-1] - v[-2]) / (t[-1] - t[-2])
            # A tenth of the end value at least.
            if low_slope > 0 and (bend := t[0] - 0.9 * v[0] / low_slope) > LOWEST_K:
                t, v = [LOWEST_K, bend, *t], [0.1 * v[0], 0.1 * v[0], *v]
            else:
                t, v = [LOWEST_K, *t], [v[0] + low_slope * (LOWEST_K - t[0]), *v]
            if high_slope < 0 and (bend := t[-1] - 0.9 * v[-1] / high_slope) < HIGHEST_K:
                t, v = [*t, bend, HIGHEST_K], [*v, 0.1 * v[-1], 0.1 * v[-1]]
            else:
                t, v = [*t, HIGHEST_K], [*v, v[-1] + high_slope * (HIGHEST_K - t[-1])]
        starts, values, slopes = [], [], []
        for i in range(len(t) - 1):
            if t[i + 1] > t[i]:
                starts.append(t[i])
                values.append(v[i])
                slopes.append((v[i + 1] - v[i]) / (t[i + 1] - t[i]))
        return np.array(starts), np.array(values), np.array(slopes)

    def at(self, temperature_k: Any) -> Any:
        """The value at a temperature, or at several."""
        starts, values, slopes = self.segments
        if isinstance(temperature_k, float):
            i = min(max(bisect.bisect_right(self._starts, temperature_k) - 1, 0), len(starts) - 1)
            return float(values[i]) + float(slopes[i]) * (temperature_k - self._starts[i])
        found = np.maximum(starts.searchsorted(temperature_k, side="right") - 1, 0)
        return values[found] + slopes[found] * (temperature_k - starts[found])

    @cached_property
    def _starts(self) -> list[float]:
        starts: list[float] = self.segments[0].tolist()
        return starts

    @property
    def is_constant(self) -> bool:
        return all(value == self.values[0] for value in self.values)

    @property
    def error_range_k(self) -> tuple[float, float]:
        """The temperatures outside which a member fails."""
        if self.outside == "error" and len(self.values) > 1:
            return self.temperatures_k[0], self.temperatures_k[-1]
        return 0.0, np.inf


def weighted_sum(tables: list[tuple[float, Table]]) -> tuple[Array, Array, Array]:
    """Segments of the sum of tables with weights: exact, at all bends of all of them."""
    starts = np.unique(np.concatenate([table.segments[0] for _, table in tables]))
    values, slopes = np.zeros_like(starts), np.zeros_like(starts)
    for weight, table in tables:
        own_starts, own_values, own_slopes = table.segments
        i = np.searchsorted(own_starts, starts, side="right") - 1
        values += weight * (own_values[i] + own_slopes[i] * (starts - own_starts[i]))
        slopes += weight * own_slopes[i]
    return starts, values, slopes


def integral_at_starts(segments: tuple[Array, Array, Array]) -> Array:
    """The integral from the first start to each start."""
    starts, values, slopes = segments
    widths = np.diff(starts)
    return np.concatenate([[0.0], np.cumsum(widths * (values[:-1] + 0.5 * slopes[:-1] * widths))])


@dataclass(frozen=True)
class Schedule:
    """A quantity over time: linear between corners, constant outside; a time stated twice is a jump."""

    times_s: tuple[float, ...]
    values: tuple[float, ...]

    @staticmethod
    def constant(value: float) -> "Schedule":
        return Schedule((0.0,), (value,))

    def after(self, time_s: float) -> float:
        """The value just after a time."""
        t, v = self.times_s, self.values
        i = int(np.searchsorted(t, time_s, side="right"))
        if i == 0:
            return v[0]
        if i == len(t):
            return v[-1]
        return v[i - 1] + (v[i] - v[i - 1]) * (time_s - t[i - 1]) / (t[i] - t[i - 1])

    def before(self, time_s: float) -> float:
        """The value just before a time."""
        t, v = self.times_s, self.values
        i = int(np.searchsorted(t, time_s, side="left"))
        if i == 0:
            return v[0]
        if i == len(t):
            return v[-1]
        return v[i - 1] + (v[i] - v[i - 1]) * (time_s - t[i - 1]) / (t[i] - t[i - 1])

    @cached_property
    def acts(self) -> bool:
        return any(value != 0.0 for value in self.values)

    def crossings_s(self, level: float) -> list[float]:
        """Times at which it passes a level."""
        times = []
        for t0, t1, v0, v1 in zip(self.times_s, self.times_s[1:], self.values, self.values[1:]):
            if (v0 - level) * (v1 - level) < 0.0 and t1 > t0:
                times.append(t0 + (level - v0) / (v1 - v0) * (t1 - t0))
        return times
