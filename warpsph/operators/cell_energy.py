"""The energy of a body of the scheme `cells`: what its nodes have, and what its steps have booked."""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.reduction import SHARE, Sum
from ..materials.law import Law
from ..physics.space import Space
from ..state.cell_body import (
    CONDITIONS,
    DAMPING,
    ELASTIC,
    ENTRIES,
    FLOW,
    FORCES,
    REMADE,
    CellBody,
    cell_node_types,
)
from ..state.energy import Energy


class CellEnergy:
    """The energy balance of a body, summed on the device in an order of its own.

    Args:
        body: the body.
        rough_loss: energy lost to the rough viscosity [J], a number a cell.
        loads: work of the loads [J], a number a loaded cell.
        tools: work of the tools [J], a number a node.

    Attributes:
        initial: kinetic and elastic energy at t = 0 [J], from the first step on as the leapfrog has them.
        begun: whether a step was made.
        kernels: all that it launches.
    """

    def __init__(self, body: CellBody, *, rough_loss: wp.array, loads: wp.array, tools: wp.array):
        self._body, self._rough_loss, launcher = body, rough_loss, body.launcher
        self._loads, self._tools = loads, tools
        n, device = body.nodes.point.shape[0], launcher.device
        self._sums, self._opening = _sum_kernel(body.space), _opening_kernel(body.space, body.law)
        self._totals = wp.zeros(-(-n // SHARE), dtype=Totals, device=device)
        self._rough = Sum(rough_loss.shape[0], launcher)
        self.kernels = (self._sums, self._opening, *self._rough.kernels)
        self.initial, self.begun = 0.0, False

    def open(self) -> None:
        """Open the books of the initial state."""
        body = self._body
        body.launcher.launch(self._opening, body.nodes.point, [body.parameters, body.nodes])
        self._rough_loss.zero_()
        self.initial = self.now().unaccounted

    def begin(self) -> None:
        """After the first step: what the leapfrog keeps is O(Δt²) from what was there (METHOD section 8)."""
        self.initial, self.begun = self.initial + self.now().unaccounted, True

    def now(self) -> Energy:
        """The balance as it is."""
        self._body.launcher.launch(self._sums, self._totals, [self._body.nodes, self._totals])
        *booked, kinetic = self._totals.numpy().sum(axis=0).tolist()
        return Energy(
            kinetic=kinetic,
            elastic=booked[ELASTIC],
            flow=booked[FLOW],
            viscous=self._rough.of(self._rough_loss),
            damping=booked[DAMPING],
            remade=booked[REMADE],
            gravity=booked[FORCES],
            loads=float(self._loads.numpy().sum()),
            walls=booked[CONDITIONS],
            tools=float(self._tools.numpy().sum()),
            initial=self.initial,
        )


KINETIC = len(ENTRIES)
Totals = wp.types.vector(length=KINETIC + 1, dtype=wp.float64)  # of the books, then the kinetic energy


@cache
def _opening_kernel(space: Space, law: Law):
    """Empty books, but for the energy that the initial stress has."""
    real, CellNodes = space.real, cell_node_types(space)[1]

    @forward_kernel
    def opening(first: int, material: law.Parameters, nodes: CellNodes):
        i = first + wp.tid()
        sigma = space.phi.stress(nodes.point[i].phi)
        twice = space.stress.complementary(sigma, sigma, material.lame, material.shear, material.young)
        for row in range(KINETIC):
            nodes.books[row, i] = wp.float64(0.0)
        nodes.books[ELASTIC, i] = wp.float64(real(0.5) * nodes.volume[i] * twice)

    return opening


@cache
def _sum_kernel(space: Space):
    """Of `SHARE` nodes: all entries, and ½ m v^{n−1/2}·(2 vⁿ − v^{n−1/2}), the leapfrog's kinetic energy."""
    real, CellNodes = space.real, cell_node_types(space)[1]

    @forward_kernel
    def sums(first: int, nodes: CellNodes, result: wp.array(dtype=Totals)):
        k = first + wp.tid()
        total = Totals()
        for i in range(SHARE * k, wp.min(SHARE * (k + 1), nodes.mass.shape[0])):
            half, v = nodes.half[i].v, space.phi.velocity(nodes.point[i].phi)
            for row in range(KINETIC):
                total[row] += nodes.books[row, i]
            total[KINETIC] += wp.float64(real(0.5) * nodes.mass[i] * wp.dot(half, real(2.0) * v - half))
        result[k] = total

    return sums
