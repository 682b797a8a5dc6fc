"""The scheme in Numba: `prange` over groups of members, with the members of a group in the innermost loops.

Groups of 8 take 9 to 10 ns per cell-step, single members 18 (two threads, AVX-512); `fastmath` changes little. Groups
of 32 take four fifths of that and are used from 1,000 members on; with 15 members (one group) they take twice as long.
`plain`: one member per turn of `prange`. """

import os
import sys

import numba
import numpy as np
from numba import njit, prange

from layup import STEFAN_BOLTZMANN
from peer import serve
from scheme import GAMMA

PLAIN = sys.argv[3:] == ["plain"]
LANES = 1 if PLAIN else 32
inlined = njit(inline="always")


@inlined
def properties(temperatures_k, increments_k, columns, plies, k, slopes, capacities, sloped):
    """Conductivities, heat capacities and, if requested, slopes of the conductivities."""
    tables, density_kg_m3, radiates, spans, width_m, step_k = plies
    per_step = 1 / step_k
    for s in range(len(spans)):
        for i in range(spans[s, 0], spans[s, 1]):
            for lane in range(LANES):
                scale = columns[spans[s, 2], lane]
                radiation = 1 / columns[spans[s, 3], lane]
                density = density_kg_m3[s] * columns[spans[s, 4], lane] * columns[spans[s, 5], lane]
                position = (temperatures_k[i, lane] + increments_k[i, lane]) * per_step
                row = min(max(int(position), 0), tables.shape[1] - 2)
                share = position - row
                under = tables[s, row]
                over = tables[s, row + 1]
                value = under[0] + share * (over[0] - under[0])
                if radiates[s]:
                    value += radiation * (under[3] + share * (over[3] - under[3]))
                k[i, lane] = scale * value
                if sloped:
                    slope = under[1] + share * (over[1] - under[1])
                    if radiates[s]:
                        slope += radiation * (under[4] + share * (over[4] - under[4]))
                    slopes[i, lane] = scale * slope
                capacities[i, lane] = density * width_m[i] * (under[2] + share * (over[2] - under[2]))


@inlined
def conduct(k, conductances, grid):
    """Conductances between nodes."""
    contact, contacts_m2_k_w, above_m, below_m, half_1_m = grid
    for i in range(len(k) - 1):
        if contact[i] < 0:
            for lane in range(LANES):
                conductances[i, lane] = (k[i, lane] + k[i + 1, lane]) * half_1_m[i]
        else:
            for lane in range(LANES):
                both = k[i, lane] * k[i + 1, lane]
                resistance = (
                    below_m[i] * k[i + 1, lane] + above_m[i + 1] * k[i, lane] + contacts_m2_k_w[contact[i]] * both
                )
                conductances[i, lane] = both / resistance


@inlined
def incline(temperatures_k, k, slopes, conductances, grid, by_upper, by_lower):
    """Slopes of the fluxes by the temperature of the upper and, negated, of the lower node."""
    contact, _, above_m, below_m, half_1_m = grid
    for i in range(len(k) - 1):
        for lane in range(LANES):
            above = below = half_1_m[i]
            if contact[i] >= 0:
                above = (conductances[i, lane] / k[i, lane]) ** 2 * below_m[i]
                below = (conductances[i, lane] / k[i + 1, lane]) ** 2 * above_m[i + 1]
            drop = temperatures_k[i, lane] - temperatures_k[i + 1, lane]
            by_upper[i, lane] = max(conductances[i, lane] + above * slopes[i, lane] * drop, 0.0)
            by_lower[i, lane] = max(conductances[i, lane] - below * slopes[i + 1, lane] * drop, 0.0)
    by_upper[-1], by_lower[-1] = 0.0, 0.0


@inlined
def hot_face(temperature_k, scale, flux_w_m2, surroundings_k, face, hot_wall_kg_j, step_k):
    """Heat flux into the layup and its slope."""
    position = temperature_k / step_k
    row = min(max(int(position), 0), len(face) - 2)
    under, over, share = face[row], face[row + 1], position - row
    enthalpy = under[0] + share * (over[0] - under[0])
    rise = under[1] + share * (over[1] - under[1])
    radiance = STEFAN_BOLTZMANN * scale * (under[2] + share * (over[2] - under[2]))
    square = temperature_k * temperature_k
    flux = flux_w_m2 * (1 - hot_wall_kg_j * enthalpy) + radiance * (surroundings_k**4 - square * square)
    return flux, -flux_w_m2 * hot_wall_kg_j * rise - 4 * radiance * square * temperature_k


@inlined
def imbalance(i, lane, temperatures_k, increments_k, conductances, hot):
    """Net heat flux into a cell."""
    here = temperatures_k[i, lane] + increments_k[i, lane]
    above, below = hot, 0.0
    if i > 0:
        above = conductances[i - 1, lane] * (temperatures_k[i - 1, lane] + increments_k[i - 1, lane] - here)
    if i + 1 < len(temperatures_k):
        below = conductances[i, lane] * (here - (temperatures_k[i + 1, lane] + increments_k[i + 1, lane]))
    return above - below


@inlined
def ascend(side, by_lower, reciprocals, found):
    last = len(side) - 1
    for lane in range(LANES):
        found[last, lane] = side[last, lane] * reciprocals[last, lane]
    for i in range(last - 1, -1, -1):
        for lane in range(LANES):
            found[i, lane] = (side[i, lane] + GAMMA * by_lower[i, lane] * found[i + 1, lane]) * reciprocals[i, lane]


@njit(parallel=True, cache=True)
def march(traces, columns, plies, grid, wall, start_k, steps_s, flux_w_m2, surroundings_k, readout, sensors):
    """Add the weighted readings of this resolution to the traces (member × instant × sensor)."""
    face, emissivity, hot_wall_kg_j, step_k = wall
    record_steps, taps, weights = readout
    places, above_m, below_m, share_below = sensors
    members, cells = len(columns), len(start_k)
    for group in prange((members + LANES - 1) // LANES):
        # Transposed; the last group is padded with its last member.
        own = np.empty((columns.shape[1], LANES))
        for lane in range(LANES):
            own[:, lane] = columns[min(group * LANES + lane, members - 1)]
        temperatures_k = np.empty((cells, LANES))
        first = np.zeros((cells, LANES))
        k, slopes, capacities, staged = np.empty((4, cells, LANES))
        conductances, by_upper, by_lower, ratios = np.empty((4, cells, LANES))
        reciprocals, side = np.empty((2, cells, LANES))
        hot, driven, hot_slope = np.empty((3, LANES))
        records = np.empty((len(record_steps), len(places), LANES))
        for i in range(cells):
            temperatures_k[i] = start_k[i]
        record = 0
        for step in range(len(steps_s) + 1):
            properties(temperatures_k, first, own, plies, k, slopes, capacities, True)
            conduct(k, conductances, grid)
            if record_steps[record] == step:
                for sensor in range(len(places)):
                    i = places[sensor]
                    for lane in range(LANES):
                        drop = temperatures_k[i, lane] - temperatures_k[i + 1, lane]
                        sides_m = above_m[sensor] / k[i, lane] - below_m[sensor] / k[i + 1, lane]
                        fall = conductances[i, lane] * drop * sides_m + share_below[sensor] * drop
                        records[record, sensor, lane] = temperatures_k[i, lane] - fall
                record += 1
            if step == len(steps_s):
                break
            for lane in range(LANES):
                surface_k, scale = temperatures_k[0, lane], own[emissivity, lane]
                drives = flux_w_m2[step], surroundings_k[step]
                hot[lane], hot_slope[lane] = hot_face(
                    surface_k, scale, drives[0][0], drives[1][0], face, hot_wall_kg_j, step_k
                )
                end, _ = hot_face(surface_k, scale, drives[0][1], drives[1][1], face, hot_wall_kg_j, step_k)
                driven[lane] = GAMMA * (end - hot[lane])
            incline(temperatures_k, k, slopes, conductances, grid, by_upper, by_lower)
            per_length = 1 / steps_s[step]
            for lane in range(LANES):
                pivot = capacities[0, lane] * per_length + GAMMA * (by_upper[0, lane] - hot_slope[lane])
                reciprocals[0, lane] = 1 / pivot
                side[0, lane] = imbalance(0, lane, temperatures_k, first, conductances, hot[lane]) + driven[lane]
            for i in range(1, cells):
                for lane in range(LANES):
                    ratio = -GAMMA * by_upper[i - 1, lane] * reciprocals[i - 1, lane]
                    pivot = capacities[i, lane] * per_length + GAMMA * (by_lower[i - 1, lane] + by_upper[i, lane])
                    reciprocals[i, lane] = 1 / (pivot + ratio * GAMMA * by_lower[i - 1, lane])
                    side[i, lane] = (
                        imbalance(i, lane, temperatures_k, first, conductances, 0.0) - ratio * side[i - 1, lane]
                    )
                    ratios[i, lane] = ratio
            ascend(side, by_lower, reciprocals, first)

            properties(temperatures_k, first, own, plies, k, slopes, staged, False)
            conduct(k, conductances, grid)
            for lane in range(LANES):
                surface_k, scale = temperatures_k[0, lane] + first[0, lane], own[emissivity, lane]
                drives = flux_w_m2[step], surroundings_k[step]
                hot[lane], _ = hot_face(surface_k, scale, drives[0][1], drives[1][1], face, hot_wall_kg_j, step_k)
            for i in range(cells):
                for lane in range(LANES):
                    net = imbalance(i, lane, temperatures_k, first, conductances, hot[lane])
                    carried = 2 * capacities[i, lane] * per_length * first[i, lane]
                    side[i, lane] = capacities[i, lane] / staged[i, lane] * net - carried
                    if i == 0:
                        side[i, lane] -= driven[lane]
                    else:
                        side[i, lane] -= ratios[i, lane] * side[i - 1, lane]
            ascend(side, by_lower, reciprocals, side)
            for i in range(cells):
                for lane in range(LANES):
                    temperatures_k[i, lane] += 1.5 * first[i, lane] + 0.5 * side[i, lane]
                    first[i, lane] = 0.0
        for lane in range(min(LANES, members - group * LANES)):
            for instant in range(len(taps)):
                for sensor in range(len(places)):
                    for tap in range(taps.shape[1]):
                        reading = weights[instant, tap] * records[taps[instant, tap], sensor, lane]
                        traces[group * LANES + lane, instant, sensor] += reading


def arguments(layup):
    """Arrays of a resolution for the march."""
    stretches = layup.stretches
    tables = np.zeros((len(stretches), layup.table_nodes, 5))
    for own, stretch in zip(tables, stretches):
        own[:, : len(stretch.table)] = stretch.table.T
    spans = [(s.start, s.end, s.conductivity, s.extinction, s.density, s.heat_capacity) for s in stretches]
    densities, radiates = np.array([s.density_kg_m3 for s in stretches]), np.array([s.radiates for s in stretches])
    plies = tables, densities, radiates, np.array(spans), layup.width_m, layup.table_step_k
    contact = np.full(layup.cells, -1)
    contact[layup.interfaces] = np.arange(len(layup.interfaces))
    grid = contact, layup.contacts_m2_k_w, layup.above_m, layup.below_m, layup.half_over_next_1_m
    wall = np.ascontiguousarray(layup.face.T), layup.emissivity, layup.hot_wall_kg_j, layup.table_step_k
    readout = layup.records, layup.taps, layup.share * layup.weights
    sensors = layup.places, *layup.sides, layup.share_below
    return plies, grid, wall, layup.start_k, layup.steps_s, layup.flux_w_m2, layup.surroundings_k, readout, sensors


def prepare(layups, columns, _setting=None):
    threads = len(os.sched_getaffinity(0))
    numba.set_num_threads(threads)
    marches = [arguments(layup) for layup in layups]

    def run(members):
        traces = np.zeros((members, *layups[0].shape))
        for march_arguments in marches:
            march(traces, columns[:members], *march_arguments)
        return traces

    run(1)
    return (
        lambda members: lambda: run(members),
        f"{'one member a turn' if PLAIN else f'groups of {LANES} members'}, {threads} threads",
    )


if __name__ == "__main__":
    serve(prepare)
