"""How much sooner than at the start a wave is at the next node, as far as the time step can feel it.

A corrected gradient multiplies neighbours' values by G_J = A⁻¹ g_J r_J, A = Σ g_J r_J r_J, g_J = V_J
(−W′/ξ). By Cauchy and Schwarz Σ |e · G_J| ≤ √(Σ g/λ) along any direction e, λ the least eigenvalue of A,
with equality on a lattice: waves are stable for c_p Δt ≤ 2 √(λ/Σ g). That is METHOD's 2 √m₂ Δx, wherever
the nodes now are. The stiffness stays what it is while the density falls where a body is stretched, so c_p
∝ ρ^−½ there: in a solid stretched three times all round waves are √3 times as fast from node to node as at
the start.
"""

from functools import cache

import numpy as np
import warp as wp

from ..ground.linear_algebra import inverse_of
from ..ground.precision import Precision
from ..ground.smoothing import SMOOTHING_FUNCTIONS
from ..nodes.neighbours import PairList
from ..nodes.node_sets import node_types
from ..scene.dimension import Continuum
from ..scene.numerics import KERNELS
from .sweep import EDGE

# Cells that fold have no spacing left; the step is not shortened beyond this share, or a run would never end.
SMALLEST = 0.25
ITERATIONS = 12  # of the power method; with d ≤ 3 the estimate is good to a per cent


class Spacing:
    """Measures the spacing of the auxiliary nodes' neighbourhoods, over the wave speed there.

    Args:
        m: number of auxiliary nodes.
        kernel: name of the smoothing function.
    """

    def __init__(self, m: int, continuum: Continuum, precision: Precision, kernel: str, device: wp.Device):
        self._kernel = _spacing_kernel(continuum, precision, kernel)
        self._spacing = wp.zeros(m, dtype=precision.real, device=device)
        self._initial: float | None = None
        self.kernels = (self._kernel,)

    def shrinkage(self, pairs: PairList, nodes, auxiliary) -> float:
        """The least time of a wave from node to node over the one at the first call, between `SMALLEST` and 1."""
        inputs = [pairs, nodes, auxiliary]
        device = self._spacing.device
        wp.launch(self._kernel, self._spacing.shape[0], inputs, [self._spacing], device=device)
        smallest = float(np.min(self._spacing.numpy()))
        if self._initial is None:
            self._initial = smallest
        return float(np.clip(smallest / self._initial, SMALLEST, 1.0))


@cache
def _spacing_kernel(continuum: Continuum, precision: Precision, kernel: str):
    types, dim, real = node_types(continuum, precision), continuum.dim, precision.real
    tensor, vector, inverse = types.tensor, types.vector, inverse_of(dim, precision)
    weights = SMOOTHING_FUNCTIONS[kernel](precision)
    support_squared = EDGE * KERNELS[kernel].support ** 2
    start = vector(*[1.0 + 0.3 * a for a in range(dim)])

    @wp.kernel(module="unique", enable_backward=False)
    def spacing(
        pairs: PairList,
        nodes: types.MaterialNodes,
        auxiliary: types.AuxiliaryNodes,
        result: wp.array(dtype=real),
    ):
        a = wp.tid()
        x, h = auxiliary.point[a].x, auxiliary.smoothing_length[a]
        total, moments = real(0.0), tensor()
        for k in range(pairs.start[a], pairs.start[a + 1]):
            neighbour = nodes.point[pairs.index[k]]
            r = neighbour.x - x
            s = wp.dot(r, r) / (h * h)
            if s < real(support_squared):
                _, g = weights(s)
                g *= neighbour.volume
                total += g
                moments += g * wp.outer(r, r)
        stiff, along = inverse(moments), start  # the largest eigenvalue of A⁻¹ by the power method
        largest = real(0.0)
        for _ in range(ITERATIONS):
            along = stiff * along
            largest = wp.length(along)
            along = along / largest
        result[a] = real(2.0) * wp.sqrt(auxiliary.density[a] / (largest * total))

    return spacing
