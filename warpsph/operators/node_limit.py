"""How much sooner than at the start a wave is across the cells around a node, where cells are made anew.

A cell T is as stiff as κ_T Σ_j |u_j|², κ_T = ρ c_p² A_T λ_max(Σ_j ∇N_j ⊗ ∇N_j). So no frequency is above the
largest of ω_i² = Σ_T κ_T/m_i over the cells around a node: the mean of what `cell_limit` says of each, by what it
has of the node's mass. A cell that is flat, for a node has come near an edge of the outline, counts for little;
by itself it would take all of the time step.
"""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cell_body import CellBody, cell_node_types
from ..state.cells import NodeCells, corner_place
from ..state.clock import Clock
from .cell_limit import Limit
from .cell_shape import cell_shape


class NodeLimit(Limit):
    """The `Limit` of the cells around each node; the body's `node_cells` have no slots."""

    def __init__(self, body: CellBody, clock: Clock):
        self._stiffen, self._kernel = _stiffness_kernel(body.space, body.kind), _rate_kernel(body.space, body.kind)
        self._stiffness = wp.zeros(body.corners.shape[0], dtype=body.space.real, device=body.launcher.device)
        super().__init__(body, clock, rates=body.nodes.mass.shape[0], kernels=(self._stiffen, self._kernel))

    def _measure(self) -> None:
        body, launch = self._body, self._body.launcher.launch
        launch(self._stiffen, self._stiffness, [body.corners, body.nodes, self._stiffness])
        launch(self._kernel, self._rate, [self._stiffness, body.node_cells, body.nodes, self._rate])


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
