"""Markdown: errors by spacing, and the cheapest setting for a wanted error."""

from collections.abc import Mapping, Sequence

from benchmarking.tables import table

from .campaign import Result
from .cases import CASES, Case
from .drawing import THRESHOLDS
from .settings import Setting

PEERS = """\
Others on the impact, 200 / 800 columns: LAMMPS 3.6 / 1.5 %, SPHinXsys 5.6 / 2.0 %, GeoTaichi 5.9 / 2.6 % of the
impact velocity."""


def tables(results: Mapping[Case, Sequence[Result]]) -> str:
    """All tables."""
    parts = [f"# Errors\n\n{_legend()}"]
    for case, rows in results.items():
        parts.append(f"## {case.title}\n\nError {case.measure}.\n\n{_errors(rows)}")
        if case is CASES["impact"]:
            parts.append(PEERS)
    parts.append(f"# Cheapest setting for an error\n\n{_cheapest(results)}")
    failures = [row for rows in results.values() for row in rows if row.why]
    if failures:
        reasons: dict[str, int] = {}
        for row in failures:
            reasons[row.why] = reasons.get(row.why, 0) + 1
        parts.append("# Not run\n\n" + "\n".join(f"- {count} × {why}" for why, count in reasons.items()))
    return "\n\n".join(parts) + "\n"


def _legend() -> str:
    base = Setting(1.0)
    return (
        f"In %, by spacing Δx [m]. Unless a row says otherwise: {base.source_scheme} sources, {base.precision}, "
        "the package's smoothing in sums over neighbours. A dash: not run, the reason is at the end."
    )


def _errors(results: Sequence[Result]) -> str:
    spacings = list({result.setting.spacing: None for result in results})
    lines: dict[str, dict[float, str]] = {}
    for result in results:
        setting = result.setting
        lines.setdefault(setting.label(), {})[setting.spacing] = (
            "-" if result.why else f"{100.0 * result.error:.3g}"
        )
    rows = [(name, *(line.get(spacing, "") for spacing in spacings)) for name, line in lines.items()]
    return table(("setting", *(f"{spacing:.4g}" for spacing in spacings)), rows)


def _cheapest(results: Mapping[Case, Sequence[Result]]) -> str:
    rows = []
    for case, members in results.items():
        good = [result for result in members if not result.why]
        for wanted in (threshold for threshold in THRESHOLDS if threshold >= case.floor):
            reached = [result for result in good if result.error <= wanted]
            label = case.title, f"{100.0 * wanted:g} %"
            if not reached:
                best = min(good, key=lambda result: result.error, default=None)
                rows.append((*label, f"none; best {100.0 * best.error:.2g} %" if best else "none", "", "", ""))
                continue
            for kind, cost in (("node-steps", "node_steps"), ("wall time", "wall_s")):
                chosen = min(reached, key=lambda result: getattr(result, cost))
                figures = f"{100.0 * chosen.error:.2g} %", f"{chosen.node_steps:.2g}", f"{chosen.wall_s:.2g}"
                rows.append((*label, f"{chosen.setting} (least {kind})", *figures))
    return table(("case", "wanted", "setting", "error", "node-steps", "wall time, s"), rows)
