"""Pictures of a run: the history curve and the final field, with matplotlib and without a screen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from ..analysis.measures import split_cells
from ..mesh.mesh import Mesh
from ..scene.output import component
from ..simulation.fields import component_names, fields_of
from ..simulation.history import History
from ..simulation.simulation import Simulation
from ..storage.files import write_whole

COLOUR_MAP = "cividis"  # readable with every common colour-vision deficiency, and in grey
DARK, BRIGHT = "#00204d", "#c26a00"  # of lines; told apart in grey as well
DOTS_PER_INCH = 150


def plot_history(simulation: Simulation, history: History, path: Path) -> bool:
    """Draw the scene's curve into a PNG; False when the scene records nothing to draw."""
    output = simulation.scene.output
    if not output.probes:
        return False
    x_name, y_name = output.curve or ("time", output.probes[0].name)
    figure, axes = _figure((7.0, 4.5))
    x, y = history[x_name], history[y_name]
    axes.plot(x, y, color=DARK, linewidth=1.5, label="warpsph")
    if output.curve_reference:
        label, value = output.curve_reference
        axes.axhline(value, color=BRIGHT, linestyle="--", linewidth=1.2, label=f"{label}: {value:.5g}")
        axes.legend(loc="best", frameon=False)
    axes.set_xlabel(axis_label(x_name, history.unit(x_name)))
    axes.set_ylabel(axis_label(y_name, history.unit(y_name)))
    axes.set_title(f"{simulation.scene.name}, t = {simulation.time:.4g} s")
    axes.grid(alpha=0.3)
    save_picture(figure, path)
    return True


def plot_field(simulation: Simulation, path: Path) -> None:
    """Draw the scene's field at the present time, on the deformed nodes, into a PNG."""
    output, mesh = simulation.scene.output, simulation.mesh
    values = simulation.field(output.field).astype(float)
    name = output.field
    if values.ndim > 1:
        name = f"{name} {component_names(output.field, mesh.continuum)[output.component]}"
        values = component("Output", values, output.component)
    position = simulation.field("position")
    label = axis_label(name, fields_of(simulation.scene)[output.field].unit)
    draw = {1: _line, 2: _cells, 3: _surface}[mesh.dim]
    figure = draw(position, values, mesh, label)
    figure.axes[0].set_title(f"{simulation.scene.name}, t = {simulation.time:.4g} s")
    save_picture(figure, path)


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG, whole or not at all."""
    write_whole(path, lambda file: figure.savefig(file, format="png", dpi=DOTS_PER_INCH, bbox_inches="tight"))


def _line(position, values, mesh, label) -> Figure:
    figure, axes = _figure((7.0, 4.0))
    axes.plot(position[:, 0], values, color=DARK, linewidth=1.2, marker=".", markersize=3)
    axes.set_xlabel("x [m]")
    axes.set_ylabel(label)
    axes.grid(alpha=0.3)
    return figure


def _cells(position, values, mesh, label) -> Figure:
    extent = np.ptp(position, axis=0)
    wide = extent[0] > 1.5 * extent[1]
    figure, axes = _figure((8.0, 2.0 + 7.0 * extent[1] / extent[0]) if wide else (7.5, 6.5))
    span = colour_span(values)
    colours = draw_cells(axes, position, values, mesh, span)
    place = {"location": "bottom" if wide else "right", "shrink": 0.8, "aspect": 30}
    figure.colorbar(colours, ax=axes, label=label, extend=beyond(values, span), **place)
    return figure


def colour_span(values: np.ndarray) -> tuple[float, float]:
    """The middle 99 % of the values: a single node at a footing's edge would hide all others.

    From zero on where all values are positive and come near it.
    """
    return span_of([percentiles(values)])


def percentiles(values: np.ndarray) -> np.ndarray:
    """The smallest value and the ends of the middle 99 %, shape (3,)."""
    return np.percentile(values, [0.0, 0.5, 99.5])


def span_of(several: Sequence[np.ndarray]) -> tuple[float, float]:
    """The span of colours that shows several pictures, each given by its `percentiles`."""
    smallest, low, high = np.min(several, axis=0)[0], np.min(several, axis=0)[1], np.max(several, axis=0)[2]
    low = 0.0 if smallest >= 0.0 and low < 0.2 * high else low
    return float(low), float(high if high > low else low + 1.0)


def beyond(values: np.ndarray, span: tuple[float, float]) -> str:
    """On which sides values lie beyond a span of colours, as `Figure.colorbar` wants it."""
    below, above = bool(values.min() < span[0]), bool(values.max() > span[1])
    return {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[
        below, above
    ]


def draw_cells(
    axes: Axes,
    position: np.ndarray,
    values: np.ndarray,
    mesh: Mesh,
    span: tuple[float, float],
    edges: bool = False,
):
    """Draw a plane body: the cells of its initial lattice where they are now, the nodes' values between them.

    Args:
        axes: where to draw; gets equal aspect and labels.
        position: of the nodes [m], shape (n, 2).
        values: at the nodes, shape (n,).
        lattice: the initial lattice.
        span: the values at the ends of the colour map.
        edges: whether to draw all cell edges; the outline only if not.

    Returns: what `Figure.colorbar` needs.
    """
    corners, triangles, heights = split_cells(position, mesh.cells, values)
    colours = axes.tripcolor(
        *corners.T,
        triangles,
        heights,
        shading="gouraud",
        cmap=COLOUR_MAP,
        vmin=span[0],
        vmax=span[1],
        rasterized=True,
    )
    if edges:
        around = position[mesh.cells[:, mesh.kind.drawn]]
        axes.add_collection(PolyCollection(around, edgecolor="white", facecolor="none", linewidth=0.25, alpha=0.6))
    outline = PolyCollection(position[mesh.faces], edgecolor="black", facecolor="none", linewidth=0.6)
    axes.add_collection(outline)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    return colours


def _surface(position, values, mesh, label) -> Figure:
    figure = Figure(figsize=(7.0, 6.0))
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(projection="3d")
    nodes = np.unique(mesh.faces)
    points = axes.scatter(*position[nodes].T, c=values[nodes], cmap=COLOUR_MAP, s=8)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_zlabel("z [m]")
    axes.set_aspect("equal")
    figure.colorbar(points, ax=axes, label=label, shrink=0.7)
    return figure


def _figure(size):
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.add_subplot()


def axis_label(name: str, unit: str) -> str:
    return f"{name.replace('_', ' ')} [{unit}]"
