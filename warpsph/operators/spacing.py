"""How much sooner than at the start a wave is at the next node, as far as the time step can feel it.

Kernels are stretched and turned with the cells, so in a cell's own coordinates ξ every gradient is a lattice's,
whose waves are stable for c_p Δt ≤ 2 √m₂ Δx (METHOD section 4). In space that gradient grows with ∇ξ, at most by
its largest singular value: Δx is the least singular value of the cell's edges ∂x/∂ξ, the least distance across it.
The stiffness stays what it is while the density falls where a body is stretched, so that c_p ∝ ρ^−½ there.
"""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..device.reduction import LargestMagnitude
from ..physics.space import Space
from .cell_means import edges_function, frame_function

# A step is not shortened beyond this share, or a run in which cells fold would never end.
SMALLEST = 0.25
DOUBLINGS = 7  # of the power method, which then tells eigenvalues apart that differ by 3 %


class Spacing:
    """Measures the rate of the fastest wave across each cell, its speed over the cell's spacing.

    Args:
        m: number of cells.
    """

    def __init__(self, m: int, space: Space, launcher: Launcher):
        self._launcher, self._kernel = launcher, _spacing_kernel(space)
        self._rate = wp.zeros(m, dtype=space.real, device=launcher.device)
        self._largest = LargestMagnitude(m, space.precision, launcher)
        self._initial: float | None = None
        self.kernels = (self._kernel, *self._largest.kernels)

    def shrinkage(self, nodes, auxiliary) -> float:
        """The least time of a wave from node to node over the one at the first call, between `SMALLEST` and 1."""
        self._launcher.launch(self._kernel, self._rate, [nodes, auxiliary, self._rate])
        fastest = self._largest.of(self._rate)
        if self._initial is None:
            self._initial = fastest
        return max(SMALLEST, self._initial / max(fastest, self._initial))


@cache
def _spacing_kernel(space: Space):
    types, real = space.types, space.real
    edges_of, frame_of = edges_function(space), frame_function(space)

    @forward_kernel
    def spacing(
        first: int, nodes: types.MaterialNodes, auxiliary: types.AuxiliaryNodes, result: wp.array(dtype=real)
    ):
        a = first + wp.tid()
        frame = frame_of(edges_of(a, auxiliary, nodes.point))
        stiff = frame * wp.transpose(frame)
        if wp.trace(stiff) <= real(0.0):
            result[a] = real(0.0)  # a folded cell: its kernels are round
            return
        power = stiff / wp.trace(stiff)
        for _ in range(DOUBLINGS):
            power = power * power
            power = power / wp.trace(power)
        result[a] = wp.sqrt(wp.trace(stiff * power) / auxiliary.density[a])

    return spacing
