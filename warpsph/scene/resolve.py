"""Resolves overlapping conditions into one linear statement a node.

At a constrained node, applying the conditions at time t means

    v ← P v + Σ_k a_k f_k(t),        σ ← Π σ,

with P the projector onto the directions whose velocity is free and Π a projector onto the stresses whose
prescribed tractions vanish, orthogonal in the Frobenius norm (tractions are cut off, as published) or in that of
the elastic energy (they go by elastic unloading: Π = 1 − Dₑ Nᵀ (N Dₑ Nᵀ)⁻¹ N, N the tractions' rows). Where
conditions meet (METHOD section 5):

- a velocity condition beats a traction condition: a free edge frees only the directions that nobody moves;
- a wall without friction keeps its zero shear at its ends as well, as a plane of symmetry does;
- where two free edges meet, all in-plane stresses vanish (this follows from the two normals);
- two conditions that give one direction different velocities, or that call one face free and moved, contradict
  each other and are refused.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.continuum import Continuum
from ..mesh.mesh import Mesh
from ..validate import TimeFunction
from .condition import Condition, Free

# Faces of one node whose normals differ by less than this belong to one smooth edge; their mean is its normal.
SMOOTH_EDGE_ANGLE = np.deg2rad(50.0)
TOLERANCE = 1e-9


@dataclass(frozen=True)
class BoundaryTable:
    """The resolved conditions of b constrained nodes.

    Attributes:
        nodes: node indices, shape (b,), ascending.
        velocity_projector: P, shape (b, d, d).
        stress_projector: Π on the stored stress components, shape (b, s, s).
        functions: the distinct functions of time f_k.
        amplitude: a_k, shape (b, K, d); K is the largest number of terms at a node.
        function: index into `functions` of each term, shape (b, K).
        moved: whether a velocity component is prescribed, shape (b,).
    """

    nodes: np.ndarray
    velocity_projector: np.ndarray
    stress_projector: np.ndarray
    functions: tuple[TimeFunction, ...]
    amplitude: np.ndarray
    function: np.ndarray
    moved: np.ndarray


def resolve(mesh: Mesh, conditions: Sequence[Condition], stiffness: np.ndarray | None = None) -> BoundaryTable:
    """Resolve the conditions on a lattice; see the module's text for the rules.

    Args:
        lattice: the lattice.
        conditions: the conditions.
        stiffness: Dₑ on the stored components (s, s), up to a factor: tractions then vanish by elastic
            unloading. They are cut off, all other components kept, unless it is given.
    """
    dim, continuum = mesh.dim, mesh.continuum
    groups = _groups(mesh, conditions)
    nodes = np.array(sorted(node for members in groups.values() for node in members), dtype=np.int64)
    row_of = {node: row for row, node in enumerate(nodes.tolist())}
    size = continuum.stress_size
    if stiffness is None:
        stiffness = np.diag([1.0 if i == j else 0.5 for i, j in continuum.pairs])
    projectors = np.zeros((len(nodes), dim, dim))
    stress = np.zeros((len(nodes), size, size))
    moved = np.zeros(len(nodes), dtype=bool)
    functions: list[TimeFunction] = []
    terms: dict[int, list[tuple[np.ndarray, int]]] = defaultdict(list)

    for signature, members in groups.items():
        where = np.array([row_of[node] for node in members])
        points = mesh.nodes[members]
        rows = [
            row
            for index, normals in signature
            for normal in (normals or (None,))
            for row in conditions[index].rows(points, None if normal is None else np.array(normal))
        ]
        directions = np.array([vectors[0] for vectors, _ in rows]).reshape(-1, dim)
        inverse = _clean(np.linalg.pinv(directions, rcond=TOLERANCE))
        projector = _clean(np.eye(dim) - inverse @ directions)
        _refuse_contradiction(directions, rows, signature, conditions, points)
        projectors[where] = projector
        stress[where] = _stress_projector(signature, conditions, projector, points, continuum, stiffness)
        moved[where] = len(rows) > 0
        for column, (_, parts) in zip(inverse.T, rows, strict=True):
            for coefficient, function in parts:
                if not callable(function) and function == 0.0:
                    continue
                if function not in functions:
                    functions.append(function)
                for row, factor in zip(where, coefficient, strict=True):
                    terms[row].append((factor * column, functions.index(function)))

    width = max((len(parts) for parts in terms.values()), default=0)
    amplitude = np.zeros((len(nodes), width, dim))
    spare = len(functions)  # short rows end in a constant zero, since zero times a drive that is NaN is NaN
    function = np.full((len(nodes), width), spare, dtype=np.int32)
    for row, parts in terms.items():
        for k, (vector, index) in enumerate(parts):
            amplitude[row, k], function[row, k] = vector, index
    if (function == spare).any():
        functions.append(0.0)
    return BoundaryTable(nodes, projectors, stress, tuple(functions), amplitude, function, moved)


Signature = tuple[tuple[int, tuple[tuple[float, ...], ...]], ...]


def _groups(mesh: Mesh, conditions: Sequence[Condition]) -> dict[Signature, list[int]]:
    """Constrained nodes grouped by which conditions hold there and with which normals."""
    touching: dict[int, list[int]] = defaultdict(list)
    for face, corners in enumerate(mesh.faces.tolist()):
        for node in corners:
            touching[node].append(face)
    face_normals = mesh.face_normals()
    signatures: dict[int, list] = defaultdict(list)
    selected, covered = [], []
    for index, condition in enumerate(conditions):
        condition.check(mesh.dim)
        nodes, faces = condition.on.nodes(mesh), condition.on.faces(mesh)
        if not nodes.any():
            raise SceneError(f"conditions[{index}]", condition, "its selection must hold at least one node")
        selected.append(nodes)
        covered.append(faces & nodes[mesh.faces].all(axis=1))
        given = getattr(condition, "normal", None)
        for node in np.flatnonzero(nodes).tolist():
            own = [face for face in touching.get(node, ()) if faces[face]]
            normals = (given,) if given is not None else _smooth_normals(face_normals[own])
            if not normals and condition.takes_normal:
                raise SceneError(
                    f"conditions[{index}]",
                    condition,
                    f"node {node} at {tuple(mesh.nodes[node].tolist())} lies on no selected boundary face; "
                    f"give normal=…",
                )
            signatures[node].append((index, normals))
    _refuse_free_and_moved(conditions, covered)
    groups: dict[Signature, list[int]] = defaultdict(list)
    for node, signature in signatures.items():
        groups[tuple(signature)].append(node)
    return groups


def _smooth_normals(normals: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """The distinct edges a node lies on: normals within `SMOOTH_EDGE_ANGLE` are averaged."""
    clusters: list[list[np.ndarray]] = []
    for normal in normals:
        for cluster in clusters:
            if normal @ cluster[0] > np.cos(SMOOTH_EDGE_ANGLE):
                cluster.append(normal)
                break
        else:
            clusters.append([normal])
    means = [np.mean(cluster, axis=0) for cluster in clusters]
    return tuple(tuple(np.round(mean / np.linalg.norm(mean), 12).tolist()) for mean in means)


def _refuse_free_and_moved(conditions: Sequence[Condition], covered: list[np.ndarray]) -> None:
    for i, first in enumerate(conditions):
        for j, second in enumerate(conditions):
            if isinstance(first, Free) and not isinstance(second, Free):
                shared = int((covered[i] & covered[j]).sum())
                if shared:
                    raise SceneError(
                        f"conditions[{i}]",
                        first,
                        f"it shares {shared} boundary face(s) with conditions[{j}] = {second}, which moves or "
                        f"holds them; a face is either free or moved",
                    )


def _refuse_contradiction(directions, rows, signature, conditions, points) -> None:
    """Every linear relation between the directions must hold between their velocities as well."""
    if len(rows) < 2:
        return
    left, values, _ = np.linalg.svd(directions)
    rank = int((values > TOLERANCE).sum())
    functions: list[TimeFunction] = []
    for _, parts in rows:
        functions += [f for _, f in parts if f not in functions and (callable(f) or f != 0.0)]
    targets = np.zeros((len(rows), max(1, len(functions)), len(points)))
    for row, (_, parts) in enumerate(rows):
        for coefficient, function in parts:
            if function in functions:
                targets[row, functions.index(function)] += coefficient
    violation = np.abs(np.tensordot(left[:, rank:].T, targets, 1)).max(axis=(0, 1), initial=0.0)
    worst = int(violation.argmax())
    if violation[worst] > 1e-9 * (1.0 + np.abs(targets).max()):
        (first, _), *others = signature
        names = " and ".join(f"conditions[{index}] = {conditions[index]}" for index, _ in others)
        at = tuple(points[worst].tolist())
        raise SceneError(
            f"conditions[{first}]",
            conditions[first],
            f"with {names} it gives the node at {at} m different velocities in one direction",
        )


def _stress_projector(signature, conditions, projector, points, continuum: Continuum, stiffness) -> np.ndarray:
    """Π at a node: the stresses for which every prescribed traction component vanishes."""
    rows = []
    for index, normals in signature:
        condition = conditions[index]
        for normal in normals:
            normal = np.array(normal)
            own = np.array([vectors[0] for vectors, _ in condition.rows(points[:1], normal)])
            own = own.reshape(-1, len(normal))
            free_here = np.eye(len(normal)) - np.linalg.pinv(own, rcond=TOLERANCE) @ own
            if isinstance(condition, Free):
                free_here = projector
            for u in _basis(free_here):
                moved_along_u = np.linalg.norm(projector @ u) < 1.0 - TOLERANCE
                if not (moved_along_u and abs(u @ normal) > TOLERANCE):  # shear stays, see the module's text
                    rows.append(_traction_row(u, normal, continuum))
    if not rows:
        return np.eye(continuum.stress_size)
    traction = np.array(rows)
    compliance = np.linalg.pinv(traction @ stiffness @ traction.T, rcond=TOLERANCE)
    return _clean(np.eye(continuum.stress_size) - stiffness @ traction.T @ compliance @ traction)


def _clean(matrix: np.ndarray) -> np.ndarray:
    """Entries of the size of round-off set to zero, so that a wall along an axis stays exactly at rest."""
    return np.where(np.abs(matrix) < 1e-12, 0.0, matrix)


def _basis(projector: np.ndarray) -> np.ndarray:
    """Orthonormal vectors that span the range of a projector, one a row."""
    vectors, values, _ = np.linalg.svd(projector)
    return vectors[:, values > 0.5].T


def _traction_row(u: np.ndarray, normal: np.ndarray, continuum: Continuum) -> np.ndarray:
    """Coefficients of u · σ n in the stored stress components."""
    row = np.zeros(continuum.stress_size)
    for k, (i, j) in enumerate(continuum.pairs):
        if max(i, j) < continuum.dim:
            row[k] = u[i] * normal[i] if i == j else u[i] * normal[j] + u[j] * normal[i]
    return row
