"""Resolves overlapping conditions into one affine statement a node.

At a constrained node, applying the conditions at time t means

    v ← P v + Σ_k a_k f_k(t),        σ ← Π σ + Σ_k G_k t_k f_k(t),

with P the projector onto the directions whose velocity is free, Π a projector onto the stresses whose prescribed
tractions vanish, and t_k the prescribed tractions, vectors in space, which the stress G_k t_k has. Π is orthogonal
in the Frobenius norm (tractions are put in place, all else kept, as published): with N the tractions' rows, N σ
their values, and D that norm's metric on the stored components, G N = D Nᵀ (N D Nᵀ)⁻¹ N = 1 − Π. Where conditions
meet (METHOD section 5):

- a velocity condition beats a traction condition: a free edge frees only the directions that nobody moves;
- a wall without friction keeps its zero shear at its ends as well, as a plane of symmetry does;
- where two free edges meet, all in-plane stresses vanish (this follows from the two normals), but none in an inner
  corner (see `Free`);
- where tractions contradict each other, as at the end of a load, their mean holds;
- two conditions that give one direction different velocities, that call one face free and moved, or that load one
  face twice, contradict each other and are refused.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.continuum import Continuum
from ..mesh.mesh import Mesh
from ..validate import TimeFunction
from .condition import Condition

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
        amplitude: a_k [m/s], shape (b, K, d); K is the largest number of terms at a node.
        function: index into `functions` of each term, shape (b, K).
        traction: t_k [Pa], shape (b, M, d); M is the largest number of terms at a node, zero without loads.
        traction_stress: G_k, from a traction to the stress that has it, as stored, shape (b, M, s, d).
        traction_function: index into `functions` of each traction, shape (b, M).
        moved: whether a velocity component is prescribed, shape (b,).
    """

    nodes: np.ndarray
    velocity_projector: np.ndarray
    stress_projector: np.ndarray
    functions: tuple[TimeFunction, ...]
    amplitude: np.ndarray
    function: np.ndarray
    traction: np.ndarray
    traction_stress: np.ndarray
    traction_function: np.ndarray
    moved: np.ndarray

    @property
    def loaded(self) -> bool:
        """Whether a traction other than zero is prescribed anywhere."""
        return self.traction.shape[1] > 0


def resolve(mesh: Mesh, conditions: Sequence[Condition], *, duration: float = 1.0) -> BoundaryTable:
    """Resolve the conditions on a mesh; see the module's text for the rules.

    Args:
        mesh: the mesh.
        conditions: the conditions.
        duration: how long the conditions hold [s]: those that meet are compared so long.
    """
    dim, size, groups = mesh.dim, mesh.continuum.stress_size, _groups(mesh, conditions)
    nodes = np.array(sorted(node for members in groups.values() for node in members), dtype=np.int64)
    row_of = {node: row for row, node in enumerate(nodes.tolist())}
    projectors = np.zeros((len(nodes), dim, dim))
    stress = np.zeros((len(nodes), size, size))
    moved = np.zeros(len(nodes), dtype=bool)
    functions: list[TimeFunction] = []
    velocities, tractions, lifts = (
        _Terms(functions, (dim,)),
        _Terms(functions, (dim,)),
        _Terms(functions, (size, dim)),
    )

    for signature, members in groups.items():
        where = [row_of[node] for node in members]
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
        _refuse_contradiction(directions, rows, signature, conditions, points, duration)
        projectors[where] = projector
        moved[where] = len(rows) > 0
        for column, (_, parts) in zip(inverse.T, rows, strict=True):
            for coefficient, function in parts:
                velocities.add(where, coefficient[:, None] * column, function)
        faces = _prescribed_tractions(signature, conditions, projector, points)
        stress[where], lifts_here = _stress_map(faces, mesh.continuum)
        for (condition, normal, _), lift in zip(faces, lifts_here, strict=True):
            for vectors, function in condition.tractions(points, normal):
                tractions.add(where, vectors, function)
                lifts.add(where, [lift] * len(where), function)

    spare = len(functions)  # short rows end in a constant zero, since zero times a drive that is NaN is NaN
    amplitude, function = velocities.arrays(len(nodes), spare)
    traction, traction_function = tractions.arrays(len(nodes), spare)
    traction_stress, _ = lifts.arrays(len(nodes), spare)
    if spare in function or spare in traction_function:
        functions.append(0.0)
    return BoundaryTable(
        nodes=nodes,
        velocity_projector=projectors,
        stress_projector=stress,
        functions=tuple(functions),
        amplitude=amplitude,
        function=function,
        traction=traction,
        traction_stress=traction_stress,
        traction_function=traction_function,
        moved=moved,
    )


class _Terms:
    """Sums of vectors or matrices times functions of time, a sum a row, as they are put together."""

    def __init__(self, functions: list[TimeFunction], shape: tuple[int, ...]):
        self._functions, self._shape = functions, shape
        self._of_row: dict[int, list[tuple[np.ndarray, int]]] = defaultdict(list)

    def add(self, rows: Sequence[int], values: Sequence[np.ndarray], function: TimeFunction) -> None:
        """Add a value to each of the rows, times a function of time; not a constant zero."""
        if not callable(function) and function == 0.0:
            return
        if function not in self._functions:
            self._functions.append(function)
        for row, value in zip(rows, values, strict=True):
            self._of_row[row].append((value, self._functions.index(function)))

    def arrays(self, count: int, spare: int) -> tuple[np.ndarray, np.ndarray]:
        """Values and indices of their functions, a row each, of one length: short ones end in `spare`."""
        width = max(map(len, self._of_row.values()), default=0)
        values = np.zeros((count, width, *self._shape))
        function = np.full((count, width), spare, dtype=np.int32)
        for row, terms in self._of_row.items():
            for k, (value, index) in enumerate(terms):
                values[row, k], function[row, k] = value, index
        return values, function


Signature = tuple[tuple[int, tuple[tuple[float, ...], ...]], ...]


def _groups(mesh: Mesh, conditions: Sequence[Condition]) -> dict[Signature, list[int]]:
    """Constrained nodes grouped by which conditions hold there and with which normals."""
    places = np.argsort(mesh.faces.ravel(), kind="stable")  # in the table of faces, node by node
    first = np.searchsorted(mesh.faces.ravel()[places], np.arange(len(mesh.nodes) + 1)).tolist()
    places = places.tolist()
    corners, angles, face_normals = mesh.faces.shape[1], mesh.face_angles().round(9).ravel(), mesh.face_normals()
    normals_at = np.repeat(face_normals, corners, axis=0)
    alike = np.repeat(np.unique(face_normals, axis=0, return_inverse=True)[1].ravel(), corners)
    distinct, angle = np.unique(angles, return_inverse=True)
    alike = (alike * len(distinct) + angle).tolist()  # equal where both normal and angle are
    unmoved = np.zeros(len(mesh.faces), dtype=bool)  # one smooth edge, however many conditions share it
    for condition in conditions:
        if condition.unmoved and getattr(condition, "normal", None) is None:
            unmoved |= condition.on.faces(mesh)
    signatures: dict[int, list] = defaultdict(list)
    covered = []
    for index, condition in enumerate(conditions):
        condition.check(mesh.dim)
        nodes, faces = condition.on.nodes(mesh), condition.on.faces(mesh)
        if not nodes.any():
            raise SceneError(f"conditions[{index}]", condition, "its selection must hold at least one node")
        covered.append(condition.faces(mesh))
        given = getattr(condition, "normal", None)
        everywhere = () if condition.rigid else None if given is None else (given,)  # rigid: however faces look
        own = np.repeat(faces, corners)
        edge = (np.repeat(unmoved, corners) if condition.unmoved else own).tolist()
        known: dict[tuple, tuple] = {}  # most nodes have faces around them like those of some other node
        for node in np.flatnonzero(condition.nodes(mesh)).tolist():
            normals = everywhere
            if normals is None:
                around = [place for place in places[first[node] : first[node + 1]] if edge[place]]
                key = tuple((alike[place], bool(own[place])) for place in around)
                if key not in known:
                    known[key] = _smooth_normals(normals_at[around], angles[around], own[around])
                normals = known[key]
            if not normals and condition.takes_normal:
                raise SceneError(
                    f"conditions[{index}]",
                    condition,
                    f"node {node} at {tuple(mesh.nodes[node].tolist())} lies on no selected boundary face; "
                    f"give normal=…",
                )
            signatures[node].append((index, normals))
    _refuse_shared_faces(mesh, conditions, covered)
    groups: dict[Signature, list[int]] = defaultdict(list)
    for node, signature in signatures.items():
        groups[tuple(signature)].append(node)
    return groups


def _smooth_normals(normals: np.ndarray, angles: np.ndarray, own: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """The distinct edges a node lies on: normals within `SMOOTH_EDGE_ANGLE` are averaged, weighed by angles.

    Only edges with a face of the condition's own count.
    """
    clusters: list[list[int]] = []
    for face, normal in enumerate(normals):
        for cluster in clusters:
            if normal @ normals[cluster[0]] > np.cos(SMOOTH_EDGE_ANGLE):
                cluster.append(face)
                break
        else:
            clusters.append([face])
    means = [angles[cluster] @ normals[cluster] for cluster in clusters if own[cluster].any()]
    return tuple(tuple(np.round(mean / np.linalg.norm(mean), 12).tolist()) for mean in means)


def _refuse_shared_faces(mesh: Mesh, conditions: Sequence[Condition], covered: list[np.ndarray]) -> None:
    """A face is either free or moved, and loaded by one condition at most."""
    normals = mesh.face_normals()
    for i, j in itertools.permutations(range(len(conditions)), 2):
        first, second, shared = conditions[i], conditions[j], np.flatnonzero(covered[i] & covered[j])
        if not len(shared):
            continue
        if first.unmoved and not second.unmoved:
            reason = "moves or holds them; a face is either free or moved"
        elif first.tractions(mesh.nodes[mesh.faces[shared[0]]], normals[shared[0]]):
            reason = "is on them as well; a face that is loaded has one condition"
        else:
            continue
        raise SceneError(
            f"conditions[{i}]",
            first,
            f"it shares {len(shared)} boundary face(s) with conditions[{j}] = {second}, which {reason}",
        )


# Functions of time are compared at so many times: equal ones need not be one object, and may add up to nothing.
COMPARED = 33


def _refuse_contradiction(directions, rows, signature, conditions, points, duration) -> None:
    """Every linear relation between the directions must hold between their velocities as well, at any time."""
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
    violation = np.tensordot(left[:, rank:].T, targets, 1)  # of each relation, by function and node
    if np.abs(violation).max(initial=0.0) <= 1e-9 * (1.0 + np.abs(targets).max()):
        return
    over_time = np.array(
        [[f(t) if callable(f) else f for f in functions] for t in np.linspace(0.0, duration, COMPARED).tolist()]
    )
    violation = np.abs(np.einsum("tk,rkn->trn", over_time, violation)).max(axis=(0, 1), initial=0.0)
    worst = int(violation.argmax())
    if violation[worst] > 1e-9 * np.abs(np.einsum("tk,rkn->trn", over_time, targets)).max():
        (first, _), *others = signature
        names = " and ".join(f"conditions[{index}] = {conditions[index]}" for index, _ in others)
        at = tuple(points[worst].tolist())
        raise SceneError(
            f"conditions[{first}]",
            conditions[first],
            f"with {names} it gives the node at {at} m different velocities in one direction",
        )


Tractions = tuple[Condition, np.ndarray, np.ndarray]


def _prescribed_tractions(signature, conditions, projector, points) -> list[Tractions]:
    """The conditions at a node, with a normal n and the directions u (k, d) along which they prescribe u · σ n."""
    found = []
    for index, normals in signature:
        condition = conditions[index]
        for normal in map(np.array, normals):
            own = np.array([vectors[0] for vectors, _ in condition.rows(points[:1], normal)])
            own = own.reshape(-1, len(normal))
            free_here = np.eye(len(normal)) - np.linalg.pinv(own, rcond=TOLERANCE) @ own
            if condition.unmoved:
                free_here = projector
            directions = []
            for u in _basis(free_here):
                moved_along_u = np.linalg.norm(projector @ u) < 1.0 - TOLERANCE
                if not (moved_along_u and abs(u @ normal) > TOLERANCE):  # shear stays, see the module's text
                    directions.append(u)
            if directions:
                found.append((condition, normal, np.array(directions)))
    return found


def _stress_map(faces: Sequence[Tractions], continuum: Continuum) -> tuple[np.ndarray, list[np.ndarray]]:
    """Π at a node, and for each of the prescribed tractions G (s, d), from its vector to a stress that has it."""
    if not faces:
        return np.eye(continuum.stress_size), []
    traction = np.array(
        [_traction_row(u, normal, continuum) for _, normal, directions in faces for u in directions]
    )
    metric = np.diag([1.0 if i == j else 0.5 for i, j in continuum.pairs])
    solutions = metric @ traction.T @ np.linalg.pinv(traction @ metric @ traction.T, rcond=TOLERANCE)
    ends = np.cumsum([len(along) for _, _, along in faces])
    parts = zip(np.split(solutions, ends[:-1], axis=1), faces, strict=True)
    lifts = [_clean(columns @ along) for columns, (_, _, along) in parts]
    return _clean(np.eye(continuum.stress_size) - solutions @ traction), lifts


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
