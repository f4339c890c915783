"""Where a user names a point of a body."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..validate import vector


def node_at(field: str, point: Iterable[float], mesh: Mesh) -> int:
    """Index of the node nearest to a point of a body [m].

    Raises:
        SceneError: the point is not in the body: further from that node than the corners of the node's cells;
            `field` is what the user calls it.
    """
    place = vector(field, point, mesh.dim)
    distance = np.linalg.norm(mesh.nodes - np.array(place), axis=1)
    node = int(distance.argmin())
    corners = mesh.nodes[mesh.cells[(mesh.cells == node).any(axis=1)]]
    if distance[node] > np.linalg.norm(corners - mesh.nodes[node], axis=-1).max():
        at = tuple(round(x, 6) for x in mesh.nodes[node].tolist())
        allowed = f"it must be in the body; the nearest node, at {at}, is {distance[node]:.4g} m away"
        raise SceneError(field, place, allowed)
    return node
