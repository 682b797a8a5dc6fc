"""Air: in the pores of an insulation, and its enthalpy at a wall. Formulas and numbers are those of the literature."""

from typing import Any

import numpy as np

from tables import Array, Table

BOLTZMANN_J_K = 1.380649e-23
STEFAN_BOLTZMANN = 5.670374419e-8
GAS_CONSTANT = 8.31446261815324
COLLISION_DIAMETER_M = 3.65e-10
ACCOMMODATION, HEAT_CAPACITY_RATIO, PRANDTL = 0.9, 1.4, 0.71

# Above 298 K, J/kg; the first and the last line continue.
WALL_ENTHALPY = Table(
    (300.0, 600.0, 900.0, 1200.0, 1500.0, 1700.0, 2000.0),
    (2e3, 310e3, 636e3, 980e3, 1338e3, 1582e3, 1954e3),
)
COLD_WALL_ENTHALPY_J_KG = 2e3


_T = np.array(WALL_ENTHALPY.temperatures_k)
_H = np.array(WALL_ENTHALPY.values)
_SLOPES = np.diff(_H) / np.diff(_T)


def wall_enthalpy(temperature_k: Any) -> tuple[Any, Any]:
    """Enthalpy of air at a wall, and its slope."""
    i = np.minimum(np.maximum(_T.searchsorted(temperature_k, side="right") - 1, 0), len(_T) - 2)
    return _H[i] + _SLOPES[i] * (temperature_k - _T[i]), _SLOPES[i]


def free_conductivity(temperature_k: Array) -> Array:
    """Sutherland's law (White, Viscous Fluid Flow), W/m/K."""
    result: Array = 0.0241 * (temperature_k / 273.15) ** 1.5 * (273.15 + 194.4) / (temperature_k + 194.4)
    return result


def pore_conductivity(temperature_k: Array, pressure_pa: float, length_m: float) -> Array:
    """Conductivity in pores of a length, with the temperature jump at both walls (Daryabeigi 2003), W/m/K."""
    mean_free_path_m = BOLTZMANN_J_K * temperature_k / (np.sqrt(2.0) * np.pi * COLLISION_DIAMETER_M**2 * pressure_pa)
    jump = (2.0 - ACCOMMODATION) / ACCOMMODATION * 2.0 * HEAT_CAPACITY_RATIO / (HEAT_CAPACITY_RATIO + 1.0) / PRANDTL
    result: Array = free_conductivity(temperature_k) / (1.0 + 2.0 * jump * mean_free_path_m / length_m)
    return result
