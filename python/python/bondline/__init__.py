"""Thermal response of flexible heat shields: predictions, uncertainty, sensitivity and estimates.

A :class:`Case` is read from a file or made from Python values. Its methods answer the questions of the command
``bondline`` with the same numbers, to the last bit. Temperatures are in kelvin, and all other values in SI units.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bondline._bondline import BondlineError, CaseError, DeviceError, OptionError, __version__

if TYPE_CHECKING:
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


def __getattr__(name: str) -> Any:
    """A class, imported when it is first used: the command needs no NumPy, whose import takes 60 ms."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from bondline import _case, _results

    found = _case.Case if name == "Case" else getattr(_results, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return __all__


def study(case: Case, **options: Any) -> Study:
    """Prediction, uncertainty, sensitivity and estimate of a case: :meth:`Case.study`."""
    return case.study(**options)
