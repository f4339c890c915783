"""Whether points and cells from anywhere make a body: each check names the first thing that is wrong.

Cells must have volume, corners that differ, and lie side by side: a face is between two cells or on the boundary.
The body is in one piece, hangs together by faces wherever it hangs together, and does not lie on itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from ..errors import SceneError
from .components import components
from .faces import match_faces, row_keys
from .kinds import CellKind
from .mesh import Mesh
from .overlap import TOUCHING, hanging, overlap

FLAT = 1e-9  # a cell is flat whose Jacobian at a corner, over its longest edge to the d, is less
ASLANT = (1.0, 2.0**0.5, 3.0**0.5)  # a direction in which the nodes of a lattice have places of their own


def check_corners(cells: np.ndarray, points: int) -> None:
    """Refuse cells (m, c) with corners that are no points, that repeat a corner, or that stand twice."""
    wrong = ((cells < 0) | (cells >= points)).any(axis=1)
    _refuse(cells, wrong, f"its corners must be numbers of points, at least 0 and below {points}")
    corners = np.sort(cells, axis=1)
    _refuse(cells, (np.diff(corners, axis=1) == 0).any(axis=1), "its corners must differ")
    found, first, back = np.unique(row_keys(corners), return_index=True, return_inverse=True)
    if len(found) < len(cells):
        again = int((first[back] != np.arange(len(cells))).argmax())
        raise _wrong_cell(cells, again, f"cells[{first[back[again]]}] has the same corners")
    unused = np.bincount(cells.ravel(), minlength=points) == 0
    if unused.any():
        raise SceneError("points", int(unused.argmax()), "it is the corner of no cell; leave such points out")


def check_places(points: np.ndarray, spacing: float) -> None:
    """Refuse two points (n, d) in one place; points nearer than `TOUCHING` spacings [m] are."""
    direction = np.array(ASLANT[: points.shape[1]])
    along = points @ direction
    order, reach = np.argsort(along, kind="stable"), TOUCHING * spacing * np.linalg.norm(direction)
    for step in count(1):
        near = np.flatnonzero(along[order[step:]] - along[order[:-step]] <= reach)
        a, b = order[near], order[near + step]
        same = np.flatnonzero(np.linalg.norm(points[a] - points[b], axis=1) <= TOUCHING * spacing)
        if len(same):
            first, second = sorted((int(a[same[0]]), int(b[same[0]])))
            value = tuple(points[second].tolist())
            raise SceneError(f"points[{second}]", value, f"points[{first}] is in the same place; a place has one")
        if not len(near):
            return


def positive(nodes: np.ndarray, cells: np.ndarray, kind: CellKind) -> np.ndarray:
    """The cells, those that count their corners the other way round mirrored.

    Raises:
        SceneError: a cell is flat or folded.
    """
    mesh = _bare(nodes, cells)
    longest = np.max(
        [np.linalg.norm(nodes[cells[:, b]] - nodes[cells[:, a]], axis=1) for a, b in kind.edges], axis=0
    )
    size = mesh.corner_volumes() / longest[:, None] ** kind.dim
    backward = (size < -FLAT).all(axis=1)
    wrong = ~(backward | (size > FLAT).all(axis=1))
    around = "" if not kind.grid or kind.dim == 1 else "; corners go round it, in the order of VTK"
    given = cells[:, kind.drawn]
    _refuse(given, wrong, f"it is flat or folded: a {kind.name} must have a volume at each corner{around}")
    return np.where(backward[:, None], cells[:, kind.mirrored], cells)


def check_faces(mesh: Mesh) -> None:
    """Refuse faces of three cells, cells on one another, and bodies in pieces or held by a point or an edge."""
    kind, cells = mesh.kind, mesh.cells
    given, match = cells[:, kind.drawn], match_faces(cells, kind)
    if len(match.crowded):
        *others, last = np.sort(match.crowded // len(kind.faces)).tolist()
        allowed = f"one of its faces belongs to cells {_listed(others)} as well; a face has two cells at most"
        raise _wrong_cell(given, last, allowed)
    owner, face = np.divmod(match.shared, len(kind.faces))
    _check_sides(mesh, owner, face, given)
    stray = hanging(mesh)
    if stray is not None:
        node, corners = stray
        allowed = f"it must not lie on a face whose corner it is not, of points {_listed(corners.tolist())}"
        raise SceneError(f"points[{node}]", tuple(mesh.nodes[node].tolist()), allowed)
    first_of_part = components(len(cells), *owner.T)
    _refuse(given, first_of_part != 0, "no faces join it to cells[0]; a body is in one piece")
    if kind.dim > 1:
        _check_joints(mesh, owner, face, [(corner,) for corner in range(kind.corners)])
    if kind.dim > 2:
        _check_joints(mesh, owner, face, kind.edges)
    place = overlap(mesh)
    if place is not None:
        at = ", ".join(f"{x:.4g}" for x in place)
        raise SceneError("cells", given, f"the body must not lie on itself, as it does at ({at})")


def _check_sides(mesh: Mesh, owner: np.ndarray, face: np.ndarray, given: np.ndarray) -> None:
    """Refuse two cells on the same side of the face between them.

    Args:
        mesh: the mesh.
        owner: the two cells of each face between cells, shape (s, 2).
        face: which of their faces it is, shape (s, 2).
        given: the corners of each cell as the user gave them, shape (m, c).
    """
    between = np.take_along_axis(mesh.cells[owner[:, 0]], np.array(mesh.kind.faces)[face[:, 0]], axis=1)
    normals = replace(mesh, faces=between, face_cell=owner[:, 0]).face_normals()
    to_other = mesh.nodes[mesh.cells[owner[:, 1]]].mean(axis=1) - mesh.nodes[between].mean(axis=1)
    same = np.flatnonzero(np.sum(normals * to_other, axis=1) <= 0.0)
    if len(same):
        first, second = np.sort(owner[same[0]]).tolist()
        raise _wrong_cell(given, second, f"it lies on cells[{first}], on the same side of the face they share")


def _check_joints(mesh: Mesh, owner: np.ndarray, face: np.ndarray, joints: Sequence[Sequence[int]]) -> None:
    """Refuse joints, nodes or edges, around which not all cells are linked by faces that hold the joint as well.

    Args:
        mesh, owner, face: as those of `_check_sides`.
        joints: corners of each joint of a cell, all of the same number.
    """
    nodes = np.sort(mesh.cells[:, np.array(joints)], axis=2)
    key = row_keys(nodes.reshape(-1, nodes.shape[2]))
    in_face = np.array([[j for j, own in enumerate(joints) if set(own) <= set(f)] for f in mesh.kind.faces])
    both = []
    for cell, which in zip(owner.T, face.T, strict=True):
        places = cell[:, None] * len(joints) + in_face[which]
        both.append(np.take_along_axis(places, np.argsort(key[places], axis=1), axis=1).ravel())
    root = components(len(key), *both)
    _, first, back = np.unique(key, return_index=True, return_inverse=True)
    apart = np.flatnonzero(root != root[first[back]])
    if len(apart):
        joint = nodes.reshape(-1, nodes.shape[2])[apart[0]].tolist()
        places = mesh.nodes[joint if len(joint) > 1 else joint[0]].tolist()
        allowed = "cells meet in it that no face there joins; a body has no hinges"
        raise SceneError(f"points[{_listed(joint)}]", places, allowed)


def _bare(nodes: np.ndarray, cells: np.ndarray) -> Mesh:
    """A mesh of which only nodes and cells are known."""
    none = np.empty(0, dtype=int)
    return Mesh(spacing=1.0, nodes=nodes, cells=cells, faces=none, face_cell=none, face_side=none)


def _refuse(cells: np.ndarray, wrong: np.ndarray, allowed: str) -> None:
    if wrong.any():
        raise _wrong_cell(cells, int(wrong.argmax()), allowed)


def _wrong_cell(cells: np.ndarray, cell: int, allowed: str) -> SceneError:
    return SceneError(f"cells[{cell}]", tuple(cells[cell].tolist()), allowed)


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers))
