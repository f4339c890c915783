"""Pictures of a run from its frames: one time, the whole run on a sheet, an animation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib import animation
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..errors import SceneError
from ..simulation.history import read_history
from ..storage.files import whole
from .frames import Frame, Frames
from .plots import BRIGHT, COLOUR_MAP, DARK, axis_label, save_picture
from .quantity import Quantity
from .view import View

WIDTH, BELOW = 12.0, 3.2  # of the sheet, and height of its lower part [inch]
SNAPSHOTS = 6
HISTORIES = 3
FRAMES_A_SECOND = 12
MOVING_DOTS_PER_INCH = 100
MOVIES = {"gif": animation.PillowWriter, "mp4": animation.FFMpegWriter}


def plot_frame(frames: Frames, quantity: Quantity, frame: Frame, path: Path) -> None:
    """One frame into a PNG."""
    view = View.of(frames, quantity)
    figure, axes = _single(view)
    view.draw(axes, frame)
    axes.set_title(_title(frames, frame))
    save_picture(figure, path)


def animate(frames: Frames, quantity: Quantity, path: Path) -> None:
    """All frames into a GIF or an MP4, by the ending of the path."""
    writer = MOVIES[path.suffix[1:]]
    if not writer.isAvailable():
        raise SceneError("--animate", path.suffix[1:], "it needs ffmpeg, which is not installed here; use gif")
    view = View.of(frames, quantity)
    figure, axes = _single(view)
    movie = writer(fps=FRAMES_A_SECOND)
    with whole(path) as temporary, movie.saving(figure, str(temporary), MOVING_DOTS_PER_INCH):
        for frame in frames:
            axes.clear()
            view.draw(axes, frame)
            axes.set_title(_title(frames, frame))
            movie.grab_frame()


def plot_overview(frames: Frames, quantity: Quantity, path: Path) -> None:
    """The whole run on one sheet: the quantity at several times, the deformation, the histories."""
    view, chosen = View.of(frames, quantity), _evenly_chosen(frames)
    histories = _histories(frames)
    rows, columns = _table(view.width_to_height, len(chosen)) if len(view.low) > 1 else (1, 1)
    height = float(np.clip(rows * (0.85 * WIDTH / columns / view.width_to_height + 0.3) + 0.5, 3.5, 11.0))
    figure = _new_figure((WIDTH, height + BELOW))
    figure.suptitle(frames.about["scene"])
    above, below = figure.subfigures(2, 1, height_ratios=(height, BELOW))
    if len(view.low) == 1:
        _lines_and_diagram(view, frames, chosen, above)
        widths = [1.0] * len(histories)
    else:
        _snapshots(view, chosen, above, rows, columns)
        widths = [float(np.clip(view.width_to_height, 0.6, 1.8)), *[1.0] * len(histories)]
    cells = below.add_gridspec(1, len(widths), width_ratios=widths) if widths else []
    if len(view.low) > 1:
        view.draw_grid(view.axes(below, cells[0]), chosen[-1])
    for k, (x, y, reference) in enumerate(reversed(histories)):
        _draw_history(below.add_subplot(cells[-1 - k]), x, y, reference)
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


def _histories(frames: Frames) -> list[tuple]:
    """Up to `HISTORIES` curves, each x and y as (label, values), and a reference (label, value) or None."""
    path = frames.run / "history.csv"
    if not path.exists():
        return []
    columns, units = read_history(path)
    probes = [name for name in columns if name not in ("step", "time")]

    def column(name: str) -> tuple[str, np.ndarray]:
        return axis_label(name, units[name]), columns[name]

    for name in frames.about["curve"] or ():
        if name not in columns:
            raise SceneError("history", str(path), f"it has no column {name!r}, which about.json says to draw")
    first = frames.about["curve"] or (("time", probes[0]) if probes else None)
    pairs = [tuple(first)] if first else []
    pairs += [("time", name) for name in probes if not first or name not in first]
    references = [frames.about["curve_reference"], *[None] * len(pairs)]
    return [(column(x), column(y), r) for (x, y), r in zip(pairs, references, strict=False)][:HISTORIES]


def _draw_history(axes, x: tuple, y: tuple, reference: Mapping | None) -> None:
    axes.plot(x[1], y[1], color=DARK, linewidth=1.3)
    if reference:
        axes.axhline(
            reference[1], color=BRIGHT, linestyle="--", linewidth=1.1, label=f"{reference[0]}: {reference[1]:.4g}"
        )
        axes.legend(frameon=False, fontsize=8)
    axes.set(xlabel=x[0], ylabel=y[0])
    axes.locator_params(axis="x", nbins=5)  # its labels are wide
    axes.grid(alpha=0.3)


def _evenly_chosen(frames: Frames) -> list[Frame]:
    """Some frames, evenly over the run, the last among them, the first left out where there are enough."""
    count = len(frames)
    places = np.linspace(0, count - 1, SNAPSHOTS + 1)[1:] if count > SNAPSHOTS else np.arange(count)
    return [frames[k] for k in np.unique(np.rint(places).astype(int))]


def _table(width_to_height: float, panels: int) -> tuple[int, int]:
    """Rows and columns of the snapshots."""
    columns = 2 if width_to_height > 1.6 else 3 if width_to_height > 0.6 else 6
    columns = min(columns, panels)
    return -(-panels // columns), columns


def _single(view: View):
    """A figure for one frame, and its axes."""
    ratio = view.width_to_height
    wide = ratio > 1.5
    size = (8.0, 1.9 + 7.2 / ratio) if wide else (7.5, 6.5) if ratio > 0.7 else (2.6 + 6.0 * ratio, 7.0)
    figure = _new_figure((7.0, 4.0) if len(view.low) == 1 else size)
    axes = view.axes(figure)
    place = {"location": "bottom"} if wide else {}
    view.colour_bar(figure, axes, shrink=0.8, aspect=30, **place)
    return figure, axes


def _title(frames: Frames, frame: Frame) -> str:
    return f"{frames.about['scene']}, t = {frame.time:.4g} s"


def _new_figure(size: tuple[float, float]) -> Figure:
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure
