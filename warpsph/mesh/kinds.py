"""The kinds of cell, as data: the one file that knows the order of a cell's corners.

Corners are numbered by their reference coordinates ξ in [0, 1]ᵈ. Those of a segment, a quad and a hexahedron are
the bits of their number, the last axis varying fastest, as a grid has them; those of a triangle and a tetrahedron
are the origin and the ends of the axes.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

Corners = tuple[int, ...]


@dataclass(frozen=True)
class CellKind:
    """A kind of cell.

    Attributes:
        name: what it is called.
        points: reference coordinates of each corner, shape (c, d).
        volume: of the reference cell [-]; times the Jacobian in the middle it is a cell's.
        gradients: ∂N_k/∂ξ_a in the middle, shape (c, d): ∂f/∂ξ_a = Σ_k f_k ∂N_k/∂ξ_a.
        modes: the axes along which each hourglass mode alternates; a simplex has none.
        faces: corners of each face, in the order of the face's own kind; on a grid the low and the high side of
            each axis in turn.
        edges: pairs of corners.
        spans: two pairs of corners; the cross product of the vectors between them is twice the area of a face.
        vtk: VTK's number of the kind.
        drawn: corners in the order of plots, USD and VTK: counterclockwise around a plane cell.
        face_kind: the kind of its faces; None where they are points.
    """

    name: str
    points: tuple[tuple[float, ...], ...]
    volume: float
    gradients: tuple[tuple[float, ...], ...]
    faces: tuple[Corners, ...]
    edges: tuple[tuple[int, int], ...]
    vtk: int
    drawn: Corners
    spans: tuple[tuple[int, int], ...] = ()
    modes: tuple[tuple[int, ...], ...] = ()
    face_kind: CellKind | None = field(default=None, repr=False)

    @property
    def dim(self) -> int:
        """Number of dimensions d."""
        return len(self.points[0])

    @property
    def corners(self) -> int:
        """Number of corners c."""
        return len(self.points)

    @property
    def grid(self) -> bool:
        """Whether it is a cell of a grid, whose faces come in pairs, a low and a high one along each axis."""
        return len(self.faces) == 2 * self.dim

    @cached_property
    def sides(self) -> np.ndarray:
        """2ξ − 1 of each corner, on a grid ±1, shape (c, d)."""
        return 2.0 * np.array(self.points) - 1.0

    @cached_property
    def signs(self) -> np.ndarray:
        """±1 of each corner in each hourglass mode, shape (c, modes)."""
        return np.array([[side[list(axes)].prod() for axes in self.modes] for side in self.sides])

    @cached_property
    def regular(self) -> np.ndarray:
        """∂x/∂ξ of a regular cell with edges of length 1, a column an axis, shape (d, d)."""
        return np.eye(self.dim) if self.grid else np.linalg.cholesky(0.5 * (1.0 + np.eye(self.dim))).T

    def slopes(self, place: Sequence[float]) -> np.ndarray:
        """∂N_k/∂ξ_a at a place ξ of the reference cell, shape (c, d)."""
        if not self.grid:
            return np.array(self.gradients)
        points = np.array(self.points)
        parts = np.where(points == 1.0, place, 1.0 - np.asarray(place))
        others = [np.delete(parts, axis, axis=1).prod(axis=1) for axis in range(self.dim)]
        return self.sides * np.stack(others, axis=1)

    def shares(self, place: Sequence[float]) -> np.ndarray:
        """N_k at a place ξ of the reference cell, shape (c,): f = Σ_k N_k f_k, and Σ_k N_k = 1."""
        if not self.grid:
            return np.array([1.0 - sum(place), *place])
        points = np.array(self.points)
        return np.where(points == 1.0, place, 1.0 - np.asarray(place)).prod(axis=1)

    @cached_property
    def product_rule(self) -> tuple[tuple[float, np.ndarray, np.ndarray], ...]:
        """Weights, N_k and ∂N_k/∂ξ_a, shapes (c,) and (c, d), at points that integrate N_i N_j dA exactly."""
        if self.grid:
            line = (0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5)
            places = list(itertools.product(line, repeat=self.dim))
        else:
            near = (1.0 - (self.dim + 2.0) ** -0.5) / (self.dim + 1.0)  # exact for squares
            corners = np.array(self.points)
            places = (near + (1.0 - (self.dim + 1.0) * near) * corners).tolist()
        return tuple((self.volume / len(places), self.shares(place), self.slopes(place)) for place in places)

    @cached_property
    def mirrored(self) -> Corners:
        """The corners of the same cell counted the other way round, which turns the sign of its Jacobian."""
        if not self.grid:
            return (*range(self.dim - 1), self.dim, self.dim - 1)
        return tuple(self.points.index((*point[:-1], 1.0 - point[-1])) for point in self.points)

    def simplices(self, start: Sequence[int]) -> tuple[Corners, ...]:
        """The corners of the simplices that cut a grid's cell (Kuhn), d! of them, each counted the positive way.

        One for every order of the axes, along which it goes from one corner of the cell to the opposite one. Cells
        side by side match if they start in the same corner, or in one mirrored in the face between them.

        Args:
            start: reference coordinates of the corner where all begin, each 0 or 1, shape (d,).
        """
        found = []
        for order in itertools.permutations(range(self.dim)):
            path = [tuple(map(float, start))]
            for axis in order:
                path.append((*path[-1][:axis], 1.0 - path[-1][axis], *path[-1][axis + 1 :]))
            corners = tuple(self.points.index(point) for point in path)
            positive = np.linalg.det(np.diff(path, axis=0)) > 0.0
            mirrored = (*corners[:-2], corners[-1], corners[-2])
            found.append(corners if positive else mirrored)
        return tuple(found)


def _grid(name: str, dim: int, vtk: int, drawn: Corners, **more: object) -> CellKind:
    """A cell of a regular grid: a product of segments, whose middle gradient is the mean over its edges."""
    points = tuple(itertools.product((0.0, 1.0), repeat=dim))
    number = range(len(points))
    return CellKind(
        name=name,
        points=points,
        volume=1.0,
        gradients=tuple(tuple((2.0 * x - 1.0) / 2.0 ** (dim - 1) for x in point) for point in points),
        modes=tuple(axes for size in range(2, dim + 1) for axes in itertools.combinations(range(dim), size)),
        faces=tuple(tuple(k for k in number if points[k][a] == side) for a in range(dim) for side in (0.0, 1.0)),
        edges=tuple((k, k | 1 << bit) for k in number for bit in range(dim) if not k & 1 << bit),
        vtk=vtk,
        drawn=drawn,
        **more,
    )


def _simplex(name: str, dim: int, vtk: int, faces: tuple[Corners, ...], **more: object) -> CellKind:
    """A cell with one corner more than dimensions, in which every gradient is constant."""
    axes = np.eye(dim).tolist()
    return CellKind(
        name=name,
        points=((0.0,) * dim, *map(tuple, axes)),
        volume=1.0 / (2.0 if dim == 2 else 6.0),
        gradients=((-1.0,) * dim, *map(tuple, axes)),
        faces=faces,
        edges=tuple(itertools.combinations(range(dim + 1), 2)),
        vtk=vtk,
        drawn=tuple(range(dim + 1)),
        **more,
    )


SEGMENT = _grid("segment", 1, 3, (0, 1))
TRIANGLE = _simplex("triangle", 2, 5, ((0, 1), (1, 2), (2, 0)), spans=((0, 1), (0, 2)), face_kind=SEGMENT)
QUAD = _grid("quad", 2, 9, (0, 2, 3, 1), spans=((0, 3), (1, 2)), face_kind=SEGMENT)
TETRAHEDRON = _simplex("tetrahedron", 3, 10, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)), face_kind=TRIANGLE)
HEXAHEDRON = _grid("hexahedron", 3, 12, (0, 4, 6, 2, 1, 5, 7, 3), face_kind=QUAD)
KINDS = {(kind.dim, kind.corners): kind for kind in (SEGMENT, TRIANGLE, QUAD, TETRAHEDRON, HEXAHEDRON)}
GRID_KINDS = {kind.dim: kind for kind in (SEGMENT, QUAD, HEXAHEDRON)}
