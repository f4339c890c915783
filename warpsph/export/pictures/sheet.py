"""A run on one sheet: a quantity at several times, the deformation, the histories.

It is what to look at first: whether the run did what was meant, and when it did.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np

from ..colours import COLOUR_MAP
from ..frames import Frame, Frames
from ..quantity import Quantity
from .figures import new_figure, save_picture
from .history import curves_of
from .view import View

WIDTH, BELOW = 12.0, 3.2  # of the sheet, and height of its lower part [inch]
SNAPSHOTS = 6


def plot_overview(frames: Frames, quantity: Quantity, *, path: Path) -> None:
    """The whole run on one sheet: the quantity at several times, the deformation, the histories."""
    view, chosen = View.of(frames, quantity), _evenly_chosen(frames)
    curves = curves_of(frames)
    rows, columns = _rows_and_columns(view.width_to_height, len(chosen)) if len(view.low) > 1 else (1, 1)
    height = float(np.clip(rows * (0.85 * WIDTH / columns / view.width_to_height + 0.3) + 0.5, 3.5, 11.0))
    figure = new_figure((WIDTH, height + BELOW))
    figure.suptitle(frames.about["scene"])
    above, below = figure.subfigures(2, 1, height_ratios=(height, BELOW))
    if len(view.low) == 1:
        _lines_and_diagram(view, frames, chosen, above)
        widths = [1.0] * len(curves)
    else:
        _snapshots(view, chosen, above, rows, columns)
        widths = [float(np.clip(view.width_to_height, 0.6, 1.8)), *[1.0] * len(curves)]
    cells = below.add_gridspec(1, len(widths), width_ratios=widths) if widths else []
    if len(view.low) > 1:
        view.draw_grid(view.axes(below, cells[0]), chosen[-1])
    for k, curve in enumerate(reversed(curves)):
        curve.draw(below.add_subplot(cells[-1 - k]))
    save_picture(figure, path)


def _snapshots(view: View, chosen: Sequence[Frame], figure, rows: int, columns: int) -> None:
    panels = [view.axes(figure, rows, columns, k + 1) for k in range(len(chosen))]
    for k, (axes, frame) in enumerate(zip(panels, chosen, strict=True)):
        view.draw(axes, frame)
        axes.set_title(f"t = {frame.time:.4g} s", fontsize=10)
        if len(view.low) == 2:
            lowest, leftmost = k + columns >= len(chosen), k % columns == 0
            axes.set(xlabel="x [m]" if lowest else "", ylabel="y [m]" if leftmost else "")
            axes.tick_params(labelbottom=lowest, labelleft=leftmost)
    view.colour_bar(figure, panels, shrink=0.8, aspect=35)


def _lines_and_diagram(view: View, frames: Frames, chosen: Sequence[Frame], figure) -> None:
    """A bar: the quantity along it at some times, and over place and time."""
    lines, diagram = figure.subplots(1, 2)
    shades = matplotlib.colormaps[COLOUR_MAP](np.linspace(0.0, 0.9, len(chosen)))
    for frame, shade in zip(chosen, shades, strict=True):
        view.draw(lines, frame, color=shade, label=f"{frame.time:.3g} s")
    lines.legend(frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    time = [frame.time for frame in frames]
    values = np.array([view.quantity(frame) for frame in frames])
    x = frames.mesh.nodes[:, 0]
    low, high = view.span
    drawn = diagram.pcolormesh(x, time, values, cmap=COLOUR_MAP, shading="nearest", vmin=low, vmax=high)
    diagram.set(xlabel="initial x [m]", ylabel="time [s]")
    figure.colorbar(drawn, ax=diagram, label=view.quantity.label)


def _evenly_chosen(frames: Frames) -> list[Frame]:
    """Some frames, evenly over the run, the last among them, the first left out where there are enough."""
    count = len(frames)
    places = np.linspace(0, count - 1, SNAPSHOTS + 1)[1:] if count > SNAPSHOTS else np.arange(count)
    return [frames[k] for k in np.unique(np.rint(places).astype(int))]


def _rows_and_columns(width_to_height: float, panels: int) -> tuple[int, int]:
    """Rows and columns of the snapshots."""
    columns = 2 if width_to_height > 1.6 else 3 if width_to_height > 0.6 else 6
    columns = min(columns, panels)
    return -(-panels // columns), columns
