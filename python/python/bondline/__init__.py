"""Thermal response of flexible heat shields: predictions, uncertainty, sensitivity and estimates.

A :class:`Case` is read from a file or made from Python values. Its methods answer the questions of the command
``bondline`` with the same numbers, to the last bit. Temperatures are in kelvin, and all other values in SI units.
"""

from typing import Any

from bondline._bondline import BondlineError, CaseError, DeviceError, OptionError, __version__
from bondline._case import Case
from bondline._results import (
    Coverage,
    Design,
    Estimate,
    History,
    ObservationCheck,
    Prediction,
    Result,
    Sensitivity,
    Sizing,
    Study,
    Trade,
    Uncertainty,
)

__all__ = [
    "BondlineError",
    "Case",
    "CaseError",
    "Coverage",
    "Design",
    "DeviceError",
    "Estimate",
    "History",
    "ObservationCheck",
    "OptionError",
    "Prediction",
    "Result",
    "Sensitivity",
    "Sizing",
    "Study",
    "Trade",
    "Uncertainty",
    "__version__",
    "study",
]


def study(case: Case, **options: Any) -> Study:
    """Prediction, uncertainty, sensitivity and estimate of a case: :meth:`Case.study`."""
    return case.study(**options)
