"""A body whose nodes and cells the user gives: from a mesh generator, or from a program of his own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..errors import SceneError
from ..mesh.faces import mesh_of_cells, row_keys
from ..mesh.mesh import Mesh, Tag, kind_of
from ..mesh.wholeness import check_corners, check_faces, check_places, positive
from .shape import Shape


@dataclass(frozen=True, eq=False)
class GivenMesh(Shape):
    """A body of given cells: segments, triangles, quads, tetrahedra or hexahedra, all of one kind.

    Its kind follows from the numbers of coordinates a point and of corners a cell. Its boundary are the faces that
    belong to one cell alone; an edge of that name, `edge("left")`, holds the faces that lie on that side of the
    box around the points.

    Args:
        points: places of the nodes [m], shape (n, d), d = 1, 2 or 3; each a corner of some cell.
        cells: numbers of each cell's corners, counted from 0, shape (m, c), in the order of VTK: around a triangle
            or a quad; a tetrahedron's in any order; around a face of a hexahedron, then likewise around the one
            opposite. It does not matter which way round.
        tags: names for parts of it, for `tag(name)`: numbers of nodes, shape (k,), or the corners of boundary
            faces, each in any order, shape (k, corners a face).

    Raises:
        SceneError: the cells are no body in one piece, or a tag holds what there is not.

    >>> from warpsph import GivenMesh
    >>> mesh = GivenMesh(
    ...     points=[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
    ...     cells=[(0, 1, 2), (0, 2, 3)],
    ...     tags={"base": [(0, 1)]},
    ... ).mesh()
    >>> mesh.kind.name, mesh.tags["base"].nodes
    ('triangle', array([0, 1]))
    """

    points: np.ndarray
    cells: np.ndarray
    tags: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self):
        object.__setattr__(self, "points", _points(self.points))
        object.__setattr__(self, "cells", _cells(self.cells))
        if not isinstance(self.tags, Mapping):
            raise SceneError("tags", self.tags, "it must be a mapping from names to numbers of nodes or to faces")
        object.__setattr__(self, "tags", {name: _numbers(name, given) for name, given in self.tags.items()})
        _ = self._mesh

    def mesh(self) -> Mesh:
        return self._mesh

    @cached_property
    def _mesh(self) -> Mesh:
        points, given = self.points, self.cells
        kind = kind_of(points.shape[1], given.shape[1])
        check_corners(given, len(points))
        cells = np.empty_like(given)
        cells[:, kind.drawn] = given
        edges = [points[cells[:, b]] - points[cells[:, a]] for a, b in kind.edges]
        spacing = float(np.linalg.norm(edges, axis=2).mean())
        check_places(points, spacing)
        mesh = mesh_of_cells(points, positive(points, cells, kind), spacing)
        check_faces(mesh)
        return replace(mesh, tags={name: _tag(name, given, mesh) for name, given in self.tags.items()})


def _points(given: object) -> np.ndarray:
    """Points as the shape keeps them: a copy, float64."""
    try:
        points = np.array(given)
    except ValueError:  # rows of different lengths
        points = np.empty(0)
    if points.dtype.kind not in "iuf" or points.ndim != 2 or points.shape[1] not in (1, 2, 3):
        raise SceneError("points", given, "it must be numbers [m] of shape (n, 1), (n, 2) or (n, 3)")
    wrong = ~np.isfinite(points).all(axis=1)
    if wrong.any():
        raise SceneError(f"points[{wrong.argmax()}]", tuple(points[wrong.argmax()].tolist()), "it must be finite")
    return points.astype(float)


def _cells(given: object) -> np.ndarray:
    cells = _whole(given)
    if cells is None or cells.ndim != 2 or not len(cells):
        raise SceneError("cells", given, "it must be whole numbers of shape (m, c), c corners of one cell or more")
    return cells


def _numbers(name: object, given: object) -> np.ndarray:
    """What a tag holds, as the shape keeps it: numbers of nodes (k,), or of the corners of faces (k, c)."""
    if not isinstance(name, str) or not name:
        raise SceneError("tags", name, "a name must be a text")
    numbers = _whole(given)
    if numbers is None or numbers.ndim not in (1, 2) or not numbers.size:
        allowed = "it must be numbers of nodes, or lists of the corners of faces, one or more"
        raise SceneError(f"tags[{name!r}]", given, allowed)
    return numbers


def _whole(given: object) -> np.ndarray | None:
    """A copy of whole numbers as int64; None of anything else."""
    try:
        numbers = np.array(given)
    except ValueError:  # rows of different lengths
        return None
    return numbers.astype(np.int64) if numbers.dtype.kind in "iu" else None


def _tag(name: str, given: np.ndarray, mesh: Mesh) -> Tag:
    """The nodes and the boundary faces of a tag: of nodes, those faces that it holds wholly."""
    wrong = given[(given < 0) | (given >= len(mesh.nodes))]
    if len(wrong):
        allowed = f"it must be a number of a point, at least 0 and below {len(mesh.nodes)}"
        raise SceneError(f"tags[{name!r}]", int(wrong[0]), allowed)
    nodes = np.unique(given)
    if given.ndim == 1:
        return Tag(nodes, np.flatnonzero(np.isin(mesh.faces, nodes).all(axis=1)))
    corners = mesh.faces.shape[1]
    if given.shape[1] != corners:
        allowed = f"a face of a {mesh.kind.name} has {corners} corner(s)"
        raise SceneError(f"tags[{name!r}]", tuple(given[0].tolist()), allowed)
    keys = row_keys(np.sort(np.concatenate([mesh.faces, given]), axis=1))
    own, asked = keys[: len(mesh.faces)], keys[len(mesh.faces) :]
    inner = ~np.isin(asked, own)
    if inner.any():
        allowed = "it must be a face of the boundary"
        raise SceneError(f"tags[{name!r}]", tuple(given[inner.argmax()].tolist()), allowed)
    return Tag(nodes, np.flatnonzero(np.isin(own, asked)))
