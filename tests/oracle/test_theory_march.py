"""The march by the text of docs/theory: with the same cells and steps it gives the digits of bondline.

Each comparison has a negative control: a spoiled march that must fail. `BONDLINE_PROGRAM` states the command.
"""

import csv
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import theory_march
from comparison import program
from tables import Array, Schedule, Table
from theory_march import Face, Gas, Layup, Material, Reaction, State, march, write

# bondline writes nine digits; the rest is rounding of a thousand steps.
DIGITS = 2e-8


def line(at_300_k: float, at_1800_k: float) -> Table:
    """A straight line through both values."""
    beyond = (at_1800_k - at_300_k) / 15.0
    return Table((200.0, 1900.0), (at_300_k - beyond, at_1800_k + beyond))


def felt(permeability: float = 1e-13, by_volume: bool = False, shrinkage: float = 0.0) -> Material:
    """Two parallel reactions."""
    virgin = State(line(1000.0, 1800.0), line(0.08, 0.3), 0.8, 0.7, permeability, 20.0)
    char = State(line(900.0, 1900.0), line(0.1, 0.5), 0.9, 0.8, 2.0 * permeability, 20.0)
    reactions = (Reaction(0.1, 3e4, 7e4, 1.0, 4e5), Reaction(0.2, 1e5, 9e4, 2.0, 8e5))
    return Material(200.0, (virgin, char), reactions, by_volume=by_volume, shrinkage=shrinkage)


def chain(is_absolute: bool) -> Material:
    """Two consecutive reactions, one with an onset; slip, inertia, shrinkage."""
    states = (
        State(line(1000.0, 1800.0), line(0.08, 0.3), 0.8, 0.5, 1e-12, 10.0, 1e6, enthalpy=-8e5),
        State(line(950.0, 1700.0), line(0.15, 0.35), 0.85, 0.6, 2e-12, 12.0, 2e6, enthalpy=-6e5),
        State(line(900.0, 1900.0), line(0.1, 0.5), 0.9, 0.8, 4e-12, 20.0, 5e5, enthalpy=-1e5),
    )
    reactions = (Reaction(0.15, 3e4, 7e4, 1.0, 4e5), Reaction(0.2, 1e5, 9e4, 1.5, 8e5, 450.0))
    return Material(300.0, states, reactions, True, True, 0.1, 298.15 if is_absolute else None)


WOOL = Material(120.0, (State(line(800.0, 1200.0), line(0.03, 0.15), 0.5, 0.9, 1e-11, 5.0),))
SENSIBLE = Gas(Table((200.0, 1900.0), (0.0, 3.4e6)), line(0.03, 0.02), line(1.5e-5, 5e-5))
ABSOLUTE = replace(SENSIBLE, enthalpy=Table((200.0, 400.0, 800.0, 1900.0), (-2.5e6, -2.1e6, -1e6, 3e6)))

FELT = Layup(
    plies=((felt(), 0.005),), contacts=(), sensors=(0.0, 0.002, 0.005), duration=40.0, initial=300.0,
    hot=Face(flux=Schedule((0.0, 30.0, 40.0), (0.0, 60e3, 60e3)), radiates=True), gas=SENSIBLE, flow="quasi-steady",
    cells=20, first_step=0.02, step_growth=0.2, max_step=0.2, interval=1.0,
)  # fmt: skip
CHAIN = replace(
    FELT, plies=((chain(False), 0.003), (WOOL, 0.004)), contacts=(500.0,), sensors=(0.0, 0.001, 0.003, 0.005, 0.007),
    duration=30.0, cells=30, back=Face(film=Schedule.constant(10.0), gas=Schedule.constant(300.0), radiates=True),
    hot=Face(flux=Schedule((0.0, 5.0, 20.0, 30.0), (0.0, 3e5, 3e5, 1e5)), recovery=Schedule((0.0, 30.0), (8e6, 1.2e7)),
             blowing=0.5, radiates=True),
)  # fmt: skip
HELD = replace(
    FELT, plies=((felt(), 0.003), (felt(by_volume=True, shrinkage=0.2), 0.002)), contacts=(1000.0,),
    hot=Face(held=Schedule((0.0, 10.0, 30.0, 40.0), (300.0, 900.0, 1200.0, 1000.0))), sensors=(0.001, 0.003, 0.004),
)  # fmt: skip
LAYUPS = {
    "a felt, gas unhindered": replace(FELT, flow="unhindered"),
    "a felt, quasi-steady gas": FELT,
    "a felt under a pressure that rises": replace(
        FELT, plies=((felt(1e-12), 0.005),), flow="darcy",
        pressure=Schedule((0.0, 5.0, 10.0, 40.0), (1e3, 1e3, 101325.0, 9e4)),
    ),
    "a felt with an open back": replace(
        FELT, plies=((felt(1e-12), 0.005),), flow="darcy",
        back=Face(film=Schedule.constant(10.0), gas=Schedule.constant(300.0)),
        back_pressure=Schedule((0.0, 20.0, 40.0), (101325.0, 1.2e5, 101325.0)),
    ),
    "a chain under blowing, heats of reaction": CHAIN,
    "a chain under blowing, absolute heats": replace(
        CHAIN, plies=((chain(True), 0.003), (WOOL, 0.004)), gas=ABSOLUTE, flow="darcy"
    ),
    "two felts below a held face, quasi-steady gas": HELD,
    "two felts below a held face, Darcy flow": replace(HELD, flow="darcy"),
}  # fmt: skip


def reported(layup: Layup, folder: Path) -> tuple[dict[str, Array], dict[str, Array]]:
    """Columns of the traces, and of the profiles of cells, that bondline writes."""
    write(layup, folder)
    instants = round(layup.duration / layup.interval) + 1
    command = [program(), "predict", str(folder), "--precision", "f64", "--backend", "cpu", "--depth-profiles",
               str(instants), "--out", str(folder / "out"), "-q"]  # fmt: skip
    run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stdout + run.stderr

    def columns(name: str) -> dict[str, Array]:
        with open(folder / "out" / name) as file:
            heading, *rows = list(csv.reader(file))
        kept = [i for i, column in enumerate(heading) if column != "ply"]
        return {heading[i]: np.array([float(row[i] or "nan") for row in rows]) for i in kept}

    return columns("traces.csv"), columns("state-profiles.csv")


def worst(found: Array, given: Array) -> float:
    """Largest difference relative to the largest value."""
    return float(np.max(np.abs(found - given)) / np.max(np.abs(given)))


def differences(layup: Layup, traces: dict[str, Array], profiles: dict[str, Array]) -> dict[str, float]:
    """Differences between this march and bondline's, relative to the largest value of each quantity."""
    values, fine = march(layup)
    n = len(layup.sensors)
    found = {f"S{i}_k": worst(values[:, i], traces[f"S{i}_k"]) for i in range(n)}
    found["mass lost"] = worst(values[:, n], traces["mass_lost_kg_m2"])
    # The first two records of the flux have no two steps before them.
    found["gas flux"] = worst(values[1:, n + 1], traces["gas_flux_kg_m2_s"][1:])
    found["conversion"] = worst(fine.profiles(fine.conversion).ravel(), profiles["char_fraction"])
    if layup.flow == "darcy":
        found["pressure"] = worst(fine.profiles(fine.pressure).ravel(), profiles["pressure_pa"])
    return found


@pytest.mark.parametrize("name", LAYUPS)
def test_the_march_of_the_theory_gives_the_digits_of_bondline(name: str, tmp_path: Path) -> None:
    found = differences(LAYUPS[name], *reported(LAYUPS[name], tmp_path))
    assert max(found.values()) < DIGITS, found


@pytest.mark.parametrize(
    ("detail", "value", "flow"),
    [
        ("DAMPING_SHARE", 0.31, "quasi-steady"),
        ("GAS_CONSTANT", 8.3145, "quasi-steady"),
        ("GAMMA_P", theory_march.GAMMA, "darcy"),
        ("STEFAN_BOLTZMANN", 5.67e-8, "unhindered"),
    ],
)
def test_a_march_with_one_detail_changed_gives_other_digits(
    detail: str, value: float, flow: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hot = Face(flux=Schedule((0.0, 5.0, 20.0), (0.0, 9e4, 9e4)), radiates=True)
    layup = replace(FELT, flow=flow, duration=20.0, hot=hot)
    given = reported(layup, tmp_path)
    same = differences(layup, *given)
    assert max(same.values()) < DIGITS, same
    monkeypatch.setattr(theory_march, detail, value)
    other = differences(layup, *given)
    assert max(other.values()) > 10.0 * DIGITS, other
