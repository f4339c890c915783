"""A body's outline as material edges: which node is next to a node along it, with the body to the left."""

from typing import NamedTuple

import numpy as np
import warp as wp

from ..errors import SceneError
from ..mesh.mesh import Mesh

INSIDE = -1


class Outline(NamedTuple):
    """The outline of a body in the plane.

    Attributes:
        after: the node that follows each along the outline, counterclockwise round the body, clockwise round its
            holes, `INSIDE` for nodes that are not on it, shape (n,).
        before: the node it follows, shape (n,).
    """

    after: np.ndarray
    before: np.ndarray


@wp.struct
class OutlineArrays:
    """An `Outline` on a device."""

    after: wp.array(dtype=wp.int32)
    before: wp.array(dtype=wp.int32)


def outline_arrays(outline: Outline, device: wp.Device) -> OutlineArrays:
    """The outline on a device."""
    arrays = OutlineArrays()
    arrays.after = wp.array(outline.after, dtype=wp.int32, device=device)
    arrays.before = wp.array(outline.before, dtype=wp.int32, device=device)
    return arrays


def copy_outline(to: OutlineArrays, outline: OutlineArrays) -> None:
    """Copy an outline."""
    wp.copy(to.after, outline.after)
    wp.copy(to.before, outline.before)


def outline_of(mesh: Mesh) -> Outline:
    """The outline of a mesh of plane cells.

    Raises:
        SceneError: two parts of it go through one node.
    """
    ends = mesh.faces.astype(np.int32)
    along = mesh.nodes[ends[:, 1]] - mesh.nodes[ends[:, 0]]
    inward = mesh.nodes[mesh.cells[mesh.face_cell]].mean(axis=1) - mesh.nodes[ends[:, 0]]
    clockwise = along[:, 0] * inward[:, 1] - along[:, 1] * inward[:, 0] < 0.0
    ends[clockwise] = ends[clockwise, ::-1]
    for end in ends.T:
        crowded = np.flatnonzero(np.bincount(end, minlength=len(mesh.nodes)) > 1)
        if len(crowded):
            where = tuple(mesh.nodes[crowded[0]].tolist())
            allowed = "the outline passes through a node once where cells are made anew; let parts share an edge"
            raise SceneError("shape", f"two parts that touch in the node at {where}", allowed)
    after, before = (np.full(len(mesh.nodes), INSIDE, dtype=np.int32) for _ in range(2))
    after[ends[:, 0]], before[ends[:, 1]] = ends[:, 1], ends[:, 0]
    return Outline(after, before)
