#!/usr/bin/env python3
"""The public items of the library, one a line: `public_api.py JSON` prints them, `public_api.py JSON LISTING` compares.

JSON is what `cargo rustdoc -- -Z unstable-options --output-format json` writes. scripts/test.sh calls this.
"""

import difflib
import json
import sys
from pathlib import Path


def listing(crate):
    """Kind and path of every public item that a user of the crate can name."""
    index = crate["index"]
    lines, seen = set(), set()

    def visit(identifier, path):
        item = index.get(str(identifier))
        if item is None or (identifier, path) in seen:
            return
        seen.add((identifier, path))
        ((kind, inner),) = item["inner"].items()
        if kind == "use":
            if inner["is_glob"]:
                for child in index[str(inner["id"])]["inner"]["module"]["items"]:
                    visit(child, path)
            elif inner["id"] is not None and str(inner["id"]) in index:
                visit_named(inner["id"], f"{path}::{inner['name']}")
            return
        visit_named(identifier, f"{path}::{item['name']}" if item["name"] else path)

    def visit_named(identifier, path):
        item = index[str(identifier)]
        ((kind, inner),) = item["inner"].items()
        if item["visibility"] not in ("public", "default"):
            return
        if "#[doc(hidden)]" in item["attrs"]:
            return
        lines.add(f"{kind.replace('_', ' ')} {path}")
        if kind == "module":
            for child in inner["items"]:
                visit(child, path)
        elif kind == "enum":
            for variant in inner["variants"]:
                name = f"{path}::{index[str(variant)]['name']}"
                lines.add(f"variant {name}")
                fields = index[str(variant)]["inner"]["variant"]["kind"]
                if isinstance(fields, dict) and "struct" in fields:
                    lines.update(f"field {name}::{index[str(field)]['name']}" for field in fields["struct"]["fields"])
            implementations(inner["impls"], path)
        elif kind == "struct":
            plain = inner["kind"].get("plain", {}) if isinstance(inner["kind"], dict) else {}
            for field in plain.get("fields", []):
                if index.get(str(field), {}).get("visibility") == "public":
                    lines.add(f"field {path}::{index[str(field)]['name']}")
            implementations(inner["impls"], path)
        elif kind == "trait":
            lines.update(f"trait item {path}::{index[str(child)]['name']}" for child in inner["items"])

    def implementations(identifiers, path):
        for identifier in identifiers:
            implementation = index.get(str(identifier), {}).get("inner", {}).get("impl")
            if implementation is None or implementation["trait"] is not None:
                continue
            for child in implementation["items"]:
                item = index[str(child)]
                if item["visibility"] == "public":
                    lines.add(f"{next(iter(item['inner'])).replace('_', ' ')} {path}::{item['name']}")

    root = index[str(crate["root"])]
    lines.add(f"module {root['name']}")
    for child in root["inner"]["module"]["items"]:
        visit(child, root["name"])
    return sorted(lines, key=lambda line: (line.split(" ")[-1], line))


def main():
    """Print or compare; a difference is an error."""
    found = listing(json.loads(Path(sys.argv[1]).read_text()))
    if len(sys.argv) == 2:
        print("\n".join(found))
        return
    listed = Path(sys.argv[2]).read_text().splitlines()
    changes = list(difflib.unified_diff(listed, found, sys.argv[2], "the library", lineterm="", n=0))
    if changes:
        print("\n".join(changes))
        sys.exit(f"the public interface changed: if it is meant to, write the new listing to {sys.argv[2]}")


main()
