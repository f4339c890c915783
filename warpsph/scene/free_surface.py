"""A moving free surface: which part of the body's edge is looked at, and how."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..validate import choice, number
from .condition import Condition
from .resolve import BoundaryTable
from .selection import Bare

NORMALS = ("improved", "marrone")
LARGEST_SCAN = 2.0


@dataclass(frozen=True)
class FreeSurface:
    """Makes the body's edge traction-free wherever no velocity is prescribed, as it moves and deforms.

    For the published schemes, whose edges keep what traction they have; those of `cells` are free by themselves.
    Surface nodes and their normals are found anew in the current configuration (see
    `warpsph.operators.surface.scan`); those of `Free` stay what they initially are.

    Args:
        scan_ratio: length of the scan over the local spacing h_s/Δx [-].
        normals: `improved` (fitted to the neighbouring surface nodes) or `marrone` (of the scan itself).
    """

    scan_ratio: float = 4.0 / 3.0
    normals: str = "improved"

    def __post_init__(self):
        object.__setattr__(self, "scan_ratio", number("FreeSurface.scan_ratio", self.scan_ratio, above=0.0))
        choice("FreeSurface.normals", self.normals, NORMALS)

    def check(self, dim: int) -> None:
        """Raise `SceneError` when the free surface does not fit `dim` space dimensions.

        The scan covers a ball of radius h_s/√2; in a lattice it finds a node wherever it points once that is
        no smaller than half the diagonal of a cell, √d Δx/2.
        """
        if dim == 1:
            raise SceneError("free_surface", self, "a bar has no free surface that moves; use Free(edge(…))")
        least = math.sqrt(dim / 2.0)
        number("FreeSurface.scan_ratio", self.scan_ratio, at_least=least, at_most=LARGEST_SCAN)

    def candidates(self, mesh: Mesh, conditions: Sequence[Condition]) -> np.ndarray:
        """The nodes that can be on the free surface, indices, shape (b,), ascending.

        They are the nodes of the boundary faces that none of the velocity conditions covers. The body can not
        tear, as auxiliary nodes stay in the middle of their initial cells, so no other node ever gets there. A
        node at the end of a wall is one of them, also where walls end on both sides of a face.
        """
        return np.unique(mesh.faces[Bare(tuple(condition.on for condition in conditions)).faces(mesh)])

    def moved(self, mesh: Mesh, boundary: BoundaryTable) -> np.ndarray:
        """Which nodes are under a velocity condition, boolean, shape (n,)."""
        moved = np.zeros(len(mesh.nodes), dtype=bool)
        moved[boundary.nodes] = boundary.moved
        return moved
