"""The Python blocks of the book and of the README run, those of a page one after another."""

import os
import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ["python/README.md", "docs/how-to/use-python.md", "docs/how-to/run-on-a-cluster.md"]
#: Recipes for libraries of requirements.txt, and those for libraries of requirements-all.txt.
LIGHT = ["dakota-and-pest", "pandas-and-xarray", "salib", "scipy"]
HEAVY = ["emcee-and-arviz", "measured-data", "pymc", "um-bridge"]
PAGES += [f"docs/recipes/{page}.md" for page in LIGHT + (HEAVY if "BONDLINE_ALL" in os.environ else [])]


def test_every_recipe_is_run() -> None:
    assert sorted(LIGHT + HEAVY) == sorted(path.stem for path in (ROOT / "docs" / "recipes").glob("*.md"))


@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    monkeypatch.chdir(tmp_path)
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = list(re.finditer(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL))
    assert blocks, f"{page} has no block"
    names: dict[str, Any] = {}
    for block in blocks:
        lines_before = text[: block.start(1)].count("\n")
        exec(compile("\n" * lines_before + block[1], page, "exec"), names)
