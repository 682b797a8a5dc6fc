"""A march of plies that decompose, by the text of docs/theory; it takes nothing from the program.

It takes the cells and steps that a case states, marches both resolutions, and extrapolates. It shows that the pages are
complete: what they say gives the digits that bondline writes. Names are those of docs/theory/symbols.md; values are in
SI. Left out are what the pages treat apart: steep tables, conductivities in parts or over pressure, factors, holders.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.linalg import solve_banded
from tables import Array, Schedule, Table

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
GAMMA_P = 1.0 + 1.0 / math.sqrt(2.0)
GAS_CONSTANT = 8.314462618
STEFAN_BOLTZMANN = 5.670374419e-8
COLD_WALL_K = 300.0
SLIP_PA_M_K = 9.332e-5
DAMPING_SHARE = 0.3
AIR = Table(
    (300.0, 600.0, 900.0, 1200.0, 1500.0, 1700.0, 2000.0),
    (2e3, 310e3, 636e3, 980e3, 1338e3, 1582e3, 1954e3),
    "extrapolate",
)


@dataclass(frozen=True)
class State:
    """Virgin material or a residue. `enthalpy` is that at the reference temperature, of absolute heats."""

    heat_capacity: Table
    conductivity: Table
    emissivity: float = 0.0
    porosity: float = 0.0
    permeability: float = 0.0
    slip: float = 0.0
    forchheimer: float = 0.0
    enthalpy: float = 0.0


@dataclass(frozen=True)
class Reaction:
    loss: float
    rate: float
    activation: float
    order: float
    heat: float = 0.0
    onset: float = 0.0


@dataclass(frozen=True)
class Material:
    density: float
    states: tuple[State, ...]
    reactions: tuple[Reaction, ...] = ()
    is_consecutive: bool = False
    by_volume: bool = False
    shrinkage: float = 0.0
    reference: float | None = None  # of absolute enthalpies


@dataclass(frozen=True)
class Gas:
    enthalpy: Table
    molar_mass: Table = Table.constant(0.025)
    viscosity: Table = Table.constant(3e-5)


@dataclass(frozen=True)
class Face:
    """Open, or held. Without any of these it is insulated."""

    held: Schedule | None = None
    flux: Schedule | None = None
    recovery: Schedule | None = None
    blowing: float = 0.0
    film: Schedule | None = None
    gas: Schedule | None = None
    radiant: Schedule | None = None
    radiates: bool = False
    surroundings: float = 300.0


@dataclass(frozen=True)
class Layup:
    plies: tuple[tuple[Material, float], ...]
    contacts: tuple[float | None, ...]
    sensors: tuple[float, ...]  # depths inside plies or on faces
    duration: float
    initial: float
    hot: Face
    gas: Gas
    flow: str
    cells: int
    first_step: float
    step_growth: float
    max_step: float
    interval: float
    back: Face = Face()
    pressure: Schedule = Schedule.constant(101325.0)
    back_pressure: Schedule | None = None

    def corners(self) -> set[float]:
        found = {0.0, self.duration}
        for face in (self.hot, self.back):
            for schedule in (face.held, face.flux, face.recovery, face.film, face.gas, face.radiant):
                found.update(schedule.times_s if schedule else ())
        for schedule in (self.pressure, self.back_pressure):
            found.update(schedule.times_s if schedule else ())
        return {t for t in found if 0.0 <= t <= self.duration}


class Property:
    """A table with its slope and its integral as the march has them: from node to node."""

    def __init__(self, table: Table, nodes: Array) -> None:
        self.nodes, self.values = nodes, np.asarray(table.at(nodes))
        rise = np.empty_like(self.values)
        rise[1:-1] = (self.values[2:] - self.values[:-2]) / (nodes[2:] - nodes[:-2])
        rise[0] = (self.values[1] - self.values[0]) / (nodes[1] - nodes[0])
        rise[-1] = (self.values[-1] - self.values[-2]) / (nodes[-1] - nodes[-2])
        self.rise = rise
        pieces = 0.5 * (self.values[1:] + self.values[:-1]) * np.diff(nodes)
        self.sums = np.concatenate([[0.0], np.cumsum(pieces)])

    def at(self, t: Array) -> Array:
        value: Array = np.interp(t, self.nodes, self.values)
        return value

    def slope(self, t: Array) -> Array:
        slope: Array = np.interp(t, self.nodes, self.rise)
        return slope

    def integral(self, t: Array) -> Array:
        i = np.clip(np.searchsorted(self.nodes, t, side="right") - 1, 0, len(self.nodes) - 2)
        past: Array = 0.5 * (self.values[i] + self.at(t)) * (t - self.nodes[i])
        return self.sums[i] + past


def grid(layup: Layup, halvings: int) -> tuple[Array, Array, Array, list[slice]]:
    """Faces of the cells, their nodes, the faces that sensors lie on, and the cells of each ply."""
    roots = []
    for material, thickness in layup.plies:
        virgin = material.states[0]
        k, c = float(virgin.conductivity.at(layup.initial)), float(virgin.heat_capacity.at(layup.initial))
        roots.append(thickness * math.sqrt(material.density * c / k))
    weights = [root**0.75 for root in roots]
    faces, nodes, plies = [0.0], list[float](), list[slice]()
    position, top = 0.3 * sum(roots), 0.0
    for p, ((_, thickness), root) in enumerate(zip(layup.plies, roots)):
        spread = math.sqrt((position + root) / position)

        def depth(u: float) -> float:
            return top + thickness * u * (2.0 + u * (spread - 1.0)) / (spread + 1.0)

        def share(x: float) -> float:
            y = (x - top) / thickness * (spread + 1.0)
            return y / (1.0 + math.sqrt(1.0 + y * (spread - 1.0)))

        first = len(nodes)
        number = max(0.5 * layup.cells * weights[p] / sum(weights), 2.0)
        inside = [x for x in layup.sensors if top + 1e-9 < x < top + thickness - 1e-9]
        marks = [top, *sorted(inside), top + thickness]
        for place, (a, b) in enumerate(zip(marks, marks[1:])):
            hot = p == 0 and place == 0
            back = p == len(layup.plies) - 1 and place == len(marks) - 2
            ua, ub = share(a), share(b)
            count = max(int(number * (ub - ua) + 0.5), 2) * 2**halvings
            widths = [1.0] * count
            if hot and back:
                widths = [0.5, *[1.0] * (count - 1), 0.5]
            elif hot:
                widths[0], widths[-1] = 0.5, 1.5
            elif back:
                widths[0], widths[-1] = 1.5, 0.5
            ends = np.concatenate([[0.0], np.cumsum(widths)])
            for i, (upper, lower) in enumerate(zip(ends, ends[1:])):
                node = 0.5 * (upper + lower)
                node = upper if hot and i == 0 else lower if back and i == len(widths) - 1 else node
                nodes.append(depth(ua + (ub - ua) * node / count))
                faces.append(depth(ua + (ub - ua) * lower / count))
        plies.append(slice(first, len(nodes)))
        position, top = position + root, top + thickness
    all_faces = np.array(faces)
    read = np.array([int(np.argmin(np.abs(all_faces - x))) for x in layup.sensors])
    return all_faces, np.array(nodes), read, plies


def times(layup: Layup, halvings: int) -> tuple[Array, Array]:
    """Ends of the steps, and the instants of a trace."""
    corners = sorted(layup.corners())
    instants = np.arange(0.0, layup.duration - 1e-9, layup.interval).tolist() + [layup.duration]
    ends = sorted({round(t, 12) for t in (*corners, *instants)})
    first, share, largest = 2.0 * layup.first_step, 2.0 * layup.step_growth, 2.0 * layup.max_step
    found = [0.0]
    for start, end in zip(ends, ends[1:]):
        corner = max(t for t in corners if t <= start + 1e-9)
        since, counts, counted = start - corner, [0.0], [start - corner]
        while since < end - corner:
            step = min(max(share * since, first), largest)
            counts.append(counts[-1] + min((end - corner - since) / step, 1.0))
            since = min(since + step, end - corner)
            counted.append(since)
        whole = max(math.ceil(counts[-1] - 1e-6), 1)
        inner = np.interp(counts[-1] * np.arange(1, whole) / whole, counts, counted) + corner
        for t in [*inner, end]:
            last = found[-1]
            found += [last + (t - last) * part / 2**halvings for part in range(1, 2**halvings)] + [t]
    return np.array(found), np.array(instants)


class Cells:
    """A ply on its cells: composition and properties."""

    def __init__(self, material: Material, gas: Gas, where: slice, width: Array) -> None:
        self.material, self.where, self.width = material, where, width
        tables = [table for s in material.states for table in (s.heat_capacity, s.conductivity)]
        tables += [gas.enthalpy, gas.molar_mass, gas.viscosity]
        corners = {t for table in tables if len(table.values) > 1 for t in table.temperatures_k}
        nodes = np.array(sorted(corners | {5.0 * i for i in range(801)}))
        self.c = [Property(s.heat_capacity, nodes) for s in material.states]
        self.k = [Property(s.conductivity, nodes) for s in material.states]
        self.h_g, self.m, self.mu = (Property(t, nodes) for t in (gas.enthalpy, gas.molar_mass, gas.viscosity))
        self.reactions = material.reactions
        total = sum(r.loss for r in self.reactions)
        count = len(self.reactions)
        if material.is_consecutive:
            self.paths = [(j, j + 1) for j in range(count)]
            self.d = np.ones(count)
            losses = np.cumsum([r.loss for r in self.reactions])
            self.y = np.array([1.0, *(1.0 - losses)])
        else:
            self.paths = [(0, 1)] * count
            self.d = np.array([r.loss / total for r in self.reactions])
            self.y = np.array([1.0, 1.0 - total][: len(material.states)])
        n = len(width)
        self.xi = np.zeros((count, n))
        self.v1 = self.volumes(self.xi)
        self.v2 = self.v1
        self.pi, self.a, self.theta = np.zeros(n), np.zeros(n), np.zeros(n)  # means of the step before, slope of a

    def volumes(self, xi: Array) -> Array:
        v = np.zeros((len(self.material.states), len(self.width)))
        v[0] = 1.0
        for j, (a, b) in enumerate(self.paths):
            v[a] -= self.d[j] * xi[j]
            v[b] += self.d[j] * xi[j]
        return v

    def mass_ratio(self, v: Array) -> Array:
        ratio: Array = self.y @ v
        return ratio

    def conversion(self, v: Array) -> Array:
        if not self.reactions:
            return np.zeros(len(self.width))
        lost: Array = (1.0 - self.mass_ratio(v)) / (1.0 - self.y[-1])
        return lost

    def thickness_ratio(self, v: Array) -> Array:
        ratio: Array = 1.0 - self.material.shrinkage * self.conversion(v)
        return ratio

    def conductivity(self, t: Array, v: Array) -> tuple[Array, Array]:
        """Conductivity on the virgin cells, and its slope."""
        by_volume = self.material.by_volume
        weights = v if by_volume else v * self.y[:, None]
        whole = self.thickness_ratio(v) * (1.0 if by_volume else self.mass_ratio(v))
        k = sum(weight * own.at(t) for weight, own in zip(weights, self.k)) / whole
        slope = sum(weight * own.slope(t) for weight, own in zip(weights, self.k)) / whole
        return np.asarray(k), np.asarray(slope)

    def capacity(self, t: Array, v: Array) -> Array:
        """Heat capacity of the cells without their gas."""
        c = sum(y * part * own.at(t) for y, part, own in zip(self.y, v, self.c))
        return np.asarray(self.material.density * self.width * c)

    def emissivity(self, v: Array, i: int) -> float:
        own = np.array([s.emissivity for s in self.material.states])
        weights = v[:, i] if self.material.by_volume else v[:, i] * self.y
        return min(float(weights @ own) / (1.0 if self.material.by_volume else float(weights.sum())), 1.0)

    def pores(self, t: Array, xi: Array) -> tuple[Array, Array, Array, Array]:
        """Stored mass over pressure, mobility, slip pressure, inertia."""
        v = self.volumes(xi)
        ratio, states = self.thickness_ratio(v), self.material.states

        def mean(values: list[float]) -> Array:
            result: Array = np.array(values) @ v
            return result

        porosity, permeability = mean([s.porosity for s in states]), mean([s.permeability for s in states])
        over_t = self.m.at(t) / (GAS_CONSTANT * t)
        speed = permeability / (ratio * self.mu.at(t))
        storage = np.maximum(self.width * ratio * porosity * over_t, 1e-18)
        slip = mean([s.slip for s in states]) * t
        return storage, speed * over_t, slip, 4.0 * mean([s.forchheimer for s in states]) * speed**2 * over_t

    def react(self, t: Array, rise: Array, step: float, next_step: float, duration: float) -> None:
        """Reactions over a step, from the temperatures at its start and the increments of stage one."""
        middle = t + 0.5 * rise
        h_g = self.h_g.at(t) + 0.5 * rise * self.h_g.slope(t)
        reference = self.material.reference
        h = []
        if reference is not None:
            for s, c in zip(self.material.states, self.c):
                start = s.enthalpy + c.integral(t) - c.integral(np.array(reference))
                h.append(start + 0.5 * rise * c.at(t))
        before, inflow = np.ones_like(t), np.zeros_like(t)
        xi2, xi1 = self.xi.copy(), self.xi.copy()
        made, absorbed, slope = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
        for j, (reaction, (a, b)) in enumerate(zip(self.reactions, self.paths)):
            start = self.xi[j].copy()
            exponent = math.log(reaction.rate) - reaction.activation / (GAS_CONSTANT * middle)
            integral = step * np.exp(np.minimum(exponent, 40.0)) * (middle >= reaction.onset)
            integral = np.where(duration * np.exp(exponent) >= 1e-9, integral, 0.0)
            if self.material.is_consecutive and j > 0:
                s = np.maximum(before - start + 0.5 * inflow, 0.0)
            else:
                s = 1.0 - start
            n = reaction.order
            if n == 1.0:
                u = -np.expm1(-integral)
            else:
                inner = (n - 1.0) * integral * np.maximum(s, 1e-30) ** (n - 1.0)
                u = -np.expm1(np.log1p(np.maximum(inner, -1.0 + 2e-16)) / (1.0 - n))
            u = np.where(s >= 1e-9, u, 0.0)
            spent = s * u
            end = start + spent
            self.xi[j] = end
            xi2[j] = end - GAMMA * spent
            xi1[j] = end + np.minimum(GAMMA * spent * next_step / step, GAMMA * (1.0 - end))
            if reference is not None:
                heat = reaction.loss * h_g - self.d[j] * (self.y[a] * h[a] - self.y[b] * h[b])
            else:
                heat = reaction.loss * reaction.heat * np.ones_like(t)
            made += reaction.loss * spent
            absorbed += heat * spent
            slope += heat * spent * (1.0 - u) * reaction.activation / (GAS_CONSTANT * middle**2)
            before, inflow = start, spent
        flux = self.material.density * self.width / step
        self.pi, self.a, self.theta = flux * made, flux * absorbed, np.maximum(flux * slope, 0.0)
        self.v2, self.v1 = self.volumes(xi2), self.volumes(xi1)

    def lost(self) -> float:
        losses = np.array([r.loss for r in self.reactions])
        return float(self.material.density * self.width @ (losses @ self.xi)) if self.reactions else 0.0


@dataclass
class Record:
    """What a march reads at the start of a step."""

    temperatures: list[float]
    lost: float
    outflow: float


@dataclass
class Marched:
    times: Array
    instants: Array
    records: list[Record] = field(default_factory=list)  # at every step
    conversion: list[Array] = field(default_factory=list)
    pressure: list[Array] = field(default_factory=list)

    def at_instants(self) -> Array:
        """Instant × (temperatures, mass lost, outflow)."""
        steps = [int(np.argmin(np.abs(self.times - t))) for t in self.instants]
        return np.array([[*self.records[i].temperatures, self.records[i].lost, self.records[i].outflow] for i in steps])

    def profiles(self, of: list[Array]) -> Array:
        return np.array([of[int(np.argmin(np.abs(self.times - t)))] for t in self.instants])


def solve_tridiagonal(lower: Array, diagonal: Array, upper: Array, right: Array) -> Array:
    """Row i holds lower[i], diagonal[i], upper[i]."""
    banded = np.zeros((3, len(diagonal)))
    banded[0, 1:], banded[1], banded[2, :-1] = upper[:-1], diagonal, lower[1:]
    solution: Array = solve_banded((1, 1), banded, right)
    return solution


class March:
    """A march at one resolution."""

    def __init__(self, layup: Layup, halvings: int) -> None:
        self.layup = layup
        faces, nodes, self.read, plies = grid(layup, halvings)
        self.width = np.diff(faces)
        self.above, self.below = nodes - faces[:-1], faces[1:] - nodes
        self.plies = [
            Cells(material, layup.gas, where, self.width[where]) for (material, _), where in zip(layup.plies, plies)
        ]
        self.n = len(nodes)
        self.interfaces = {where.stop - 1: contact for where, contact in zip(plies, layup.contacts)}
        self.air = Property(AIR, np.array([5.0 * i for i in range(801)]))
        self.times, self.instants = times(layup, halvings)
        self.t = np.full(self.n, layup.initial)
        self.is_darcy = layup.flow == "darcy"
        self.g_mean, self.g0_mean, self.back_mean = np.zeros(self.n), 0.0, 0.0
        self.outflows: list[float] = []
        if self.is_darcy:
            self.p = np.full(self.n, layup.pressure.after(0.0))
            self.p_rate, self.supply = np.zeros(self.n), np.zeros(self.n)
            self.storage = self.gather([c.pores(self.t[c.where], c.xi)[0] for c in self.plies])

    @staticmethod
    def gather(parts: list[Array]) -> Array:
        return np.concatenate(parts)

    def conductances(self, k: Array, rise: Array) -> tuple[Array, Array, Array]:
        """Conductance of each inner face, and its slopes by both temperatures."""
        apart = self.below[:-1] + self.above[1:]
        g = 0.5 * (k[:-1] + k[1:]) / apart
        upper, lower = 0.5 * rise[:-1] / apart, 0.5 * rise[1:] / apart
        for i, contact in self.interfaces.items():
            if i < self.n - 1:
                resistance = self.below[i] / k[i] + self.above[i + 1] / k[i + 1]
                g[i] = 1.0 / (resistance + (1.0 / contact if contact else 0.0))
                upper[i] = g[i] ** 2 * self.below[i] / k[i] ** 2 * rise[i]
                lower[i] = g[i] ** 2 * self.above[i + 1] / k[i + 1] ** 2 * rise[i + 1]
        return g, upper, lower

    def face_flux(self, face: Face, now: tuple[float, bool], t: float, emissivity: float, out: float) -> Array:
        """Flux into an open face and its slope; `now` is a time, and whether its value is that before or after."""

        def value(schedule: Schedule | None) -> float:
            if schedule is None:
                return 0.0
            return schedule.before(now[0]) if now[1] else schedule.after(now[0])

        flux, wall, q, slope = value(face.flux), 0.0, 0.0, 0.0
        if face.recovery is not None:
            wall = 1.0 / (value(face.recovery) - float(AIR.at(COLD_WALL_K)))
        if face.blowing:
            ratio = 2.0 * face.blowing * out / max(flux * wall, 1e-12)
            flux *= ratio / math.expm1(ratio) if ratio != 0.0 else 1.0
        q += flux * (1.0 - wall * float(self.air.at(np.array(t)) - AIR.at(COLD_WALL_K)))
        slope -= flux * wall * float(self.air.slope(np.array(t)))
        q += value(face.film) * (value(face.gas) - t)
        slope -= value(face.film)
        q += emissivity * value(face.radiant)
        if face.radiates:
            q += emissivity * STEFAN_BOLTZMANN * (face.surroundings**4 - t**4)
            slope -= 4.0 * emissivity * STEFAN_BOLTZMANN * t**3
        return np.array([q, slope])

    def advance(self, start: float, end: float, next_step: float) -> None:
        layup, step = self.layup, end - start
        faces = [(layup.hot, 0, self.plies[0]), (layup.back, self.n - 1, self.plies[-1])]
        pi_before = self.gather([c.pi for c in self.plies])
        a_before = self.gather([c.a for c in self.plies])
        theta = self.gather([c.theta for c in self.plies])
        h_g, c_g = self.gas(self.t)
        # Stage one.
        out = [0.0, 0.0]
        if self.is_darcy:
            face_mass, out[0] = self.g_mean, self.g0_mean
            pores_start = self.all_pores(self.t)
            self.set_face_pressures(start)
        else:
            face_mass, out[0] = self.quasi_steady(pi_before)
        k, rise = self.conductivity(self.t, 1)
        c = self.capacity(self.t, 1)
        if self.is_darcy:
            c = c + self.storage * self.p * c_g
        g, upper, lower = self.conductances(k, rise)
        drop = self.t[:-1] - self.t[1:]
        m = face_mass[:-1]
        by_upper = np.maximum(0.0, g + upper * drop - 0.5 * m * c_g[:-1])
        by_lower = np.maximum(0.0, g - lower * drop + 0.5 * m * c_g[1:])
        net = self.net(g * drop, m, h_g, a_before)
        if self.is_darcy:
            net += self.work(self.storage, self.t)
        diagonal = c / step
        diagonal[:-1] += GAMMA * by_upper
        diagonal[1:] += GAMMA * by_lower
        above = np.concatenate([[0.0], -GAMMA * by_upper])
        below = np.concatenate([-GAMMA * by_lower, [0.0]])
        stiff = GAMMA * theta
        diagonal += stiff**2 / (DAMPING_SHARE * c / step + stiff)
        changes, rises = [0.0, 0.0], [0.0, 0.0]
        for f, (face, i, own) in enumerate(faces):
            if face.held is not None:
                rises[f] = face.held.before(end) - face.held.after(start)
                continue
            emissivity = own.emissivity(own.v1, 0 if f == 0 else -1)
            surface = float(self.t[i])
            q, slope = self.face_flux(face, (start, False), surface, emissivity, out[0])
            later, _ = self.face_flux(face, (end, True), surface, emissivity, out[0])
            changes[f] = GAMMA * (later - q)
            net[i] += q
            diagonal[i] -= GAMMA * slope
            if self.layup.flow != "unhindered":
                leaves = out[0] if f == 0 else self.back_mean
                diagonal[i] += GAMMA * max(leaves, 0.0) * c_g[i]
        right = net.copy()
        for f, (face, i, _) in enumerate(faces):
            right[i] += changes[f]
            if face.held is not None:
                above[i], diagonal[i], below[i], right[i] = 0.0, 1.0, 0.0, rises[f]
        first = solve_tridiagonal(above, diagonal, below, right)
        # Between the stages.
        for cells in self.plies:
            if cells.reactions:
                w = cells.where
                cells.react(self.t[w], first[w], step, next_step, layup.duration)
        pi = self.gather([cells.pi for cells in self.plies])
        a = self.gather([cells.a for cells in self.plies])
        then = self.t + first
        if self.is_darcy:
            face_mass, out[1] = self.advance_pressures(pores_start, then, pi, start, end)
            h_g, c_g = self.gas(then)
        else:
            face_mass, out[1] = self.quasi_steady(2.0 * pi - pi_before)
            h_g = h_g + c_g * first
            self.outflows.append(0.5 * (out[0] + out[1]))
        # Stage two.
        k, rise = self.conductivity(then, 2)
        c_then = self.capacity(then, 2)
        if self.is_darcy:
            c_then = c_then + self.storage * self.p * c_g
        g, _, _ = self.conductances(k, rise)
        net = self.net(g * (then[:-1] - then[1:]), face_mass[:-1], h_g, 2.0 * a - a_before)
        if self.is_darcy:
            net += self.work(self.storage, then)
        for f, (face, i, own) in enumerate(faces):
            if face.held is None:
                emissivity = own.emissivity(own.v2, 0 if f == 0 else -1)
                net[i] += self.face_flux(face, (end, True), float(then[i]), emissivity, out[1])[0]
        right = c / c_then * net - 2.0 * c / step * first
        for f, (face, i, _) in enumerate(faces):
            right[i] -= changes[f]
            if face.held is not None:
                right[i] = -rises[f]
        second = solve_tridiagonal(above, diagonal, below, right)
        self.t = self.t + 1.5 * first + 0.5 * second

    def gas(self, t: Array) -> tuple[Array, Array]:
        h = self.gather([c.h_g.at(t[c.where]) for c in self.plies])
        return h, self.gather([c.h_g.slope(t[c.where]) for c in self.plies])

    def conductivity(self, t: Array, stage: int) -> tuple[Array, Array]:
        parts = [c.conductivity(t[c.where], c.v1 if stage == 1 else c.v2) for c in self.plies]
        return self.gather([k for k, _ in parts]), self.gather([s for _, s in parts])

    def capacity(self, t: Array, stage: int) -> Array:
        return self.gather([c.capacity(t[c.where], c.v1 if stage == 1 else c.v2) for c in self.plies])

    def quasi_steady(self, pi: Array) -> tuple[Array, float]:
        """Mass flux under each cell, and out of the hot face."""
        from_back = np.cumsum(pi[::-1])[::-1]
        through = np.concatenate([from_back[1:], [0.0]])
        return (through if self.layup.flow == "quasi-steady" else np.zeros(self.n)), float(from_back[0])

    @staticmethod
    def net(conducted: Array, mass: Array, h_g: Array, absorbed: Array) -> Array:
        net = -absorbed
        advected = 0.5 * mass * np.diff(h_g)
        net[:-1] += advected - conducted
        net[1:] += advected + conducted
        return net

    def work(self, storage: Array, t: Array) -> Array:
        molar = self.gather([c.m.at(t[c.where]) for c in self.plies])
        result: Array = storage * GAS_CONSTANT * t / molar * self.p_rate
        return result

    def all_pores(self, t: Array) -> list[Array]:
        parts = [c.pores(t[c.where], c.xi) for c in self.plies]
        return [self.gather([part[i] for part in parts]) for i in range(4)]

    def outside(self) -> list[tuple[int, Schedule]]:
        back = self.layup.back_pressure
        return [(0, self.layup.pressure), *([] if back is None else [(self.n - 1, back)])]

    def set_face_pressures(self, time: float) -> None:
        for i, schedule in self.outside():
            self.p[i] = schedule.after(time)

    def mass_flux(self, p: Array, nu: Array, slip: Array, inertia: Array) -> tuple[Array, Array, Array]:
        """Mass flux through each inner face, its slopes by the pressure above (negated) and below."""
        up, low = self.below[:-1], self.above[1:]
        mean, drop = 0.5 * (p[:-1] + p[1:]), p[1:] - p[:-1]
        factor = 2.0 / (1.0 + np.sqrt(1.0 + 0.5 * (inertia[:-1] + inertia[1:]) * mean * np.abs(drop) / (up + low)))
        over, under = mean + slip[:-1], mean + slip[1:]
        resistance = up * nu[1:] * under + low * nu[:-1] * over
        is_open = resistance > 0.0
        resistance = np.where(is_open, resistance, 1.0)
        conductance = np.where(is_open, factor * nu[:-1] * over * nu[1:] * under / resistance, 0.0)
        eta = (up * nu[1:] * under / over + low * nu[:-1] * over / under) / resistance
        half = 0.5 * conductance * eta * drop
        return conductance * drop, np.maximum(0.0, conductance - half), np.maximum(0.0, conductance + half)

    def advance_pressures(
        self, start: list[Array], then: Array, pi: Array, begin: float, end: float
    ) -> tuple[Array, float]:
        step = end - begin
        place = int(np.argmin(np.abs(self.times - begin)))
        before = self.times[place] - self.times[place - 1] if place > 0 else step
        at_end = self.all_pores(then)
        middle = [0.5 * (a + b) for a, b in zip(start, at_end)]
        storage, p = at_end[0], self.p
        supply = pi - p * (storage - self.storage) / step
        correction = (GAMMA_P - 0.5) * 2.0 * step / (step + before) * (supply - self.supply)

        def inflow(flux: Array) -> Array:
            gained: Array = np.concatenate([flux, [0.0]]) - np.concatenate([[0.0], flux])
            return gained

        flux, by_upper, by_lower = self.mass_flux(p, *middle[1:])
        ending = self.mass_flux(p, *at_end[1:])[0]
        correction = correction + (2.0 * GAMMA_P - 1.0) * inflow(ending - flux)
        diagonal = storage / step
        diagonal[:-1] += GAMMA_P * by_upper
        diagonal[1:] += GAMMA_P * by_lower
        above = np.concatenate([[0.0], -GAMMA_P * by_upper])
        below = np.concatenate([-GAMMA_P * by_lower, [0.0]])
        right = inflow(flux) + supply + correction
        rises = {i: schedule.before(end) - schedule.after(begin) for i, schedule in self.outside()}
        for i, rise in rises.items():
            above[i], diagonal[i], below[i], right[i] = 0.0, 1.0, 0.0, rise
        first = solve_tridiagonal(above, diagonal, below, right)
        again = self.mass_flux(p + first, *middle[1:])[0]
        right = inflow(again) + supply - correction - 2.0 * storage / step * first
        for i, rise in rises.items():
            right[i] = -rise
        second = solve_tridiagonal(above, diagonal, below, right)
        p_end = p + 1.5 * first + 0.5 * second
        release = pi - (storage * p_end - self.storage * p) / step
        mean = np.zeros(self.n)
        last = self.n - 1
        back = 0.0
        for i in range(last - 1, -1, -1):
            if i == last - 1 and self.layup.back_pressure is not None:
                both = first + second
                implicit = GAMMA_P * (by_lower[i] * both[i + 1] - by_upper[i] * both[i])
                mean[i] = 0.5 * (flux[i] + again[i] + implicit)
                back = release[last] - mean[i]
            elif by_upper[i] + by_lower[i] >= 1e-30:
                mean[i] = mean[i + 1] + release[i + 1]
        outflow = float(mean[0] + release[0])
        stage = 2.0 * mean - self.g_mean
        out = 2.0 * outflow - self.g0_mean
        self.g_mean, self.g0_mean, self.back_mean = mean, outflow, float(back)
        self.p_rate, self.p, self.storage, self.supply = (p_end - p) / step, p_end, storage, supply
        self.outflows.append(outflow)
        return stage, out

    def readings(self) -> list[float]:
        """Temperatures of the sensors, with the composition of the instant."""
        parts = [c.conductivity(self.t[c.where], c.volumes(c.xi)) for c in self.plies]
        k = self.gather([own for own, _ in parts])
        g, _, _ = self.conductances(k, np.zeros(self.n))
        found = []
        for face in self.read:
            if face in (0, self.n):
                found.append(float(self.t[min(face, self.n - 1)]))
                continue
            i = face - 1
            flux = g[i] * (self.t[i] - self.t[i + 1])
            upper = self.t[i] - flux * self.below[i] / k[i]
            lower = self.t[i + 1] + flux * self.above[i + 1] / k[i + 1]
            found.append(float(0.5 * (upper + lower)))
        return found

    def run(self) -> Marched:
        marched = Marched(self.times, self.instants)
        steps = np.diff(self.times)
        for i, t in enumerate(self.times):
            for face, cell in ((self.layup.hot, 0), (self.layup.back, -1)):
                if face.held is not None:
                    self.t[cell] = face.held.after(t)
            outflow = 0.0
            if i >= 2:
                now, earlier = self.outflows[-1], self.outflows[-2]
                outflow = now + (now - earlier) * steps[i - 1] / (steps[i - 1] + steps[i - 2])
            lost = sum(c.lost() for c in self.plies)
            readings = self.readings() if i > 0 else [self.layup.initial] * len(self.read)
            marched.records.append(Record(readings, lost, outflow))
            marched.conversion.append(self.gather([c.conversion(c.volumes(c.xi)) for c in self.plies]))
            if self.is_darcy:
                marched.pressure.append(self.p.copy())
            if i < len(steps):
                self.advance(t, self.times[i + 1], steps[i + 1] if i + 1 < len(steps) else 0.0)
        return marched


def march(layup: Layup) -> tuple[Array, Marched]:
    """Extrapolated readings at the instants, and the finer march."""
    coarse, fine = March(layup, 0).run(), March(layup, 1).run()
    finer = fine.at_instants()
    extrapolated: Array = finer + (finer - coarse.at_instants()) / 3.0
    return extrapolated, fine


def _table(name: str, table: Table, unit: str) -> str:
    t, v = list(table.temperatures_k), list(table.values)
    if len(v) == 1:
        return f'[{name}]\nvalue = "{v[0]!r} {unit}"\n'
    return f'[{name}]\nunit = "{unit}"\ntemperatures_k = {t}\nvalues = {v}\noutside = "clamp"\n'


def _pores(name: str, state: State) -> str:
    if state.porosity == 0.0:
        return ""
    text = f'[{name}]\nporosity = {state.porosity!r}\npermeability = "{state.permeability!r} m^2"\n'
    text += f'forchheimer_coefficient = "{state.forchheimer!r} 1/m"\n'
    return text + (f'pore_radius = "{SLIP_PA_M_K / state.slip!r} m"\n' if state.slip > 0.0 else "")


def _points(schedule: Schedule, unit: str) -> str:
    if len(schedule.times_s) == 1:
        return f'"{schedule.values[0]!r} {unit}"'
    return str([[f"{t!r} s", f"{v!r} {unit}"] for t, v in zip(schedule.times_s, schedule.values)]).replace("'", '"')


def write(layup: Layup, folder: Path) -> None:
    """The same layup as the folder of a case."""
    (folder / "materials").mkdir(parents=True, exist_ok=True)
    (folder / "gases").mkdir(exist_ok=True)
    case = [
        f'duration = "{layup.duration!r} s"\ninitial_temperature = "{layup.initial!r} K"\ndecomposition = true',
        f"pressure = {_points(layup.pressure, 'Pa')}",
    ]
    for p, ((material, thickness), contact) in enumerate(zip(layup.plies, (*layup.contacts, None))):
        case.append(f'[[ply]]\nname = "P{p}"\nmaterial = "m{p}"\nthickness = "{thickness!r} m"')
        if not material.reactions:
            case.append("decomposition = false")
        if contact:
            case.append(f'contact_below = "{contact!r} W/m^2/K"')
        virgin = material.states[0]
        text = [f'name = "M{p}"\n[density]\nvalue = "{material.density!r} kg/m^3"\n']
        text.append(_table("heat_capacity", virgin.heat_capacity, "J/kg/K"))
        text.append(_table("conductivity", virgin.conductivity, "W/m/K"))
        text.append(f"[emissivity]\nvalue = {virgin.emissivity!r}\n" + _pores("pores", virgin))
        if material.reactions:
            text.append(f"[decomposition]\nshrinkage = {material.shrinkage!r}\n")
            text.append(f'mixture_rule = "{"volume" if material.by_volume else "mass"}"\n')
            text.append(f'reaction_scheme = "{"consecutive" if material.is_consecutive else "parallel"}"\n')
            if material.reference is not None:
                text.append(f'heat = "absolute"\nvirgin_enthalpy = "{virgin.enthalpy!r} J/kg"\n')
                text.append(f'reference = "{material.reference!r} K"\n')
            for r in material.reactions:
                text.append(
                    f'[[decomposition.reaction]]\nmass_loss = {r.loss!r}\npre_exponential = "{r.rate!r} 1/s"\n'
                    f'activation_energy = "{r.activation!r} J/mol"\norder = {r.order!r}\n'
                )
                if r.onset > 0.0:
                    text.append(f'onset_temperature = "{r.onset!r} K"\n')
                if material.reference is None:
                    text.append(f'heat = "{r.heat!r} J/kg"\n')
            for s, state in enumerate(material.states[1:], start=1):
                is_char = s == len(material.states) - 1
                name = "decomposition.char" if is_char else "decomposition.intermediate"
                text.append(f"[{name}]\n" if is_char else f'[[{name}]]\nname = "i{s}"\n')
                if material.reference is not None:
                    text.append(f'enthalpy = "{state.enthalpy!r} J/kg"\n')
                text.append(_table(f"{name}.heat_capacity", state.heat_capacity, "J/kg/K"))
                text.append(_table(f"{name}.conductivity", state.conductivity, "W/m/K"))
                text.append(f"[{name}.emissivity]\nvalue = {state.emissivity!r}\n" + _pores(f"{name}.pores", state))
        (folder / "materials" / f"m{p}.toml").write_text("".join(text))
    for i, depth in enumerate(layup.sensors):
        case.append(f'[[sensor]]\nname = "S{i}"\ndepth = "{depth!r} m"')
    for name, face in (("hot_face", layup.hot), ("back_face", layup.back)):
        back = layup.back_pressure if name == "back_face" else None
        pressure = f"pressure = {_points(back, 'Pa')}" if back is not None else ""
        if face.held is not None:
            case.append(f'[{name}]\nkind = "held"\ntemperature = {_points(face.held, "K")}\n{pressure}')
        elif name == "hot_face":
            case.append(f"[{name}]")
            case.append(f'kind = "{"heated" if face.flux or face.radiant else "convective"}"')
            if face.flux:
                case.append(f"flux = {_points(face.flux, 'W/m^2')}")
            if face.radiant:
                case.append(f"radiant_flux = {_points(face.radiant, 'W/m^2')}")
            if face.recovery:
                case.append(f"recovery_enthalpy = {_points(face.recovery, 'J/kg')}")
            if face.blowing:
                case.append(f"blowing = {face.blowing!r}")
            if face.film and face.gas:
                case.append(f"heat_transfer_coefficient = {_points(face.film, 'W/m^2/K')}")
                case.append(f"gas = {_points(face.gas, 'K')}")
            case.append(f'surroundings = "{face.surroundings!r} K"' if face.radiates else "emissivity = 0.0")
        elif face.film and face.gas:
            case.append(f'[{name}]\nkind = "cooled"\nambient = {_points(face.gas, "K")}')
            case.append(f"heat_transfer_coefficient = {_points(face.film, 'W/m^2/K')}")
            case.append(f'surroundings = "{face.surroundings!r} K"' if face.radiates else "emissivity = 0.0")
            case.append(pressure)
    case.append(f'[gas]\nflow = "{layup.flow}"\ngas = "g"')
    case.append(f'[resolution]\ncells = {layup.cells}\nfirst_step = "{layup.first_step!r} s"')
    case.append(f'step_growth = {layup.step_growth!r}\nmax_step = "{layup.max_step!r} s"')
    case.append(f'output_interval = "{layup.interval!r} s"')
    (folder / "case.toml").write_text("\n".join(case) + "\n")
    is_absolute = any(material.reference is not None for material, _ in layup.plies)
    gas = 'name = "G"\n' + _table("molar_mass", layup.gas.molar_mass, "kg/mol")
    gas += _table("enthalpy", layup.gas.enthalpy, "J/kg") + f'kind = "{"absolute" if is_absolute else "sensible"}"\n'
    (folder / "gases" / "g.toml").write_text(gas + _table("viscosity", layup.gas.viscosity, "Pa*s"))
