"""Shipped cases."""

from pathlib import Path

import bondline
import pytest

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture
def slab() -> bondline.Case:
    """One ply with constant properties, and the exact solution as observations."""
    return bondline.Case.load(CASES / "slab").on(backend="cpu")
