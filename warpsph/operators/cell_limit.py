"""How much sooner than at the start a wave is across a cell of the scheme `cells`, looked at as the body strains.

ω_T² = n c_p² λ_max(Σ_j ∇N_j ⊗ ∇N_j) bounds the frequencies of a cell; of a lattice's it is (2 c_p/Δx)². Bent
cells have more by n c_p² κ² (1 + b²) Σ_j |∇N_j|², their hourglass modes being held with κ as bending asks for. The
stiffness and a cell's mass stay what they are: c_p² falls as a cell is pressed, and grows as it is stretched.
"""

from abc import ABC, abstractmethod
from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.reduction import LargestMagnitude
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cell_body import CellBody, cell_node_types
from ..state.clock import Clock
from .cell_passes import BENT, BENT_SHARE
from .cell_shape import cell_shape


class Limit(ABC):
    """A `Part`: the rate of the fastest wave, measured anew when a node has strained by 2 %.

    Args:
        body: the body in its initial state.
        clock: gives the flag that says when it is outdated.
        rates: how many of them there are.
        kernels: what measures them.

    Attributes:
        outdated: the flag.
        shrinkage: least time of a wave over the initial one, at most 1.
        kernels: all that it launches.
    """

    def __init__(self, body: CellBody, clock: Clock, *, rates: int, kernels: tuple):
        self._body, self.outdated, self.shrinkage = body, clock.new_flag(), 1.0
        self._rate = wp.zeros(rates, dtype=body.space.real, device=body.launcher.device)
        self._largest = LargestMagnitude(rates, body.space.precision, body.launcher)
        self._initial = 0.0  # not measured yet
        self.kernels = (*kernels, *self._largest.kernels)

    @abstractmethod
    def _measure(self) -> None:
        """Fill `_rate` in the present configuration, with the present cells."""

    def refresh(self) -> None:
        """Measure it now."""
        self._measure()
        fastest = self._largest.of(self._rate)
        self._initial = self._initial or fastest
        self.shrinkage = self._initial / max(fastest, self._initial)
        self._body.nodes.strained.zero_()
        self.outdated.zero_()


class CellLimit(Limit):
    """The `Limit` of each cell by itself."""

    def __init__(self, body: CellBody, clock: Clock):
        self._kernel = _rate_kernel(body.space, body.kind)
        super().__init__(body, clock, rates=body.corners.shape[0], kernels=(self._kernel,))

    def _measure(self) -> None:
        body = self._body
        body.launcher.launch(self._kernel, self._rate, [body.corners, body.cell_mass, body.nodes, self._rate])


@cache
def _rate_kernel(space: Space, kind: CellKind):
    real, shape, CellNodes = space.real, cell_shape(space, kind), cell_node_types(space)[1]
    T, bend = shape.weights, shape.bend

    @forward_kernel
    def rate(
        first: int,
        corners: wp.array2d(dtype=wp.int32),
        cell_mass: wp.array(dtype=real),
        nodes: CellNodes,
        result: wp.array(dtype=real),
    ):
        c = first + wp.tid()
        x = shape.Modes()
        for k in range(wp.static(kind.corners)):
            i = corners[c, k]
            x += wp.outer(T[k], nodes.point[i].x)
        B, volume, frame = shape.measure(x)
        spread = shape.spread(B)
        largest = space.algebra.largest(spread)
        if wp.static(shape.partial > 0):
            b = bend(x, frame)
            share = real(BENT_SHARE) * wp.min(b / (real(BENT) * real(BENT)), real(1.0))
            largest += share * share * (real(1.0) + b) * wp.trace(spread)
        result[c] = wp.sqrt(largest / (cell_mass[c] * wp.abs(volume)))

    return rate
