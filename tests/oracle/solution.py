"""Integration of a case in time and the error of its own results, from two grids and two tolerances."""

from dataclasses import dataclass, field

import numpy as np
from case_file import Case
from heat import Heat
from pyrometer import brightness_temperature
from quantities import Refused
from stepper import BackwardDifferences
from tables import Array

_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(5)
_GAUSS_X, _GAUSS_W = 0.5 + 0.5 * _GAUSS_X, 0.5 * _GAUSS_W


@dataclass
class Result:
    """What a case gives; arrays over the instants, numbers by name."""

    times_s: Array
    traces: dict[str, Array]
    numbers: dict[str, float]
    errors: dict[str, float] = field(default_factory=dict)
    steps: int = 0
    nodes: int = 0
    work: float = 0.0
    is_loose: bool = False


TOO_MUCH_WORK = "the case takes too many steps"


def cost_of_step(nodes: int) -> float:
    """Relative to that on a few nodes, which takes about half a millisecond."""
    return 1.0 + nodes / 300.0


class _Maximum:
    """The highest value of a series and its time."""

    def __init__(self) -> None:
        self.value, self.time = -np.inf, 0.0

    def see(self, times: Array, values: Array) -> None:
        i = int(np.argmax(values))
        if values[i] > self.value:
            self.value, self.time = float(values[i]), float(times[i])


def integrate(case: Case, refinement: float, tolerance: float, times_s: Array, work: float) -> Result:
    """One march: cells `refinement` times as many, local errors of `tolerance` kelvin, at most `work`."""
    corners = shortest_scale_s(case)
    heat = Heat(case, refinement, corners)
    y = heat.initial_state()
    names = [sensor.name for sensor in case.sensors]
    traces = {name: np.full(len(times_s), np.nan) for name in names}
    gas = np.full(len(times_s), np.nan)
    mass = np.full(len(times_s), np.nan)
    peaks = {name: _Maximum() for name in names}
    of_node = np.full(heat.nodes, -np.inf)
    gas_peak = _Maximum()
    heat_in = {"hot": 0.0, "back": 0.0}
    inflow = 0.0
    steps, cost = 0, cost_of_step(heat.nodes)
    has_range = any(np.isfinite(high) for high in heat.error_range[1])

    absolute = np.full(heat.size, tolerance)
    for reacting in heat.reacting:
        absolute[reacting.index] = 2e-4 * tolerance

    def readings(t: Array, states: Array, temperature: Array) -> dict[str, Array]:
        """Readings of all sensors at several times."""
        found = {}
        for s, sensor in enumerate(case.sensors):
            if s in heat.lagged:
                found[sensor.name] = states[heat.bead[heat.lagged.index(s)]]
            elif sensor.pyrometer is not None:
                emissivity = np.broadcast_to(heat.emissivity(states, case.hot, True, temperature[0]), t.shape)
                surroundings = np.broadcast_to(heat.forcing("hot.surroundings_k", t), t.shape)
                found[sensor.name] = np.array(
                    [
                        brightness_temperature(sensor.pyrometer, float(e), float(surface), float(around))
                        for e, surface, around in zip(emissivity, temperature[0], surroundings)
                    ]
                )
            else:
                a, b = heat.read[s]
                found[sensor.name] = 0.5 * (temperature[a] + temperature[b])
        return found

    def see(t: Array, states: Array, at_outputs: np.ndarray) -> Array:
        """Notes readings at some times, of which the first few are instants of the traces."""
        temperature = heat.temperatures(t, states)[0]
        found = readings(t, states, temperature)
        for name in names:
            traces[name][at_outputs] = found[name][: len(at_outputs)]
            peaks[name].see(t, found[name])
        np.maximum(of_node, temperature.max(axis=1), out=of_node)
        if heat.has_gas:
            n = len(at_outputs)
            mass[at_outputs] = heat.mass_lost(states[:, :n])
            made = heat.gas_made(states, temperature)
            gas[at_outputs] = made[:n]
            gas_peak.see(t, made)
        return temperature

    edges = heat.corners_s
    first = np.flatnonzero(times_s <= edges[0])
    heat.enter(edges[0], edges[1])
    see(np.full(max(len(first), 1), edges[0]), np.repeat(y[:, None], max(len(first), 1), axis=1), first)
    for start, end in zip(edges, edges[1:]):
        heat.enter(start, end)
        # A jump of a held temperature is seen at its later value, and as highest temperature at once.
        if heat.held:
            see(np.array([start]), y[:, None], np.flatnonzero(times_s == start))
        solver = _started(heat, y, absolute, tolerance)
        is_first = True
        while not solver.is_done:
            steps += 1
            if not is_first and not solver.step():
                raise Refused(f"integration failed at {solver.t:.9g} s: {solver.message}")
            is_first = False
            if steps * cost > work:
                raise Refused(f"{TOO_MUCH_WORK}, at {solver.t:.6g} s on {heat.nodes} nodes")
            before, now = solver.t_old, solver.t
            outputs = np.flatnonzero((times_s > before) & (times_s <= now))
            gauss = before + (now - before) * _GAUSS_X
            t = np.concatenate([times_s[outputs], gauss, [now]])
            states = solver.interpolated(t)
            temperature = see(t, states, outputs)
            if has_range or steps % 16 == 0:
                _check_ranges(heat, temperature)
            weights = _GAUSS_W * (now - before)
            inside = slice(len(outputs), len(outputs) + len(gauss))
            for name, face, node in (("hot", case.hot, 0), ("back", case.back, -1)):
                if face.held is None:
                    surface = temperature[node, inside]
                    emissivity = heat.emissivity(states[:, inside], face, name == "hot", surface)
                    q = heat.face_flux(name, face, gauss, surface, emissivity)[0] * np.ones(len(gauss))
                    heat_in[name] += float(weights @ q)
                    if name == "hot":
                        inflow += float(weights @ np.maximum(q, 0.0))
        y = solver.y

    numbers = {f"peak of {name}": peaks[name].value for name in names}
    numbers |= {f"time of the peak of {name}": peaks[name].time for name in names}
    for p, ply in enumerate(case.plies):
        nodes = slice(heat.top_node[p], heat.bottom_node[p] + 1)
        numbers[f"peak of ply {ply.name}"] = float(of_node[nodes].max())
        if p + 1 < len(case.plies):
            pair = heat.bottom_node[p], heat.top_node[p + 1]
            name = f"peak of interface {ply.name}/{case.plies[p + 1].name}"
            numbers[name] = float(max(of_node[pair[0]], of_node[pair[1]]))
    if case.hot.held is None:
        numbers["heat load"] = inflow
        numbers["heat through the hot face"] = heat_in["hot"]
    if heat.has_gas:
        numbers["peak of gas_flux_kg_m2_s"] = gas_peak.value
        numbers["final mass_lost_kg_m2"] = heat.mass_lost(y)
        traces["mass_lost_kg_m2"], traces["gas_flux_kg_m2_s"] = mass, gas
    elif case.hot.held is None and case.back.held is None and case.holder is None:
        stored = heat.stored_heat(y) - heat.stored_heat(heat.initial_state())
        moved = heat_in["hot"] + heat_in["back"]
        numbers["balance of energy"] = abs(stored - moved) / max(abs(stored), inflow, 1.0)
    return Result(times_s, traces, numbers, {}, steps, heat.nodes, steps * cost)


def _started(heat: Heat, y: Array, absolute: Array, tolerance: float) -> BackwardDifferences:
    """A stepper after its first step between two corners, which is as short as the jump at the corner needs."""
    start, end = heat.segment
    for share in (1e-5, 1e-9, 1e-13):
        solver = BackwardDifferences(
            lambda t, y: heat.evaluate(t, y, False)[0],
            lambda t, y: heat.evaluate(t, y, True)[1],
            start,
            y,
            end,
            relative=2e-4 * tolerance,
            absolute=absolute,
            band=heat.band,
            first_step=share * (end - start),
        )
        if solver.step():
            return solver
    raise Refused(f"no first step at {start:.9g} s: {solver.message}")


def _check_ranges(heat: Heat, temperature: Array) -> None:
    lows, highs = heat.error_range
    for p in range(len(lows)):
        own = temperature[heat.top_node[p] : heat.bottom_node[p] + 1]
        if own.min() < lows[p] or own.max() > highs[p]:
            raise Refused(f"a temperature leaves the tables of ply {heat.case.plies[p].name}, which say \"error\"")
    if not np.all(np.isfinite(temperature)) or temperature.max() > 1e4:
        raise Refused("a temperature above 10,000 K")


def shortest_scale_s(case: Case) -> float:
    """The shortest time between corners at the faces, which sets the first cells."""
    scale = case.duration_s
    for face in (case.hot, case.back):
        for key in ("held", "flux", "recovery", "enthalpy_film", "radiant", "film", "gas_k", "surroundings_k"):
            schedule = getattr(face, key)
            if schedule is None:
                continue
            corners = sorted({t for t in (0.0, *schedule.times_s, case.duration_s) if 0.0 <= t <= case.duration_s})
            gaps = [b - a for a, b in zip(corners, corners[1:]) if b - a > 1e-9 * case.duration_s]
            if schedule.times_s != (0.0,):
                scale = min([scale, *gaps])
    return scale


def solve(case: Case, times_s: Array, share: float = 0.1, work: float = 1e5) -> Result:
    """The case with an error of each result that the oracle vouches for: at most `share` of its tolerance.

    Each grid has twice the cells of the one before and half of its tolerance in time. Results of successive grids are
    extrapolated as of second order; the error is the change of the extrapolated result between two pairs of grids,
    which is also the true one where the order is only the first.

    What does not reach this error with the given work (steps on few nodes) is loose if it is within the tolerance, else
    refused. Work is counted, not timed, so that the same cases are refused everywhere.
    """
    target = share * case.tolerance_k
    tolerance, refinement = 0.5 * target, 0.4
    coarse: Result | None = None
    result: Result | None = None
    worst, steps, done, reason = np.inf, 0, 0.0, ""
    for _ in range(7):
        if coarse is not None and done + 1.8 * coarse.work > work:
            reason = f"{TOO_MUCH_WORK} on more than {coarse.nodes} nodes"
            break
        try:
            fine = integrate(case, refinement, tolerance, times_s, work - done)
        except Refused as refused:
            reason = str(refused)
            if result is None or not result.errors or TOO_MUCH_WORK not in reason:
                raise
            break
        steps += fine.steps
        done += fine.work
        refinement *= 2.0
        tolerance /= 2.0
        if coarse is not None:
            last, result = result, extrapolated(coarse, fine)
            if last is not None:
                compare(last, result)
                worst = max((error for name, error in result.errors.items() if _is_temperature(name)), default=0.0)
                result.work, result.steps = done, steps
                if worst <= target:
                    return result
        coarse = fine
    if result is None:
        raise Refused(reason)
    if worst <= case.tolerance_k:
        result.is_loose = True
        return result
    raise Refused(f"no convergence: {worst:.2g} K of {target:.2g} K on {result.nodes} nodes; {reason}")


def _is_temperature(name: str) -> bool:
    return not name.startswith(("time of", "heat", "balance", "final")) and "kg_m2" not in name


def extrapolated(coarse: Result, fine: Result) -> Result:
    """Richardson's extrapolation of two results."""
    result = Result(fine.times_s, {}, {}, {}, fine.steps, fine.nodes)
    for name, values in fine.traces.items():
        result.traces[name] = values + (values - coarse.traces[name]) / 3.0
    for name, value in fine.numbers.items():
        is_smooth = not name.startswith(("time of", "balance"))
        result.numbers[name] = value + (value - coarse.numbers[name]) / 3.0 if is_smooth else value
    return result


def compare(last: Result, result: Result) -> None:
    """Takes the change since the last result for the error."""
    for name, values in result.traces.items():
        result.errors[name] = float(np.nanmax(np.abs(values - last.traces[name])))
    for name, value in result.numbers.items():
        result.errors[name] = abs(value - last.numbers[name])
