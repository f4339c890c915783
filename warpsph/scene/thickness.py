"""Refuses bodies that are one cell thick between two free faces.

Stresses live at nodes. With a published scheme a free face takes from its nodes what acts across it, and in a cell
between two free faces no node is left to carry shear through its thickness: a plate one cell thick bends like a
chain and falls for ever. In sharpened cells it has a fiftieth of its stiffness. Between walls, or from a wall to a
free face, one cell is enough.
"""

from __future__ import annotations

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..mesh.reentrant import reentrant_nodes
from .resolve import BoundaryTable


def check_thickness(mesh: Mesh, boundary: BoundaryTable, surface: np.ndarray) -> None:
    """Raise `SceneError` where a cell lies between two faces whose nodes are all free of tractions.

    Args:
        mesh: the mesh.
        boundary: the conditions.
        surface: indices of the nodes that are free where nobody moves them, conditions aside.
    """
    if not mesh.kind.grid:
        return
    faces = np.flatnonzero(_freed(mesh, boundary, surface)[mesh.faces].all(axis=1))
    cell, sides = mesh.face_cell[faces], np.array(mesh.kind.faces)
    which = (mesh.cells[cell][:, sides] == mesh.faces[faces][:, None]).all(axis=2).argmax(axis=1)
    free = np.zeros((len(mesh.cells), mesh.dim, 2), dtype=bool)
    free[cell, which // 2, which % 2] = True
    thin = free.all(axis=2).any(axis=1)
    if thin.any():
        at = ", ".join(f"{x:.4g}" for x in mesh.nodes[mesh.cells[thin.argmax()]].mean(axis=0))
        allowed = f"at ({at}) the body is one cell thick between two free faces, and nothing would hold its shape"
        raise SceneError("spacing", mesh.spacing, allowed)


def _freed(mesh: Mesh, boundary: BoundaryTable, surface: np.ndarray) -> np.ndarray:
    """Which nodes are free of tractions and moved by nobody, boolean, shape (n,)."""
    freed = np.zeros(len(mesh.nodes), dtype=bool)
    freed[np.asarray(surface, dtype=int)] = True
    freed &= ~reentrant_nodes(mesh)
    loses = (boundary.stress_projector != np.eye(mesh.continuum.stress_size)).any(axis=(1, 2))
    freed[boundary.nodes] |= loses
    freed[boundary.nodes[boundary.moved]] = False
    return freed
