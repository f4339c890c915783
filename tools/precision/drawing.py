"""Pictures of the results: error against cost."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from warpsph.scene.numerics import Numerics
from warpsph.scene.scheme import SCHEMES

from .campaign import Result
from .cases import Case
from .settings import COURANT, Setting

COLOURS = {scheme: f"C{number}" for number, scheme in enumerate(SCHEMES)}
LINES = dict(zip(COURANT, ((":", "s"), ("-", "o"), ("--", "^"), ("-.", "D")), strict=True))
OTHERS = ("#d62728", "#ff7f0e", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf")
COSTS = (("node_steps", "node-steps"), ("wall_s", "wall time [s]"))
THRESHOLDS = (0.05, 0.01, 0.001)


def sheet(case: Case, results: Sequence[Result], path: Path) -> Path:
    """A case: velocity schemes and Courant numbers above, the other choices below; against both costs."""
    figure = Figure(figsize=(13.0, 9.0), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(2, 2, sharex="col", sharey=True)
    for panels, lines in zip(grid, (_schemes(results), _others(results)), strict=True):
        for panel, (cost, label) in zip(panels, COSTS, strict=True):
            for name, (rows, style) in lines.items():
                _draw(panel, rows, cost, label=name, **style)
            panel.set_xlabel(label)
        if lines:
            panels[1].legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    for panel in grid.ravel():
        _dress(panel, case.floor)
    for panel in grid[:, 0]:
        panel.set_ylabel("error")
    figure.suptitle(f"{case.title}: error {case.measure}")
    figure.savefig(path, dpi=110)
    return path


def overview(results: Mapping[Case, Sequence[Result]], path: Path) -> Path:
    """All cases on one sheet: velocity schemes and Courant numbers against node-steps."""
    columns = min(4, len(results))
    rows = -(-len(results) // columns)
    figure = Figure(figsize=(4.2 * columns, 3.6 * rows + 1.2), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    drawn = {}
    for panel, (case, members) in zip(panels, results.items(), strict=False):
        for name, (line, style) in _schemes(members).items():
            drawn[name] = _draw(panel, line, "node_steps", **style)
        _dress(panel, case.floor)
        panel.set_title(case.title, fontsize=10)
    for panel in panels[len(results) :]:
        panel.set_axis_off()
    for panel in panels[max(0, len(results) - columns) : len(results)]:
        panel.set_xlabel("node-steps")
    for panel in panels[::columns]:
        panel.set_ylabel("error")
    names = [str(name) for name in drawn]
    figure.legend(drawn.values(), names, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.savefig(path, dpi=100)
    return path


def _schemes(results: Sequence[Result]) -> dict[str, tuple[list[Result], dict]]:
    lines = {}
    for scheme in SCHEMES:
        for courant in COURANT:
            base = [r for r in results if r.setting == Setting(r.setting.spacing, scheme, courant)]
            if not base:
                continue
            line, marker = LINES[courant]
            style = {"color": COLOURS[scheme], "linestyle": line, "marker": marker}
            lines[f"{scheme}, C = {courant:g}"] = base, style
    return lines


def _others(results: Sequence[Result]) -> dict[str, tuple[list[Result], dict]]:
    """The defaults, and what differs in more than scheme and Courant number."""
    default, colours, lines = Setting(1.0).label(), cycle(OTHERS), {}
    for result in results:
        name = result.setting.label()
        if name != default and not result.setting.varies():
            continue
        if name not in lines:
            colour = COLOURS[Numerics.velocity_scheme] if name == default else next(colours)
            label = f"defaults: {name}" if name == default else name
            lines[name] = [], {"color": colour, "marker": "o", "label": label}
        lines[name][0].append(result)
    return {style.pop("label"): (rows, style) for rows, style in lines.values()}


def _draw(panel, results: Sequence[Result], cost: str, **style):
    good = [result for result in results if not result.why]
    x, y = ([getattr(result, name) for result in good] for name in (cost, "error"))
    return panel.plot(x, y, linewidth=1.3, markersize=4, **style)[0]


def _dress(panel, floor: float) -> None:
    """Logarithmic axes of a decade at least, errors in per cent and not far below the case's floor, lines at the
    errors of the tables."""
    panel.set(xscale="log", yscale="log")
    for get, put in ((panel.get_xlim, panel.set_xlim), (panel.get_ylim, panel.set_ylim)):
        low, high = get()
        middle = (low * high) ** 0.5
        put(min(low, middle / 4.0), max(high, middle * 4.0))
    panel.set_ylim(bottom=max(panel.get_ylim()[0], 0.2 * floor))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:g} %"))
    low, high = panel.get_ylim()
    for threshold in THRESHOLDS:
        if low < threshold < high:
            panel.axhline(threshold, color="black", linewidth=0.6, alpha=0.5)
    panel.grid(alpha=0.3)
