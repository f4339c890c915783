"""Meshes of the cells of a regular grid."""

from __future__ import annotations

import numpy as np

from ..errors import SceneError
from .kinds import GRID_KINDS
from .mesh import NO_SIDE, Mesh


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


def grid_lattice(kept: np.ndarray, spacing: float, origin: np.ndarray, size: np.ndarray) -> Mesh:
    """The mesh made of the cells of a regular grid that are kept.

    Args:
        kept: which cells belong to the body, boolean, one axis a dimension.
        spacing: Δx [m].
        origin: low corner of the grid [m], shape (d,).
        size: extent of the grid along each axis [m], shape (d,); gives coordinates without round-off drift.
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
