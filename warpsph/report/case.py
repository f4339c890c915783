"""What a case of the report is made of: the runs it needs, and its section of the page.

A case only describes; `make` runs what is missing, `page` writes. A further case is a file in `cases/`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path

from .prose import Prose
from .runs import Result, Run


@dataclass(frozen=True)
class Row:
    """A row of a case's table.

    Attributes:
        quantity: what.
        ours: our value.
        unit: unit of all values.
        paper: the paper's value, or its words.
        exact: the exact value, where there is one.
        seconds: run time behind it [s].
    """

    quantity: str
    ours: float | str
    _: KW_ONLY
    unit: str = "-"
    paper: float | str | None = None
    exact: float | str | None = None
    seconds: float | None = None

    @property
    def difference(self) -> float | None:
        """(ours − reference)/|reference|: to the exact value where there is one, else to the paper's; or None."""
        for reference in (self.exact, self.paper):
            if isinstance(reference, float) and isinstance(self.ours, float) and reference != 0.0:
                return (self.ours - reference) / abs(reference)
        return None


@dataclass(frozen=True)
class Picture:
    """A picture with its caption."""

    path: Path
    caption: str


@dataclass(frozen=True)
class ReportTable:
    """A further table: its caption, its header, and its lines (numbers or texts), the first column naming them."""

    caption: str
    header: tuple[str, ...]
    lines: list[tuple[float | str | None, ...]]


@dataclass(frozen=True)
class Section:
    """A section of the report.

    Attributes:
        prose: its words; they may hold `code` and **stress**.
        rows: its table beside the paper and the exact solution.
        pictures: its figures, in the paper's order.
        results: the runs behind it.
        tables: further tables, of our own variations.
    """

    prose: Prose
    rows: Sequence[Row]
    pictures: Sequence[Picture]
    results: Sequence[Result]
    tables: Sequence[ReportTable] = ()


@dataclass(frozen=True)
class Case:
    """A case of the report.

    Attributes:
        name: of its pictures.
        runs: what it needs.
        section: makes its section from its results (by the runs' names) and a function that gives the path of a
            picture.
    """

    name: str
    runs: tuple[Run, ...]
    section: Callable[[Mapping[str, Result], Callable[[str], Path]], Section]
