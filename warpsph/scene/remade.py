"""Cells that follow the flow: asked for by a scene, off unless it is."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import SceneError
from ..validate import index


@dataclass(frozen=True, kw_only=True)
class Remade:
    """Cells are made anew from the places of the nodes as the body flows (triangles in the plane).

    State stands at the nodes and stays there; edges of the outline stay what they are. Until a cell has lost its
    shape all are let alone, bit for bit.

    Args:
        every: steps between two looks at the cells.
    """

    every: int = 20

    def __post_init__(self):
        object.__setattr__(self, "every", index("Remade.every", self.every, at_least=1))

    def check(self, scene) -> None:
        """Refuse a scene whose cells can not be made anew.

        Raises:
            SceneError: its scheme, its cells or its loads do not allow it.
        """
        allowed = None
        if scene.numerics.scheme.sums is not None:
            allowed = f"velocity_scheme {scene.numerics.velocity_scheme} has cells of its own; take cells"
        elif scene.mesh.kind.name != "triangle":
            allowed = (
                f"it takes triangles, not a {scene.mesh.kind.name}; take Box(…, cells='triangles') or GivenMesh"
            )
        elif not scene.large_displacements:
            allowed = "cells stay where nodes do; take large_displacements=True"
        elif len(scene.loads.cell):
            allowed = "loads are on faces of cells that stay; leave one of both out"
        elif scene.rigid_cells.any():
            allowed = "conditions that move whole cells need cells that stay; hold their edge only"
        if allowed is not None:
            raise SceneError("cells", self, allowed)
