"""Shapes a user can write: each makes the initial lattice of a body."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh import outline
from ..mesh.lattice import DIAGONALS, grid_lattice, hinges, parts
from ..mesh.mesh import Mesh
from ..mesh.overlap import overlap
from ..validate import choice, field_of_position, instance, number, vector


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
        cells: `lattice` (segments, squares or cubes), or what those are cut into: `triangles` of a rectangle,
            `tetrahedra` of a cuboid, two a square and six a cube.
        diagonals: how the cuts lie: `rising` from each cell's low corner to its high one, `falling` the same
            mirrored left to right, or `alternating`, mirrored from cell to cell. Alternating in the plane unless
            given; rising in space, where every inner node then has 24 tetrahedra, and not 16 or 48.

    >>> Box(size=(2.0, 1.0), spacing=0.5).mesh().nodes.shape
    (15, 2)
    >>> Box(size=(2.0, 1.0), spacing=0.5, cells="triangles").mesh().cells.shape
    (16, 3)
    """

    size: tuple[float, ...]
    spacing: float
    origin: tuple[float, ...] | None = None
    cells: str = "lattice"
    diagonals: str | None = None

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
        _diagonals(self, len(size))

    def mesh(self) -> Mesh:
        size = np.array(self.size)
        kept = np.ones(np.rint(size / self.spacing).astype(int), dtype=bool)
        origin, diagonals = np.array(self.origin), _diagonals(self, len(size))
        return grid_lattice(kept, spacing=self.spacing, origin=origin, size=size, diagonals=diagonals)


@dataclass(frozen=True)
class Disc(Shape):
    """A disc cut out of a square lattice: the cells whose middle lies inside the circle, not on it.

    Its edge is a staircase. For edge nodes on a curve, map a box (see `Shape.mapped`). The lattice stands in the
    disc's middle.

    Args:
        radius: radius [m].
        spacing: Δx [m].
        centre: centre [m].
        cells, diagonals: as those of a `Box`.

    >>> len(Disc(radius=1.0, spacing=0.5).mesh().cells)
    12
    """

    radius: float
    spacing: float
    centre: tuple[float, float] = (0.0, 0.0)
    cells: str = "lattice"
    diagonals: str | None = None

    def __post_init__(self):
        object.__setattr__(self, "radius", number("radius", self.radius, above=0.0))
        object.__setattr__(self, "spacing", number("spacing", self.spacing, above=0.0, at_most=self.radius))
        object.__setattr__(self, "centre", vector("centre", self.centre, 2))
        _limit_cells((2 * self.radius,) * 2, self.spacing)
        _diagonals(self, 2)

    def mesh(self) -> Mesh:
        centre, reach = np.array(self.centre), self.radius - SLACK * self.spacing
        cells = np.full(2, math.ceil(2.0 * self.radius / self.spacing - SLACK))
        return _cut(
            lambda p: np.hypot(*np.moveaxis(p - centre, -1, 0)) < reach,
            low=centre - 0.5 * self.spacing * cells,
            cells=cells,
            spacing=self.spacing,
            area=math.pi * self.radius**2,
            diagonals=_diagonals(self, 2),
        )


@dataclass(frozen=True)
class Polygon(Shape):
    """A polygon cut out of a square lattice: the cells whose middle lies inside it, not on its outline.

    Sides along the axes lie on lattice lines, other sides become staircases. Along an axis that no side stands
    across, the lattice is in the polygon's middle. A mirrored polygon gives the mirrored body.

    Args:
        vertices: corners in order, either way round [m]: three or more (x, y) pairs.
        spacing: Δx [m]; sides along the axes lie whole numbers of spacings apart.
        cells, diagonals: as those of a `Box`.

    >>> Polygon([(0, 0), (2, 0), (0, 2)], spacing=0.25).mesh().cells.shape
    (28, 4)
    """

    vertices: tuple[tuple[float, float], ...]
    spacing: float
    cells: str = "lattice"
    diagonals: str | None = None

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
        for vertex, following in zip(vertices, (*vertices[1:], vertices[0]), strict=True):
            if vertex == following:
                raise SceneError("vertices", self.vertices, f"neighbours must differ, and {vertex} stands twice")
        meeting = outline.meeting_sides(corners)
        if meeting:
            first, second = (f"{vertices[k]} to {vertices[(k + 1) % len(vertices)]}" for k in meeting)
            allowed = (
                f"its sides may meet in the corner they share only; those from {first} and from {second} do more"
            )
            raise SceneError("vertices", self.vertices, allowed)
        for axis in (0, 1):
            _grid_line(corners[:, axis], "xy"[axis], self.spacing)
        _diagonals(self, 2)

    def mesh(self) -> Mesh:
        corners = np.array(self.vertices)
        low, cells = zip(*(_grid_line(corners[:, axis], "xy"[axis], self.spacing) for axis in (0, 1)), strict=True)
        return _cut(
            lambda p: outline.inside(p, corners, SLACK * self.spacing),
            low=np.array(low),
            cells=np.array(cells),
            spacing=self.spacing,
            area=outline.area(corners),
            diagonals=_diagonals(self, 2),
        )


def _grid_line(places: np.ndarray, axis: str, spacing: float) -> tuple[float, int]:
    """Where the lattice of a polygon begins along an axis [m], and its number of cells there.

    Args:
        places: coordinate of each corner along the axis [m].
        axis: its name.
        spacing: Δx [m].
    """
    walls = np.unique(places[np.abs(places - np.roll(places, -1)) <= SLACK * spacing])
    low, high = places.min(), places.max()
    if not len(walls):
        cells = math.ceil((high - low) / spacing - SLACK)
        over = cells * spacing - (high - low)
        return low - 0.5 * over if over > SLACK * spacing else low, cells
    for wall in walls[1:]:
        apart = wall - walls[0]
        cells = round(apart / spacing)
        if apart <= SLACK * min(spacing, high - low):
            continue  # the same wall but for rounding
        if cells < 1 or abs(apart / spacing - cells) > SLACK * cells:
            allowed = (
                f"the sides at {axis} = {walls[0]:g} and {wall:g} m must be a whole number of spacings apart, "
                f"for example {apart / max(1, cells):.6g}"
            )
            raise SceneError("spacing", spacing, allowed)
    below, above = (math.ceil(length / spacing - SLACK) for length in (walls[0] - low, high - walls[0]))
    return walls[0] - below * spacing if below else walls[0], below + above


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
    if mesh.corner_volumes().min() <= 0.0:
        raise SceneError(field, value, "it must keep every cell's volume positive, at each corner (no folds)")
    place = overlap(mesh)
    if place is not None:
        at = ", ".join(f"{x:.4g}" for x in place)
        raise SceneError(field, value, f"it must not lay the body on itself, as it does at ({at})")
    return mesh


SIMPLICES = {1: (), 2: ("triangles",), 3: ("tetrahedra",)}  # by dimension, what a lattice's cells are cut into
LARGEST_LATTICE = 10**9
SLACK = 1e-6  # spacings: nearer to a line than this is on it
LARGEST_AREA_ERROR = 0.2  # of a shape cut out of a lattice, which then has too few cells to look like it


def _limit_cells(size, spacing: float) -> None:
    cells = math.prod(max(1.0, float(length) / spacing) for length in size)
    if not cells < LARGEST_LATTICE:
        raise SceneError(
            "spacing", spacing, f"it must give fewer than {LARGEST_LATTICE:.0e} cells, here {cells:.3g}"
        )


def _diagonals(shape: Box | Disc | Polygon, dim: int) -> str | None:
    """How the cells of a lattice of so many dimensions are cut; None where they stay whole.

    Raises:
        SceneError: `cells` or `diagonals` says what there is not.
    """
    if choice("cells", shape.cells, ("lattice", *SIMPLICES[dim])) == "lattice":
        if shape.diagonals is not None:
            allowed = "a lattice has none; triangles and tetrahedra have them"
            raise SceneError("diagonals", shape.diagonals, allowed)
        return None
    if shape.diagonals is None:
        return "alternating" if dim == 2 else "rising"
    return choice("diagonals", shape.diagonals, DIAGONALS)


def _cut(
    inside: Callable[[np.ndarray], np.ndarray],
    *,
    low: np.ndarray,
    cells: np.ndarray,
    spacing: float,
    area: float,
    diagonals: str | None,
) -> Mesh:
    """Mesh of the cells of a plane grid whose middles are inside a figure.

    Args:
        inside: which of some points (…, 2) are inside.
        low: low corner of the grid [m].
        cells: number of cells along each axis.
        spacing: Δx [m].
        area: of the figure [m²].
        diagonals: how the cells are cut; None leaves them whole.
    """
    axes = [start + spacing * (np.arange(count) + 0.5) for start, count in zip(low, cells, strict=True)]
    kept = inside(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
    covered = spacing**2 * np.count_nonzero(kept)
    if abs(covered - area) > (LARGEST_AREA_ERROR + SLACK) * area:  # rounding does not decide
        allowed = f"it must be finer: the cells have {covered:.4g} m² in all, the shape {area:.4g} m²"
        raise SceneError("spacing", spacing, allowed)
    for x, y in low + spacing * hinges(kept):
        allowed = (
            f"near ({x:.4g}, {y:.4g}) the shape is so thin or sharp that two cells share a corner and no side"
        )
        raise SceneError("spacing", spacing, allowed)
    if parts(kept) > 1:
        raise SceneError("spacing", spacing, "it must be finer: the shape is so thin that its cells fall apart")
    return grid_lattice(kept, spacing=spacing, origin=low, size=spacing * cells, diagonals=diagonals)
