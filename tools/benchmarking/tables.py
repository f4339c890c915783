"""Prints results as Markdown tables, and two of them side by side."""

from collections.abc import Sequence

KEY = ("dimension", "material", "precision", "device", "threads", "nodes")


def tables(report: dict) -> str:
    """All results as Markdown."""
    machine = report["machine"]
    gpus = ", ".join(machine["gpus"]) or "no GPU"
    parts = [
        f"{report['date']}, warpsph {machine['warpsph']} ({machine['commit']}), Warp {machine['warp']}, "
        f"{machine['processor']}, {machine['cores']} cores, {gpus}\n\n    {report['command']}"
    ]
    if report["results"]:
        parts += [_speed(report), _phases(report)]
    if report["copies"]:
        rows = [(*_place(row), f"{row['bytes_per_second'] / 1e9:.1f}") for row in report["copies"]]
        parts.append(table(("device", "threads", "copy, GB/s"), rows))
    if report["starts"]:
        names = ("seconds", "build_seconds", "first_step_seconds")
        rows = [(*_place(row), row["cache"], *(f"{row[name]:.2f}" for name in names)) for row in report["starts"]]
        parts.append(table(("device", "threads", "start", "in all, s", "build, s", "first step, s"), rows))
    if report["others"]:
        names = ("solver", "case", "threads", "nodes")
        rows = [
            (*(str(row[name]) for name in names), f"{row['node_steps_per_second']:.3g}")
            for row in report["others"]
        ]
        parts.append(table((*names, "node-steps/s"), rows))
    if report["skipped"]:
        reasons: dict[str, int] = {}
        for row in report["skipped"]:
            reasons[row["why"]] = reasons.get(row["why"], 0) + 1
        parts.append("Skipped:\n\n" + "\n".join(f"- {count} × {why}" for why, count in reasons.items()))
    return "\n\n".join(parts)


def _speed(report: dict) -> str:
    heads = (
        "node-steps/s",
        "spread",
        "growth",
        "bytes/node-step",
        "of copy",
        "bytes/node",
        "host peak",
    )
    rows = [
        (
            *_case(row),
            f"{row['node_steps_per_second']:.3g}",
            _percent(row["spread"]),
            _number(row.get("growth"), ".2f"),
            f"{row['bytes_per_node_step']:.0f}",
            _percent(row.get("memory_bandwidth_fraction")),
            f"{row['memory_per_node']:.0f}",
            f"{row['host_peak_per_node']:.0f}",
        )
        for row in report["results"]
    ]
    return table((*_CASE_HEADS, *heads), rows)


def _phases(report: dict) -> str:
    phases = list({phase: None for row in report["results"] for phase in row["phases"]})
    phases.sort(key="rest".__eq__)
    rows = [(*_case(row), *(_percent(row["phases"].get(phase)) for phase in phases)) for row in report["results"]]
    return table((*_CASE_HEADS, *phases), rows)


def compare(old: dict, new: dict) -> str:
    """The rates of two reports side by side, for the cases that both have."""
    lines = [
        f"{name}: {report['date']}, {report['machine']['commit']}, {report['machine']['processor']}"
        for name, report in (("old", old), ("new", new))
    ]
    if any(old["machine"][name] != new["machine"][name] for name in ("processor", "cores", "gpus")):
        lines.append("The machines differ.")
    before, after = ({_key(row): row for row in report["results"]} for report in (old, new))
    rows = []
    for key in [key for key in before if key in after]:
        was, now = (part[key]["node_steps_per_second"] for part in (before, after))
        spreads = (_percent(part[key]["spread"]) for part in (before, after))
        rows.append((*_case(after[key]), f"{was:.3g}", f"{now:.3g}", f"{now / was:.2f}", *spreads))
    heads = (*_CASE_HEADS, "old, node-steps/s", "new, node-steps/s", "new/old", "spread, old", "spread, new")
    parts = ["\n".join(lines), table(heads, rows) if rows else "No case is in both."]
    alone = [f"{len(before.keys() - after.keys())} in the old one only"]
    alone.append(f"{len(after.keys() - before.keys())} in the new one only")
    return "\n\n".join([*parts, f"Cases: {len(rows)} in both, {', '.join(alone)}."])


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, aligned for reading as it stands."""
    widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
    lines = [heads, ["-" * width for width in widths], *rows]
    return "\n".join(
        "| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |" for row in lines
    )


_CASE_HEADS = ("case", "device", "threads", "nodes")


def _case(row: dict) -> tuple[str, ...]:
    return f"{row['dimension']}D {row['material']} {row['precision']}", *_place(row), str(row["lattice_nodes"])


def _place(row: dict) -> tuple[str, str]:
    return row["device"], str(row["threads"]) if row["device"] == "cpu" else "-"


def _key(row: dict) -> tuple:
    return tuple(row[name] for name in KEY)


def _percent(value: float | None) -> str:
    return _number(None if value is None else 100.0 * value, ".0f", " %")


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{form}}{unit}"
