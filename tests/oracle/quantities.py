"""Quantities with units, as the reference of the case file states them, in SI."""

import re

_PREFIXED = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "mil": 2.54e-5, "ft": 0.3048,
    "s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0,
    "K": 1.0, "degC": 1.0, "degF": 5.0 / 9.0, "degR": 5.0 / 9.0, "R": 5.0 / 9.0,
    "Pa": 1.0, "hPa": 100.0, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "mbar": 100.0, "atm": 101325.0,
    "torr": 101325.0 / 760.0, "psi": 6894.757293168361, "psia": 6894.757293168361, "psf": 47.88025898033584,
    "W": 1.0, "mW": 1e-3, "kW": 1e3, "MW": 1e6, "J": 1.0, "kJ": 1e3, "MJ": 1e6, "cal": 4.184, "kcal": 4184.0,
    "BTU": 1055.05585262, "Btu": 1055.05585262, "kg": 1.0, "g": 1e-3, "lb": 0.45359237, "lbm": 0.45359237,
    "N": 1.0, "lbf": 4.4482216152605, "mol": 1.0, "kmol": 1e3, "%": 1e-2, "1": 1.0,
}  # fmt: skip

_OFFSETS_K = {"degC": 273.15, "degF": 459.67 * 5.0 / 9.0}

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")


class Refused(Exception):
    """What this program does not compute, with the reason."""


def unit_factor(text: str) -> float:
    """The SI value of a unit without offset, `W/m^2/K`."""
    tokens = re.findall(r"[A-Za-z%]+|\^?-?\d+|[/*() ]", text.replace("·", "*").replace("²", "2").replace("³", "3"))
    position = 0

    def power() -> int:
        nonlocal position
        if position < len(tokens) and re.fullmatch(r"\^?-?\d+", tokens[position]):
            position += 1
            return int(tokens[position - 1].lstrip("^"))
        return 1

    def product() -> float:
        nonlocal position
        value, divides = 1.0, False
        while position < len(tokens) and tokens[position] != ")":
            token = tokens[position]
            position += 1
            if token == "/":
                divides = True
                continue
            if token in "* ":
                continue
            if token == "(":
                factor = product()
                position += 1
            elif token == "1":
                factor = 1.0
            elif token in _PREFIXED:
                factor = _PREFIXED[token]
            else:
                raise Refused(f"unit {text!r}: {token!r} is unknown here")
            factor = factor ** power()
            value = value / factor if divides else value * factor
            divides = False
        return value

    return product()


def si(value: object, temperature: bool = False) -> float:
    """A quantity such as "20 degC" in SI; a plain number is itself."""
    if isinstance(value, (int, float)):
        return float(value)
    matched = _QUANTITY.match(str(value))
    if matched is None:
        raise Refused(f"{value!r} is no quantity")
    number, unit = float(matched[1]), matched[2]
    if unit == "":
        return number
    return to_si(number, unit, temperature)


def to_si(number: float, unit: str, temperature: bool = False) -> float:
    """A number in a unit, in SI; a temperature on the absolute scale."""
    scaled = number * unit_factor(unit)
    return scaled + _OFFSETS_K.get(unit, 0.0) if temperature else scaled
