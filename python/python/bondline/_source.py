"""Where a case is read from, so that it can be read again with other values, also in another process."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from bondline import _bondline

Overrides = list[tuple[str, str]]


@dataclass(frozen=True)
class Memory:
    """The text of a case file, and the bytes of the files that it names, by path."""

    text: str
    id: str
    files: Mapping[str, bytes]

    def read(self, overrides: Overrides) -> _bondline.Case:
        """The case with other values."""
        return _bondline.Case.from_toml(self.text, self.id, self.files, overrides)

    def in_memory(self, core: _bondline.Case) -> Memory:
        """This source."""
        return self


@dataclass(frozen=True)
class Disk:
    """A case file, or a folder with a ``case.toml``."""

    path: str | PathLike[str]

    def read(self, overrides: Overrides) -> _bondline.Case:
        """The case with other values."""
        return _bondline.Case.load(self.path, overrides)

    def in_memory(self, core: _bondline.Case) -> Memory:
        """The contents of the files that the case was read from, which must not have changed since."""
        (case_file, digest), *others = core.input_files()
        # Names in a case file are relative to its folder.
        parent = str(Path(case_file).parent)
        folder = "" if parent == "." and not case_file.startswith(".") else f"{parent}/"
        files = {path.removeprefix(folder): _unchanged(path, digest) for path, digest in others}
        text = _unchanged(case_file, digest).decode("utf-8-sig")
        return Memory(text, str(core.content()["id"]), files)


def _unchanged(path: str, digest: str) -> bytes:
    content = Path(path).read_bytes()
    if hashlib.sha256(content).hexdigest() != digest:
        raise _bondline.BondlineError(f"{path} has changed since the case was read")
    return content
