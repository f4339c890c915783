"""Loads as forces on nodes: which boundary faces are loaded, and with what; and which loads contradict motions.

A face with the corners k loads its own nodes by f_k = ∫ N_k t dA, with t = Σ_j N_j t_j between the values at its
corners. So force and moment are those of the load, a constant stress is in equilibrium with its tractions on any
cells, and where two sides meet each loads the corner by its own faces. Loads on one face add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.kinds import CellKind
from ..mesh.mesh import Mesh
from ..validate import TimeFunction
from .condition import Condition
from .load import Load, Pressure

TOLERANCE = 1e-9


@dataclass(frozen=True)
class FaceLoads:
    """The loads on l faces; a face is there once for every load on it. They are in the order of their cells.

    Attributes:
        faces: node indices, shape (l, c).
        cell: the cell each face is of, shape (l,).
        corner: which corners of that cell its nodes are, shape (l, c).
        sign: 1 where `area_vectors` point outwards, −1 where they point inwards, shape (l,).
        values: traction vector and pressure [Pa] at its corners, shape (l, c, d + 1).
        follows: whether the present face counts and not the initial one, shape (l,).
        functions: the distinct functions of time.
        function: index into `functions`, shape (l,).
    """

    faces: np.ndarray
    cell: np.ndarray
    corner: np.ndarray
    sign: np.ndarray
    values: np.ndarray
    follows: np.ndarray
    functions: tuple[TimeFunction, ...]
    function: np.ndarray


def face_loads(mesh: Mesh, conditions: Sequence[Condition]) -> FaceLoads:
    """What conditions load faces with; none of it is looked at twice.

    Raises:
        SceneError: a load is on no whole boundary face, on one that another condition calls free, or along a
            direction in which another condition moves the face.
    """
    size, functions = mesh.faces.shape[1], []
    chosen = [np.zeros(0, dtype=np.int64)]
    values, follows, function = [np.zeros((0, size, mesh.dim + 1))], [np.zeros(0, bool)], [np.zeros(0, np.int32)]
    for index, condition in enumerate(conditions):
        for faces, at, scale, present in _terms(index, condition, mesh):
            if not callable(scale) and scale == 0.0:
                continue
            _refuse_contradiction(index, faces, at, mesh, conditions)
            if scale not in functions:
                functions.append(scale)
            chosen.append(faces)
            values.append(at)
            follows.append(np.full(len(faces), present))
            function.append(np.full(len(faces), functions.index(scale), np.int32))
    faces = np.concatenate(chosen)
    order = np.argsort(mesh.face_cell[faces], kind="stable")
    faces = faces[order]
    nodes, cell = mesh.faces[faces], mesh.face_cell[faces]
    outward = np.sum(area_vectors(mesh.nodes[nodes], mesh.kind) * mesh.face_normals()[faces], axis=1)
    return FaceLoads(
        faces=nodes,
        cell=cell,
        corner=(mesh.cells[cell][:, None, :] == nodes[:, :, None]).argmax(axis=2),
        sign=np.sign(outward),
        values=np.concatenate(values)[order],
        follows=np.concatenate(follows)[order],
        functions=tuple(functions),
        function=np.concatenate(function)[order],
    )


def surface_rule(kind: CellKind) -> tuple[tuple[float, np.ndarray, np.ndarray], ...]:
    """Weights, N_k and ∂N_k/∂ξ_a of a cell's faces, see `CellKind.product_rule`; of a point, one of each."""
    return ((1.0, np.ones(1), np.zeros((1, 0))),) if kind.face_kind is None else kind.face_kind.product_rule


def area_vectors(points: np.ndarray, kind: CellKind) -> np.ndarray:
    """∂x/∂ξ₁ × ∂x/∂ξ₂ in the middle of faces with corners (f, c, d), shape (f, d); see `surface_rule`."""
    slopes = sum(weight * slope for weight, _, slope in surface_rule(kind))
    along = np.einsum("fkd,ka->fad", points, slopes)
    if points.shape[2] == 1:
        return np.ones((len(points), 1))
    if points.shape[2] == 2:
        return np.stack([along[:, 0, 1], -along[:, 0, 0]], axis=1)
    return np.cross(along[:, 0], along[:, 1])


Term = tuple[np.ndarray, np.ndarray, TimeFunction, bool]


def _terms(index: int, condition: Condition, mesh: Mesh) -> list[Term]:
    """Faces (l,), values at their corners (l, c, d + 1), function of time, whether the present faces count."""
    if isinstance(condition, Load):
        condition.check_faces(f"conditions[{index}]", mesh)
        faces = np.flatnonzero(condition.faces(mesh))
        at = condition.values(mesh.nodes[mesh.faces[faces]].reshape(-1, mesh.dim))
        return [(faces, at.reshape(*mesh.faces[faces].shape, -1), condition.factor, condition.follows)]
    if type(condition).tractions is Condition.tractions:
        return []
    found, normals = [], mesh.face_normals()
    for face in np.flatnonzero(condition.faces(mesh)):
        for vectors, scale in condition.tractions(mesh.nodes[mesh.faces[face]], normals[face]):
            at = np.concatenate([vectors, np.zeros((len(vectors), 1))], axis=1)
            found.append((np.array([face]), at[None], scale, True))
    return found


def _refuse_contradiction(
    index: int, faces: np.ndarray, values: np.ndarray, mesh: Mesh, conditions: Sequence[Condition]
) -> None:
    """A load must not be along a direction in which one condition moves the face, nor on a face called free."""
    load, covered, normals = conditions[index], np.zeros(len(mesh.faces), dtype=bool), mesh.face_normals()
    covered[faces] = True
    for other, condition in enumerate(conditions):
        if other == index or isinstance(condition, Load):
            continue
        shared = np.flatnonzero(covered & condition.faces(mesh))
        if condition.unmoved:
            lost, reason = shared, "says that nothing is on them"
        else:
            place = np.searchsorted(faces, shared)
            lost = [
                face
                for face, at in zip(shared.tolist(), values[place], strict=True)
                if _taken_up(load, at, _held(condition, face, normals[face], mesh), normals[face])
            ]
            reason = "moves or holds them along the load"
        if len(lost):
            raise SceneError(
                f"conditions[{index}]",
                load,
                f"it shares {len(lost)} boundary face(s) with conditions[{other}] = {condition}, which {reason}",
            )


def _held(condition: Condition, face: int, normal: np.ndarray, mesh: Mesh) -> np.ndarray:
    """The projector onto the directions in which a condition moves a face."""
    given = getattr(condition, "normal", None)
    rows = condition.rows(mesh.nodes[mesh.faces[face]], normal if given is None else np.array(given))
    directions = np.array([vectors[0] for vectors, _ in rows]).reshape(-1, mesh.dim)
    return np.linalg.pinv(directions, rcond=TOLERANCE) @ directions


def _taken_up(load: Condition, values: np.ndarray, held: np.ndarray, normal: np.ndarray) -> bool:
    """Whether a motion leaves nothing of a pressure, or takes up a part of a traction, on one face."""
    if isinstance(load, Pressure):
        return bool(values.any() and np.linalg.norm(normal - held @ normal) < TOLERANCE)
    tractions = values[:, :-1]
    return bool(np.abs(tractions @ held).max() > TOLERANCE * np.abs(tractions).max())
