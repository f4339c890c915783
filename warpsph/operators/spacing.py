"""How much sooner than at the start a wave is at the next node, as far as the time step can feel it.

Kernels are stretched and turned with the cells, so in a cell's own coordinates ξ every gradient is a lattice's,
whose waves are stable for c_p Δt ≤ 2 √m₂ Δx (METHOD section 4). In space that gradient grows with ∇ξ, at most by
its largest singular value: Δx is the least singular value of the cell's edges ∂x/∂ξ, the least distance across it.
The stiffness stays what it is while the density falls where a body is stretched, so that c_p ∝ ρ^−½ there.
"""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.reduction import LargestMagnitude
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.body import Body
from .cell_means import edges_function, frame_function


class Spacing:
    """Measures the rate of the fastest wave across each cell, its speed over the cell's spacing.

    Args:
        body: the body in its initial state.
    """

    def __init__(self, body: Body):
        self._body, self._kernel = body, _spacing_kernel(body.space, body.kind)
        self._rate = wp.zeros_like(body.auxiliary.density)
        self._largest = LargestMagnitude(len(self._rate), body.space.precision, body.launcher)
        self._initial = 0.0  # not measured yet
        self.kernels = (self._kernel, *self._largest.kernels)

    def shrinkage(self) -> float:
        """Least time of a wave from node to node over the one at the first call, at most 1."""
        body = self._body
        body.launcher.launch(self._kernel, self._rate, [body.nodes, body.auxiliary, self._rate])
        fastest = self._largest.of(self._rate)
        self._initial = self._initial or fastest
        return self._initial / max(fastest, self._initial)


@cache
def _spacing_kernel(space: Space, kind: CellKind):
    real, edges_of, frame_of = space.real, edges_function(space, kind), frame_function(space)

    @forward_kernel
    def spacing(
        first: int,
        nodes: space.types.MaterialNodes,
        auxiliary: space.types.AuxiliaryNodes,
        result: wp.array(dtype=real),
    ):
        a = first + wp.tid()
        frame = frame_of(edges_of(a, auxiliary, nodes.point))
        stiff = frame * wp.transpose(frame)
        if wp.trace(stiff) <= real(0.0):
            result[a] = real(0.0)  # a folded cell: its kernels are round
            return
        result[a] = wp.sqrt(space.algebra.largest(stiff) / auxiliary.density[a])

    return spacing
