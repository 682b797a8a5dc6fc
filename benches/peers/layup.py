"""A layup for the peers: cells, steps and tables of bondline's own plan, as the bench `plan` prints them.

bondline marches at two resolutions and extrapolates (src/march/richardson.rs): a reading is 4/3 of the finer one less
1/3 of the coarser one. Each layup here carries its weight.

Conduction with k(T, P), c_p(T) and contacts; a hot face under a flux schedule with hot-wall correction and ε(T); an
insulated back, as `lcat-2259` has it. Other features of a plan are refused.
"""

import dataclasses
import json

import numpy as np

STEFAN_BOLTZMANN = 5.670374419e-8
# Weights of the resolutions, the finest first.
SHARES = {1: [1.0], 2: [4 / 3, -1 / 3]}


@dataclasses.dataclass(frozen=True)
class Stretch:
    """Adjacent plies of one material and the same factors: cells, tables, columns of the factors (column 0 is 1)."""

    start: int
    end: int
    # (conductivity without radiation, its slope, heat capacity[, radiative conductivity, its slope]) × node, SI.
    table: np.ndarray
    # Differences between nodes.
    rises: np.ndarray
    density_kg_m3: float
    conductivity: int
    extinction: int
    heat_capacity: int
    density: int

    @property
    def radiates(self):
        return len(self.table) > 3


def layups(path, resolutions=2):
    """The layups of a plan: the finer resolution, then the coarser one."""
    with open(path, encoding="utf-8") as file:
        plan = json.load(file)
    return [Layup(plan, march, share) for march, share in zip(plan["marches"], SHARES[resolutions])]


class Layup:
    def __init__(self, case, plan, share):
        refuse(case["case"], plan)
        self.share = share
        self.times_s, self.instants_s = np.array(plan["times_s"]), np.array(case["instants_s"])
        # Steps at whose start sensors are read, and the interpolation of each instant: instant × tap.
        self.records = np.array(plan["record_steps"])
        taps = np.array(plan["taps"])
        self.taps, self.weights = taps[..., 0].astype(int), taps[..., 1]
        cells, plies = columns(plan["cells"]), columns(plan["plies"])
        self.width_m, self.above_m, self.below_m = cells["width_m"], cells["above_m"], cells["below_m"]
        self.start_k = cells["start_k"]
        # Below each cell but the last: contact resistance (m²K/W) at an interface, else half over the distance (1/m).
        self.interfaces = plies["end_cell"][:-1].astype(int) - 1
        self.contacts_m2_k_w = np.array(plan["contacts_m2_k_w"])[: len(self.interfaces)]
        self.half_over_next_1_m = cells["half_over_next_1_m"][:-1]
        self.table_step_k, self.table_nodes = plan["table_step_k"], plan["table_nodes"]
        self.stretches = stretches(plan, plies)
        # (enthalpy of air less that at the cold wall, its slope, emissivity of the hot face) × node.
        self.face = np.ascontiguousarray(np.array(plan["tables"][-1])[:, [0, 2, 4]].T)
        self.face_rises = np.diff(self.face)
        self.emissivity = int(columns(plan["scalings"])["emissivity"][0])
        drives = columns(plan["drives"])
        # One over the difference of enthalpies of a cold-wall flux.
        self.hot_wall_kg_j = drives["hot_wall"].max()
        # Step × (start, end).
        self.flux_w_m2 = drives["convection"].reshape(-1, 4)[:-1, :2]
        self.surroundings_k = drives["surroundings_k"].reshape(-1, 4)[:-1, :2]
        sensors, places = columns(plan["sensors"]), columns(plan["places"])
        # Each sensor lies between this cell and the next.
        self.places = places["cell"].astype(int)
        self.sides = [(sensors[side] * sensors[f"{side}_m"]) for side in ("above", "below")]
        self.share_below = sensors["below"]

    def read(self, xp, records):
        """From … × record × sensor to … × instant × sensor."""
        return (xp.take(records, self.taps, axis=-2) * self.weights[..., None]).sum(axis=-2)

    @property
    def shape(self):
        """Of a member's traces: instant × sensor."""
        return len(self.instants_s), len(self.places)

    @property
    def cells(self):
        return len(self.width_m)

    @property
    def steps_s(self):
        return np.diff(self.times_s)


def columns(table):
    return dict(zip(table["fields"], np.array(table["rows"], float).T))


def stretches(plan, plies):
    """Adjacent equal plies merged; zero radiative parts left out."""
    found = []
    # A ply here has one state, and its conductivity factors too.
    conductions = columns(plan["conductions"])
    for ply, density in enumerate(columns(plan["bulks"])["density_kg_m3"]):
        row = {name: int(values[ply]) for name, values in plies.items()}
        table = np.array(plan["tables"][ply])
        # Each property is followed by its difference to the next node.
        picked = [0, 4, 2] + ([8, 10] if plan["parts"] == 2 and table[:, 8].any() else [])
        scales = {name: row[name] for name in ("heat_capacity", "density")}
        scales["conductivity"], scales["extinction"] = (
            int(conductions[of][row["first_state"]]) for of in ("whole", "extinction")
        )
        own = np.ascontiguousarray(table[:, picked].T)
        stretch = Stretch(row["first_cell"], row["end_cell"], own, np.diff(own), density, **scales)
        last = found[-1] if found else None
        if (
            last
            and last.density_kg_m3 == density
            and np.array_equal(last.table, stretch.table)
            and scales.items() <= vars(last).items()
        ):
            found[-1] = dataclasses.replace(last, end=stretch.end)
        else:
            found.append(stretch)
    return found


def refuse(case, plan):
    """The features of a plan that the peers do not support."""
    faces, drives, plies = columns(plan["faces"]), columns(plan["drives"]), columns(plan["plies"])
    emissivity = np.array(plan["tables"][-1])[:, 12]
    heated = drives["convection"] != 0
    scalings = columns(plan["scalings"])
    beyond = {
        "gas, decomposition or a holder": plan["has_gas"] or plan["has_holder"] or plan["states"] > 1,
        "pressure that changes": plan["depends_on_pressure"],
        "tables with nodes between multiples of 5 K": plan["has_directories"],
        "steep heat capacities": plan["advances_enthalpy"],
        "conductivity in three parts": plan["parts"] > 2,
        "a held face, a film or blowing": faces["held"].any() or drives["film_w_m2_k"].any() or drives["blowing"].any(),
        "film coefficients of enthalpy, or a recovery enthalpy that changes": (drives["recovery"][heated] != 1).any()
        or np.ptp(drives["hot_wall"][heated]) > 0,
        "radiant heating or a heated back": drives["radiant_w_m2"].any() or heated.reshape(-1, 4)[:, 2:].any(),
        "a back face that radiates": emissivity.any(),
        "factors on thickness, contacts or depths": plan["has_depths"]
        or plies["thickness"].any()
        or plies["contact"].any(),
        "thermocouples that lag": columns(plan["beads"])["start"].any(),
        "factors on heating or radiation to the surroundings": any(
            scalings[name].any() for name in ("heating", "film", "exchange")
        ),
    }
    for what, is_there in beyond.items():
        if is_there:
            raise SystemExit(f"{case}: the peers do not march {what}")
