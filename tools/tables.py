"""Writes the tables of the docs that follow from the code: defaults, parameters, fields, options of the commands.

    python tools/tables.py

A table stands in a page between `<!-- table: NAME -->` and `<!-- end -->`; `TABLES` says what it holds, and
`tests/test_documents.py` that the pages hold the same. What is to be said otherwise is said in the code.
"""

from __future__ import annotations

import argparse
import dataclasses
import re
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from warpsph.cli.main import _parser
from warpsph.materials import Elastic, PerzynaVonMises
from warpsph.scene.parameter import numerical_parameters
from warpsph.scene.scheme import SCHEMES
from warpsph.simulation.fields import FIELDS

ROOT = Path(__file__).resolve().parent.parent
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
PLACE = re.compile(r"(<!-- table: ([^>]*) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lines of a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def numerics() -> str:
    """What every scene file takes with `--set`, and its default."""
    rows = [
        (f"`{p.name}`", "auto" if p.default is None else f"`{p.default}`", p.unit, p.meaning)
        for p in numerical_parameters({})
    ]
    return table(("name", "default", "unit", "meaning"), rows)


def fields() -> str:
    """The node fields that do not belong to a material."""
    rows = [(f"`{name}`", field.unit, field.shape, field.meaning) for name, field in FIELDS.items()]
    return table(("field", "unit", "shape", "meaning"), rows)


def parameters(material: type) -> str:
    """What a material takes."""
    rows = []
    for entry in dataclasses.fields(material):
        bounds = [f"{name.replace('_', ' ')} {value:g}" for name, value in entry.metadata["bounds"].items()]
        default = "" if entry.default is dataclasses.MISSING else f"`{entry.default:g}`"
        row = entry.metadata["unit"], entry.metadata["meaning"], ", ".join(bounds), default
        rows.append((f"`{entry.name}`", *row))
    return table(("parameter", "unit", "meaning", "allowed", "default"), rows)


def material_fields(material: type) -> str:
    """What it adds to the fields of the nodes."""
    rows = [(f"`{field.name}`", field.unit, field.meaning) for field in (*material.internals, *material.derived)]
    return table(("field", "unit", "meaning"), rows)


def schemes() -> str:
    """The schemes, and what a scene must know of each."""
    rows = []
    for scheme in SCHEMES.values():
        free = "free" if scheme.sums is None else "keeps its traction"
        kinds = ", ".join(kind.name for kind in scheme.kinds)
        rows.append((f"`{scheme.name}`", scheme.meaning, free, kinds))
    return table(("scheme", "meaning", "an edge without a condition", "cells"), rows)


def commands() -> dict[str, argparse.ArgumentParser]:
    """The commands by name."""
    (subparsers,) = (action for action in _parser()._actions if isinstance(action, argparse._SubParsersAction))
    return subparsers.choices


def options(command: argparse.ArgumentParser) -> str:
    """What a command takes."""
    rows = []
    for action in command._actions:
        if isinstance(action, argparse._HelpAction):
            continue
        value = "" if action.nargs == 0 else action.metavar or action.dest.upper()
        value = f"[{value}]" if action.nargs == "?" else value
        rows.append((f"`{' '.join([*action.option_strings, value]).strip()}`", action.help))
    return table(("", ""), rows)


TABLES: dict[str, Callable[[], str]] = {
    "numerics": numerics,
    "fields": fields,
    "schemes": schemes,
    **{f"parameters of {kind.__name__}": partial(parameters, kind) for kind in (Elastic, PerzynaVonMises)},
    "fields of PerzynaVonMises": partial(material_fields, PerzynaVonMises),
    **{f"options of {name}": partial(options, command) for name, command in commands().items()},
}


def filled(text: str) -> str:
    """A page with its tables as the code has them."""
    return PLACE.sub(lambda found: found[1] + TABLES[found[2]]() + found[3], text)


def main() -> int:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        if filled(text) != text:
            page.write_text(filled(text), encoding="utf-8")
            print(f"{page.relative_to(ROOT)} written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
