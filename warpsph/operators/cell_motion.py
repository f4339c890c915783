"""Step 14 with volumes from the cells: nodes move, and densities follow from where they are.

A cell's mass is constant, so its density is that mass over its volume, and a node's follows from the mean volume
of its cells. Integrating dρ/dt = −ρ tr d, as published, drifts where the gradient at a node is one-sided: at a
free edge in strong shear by tens of per cent.
"""

from functools import cache

import warp as wp

from ..device.arrays import packed
from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..physics.space import Space
from ..scene.scene import Scene
from .cell_means import cells_of_nodes, edges_function
from .motion import Motion
from .spacing import Spacing

# A cell that folds keeps this share of its initial volume: a density must stay positive.
SMALLEST = 0.1


class CellMotion(Motion):
    """Moves the nodes with v^{n+1/2}; volumes, densities and smoothing lengths follow from the cells.

    Args:
        scene, skin, space, launcher, outdated: as for `Motion`.
    """

    def __init__(self, scene: Scene, skin: float, space: Space, launcher: Launcher, outdated: wp.array):
        super().__init__(scene, skin, space, launcher, outdated)
        device, mesh = launcher.device, scene.mesh
        self._of_node = wp.array(cells_of_nodes(mesh), dtype=wp.int32, device=device)
        self._initial_volume = wp.array(mesh.cell_volumes(), dtype=space.real, device=device)
        self._ratio = scene.numerics.smoothing_ratio
        self._cell_h = wp.zeros(len(mesh.cells), dtype=space.real, device=device)
        self._shift, self._measure, self._share = _kernels(space)
        self._spacing = Spacing(len(mesh.cells), space, launcher)
        self.kernels = (self._shift, self._measure, self._share, *self._spacing.kernels)

    def mark(self, nodes, auxiliary) -> None:
        """Remember where the nodes are now: the pair lists were just built for this."""
        super().mark(nodes, auxiliary)
        wp.copy(self._cell_h, auxiliary.smoothing_length)

    def shrinkage(self, nodes, auxiliary) -> float:
        """Least time of a wave from node to node over the initial one, at most 1."""
        return self._spacing.shrinkage(nodes, auxiliary)

    def move(self, nodes, auxiliary, dt: wp.array) -> None:
        """x ← x + Δt v^{n+1/2}; then x, V, ρ and h of the cells, then V, ρ and h of the nodes."""
        self._launcher.launch(self._shift, nodes.point, [dt, nodes], gathers=False)
        inputs = [self._reference_density, self._initial_volume, self._ratio, self._support, 0.5 * self._skin]
        inputs += [self._cell_h, nodes, auxiliary, self._outdated]
        self._launcher.launch(self._measure, auxiliary.point, inputs)
        inputs = [self._support, 0.5 * self._skin, self._listed, self._listed_h, self._of_node]
        inputs += [auxiliary, nodes, self._outdated]
        self._launcher.launch(self._share, nodes.point, inputs)


@cache
def _kernels(space):
    types, dim = space.types, space.dim
    real, vector, tensor = space.real, types.vector, types.tensor
    MaterialNodes, AuxiliaryNodes = types.MaterialNodes, types.AuxiliaryNodes
    determinant, corners = space.algebra.determinant, 2**dim
    edges_of = edges_function(space)

    packed_nodes, packed_auxiliary = packed(MaterialNodes), packed(AuxiliaryNodes)
    packed_tables = packed(wp.array2d(dtype=wp.int32))

    @forward_kernel
    def shift(first: int, dt: wp.array(dtype=real), nodes: MaterialNodes):
        i = first + wp.tid()
        packed_nodes(nodes)
        u = nodes.displacement[i] + dt[0] * nodes.half_velocity[i]
        nodes.displacement[i] = u
        nodes.point[i].x = nodes.reference[i] + u

    @wp.func
    def longest(edges: tensor):
        """The longest of a cell's edges and, over √2, of the diagonals of its faces: about its largest stretch."""
        e = wp.transpose(edges)
        most2 = real(0.0)
        for b in range(wp.static(dim)):
            most2 = wp.max(most2, wp.length_sq(e[b]))
            for c in range(b):
                diagonal2 = wp.max(wp.length_sq(e[b] + e[c]), wp.length_sq(e[b] - e[c]))
                most2 = wp.max(most2, real(0.5) * diagonal2)
        return wp.sqrt(most2)

    @forward_kernel
    def measure(
        first: int,
        reference_density: real,
        initial_volume: wp.array(dtype=real),
        ratio: real,
        support: real,
        half_skin: real,
        listed_h: wp.array(dtype=real),
        nodes: MaterialNodes,
        auxiliary: AuxiliaryNodes,
        outdated: wp.array(dtype=wp.int32),
    ):
        a = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        x = vector()
        for k in range(wp.static(corners)):
            i = auxiliary.cell[a, k]
            x += nodes.point[i].x
        auxiliary.point[a].x = real(wp.static(1.0 / corners)) * x
        edges = edges_of(a, auxiliary, nodes.point)
        h = ratio * longest(edges)
        auxiliary.smoothing_length[a] = h
        if support * wp.max(h - listed_h[a], real(0.0)) > half_skin:
            outdated[0] = 1
        volume = wp.max(determinant(edges), real(SMALLEST) * initial_volume[a])
        auxiliary.volume[a] = volume
        auxiliary.density[a] = reference_density * initial_volume[a] / volume

    @forward_kernel
    def share(
        first: int,
        support: real,
        half_skin: real,
        listed: wp.array(dtype=vector),
        listed_h: wp.array(dtype=real),
        of_node: wp.array2d(dtype=wp.int32),
        auxiliary: AuxiliaryNodes,
        nodes: MaterialNodes,
        outdated: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        packed_tables(of_node)
        total, found, h = real(0.0), real(0.0), real(0.0)
        for k in range(wp.static(corners)):
            a = of_node[i, k]
            if a >= 0:
                total += auxiliary.volume[a]
                found += real(1.0)
                h = wp.max(h, auxiliary.smoothing_length[a])
        volume = total / found
        nodes.volume[i] = volume
        nodes.density[i] = nodes.weight[i] / volume
        nodes.smoothing_length[i] = h
        u = nodes.displacement[i]
        if wp.length(u - listed[i]) + support * wp.max(h - listed_h[i], real(0.0)) > half_skin:
            outdated[0] = 1

    return shift, measure, share
