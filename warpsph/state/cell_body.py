"""A body of the scheme `cells` on a device: its nodes, and what a pass over the cells leaves of each."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..device.launching import Launcher
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..scene.scene import Scene
from .cells import NodeCells, cell_table, has_slots, node_cells
from .nodes import material_internals


@cache
def cell_node_types(space: Space) -> tuple[type, type]:
    """Warp structs: `Half`, x and v at the half step; `CellNodes`, the arrays of `CellBody.nodes`."""
    types = space.types

    @wp.struct
    class Half:
        x: types.vector
        v: types.vector

    @wp.struct
    class CellNodes:
        point: wp.array(dtype=types.Point)
        half: wp.array(dtype=Half)
        reference: wp.array(dtype=types.vector)
        displacement: wp.array(dtype=types.vector)
        mass: wp.array(dtype=space.real)
        volume: wp.array(dtype=space.real)
        velocity_gradient: wp.array(dtype=types.tensor)
        elastic_rate: wp.array(dtype=types.stress)
        acceleration: wp.array(dtype=types.vector)
        books: wp.array(dtype=wp.vec3d)
        strained: wp.array(dtype=space.real)

    return Half, CellNodes


@dataclass(frozen=True, kw_only=True)
class CellBody:
    """One material, one kind of cell, and the arrays that a step works on.

    Attributes:
        scene: the scene it is of.
        space: its continuum and precision.
        kind: the kind of its cells.
        law: its material's law.
        parameters: the law's parameters.
        nodes: `CellNodes`: `point` x [m] (from `mesh.middle`) and φ = (v, σ) at tⁿ; `half` x and v at t^{n+1/2};
            `reference` X and `displacement` u [m]; `mass` [kg], constant; `volume` V [mᵈ] and
            `velocity_gradient` L [1/s] at t^{n+1/2}; `elastic_rate` Dₑ : L [Pa/s]; `acceleration` [m/s²] at tⁿ by
            all forces but those of the conditions; `books` [J]: work done by forces on the body, work done by
            conditions, lost to flow; `strained` ∫ |d| dt since the step was last measured.
        internals: what each node remembers of the material, or None.
        corners: node indices of each cell, shape (m, c).
        slots: whether `node_cells` has them.
        node_cells: the cells around each node.
        launcher: launches the kernels that work on it.
        auxiliary: None: auxiliary nodes remember nothing, and nothing of them is kept.
    """

    scene: Scene
    space: Space
    kind: CellKind
    law: Law
    parameters: object
    nodes: object
    internals: wp.array | None
    corners: wp.array
    slots: bool
    node_cells: NodeCells
    launcher: Launcher
    auxiliary: None = None

    @staticmethod
    def of(scene: Scene, space: Space, launcher: Launcher) -> "CellBody":
        """The body of a scene in its initial state."""
        law, mesh, device = scene.material.law(space), scene.mesh, launcher.device
        Half, CellNodes = cell_node_types(space)
        n, x, types = len(mesh.nodes), mesh.nodes - mesh.middle, space.types
        point = np.zeros(n, dtype=types.Point.numpy_dtype())
        point["x"] = x
        point["phi"] = np.concatenate([scene.initial_velocity, scene.initial_stress], axis=1)
        volume, _ = mesh.node_volumes()
        nodes, slots = CellNodes(), has_slots(mesh)
        nodes.point = wp.array(point, dtype=types.Point, device=device)
        nodes.half = wp.zeros(n, dtype=Half, device=device)
        nodes.reference = wp.array(x, dtype=types.vector, device=device)
        nodes.mass = wp.array(scene.material.density * volume, dtype=space.real, device=device)
        nodes.volume = wp.array(volume, dtype=space.real, device=device)
        for name, kind in (
            *(("displacement", types.vector), ("velocity_gradient", types.tensor)),
            *(("elastic_rate", types.stress), ("acceleration", types.vector), ("books", wp.vec3d)),
            ("strained", space.real),
        ):
            setattr(nodes, name, wp.zeros(n, dtype=kind, device=device))
        return CellBody(
            scene=scene,
            space=space,
            kind=mesh.kind,
            law=law,
            parameters=law.fill(scene.material),
            nodes=nodes,
            internals=material_internals(scene, law, space, device),
            corners=cell_table(mesh, mesh.kind, device),
            slots=slots,
            node_cells=node_cells(mesh, slots, device),
            launcher=launcher,
        )

    def density(self) -> np.ndarray:
        """ρ = m/V of the nodes [kg/mᵈ], shape (n,)."""
        return self.nodes.mass.numpy() / self.nodes.volume.numpy()
