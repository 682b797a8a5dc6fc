"""Reading of a pyrometer by Planck's law."""

import math

import numpy as np
from scipy.optimize import brentq

SECOND_RADIATION_CONSTANT = 1.438776877e-2
_X, _W = np.polynomial.legendre.leggauss(48)


def _radiance(shorter_m: float, longer_m: float, temperature_k: float) -> float:
    if temperature_k <= 0.0:
        return 0.0
    if shorter_m == longer_m:
        return 1.0 / math.expm1(min(SECOND_RADIATION_CONSTANT / (shorter_m * temperature_k), 700.0))
    wavelengths = 0.5 * (shorter_m + longer_m) + 0.5 * (longer_m - shorter_m) * _X
    x = np.minimum(SECOND_RADIATION_CONSTANT / (wavelengths * temperature_k), 700.0)
    return float(_W @ ((wavelengths / longer_m) ** -5.0 / np.expm1(x)))


def brightness_temperature(
    instrument: tuple[float, float, float], emissivity: float, surface_k: float, surroundings_k: float
) -> float:
    """What an instrument (shorter and longer wavelength, emissivity) reads of a grey face."""
    shorter_m, longer_m, set_to = instrument
    seen = emissivity * _radiance(shorter_m, longer_m, surface_k)
    seen += (1.0 - emissivity) * _radiance(shorter_m, longer_m, surroundings_k)
    seen /= set_to
    if shorter_m == longer_m:
        return SECOND_RADIATION_CONSTANT / shorter_m / math.log1p(1.0 / seen)
    low, high = 0.2 * min(surface_k, surroundings_k or surface_k), 5.0 * max(surface_k, surroundings_k)
    found: float = brentq(lambda t: math.log(_radiance(shorter_m, longer_m, t) / seen), low, high, xtol=1e-7)
    return found
