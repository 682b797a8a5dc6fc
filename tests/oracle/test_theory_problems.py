"""The march by the text of docs/theory, on the decomposing problems of `bondline verify`, with their tolerances.

Each problem states its errors over their tolerances, for the right input and for one that is changed: the negative
control.
"""

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import theory_march
from scipy.integrate import solve_ivp
from tables import Array, Schedule, Table
from theory_march import GAS_CONSTANT, Face, Gas, Layup, March, Material, Reaction, State, march

DATA = Path(__file__).parents[2] / "data" / "verification"
HELD = Face(held=Schedule.constant(1000.0))
ATMOSPHERE = 101325.0


def rows(name: str, series: str | None = None) -> tuple[list[str], list[list[Any]]]:
    """Heading and rows of a series of published figures."""
    with open(DATA / name) as file:
        heading, *found = list(csv.reader(line for line in file if not line.startswith("#")))
    return heading, [row for row in found if series in (None, row[0])]


def properties(name: str) -> list[Table]:
    """The columns of a file over the temperature in its first."""
    at, *columns = np.array(rows(name)[1], dtype=float).T
    return [Table(tuple(at), tuple(column)) for column in columns]


def gas_of(capacity: float, formation: float = 0.0) -> Gas:
    enthalpy = Table((1.0, 4000.0), (formation + capacity, formation + 4000.0 * capacity))
    return Gas(enthalpy, Table.constant(0.022), Table.constant(3e-5))


def sourced(state: State, source: float, duration: float) -> Material:
    """A constant source of gas: a reaction of order zero, of which a thousandth proceeds."""
    rate = 1e-3 / duration
    return Material(source / (0.5 * rate), (state, state), (Reaction(0.5, rate, 0.0, 0.0),))


def porous(slip: float = 0.0, forchheimer: float = 0.0, permeability: float = 2e-11) -> State:
    return State(Table.constant(1e5), Table.constant(1e3), 0.0, 0.85, permeability, slip, forchheimer)


SLAB = Layup(
    plies=(), contacts=(), sensors=(), duration=1.0, initial=1000.0, hot=HELD, back=HELD, gas=gas_of(0.0), flow="darcy",
    cells=100, first_step=1e-6, step_growth=0.05, max_step=1e9, interval=1.0,
)  # fmt: skip


def one_reaction(order: float, change: float) -> list[float]:
    """From 600 to 1000 K at 1 K/s."""
    state = State(Table.constant(1000.0), Table.constant(1e6))
    reaction = Reaction(0.5, change * 1e9, 150e3, order)
    held = Face(held=Schedule((0.0, 400.0), (600.0, 1000.0)))
    layup = replace(
        SLAB, plies=((Material(280.0, (state, state), (reaction,)), 1e-3),), duration=400.0, initial=600.0, hot=held,
        back=held, flow="unhindered", cells=4, first_step=1.0, step_growth=0.0, max_step=1.0, interval=25.0,
    )  # fmt: skip
    found = march(layup)[0][:, 0] / (0.5 * 280.0 * 1e-3)

    def rate(t: float, x: Array) -> Array:
        left = np.maximum(1.0 - x, 0.0)
        speed: Array = 1e9 * math.exp(-150e3 / GAS_CONSTANT / (600.0 + t)) * left**order
        return speed

    exact = solve_ivp(rate, (0.0, 400.0), [0.0], "DOP853", np.arange(0.0, 401.0, 25.0), rtol=1e-11, atol=1e-12).y[0]
    return [float(np.max(np.abs(found - exact))) / 1e-6]


def cooled_by_reaction(is_absolute: bool, change: float) -> list[float]:
    """c dT = H dρ/ρ, to 6 s."""
    c, heat, loss, virgin, char = 1500.0, 5e5, 0.4, -8e5, 1e5
    formation = (virgin - (1.0 - loss) * char) / loss + heat if is_absolute else 0.0
    own, conductive = Table.constant(c), Table.constant(1e6)
    states = tuple(State(own, conductive, enthalpy=change * h + c * 300.0) for h in (virgin, char))
    reactions = (Reaction(loss, 1e6, 1e5, 1.0, change * heat),)
    slab = Material(280.0, states, reactions, reference=300.0 if is_absolute else None)
    layup = replace(
        SLAB, plies=((slab, 1e-3),), sensors=(0.0,), duration=6.0, initial=900.0, hot=Face(), back=Face(),
        gas=gas_of(c, formation), flow="unhindered", cells=4, first_step=7.5e-3, max_step=7.5e-3, interval=3.0,
    )  # fmt: skip
    found = march(layup)[0]

    def temperature(x: Array) -> Array:
        t: Array = 900.0 + heat / c * np.log(1.0 - loss * x)
        return t

    def rate(_: float, x: Array) -> Array:
        speed: Array = 1e6 * np.exp(-1e5 / GAS_CONSTANT / temperature(x)) * (1.0 - x)
        return speed

    x = solve_ivp(rate, (0.0, 6.0), [0.0], "DOP853", [0.0, 3.0, 6.0], rtol=1e-11, atol=1e-12).y[0]
    drop = 900.0 - float(temperature(np.array(1.0)))
    off = np.max(np.abs(found[:, 0] - temperature(x))) / drop, np.max(np.abs(found[:, 1] / (loss * 0.28) - x))
    return [float(error) / 1e-6 for error in off]


def uniform_source(change: float, slip: float = 20.0) -> list[float]:
    """(p + b)² = (p₀ + b)² + π μ L² (RT/M)/K at the sealed back."""
    slab = sourced(porous(slip, permeability=change * 2e-11), 0.5, 2.0)
    values, fine = march(replace(SLAB, plies=((slab, 0.05),), duration=2.0, interval=2.0))
    driven = 0.5 * 3e-5 * 0.05**2 * GAS_CONSTANT * 1000.0 / 0.022 / 2e-11
    back = math.sqrt((ATMOSPHERE + 1000.0 * slip) ** 2 + driven) - 1000.0 * slip
    return [abs(fine.pressure[-1][-1] / back - 1.0) / 1e-6, abs(values[-1, 1] / (0.5 * 0.05) - 1.0) / 1e-6]


def steady_flow(slip: float, forchheimer: float, change: float) -> list[float]:
    """The root of (M/RT) ((p₁² − p₀²)/2 + b (p₁ − p₀))/L = μ G/K + β G²."""
    slab = Material(1.0, (porous(change * slip, change * forchheimer),))
    layup = replace(
        SLAB, plies=((slab, 0.05),), duration=2.0, interval=2.0, pressure=Schedule.constant(1e4),
        back_pressure=Schedule((0.0, 0.1), (1e4, 3e4)),
    )  # fmt: skip
    driving = 0.022 / (GAS_CONSTANT * 1000.0) * (2e4 + 1000.0 * slip) * 2e4 / 0.05
    drag = 3e-5 / 2e-11
    exact = 2.0 * driving / (drag + math.sqrt(drag**2 + 4.0 * forchheimer * driving))
    return [float(abs(march(layup)[0][-1, 1] / exact - 1.0)) / 1e-6]


def driven_into_near_vacuum(change: float) -> list[float]:
    """p = (U μ ε/K)(U t − x). 200 cells and steps of 2 ms in place of 400 and 1 ms."""
    slope = 0.05 * 3e-5 * 0.85 / 2e-11
    layup = replace(
        SLAB, plies=((Material(1.0, (porous(permeability=change * 2e-11),)), 0.05),), cells=200, first_step=2e-3,
        step_growth=0.0, max_step=2e-3, interval=0.1, pressure=Schedule((0.0, 1.0), (1.0, slope * 0.05)),
    )  # fmt: skip
    values, fine = march(layup)
    exact = -0.85 * 0.05 * 0.022 / (GAS_CONSTANT * 1000.0) * slope * 0.05 * np.arange(0.1, 0.91, 0.1)
    flux = float(np.max(np.abs(values[1:10, 1] - exact)) / abs(exact[-1]))
    back = float(np.max(np.abs(fine.profiles(fine.pressure)[1:10, -1] - 1.0)))
    return [flux / 2e-3, back / 1e-3]


def enclosed_and_heated(change: float) -> list[float]:
    """p/T is constant under a cover that lets nothing through."""
    conductive = replace(porous(), heat_capacity=Table.constant(1.0), conductivity=Table.constant(1e9))
    cover = Material(1.0, (replace(conductive, permeability=0.0),))
    held = Face(held=Schedule((0.0, 20.0), (300.0, 900.0 * change)))
    layup = replace(
        SLAB, plies=((cover, 0.01), (Material(1.0, (conductive,)), 0.01)), contacts=(None,), duration=20.0,
        initial=300.0, hot=held, back=held, cells=20, first_step=0.2, step_growth=0.0, max_step=0.2, interval=2.0,
    )  # fmt: skip
    _, fine = march(layup)
    found = fine.profiles(fine.pressure)[1:, -1] / ATMOSPHERE
    return [float(np.max(np.abs(found / (1.0 + 0.2 * np.arange(1.0, 11.0)) - 1.0))) / 1e-6]


def conduction_against_gas(flow: str, change: float) -> list[float]:
    """T = T_h − (T_h − T_b) (1 − e^(−Pe x/L))/(1 − e^(−Pe)), Pe = 2."""
    passed = replace(porous(), conductivity=Table.constant(0.5))
    maker = replace(porous(), heat_capacity=Table.constant(1.0), conductivity=Table.constant(1e6))
    depths = tuple(1e-3 * i for i in range(1, 10))
    layup = replace(
        SLAB, plies=((Material(1.0, (passed,)), 0.01), (sourced(maker, 100.0, 400.0), 1e-3)), contacts=(None,),
        sensors=depths, duration=400.0, initial=500.0, hot=Face(held=Schedule((0.0, 10.0), (500.0, 1300.0))),
        back=Face(held=Schedule.constant(500.0)), gas=gas_of(change * 1000.0), flow=flow, cells=200, first_step=1e-3,
        step_growth=0.05, interval=400.0,
    )  # fmt: skip
    exact = 1300.0 - 800.0 * np.expm1(-200.0 * np.array(depths)) / math.expm1(-2.0)
    return [float(np.max(np.abs(march(layup)[0][-1, :9] - exact))) / 800.0 / 3e-6]


def charring_board(change: float) -> list[float]:
    """Under a film to hot gas, to 30 s, against the method of lines."""
    virgin = State(Table.constant(1200.0), Table.constant(0.15), 0.7)
    char = State(Table.constant(1100.0), Table.constant(0.25), 0.9)
    board = Material(300.0, (virgin, char), (Reaction(0.3, 1e6, 1e5, 1.0, change * 1e6),), by_volume=True)
    heading, temperatures = rows("charring_board.csv", "film")
    temperatures = [row for row in temperatures if float(row[1]) <= 30.0]
    masses = rows("charring_board_gas.csv", "film")[1][: len(temperatures)]
    gas_k = Schedule((0.0, 5.0, 60.0), (300.0, 1400.0, 1400.0))
    layup = replace(
        SLAB, plies=((board, 0.006),), sensors=tuple(float(x) for x in heading[2:]), duration=30.0, initial=300.0,
        hot=Face(film=Schedule.constant(200.0), gas=gas_k, radiates=True), back=Face(), gas=gas_of(1500.0),
        flow="quasi-steady", cells=60, first_step=1e-3, step_growth=0.1, max_step=0.05, interval=2.5,
    )  # fmt: skip
    values, _ = march(layup)
    at = [round(float(row[1]) / 2.5) for row in temperatures]
    exact = np.array([[float(x) for x in row[2:]] for row in temperatures])
    lost = np.array([float(row[2]) for row in masses])
    return [
        float(np.max(np.abs(values[at, :6] - exact))) / 0.05,
        float(np.max(np.abs(values[at, 6] - lost))) / (3e-5 * 0.54),
    ]


def gpyro_slab(permeability: float, change: float) -> list[float]:
    """Two reactions in a chain: temperatures of gpyro, or its pressure at the back."""
    nodes = tuple(float(t) for t in range(250, 1501, 5))

    def radiating(solid: float, length: float) -> Table:
        return Table(nodes, tuple(solid + length * theory_march.STEFAN_BOLTZMANN * t**3 for t in nodes))

    def viscosity(t: float) -> float:
        """Chapman and Enskog's, with the collision integral of Neufeld, Janzen and Aziz (1972)."""
        reduced = t / 254.0
        collision = 1.06036 * math.pow(reduced, -0.1561) + 0.193 * math.exp(-0.47635 * reduced)
        collision += 1.03587 * math.exp(-1.52996 * reduced) + 1.76474 * math.exp(-3.89411 * reduced)
        diffusivity = 1e-4 * 0.0018583 * math.sqrt(t**3 * 2.0 / 44.0) / (5.061**2 * collision)
        return ATMOSPHERE * 0.044 / (8.314 * t) * diffusivity

    def state(conductivity: Table, emissivity: float) -> State:
        return State(Table.constant(1500.0), conductivity, emissivity, 0.5, change * permeability)

    states = (state(Table.constant(0.2), 0.65), state(radiating(0.15, 0.001), 0.95), state(radiating(0.1, 0.002), 0.9))
    reactions = (Reaction(0.6, 5e8, 130e3, 1.0, 6e5), Reaction(0.3, 5e10, change * 175e3, 1.0, 1e5))
    at = tuple(25.0 * i for i in range(10, 61))
    gas = Gas(gas_of(1000.0).enthalpy, Table.constant(0.044), Table(at, tuple(viscosity(t) for t in at)))
    film = Face(radiant=Schedule.constant(25e3), film=Schedule.constant(10.0), gas=Schedule.constant(300.0),
                radiates=True)  # fmt: skip
    layup = replace(
        SLAB, plies=((Material(500.0, states, reactions, True, True), 0.008),), sensors=(0.0, 0.004, 0.008),
        duration=801.0, initial=300.0, hot=film, back=Face(), gas=gas, flow="darcy" if permeability else "quasi-steady",
        cells=60, first_step=1e-3, step_growth=0.1, max_step=1.0, interval=801.0,
    )  # fmt: skip
    found = March(layup, 1).run()
    if permeability:
        _, given = rows("gpyro_charring_slab_gas.csv", f"permeable {permeability:.0e} m2")
        times, over = np.array([[float(row[1]), float(row[3])] for row in given]).T
        own = np.interp(times, found.times, [p[-1] for p in found.pressure]) - ATMOSPHERE
        return [float(np.max(np.abs(own - over)[times > 250.0])) / (0.02 * float(np.max(over)))]
    _, given = rows("gpyro_charring_slab.csv", "gpyro")
    times = np.array([float(row[1]) for row in given])
    exact = 273.15 + np.array([[float(x) for x in row[2:]] for row in given])
    traces = np.array([record.temperatures for record in found.records])
    own = np.array([np.interp(times, found.times, trace) for trace in traces.T]).T
    return [float(np.max(np.abs(own - exact))) / 0.5]


def tacot_held(change: float) -> list[float]:
    """Test case 1.0 of the Ablation Workshop to 10 s: temperatures, gas flux and pressure of the converged solution."""
    virgin, char, gas = (properties(f"tacot_{of}.csv") for of in ("virgin", "char", "gas"))
    states = (
        State(virgin[0], virgin[1], 0.0, 0.8, 1.6e-11, enthalpy=change * -857e3),
        State(char[0], char[1], 0.0, 0.85, 2e-11),
    )
    late = (4.97777e8, 1.69975e5, 3.0, 0.0, 555.6)
    reactions = (
        Reaction(30.0 / 280.0, 1.2e4, 71130.89, 3.0, 0.0, 333.3),
        *(Reaction(loss / 280.0, *late) for loss in (22.8, 7.2)),
    )
    tacot = Material(280.0, states, reactions, reference=298.0)
    heading, temperatures = rows("tacot_held.csv", "converged")
    _, flows = rows("tacot_held_gas.csv", "converged")
    layup = replace(
        SLAB, plies=tuple((tacot, x) for x in (0.0015, 0.0035, 0.009, 0.036)), contacts=(None, None, None),
        sensors=tuple(float(x) for x in heading[2:]), duration=10.0, initial=300.0, back=Face(),
        hot=Face(held=Schedule((0.0, 0.1, 60.0), (300.0, 1644.0, 1644.0))), gas=Gas(gas[1], gas[0], gas[2]), cells=240,
        first_step=1e-3, step_growth=0.05, max_step=0.1,
    )  # fmt: skip
    values, fine = march(layup)
    exact = np.array([[float(x) for x in row[1:]] for row in temperatures if float(row[1]) <= 10.0])
    flux = np.array([[float(row[i]) for i in (1, 2, 5)] for row in flows if float(row[1]) <= 10.0])
    at = [int(t) for t in flux[:, 0]]
    largest = np.max(fine.profiles(fine.pressure)[at], axis=1) - ATMOSPHERE
    return [
        float(np.max(np.abs(values[exact[:, 0].astype(int), :8] - exact[:, 1:]))) / 0.3,
        float(np.max(np.abs(values[at, 9] / flux[:, 1] - 1.0))) / 2.6e-3,
        float(np.max(np.abs(largest - flux[:, 2]))) / 1.5,
    ]


PROBLEMS: dict[str, tuple[float, Callable[[float], list[float]]]] = {
    # The input is changed by this factor in the control.
    "one reaction of order 0.5": (1.001, lambda change: one_reaction(0.5, change)),
    "one reaction of order 3": (1.001, lambda change: one_reaction(3.0, change)),
    "cooled by reaction, heat of reaction": (1.001, lambda change: cooled_by_reaction(False, change)),
    "cooled by reaction, absolute heat": (1.001, lambda change: cooled_by_reaction(True, change)),
    "uniform gas source, slip 20 Pa/K": (1.001, uniform_source),
    "steady gas flow, slip": (1.001, lambda change: steady_flow(10.0, 0.0, change)),
    "steady gas flow, inertia": (1.001, lambda change: steady_flow(0.0, 1e7, change)),
    "gas driven into near vacuum": (1.05, driven_into_near_vacuum),
    "enclosed gas, heated": (1.001, enclosed_and_heated),
    "conduction against quasi-steady gas": (1.001, lambda change: conduction_against_gas("quasi-steady", change)),
    "conduction against Darcy flow": (1.001, lambda change: conduction_against_gas("darcy", change)),
    "charring board, film to hot gas": (1.01, charring_board),
    "charring slab, two reactions in a chain": (1.01, lambda change: gpyro_slab(0.0, change)),
    "charring slab, permeable 1e-13 m2": (1.05, lambda change: gpyro_slab(1e-13, change)),
    "TACOT held at 1644 K": (1.02, tacot_held),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_march_of_the_theory_agrees_with_a_problem_of_verify(name: str) -> None:
    factor, errors = PROBLEMS[name]
    right, changed = errors(1.0), errors(factor)
    assert max(right) < 1.0, right
    assert max(changed) > 1.5, changed
