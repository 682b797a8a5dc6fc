"""Reads the folder of a case into numbers in SI. It knows the keys that the random cases use and refuses others."""

import csv
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from quantities import Refused, si, to_si
from tables import Schedule, Table

DATA = Path(__file__).parents[2] / "data"

_HEADING_UNITS = {
    "s": "s", "ms": "ms", "min": "min", "h": "h", "K": "K", "degC": "degC", "degF": "degF", "Pa": "Pa", "kPa": "kPa",
    "w_m2": "W/m^2", "kw_m2": "kW/m^2", "w_cm2": "W/cm^2", "btu_ft2_s": "BTU/ft^2/s",
}  # fmt: skip


@dataclass(frozen=True)
class Conductivity:
    """Tables at pressures, or three parts."""

    tables: tuple[tuple[float, Table], ...] = ()
    solid: float = 0.0
    solid_exponent: float = 0.0
    pores: tuple[tuple[float, float], ...] = ()
    extinction_1_m: float | None = None

    def times(self, factor: float) -> "Conductivity":
        return Conductivity(
            tuple((pressure, table.times(factor)) for pressure, table in self.tables),
            self.solid * factor,
            self.solid_exponent,
            tuple((share * factor, length) for share, length in self.pores),
            None if self.extinction_1_m is None else self.extinction_1_m / factor,
        )


@dataclass(frozen=True)
class Reaction:
    mass_loss: float
    pre_exponential_1_s: float
    activation_j_mol: float
    order: float
    onset_k: float
    heat_j_kg: float


@dataclass(frozen=True)
class State:
    """Virgin material or char."""

    heat_capacity: Table
    conductivity: Conductivity
    emissivity: Table


@dataclass(frozen=True)
class Material:
    density: float
    virgin: State
    char: State | None = None
    reactions: tuple[Reaction, ...] = ()
    by_volume: bool = False


@dataclass(frozen=True)
class Ply:
    name: str
    thickness_m: float
    material: Material
    contact_below: float | None
    limit_k: float | None
    limit_below_k: float | None


@dataclass(frozen=True)
class Sensor:
    name: str
    below: int | None
    depth_m: float | None
    side: str
    time_constant_s: float
    limit_k: float | None
    pyrometer: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Face:
    """A face: held, or the sum of what acts on it."""

    held: Schedule | None = None
    flux: Schedule = field(default_factory=lambda: Schedule.constant(0.0))
    recovery: Schedule | None = None
    enthalpy_film: Schedule | None = None
    radiant: Schedule = field(default_factory=lambda: Schedule.constant(0.0))
    film: Schedule = field(default_factory=lambda: Schedule.constant(0.0))
    gas_k: Schedule = field(default_factory=lambda: Schedule.constant(300.0))
    emissivity: Table | None = None
    radiates: bool = False
    surroundings_k: Schedule = field(default_factory=lambda: Schedule.constant(300.0))


@dataclass(frozen=True)
class Case:
    duration_s: float
    initial: tuple[tuple[float, float], ...]
    pressure: Schedule
    plies: tuple[Ply, ...]
    sensors: tuple[Sensor, ...]
    hot: Face
    back: Face
    holder: tuple[float, Schedule] | None
    gas_flow: str
    gas_enthalpy: Table
    tolerance_k: float
    output_interval_s: float


class _Keys:
    """A table of a file of which every key has to be known."""

    def __init__(self, where: str, keys: dict[str, Any]) -> None:
        self.where, self.keys, self.known = where, keys, set[str]()

    def get(self, key: str, default: Any = None) -> Any:
        self.known.add(key)
        return self.keys.get(key, default)

    def ignore(self, *keys: str) -> None:
        self.known.update(keys)

    def done(self) -> None:
        unknown = set(self.keys) - self.known
        if unknown:
            raise Refused(f"{self.where}: {', '.join(sorted(unknown))}: not computed here")


def _table(where: str, keys: dict[str, Any]) -> Table:
    section = _Keys(where, keys)
    section.ignore("mark", "source", "uncertainty", "note")
    value, unit = section.get("value"), section.get("unit")
    outside = section.get("outside", "clamp")
    if value is not None:
        section.done()
        return Table.constant(si(value))
    temperatures = section.get("temperatures_k")
    if temperatures is None:
        temperature_unit = section.get("temperature_unit", "K")
        temperatures = [to_si(t, temperature_unit, temperature=True) for t in section.get("temperatures")]
    values = [si(v) if unit is None else to_si(v, unit) for v in section.get("values")]
    section.done()
    return Table(tuple(float(t) for t in temperatures), tuple(values), outside)


def _conductivity(where: str, keys: dict[str, Any], density: float) -> Conductivity:
    if "at" in keys:
        levels = []
        for level in keys["at"]:
            rest = {key: value for key, value in level.items() if key != "pressure"}
            levels.append((si(level["pressure"]), _table(where, rest)))
        return Conductivity(tuple(levels))
    if not {"solid", "pores", "extinction", "specific_extinction"} & set(keys):
        return Conductivity(((101325.0, _table(where, keys)),))
    section = _Keys(where, keys)
    section.ignore("mark", "source", "uncertainty", "range", "note")
    extinction = section.get("extinction")
    specific = section.get("specific_extinction")
    beta = si(extinction) if extinction is not None else si(specific) * density if specific is not None else None
    parts = Conductivity(
        (),
        si(section.get("solid", "0 W/m/K")),
        float(section.get("solid_exponent", 0.0)),
        tuple((float(pore["share"]), si(pore["length"])) for pore in section.get("pores", [])),
        beta,
    )
    section.done()
    return parts


def material(path: Path) -> Material:
    where = path.name
    top = _Keys(where, tomllib.loads(path.read_text()))
    top.ignore("name", "note", "pores", "mark", "source", "uncertainty")
    density = si(top.get("density")["value"])
    virgin = State(
        _table(f"{where} [heat_capacity]", top.get("heat_capacity")),
        _conductivity(f"{where} [conductivity]", top.get("conductivity"), density),
        _table(f"{where} [emissivity]", top.get("emissivity")),
    )
    decomposition = top.get("decomposition")
    top.done()
    if decomposition is None:
        return Material(density, virgin)
    section = _Keys(f"{where} [decomposition]", decomposition)
    section.ignore("mark", "source", "uncertainty")
    reasons = []
    if section.get("reaction_scheme", "parallel") != "parallel":
        reasons.append("consecutive reactions")
    if section.get("heat", "of-reaction") != "of-reaction":
        reasons.append("absolute heats")
    if section.get("shrinkage", 0.0) != 0.0:
        reasons.append("shrinkage")
    section.ignore("virgin_enthalpy", "reference", "intermediate")
    reactions = []
    for keys in section.get("reaction", []):
        reaction = _Keys(section.where, keys)
        if "volume_share" in keys:
            reasons.append("component densities")
            break
        reactions.append(
            Reaction(
                float(reaction.get("mass_loss")),
                si(reaction.get("pre_exponential")),
                si(reaction.get("activation_energy")),
                float(reaction.get("order")),
                si(reaction.get("onset_temperature", "0 K"), temperature=True),
                si(reaction.get("heat", "0 J/kg")),
            )
        )
        reaction.done()
    by_volume = section.get("mixture_rule", "mass") == "volume"
    char_keys = dict(section.get("char", {}))
    section.done()
    if reasons:
        # The ply may be exempt; then this material is used without its reactions.
        return Material(density, virgin, None, (), by_volume)

    def of_char(key: str, own: Any, read: Any) -> Any:
        written = char_keys.get(key)
        if written is None:
            return own
        if "times_virgin" in written:
            return own.times(float(written["times_virgin"]))
        return read(written)

    char = State(
        of_char("heat_capacity", virgin.heat_capacity, lambda keys: _table(where, keys)),
        of_char("conductivity", virgin.conductivity, lambda keys: _conductivity(where, keys, density)),
        of_char("emissivity", virgin.emissivity, lambda keys: _table(where, keys)),
    )
    return Material(density, virgin, char, tuple(reactions), by_volume)


def _find(folder: Path, kind: str, name: Any) -> Path:
    if isinstance(name, dict):
        return folder / str(name["file"])
    for candidate in (folder / kind / f"{name}.toml", DATA / kind / f"{str(name).replace('-', '_')}.toml"):
        if candidate.exists():
            return candidate
    raise Refused(f"no {kind} named {name}")


class _Schedules:
    def __init__(self, folder: Path, duration_s: float) -> None:
        self.folder, self.duration_s = folder, duration_s

    def read(self, written: Any, temperature: bool = False) -> Schedule:
        if isinstance(written, (str, int, float)):
            return Schedule.constant(si(written, temperature))
        outside = None
        if isinstance(written, dict):
            outside = written.get("outside")
            if "file" in written:
                if set(written) - {"file", "column", "outside"}:
                    raise Refused("a schedule from a file with a unit, time, sheet or noise: not computed here")
                times, values = self.column(written["file"], written.get("column"))
            elif "points" in written:
                times, values = self.points(written["points"], temperature)
            else:
                raise Refused("a schedule of a trajectory: not computed here")
        else:
            times, values = self.points(written, temperature)
        if outside == "zero":
            times, values = [times[0], *times, times[-1]], [0.0, *values, 0.0]
        elif outside is None and (times[0] > 0.0 or times[-1] < self.duration_s * (1.0 - 1e-12)):
            raise Refused("a schedule does not cover the run")
        return Schedule(tuple(times), tuple(values))

    @staticmethod
    def points(points: list[Any], temperature: bool) -> tuple[list[float], list[float]]:
        return [si(t) for t, _ in points], [si(v, temperature) for _, v in points]

    def column(self, name: str, column: str | None) -> tuple[list[float], list[float]]:
        with open(self.folder / name) as file:
            rows = list(csv.reader(line for line in file if not line.startswith("#")))
        heading = rows[0]
        i = 1 if column is None else heading.index(column)

        def unit(text: str) -> str:
            for suffix, unit in _HEADING_UNITS.items():
                if text.endswith("_" + suffix):
                    return unit
            raise Refused(f"heading {text!r}: not read here")

        time_unit, value_unit = unit(heading[0]), unit(heading[i])
        kept = [row for row in rows[1:] if row[i] not in ("", "NaN", "NA", "N/A")]
        times = [to_si(float(row[0]), time_unit) for row in kept]
        is_temperature = value_unit in ("K", "degC", "degF")
        return times, [to_si(float(row[i]), value_unit, is_temperature) for row in kept]


def _contact(written: Any, default: float | None) -> float | None:
    """A conductance; infinite is perfect, which is also the default."""
    if written is None:
        return default
    if written == "perfect":
        return None
    value, text = si(written), str(written).replace(" ", "")
    return 1.0 / value if "K/W" in text else value


def _open_face(keys: _Keys, schedules: _Schedules, own: Table, default_k: Schedule) -> dict[str, Any]:
    emissivity = keys.get("emissivity")
    surroundings = keys.get("surroundings")
    table = own if emissivity is None else Table.constant(float(emissivity))
    return {
        "emissivity": table,
        "radiates": True,
        "surroundings_k": default_k if surroundings is None else schedules.read(surroundings, temperature=True),
    }


def load(folder: Path) -> Case:
    """The case of a folder."""
    path = folder / "case.toml"
    top = _Keys("case.toml", tomllib.loads(path.read_text()))
    top.ignore("name", "note", "observations", "estimate", "correlation")
    if any(factor.get("nominal", 1.0) != 1.0 for factor in top.get("factor", [])):
        raise Refused("a factor whose nominal value is not one")
    duration_s = si(top.get("duration"))
    schedules = _Schedules(folder, duration_s)
    decomposes = bool(top.get("decomposition", False))
    conductance, resistance = top.get("contact_conductance"), top.get("contact_resistance")
    default_contact = _contact(conductance if conductance is not None else resistance, None)

    plies = []
    for written in top.get("ply", []):
        ply = _Keys(f"ply {written['name']}", written)
        ply.ignore("name", "group")
        own = material(_find(folder, "materials", ply.get("material")))
        reacts = bool(ply.get("decomposition", True)) and decomposes
        if reacts and not own.reactions:
            text = _find(folder, "materials", ply.get("material")).read_text()
            if "[[decomposition.reaction]]" in text:
                raise Refused("consecutive reactions, absolute heats, shrinkage or component densities")
        if not reacts:
            own = Material(own.density, own.virgin)
        limit, limit_below = ply.get("limit"), ply.get("limit_below")
        plies.append(
            Ply(
                written["name"],
                si(ply.get("thickness")),
                own,
                _contact(ply.get("contact_below"), default_contact),
                None if limit is None else si(limit, temperature=True),
                None if limit_below is None else si(limit_below, temperature=True),
            )
        )
        ply.done()
    names = [ply.name for ply in plies]

    sensors = []
    for written in top.get("sensor", []):
        keys = _Keys(f"sensor {written['name']}", written)
        keys.ignore("name", "kind")
        limit = keys.get("limit")
        limit_k = None if limit is None else si(limit, temperature=True)
        if written.get("kind") == "pyrometer":
            wavelength, band = keys.get("wavelength"), keys.get("band")
            shorter, longer = (si(wavelength),) * 2 if band is None else (si(band[0]), si(band[1]))
            pyrometer = (shorter, longer, float(keys.get("emissivity")))
            sensors.append(Sensor(written["name"], None, 0.0, "both", 0.0, limit_k, pyrometer))
        else:
            below, depth = keys.get("below"), keys.get("depth")
            sensors.append(
                Sensor(
                    written["name"],
                    None if below is None else names.index(below),
                    None if depth is None else si(depth),
                    keys.get("side", "both"),
                    si(keys.get("time_constant", "0 s")),
                    limit_k,
                )
            )
        keys.done()

    hot_keys = _Keys("[hot_face]", top.get("hot_face"))
    kind = hot_keys.get("kind")
    room = Schedule.constant(300.0)
    face_emissivity = plies[0].material.virgin.emissivity
    if kind == "held":
        hot = Face(held=schedules.read(hot_keys.get("temperature"), temperature=True))
    else:
        parts = _open_face(hot_keys, schedules, face_emissivity, room)
        for key, name in [
            ("flux", "flux"),
            ("recovery_enthalpy", "recovery"),
            ("enthalpy_film_coefficient", "enthalpy_film"),
            ("radiant_flux", "radiant"),
            ("heat_transfer_coefficient", "film"),
        ]:
            written = hot_keys.get(key)
            if written is not None:
                parts[name] = schedules.read(written)
        gas = hot_keys.get("gas")
        if gas is not None:
            parts["gas_k"] = schedules.read(gas, temperature=True)
        hot = Face(**parts)
    hot_keys.done()

    back = Face()
    written = top.get("back_face")
    if written is not None:
        keys = _Keys("[back_face]", written)
        kind = keys.get("kind")
        if kind == "held":
            back = Face(held=schedules.read(keys.get("temperature"), temperature=True))
        elif kind == "cooled":
            ambient = schedules.read(keys.get("ambient"), temperature=True)
            parts = _open_face(keys, schedules, plies[-1].material.virgin.emissivity, ambient)
            parts["film"] = schedules.read(keys.get("heat_transfer_coefficient"))
            parts["gas_k"] = ambient
            back = Face(**parts)
        elif kind == "holder":
            film = Schedule.constant(si(keys.get("conductance")))
            back = Face(film=film, gas_k=schedules.read(keys.get("temperature"), temperature=True))
        keys.done()

    written = top.get("holder")
    holder = None
    if written is not None:
        holder = (si(written["conductance"]), schedules.read(written["temperature"], temperature=True))

    gas_keys = _Keys("[gas]", top.get("gas", {}))
    flow = gas_keys.get("flow", "quasi-steady")
    name = gas_keys.get("gas", "pyrolysis")
    gas_keys.done()
    if flow == "darcy":
        raise Refused("Darcy flow")
    gas = tomllib.loads(_find(folder, "gases", name).read_text())
    gas_enthalpy = _table("[enthalpy]", {k: v for k, v in gas["enthalpy"].items() if k != "kind"})

    initial = top.get("initial_temperature")
    if isinstance(initial, dict):
        initial = initial["points"]
    if isinstance(initial, str):
        initial = [["0 m", initial]]
    profile = tuple((si(depth), si(value, temperature=True)) for depth, value in initial)

    resolution = _Keys("[resolution]", top.get("resolution", {}))
    tolerance_k = si(resolution.get("tolerance", "0.05 K"))
    output_interval_s = si(resolution.get("output_interval", "1 s"))
    resolution.ignore("cells", "first_step", "max_step", "step_growth")
    resolution.done()
    pressure = schedules.read(top.get("pressure", "1 atm"))
    top.done()
    return Case(
        duration_s, profile, pressure, tuple(plies), tuple(sensors), hot, back, holder, flow, gas_enthalpy,
        tolerance_k, output_interval_s,
    )  # fmt: skip
