"""What all pictures share: their style, a figure without a screen, and a file that is whole or not there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from ...analysis import split_cells
from ...mesh.mesh import Mesh
from ...storage.files import write_whole
from ..colours import COLOUR_MAP

DARK, BRIGHT, GREY = "#00204d", "#c26a00", "#8a8a8a"  # of lines and points; told apart in grey as well
DOTS_PER_INCH = 150


def new_figure(size: tuple[float, float]) -> Figure:
    """A figure of that size [inch] that needs no screen."""
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_picture(figure: Figure, path: Path) -> Path:
    """Write a figure as a PNG, whole or not at all; returns the path."""
    write_whole(path, lambda file: figure.savefig(file, format="png", dpi=DOTS_PER_INCH, bbox_inches="tight"))
    return path


def axis_label(name: str, unit: str) -> str:
    """Name and unit as they stand on an axis."""
    return f"{name.replace('_', ' ')} [{unit}]"


def draw_cells(axes: Axes, mesh: Mesh, values: np.ndarray, *, span: tuple[float, float], edges: bool = False):
    """Draw a plane body: its cells, the nodes' values between them.

    Args:
        axes: where to draw; gets equal aspect and labels.
        mesh: the body, its nodes where they are drawn.
        values: at the nodes, shape (n,).
        span: the values at the ends of the colour map.
        edges: whether to draw all cell edges; the outline only if not.

    Returns: what `Figure.colorbar` needs.
    """
    corners, triangles, heights = split_cells(mesh, values)
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
        around = mesh.nodes[mesh.cells[:, mesh.kind.drawn]]
        axes.add_collection(PolyCollection(around, edgecolor="white", facecolor="none", linewidth=0.25, alpha=0.6))
    outline = PolyCollection(mesh.nodes[mesh.faces], edgecolor="black", facecolor="none", linewidth=0.6)
    axes.add_collection(outline)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    return colours
