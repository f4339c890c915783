"""Where a body meets itself, though none of its cells is turned over: seams, and arms that lie on one another.

Cells that all face one way overlap only if the boundary meets itself, so that only its faces are looked at: in the
plane its segments must not cross, in space no edge of a face may go through another face.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from .mesh import Mesh

TOUCHING = 1e-6  # spacings: boundary nodes nearer to each other than this lie on one another
MOST_PAIRS = 10**7  # of neighbouring faces that are held at once


def overlap(mesh: Mesh) -> np.ndarray | None:
    """A place [m] where the boundary meets itself, shape (d,), or None."""
    if mesh.dim == 1:
        return None
    points = mesh.nodes[mesh.faces]
    meet, slack = _segments_meet if mesh.dim == 2 else _faces_meet, TOUCHING * mesh.spacing
    for first, second in _neighbours(points, slack):
        apart = (mesh.faces[first][:, :, None] != mesh.faces[second][:, None, :]).all(axis=(1, 2))
        first, second = first[apart], second[apart]
        if mesh.dim == 3:
            first, second = np.concatenate([first, second]), np.concatenate([second, first])
        found = _coincide(points[first], points[second], slack)
        found |= meet(mesh, points[first], points[second])
        if found.any():
            return points[first[found.argmax()]].mean(axis=0)
    return None


def hanging(mesh: Mesh) -> tuple[int, np.ndarray] | None:
    """A boundary node that lies on a boundary face without being a corner of it, and that face, (k,), or None."""
    if mesh.dim == 1:
        return None
    points, slack = mesh.nodes[mesh.faces], TOUCHING * mesh.spacing
    for pair in _neighbours(points, slack):
        for first, second in (pair, pair[::-1]):
            for corner in mesh.faces[first].T:
                strange = (mesh.faces[second] != corner[:, None]).all(axis=1)
                node, face = corner[strange], second[strange]
                on = _on_face(mesh, mesh.nodes[node], points[face], slack)
                if on.any():
                    return int(node[on.argmax()]), mesh.faces[face[on.argmax()]]
    return None


def _neighbours(points: np.ndarray, slack: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of faces (f, k, d) whose boxes along the axes meet, to within `slack` [m], each pair once."""
    centres = points.mean(axis=1)
    reach = np.linalg.norm(points - centres[:, None], axis=2).max()
    low, high = points.min(axis=1) - slack, points.max(axis=1)
    for first, second in _near(centres, 2.0 * reach):
        chosen = ((low[first] <= high[second]) & (low[second] <= high[first])).all(axis=1)
        yield first[chosen], second[chosen]


def _on_face(mesh: Mesh, place: np.ndarray, face: np.ndarray, slack: float) -> np.ndarray:
    """Whether places (p, d) are nearer than `slack` [m] to faces (p, k, d), in triangles about their middle."""
    if mesh.dim == 2:
        way = face[:, 1] - face[:, 0]
        along = np.clip(np.sum((place - face[:, 0]) * way, axis=1) / np.sum(way * way, axis=1), 0.0, 1.0)
        return np.linalg.norm(place - face[:, 0] - along[:, None] * way, axis=1) <= slack
    middle, found = face.mean(axis=1), np.zeros(len(place), dtype=bool)
    for i, j in mesh.kind.face_kind.edges:
        u, v, w = face[:, i] - middle, face[:, j] - middle, place - middle
        normal = np.cross(u, v)
        size = np.sum(normal * normal, axis=1)
        x, y = np.sum(np.cross(w, v) * normal, axis=1) / size, np.sum(np.cross(u, w) * normal, axis=1) / size
        off = np.abs(np.sum(w * normal, axis=1)) / np.sqrt(size)
        found |= (off <= slack) & (np.minimum(np.minimum(x, y), 1.0 - x - y) >= -TOUCHING)
    return found


def _near(points: np.ndarray, distance: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of points that are nearer than a distance, and some that are not, each pair once."""
    cell = np.floor((points - points.min(axis=0)) / distance).astype(np.int64) + 1
    stride = np.cumprod(np.concatenate([[1], cell.max(axis=0)[:-1] + 2]))
    key = cell @ stride
    order = np.argsort(key, kind="stable")
    keys = key[order]
    steps = [np.array(step) for step in itertools.product((-1, 0, 1), repeat=points.shape[1])]
    for offset in (int(step @ stride) for step in steps):
        if offset < 0:
            continue
        begin, end = (np.searchsorted(keys, keys + offset, side) for side in ("left", "right"))
        if offset == 0:
            begin = np.arange(len(keys)) + 1
        counts = end - begin
        total = np.cumsum(counts)
        for part in np.array_split(np.arange(len(keys)), max(1, -(-int(total[-1]) // MOST_PAIRS))):
            first = np.repeat(part, counts[part])
            rank = np.arange(len(first)) - np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
            a, b = order[first], order[np.repeat(begin[part], counts[part]) + rank]
            close = np.sum((points[a] - points[b]) ** 2, axis=1) <= distance**2
            yield a[close], b[close]


def _coincide(first: np.ndarray, second: np.ndarray, distance: float) -> np.ndarray:
    """Whether a corner of one face lies on a corner of the other, by pairs of faces (p, c, d)."""
    apart = np.linalg.norm(first[:, :, None] - second[:, None, :], axis=3)
    return (apart <= distance).any(axis=(1, 2))


def _segments_meet(mesh: Mesh, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    (a, b), (c, d) = first.swapaxes(0, 1), second.swapaxes(0, 1)
    return (_side(a, b, c) * _side(a, b, d) < 0.0) & (_side(c, d, a) * _side(c, d, b) < 0.0)


def _side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the area of a triangle, positive when it turns left."""
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def _faces_meet(mesh: Mesh, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Whether an edge of the first face goes through the second, cut into triangles about its middle."""
    found = np.zeros(len(first), dtype=bool)
    edges = mesh.kind.face_kind.edges
    middle = second.mean(axis=1)
    for (i, j), (k, m) in itertools.product(edges, edges):
        p, way = first[:, i], first[:, j] - first[:, i]
        u, v = second[:, k] - middle, second[:, m] - middle
        normal = np.cross(u, v)
        along = np.sum(way * normal, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.sum((middle - p) * normal, axis=1) / along
            hit = np.cross(p + t[:, None] * way - middle, normal)
            size = np.sum(normal * normal, axis=1)
            x, y = -np.sum(hit * v, axis=1) / size, np.sum(hit * u, axis=1) / size
            found |= (t > 0.0) & (t < 1.0) & (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0)
    return found
