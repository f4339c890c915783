"""How much sooner than at the start a wave is across the cells around a node, where cells are made anew.

A cell T is as stiff as κ_T Σ_j |u_j|², κ_T = ρ c_p² A_T λ_max(Σ_j ∇N_j ⊗ ∇N_j). So no frequency is above the
largest of ω_i² = Σ_T κ_T/m_i over the cells around a node: the mean of what `cell_limit` says of each, by what it
has of the node's mass. A cell that is flat, for a node has come near an edge of the outline, counts for little;
by itself it would take all of the time step.
"""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.reduction import LargestMagnitude
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cell_body import CellBody, cell_node_types
from ..state.cells import NodeCells, corner_place
from ..state.clock import Clock
from .cell_shape import cell_shape


class NodeLimit:
    """A `Part` in the place of `CellLimit`: the same rate, the mean around each node.

    Args:
        body: the body in its initial state, whose `node_cells` have no slots.
        clock: gives the flag that says when it is outdated.

    Attributes:
        outdated: the flag.
        shrinkage: least time of a wave across the cells around a node over the initial one, at most 1.
        kernels: what measures it.
    """

    def __init__(self, body: CellBody, clock: Clock):
        self._body, self.outdated, self.shrinkage = body, clock.new_flag(), 1.0
        kernels = _stiffness_kernel(body.space, body.kind), _rate_kernel(body.space, body.kind)
        self._stiffen, self._kernel = kernels
        self._stiffness, self._rate = (
            wp.zeros(over.shape[0], dtype=body.space.real, device=body.launcher.device)
            for over in (body.corners, body.nodes.mass)
        )
        self._largest = LargestMagnitude(len(self._rate), body.space.precision, body.launcher)
        self._initial = 0.0  # not measured yet
        self.kernels = (*kernels, *self._largest.kernels)

    def refresh(self) -> None:
        """Measure it in the present configuration, with the present cells."""
        body, launch = self._body, self._body.launcher.launch
        launch(self._stiffen, self._stiffness, [body.corners, body.nodes, self._stiffness])
        launch(self._kernel, self._rate, [self._stiffness, body.node_cells, body.nodes, self._rate])
        fastest = self._largest.of(self._rate)
        self._initial = self._initial or fastest
        self.shrinkage = self._initial / max(fastest, self._initial)
        body.nodes.strained.zero_()
        self.outdated.zero_()


@cache
def _stiffness_kernel(space: Space, kind: CellKind):
    """κ_T over ρ c_p² of each cell."""
    real, shape, CellNodes = space.real, cell_shape(space, kind), cell_node_types(space)[1]
    T = shape.weights

    @forward_kernel
    def stiffness(first: int, corners: wp.array2d(dtype=wp.int32), nodes: CellNodes, result: wp.array(dtype=real)):
        c = first + wp.tid()
        x = shape.Modes()
        for k in range(wp.static(kind.corners)):
            i = corners[c, k]
            x += wp.outer(T[k], nodes.point[i].x)
        B, volume, _ = shape.measure(x)
        result[c] = space.algebra.largest(shape.spread(B)) / wp.abs(volume)

    return stiffness


@cache
def _rate_kernel(space: Space, kind: CellKind):
    """ω_i over √(n ρ c_p²)."""
    real, CellNodes, place_of, per_corner = (
        space.real,
        cell_node_types(space)[1],
        corner_place(kind),
        1.0 / kind.corners,
    )

    @forward_kernel
    def rate(
        first: int,
        stiffness: wp.array(dtype=real),
        table: NodeCells,
        nodes: CellNodes,
        result: wp.array(dtype=real),
    ):
        i = first + wp.tid()
        total = real(0.0)
        for entry in range(table.first[i], table.first[i + 1]):
            c, _ = place_of(entry, table)
            total += stiffness[c]
        result[i] = wp.sqrt(real(per_corner) * total / nodes.mass[i])

    return rate
