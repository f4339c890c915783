"""The report's prose: a Markdown file a case in `texts/`, with {places} for numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

TEXTS = Path(__file__).with_name("texts")


@dataclass(frozen=True)
class Prose:
    """The words of a section: its title, what the case is, and a paragraph on every difference."""

    title: str
    text: str
    differences: tuple[str, ...]


def prose(name: str, **numbers: float | str) -> Prose:
    """The words of a case, its numbers filled in.

    The file: `# title`, paragraphs, `## Differences`, paragraphs.
    """
    text = (TEXTS / f"{name}.md").read_text(encoding="utf-8").format(**numbers)
    words, _, differences = text.partition("## Differences")
    title, *paragraphs = _paragraphs(words)
    return Prose(title.removeprefix("# "), "\n\n".join(paragraphs), tuple(_paragraphs(differences)))


def _paragraphs(text: str) -> list[str]:
    """The paragraphs of a text, each on one line."""
    return [" ".join(part.split()) for part in text.split("\n\n") if part.strip()]
