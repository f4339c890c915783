"""Writes the report: one self-contained HTML page, and a Markdown file beside its pictures."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from pathlib import Path

from .case import ReportTable, Row, Section

HEADER = ("quantity", "unit", "paper", "exact", "ours", "difference", "run time")
CHECKS = ("run", "check", "value", "reference", "unit", "error", "bound", "")
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; }
body { max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { line-height: 1.2; } h2 { margin-top: 3rem; border-bottom: 2px solid #00204d; }
table { border-collapse: collapse; font-size: 14px; margin: 1rem 0; display: block; overflow-x: auto; }
th, td { padding: 0.25rem 0.7rem; border-bottom: 1px solid #ddd; text-align: right; }
th:first-child, td:first-child { text-align: left; } th { border-bottom: 2px solid #00204d; }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; } figcaption { font-size: 14px; color: #444; }
code { background: #f2f2f2; padding: 0 0.2rem; } summary { cursor: pointer; color: #00204d; }
"""
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""


def write_markdown(path: Path, sections: Sequence[Section], *, title: str, lead: Sequence[str]) -> None:
    """The Markdown file; pictures are referred to by their place beside it."""
    lines = [f"# {title}", ""]
    for text in lead:
        lines += [text, ""]
    for section in sections:
        lines += [f"## {section.prose.title}", "", section.prose.text, ""]
        lines += _markdown_table(HEADER, [cells(row) for row in section.rows])
        for table in section.tables:
            lines += [f"{table.caption}", "", *_markdown_table(table.header, _texts(table))]
        for picture in section.pictures:
            where = picture.path.relative_to(path.parent).as_posix()
            lines += [f"![{picture.caption}]({where})", "", f"*{picture.caption}*", ""]
        if section.prose.differences:
            lines += ["**Differences.**", ""]
        for text in section.prose.differences:
            lines += [text, ""]
        lines += ["Checks of the runs:", ""]
        lines += _markdown_table(CHECKS, checks_of(section))
    path.write_text("\n".join(lines), encoding="utf-8")


def write_html(path: Path, sections: Sequence[Section], *, title: str, lead: Sequence[str]) -> None:
    """The HTML page, its pictures inside."""
    parts = [f"<h1>{html.escape(title)}</h1>", *(f"<p>{_inline(text)}</p>" for text in lead), "<ul>"]
    parts += [f'<li><a href="#s{k}">{_inline(section.prose.title)}</a></li>' for k, section in enumerate(sections)]
    parts.append("</ul>")
    for k, section in enumerate(sections):
        parts += [f'<h2 id="s{k}">{_inline(section.prose.title)}</h2>', f"<p>{_inline(section.prose.text)}</p>"]
        parts.append(_html_table(HEADER, [cells(row) for row in section.rows]))
        for table in section.tables:
            parts += [f"<p>{_inline(table.caption)}</p>", _html_table(table.header, _texts(table))]
        for picture in section.pictures:
            data = base64.b64encode(picture.path.read_bytes()).decode("ascii")
            caption = _inline(picture.caption)
            parts.append(
                f'<figure><img alt="{html.escape(picture.caption)}" src="data:image/png;base64,{data}">'
                f"<figcaption>{caption}</figcaption></figure>"
            )
        if section.prose.differences:
            parts.append("<h3>Differences</h3>")
        parts += [f"<p>{_inline(text)}</p>" for text in section.prose.differences]
        table = _html_table(CHECKS, checks_of(section))
        parts.append(f"<details><summary>Checks of the runs</summary>{table}</details>")
    body = "\n".join(parts)
    path.write_text(PAGE.format(title=html.escape(title), style=STYLE, body=body), encoding="utf-8")


def cells(row: Row) -> tuple[str, ...]:
    """A row of a case's table as texts."""
    difference = "" if row.difference is None else f"{100.0 * row.difference:+.3g} %"
    time = "" if row.seconds is None else f"{row.seconds:.1f} s"
    return row.quantity, row.unit, shown(row.paper), shown(row.exact), shown(row.ours), difference, time


def shown(value: float | str | None) -> str:
    """A value as text: numbers with four digits, five from a thousand on.

    >>> shown(1252.297), shown(None), shown("1171-1267"), shown(1.644e-4), shown(91473.7), shown(5.2e14)
    ('1252.3', '', '1171-1267', '0.0001644', '91474', '5.2e+14')
    """
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if 1e5 <= abs(value) < 1e7:
        return f"{value:.0f}"
    return f"{value:.5g}" if abs(value) >= 1e3 else f"{value:.4g}"


def _texts(table: ReportTable) -> list[tuple[str, ...]]:
    return [tuple(shown(value) for value in line) for line in table.lines]


def checks_of(section: Section) -> list[tuple[str, ...]]:
    """The checks of a section's runs as texts; a run that broke down says why."""
    rows = []
    for result in section.results:
        name = result.run.name
        if result.summary["error"]:
            rows.append((name, result.summary["error"], "", "", "", "", "", "broke down"))
        for check in result.summary["checks"]:
            numbers = [
                "not finite" if check[key] is None else f"{check[key]:.4g}"
                for key in ("value", "reference", "error", "bound")
            ]
            verdict = "passed" if check["passed"] else "FAILED"
            rows.append((name, check["name"], *numbers[:2], check["unit"], *numbers[2:], verdict))
    return rows


def _inline(text: str) -> str:
    """Escaped text with `code`, **stress** and paragraphs."""
    text = html.escape(text)
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", text)
    text = re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", text)
    return text.replace("\n\n", "</p><p>")


def _html_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def line(tag, row):
        return "<tr>" + "".join(f"<{tag}>{_inline(cell)}</{tag}>" for cell in row) + "</tr>"

    return "<table>" + line("th", header) + "".join(line("td", row) for row in rows) + "</table>"


def _markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return [*lines, *("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows), ""]
