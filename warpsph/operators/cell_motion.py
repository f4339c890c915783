"""Step 14 with volumes from the cells: nodes move, and densities follow from where they are.

A cell's mass is constant, so its density is that mass over its volume, and a node's follows from the mean volume of
its cells. Integrating dρ/dt = −ρ tr d, as published, drifts where the gradient at a node is one-sided: at a free
edge in strong shear by tens of per cent.
"""

from functools import cache

import numpy as np
import warp as wp

from ..ground.linear_algebra import determinant_of
from ..nodes.node_sets import node_types
from ..scene.lattice import Lattice
from .cells import cells_of_nodes
from .motion import Motion

# A cell that folds keeps this share of its initial volume: a density must stay positive.
SMALLEST = 0.1


class CellMotion(Motion):
    """Moves the nodes with v^{n+1/2}; volumes, densities and smoothing lengths follow from the cells.

    Args:
        lattice: the initial lattice.
        support, skin, reference_density, continuum, precision, device: as for `Motion`.
    """

    def __init__(self, lattice: Lattice, support, skin, reference_density, continuum, precision, device):
        super().__init__(len(lattice.nodes), support, skin, reference_density, continuum, precision, device)
        self._of_node = wp.array(cells_of_nodes(lattice), dtype=wp.int32, device=device)
        self._initial_volume = wp.array(lattice.cell_volumes(), dtype=precision.real, device=device)
        self._shift, self._measure, self._share = _kernels(continuum, precision)
        self.kernels = (*self.kernels, self._shift, self._measure, self._share)

    def move(self, nodes, auxiliary, dt: float) -> None:
        """x ← x + Δt v^{n+1/2}; then V, ρ and h of the cells, then of the nodes."""
        device, n, m = nodes.point.device, nodes.point.shape[0], auxiliary.point.shape[0]
        wp.launch(self._shift, n, inputs=[dt, nodes], device=device)
        wp.launch(self._centre, m, inputs=[nodes, auxiliary], device=device)
        inputs = [self._reference_density, self._initial_volume, nodes, auxiliary]
        wp.launch(self._measure, m, inputs=inputs, device=device)
        inputs = [self._reference_density, self._initial_smoothing_length, self._support, 0.5 * self._skin]
        inputs += [self._listed, self._listed_h, self._of_node, auxiliary, nodes, self._outdated]
        wp.launch(self._share, n, inputs=inputs, device=device)


@cache
def _kernels(continuum, precision):
    types, dim = node_types(continuum, precision), continuum.dim
    real, vector, tensor = precision.real, types.vector, types.tensor
    MaterialNodes, AuxiliaryNodes = types.MaterialNodes, types.AuxiliaryNodes
    determinant, corners = determinant_of(dim, precision), 2**dim
    side = precision.mat(corners, dim)(
        *[1.0 if k >> (dim - 1 - a) & 1 else -1.0 for k in range(corners) for a in range(dim)]
    )

    @wp.kernel(module="unique", enable_backward=False)
    def shift(dt: real, nodes: MaterialNodes):
        i = wp.tid()
        u = nodes.displacement[i] + dt * nodes.half_velocity[i]
        nodes.displacement[i] = u
        nodes.point[i].x = nodes.reference[i] + u

    @wp.kernel(module="unique", enable_backward=False)
    def measure(
        reference_density: real,
        initial_volume: wp.array(dtype=real),
        nodes: MaterialNodes,
        auxiliary: AuxiliaryNodes,
    ):
        a = wp.tid()
        edges = tensor()
        for k in range(wp.static(corners)):
            edges += wp.outer(nodes.point[auxiliary.cell[a, k]].x, side[k])
        volume = wp.max(
            determinant(real(wp.static(2.0 / corners)) * edges), real(SMALLEST) * initial_volume[a]
        )
        auxiliary.point[a].volume = volume
        auxiliary.density[a] = reference_density * initial_volume[a] / volume

    @wp.kernel(module="unique", enable_backward=False)
    def share(
        reference_density: real,
        initial_smoothing_length: wp.array(dtype=real),
        support: real,
        half_skin: real,
        listed: wp.array(dtype=vector),
        listed_h: wp.array(dtype=real),
        of_node: wp.array2d(dtype=wp.int32),
        auxiliary: AuxiliaryNodes,
        nodes: MaterialNodes,
        outdated: wp.array(dtype=wp.int32),
    ):
        i = wp.tid()
        total, found = real(0.0), real(0.0)
        for k in range(wp.static(corners)):
            a = of_node[i, k]
            if a >= 0:
                total += auxiliary.point[a].volume
                found += real(1.0)
        volume = total / found
        density = nodes.weight[i] / volume
        h = initial_smoothing_length[i] * wp.pow(reference_density / density, real(wp.static(1.0 / dim)))
        nodes.point[i].volume = volume
        nodes.density[i] = density
        nodes.smoothing_length[i] = h
        u = nodes.displacement[i]
        if wp.length(u - listed[i]) + support * wp.max(h - listed_h[i], real(0.0)) > half_skin:
            outdated[0] = 1

    return shift, measure, share
