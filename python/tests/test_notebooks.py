"""The notebooks of the book are stored without outputs; scripts/python.sh executes all of them with BONDLINE_ALL."""

import json
from pathlib import Path
from typing import Any

import matplotlib
import pytest

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
NAMES = sorted(path.stem for path in FOLDER.glob("*.ipynb"))


def cells(name: str) -> list[dict[str, Any]]:
    """The cells of code."""
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def test_every_notebook_is_in_the_book_and_without_outputs() -> None:
    page = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert len(NAMES) >= 5
    for name in NAMES:
        assert f"({name}.ipynb)" in page, f"{name} is not in docs/notebooks/index.md"
        assert all(cell["outputs"] == [] for cell in cells(name)), f"{name} has outputs"


def test_the_first_notebook_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(FOLDER)
    matplotlib.use("agg")
    names: dict[str, Any] = {}
    for cell in cells("own-case-from-arrays"):
        exec("".join(cell["source"]), names)
    assert names["T"].shape == (500, 2, len(names["instants_s"]))
