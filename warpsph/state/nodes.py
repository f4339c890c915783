"""The two node sets of sums: material nodes carry the mass, auxiliary nodes stand in the middle of their cells."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..device.launching import Launcher
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..scene.scene import Scene
from .body import Body, shared_parts
from .cells import cell_table


@dataclass(frozen=True, kw_only=True)
class SumsBody(Body):
    """A body as schemes of sums over neighbours keep it.

    Attributes:
        nodes: material nodes, see `material_nodes`.
        auxiliary: auxiliary nodes, see `auxiliary_nodes`.
    """

    auxiliary: object

    @staticmethod
    def of(scene: Scene, space: Space, launcher: Launcher) -> "SumsBody":
        """The body of a scene in its initial state; auxiliary nodes are still to be centred."""
        device, shared = launcher.device, shared_parts(scene, space, launcher)
        return SumsBody(
            nodes=material_nodes(scene, space, device),
            auxiliary=auxiliary_nodes(scene, space, shared["kind"], device),
            **shared,
        )

    def density(self) -> np.ndarray:
        """ρ of the nodes [kg/mᵈ], shape (n,)."""
        return self.nodes.density.numpy().copy()


def material_nodes(scene: Scene, space: Space, device: wp.Device):
    """The material nodes of a scene in its initial state, as a `MaterialNodes` struct.

    Its arrays, one entry a node: `point`; `volume` V [mᵈ] in sums over neighbours; `reference`, the initial
    position X [m]; `displacement` u [m], the unknown that is integrated, since in float32 Δt·v is often below the
    last bit of x; `density` ρ [kg/mᵈ]; `smoothing_length` h [m]; `weight` ρ₀V₀ [kg], so that V = ρ₀V₀/ρ;
    `half_velocity` v^{n+1/2} [m/s]; `velocity_gradient` L [1/s] of v^{n+1/2}, which turns the stresses in the
    source steps. Positions are from `mesh.middle`: far from it float32 has no digits left.
    """
    mesh, density, types = scene.mesh, scene.material.density, space.types
    n = len(mesh.nodes)
    volume = mesh.node_weights()
    point = np.zeros(n, dtype=types.Point.numpy_dtype())
    point["x"] = mesh.nodes - mesh.middle
    point["phi"] = np.concatenate([scene.initial_velocity, scene.initial_stress], axis=1)
    nodes = types.MaterialNodes()

    def array(values, dtype):
        return wp.array(values, dtype=dtype, device=device)

    nodes.point = array(point, types.Point)
    nodes.volume = array(volume, space.real)
    nodes.reference = array(mesh.nodes - mesh.middle, types.vector)
    nodes.displacement = wp.zeros(n, dtype=types.vector, device=device)
    nodes.density = array(np.full(n, density), space.real)
    nodes.smoothing_length = array(initial_smoothing_length(scene, volume), space.real)
    nodes.weight = array(density * volume, space.real)
    nodes.half_velocity = array(scene.initial_velocity, types.vector)
    nodes.velocity_gradient = wp.zeros(n, dtype=types.tensor, device=device)
    return nodes


def initial_smoothing_length(scene: Scene, volume: np.ndarray) -> np.ndarray:
    """h₀ [m], shape (n,): (smoothing ratio) · (V₀)^{1/d}, the ratio times the local spacing."""
    return scene.numerics.smoothing_ratio * volume ** (1.0 / scene.mesh.dim)


def auxiliary_nodes(scene: Scene, space: Space, kind: CellKind, device: wp.Device):
    """The auxiliary nodes, as an `AuxiliaryNodes` struct, still to be centred in their cells.

    Its arrays, one entry a node: `point`; `volume`, `density` and `smoothing_length`, means over the cell's nodes
    as its position is; `cell`, the indices of those nodes, shape (m, c).
    """
    cells = scene.mesh.cells
    auxiliary = space.types.AuxiliaryNodes()
    auxiliary.point = wp.zeros(len(cells), dtype=space.types.Point, device=device)
    auxiliary.volume = wp.zeros(len(cells), dtype=space.real, device=device)
    auxiliary.density = wp.zeros(len(cells), dtype=space.real, device=device)
    auxiliary.smoothing_length = wp.zeros(len(cells), dtype=space.real, device=device)
    auxiliary.cell = cell_table(scene.mesh, kind, device)
    return auxiliary
