"""The heat of a layup by the method of lines, in enthalpy.

A layup is cut into cells around nodes; a node lies on each face, on each sensor, and on both sides of each contact. The
state of a node is the heat of its cell, ∫ C dT / C₀, from which the temperature follows exactly, as C is piecewise
linear. Between two nodes of a ply flows the integral of the conductivity over temperature (Kirchhoff). Reactions have
their remaining reactant as state, sensors with a lag the temperature of their bead.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from air import (
    COLD_WALL_ENTHALPY_J_KG,
    GAS_CONSTANT,
    STEFAN_BOLTZMANN,
    pore_conductivity,
    wall_enthalpy,
)
from case_file import Case, Conductivity, Face, Material, Reaction
from quantities import Refused
from tables import HIGHEST_K, Array, Schedule, integral_at_starts, weighted_sum

Segments = tuple[Array, Array, Array]

# Gauss-Legendre points for the mean of a conductivity in parts between two temperatures.
_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(4)
_GAUSS_X, _GAUSS_W = 0.5 + 0.5 * _GAUSS_X, 0.5 * _GAUSS_W


class PiecewiseQuadratics:
    """Integrals of several piecewise linear functions, evaluated for many arguments at once."""

    def __init__(self, functions: list[Segments]) -> None:
        self.start = np.concatenate([f[0] for f in functions])
        self.value = np.concatenate([f[1] for f in functions])
        self.slope = np.concatenate([f[2] for f in functions])
        self.integral = np.concatenate([integral_at_starts(f) for f in functions])
        lengths = [len(f[0]) for f in functions]
        self.first = np.concatenate([[0], np.cumsum(lengths)[:-1]])
        self.last = np.cumsum(lengths) - 1
        number = np.repeat(np.arange(len(functions)), lengths)
        self.spacing = 2.0 * HIGHEST_K
        self.keys = self.start + self.spacing * number
        # Keys find the segment only; a rounded key is wrong by less than it matters on a continuous integral.
        self.height = 2.0 * max(float(np.max(self.integral)) * 2.0, 1.0)
        self.integral_keys = self.integral + self.height * number

    def segment(self, function: np.ndarray, argument: Array) -> np.ndarray:
        found = np.searchsorted(self.keys, argument + self.spacing * function, side="right") - 1
        return np.minimum(np.maximum(found, self.first[function]), self.last[function])

    def at(self, i: np.ndarray, argument: Array) -> tuple[Array, Array]:
        """Value and integral on given segments."""
        d = argument - self.start[i]
        slope = self.slope[i] * d
        value = self.value[i] + slope
        return value, self.integral[i] + d * (value - 0.5 * slope)

    def inverse(self, function: np.ndarray, integral: Array) -> tuple[Array, Array]:
        """The argument of an integral, and the value there."""
        found = np.searchsorted(self.integral_keys, integral + self.height * function, side="right") - 1
        i = np.minimum(np.maximum(found, self.first[function]), self.last[function])
        rest, value = integral - self.integral[i], self.value[i]
        square = value * value
        value_there = np.sqrt(np.maximum(square + 2.0 * self.slope[i] * rest, 1e-30 * square))
        return self.start[i] + 2.0 * rest / (value + value_there), value_there


class Conductor:
    """Conductivities of plies between neighbouring nodes."""

    def __init__(self, conductivities: list[Conductivity], ply: np.ndarray, left: np.ndarray) -> None:
        """`ply` of every part of a node, `left` part of every pair of neighbours."""
        self.ply, self.left = ply, left
        self.pair_ply = ply[left]
        self.conductivities = conductivities
        functions: list[Segments] = []
        self.levels: list[tuple[list[float], int]] = []
        self.is_tabled = np.zeros(len(conductivities), dtype=bool)
        for p, own in enumerate(conductivities):
            self.levels.append(([pressure for pressure, _ in own.tables], len(functions)))
            functions += [table.segments for _, table in own.tables]
            self.is_tabled[p] = bool(own.tables)
        self.tables = PiecewiseQuadratics(functions) if functions else None
        self.any_levels = any(len(own.tables) > 1 for own in conductivities)
        self.fixed_levels = None if self.any_levels else self.levels_at(101325.0)
        self.part_pairs = [
            (own, np.flatnonzero(self.pair_ply == p), np.flatnonzero(ply == p))
            for p, own in enumerate(conductivities)
            if not own.tables
        ]
        tabled = self.is_tabled[ply]
        self.tabled_parts = np.flatnonzero(tabled)
        self.all_tabled = bool(tabled.all())

    def levels_at(self, pressure_pa: float) -> tuple[np.ndarray, np.ndarray, Array]:
        """For every ply the tables below and above a pressure, and the weight of that above."""
        low = np.zeros(len(self.levels), dtype=int)
        high, weight = low.copy(), np.zeros(len(self.levels))
        for p, (pressures, first) in enumerate(self.levels):
            if not pressures:
                continue
            i = int(np.searchsorted(pressures, pressure_pa, side="right")) - 1
            if i < 0 or i == len(pressures) - 1:
                low[p] = high[p] = first + max(i, 0)
            else:
                low[p], high[p] = first + i, first + i + 1
                weight[p] = math.log(pressure_pa / pressures[i]) / math.log(pressures[i + 1] / pressures[i])
        return low, high, weight

    def __call__(self, temperature: Array, pressure_pa: float, slopes: bool) -> tuple[Array, Array]:
        """The integral of k from the right to the left node of every pair, W/m, and k at every part (if asked)."""
        integral, k = np.zeros(len(temperature)), np.zeros(len(temperature))
        if self.tables is not None:
            low, high, weight = self.fixed_levels or self.levels_at(pressure_pa)
            parts = slice(None) if self.all_tabled else self.tabled_parts
            ply, t = self.ply[parts], temperature[parts]
            k_low, i_low = self.tables.at(self.tables.segment(low[ply], t), t)
            if self.any_levels:
                k_high, i_high = self.tables.at(self.tables.segment(high[ply], t), t)
                w = weight[ply]
                k_low, i_low = k_low + w * (k_high - k_low), i_low + w * (i_high - i_low)
            integral[parts], k[parts] = i_low, k_low
        flux = integral[self.left] - integral[self.left + 1]
        for own, pairs, parts in self.part_pairs:
            left, right = temperature[self.left[pairs]], temperature[self.left[pairs] + 1]
            points = right + _GAUSS_X[:, None] * (left - right)
            flux[pairs] = (_GAUSS_W @ in_parts(own, points, pressure_pa)) * (left - right)
            if slopes:
                k[parts] = in_parts(own, temperature[parts], pressure_pa)
        return flux, k


def in_parts(own: Conductivity, temperature: Array, pressure_pa: float) -> Array:
    """The conductivity in three parts."""
    k = np.full_like(temperature, own.solid)
    if own.solid_exponent != 0.0:
        k *= (temperature / 300.0) ** own.solid_exponent
    for share, length_m in own.pores:
        k += share * pore_conductivity(temperature, pressure_pa, length_m)
    if own.extinction_1_m is not None:
        k += 16.0 * STEFAN_BOLTZMANN * temperature**3 / (3.0 * own.extinction_1_m)
    return k


@dataclass
class Reacting:
    """The parts of nodes in a ply that decomposes, and where their remaining reactants lie in the state."""

    material: Material
    parts: np.ndarray
    nodes: np.ndarray
    mass: Array  # kg/m² of virgin material
    index: np.ndarray  # reaction × part
    conductor: Conductor | None = None
    pairs: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))


def spacing(length_m: float, first_m: float, cells_min: int, refinement: float) -> Array:
    """Nodes of a ply: finer towards both ends, on one smooth curve for all refinements."""
    cells = cells_min
    beta = 0.0
    if first_m < length_m / cells:
        # sech² β · 2β ≈ 2 first/(length/cells); growth of neighbours ≈ 4 β / cells.
        for beta in np.arange(0.2, 9.0, 0.1):
            cells = max(cells_min, math.ceil(24.0 * beta))
            if length_m / cells * beta / math.cosh(beta) ** 2 / math.tanh(beta) <= first_m:
                break
    n = max(2, round(cells * refinement))
    s = np.linspace(-1.0, 1.0, n + 1)
    x = 0.5 + 0.5 * (s if beta == 0.0 else np.tanh(beta * s) / math.tanh(beta))
    x[0], x[-1] = 0.0, 1.0
    return length_m * x


class Heat:
    """Ordinary differential equations of a case on a grid."""

    def __init__(self, case: Case, refinement: float, time_scale_s: float) -> None:
        self.case = case
        self._grid(case, refinement, time_scale_s)
        self._capacities(case)
        self._readings(case)
        self._states(case)
        self.segment = (0.0, case.duration_s)
        self._forcings()

    # Set-up

    def _grid(self, case: Case, refinement: float, time_scale_s: float) -> None:
        tops = np.concatenate([[0.0], np.cumsum([ply.thickness_m for ply in case.plies])])
        self.tops = tops
        wanted = [sensor.depth_m for sensor in case.sensors if sensor.depth_m is not None]
        wanted += [depth for depth, _ in case.initial]
        node_x: list[float] = []
        part_node: list[int] = []
        part_ply: list[int] = []
        part_width: list[float] = []
        left: list[int] = []
        distance: list[float] = []
        self.contacts: list[tuple[int, int, float]] = []
        self.top_node: list[int] = []
        self.bottom_node: list[int] = []
        second_parts: list[int] = []
        for p, ply in enumerate(case.plies):
            low, high = tops[p], tops[p + 1]
            close = 1e-9 * (high - low)
            cuts = sorted({low, high, *(x for x in wanted if low + close < x < high - close)})
            k, c = self._scales(ply.material, case)
            first = 0.3 * math.sqrt(k / c * time_scale_s)
            points = [low]
            for a, b in zip(cuts, cuts[1:]):
                diffusive = (b - a) / math.sqrt(k / c * case.duration_s)
                cells = 4 if b - a < 0.2 * first else 10 if diffusive < 0.02 or b - a < first else 40
                x = a + spacing(b - a, first, cells, refinement)
                points += list(x[1:-1]) + [b]
            # Widths from the distances within the ply, which depths from the hot face would round.
            inner = np.diff(points)
            widths = np.concatenate([[inner[0] / 2], (inner[1:] + inner[:-1]) / 2, [inner[-1] / 2]])
            shares = p > 0 and case.plies[p - 1].contact_below is None
            base = len(node_x) - 1 if shares else len(node_x)
            if p > 0 and not shares:
                conductance = case.plies[p - 1].contact_below
                assert conductance is not None
                self.contacts.append((base - 1, base, conductance))
            if shares:
                second_parts.append(len(part_node))
            node_x += points[1:] if shares else points
            self.top_node.append(base)
            self.bottom_node.append(base + len(points) - 1)
            first_part = len(part_node)
            part_node += range(base, base + len(points))
            part_ply += [p] * len(points)
            part_width += list(widths)
            left += range(first_part, first_part + len(points) - 1)
            distance += list(inner)
        self.node_x = np.array(node_x)
        self.nodes = len(node_x)
        self.part_node, self.part_ply = np.array(part_node), np.array(part_ply)
        self.part_width, self.left = np.array(part_width), np.array(left)
        self.inverse_distance = 1.0 / np.array(distance)
        self.second_parts = np.array(second_parts, dtype=int)
        self.second_nodes = self.part_node[self.second_parts]
        mask = np.ones(len(part_node), dtype=bool)
        mask[self.second_parts] = False
        self.first_parts = np.flatnonzero(mask)
        self.node_width = self.part_width[self.first_parts].copy()
        self.node_width[self.second_nodes] += self.part_width[self.second_parts]
        self.pair_node = self.part_node[self.left]
        virgin = [ply.material.virgin.conductivity for ply in case.plies]
        self.conductor = Conductor(virgin, self.part_ply, self.left)
        initial_x = np.array([x for x, _ in case.initial])
        initial_t = np.array([t for _, t in case.initial])
        self.initial = np.interp(self.node_x, initial_x, initial_t)

    @staticmethod
    def _scales(material: Material, case: Case) -> tuple[float, float]:
        """Some conductivity and heat capacity of a ply."""
        own = material.virgin.conductivity
        k = float(own.tables[-1][1].at(600.0)) if own.tables else float(in_parts(own, np.array([600.0]), 1e5)[0])
        return k, material.density * float(material.virgin.heat_capacity.at(600.0))

    def _capacities(self, case: Case) -> None:
        """Groups of nodes with one function C(T) each: those of a ply, and each node that two plies share."""
        functions: list[Segments] = []
        group = np.zeros(self.nodes, dtype=int)
        weight = np.zeros(self.nodes)  # J/m²/K per unit of the function
        self.reference = np.zeros(self.nodes)
        for p, ply in enumerate(case.plies):
            segments = weighted_sum([(ply.material.density, ply.material.virgin.heat_capacity)])
            scale = float(np.interp(400.0, segments[0], segments[1]))
            nodes = self.part_node[self.part_ply == p]
            group[nodes] = len(functions)
            weight[nodes] = scale * self.part_width[self.part_ply == p]
            functions.append((segments[0], segments[1] / scale, segments[2] / scale))
        for part in self.second_parts:
            node, p = self.part_node[part], self.part_ply[part]
            upper, lower = case.plies[p - 1].material, case.plies[p].material
            widths = self.part_width[part - 1], self.part_width[part]
            segments = weighted_sum(
                [
                    (widths[0] * upper.density, upper.virgin.heat_capacity),
                    (widths[1] * lower.density, lower.virgin.heat_capacity),
                ]
            )
            scale = float(np.interp(400.0, segments[0], segments[1]))
            group[node] = len(functions)
            weight[node] = scale
            functions.append((segments[0], segments[1] / scale, segments[2] / scale))
        self.capacity = PiecewiseQuadratics(functions)
        self.group, self.weight = group, weight
        self.error_range = [
            max(t.error_range_k[0] for t in self._tables(ply.material)) for ply in case.plies
        ], [min(t.error_range_k[1] for t in self._tables(ply.material)) for ply in case.plies]

    @staticmethod
    def _tables(material: Material) -> list:
        own = material.virgin
        return [own.heat_capacity, own.emissivity, *(table for _, table in own.conductivity.tables)]

    def _readings(self, case: Case) -> None:
        """The two nodes that each sensor reads."""
        self.read: list[tuple[int, int]] = []
        for sensor in case.sensors:
            p, depth = sensor.below, sensor.depth_m
            if p is None:
                assert depth is not None
                node = int(np.argmin(np.abs(self.node_x - depth)))
                if abs(self.node_x[node] - depth) > 1e-9 * self.tops[-1]:
                    raise Refused(f"sensor {sensor.name} lies outside the layup")
                same = np.flatnonzero(np.abs(self.node_x - self.node_x[node]) < 1e-12 * self.tops[-1])
                above, below = int(same[0]), int(same[-1])
            elif p == len(case.plies) - 1:
                above = below = self.bottom_node[p]
            else:
                above, below = self.bottom_node[p], self.top_node[p + 1]
            sides = {"both": (above, below), "above": (above, above), "below": (below, below)}
            self.read.append(sides[sensor.side])

    def _states(self, case: Case) -> None:
        """Positions of temperatures, beads and reactants in the state, in the order of depth."""
        order: list[tuple[int, int, str, int, int]] = []
        held = {0} if case.hot.held else set()
        if case.back.held:
            held.add(self.nodes - 1)
        self.free = np.array([node for node in range(self.nodes) if node not in held])
        self.held = sorted(held)
        order += [(int(node), 0, "u", int(node), 0) for node in self.free]
        self.lagged = [s for s, sensor in enumerate(case.sensors) if sensor.time_constant_s > 0.0]
        order += [(self.read[s][0], 1, "b", s, 0) for s in self.lagged]
        decomposing = [p for p, ply in enumerate(case.plies) if ply.material.reactions]
        for p in decomposing:
            for part in np.flatnonzero(self.part_ply == p):
                order += [
                    (int(self.part_node[part]), 2 + p, "r", int(part), j)
                    for j in range(len(case.plies[p].material.reactions))
                ]
        order.sort(key=lambda entry: entry[:2])
        position = {entry[2:]: i for i, entry in enumerate(order)}
        self.size = len(order)
        self.u = np.array([position["u", int(node), 0] for node in self.free])
        self.place = np.full(self.nodes, -1)
        self.place[self.free] = self.u
        self.bead = np.array([position["b", s, 0] for s in self.lagged], dtype=int)
        self.reacting: list[Reacting] = []
        for p in decomposing:
            material = case.plies[p].material
            parts = np.flatnonzero(self.part_ply == p)
            index = np.array(
                [[position["r", int(part), j] for part in parts] for j in range(len(material.reactions))]
            )
            pairs = np.flatnonzero(self.part_ply[self.left] == p)
            char = material.char
            conductor = None
            if char is not None and char.conductivity != material.virgin.conductivity:
                conductor = Conductor([char.conductivity], np.zeros(len(parts), dtype=int), np.arange(len(parts) - 1))
            mass = material.density * self.part_width[parts]
            self.reacting.append(Reacting(material, parts, self.part_node[parts], mass, index, conductor, pairs))
        self.has_gas = bool(self.reacting)
        # Band: neighbouring nodes, and what lies at a node.
        distances = [1]
        for a in range(self.nodes - 1):
            if self.place[a] >= 0 and self.place[a + 1] >= 0:
                distances.append(abs(int(self.place[a + 1] - self.place[a])))
        for bead, s in zip(self.bead, self.lagged):
            distances += [abs(int(self.place[node] - bead)) for node in self.read[s] if self.place[node] >= 0]
        for reacting in self.reacting:
            places = self.place[reacting.nodes]
            distances += list(np.abs(reacting.index - places)[:, places >= 0].ravel())
        self.band = int(max(distances))

    def _forcings(self) -> None:
        case = self.case
        self.schedules: dict[str, Schedule] = {"pressure": case.pressure}
        for name, face in (("hot", case.hot), ("back", case.back)):
            for key in ("held", "flux", "recovery", "enthalpy_film", "radiant", "film", "gas_k", "surroundings_k"):
                schedule = getattr(face, key)
                if schedule is not None:
                    self.schedules[f"{name}.{key}"] = schedule
        if case.holder is not None:
            self.schedules["holder"] = case.holder[1]
        self.enter(0.0, case.duration_s)

    @property
    def corners_s(self) -> list[float]:
        """The times at which a schedule bends or jumps, or the pressure passes that of a table."""
        times = {0.0, self.case.duration_s}
        for schedule in self.schedules.values():
            times.update(schedule.times_s)
        for own in self.conductor.conductivities:
            for pressure, _ in own.tables[: len(own.tables) if len(own.tables) > 1 else 0]:
                times.update(self.case.pressure.crossings_s(pressure))
        return sorted(t for t in times if 0.0 <= t <= self.case.duration_s)

    def enter(self, start_s: float, end_s: float) -> None:
        """Takes the straight lines of all schedules between two corners."""
        self.segment = (start_s, end_s)
        self.ends = {name: (s.after(start_s), s.before(end_s)) for name, s in self.schedules.items()}

    def forcing(self, name: str, t: Any) -> Any:
        a, b = self.ends[name]
        start, end = self.segment
        return a if a == b else a + (b - a) * (t - start) / (end - start)

    # Evaluation

    def initial_state(self) -> Array:
        y = np.zeros(self.size)
        i = self.capacity.segment(self.group, self.initial)
        y[self.u] = self.capacity.at(i, self.initial)[1][self.free]
        for bead, s in zip(self.bead, self.lagged):
            a, b = self.read[s]
            y[bead] = 0.5 * (self.initial[a] + self.initial[b])
        for reacting in self.reacting:
            y[reacting.index] = 1.0
        return y

    def temperatures(self, t: Any, y: Array) -> tuple[Array, Array]:
        """Temperature and heat capacity (over its reference) of every node, at one time or several."""
        group = self.group if y.ndim == 1 else self.group[:, None]
        if not self.held:
            return self.capacity.inverse(group, y[self.u])
        temperature = np.empty((self.nodes, *y.shape[1:]))
        value = np.ones_like(temperature)
        temperature[self.free], value[self.free] = self.capacity.inverse(group[self.free], y[self.u])
        for node in self.held:
            temperature[node] = self.forcing("hot.held" if node == 0 else "back.held", t)
        return temperature, value

    def face_flux(self, name: str, face: Face, t: Any, surface_k: Any, emissivity: Any) -> tuple[Any, Any]:
        """Heat into an open face, and its slope, at one time or several."""
        film = self.forcing(f"{name}.film", t)
        flux = film * (self.forcing(f"{name}.gas_k", t) - surface_k)
        slope = -film
        if face.enthalpy_film is not None:
            enthalpy, rise = wall_enthalpy(surface_k)
            enthalpy_film = self.forcing(f"{name}.enthalpy_film", t)
            flux += enthalpy_film * (self.forcing(f"{name}.recovery", t) - enthalpy)
            slope = slope - enthalpy_film * rise
        elif face.flux.acts:
            cold = self.forcing(f"{name}.flux", t)
            if face.recovery is None:
                flux += cold
            else:
                enthalpy, rise = wall_enthalpy(surface_k)
                over = self.forcing(f"{name}.recovery", t) - COLD_WALL_ENTHALPY_J_KG
                flux += cold * (1.0 - (enthalpy - COLD_WALL_ENTHALPY_J_KG) / over)
                slope = slope - cold * rise / over
        if face.radiates:
            surroundings = self.forcing(f"{name}.surroundings_k", t)
            flux += emissivity * self.forcing(f"{name}.radiant", t)
            flux += emissivity * STEFAN_BOLTZMANN * (surroundings**4 - surface_k**4)
            slope = slope - 4.0 * emissivity * STEFAN_BOLTZMANN * surface_k**3
        return flux, slope

    def emissivity(self, y: Array, face: Face, is_hot: bool, surface_k: Any) -> Any:
        """Of a face, in one state or in several side by side."""
        table = face.emissivity
        if table is None:
            return 0.0
        own = self.case.plies[0 if is_hot else -1].material
        virgin = table.at(surface_k)
        if table is not own.virgin.emissivity or own.char is None:
            return virgin
        end = 0 if is_hot else -1
        reacting = next(r for r in self.reacting if r.nodes[end] == (0 if is_hot else self.nodes - 1))
        char, remains = self.char_fraction(reacting, y)
        phi, other = char[end], own.char.emissivity.at(surface_k)
        if own.by_volume:
            return (1.0 - phi) * virgin + phi * other
        return ((1.0 - phi) * virgin + phi * remains * other) / (1.0 - phi + phi * remains)

    @staticmethod
    def char_fraction(reacting: Reacting, y: Array) -> tuple[Array, float]:
        """Volume fraction of char of every part, and the share of the mass that remains as char."""
        losses = np.array([reaction.mass_loss for reaction in reacting.material.reactions])
        total = float(losses.sum())
        phi = np.tensordot(losses / total, 1.0 - np.clip(y[reacting.index], 0.0, 1.0), axes=1)
        return phi, 1.0 - total

    @staticmethod
    def log_constant(reaction: Reaction, temperature: Array) -> Array:
        """Logarithm of the rate constant, 1/s; minus infinity below the onset."""
        log = math.log(reaction.pre_exponential_1_s) - reaction.activation_j_mol / (GAS_CONSTANT * temperature)
        return np.where(temperature >= reaction.onset_k, log, -np.inf)

    @staticmethod
    def rates(reacting: Reacting, y: Array, temperature: Array) -> Array:
        """−dr/dt of every reaction and part, 1/s; rates in logarithms, so that they underflow to zero.

        A step may leave r below zero, by its tolerance. There the rate has the other sign: with zero, the predictor of
        a stiff reaction would carry r away from zero, as the matrix of Newton's method allows it no correction.
        """
        rates = np.zeros_like(y[reacting.index])
        with np.errstate(divide="ignore", under="ignore"):
            for j, reaction in enumerate(reacting.material.reactions):
                r = y[reacting.index[j]]
                exponent = Heat.log_constant(reaction, temperature)
                exponent = exponent + reaction.order * np.log(np.abs(r)) if reaction.order != 0.0 else exponent
                rate = np.exp(np.minimum(exponent, 300.0))
                rates[j] = np.where(r > 0.0, rate, -rate if reaction.order != 0.0 else 0.0)
        return rates

    def evaluate(self, t: float, y: Array, jacobian: bool) -> tuple[Array, Array]:
        """The right-hand side, and its banded Jacobian if asked."""
        case = self.case
        temperature, value = self.temperatures(t, y)
        pressure = self.forcing("pressure", t)
        parts = temperature[self.part_node]
        integral, k = self.conductor(parts, pressure, jacobian)
        ratio = np.ones(self.nodes)
        if self.has_gas:
            carried = np.zeros(self.nodes)
            needed = np.zeros(self.nodes)
            for reacting in self.reacting:
                phi, remains = self.char_fraction(reacting, y)
                material = reacting.material
                assert material.char is not None
                own_t = parts[reacting.parts]
                if reacting.conductor is not None or not material.by_volume:
                    if material.by_volume:
                        share = phi
                    else:
                        share = phi * remains / (1.0 - phi + phi * remains)
                    if reacting.conductor is not None:
                        other, other_k = reacting.conductor(own_t, pressure, jacobian)
                        mean = 0.5 * (share[1:] + share[:-1])
                        integral[reacting.pairs] += mean * (other - integral[reacting.pairs])
                        k[reacting.parts] += share * (other_k - k[reacting.parts])
                virgin_c = reacting.mass * material.virgin.heat_capacity.at(own_t)
                char_c = reacting.mass * remains * material.char.heat_capacity.at(own_t)
                np.add.at(carried, reacting.nodes, phi * (char_c - virgin_c))
            needed = carried / (self.weight * value)
            ratio = 1.0 / (1.0 + needed)
        flux = integral * self.inverse_distance
        of_parts = np.zeros(len(parts))
        of_parts[self.left] -= flux
        of_parts[self.left + 1] += flux
        net = of_parts[self.first_parts]
        net[self.second_nodes] += of_parts[self.second_parts]
        diagonal = np.zeros(self.nodes)
        upper, lower = np.zeros(self.nodes), np.zeros(self.nodes)  # dR_i/dT_{i+1} at i; dR_i/dT_{i-1} at i
        if jacobian:
            to_left, to_right = k[self.left] * self.inverse_distance, k[self.left + 1] * self.inverse_distance
            diagonal[self.pair_node] -= to_left
            diagonal[self.pair_node + 1] -= to_right
            upper[self.pair_node] += to_right
            lower[self.pair_node + 1] += to_left
        for a, b, conductance in self.contacts:
            through = conductance * (temperature[a] - temperature[b])
            net[a] -= through
            net[b] += through
            if jacobian:
                diagonal[a] -= conductance
                diagonal[b] -= conductance
                upper[a] += conductance
                lower[b] += conductance
        if case.holder is not None:
            conductance = case.holder[0] * self.node_width
            net += conductance * (self.forcing("holder", t) - temperature)
            diagonal -= conductance
        for name, face, node in (("hot", case.hot, 0), ("back", case.back, self.nodes - 1)):
            if face.held is None:
                surface = float(temperature[node])
                emissivity = self.emissivity(y, face, name == "hot", surface)
                q, slope = self.face_flux(name, face, t, surface, float(emissivity))
                net[node] += q
                diagonal[node] += slope
        derivative = np.zeros(self.size)
        reaction_terms: list[tuple[Reacting, Array]] = []
        if self.has_gas:
            source = np.zeros(self.nodes)
            for reacting in self.reacting:
                rates = self.rates(reacting, y, parts[reacting.parts])
                derivative[reacting.index] = -rates
                losses = np.array([r.mass_loss for r in reacting.material.reactions])
                heats = np.array([r.mass_loss * r.heat_j_kg for r in reacting.material.reactions])
                np.add.at(source, reacting.nodes, reacting.mass * (losses @ rates))
                np.subtract.at(net, reacting.nodes, reacting.mass * (heats @ rates))
                if jacobian:
                    for j, reaction in enumerate(reacting.material.reactions):
                        slope = rates[j] * reaction.activation_j_mol / (GAS_CONSTANT * parts[reacting.parts] ** 2)
                        np.subtract.at(diagonal, reacting.nodes, reacting.mass * heats[j] * slope)
                reaction_terms.append((reacting, rates))
            through = np.cumsum(source[::-1])[::-1]  # through the upper side of each node, towards the hot face
            if case.gas_flow == "quasi-steady":
                enthalpy = case.gas_enthalpy.at(temperature)
                step = 0.5 * through[1:] * np.diff(enthalpy)
                net[:-1] += step
                net[1:] += step
        speed = ratio / self.weight
        derivative[self.u] = (net * speed)[self.free]
        for bead, s in zip(self.bead, self.lagged):
            a, b = self.read[s]
            reading = 0.5 * (temperature[a] + temperature[b])
            derivative[bead] = (reading - y[bead]) / case.sensors[s].time_constant_s
        if not jacobian:
            return derivative, np.zeros((0, 0))
        return derivative, self._jacobian(y, value, speed, diagonal, upper, lower, reaction_terms, parts)

    def _jacobian(
        self,
        y: Array,
        value: Array,
        speed: Array,
        diagonal: Array,
        upper: Array,
        lower: Array,
        reaction_terms: list[tuple[Reacting, Array]],
        parts: Array,
    ) -> Array:
        packed = np.zeros((2 * self.band + 1, self.size))

        def put(rows: np.ndarray, columns: np.ndarray, values: Array) -> None:
            kept = (rows >= 0) & (columns >= 0)
            packed[self.band + rows[kept] - columns[kept], columns[kept]] += values[kept]

        place, per_u = self.place, 1.0 / value
        put(place, place, diagonal * speed * per_u)
        put(place[:-1], place[1:], upper[:-1] * speed[:-1] * per_u[1:])
        put(place[1:], place[:-1], lower[1:] * speed[1:] * per_u[:-1])
        for bead, s in zip(self.bead, self.lagged):
            rate = 1.0 / self.case.sensors[s].time_constant_s
            packed[self.band, bead] -= rate
            for node in self.read[s]:
                put(np.array([bead]), place[[node]], 0.5 * rate * per_u[[node]])
        for reacting, rates in reaction_terms:
            nodes = reacting.nodes
            for j, reaction in enumerate(reacting.material.reactions):
                by_t = rates[j] * reaction.activation_j_mol / (GAS_CONSTANT * parts[reacting.parts] ** 2)
                log_r = np.log(np.maximum(np.abs(y[reacting.index[j]]), 1e-12))
                log_by_r = self.log_constant(reaction, parts[reacting.parts]) + (reaction.order - 1.0) * log_r
                by_r = reaction.order * np.exp(np.minimum(log_by_r, 300.0))
                put(reacting.index[j], place[nodes], -by_t * per_u[nodes])
                put(reacting.index[j], reacting.index[j], -by_r)
                heat = reacting.mass * reaction.mass_loss * reaction.heat_j_kg * speed[nodes]
                put(place[nodes], reacting.index[j], -heat * by_r)
        return packed

    # Quantities

    def mass_lost(self, y: Array) -> Any:
        """Solid mass that has become gas in one state or several, kg/m²."""
        lost = np.zeros(y.shape[1:])
        for reacting in self.reacting:
            losses = np.array([reaction.mass_loss for reaction in reacting.material.reactions])
            lost = lost + reacting.mass @ np.tensordot(losses, 1.0 - y[reacting.index], axes=1)
        return lost

    def gas_made(self, y: Array, temperature: Array) -> Any:
        """Gas made in the layup in one state or several, kg/m²/s."""
        made = np.zeros(y.shape[1:])
        for reacting in self.reacting:
            losses = np.array([reaction.mass_loss for reaction in reacting.material.reactions])
            rates = self.rates(reacting, y, temperature[reacting.nodes])
            made = made + reacting.mass @ np.tensordot(losses, rates, axes=1)
        return made

    def stored_heat(self, y: Array) -> float:
        """Heat of all cells that are not held, J/m² (of virgin material)."""
        return float(np.sum((self.weight[self.free]) * y[self.u]))
