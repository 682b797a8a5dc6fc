"""`solve_ivp` one member at a time, one process per thread: the fastest of LSODA, BDF and Radau at the accuracy, on
bondline's two grids with extrapolation in space, or on one finer grid.

The spatial equations are those of scheme.py. The factors of a member scale its own tables, so a right-hand side is some
twenty operations on cells. Jacobians are exact: banded for LSODA, sparse for the others. Intervals between corners of
the exposure are integrated separately.
"""

import itertools
import math
import multiprocessing
import os
import time
import warnings

import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import diags_array

from layup import layups
from peer import serve
from scheme import Scheme
from numpy_peer import put

METHODS = ("LSODA", "BDF", "Radau")
RTOLS = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6)
# Members of the first test, which excludes most configurations.
FEW = 2
# atol over rtol, K: a lower limit of the temperatures.
LEVEL_K = 300.0


class Member:
    """The spatial equations of one member."""

    def __init__(self, layup, columns):
        self.layup, self.columns = layup, columns
        self.scheme = Scheme(layup, np, None, put)
        self.rows = np.concatenate(
            [np.full(s.end - s.start, i * layup.table_nodes) for i, s in enumerate(layup.stretches)]
        )
        # Scaled conductivity, its slope and heat capacity of the plies, concatenated.
        self.tables = np.concatenate([scaled(stretch, columns) for stretch in layup.stretches], axis=1)
        self.rises = np.diff(self.tables, append=0.0)
        self.over_1_m = 1 / layup.width_m

    def at(self, temperature_k, columns):
        position = temperature_k * (1 / self.layup.table_step_k)
        row = np.clip(position.astype(int), 0, self.layup.table_nodes - 2)
        place, share = self.rows + row, position - row
        return [self.tables[column][place] + share * self.rises[column][place] for column in columns]

    def rate(self, time_s, temperature_k, leg):
        k, capacity = self.at(temperature_k, (0, 2))
        flux = self.scheme.conductances(k) * (temperature_k[:-1] - temperature_k[1:])
        hot, _, _ = self.scheme.hot_face(self.columns, temperature_k[:1], *leg.drive(time_s))
        return -np.diff(flux, prepend=hot, append=0.0) * self.over_1_m / capacity

    def bands(self, time_s, temperature_k, leg):
        """Upper, middle and lower band of the Jacobian, without the slope of the heat capacity."""
        k, slope, capacity = self.at(temperature_k, (0, 1, 2))
        conductance, drop = self.scheme.conductances(k), temperature_k[:-1] - temperature_k[1:]
        by_upper, by_lower = self.scheme.flux_slopes(k, slope, conductance, drop)
        _, hot_slope, _ = self.scheme.hot_face(self.columns, temperature_k[:1], *leg.drive(time_s))
        weight = self.over_1_m / capacity
        middle = -weight * self.scheme.gathered(-hot_slope[0], by_lower, by_upper)
        return by_lower * weight[:-1], middle, by_upper * weight[1:]

    def packed(self, time_s, temperature_k, leg):
        bands = np.zeros((3, len(temperature_k)))
        bands[0, 1:], bands[1], bands[2, :-1] = self.bands(time_s, temperature_k, leg)
        return bands

    def sparse(self, time_s, temperature_k, leg):
        return diags_array(self.bands(time_s, temperature_k, leg), offsets=(1, 0, -1), format="csc")

    def march(self, legs, method, rtol):
        layup = self.layup
        jacobian = {"jac": self.packed, "lband": 1, "uband": 1} if method == "LSODA" else {"jac": self.sparse}
        state_k, states_k = layup.start_k, [layup.start_k[None]]
        for leg in legs:
            within = layup.instants_s[(layup.instants_s > leg.start_s) & (layup.instants_s <= leg.end_s)]
            output_s = np.union1d(within, leg.end_s)
            span, options = (leg.start_s, leg.end_s), {"rtol": rtol, "atol": rtol * LEVEL_K, **jacobian}
            found = solve_ivp(self.rate, span, state_k, method, output_s, args=(leg,), **options)
            if not found.success:
                raise ArithmeticError(found.message)
            state_k = found.y[:, -1]
            states_k.append(found.y.T[: len(within)])
        return self.scheme.shown(np.concatenate(states_k), self.columns[None])


class Interval:
    """An interval between corners of the exposure, in which the drives are linear."""

    def __init__(self, start_s, end_s, flux_w_m2, surroundings_k):
        self.start_s, self.end_s, self.flux_w_m2, self.surroundings_k = start_s, end_s, flux_w_m2, surroundings_k

    def drive(self, time_s):
        share = (time_s - self.start_s) / (self.end_s - self.start_s)
        # As for a step: (start, end); the end is not used.
        between = lambda ends: (ends[0] + share * (ends[1] - ends[0]), ends[1])
        return between(self.flux_w_m2), between(self.surroundings_k)


def scaled(stretch, columns):
    k, slope, heat_capacity = stretch.table[:3]
    if stretch.radiates:
        k, slope = (part + more / columns[stretch.extinction] for part, more in zip((k, slope), stretch.table[3:]))
    density_kg_m3 = stretch.density_kg_m3 * columns[stretch.density] * columns[stretch.heat_capacity]
    return np.stack(
        [k * columns[stretch.conductivity], slope * columns[stretch.conductivity], density_kg_m3 * heat_capacity]
    )


def legs(layup):
    drives = np.column_stack([layup.flux_w_m2, layup.surroundings_k])
    slopes = np.column_stack([drives[:, 1] - drives[:, 0], drives[:, 3] - drives[:, 2]]) / layup.steps_s[:, None]
    scale = np.abs(slopes).max(axis=0) + 1e-300
    bends = np.any(np.abs(np.diff(slopes, axis=0)) > 1e-6 * scale, axis=1)
    jumps = np.any(np.abs(drives[1:, ::2] - drives[:-1, 1::2]) > 1e-9, axis=1)
    starts = [0, *(1 + np.flatnonzero(bends | jumps))]
    ends = [*starts[1:], len(layup.steps_s)]
    return [
        Interval(layup.times_s[a], layup.times_s[b], drives[[a, b - 1], [0, 1]], drives[[a, b - 1], [2, 3]])
        for a, b in zip(starts, ends)
    ]


class Configuration:
    """A method and tolerance on one grid, or on two grids with extrapolation in space."""

    def __init__(self, grids, method, rtol):
        self.grids, self.method, self.rtol = grids, method, rtol
        self.exposure = legs(grids[0])
        self.cells = " and ".join(str(grid.cells) for grid in grids)

    def march(self, columns):
        return sum(
            grid.share * Member(grid, columns).march(self.exposure, self.method, self.rtol) for grid in self.grids
        )

    def __str__(self):
        return f"{self.method} at rtol {self.rtol:g} on {self.cells} cells"


def choose(grids, columns, reference, tolerance_k):
    """The configurations that reach the accuracy, the fastest first: each grid and method at its loosest tolerance."""
    found = []
    for each, method in itertools.product(grids, METHODS):
        for rtol in RTOLS:
            configuration = Configuration(each, method, rtol)
            # Most fail for the first members.
            if measured(configuration, columns, reference[:FEW])[1] > tolerance_k:
                continue
            seconds, error_k = measured(configuration, columns, reference)
            if error_k <= tolerance_k:
                found.append((seconds, error_k, configuration))
                break
    if not found:
        raise SystemExit(f"none of {', '.join(METHODS)} comes within {tolerance_k} K")
    return sorted(found, key=lambda each: each[0])


def measured(configuration, columns, reference):
    """Seconds per member, and the largest error of all, K."""
    began = time.perf_counter()
    try:
        traces = [configuration.march(column) for column in columns[: len(reference)]]
    except ArithmeticError:
        return math.inf, math.inf
    return (time.perf_counter() - began) / len(reference), float(np.abs(np.array(traces) - reference).max())


def prepare(pair, columns, reference, tolerance_k, *others):
    """`others` are plans whose finer grid may be cheaper."""
    warnings.filterwarnings("ignore")
    threads = len(os.sched_getaffinity(0))
    grids = [pair, *(layups(path, resolutions=1) for path in others)]
    found = choose(grids, columns, np.load(reference), float(tolerance_k))
    configuration = found[0][2]
    global one

    def one(member):
        return configuration.march(columns[member])

    pool = multiprocessing.get_context("fork").Pool(threads)
    of = lambda members: lambda: np.array(pool.map(one, range(members), chunksize=1))
    fastest = {}
    for seconds, error_k, each in found:
        fastest.setdefault(each.cells, f"{each} {1e3 * seconds:.0f} ms, {error_k:.3f} K")
    return of, f"{configuration}, {threads} processes; tried: {'; '.join(fastest.values())}"


if __name__ == "__main__":
    serve(prepare)
