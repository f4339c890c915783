"""Step 14 with volumes from the cells: nodes move, and densities follow from where they are.

A cell's mass is constant, so its density is that mass over its volume, and a node's follows from the mean volume
of its cells. Integrating dρ/dt = −ρ tr d, as published, drifts where the gradient at a node is one-sided: at a
free edge in strong shear by tens of per cent.
"""

from functools import cache

import warp as wp

from ..device.arrays import packed
from ..device.compiling import forward_kernel
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.body import Body
from ..state.cells import NodeCells, cell_in_slot, corner_place
from ..state.clock import FOLDED
from .cell_means import edges_function, folded_function
from .motion import Motion
from .spacing import Spacing

# A cell that is pressed flat keeps this share of its initial volume: a density must stay positive.
LEAST_VOLUME_SHARE = 0.1


class CellMotion(Motion):
    """Moves the nodes with v^{n+1/2}; volumes, densities and smoothing lengths follow from the cells.

    Args:
        body, skin, outdated, faults: as for `Motion`.
    """

    def __init__(self, body: Body, *, skin: float, outdated: wp.array, faults: wp.array):
        super().__init__(body, skin=skin, outdated=outdated, faults=faults)
        space, device = body.space, body.launcher.device
        volume = body.scene.mesh.middle_volumes().astype(space.precision.dtype)
        mass = space.precision.dtype(body.scene.material.density) * volume
        self._initial_volume, self._mass = (
            wp.array(values, dtype=space.real, device=device) for values in (volume, mass)
        )
        self._ratio = body.scene.numerics.smoothing_ratio
        self._cell_h = wp.zeros_like(body.auxiliary.smoothing_length)
        self._spacing = Spacing(body)
        self._shift, self._measure = _shift_kernel(space), _measure_kernel(space, body.kind)
        self._share = _share_kernel(space, body.kind, body.slots)
        self.kernels = (self._shift, self._measure, self._share, *self._spacing.kernels)

    def mark(self) -> None:
        """Remember where the nodes are now: the pair lists were just built for this."""
        super().mark()
        wp.copy(self._cell_h, self._body.auxiliary.smoothing_length)

    def shrinkage(self) -> float:
        """Least time of a wave from node to node over the initial one, at most 1."""
        return self._spacing.shrinkage()

    def move(self, dt: wp.array) -> None:
        """x ← x + Δt v^{n+1/2}; then x, V, ρ and h of the cells, then V, ρ and h of the nodes."""
        nodes, auxiliary, launch = self._body.nodes, self._body.auxiliary, self._body.launcher.launch
        launch(self._shift, nodes.point, [dt, nodes], gathers=False)
        inputs = [self._mass, self._initial_volume, self._ratio, self._support, 0.5 * self._skin]
        inputs += [self._cell_h, nodes, auxiliary, self._outdated, self._faults]
        launch(self._measure, auxiliary.point, inputs)
        inputs = [self._support, 0.5 * self._skin, self._listed, self._listed_h, self._body.node_cells]
        inputs += [auxiliary, nodes, self._outdated]
        launch(self._share, nodes.point, inputs)


@cache
def _shift_kernel(space: Space):
    packed_nodes = packed(space.types.MaterialNodes)

    @forward_kernel
    def shift(first: int, dt: wp.array(dtype=space.real), nodes: space.types.MaterialNodes):
        i = first + wp.tid()
        packed_nodes(nodes)
        u = nodes.displacement[i] + dt[0] * nodes.half_velocity[i]
        nodes.displacement[i] = u
        nodes.point[i].x = nodes.reference[i] + u

    return shift


@cache
def _longest(space: Space) -> wp.Function:
    """Edges of a cell → the longest of them and, over √2, of the diagonals of its faces: about its stretch."""
    real = space.real

    @wp.func
    def longest(edges: space.types.tensor):
        e = wp.transpose(edges)
        most2 = real(0.0)
        for b in range(wp.static(space.dim)):
            most2 = wp.max(most2, wp.length_sq(e[b]))
            for c in range(b):
                diagonal2 = wp.max(wp.length_sq(e[b] + e[c]), wp.length_sq(e[b] - e[c]))
                most2 = wp.max(most2, real(0.5) * diagonal2)
        return wp.sqrt(most2)

    return longest


@cache
def _measure_kernel(space: Space, kind: CellKind):
    types, real, longest = space.types, space.real, _longest(space)
    edges_of, has_folded = edges_function(space, kind), folded_function(space)
    packed_nodes, packed_auxiliary = packed(types.MaterialNodes), packed(types.AuxiliaryNodes)

    @forward_kernel
    def measure(
        first: int,
        mass: wp.array(dtype=real),
        initial_volume: wp.array(dtype=real),
        ratio: real,
        support: real,
        half_skin: real,
        listed_h: wp.array(dtype=real),
        nodes: types.MaterialNodes,
        auxiliary: types.AuxiliaryNodes,
        outdated: wp.array(dtype=wp.int32),
        faults: wp.array(dtype=wp.int32),
    ):
        a = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        x = types.vector()
        for k in range(wp.static(kind.corners)):
            i = auxiliary.cell[a, k]
            x += nodes.point[i].x
        auxiliary.point[a].x = real(wp.static(1.0 / kind.corners)) * x
        edges = edges_of(a, auxiliary, nodes.point)
        h = ratio * longest(edges)
        auxiliary.smoothing_length[a] = h
        if support * wp.max(h - listed_h[a], real(0.0)) > half_skin:
            outdated[0] = 1
        if has_folded(edges):
            faults[FOLDED] = 1
        volume = wp.max(space.algebra.determinant(edges), real(LEAST_VOLUME_SHARE) * initial_volume[a])
        auxiliary.volume[a] = volume
        auxiliary.density[a] = mass[a] / volume

    return measure


@cache
def _share_kernel(space: Space, kind: CellKind, slots: bool):
    types, real, place_of, cell_at = space.types, space.real, corner_place(kind), cell_in_slot(kind)
    packed_nodes, packed_auxiliary = packed(types.MaterialNodes), packed(types.AuxiliaryNodes)

    @forward_kernel
    def share(
        first: int,
        support: real,
        half_skin: real,
        listed: wp.array(dtype=types.vector),
        listed_h: wp.array(dtype=real),
        table: NodeCells,
        auxiliary: types.AuxiliaryNodes,
        nodes: types.MaterialNodes,
        outdated: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        total, found, h = real(0.0), real(0.0), real(0.0)
        if wp.static(slots):
            for k in range(wp.static(kind.corners)):
                a = cell_at(i, k, table)
                if a >= 0:
                    total += auxiliary.volume[a]
                    found += real(1.0)
                    h = wp.max(h, auxiliary.smoothing_length[a])
        else:  # the same, entry by entry
            for entry in range(table.first[i], table.first[i + 1]):
                a, _ = place_of(entry, table)
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

    return share
