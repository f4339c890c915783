"""A body on a device: what it is made of, its nodes and its cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..device.launching import Launcher
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..scene.scene import Scene
from .cells import NodeCells, has_slots, node_cells
from .nodes import auxiliary_nodes, material_internals, material_nodes


@dataclass(frozen=True, kw_only=True)
class Body:
    """One material, one kind of cell, and the arrays that every part of a step works on.

    Attributes:
        scene: the scene it is of.
        space: its continuum and precision.
        kind: the kind of its cells.
        law: its material's law.
        parameters: the law's parameters.
        nodes: material nodes (struct of arrays, see `warpsph.state.nodes`).
        internals: what each node remembers of the material, or None.
        auxiliary: auxiliary nodes.
        slots: whether `node_cells` has them.
        node_cells: the cells around each node.
        launcher: launches the kernels that work on it.
    """

    scene: Scene
    space: Space
    kind: CellKind
    law: Law
    parameters: object
    nodes: object
    internals: wp.array | None
    auxiliary: object
    slots: bool
    node_cells: NodeCells
    launcher: Launcher

    def density(self) -> np.ndarray:
        """ρ of the nodes [kg/mᵈ], shape (n,)."""
        return self.nodes.density.numpy().copy()

    def stress(self) -> np.ndarray:
        """σ of the nodes [Pa], stored components, shape (n, s)."""
        return self.nodes.point.numpy()["phi"][:, self.space.dim :].copy()

    @staticmethod
    def of(scene: Scene, space: Space, launcher: Launcher) -> Body:
        """The body of a scene in its initial state; auxiliary nodes are still to be centred."""
        device, shared = launcher.device, shared_parts(scene, space, launcher)
        return Body(
            nodes=material_nodes(scene, space, device),
            auxiliary=auxiliary_nodes(scene, space, shared["kind"], device),
            **shared,
        )


def shared_parts(scene: Scene, space: Space, launcher: Launcher) -> dict[str, object]:
    """What every scheme's body of a scene has alike, by attribute."""
    law, kind, device = scene.material.law(space), scene.mesh.kind, launcher.device
    slots = has_slots(scene.mesh)
    return {
        "scene": scene,
        "space": space,
        "kind": kind,
        "law": law,
        "parameters": law.fill(scene.material),
        "internals": material_internals(scene, law, space, device),
        "slots": slots,
        "node_cells": node_cells(scene.mesh, slots, device),
        "launcher": launcher,
    }
