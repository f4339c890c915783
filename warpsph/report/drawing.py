"""The report's pictures: curves, and rows and columns of fields on the deformed nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..export.colours import beyond, colour_span
from ..export.pictures.figures import BRIGHT, DARK, GREY, draw_cells, new_figure, save_picture
from ..mesh.mesh import Mesh

LINES = ((DARK, "-"), (BRIGHT, "-"), (GREY, "-"), (DARK, ":"), (BRIGHT, ":"), (GREY, ":"))
EXACT = {"color": "black", "linestyle": "--", "linewidth": 1.0}


@dataclass(frozen=True)
class Curve:
    """A line of a diagram: its label, x and y; `exact` draws it as a reference."""

    label: str
    x: Sequence[float]
    y: Sequence[float]
    exact: bool = False


@dataclass(frozen=True)
class Panel:
    """A field of a plane body: its title, the mesh as it is drawn, values at the nodes (n,)."""

    title: str
    mesh: Mesh
    values: np.ndarray


def grid(rows: int, columns: int, *, size: tuple[float, float], **options):
    """A figure and its axes, an array (rows, columns)."""
    figure = new_figure(size)
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def draw_curves(axes, curves: Sequence[Curve], *, x_label: str, y_label: str, above: bool = False) -> None:
    """Draw lines into axes, their legend among them or above."""
    styles = iter(LINES)
    for curve in curves:
        if curve.exact:
            axes.plot(curve.x, curve.y, label=curve.label, **EXACT)
        else:
            colour, style = next(styles)
            axes.plot(curve.x, curve.y, label=curve.label, color=colour, linestyle=style, linewidth=1.4)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.grid(alpha=0.3)
    if len(curves) > 1:
        place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": len(curves)} if above else {}
        axes.legend(frameon=False, fontsize=9, **place)


def diagram(path: Path, curves: Sequence[Curve], *, x_label: str, y_label: str, **limits) -> Path:
    """One diagram; `limits` are those of `Axes.set`, e.g. `ylim`."""
    figure, axes = grid(1, 1, size=(7.0, 3.8))
    draw_curves(axes[0, 0], curves, x_label=x_label, y_label=y_label, above=True)
    axes[0, 0].set(**limits)
    return save_picture(figure, path)


def draw_fields(
    path: Path,
    panels: Sequence[Sequence[Panel]],
    *,
    label: str,
    size: tuple[float, float],
    shared: bool = True,
    edges: bool = True,
) -> Path:
    """Fields in rows and columns, all at one scale of length.

    Args:
        path: of the picture.
        panels: the rows.
        label: of the colour bar, with unit.
        size: of the picture [inch].
        shared: whether all panels share one span of colours and one bar.
        edges: whether to draw the cells.
    """
    figure, axes = grid(len(panels), len(panels[0]), size=size, sharex=True, sharey=True)
    drawn = [(axes[i, k], panel) for i, row in enumerate(panels) for k, panel in enumerate(row)]
    low = np.min([panel.mesh.nodes.min(axis=0) for _, panel in drawn], axis=0)
    high = np.max([panel.mesh.nodes.max(axis=0) for _, panel in drawn], axis=0)
    margin = 0.03 * (high - low).max()
    everything = np.concatenate([panel.values for _, panel in drawn])
    for at, panel in drawn:
        values = everything if shared else panel.values
        span = colour_span(values)
        colours = draw_cells(at, panel.mesh, panel.values, span=span, edges=edges)
        at.set_title(panel.title, fontsize=10)
        at.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
        at.label_outer()
        if not shared:
            figure.colorbar(colours, ax=at, label=label, extend=beyond(values, span), shrink=0.9)
    if shared:
        figure.colorbar(colours, ax=axes, label=label, extend=beyond(everything, span), shrink=0.8, aspect=30)
    return save_picture(figure, path)
