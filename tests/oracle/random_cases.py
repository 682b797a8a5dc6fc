"""Random cases that are rich in what programs stumble over, written as folders.

A case is a tame base with a few of the features of FEATURES, so that a violation can be traced to one of them.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

STEFAN_BOLTZMANN = 5.670374419e-8

FEATURES = (
    "latent heat",
    "close nodes",
    "jump in a table",
    "pressure varies in tables",
    "pressure varies in pores",
    "foil",
    "thick felt",
    "weak contact",
    "stiff contact",
    "short pulse",
    "many corners",
    "file schedule",
    "long run",
    "coarse instants",
    "decomposition",
    "wild kinetics",
    "held hot face",
    "held back face",
    "cooled back face",
    "back holder",
    "lateral holder",
    "lagging sensor",
    "sensor in depth",
    "pyrometer",
    "hot wall",
    "enthalpy film",
    "radiant flux",
    "convective face",
    "initial profile",
    "emissivity over temperature",
    "limits",
)


def text(value: float, unit: str) -> str:
    return f'"{value!r} {unit}"'


def numbers(values: list[float]) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"


@dataclass
class Ply:
    kind: str
    thickness_m: float
    conductivity: float
    density: float
    heat_capacity: float
    lines: list[str] = field(default_factory=list)


class Writer:
    """One random case."""

    def __init__(self, seed: int, number: int, features: set[str] | None = None) -> None:
        self.random = np.random.default_rng([seed, number])
        if features is None:
            count = int(self.random.integers(1, 5))
            features = set(self.random.choice(FEATURES, size=count, replace=False).tolist())
        self.features = self._consistent(features)
        self.files: dict[str, str] = {}

    def _consistent(self, features: set[str]) -> set[str]:
        features = set(features)
        if "wild kinetics" in features:
            features.add("decomposition")
        faces = [f for f in FEATURES if f in features and f in
                 ("held hot face", "hot wall", "enthalpy film", "radiant flux", "convective face")]  # fmt: skip
        features -= set(faces[1:])
        backs = [f for f in FEATURES if f in features and f in ("held back face", "cooled back face", "back holder")]
        features -= set(backs[1:])
        if "held hot face" in features:
            features -= {"pyrometer", "emissivity over temperature"}
        if "decomposition" in features:
            # Of these the properties of a char would have to be stated too.
            features -= {"pyrometer"}
        return features

    def has(self, feature: str) -> bool:
        return feature in self.features

    def log_uniform(self, low: float, high: float) -> float:
        """Log-uniform, to four digits."""
        return float(f"{math.exp(self.random.uniform(math.log(low), math.log(high))):.4g}")

    def uniform(self, low: float, high: float, digits: int = 4) -> float:
        return float(f"{self.random.uniform(low, high):.{digits}g}")

    def chance(self, probability: float) -> bool:
        return bool(self.random.random() < probability)

    # Materials

    def table(self, base: float, low: float = 0.6, high: float = 1.7, points: int | None = None) -> list[str]:
        """A property that is 1 to 1.7 times as large when hot."""
        n = points or int(self.random.integers(3, 9))
        t = sorted({round(float(x), 1) for x in self.random.uniform(250.0, 2000.0, n)})
        v = [float(f"{base * self.random.uniform(low, high):.4g}") for _ in t]
        outside = str(self.random.choice(["clamp", "extrapolate"])) if len(t) > 1 and v[-1] >= v[-2] else "clamp"
        return [f"temperatures_k = {numbers(t)}", f"values = {numbers(v)}", f'outside = "{outside}"']

    def heat_capacity(self, c: float, special: bool) -> list[str]:
        lines = ["[heat_capacity]", 'unit = "J/kg/K"']
        if special and self.has("latent heat"):
            heat = self.log_uniform(2e4, 3e5)
            width = self.log_uniform(2.0, 20.0)
            at = self.uniform(320.0, 700.0)
            if self.has("jump in a table"):
                t = [at, at, at + width, at + width]
                v = [c, c + heat / width, c + heat / width, 1.1 * c]
            else:
                t = [at, at + width / 2, at + width]
                v = [c, c + 2.0 * heat / width, 1.1 * c]
            return lines + [f"temperatures_k = {numbers([250.0, *t, 2000.0])}",
                            f"values = {numbers([c, *v, 1.3 * c])}", 'outside = "clamp"']  # fmt: skip
        if special and self.has("close nodes"):
            spacing = self.log_uniform(0.2, 3.0)
            at = self.uniform(310.0, 600.0)
            n = int(self.random.integers(10, 60))
            t = [at + spacing * i for i in range(n)]
            v = [c * (1.0 + self.log_uniform(0.01, 3.0)) for _ in range(n)]
            return lines + [f"temperatures_k = {numbers([250.0, *t, t[-1] + 400.0])}",
                            f"values = {numbers([c, *v, 1.2 * c])}", 'outside = "clamp"']  # fmt: skip
        if special and self.has("jump in a table"):
            at = self.uniform(310.0, 700.0)
            factor = self.log_uniform(0.4, 3.0)
            return lines + [f"temperatures_k = {numbers([250.0, at, at, 1800.0])}",
                            f"values = {numbers([c, 1.1 * c, factor * c, factor * 1.3 * c])}",
                            'outside = "clamp"']  # fmt: skip
        if self.chance(0.3):
            return ["[heat_capacity]", f"value = {text(c, 'J/kg/K')}"]
        return lines + self.table(c)

    def conductivity(self, k: float, special: bool, insulation: bool) -> list[str]:
        if special and self.has("pressure varies in pores") and insulation:
            lines = ["[conductivity]", f"solid = {text(self.log_uniform(0.002, 0.02), 'W/m/K')}"]
            if self.chance(0.5):
                lines.append(f"solid_exponent = {self.uniform(0.0, 1.0)}")
            pores = [(self.uniform(0.3, 0.6), self.log_uniform(1e-7, 3e-4)) for _ in range(self.random.integers(1, 3))]
            lines.append("pores = [" + ", ".join(
                f"{{ share = {share}, length = {text(length, 'm')} }}" for share, length in pores) + "]")  # fmt: skip
            if self.chance(0.7):
                lines.append(f"extinction = {text(self.log_uniform(1e3, 2e4), '1/m')}")
            return lines + ['range = ["200 K", "3000 K"]']
        if special and self.has("pressure varies in tables"):
            lines = ["[conductivity]"]
            pressures = sorted({self.log_uniform(1.0, 1e5) for _ in range(self.random.integers(2, 7))})
            scale = k
            for pressure in pressures:
                lines += ["[[conductivity.at]]", f"pressure = {text(pressure, 'Pa')}", 'unit = "W/m/K"']
                lines += [line for line in self.table(scale)]
                scale = float(f"{scale * self.random.uniform(1.0, 2.5):.4g}")
            return lines
        lines = ["[conductivity]", 'unit = "W/m/K"']
        if special and self.has("close nodes"):
            spacing = self.log_uniform(0.2, 3.0)
            at = self.uniform(310.0, 600.0)
            n = int(self.random.integers(5, 40))
            t = [at + spacing * i for i in range(n)]
            v = [k * self.log_uniform(0.5, 3.0) for _ in range(n)]
            return lines + [f"temperatures_k = {numbers([250.0, *t, t[-1] + 400.0])}",
                            f"values = {numbers([k, *v, 1.5 * k])}", 'outside = "clamp"']  # fmt: skip
        if special and self.has("jump in a table") and self.chance(0.5):
            at = self.uniform(310.0, 700.0)
            factor = self.log_uniform(0.3, 3.0)
            return lines + [f"temperatures_k = {numbers([250.0, at, at, 1800.0])}",
                            f"values = {numbers([k, 1.1 * k, factor * k, factor * 1.3 * k])}",
                            'outside = "clamp"']  # fmt: skip
        if self.chance(0.3):
            return ["[conductivity]", f"value = {text(k, 'W/m/K')}"]
        return lines + self.table(k)

    def emissivity(self, special: bool) -> list[str]:
        if special and self.has("emissivity over temperature"):
            at = self.uniform(350.0, 900.0)
            width = self.log_uniform(0.5, 200.0)
            return ["[emissivity]", f"temperatures_k = {numbers([250.0, at, at + width, 2500.0])}",
                    f"values = {numbers([self.uniform(0.2, 0.9) for _ in range(4)])}", 'outside = "clamp"']  # fmt: skip
        return ["[emissivity]", f"value = {self.uniform(0.3, 0.95)}"]

    def decomposition(self) -> list[str]:
        lines = ["[decomposition]"]
        if self.chance(0.3):
            lines.append('mixture_rule = "volume"')
        n = int(self.random.integers(1, 4))
        total = self.random.uniform(0.1, 0.5)
        shares = self.random.dirichlet(np.ones(n)) * total
        for share in shares:
            at_k = self.random.uniform(380.0, 900.0)
            steep = self.random.uniform(50.0, 130.0) if self.has("wild kinetics") else self.random.uniform(10.0, 30.0)
            energy = steep * 8.314462618 * at_k
            # Kissinger: the fastest loss at 10 K/min is at this temperature.
            log_a = math.log(energy * (10.0 / 60.0) / (8.314462618 * at_k**2)) + steep
            pre_exponential = float(f"{math.exp(log_a):.4g}")
            heat = self.random.uniform(0.0, 2.5) if self.chance(0.85) else self.random.uniform(-0.3, 0.0)
            lines += ["[[decomposition.reaction]]", f"mass_loss = {float(f'{share:.3g}')}",
                      f"pre_exponential = {text(pre_exponential, '1/s')}",
                      f"activation_energy = {text(float(f'{energy / 1e3:.5g}'), 'kJ/mol')}",
                      f"order = {self.random.choice([1.0, 1.0, 1.5, 2.0, 3.0])}",
                      f"heat = {text(float(f'{heat:.3g}'), 'MJ/kg')}"]  # fmt: skip
            if self.chance(0.15):
                lines.append(f"onset_temperature = {text(round(at_k - 100.0, 1), 'K')}")
        lines += ["[decomposition.char]", f"heat_capacity = {{ times_virgin = {self.uniform(0.8, 1.3)} }}",
                  f"conductivity = {{ times_virgin = {self.uniform(0.8, 2.0)} }}"]  # fmt: skip
        return lines

    # Layup

    def ply(self, special: bool) -> Ply:
        kind = str(self.random.choice(["felt", "cloth", "board"]))
        if special and self.has("foil"):
            kind = "foil"
        if kind == "foil":
            thickness = self.log_uniform(1e-7, 5e-4)
            k, rho, c = self.log_uniform(10.0, 400.0), self.uniform(2500.0, 9000.0), self.uniform(300.0, 950.0)
        elif kind == "felt":
            thickness = self.log_uniform(3e-3, 5e-2)
            if special and self.has("thick felt"):
                thickness = self.log_uniform(5e-2, 1e-1)
            k, rho, c = self.log_uniform(0.02, 0.15), self.uniform(60.0, 250.0), self.uniform(700.0, 1200.0)
        elif kind == "cloth":
            thickness = self.log_uniform(2e-4, 2e-3)
            k, rho, c = self.log_uniform(0.08, 0.3), self.uniform(500.0, 1200.0), self.uniform(700.0, 1100.0)
        else:
            thickness = self.log_uniform(1e-3, 3e-2)
            k, rho, c = self.log_uniform(0.2, 3.0), self.uniform(300.0, 2500.0), self.uniform(600.0, 1300.0)
        return Ply(kind, thickness, k, rho, c)

    def layup(self) -> list[Ply]:
        n = int(self.random.integers(1, 5))
        if self.features & {"foil", "weak contact", "stiff contact"}:
            n = max(n, 2)
        plies = [self.ply(False) for _ in range(n)]
        if self.has("thick felt"):
            plies[int(self.random.integers(n))] = Ply(
                "felt", self.log_uniform(5e-2, 1e-1), self.log_uniform(0.02, 0.15), self.uniform(60.0, 250.0), 1000.0
            )
        if self.has("foil"):
            foils = 1 if n < 3 else 2
            for i in self.random.choice(n, size=foils, replace=False):
                if plies[int(i)].kind != "felt" or n > 1:
                    plies[int(i)] = self.ply(True)
            if all(ply.kind == "foil" for ply in plies):
                plies[-1] = Ply("felt", 0.01, 0.05, 100.0, 1000.0)
        return plies

    # Schedules

    def schedule(self, name: str, values: "list[float]", unit: str, column_unit: str, may_be_zero: bool) -> str:
        """A schedule through some of these values."""
        d = self.duration
        if self.has("short pulse") and may_be_zero and not self.pulsed:
            self.pulsed = True
            width = min(self.log_uniform(1e-3, 60.0), 0.3 * d)
            begin = float(f"{self.random.uniform(0.0, d - width):.6g}")
            end = begin + width
            top, low = values[0], 0.0 if self.chance(0.5) else 0.02 * values[0]
            if self.chance(0.5):
                points = [(0.0, low), (begin, low), (begin, top), (end, top), (end, low), (d, low)]
            else:
                points = [(0.0, low), (begin, low), (0.5 * (begin + end), top), (end, low), (d, low)]
        elif self.has("file schedule"):
            n = int(self.random.integers(15, 80))
            times = [float(f"{d * i / n:.7g}") for i in range(n)] + [d]
            smooth = np.interp(times, np.linspace(0.0, d, len(values)), values)
            column = [float(f"{v * (1.0 + 0.05 * self.random.standard_normal()):.5g}") for v in smooth]
            if not may_be_zero:
                column = [max(v, 0.3 * min(values)) for v in column]
            self.files[f"{name}.csv"] = f"time_s,value_{column_unit}\n" + "".join(
                f"{t!r},{v!r}\n" for t, v in zip(times, column)
            )
            return f'{{ file = "{name}.csv" }}'
        elif self.has("many corners") or self.chance(0.5):
            n = int(self.random.integers(6, 25)) if self.has("many corners") else int(self.random.integers(2, 5))
            inner = sorted({float(f"{x:.5g}") for x in self.random.uniform(0.0, d, n)} - {0.0, d})
            points = [(0.0, values[0])]
            for t in inner:
                value = float(self.random.choice(values)) * self.random.uniform(0.5, 1.0)
                if unit == "K":
                    value = float(self.random.choice(values))
                value = float(f"{value:.4g}")
                if may_be_zero and self.chance(0.2):
                    value = 0.0
                if self.chance(0.3):
                    points.append((t, points[-1][1]))
                points.append((t, value))
            if self.chance(0.3) and len(points) > 1 and points[-1][0] > 0.0:
                rows = ", ".join(f"[{text(t, 's')}, {text(v, unit)}]" for t, v in points)
                return f'{{ points = [{rows}], outside = "hold" }}'
            points.append((d, points[-1][1]))
        else:
            return text(values[0], unit)
        return "[" + ", ".join(f"[{text(t, 's')}, {text(v, unit)}]" for t, v in points) + "]"

    def unless_of_a_file(self, name: str, values: list[float], unit: str) -> str:
        """A schedule of a quantity whose unit no heading of a table has."""
        if self.has("file schedule"):
            return text(values[0], unit)
        return self.schedule(name, values, unit, "", True)

    # The case

    def write(self, folder: Path) -> None:
        lines = self.lines()
        (folder / "materials").mkdir(parents=True, exist_ok=True)
        (folder / "case.toml").write_text("\n".join(lines) + "\n")
        for name, content in self.files.items():
            (folder / name).write_text(content)

    def lines(self) -> list[str]:
        self.pulsed = False
        self.duration = self.log_uniform(2e3, 1.728e5) if self.has("long run") else self.log_uniform(1.0, 2e3)
        plies = self.layup()
        if self.has("latent heat"):
            for ply in plies:
                ply.thickness_m = min(ply.thickness_m, self.log_uniform(1e-3, 6e-3))
        specials = self.random.random(len(plies)) < 0.6
        specials[int(self.random.integers(len(plies)))] = True
        special_kinds = {"latent heat", "close nodes", "jump in a table", "pressure varies in tables",
                         "pressure varies in pores"}  # fmt: skip
        if self.features & special_kinds and all(ply.kind == "foil" for ply, s in zip(plies, specials) if s):
            specials[:] = True
        decomposes = [self.has("decomposition") and ply.kind != "foil" and bool(s) for ply, s in zip(plies, specials)]
        if self.has("decomposition") and not any(decomposes):
            decomposes[next(i for i, ply in enumerate(plies) if ply.kind != "foil")] = True

        interval = self.duration / float(self.random.choice([100.0, 200.0, 400.0]))
        if self.has("coarse instants"):
            interval = self.duration / float(self.random.integers(5, 20))
        interval = float(f"{interval:.3g}")
        start = self.uniform(280.0, 330.0)
        # Fronts of melting and of reactions, and tables with many nodes, take much time to resolve further.
        is_steep = self.features & {"latent heat", "close nodes", "decomposition", "jump in a table"}
        has_many = self.features & {"many corners", "file schedule"}
        tolerances = [0.5, 1.0] if is_steep else [0.1, 0.5] if has_many else [0.05, 0.1, 0.5]
        tolerance = float(self.random.choice(tolerances))
        case = [f"duration = {text(self.duration, 's')}"]
        if self.has("initial profile"):
            total = sum(ply.thickness_m for ply in plies)
            depths = [0.0, *sorted(float(f"{x:.4g}") for x in self.random.uniform(0.0, total, 2)), 2.0 * total]
            rows = ", ".join(f"[{text(x, 'm')}, {text(self.uniform(280.0, 500.0), 'K')}]" for x in depths)
            case.append(f"initial_temperature = [{rows}]")
        else:
            case.append(f"initial_temperature = {text(start, 'K')}")
        if self.features & {"pressure varies in tables", "pressure varies in pores"}:
            values = [self.log_uniform(1.0, 1e5) for _ in range(4)]
            case.append(f"pressure = {self.schedule('pressure', values, 'Pa', 'Pa', False)}")
        if self.has("decomposition"):
            case.append("decomposition = true")

        body: list[str] = []
        for i, (ply, special) in enumerate(zip(plies, specials)):
            body += ["", "[[ply]]", f'name = "P{i}"', f'material = "m{i}"', f"thickness = {text(ply.thickness_m, 'm')}"]
            if i + 1 < len(plies):
                is_weak, is_stiff = self.has("weak contact"), self.has("stiff contact")
                low, high = (0.1, 50.0) if is_weak else (1e6, 1e9) if is_stiff else (50.0, 1e4)
                if self.chance(0.6):
                    body.append(f"contact_below = {text(self.log_uniform(low, high), 'W/m^2/K')}")
            if self.has("limits") and self.chance(0.7):
                body.append(f"limit = {text(self.uniform(400.0, 1500.0), 'K')}")
                if self.chance(0.5) and i + 1 < len(plies):
                    body.append(f"limit_below = {text(self.uniform(400.0, 1500.0), 'K')}")
            is_special = bool(special) and ply.kind != "foil"
            material = [f'name = "Material {i}"', "[density]", f"value = {text(ply.density, 'kg/m^3')}"]
            material += self.heat_capacity(ply.heat_capacity, is_special and not decomposes[i])
            material += self.conductivity(ply.conductivity, is_special, ply.kind == "felt" or ply.kind == "cloth")
            material += self.emissivity(i == 0)
            if decomposes[i]:
                material += self.decomposition()
            self.files[f"materials/m{i}.toml"] = "\n".join(material) + "\n"

        sensors: list[str] = []
        for i in range(len(plies)):
            if i == len(plies) - 1 or self.chance(0.6):
                sensors += ["", "[[sensor]]", f'name = "S{i}"', f'below = "P{i}"']
                if self.chance(0.3) and i + 1 < len(plies):
                    sensors.append(f'side = "{self.random.choice(["above", "below"])}"')
                if self.has("lagging sensor") and self.chance(0.7):
                    sensors.append(f"time_constant = {text(self.log_uniform(1e-3, 30.0), 's')}")
                if self.has("limits") and self.chance(0.5):
                    sensors.append(f"limit = {text(self.uniform(400.0, 1500.0), 'K')}")
        if self.has("sensor in depth"):
            thickest = max(range(len(plies)), key=lambda i: plies[i].thickness_m)
            top = sum(ply.thickness_m for ply in plies[:thickest])
            depth = top + plies[thickest].thickness_m * self.uniform(0.05, 0.95)
            sensors += ["", "[[sensor]]", 'name = "D"', f"depth = {text(float(f'{depth:.6g}'), 'm')}"]
        if not self.has("held hot face"):
            sensors += ["", "[[sensor]]", 'name = "FACE"', 'depth = "0 m"']
        if self.has("pyrometer"):
            sensors += ["", "[[sensor]]", 'name = "PYRO"', 'kind = "pyrometer"',
                        f"emissivity = {self.uniform(0.5, 1.0)}"]  # fmt: skip
            if self.chance(0.6):
                sensors.append(f"wavelength = {text(self.log_uniform(0.8, 12.0), 'um')}")
            else:
                shorter = self.log_uniform(2.0, 9.0)
                sensors.append(f"band = [{text(shorter, 'um')}, {text(shorter * 1.5, 'um')}]")

        faces = ["", "[hot_face]", *self.hot_face(), *self.back_face()]
        if self.has("lateral holder"):
            conductance = text(self.log_uniform(1e2, 3e4), "W/m^3/K")
            held = self.schedule("holder", [self.uniform(280.0, 350.0)], "K", "K", False)
            faces += ["", "[holder]", f"conductance = {conductance}", f"temperature = {held}"]
        if self.has("decomposition"):
            faces += ["", "[gas]", f'flow = "{self.random.choice(["quasi-steady", "quasi-steady", "unhindered"])}"']
        resolution = ["", "[resolution]", f"output_interval = {text(interval, 's')}"]
        if tolerance != 0.05:
            resolution.append(f"tolerance = {text(tolerance, 'K')}")
        return case + body + sensors + faces + resolution

    def hot_face(self) -> list[str]:
        hot = self.uniform(600.0, 1500.0)
        flux = float(f"{0.5 * STEFAN_BOLTZMANN * hot**4:.4g}")
        if self.has("held hot face"):
            values = [self.uniform(300.0, 1200.0) for _ in range(4)]
            return ['kind = "held"', f"temperature = {self.schedule('hot', values, 'K', 'K', False)}"]
        if self.has("convective face"):
            films = [self.log_uniform(10.0, 300.0) for _ in range(2)]
            gases = [self.uniform(400.0, 1600.0) for _ in range(3)]
            film = self.unless_of_a_file("film", films, "W/m^2/K")
            return ['kind = "convective"', f"heat_transfer_coefficient = {film}",
                    f"gas = {self.schedule('gas', gases, 'K', 'K', False)}"]  # fmt: skip
        lines = ['kind = "heated"']
        if self.has("radiant flux"):
            lines.append(f"radiant_flux = {self.schedule('radiant', [flux, 0.5 * flux], 'W/m^2', 'w_m2', True)}")
        elif self.has("enthalpy film"):
            film = self.log_uniform(0.005, 0.05)
            written = self.unless_of_a_file("film", [film, 0.5 * film], "kg/m^2/s")
            lines.append(f"enthalpy_film_coefficient = {written}")
            lines.append(f"recovery_enthalpy = {text(self.uniform(1.0, 6.0), 'MJ/kg')}")
        else:
            lines.append(f"flux = {self.schedule('flux', [flux, 0.5 * flux, 0.2 * flux], 'W/m^2', 'w_m2', True)}")
            if self.has("hot wall"):
                lines.append(f"recovery_enthalpy = {text(self.uniform(2.0, 20.0), 'MJ/kg')}")
        if self.chance(0.3):
            lines.append(f"heat_transfer_coefficient = {text(self.log_uniform(3.0, 50.0), 'W/m^2/K')}")
            lines.append(f"gas = {text(self.uniform(280.0, 400.0), 'K')}")
        if self.chance(0.3):
            surroundings = '"0 K"' if self.chance(0.3) else text(self.uniform(250.0, 350.0), "K")
            lines.append(f"surroundings = {surroundings}")
        return lines

    def back_face(self) -> list[str]:
        if self.has("held back face"):
            values = [self.uniform(280.0, 400.0) for _ in range(3)]
            held = self.schedule("back", values, "K", "K", False)
            return ["", "[back_face]", 'kind = "held"', f"temperature = {held}"]
        if self.has("cooled back face"):
            film = text(self.log_uniform(1.0, 200.0), "W/m^2/K")
            ambient = self.schedule("ambient", [self.uniform(270.0, 350.0), 300.0], "K", "K", False)
            lines = ["", "[back_face]", 'kind = "cooled"']
            lines += [f"heat_transfer_coefficient = {film}", f"ambient = {ambient}"]
            if self.chance(0.3):
                lines.append(f"emissivity = {self.uniform(0.1, 0.9)}")
            return lines
        if self.has("back holder"):
            conductance = text(self.log_uniform(1.0, 1e4), "W/m^2/K")
            held = self.schedule("holder_back", [self.uniform(280.0, 350.0), 310.0], "K", "K", False)
            return ["", "[back_face]", 'kind = "holder"', f"conductance = {conductance}", f"temperature = {held}"]
        return []
