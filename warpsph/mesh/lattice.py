"""Meshes of the cells of a regular grid, whole or cut into simplices."""

from __future__ import annotations

import numpy as np

from ..errors import SceneError
from .faces import mesh_of_cells
from .kinds import GRID_KINDS
from .mesh import NO_SIDE, Mesh

# How cuts lie: the corner in which those of each cell begin, by the cell's place in the grid.
DIAGONALS = {
    "rising": lambda index: np.zeros_like(index),
    "falling": lambda index: np.tile(np.eye(index.shape[1], dtype=int)[0], (len(index), 1)),
    "alternating": lambda index: index % 2,
}


def hinges(kept: np.ndarray) -> np.ndarray:
    """Points of a plane grid at which two kept cells meet that share no side, indices (k, 2)."""
    a, b, c, d = kept[:-1, :-1], kept[:-1, 1:], kept[1:, :-1], kept[1:, 1:]
    return np.argwhere((a == d) & (b == c) & (a != b)) + 1


def parts(kept: np.ndarray) -> int:
    """Number of parts that the kept cells of a plane grid make, by the sides they share.

    Runs of cells along the second axis are joined, each to those beside it, in trees with a root a part.
    """
    column, change = np.nonzero(np.diff(np.pad(kept, ((0, 0), (1, 1))).astype(np.int8), axis=1))
    column, first, end = column[::2], change[::2], change[1::2]
    root = list(range(len(column)))

    def find(run: int) -> int:
        while root[run] != run:
            root[run] = run = root[root[run]]
        return run

    starts = np.searchsorted(column, np.arange(len(kept) + 1))
    for run, (x, low, high) in enumerate(zip(column.tolist(), first.tolist(), end.tolist(), strict=True)):
        begin, stop = starts[max(x - 1, 0)], starts[x]
        for other in range(begin + np.searchsorted(end[begin:stop], low, "right"), stop):
            if first[other] >= high:
                break
            root[find(run)] = find(other)
    return sum(root[run] == run for run in range(len(root)))


def grid_lattice(
    kept: np.ndarray, *, spacing: float, origin: np.ndarray, size: np.ndarray, diagonals: str | None = None
) -> Mesh:
    """The mesh made of the cells of a regular grid that are kept.

    Args:
        kept: which cells belong to the body, boolean, one axis a dimension.
        spacing: Δx [m].
        origin: low corner of the grid [m], shape (d,).
        size: extent of the grid along each axis [m], shape (d,); gives coordinates without round-off drift.
        diagonals: one of `DIAGONALS` to cut the cells into triangles or tetrahedra along; None leaves them whole.
    """
    dim = kept.ndim
    if not kept.any():
        raise SceneError("shape", "no cell", "at least one whole cell of the lattice must lie inside the shape")
    index = np.argwhere(kept)
    kind = GRID_KINDS[dim]
    offsets = np.array(kind.points, dtype=int)
    points = np.array(kept.shape) + 1
    corner = np.ravel_multi_index(tuple(np.moveaxis(index[:, None, :] + offsets[None], 2, 0)), tuple(points))
    used, cells = np.unique(corner, return_inverse=True)
    cells = cells.reshape(corner.shape)
    coordinates = np.stack(np.unravel_index(used, tuple(points)), axis=1)
    nodes = origin + size * (coordinates / np.array(kept.shape))

    if diagonals is not None:
        return mesh_of_cells(nodes, _cut(cells, DIAGONALS[diagonals](index)), spacing)

    padded = np.pad(kept, 1)
    faces, face_cell, face_side = [], [], []
    for axis in range(dim):
        for high in (0, 1):
            neighbour = index + 1
            neighbour[:, axis] += 1 if high else -1
            bare = np.flatnonzero(~padded[tuple(neighbour.T)])
            side = 2 * axis + high
            place = index[:, axis]
            faces.append(cells[bare][:, kind.faces[side]])
            face_cell.append(bare)
            face_side.append(np.where(place[bare] == (place.max() if high else place.min()), side, NO_SIDE))
    return Mesh(
        spacing=spacing,
        nodes=nodes,
        cells=cells,
        faces=np.concatenate(faces),
        face_cell=np.concatenate(face_cell),
        face_side=np.concatenate(face_side),
    )


def _cut(cells: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """The simplices that a grid's cells are cut into, those of a cell one after the other, shape (d! m, d + 1).

    Args:
        cells: node indices of the grid's cells, shape (m, 2ᵈ).
        starts: of each cell the corner where its simplices begin, 0 or 1 along each axis, shape (m, d).
    """
    dim = starts.shape[1]
    kind = GRID_KINDS[dim]
    corners = np.array([kind.simplices(point) for point in kind.points]).reshape(len(kind.points), -1)
    which = (starts[:, None] == np.array(kind.points)).all(axis=2).argmax(axis=1)
    return np.take_along_axis(cells, corners[which], axis=1).reshape(-1, dim + 1)
