"""Whether a point is inside a body: how much of what one sees from there, all around, is its boundary."""

import math

import numpy as np

from .mesh import Mesh


def inside(mesh: Mesh, point: np.ndarray) -> bool:
    """Whether a point [m], shape (d,), is inside a body and not on its boundary."""
    if mesh.dim == 1:
        return bool(mesh.nodes.min() < point[0] < mesh.nodes.max())
    rays = mesh.nodes[mesh.faces] - point
    seen = _angles(rays) if mesh.dim == 2 else _solid_angles(rays[:, mesh.kind.face_kind.drawn])
    outward = np.sum(mesh.face_normals() * rays.mean(axis=1), axis=1)
    # Seen from inside all faces face away, and fill the circle or the sphere once.
    return bool(np.sum(np.sign(outward) * np.abs(seen)) > (math.pi if mesh.dim == 2 else 2.0 * math.pi))


def _angles(rays: np.ndarray) -> np.ndarray:
    """Under which segments with ends (f, 2, 2) are seen, shape (f,)."""
    a, b = rays[:, 0], rays[:, 1]
    return np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.sum(a * b, axis=1))


def _solid_angles(rays: np.ndarray) -> np.ndarray:
    """Under which polygons with corners (f, k, 3) are seen, shape (f,): fans of triangles (van Oosterom 1983)."""
    lengths, seen = np.linalg.norm(rays, axis=2), np.zeros(len(rays))
    for k in range(1, rays.shape[1] - 1):
        (a, b, c), (p, q, r) = (rays[:, i] for i in (0, k, k + 1)), (lengths[:, i] for i in (0, k, k + 1))
        below = p * q * r + np.sum(a * b, axis=1) * r + np.sum(b * c, axis=1) * p + np.sum(c * a, axis=1) * q
        seen += 2.0 * np.arctan2(np.sum(a * np.cross(b, c), axis=1), below)
    return seen
