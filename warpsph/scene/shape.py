"""Shapes a user can write: each makes the initial lattice of a body."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.lattice import grid_lattice
from ..mesh.mesh import Mesh
from ..validate import field_of_position, instance, number, vector


class Shape:
    """A body's shape with its lattice spacing; subclasses implement `lattice`."""

    def mesh(self) -> Mesh:
        """The initial nodes, cells and boundary faces."""
        raise NotImplementedError

    def rotated(self, angle: float, about: tuple[float, float] | None = None) -> Mapped:
        """The shape with its lattice turned by `angle` [rad], anticlockwise in the x-y plane.

        Args:
            angle: angle [rad].
            about: centre of the rotation (x, y) [m]; the origin unless given.
        """
        angle = number("rotated.angle", angle)
        centre = (0.0, 0.0) if about is None else vector("rotated.about", about, 2)
        cos, sin = math.cos(angle), math.sin(angle)

        def turn(x, y, *z):
            return (
                centre[0] + cos * (x - centre[0]) - sin * (y - centre[1]),
                centre[1] + sin * (x - centre[0]) + cos * (y - centre[1]),
                *z,
            )

        return Mapped(self, turn)

    def mapped(self, function: Callable) -> Mapped:
        """The shape with every node moved to `function(x, y, …)`, which returns the new coordinates."""
        return Mapped(self, function)


@dataclass(frozen=True)
class Box(Shape):
    """A bar, a rectangle or a cuboid, by the number of lengths in `size`.

    Args:
        size: length along each axis [m]; each a whole number of spacings.
        spacing: distance between neighbouring nodes Δx [m].
        origin: low corner [m]; zero unless given.

    >>> Box(size=(2.0, 1.0), spacing=0.5).mesh().nodes.shape
    (15, 2)
    """

    size: tuple[float, ...]
    spacing: float
    origin: tuple[float, ...] | None = None

    def __post_init__(self):
        size = vector("size", self.size)
        for length in size:
            number("size", length, above=0.0)
        spacing = number("spacing", self.spacing, above=0.0)
        _limit_cells(size, spacing)
        for length in size:
            cells = round(length / spacing)
            if cells < 1 or abs(length / spacing - cells) > 1e-6 * cells:
                fit = max(1, cells)
                raise SceneError(
                    "spacing",
                    spacing,
                    f"the size {length:g} m must be a whole number of spacings, for example {length / fit:.6g}",
                )
        origin = (0.0,) * len(size) if self.origin is None else vector("origin", self.origin, len(size))
        for name, value in (("size", size), ("spacing", spacing), ("origin", origin)):
            object.__setattr__(self, name, value)

    def mesh(self) -> Mesh:
        size = np.array(self.size)
        cells = np.rint(size / self.spacing).astype(int)
        return grid_lattice(np.ones(cells, dtype=bool), self.spacing, np.array(self.origin), size)


@dataclass(frozen=True)
class Disc(Shape):
    """A disc cut out of a square lattice: the cells whose centre lies inside the circle.

    Its edge is a staircase. For edge nodes on a curve, map a box (see `Shape.mapped`).

    Args:
        radius: radius [m].
        spacing: Δx [m].
        centre: centre [m].

    >>> len(Disc(radius=1.0, spacing=0.5).mesh().cells)
    12
    """

    radius: float
    spacing: float
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self):
        object.__setattr__(self, "radius", number("radius", self.radius, above=0.0))
        object.__setattr__(self, "spacing", number("spacing", self.spacing, above=0.0, at_most=self.radius))
        object.__setattr__(self, "centre", vector("centre", self.centre, 2))
        _limit_cells((2 * self.radius,) * 2, self.spacing)

    def mesh(self) -> Mesh:
        centre = np.array(self.centre)
        half = 0.5 * self.spacing * math.ceil(2.0 * self.radius / self.spacing - 1e-9)  # centres the lattice
        return _cut(
            lambda p: np.sum((p - centre) ** 2, axis=-1) < self.radius**2,
            centre - half,
            centre + half,
            self.spacing,
        )


@dataclass(frozen=True)
class Polygon(Shape):
    """A polygon cut out of a square lattice that starts at its lowest corner: cells whose centre is inside.

    Args:
        vertices: corners in order [m], three or more (x, y) pairs.
        spacing: Δx [m].

    >>> Polygon([(0, 0), (2, 0), (0, 2)], spacing=1.0).mesh().cells.shape
    (1, 4)
    """

    vertices: tuple[tuple[float, float], ...]
    spacing: float

    def __post_init__(self):
        try:
            vertices = tuple(vector("vertices", vertex, 2) for vertex in self.vertices)
        except TypeError:
            vertices = ()
        if len(vertices) < 3:
            raise SceneError("vertices", self.vertices, "it must be three or more (x, y) pairs [m]")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "spacing", number("spacing", self.spacing, above=0.0))
        corners = np.array(vertices)
        _limit_cells(corners.max(axis=0) - corners.min(axis=0), self.spacing)

    def mesh(self) -> Mesh:
        corners = np.array(self.vertices)
        return _cut(lambda p: _inside_polygon(p, corners), corners.min(axis=0), corners.max(axis=0), self.spacing)


@dataclass(frozen=True)
class Mapped(Shape):
    """Another shape with its nodes moved by a function of position; made by `rotated` and `mapped`."""

    shape: Shape
    function: Callable

    def __post_init__(self):
        instance("mapped.shape", self.shape, Shape, "a shape")
        instance("mapped.function", self.function, Callable, "a function of position")

    def mesh(self) -> Mesh:
        start = self.shape.mesh()
        nodes = field_of_position("mapped.function", self.function, start.nodes, start.dim)
        return _unfolded(start.with_nodes(nodes), "mapped.function", self.function)


@dataclass(frozen=True, eq=False)
class Placed(Shape):
    """Another shape with its nodes at given places: what a mapping has made, in a stored scene.

    Args:
        shape: the shape whose cells these are.
        nodes: positions [m], shape (n, d).
    """

    shape: Shape
    nodes: np.ndarray

    def __post_init__(self):
        instance("Placed.shape", self.shape, Shape, "a shape")

    def mesh(self) -> Mesh:
        start = self.shape.mesh()
        try:
            nodes = np.array(self.nodes, dtype=float)
        except (TypeError, ValueError):
            nodes = np.empty(0)
        if nodes.shape != start.nodes.shape or not np.isfinite(nodes).all():
            raise SceneError("Placed.nodes", self.nodes, f"it must be finite numbers of shape {start.nodes.shape}")
        return _unfolded(start.with_nodes(nodes), "Placed.nodes", self.nodes)


def _unfolded(mesh: Mesh, field: str, value: object) -> Mesh:
    if mesh.cell_volumes().min() <= 0.0:
        raise SceneError(field, value, "it must keep every cell's volume positive (no folds)")
    return mesh


LARGEST_LATTICE = 10**9


def _limit_cells(size, spacing: float) -> None:
    cells = math.prod(max(1.0, float(length) / spacing) for length in size)
    if not cells < LARGEST_LATTICE:
        raise SceneError(
            "spacing", spacing, f"it must give fewer than {LARGEST_LATTICE:.0e} cells, here {cells:.3g}"
        )


def _cut(inside: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, spacing: float) -> Mesh:
    """Lattice of the cells of a grid over the box (low, high) whose centres are inside."""
    cells = np.maximum(1, np.ceil((high - low) / spacing - 1e-9).astype(int))
    axes = [low[k] + spacing * (np.arange(cells[k]) + 0.5) for k in range(len(low))]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return grid_lattice(inside(centres), spacing, low, spacing * cells)


def _inside_polygon(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Even-odd rule: a point is inside when a ray in +x crosses the outline an odd number of times."""
    x, y = points[..., 0], points[..., 1]
    inside = np.zeros(x.shape, dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        crosses = (y0 > y) != (y1 > y)
        inside ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return inside
