"""How a run is looked at: one quantity on the deformed body, at the same scale and colours in every frame.

Frames can then be compared by eye, and an animation does not jump. One `View` draws whatever has a mesh, a time
and fields: a frame that was kept, or a simulation as it is now.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from ...mesh.mesh import Mesh
from ...simulation.simulation import Simulation
from ..colours import COLOUR_MAP, beyond, percentiles, span_of
from ..quantity import Quantity, Snapshot
from ..tool_meshes import ToolMesh, tools_now
from .figures import DARK, GREY, draw_cells, new_figure

MARGIN = 0.04
TOOL = "#c9c9c9"


@dataclass(frozen=True)
class View:
    """A quantity of a run.

    Attributes:
        quantity: what is shown.
        span: its values at the ends of the colours.
        values: its smallest and largest value over all frames.
        low, high: corners of the box that holds the body in all frames [m], shape (d,).
    """

    quantity: Quantity
    span: tuple[float, float]
    values: tuple[float, float]
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, frames: Iterable[Snapshot], quantity: Quantity) -> View:
        """The view that shows all frames: those of a run, or one simulation as it is now."""
        spans, values, corners = [], [], []
        for frame in frames:
            shown, position = quantity(frame), frame.field("position")
            spans.append(percentiles(shown))
            values.append((shown.min(), shown.max()))
            corners.append((position.min(axis=0), position.max(axis=0)))
        low, high = np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]
        margin = MARGIN * (high - low).max()
        extremes = (float(np.min(values)), float(np.max(values)))
        return cls(quantity, span_of(spans), extremes, low - margin, high + margin)

    @property
    def width_to_height(self) -> float:
        """Of the box."""
        return float((self.high[0] - self.low[0]) / (self.high[-1] - self.low[-1])) if len(self.low) > 1 else 2.0

    def axes(self, figure: Figure, *place) -> Axes:
        """New axes for it."""
        return figure.add_subplot(*place, projection="3d" if len(self.low) == 3 else None)

    def figure(self) -> tuple[Figure, Axes]:
        """A figure for one frame, as the body is shaped, and its axes."""
        ratio = self.width_to_height
        wide = ratio > 1.5
        size = (8.0, 1.9 + 7.2 / ratio) if wide else (7.5, 6.5) if ratio > 0.7 else (2.6 + 6.0 * ratio, 7.0)
        figure = new_figure((7.0, 4.0) if len(self.low) == 1 else size)
        axes = self.axes(figure)
        place = {"location": "bottom"} if wide else {}
        self.colour_bar(figure, axes, shrink=0.8, aspect=30, **place)
        return figure, axes

    def draw(self, axes: Axes, frame: Snapshot, **style) -> None:
        """Draw a frame into its axes."""
        position, values = frame.field("position"), self.quantity(frame)
        if len(self.low) == 1:
            axes.plot(position[:, 0], values, **{"color": DARK, "linewidth": 1.2} | style)
            room = 0.05 * (self.values[1] - self.values[0]) or 1.0
            axes.set(xlabel="x [m]", ylabel=self.quantity.label, xlim=(self.low[0], self.high[0]))
            axes.set_ylim(self.values[0] - room, self.values[1] + room)
            axes.grid(alpha=0.3)
        elif len(self.low) == 2:
            outlines = [tool.outline for tool in _tools(frame)]
            axes.add_collection(PolyCollection(outlines, facecolor=TOOL, edgecolor="black", linewidth=0.6))
            draw_cells(axes, frame.present_mesh.with_nodes(position), values, span=self.span, **style)
            axes.set(xlim=(self.low[0], self.high[0]), ylim=(self.low[1], self.high[1]))
        else:
            colours = matplotlib.colormaps[COLOUR_MAP](
                Normalize(*self.span)(_of_faces(frame.present_mesh, values))
            )
            _solid(axes, frame.present_mesh, position, facecolors=colours, edgecolors=colours, linewidths=0.2)
            for tool in _tools(frame):
                if np.ptp(tool.points, axis=0).max() < 2.0 * (self.high - self.low).max():  # planes hide the body
                    faces = tool.points[tool.polygons]
                    axes.add_collection3d(Poly3DCollection(faces, facecolors=TOOL, linewidths=0.0, alpha=0.3))
            axes.set(
                xlim=(self.low[0], self.high[0]),
                ylim=(self.low[1], self.high[1]),
                zlim=(self.low[2], self.high[2]),
            )
            axes.set_box_aspect(self.high - self.low)

    def draw_grid(self, axes: Axes, frame: Snapshot) -> None:
        """Draw the deformed cells over the outline of the initial body, magnified where they hardly move."""
        displacement, mesh, present = frame.field("displacement"), frame.mesh, frame.present_mesh
        scale = magnification(np.linalg.norm(displacement, axis=1).max(), np.ptp(mesh.nodes, axis=0).max())
        position = mesh.nodes + scale * displacement
        if len(self.low) == 3:
            _solid(axes, present, position, facecolors="#e8e8e8", edgecolors=DARK, linewidths=0.3)
            axes.set_box_aspect(np.ptp(position, axis=0))
            axes.set(**{f"{k}lim": (x.min(), x.max()) for k, x in zip("xyz", position.T, strict=True)})
        else:
            ring = mesh.kind.drawn
            around = position[present.cells[:, (*ring, ring[0])]]
            cut = np.full((len(around), 1, 2), np.nan)
            axes.plot(*np.concatenate([around, cut], axis=1).reshape(-1, 2).T, color=DARK, linewidth=0.4)
            edges = np.concatenate([mesh.nodes[mesh.faces], np.full((len(mesh.faces), 1, 2), np.nan)], axis=1)
            axes.plot(*edges.reshape(-1, 2).T, color=GREY, linewidth=1.0, linestyle="--")
            axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
        axes.set_title(
            f"deformation, t = {frame.time:.4g} s" + (f" (× {scale:g})" if scale != 1.0 else ""), fontsize=10
        )

    def colour_bar(self, figure: Figure, axes, **place) -> None:
        """The bar that explains the colours; a bar's values stand on an axis already."""
        if len(self.low) > 1:
            scale = ScalarMappable(Normalize(*self.span), COLOUR_MAP)
            extend = beyond(np.array(self.values), self.span)
            pad = 0.08 if len(self.low) == 3 else 0.02  # room for the labels of the z axis
            figure.colorbar(scale, ax=axes, label=self.quantity.label, extend=extend, **{"pad": pad} | place)


def magnification(displacement: float, size: float) -> float:
    """By what a displacement is drawn larger: 1, 2 or 5 times a power of ten, 1 from 2 % of the body's size on.

    >>> magnification(0.5, 10.0), magnification(1e-4, 1.0), magnification(0.0, 1.0)
    (1.0, 500.0, 1.0)
    """
    if displacement >= 0.02 * size or displacement <= 1e-9 * size:
        return 1.0
    wanted = 0.08 * size / displacement
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted))


def _tools(frame: Snapshot) -> tuple[ToolMesh, ...]:
    return tools_now(frame) if isinstance(frame, Simulation) else frame.tools


def _of_faces(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    return values[mesh.faces].mean(axis=1)


def _solid(axes: Axes, mesh: Mesh, position: np.ndarray, **style) -> None:
    axes.add_collection3d(Poly3DCollection(position[mesh.faces[:, mesh.kind.face_kind.drawn]], **style))
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
