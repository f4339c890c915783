"""A body of the scheme `cells` on a device: its nodes, and what a pass over the cells leaves of each."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..device.launching import Launcher
from ..mesh.faces import mesh_of_cells
from ..mesh.mesh import Mesh
from ..physics.space import Space
from ..scene.scene import Scene
from .body import Body, shared_parts
from .cells import NodeCells, cell_table, has_slots, node_cells, with_room

# Rows of the nodes' books, energies [J]: work of the body force and of conditions on velocities; what damping,
# elastic strain, flow and cells that were made anew took.
ENTRIES = FORCES, CONDITIONS, DAMPING, ELASTIC, FLOW, REMADE = tuple(range(6))
LEAST_VOLUME = 0.15  # of a node's initial volume: one that loses its surroundings gets softer, not singular


@wp.func
def enter(row: int, i: int, energy: wp.float64, books: wp.array2d(dtype=wp.float64)):
    """Add an energy to a node's books; `+=` would be atomic."""
    books[row, i] = books[row, i] + energy


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
        books: wp.array2d(dtype=wp.float64)
        strained: wp.array(dtype=space.real)
        sharpened: wp.array(dtype=types.stress)
        flowed: wp.array(dtype=space.real)

    return Half, CellNodes


@dataclass(frozen=True, kw_only=True)
class CellBody(Body):
    """A body as the scheme `cells` keeps it.

    Attributes:
        nodes: `CellNodes`: `point` x [m] (from `mesh.middle`) and φ = (v, σ) at tⁿ; `half` x and v at t^{n+1/2};
            `reference` X and `displacement` u [m]; `mass` [kg], constant; `volume` V [mᵈ] and
            `velocity_gradient` L [1/s] at t^{n+1/2}; `elastic_rate` Dₑ : L [Pa/s]; `acceleration` [m/s²] at tⁿ by
            all forces but those of the conditions; `books` [J], a row each of `ENTRIES`;
            `strained` ∫ |d| dt since the step was last measured; `sharpened` K σ [Pa], where it is asked for;
            `flowed` of a law that flows, 1 in a step in which it does, then less and less.
        corners: node indices of each cell, shape (m, c).
        cell_mass: mass of each cell [kg], constant, shape (m,). Where cells are made anew there is room for 2n;
            those that are none have no mass, and the corners of another.
        slots: whether `node_cells` has them.
        node_cells: the cells around each node.
        straining: those that a node's volume and strain rate are of: `node_cells` without cells that conditions
            move rigidly, so that a clamp inside a body is as stiff as one at its edge.
    """

    corners: wp.array
    cell_mass: wp.array
    slots: bool
    node_cells: NodeCells
    straining: NodeCells

    @staticmethod
    def of(scene: Scene, space: Space, launcher: Launcher, *, sharp: bool) -> "CellBody":
        """The body of a scene in its initial state; `sharp` if stresses are to be sharpened."""
        mesh, device, types = scene.mesh, launcher.device, space.types
        Half, CellNodes = cell_node_types(space)
        n, x, nodes = len(mesh.nodes), mesh.nodes - mesh.middle, CellNodes()
        point = np.zeros(n, dtype=types.Point.numpy_dtype())
        point["x"] = x
        point["phi"] = np.concatenate([scene.initial_velocity, scene.initial_stress], axis=1)
        volume = mesh.node_volumes()
        nodes.point = wp.array(point, dtype=types.Point, device=device)
        nodes.reference = wp.array(x, dtype=types.vector, device=device)
        nodes.mass = wp.array(scene.material.density * volume, dtype=space.real, device=device)
        nodes.volume = wp.array(volume, dtype=space.real, device=device)
        for name, dtype in {
            "half": Half,
            "displacement": types.vector,
            "velocity_gradient": types.tensor,
            "elastic_rate": types.stress,
            "acceleration": types.vector,
            "strained": space.real,
        }.items():
            setattr(nodes, name, wp.zeros(n, dtype=dtype, device=device))
        nodes.books = wp.zeros((len(ENTRIES), n), dtype=wp.float64, device=device)
        shared, slots = shared_parts(scene, space, launcher), has_slots(mesh) and scene.cells is None
        nodes.sharpened = wp.zeros(n if sharp else 1, dtype=types.stress, device=device)
        nodes.flowed = wp.zeros(n if shared["law"].flows else 1, dtype=space.real, device=device)
        table, rigid = node_cells(mesh, slots, device), scene.rigid_cells
        corners = cell_table(mesh, mesh.kind, device)
        cell_mass = scene.material.density * mesh.cell_volumes()
        if scene.cells is not None:
            corners, cell_mass = (
                with_room(corners, table, n),
                np.append(cell_mass, np.zeros(2 * n - len(cell_mass))),
            )
        return CellBody(
            nodes=nodes,
            corners=corners,
            cell_mass=wp.array(cell_mass, dtype=space.real, device=device),
            slots=slots,
            node_cells=table,
            straining=node_cells(mesh, slots, device, without=rigid) if rigid.any() else table,
            **shared,
        )

    def mesh(self) -> Mesh:
        if self.scene.cells is None:
            return super().mesh()
        cells = self.corners.numpy()[self.cell_mass.numpy() > 0.0]
        return mesh_of_cells(self.scene.mesh.nodes, cells, self.scene.mesh.spacing)

    def density(self) -> np.ndarray:
        """ρ of the nodes [kg/mᵈ], shape (n,): m over the volume of their cells as they are now."""
        mesh = self.mesh()
        if self.scene.large_displacements:
            mesh = mesh.with_nodes(mesh.nodes + self.nodes.displacement.numpy())
        return self.nodes.mass.numpy() / mesh.node_volumes()

    def stress(self) -> np.ndarray:
        """The stress that forces come from [Pa], sharpened if any is, stored components, shape (n, s)."""
        sharp = len(self.nodes.sharpened) == len(self.nodes.point)
        return self.nodes.sharpened.numpy().copy() if sharp else super().stress()
