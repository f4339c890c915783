"""The faces of a mesh, found from its cells: which two cells share one, and which belong to one cell alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .kinds import KINDS, CellKind
from .mesh import NO_SIDE, Mesh

ON_SIDE = 1e-6  # spacings: faces nearer than this to a side of the box around a body lie on it


def mesh_of_cells(nodes: np.ndarray, cells: np.ndarray, spacing: float) -> Mesh:
    """The mesh of given cells: its boundary is made of the faces that belong to one cell alone.

    Args:
        nodes: positions [m], shape (n, d).
        cells: node indices in the order of their kind's corners, shape (m, c).
        spacing: a cell's size [m].
    """
    kind = KINDS[nodes.shape[1], cells.shape[1]]
    face_cell, face = np.divmod(match_faces(cells, kind).alone, len(kind.faces))
    faces = np.take_along_axis(cells[face_cell], np.array(kind.faces)[face], axis=1)
    return Mesh(
        spacing=spacing,
        nodes=nodes,
        cells=cells,
        faces=faces,
        face_cell=face_cell,
        face_side=sides_of_box(nodes, faces, spacing),
    )


@dataclass(frozen=True)
class FaceMatch:
    """Faces by their places: place p is face p mod k of cell p div k, in the order of the kind's k faces.

    Attributes:
        alone: places of the faces that one cell has for itself, rising, shape (f,).
        shared: places of the two that each face between two cells has, shape (s, 2).
        crowded: the places of one face that three cells or more have, empty unless there is one.
    """

    alone: np.ndarray
    shared: np.ndarray
    crowded: np.ndarray


def match_faces(cells: np.ndarray, kind: CellKind) -> FaceMatch:
    """Match the faces of cells (m, c) by their corners, whatever their order."""
    key = row_keys(np.sort(cells[:, np.array(kind.faces)].reshape(-1, len(kind.faces[0])), axis=1))
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    count = np.diff(first, append=len(order))
    twice, more = first[count == 2], np.flatnonzero(count > 2)
    crowd = slice(first[more[0]], first[more[0]] + count[more[0]]) if len(more) else slice(0, 0)
    return FaceMatch(
        alone=np.sort(order[first[count == 1]]),
        shared=np.stack([order[twice], order[twice + 1]], axis=1),
        crowded=order[crowd],
    )


def row_keys(rows: np.ndarray) -> np.ndarray:
    """A whole number ≥ 0 for each row (r, k) of numbers ≥ 0, equal where rows are equal, shape (r,)."""
    size = int(rows.max(initial=0)) + 1
    key, bound = rows[:, 0].astype(np.int64), size
    for column in rows.T[1:]:
        if bound * size >= 2**63:  # renumbered, so that no product is too large
            key, bound = np.unique(key, return_inverse=True)[1], len(rows)
        key, bound = key * size + column, bound * size
    return key


def sides_of_box(nodes: np.ndarray, faces: np.ndarray, spacing: float) -> np.ndarray:
    """Which side of the box around the nodes each face lies on, 2·axis or 2·axis + 1, or `NO_SIDE`, shape (f,).

    Args:
        nodes: positions [m], shape (n, d).
        faces: node indices of each face, shape (f, k).
        spacing: a cell's size [m].
    """
    side = np.full(len(faces), NO_SIDE)
    for axis, places in enumerate(nodes.T):
        for high, wall in enumerate((places.min(), places.max())):
            on = np.abs(places - wall) <= ON_SIDE * spacing
            side[on[faces].all(axis=1)] = 2 * axis + high
    return side
