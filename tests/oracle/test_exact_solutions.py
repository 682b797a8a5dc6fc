"""The oracle against exact solutions. Each comparison has a negative control: a spoiled input that must fail."""

import math
from pathlib import Path

import numpy as np
import pytest
from air import free_conductivity, pore_conductivity
from case_file import load
from pyrometer import brightness_temperature
from quantities import Refused, si
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.special import erf, erfc
from solution import Result, solve
from tables import Array, Table, integral_at_starts

SIGMA = 5.670374419e-8
R = 8.31446261815324

SOLID = """
name = "Solid"
[density]
value = "{density} kg/m^3"
[heat_capacity]
value = "{c} J/kg/K"
[conductivity]
value = "{k} W/m/K"
[emissivity]
value = {emissivity}
"""


def solid(k: float = 1.0, density: float = 1000.0, c: float = 1000.0, emissivity: float = 0.5) -> str:
    return SOLID.format(k=k, density=density, c=c, emissivity=emissivity)


def run(folder: Path, case: str, times_s: list[float], **materials: str) -> Result:
    """The oracle's values of a case that is written into a folder."""
    (folder / "materials").mkdir(parents=True, exist_ok=True)
    (folder / "case.toml").write_text(case)
    for name, content in materials.items():
        (folder / "materials" / f"{name}.toml").write_text(content)
    return solve(load(folder), np.array(times_s))


def agrees(found: Array | float, exact: Array | float, tolerance: float) -> bool:
    return bool(np.max(np.abs(np.asarray(found) - np.asarray(exact))) <= tolerance)


HELD_SLAB = """
duration = "100 s"
initial_temperature = "300 K"
[[ply]]
name = "S"
material = "s"
thickness = "10 mm"
[[sensor]]
name = "B"
below = "S"
[[sensor]]
name = "M"
depth = "3 mm"
[hot_face]
kind = "held"
temperature = "400 K"
"""


def test_a_step_of_the_face_temperature_follows_the_fourier_series(tmp_path: Path) -> None:
    times = [5.0, 20.0, 60.0, 100.0]
    found = run(tmp_path, HELD_SLAB, times, s=solid())
    n = np.arange(200)[:, None]
    roots = (n + 0.5) * math.pi

    def exact(diffusivity: float, x: float) -> Array:
        decay = np.exp(-(roots**2) * diffusivity * np.array(times) / 0.01**2)
        series: Array = np.sum(2.0 / roots * np.sin(roots * x / 0.01) * decay, axis=0)
        return 400.0 - 100.0 * series

    assert agrees(found.traces["B"], exact(1e-6, 0.01), 5e-3)
    assert agrees(found.traces["M"], exact(1e-6, 0.003), 5e-3)
    assert not agrees(found.traces["B"], exact(1.01e-6, 0.01), 5e-3)


def test_a_step_of_the_flux_follows_the_series_of_a_slab_with_an_insulated_back(tmp_path: Path) -> None:
    case = HELD_SLAB.split("[hot_face]")[0] + '[[sensor]]\nname = "F"\ndepth = "0 m"\n'
    case += '[hot_face]\nkind = "heated"\nemissivity = 0.0\nflux = "2 W/cm^2"\n'
    times = [1.0, 10.0, 100.0]
    found = run(tmp_path, case, times, s=solid())
    t = np.array(times)
    n = np.arange(1, 400)[:, None]

    def exact(x: float, k: float = 1.0) -> Array:
        # Carslaw and Jaeger, section 3.8.
        y = 1.0 - x / 0.01
        series = np.sum((-1.0) ** n / n**2 * np.exp(-(n**2) * math.pi**2 * k * 1e-6 * t / 0.01**2)
                        * np.cos(n * math.pi * y), axis=0)  # fmt: skip
        rise: Array = 2e4 * t / (1e6 * 0.01)
        rise = rise + 2e4 * 0.01 / k * ((3.0 * y * y - 1.0) / 6.0 - 2.0 / math.pi**2 * series)
        return 300.0 + rise

    assert agrees(found.traces["F"], exact(0.0), 5e-3)
    assert agrees(found.traces["B"], exact(0.01), 5e-3)
    assert agrees(found.numbers["heat load"], 2e6, 2.0)
    assert not agrees(found.traces["F"], exact(0.0, k=1.01), 5e-3)


def test_convection_follows_the_series_with_the_roots_of_beta_tan_beta(tmp_path: Path) -> None:
    case = HELD_SLAB.split("[hot_face]")[0]
    case += '[hot_face]\nkind = "convective"\nemissivity = 0.0\nheat_transfer_coefficient = "150 W/m^2/K"\n'
    case += 'gas = "700 K"\n'
    times = [10.0, 50.0, 100.0]
    found = run(tmp_path, case, times, s=solid())

    def exact(biot: float) -> Array:
        total = np.zeros(3)
        for i in range(60):
            root = brentq(lambda b: b * math.sin(b) - biot * math.cos(b), i * math.pi + 1e-9, (i + 0.5) * math.pi)
            weight = 4.0 * math.sin(root) / (2.0 * root + math.sin(2.0 * root))
            total += weight * np.exp(-(root**2) * 1e-6 * np.array(times) / 0.01**2)
        return 700.0 - 400.0 * total

    assert agrees(found.traces["B"], exact(1.5), 5e-3)
    assert not agrees(found.traces["B"], exact(1.51), 5e-3)


def test_a_melting_front_follows_neumann(tmp_path: Path) -> None:
    # 100 kJ/kg over 0.4 K about 350 K; the exact solution has them at 350 K.
    melting = """
name = "Melting"
[density]
value = "1000 kg/m^3"
[heat_capacity]
unit = "J/kg/K"
temperatures_k = [200, 349.8, 349.8, 350.2, 350.2, 900]
values = [1000, 1000, 251000, 251000, 1000, 1000]
outside = "clamp"
[conductivity]
value = "1 W/m/K"
[emissivity]
value = 0.5
"""
    case = HELD_SLAB.replace('"10 mm"', '"20 mm"').replace('"3 mm"', '"2 mm"').replace('"100 s"', '"20 s"')
    case = case.replace('"300 K"', '"340 K"') + '[resolution]\ntolerance = "4 K"\n'
    times = [5.0, 10.0, 20.0]
    found = run(tmp_path, case, times, s=melting)

    def exact(latent: float, x: float = 0.002) -> Array:
        hot, cold = 1000.0 * 50.0 / latent, 1000.0 * 10.0 / latent

        def balance(number: float) -> float:
            decay = math.exp(-(number**2)) / math.sqrt(math.pi)
            return hot * decay / float(erf(number)) - cold * decay / float(erfc(number)) - number

        number = brentq(balance, 1e-3, 3.0)
        similarity = x / (2.0 * np.sqrt(1e-6 * np.array(times)))
        molten = 400.0 - 50.0 * erf(similarity) / erf(number)
        frozen = 340.0 + 10.0 * erfc(similarity) / erfc(number)
        profile: Array = np.where(similarity < number, molten, frozen)
        return profile

    # The oracle's own error, and a quarter of the width of the peak.
    tolerance = found.errors["M"] + 0.1
    assert tolerance < 0.6
    assert agrees(found.traces["M"], exact(1e5), tolerance)
    assert not agrees(found.traces["M"], exact(0.8e5), tolerance)


def test_a_foil_cools_by_radiation_as_the_inverse_cube(tmp_path: Path) -> None:
    case = """
duration = "20 s"
initial_temperature = "1200 K"
[[ply]]
name = "FOIL"
material = "foil"
thickness = "1 um"
[[ply]]
name = "FILM"
material = "foil"
thickness = "50 um"
[[sensor]]
name = "T"
below = "FILM"
[hot_face]
kind = "heated"
flux = "0 W/m^2"
surroundings = "0 K"
"""
    found = run(tmp_path, case, [0.0, 1.0, 5.0, 20.0], foil=solid(k=100.0, density=2000.0))

    def exact(emissivity: float) -> Array:
        rate = 3.0 * emissivity * SIGMA / (2000.0 * 1000.0 * 51e-6)
        cooled: Array = (1200.0**-3 + rate * np.array([0.0, 1.0, 5.0, 20.0])) ** (-1.0 / 3.0)
        return cooled

    assert agrees(found.traces["T"], exact(0.5), 2e-2)
    assert not agrees(found.traces["T"], exact(0.501), 2e-2)


def test_layers_with_contacts_become_resistances_in_series(tmp_path: Path) -> None:
    case = """
duration = "2000 s"
initial_temperature = "300 K"
[[ply]]
name = "A"
material = "a"
thickness = "2 mm"
contact_below = "100 W/m^2/K"
[[ply]]
name = "B"
material = "b"
thickness = "0.1 um"
contact_below = "2e-3 m^2 K/W"
[[ply]]
name = "C"
material = "a"
thickness = "3 mm"
[[sensor]]
name = "AB"
below = "A"
side = "above"
[[sensor]]
name = "BC"
below = "B"
[hot_face]
kind = "held"
temperature = "500 K"
[back_face]
kind = "held"
temperature = "300 K"
"""
    found = run(tmp_path, case, [2000.0], a=solid(), b=solid(k=200.0))
    flux = 200.0 / (0.002 + 1 / 100.0 + 1e-7 / 200.0 + 2e-3 + 0.003)
    assert agrees(found.traces["AB"], 500.0 - flux * 0.002, 5e-3)
    assert agrees(found.traces["BC"], 300.0 + flux * (0.003 + 0.001), 5e-3)
    assert not agrees(found.traces["BC"], 300.0 + flux * (0.003 + 0.00101), 5e-3)


def test_a_conductivity_over_temperature_and_pressure_is_integrated_exactly(tmp_path: Path) -> None:
    # k = 0.1 (T/300)  at 100 Pa and twice that at 10 kPa; in the logarithm of pressure the mean at 1 kPa.
    felt = """
name = "Felt"
[density]
value = "10 kg/m^3"
[heat_capacity]
value = "100 J/kg/K"
[[conductivity.at]]
pressure = "100 Pa"
unit = "W/m/K"
temperatures_k = [300, 900]
values = [0.1, 0.3]
[[conductivity.at]]
pressure = "10 kPa"
unit = "W/m/K"
temperatures_k = [300, 600, 900]
values = [0.2, 0.4, 0.6]
[emissivity]
value = 0.5
"""
    pressure = '[["0 s", "1 Pa"], ["50 s", "1 MPa"], ["50 s", "1 kPa"], ["100 s", "1 kPa"]]'
    case = f"pressure = {pressure}\n" + HELD_SLAB.replace('"400 K"', '"800 K"')
    case += '[back_face]\nkind = "cooled"\nheat_transfer_coefficient = "20 W/m^2/K"\nambient = "300 K"\n'
    case += "emissivity = 0.0\n"
    found = run(tmp_path, case, [49.0, 100.0], s=felt)

    def exact(k_300: float) -> float:
        def rest(back: float) -> float:
            return k_300 / 600.0 * (800.0**2 - back**2) / 0.01 - 20.0 * (back - 300.0)

        return float(brentq(rest, 300.0, 800.0))

    assert agrees(found.traces["B"][1], exact(0.15), 5e-3)
    assert agrees(found.traces["B"][0], exact(0.2), 5e-3)
    assert not agrees(found.traces["B"][1], exact(0.1501), 5e-3)


REACTING = """
name = "Reacting"
[density]
value = "1000 kg/m^3"
[heat_capacity]
value = "1000 J/kg/K"
[conductivity]
value = "1 W/m/K"
[emissivity]
value = 0.5
[decomposition]
{reactions}
[decomposition.char]
heat_capacity = {{ times_virgin = 2.0 }}
"""

REACTION = """
[[decomposition.reaction]]
mass_loss = {loss}
pre_exponential = "{a} 1/s"
activation_energy = "{e} kJ/mol"
order = {order}
heat = "{heat} MJ/kg"
"""


def reaction(loss: float, a: float, e: float, order: float, heat: float) -> str:
    return REACTION.format(loss=loss, a=a, e=e, order=order, heat=heat)


def test_two_reactions_at_a_constant_heating_rate_lose_what_the_integrals_say(tmp_path: Path) -> None:
    # The second one is wild: A = 1e38 1/s at 480 kJ/mol.
    case = """
duration = "5000 s"
initial_temperature = "300 K"
decomposition = true
[[ply]]
name = "S"
material = "s"
thickness = "10 um"
[[sensor]]
name = "B"
below = "S"
[hot_face]
kind = "held"
temperature = [["0 s", "300 K"], ["5000 s", "1100 K"]]
[gas]
flow = "unhindered"
[resolution]
output_interval = "100 s"
"""
    times = np.arange(0.0, 5001.0, 100.0)
    text = reaction(0.2, 1e8, 120.0, 2.0, 0.5) + reaction(0.1, 1e38, 480.0, 1.0, 0.5)
    found = run(tmp_path, case, times.tolist(), s=REACTING.format(reactions=text))

    def exposure(a: float, e: float, until: float) -> float:
        def rate(t: float) -> float:
            return math.exp(math.log(a) - e / (R * (300.0 + 0.16 * t)))

        return quad(rate, 0.0, until, limit=500, epsabs=0.0, epsrel=1e-10)[0] if until > 0.0 else 0.0

    def exact(energy: float) -> Array:
        slow = np.array([1.0 - 1.0 / (1.0 + exposure(1e8, energy, t)) for t in times])
        fast = np.array([1.0 - math.exp(-exposure(1e38, 480e3, t)) for t in times])
        return 0.01 * (0.2 * slow + 0.1 * fast)

    assert agrees(found.traces["mass_lost_kg_m2"], exact(120e3), 1e-6)
    assert not agrees(found.traces["mass_lost_kg_m2"], exact(120.5e3), 1e-6)


def test_an_adiabatic_reaction_cools_the_solid_by_its_heat(tmp_path: Path) -> None:
    case = """
duration = "2000 s"
initial_temperature = "800 K"
decomposition = true
[[ply]]
name = "S"
material = "s"
thickness = "1 mm"
[[sensor]]
name = "B"
below = "S"
[hot_face]
kind = "heated"
flux = "0 W/m^2"
emissivity = 0.0
[gas]
flow = "{flow}"
"""
    # The capacity is c (1 − φ + φ remains · 2), so that c · ∫ ... dT = −loss · heat · dφ.
    loss, heat, char = 0.3, 0.4e6, 0.7 * 2.0
    final = 800.0 - loss * heat / (1000.0 * (char - 1.0)) * math.log(char)
    for flow in ("unhindered", "quasi-steady"):
        text = REACTING.format(reactions=reaction(loss, 1e6, 60.0, 1.0, heat / 1e6))
        found = run(tmp_path / flow, case.format(flow=flow), [2000.0], s=text)
        assert agrees(found.traces["B"], final, 5e-3)
        assert not agrees(found.traces["B"], final + 0.5, 5e-3)


def test_gas_from_below_cools_the_ply_above_as_a_counterflow(tmp_path: Path) -> None:
    # Steady gas of a zero-order reaction in a thin ply at the back flows through a slab between held faces:
    # T = T_f + (T_b − T_f) (1 − exp(−G c x/k)) / (1 − exp(−G c L/k)).
    case = """
duration = "60 s"
initial_temperature = "600 K"
decomposition = true
[[ply]]
name = "S"
material = "s"
thickness = "5 mm"
decomposition = false
[[ply]]
name = "G"
material = "g"
thickness = "0.4 mm"
[[sensor]]
name = "M"
depth = "2 mm"
[hot_face]
kind = "held"
temperature = "900 K"
[back_face]
kind = "held"
temperature = "600 K"
[gas]
flow = "quasi-steady"
"""
    slow = REACTING.format(reactions=reaction(0.5, 1e-3, 0.001, 0.01, 0.0))
    slow = slow.replace('"1000 kg/m^3"', '"9e4 kg/m^3"')
    found = run(tmp_path, case, [60.0], s=solid(k=0.5, density=100.0), g=slow)
    # The gas has 2000 J/kg/K; the source lies in 0.4 mm of 1 W/m/K at the back: solved as a boundary value problem.
    flux = 0.5 * 9e4 * 4e-4 * 1e-3 * math.exp(-1.0 / (R * 600.0)) * (1.0 - 1e-3 * 60.0) ** 0.01

    def exact(gas: float) -> float:
        def equations(x: float, y: Array) -> list[float]:
            through = gas * min(1.0, (5.4e-3 - x) / 4e-4)
            return [y[1] / (0.5 if x < 5e-3 else 1.0), -through * 2000.0 * y[1] / (0.5 if x < 5e-3 else 1.0)]

        def back(slope: float) -> float:
            first = solve_ivp(equations, (0.0, 5e-3), [900.0, slope], rtol=1e-10, atol=1e-10)
            second = solve_ivp(equations, (5e-3, 5.4e-3), first.y[:, -1], rtol=1e-10, atol=1e-10)
            return float(second.y[0, -1]) - 600.0

        slope = brentq(back, -3e5, -1e2)
        middle = solve_ivp(equations, (0.0, 2e-3), [900.0, slope], rtol=1e-10, atol=1e-10)
        return float(middle.y[0, -1])

    assert agrees(found.traces["M"], exact(flux), 0.05)
    assert not agrees(found.traces["M"], exact(0.99 * flux), 0.05)


def test_a_bead_follows_a_ramp_with_its_lag(tmp_path: Path) -> None:
    case = HELD_SLAB.replace('"400 K"', '[["0 s", "300 K"], ["100 s", "500 K"]]')
    case = case.replace('name = "M"\ndepth = "3 mm"', 'name = "M"\ndepth = "0 mm"\ntime_constant = "7 s"')
    times = np.array([1.0, 10.0, 100.0])
    found = run(tmp_path, case, times.tolist(), s=solid())

    def exact(lag_s: float) -> Array:
        read: Array = 300.0 + 2.0 * (times - lag_s * (1.0 - np.exp(-times / lag_s)))
        return read

    assert agrees(found.traces["M"], exact(7.0), 5e-3)
    assert not agrees(found.traces["M"], exact(7.1), 5e-3)


def test_a_pulse_of_a_millisecond_in_a_day_leaves_its_heat(tmp_path: Path) -> None:
    case = """
duration = "24 h"
initial_temperature = "300 K"
[[ply]]
name = "S"
material = "s"
thickness = "1 mm"
[[sensor]]
name = "B"
below = "S"
[hot_face]
kind = "heated"
emissivity = 0.0
flux = [["0 s", "0 W/m^2"], ["70000 s", "0 W/m^2"], ["70000 s", "50 MW/m^2"], ["70000.001 s", "50 MW/m^2"],
  ["70000.001 s", "0 W/m^2"], ["86400 s", "0 W/m^2"]]
[resolution]
output_interval = "1000 s"
"""
    found = run(tmp_path, case, [69000.0, 86400.0], s=solid())
    assert agrees(found.traces["B"], np.array([300.0, 350.0]), 5e-3)
    assert not agrees(found.traces["B"], np.array([300.0, 350.1]), 5e-3)


def test_air_in_wide_pores_is_free_air_and_in_narrow_ones_proportional_to_pressure() -> None:
    hot = np.array([300.0, 673.0, 1073.0])
    assert agrees(free_conductivity(hot), np.array([0.0262, 0.0502, 0.0692]), 2e-4)
    assert agrees(pore_conductivity(hot, 1e5, 1.0) / free_conductivity(hot), 1.0, 1e-5)
    narrow = pore_conductivity(hot, 100.0, 1e-7) / pore_conductivity(hot, 50.0, 1e-7)
    assert agrees(narrow, 2.0, 1e-2)
    assert not agrees(narrow, 1.9, 1e-2)


def test_a_pyrometer_reads_a_black_face_exactly_and_a_narrow_band_as_its_wavelength() -> None:
    assert agrees(brightness_temperature((2e-6, 2e-6, 1.0), 1.0, 900.0, 300.0), 900.0, 1e-9)
    assert agrees(brightness_temperature((8e-6, 14e-6, 0.7), 1.0, 900.0, 0.0), 1082.7, 30.0)
    line = brightness_temperature((2e-6, 2e-6, 0.9), 0.5, 900.0, 300.0)
    assert agrees(brightness_temperature((1.999e-6, 2.001e-6, 0.9), 0.5, 900.0, 300.0), line, 1e-3)
    x = 1.438776877e-2 / 2e-6
    expected = x / math.log(1.0 + 0.9 / 0.5 * (math.exp(x / 900.0) - 1.0))
    assert agrees(brightness_temperature((2e-6, 2e-6, 0.9), 0.5, 900.0, 0.0), expected, 1e-9)
    assert not agrees(line, expected * 1.001, 1e-3)


def test_a_table_holds_its_jump_and_its_latent_heat() -> None:
    table = Table((300.0, 400.0, 400.0, 500.0), (1.0, 2.0, 10.0, 10.0))
    assert table.at(399.999999) == pytest.approx(2.0)
    assert table.at(400.0) == 10.0
    starts, values, slopes = table.segments
    heat = integral_at_starts((starts, values, slopes))
    assert heat[list(starts).index(500.0)] - heat[list(starts).index(300.0)] == pytest.approx(1150.0)
    falling = Table((300.0, 400.0), (1.0, 0.5), "extrapolate")
    assert [falling.at(t) for t in (350.0, 420.0, 5000.0, 200.0)] == pytest.approx([0.75, 0.4, 0.05, 1.5])


@pytest.mark.parametrize(
    ("text", "temperature", "expected"),
    [
        ("20 degC", True, 293.15),
        ("68 degF", True, 293.15),
        ("540 degR", True, 300.0),
        ("2 degC", False, 2.0),
        ("12 W/cm^2", False, 12e4),
        ("500 W/(m^2*K)", False, 500.0),
        ("2e-3 m^2 K/W", False, 2e-3),
        ("1 BTU/ft2/s", False, 1055.05585262 / 0.09290304),
        ("1e3 1/m", False, 1000.0),
    ],
)
def test_quantities_are_converted_to_si(text: str, temperature: bool, expected: float) -> None:
    assert si(text, temperature) == pytest.approx(expected, rel=1e-12)


def test_what_is_not_computed_is_refused_with_the_reason(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="Darcy"):
        run(tmp_path, HELD_SLAB + '[gas]\nflow = "darcy"\n', [1.0], s=solid())
    with pytest.raises(Refused, match="too many steps"):
        (tmp_path / "case.toml").write_text(HELD_SLAB)
        solve(load(tmp_path), np.array([1.0]), work=0.0)
