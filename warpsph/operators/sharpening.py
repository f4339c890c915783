"""Sharpened fields of the scheme `cells`: what a mean over corners takes off short waves is put back beforehand.

    K = 1 + C,      (C f)_i = (1/V_i) Σ_T c_T (A_T/n) (f_i − f̄_T),      f̄_T the mean over the corners of cell T.

Forces take K σ in place of σ, and σ is strained by K L in place of L. In the sum over nodes with weights V, K is
its own adjoint, so Σ V σ : K L is still the power of the forces, in any configuration and with any c_T: momentum,
angular momentum and energy are kept, and constants are left alone. On a line C is −c δ²/4: with c = ⅔ the mean
over two corners becomes the interpolation of fourth order, and next to nothing is dispersed. Where soil flows
c_T = c e_T is 0, or limit loads rise.
"""

from functools import cache

import numpy as np
import warp as wp

from ..device.arrays import packed
from ..device.compiling import forward_kernel
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cell_body import CellBody, cell_node_types
from ..state.cells import NodeCells, cell_in_slot, corner_place


class Sharpening:
    """K of a body; with c = 0 it is the identity, and does nothing.

    Args:
        body: the body.
        c: how far waves are sharpened [-].
        numbers: what the strain pass leaves of each cell.

    Attributes:
        on: whether c > 0.
        means: `Means` of the cells.
        kernels: what it launches.
    """

    def __init__(self, body: CellBody, c: float, numbers: wp.array):
        space, kind, device = body.space, body.kind, body.launcher.device
        self._body, self._c, self._numbers, self.on = body, c, numbers, c > 0.0
        self.means, cells = sharp_types(space)(), body.corners.shape[0] if self.on else 1
        self.means.weight = wp.zeros(cells, dtype=space.real, device=device)
        self.means.rate = wp.zeros(cells, dtype=space.types.tensor, device=device)
        self.means.stress = wp.zeros(cells, dtype=space.types.stress, device=device)
        self._rate_mean, self._stress_mean = rate_mean_kernel(space, kind), stress_mean_kernel(space, kind)
        self._sharpen = sharpen_kernel(space, kind, body.slots)
        self.kernels = (self._rate_mean, self._stress_mean, self._sharpen) if self.on else ()

    def weigh(self) -> None:
        """Weights of the cells, and means of L: what `around` needs to sharpen L."""
        if self.on:
            body = self._body
            inputs = [self._c, body.corners, self._numbers, body.nodes, self.means]
            body.launcher.launch(self._rate_mean, body.corners, inputs)

    def stresses(self) -> None:
        """K σ of the nodes."""
        if self.on:
            body, launch = self._body, self._body.launcher.launch
            launch(self._stress_mean, body.corners, [body.corners, body.nodes, self.means])
            launch(self._sharpen, body.nodes.point, [body.straining, self.means, body.nodes])

    def undo(self, given: np.ndarray) -> None:
        """Let σ be what, sharpened, is the stress that was given, so that what balanced the loads still does.

        The eigenvalues of K are within [1, 1 + c]: an error is a quarter of what it was, or less, each time.
        """
        if not self.on:
            return
        points, d = self._body.nodes.point, self._body.space.dim
        values = points.numpy()
        for _ in range(2 * np.finfo(values["phi"].dtype).precision):
            self.stresses()
            values["phi"][:, d:] += (given - self._body.nodes.sharpened.numpy()) / (1.0 + 0.5 * self._c)
            points.assign(values)


@cache
def sharp_types(space: Space) -> type:
    """Warp struct of a cell's means: c_T A_T/n, and that times the means of L and of σ."""
    types = space.types

    @wp.struct
    class Means:
        weight: wp.array(dtype=space.real)
        rate: wp.array(dtype=types.tensor)
        stress: wp.array(dtype=types.stress)

    return Means


@cache
def rate_mean_kernel(space: Space, kind: CellKind):
    """c_T A_T/n of each cell, and that times the mean of L over its corners."""
    real, CellNodes, Means = space.real, cell_node_types(space)[1], sharp_types(space)
    packed_nodes, packed_table = packed(CellNodes), packed(wp.array2d(dtype=wp.int32))
    packed_means, per_corner = packed(Means), 1.0 / kind.corners

    @forward_kernel
    def rate_mean(
        first: int,
        sharpening: real,
        corners: wp.array2d(dtype=wp.int32),
        numbers: wp.array2d(dtype=real),
        nodes: CellNodes,
        means: Means,
    ):
        c = first + wp.tid()
        packed_nodes(nodes)
        packed_table(corners)
        packed_means(means)
        mean = space.types.tensor()
        for k in range(wp.static(kind.corners)):
            mean += nodes.velocity_gradient[corners[c, k]]
        weight = sharpening * numbers[c, 1] * numbers[c, 0]
        means.weight[c] = weight
        means.rate[c] = (real(per_corner) * weight) * mean

    return rate_mean


@cache
def stress_mean_kernel(space: Space, kind: CellKind):
    """c_T A_T/n times the mean of σ over the corners of each cell."""
    real, CellNodes, Means = space.real, cell_node_types(space)[1], sharp_types(space)
    packed_nodes, packed_table = packed(CellNodes), packed(wp.array2d(dtype=wp.int32))
    packed_means, per_corner = packed(Means), 1.0 / kind.corners

    @forward_kernel
    def stress_mean(first: int, corners: wp.array2d(dtype=wp.int32), nodes: CellNodes, means: Means):
        c = first + wp.tid()
        packed_nodes(nodes)
        packed_table(corners)
        packed_means(means)
        mean = space.types.stress()
        for k in range(wp.static(kind.corners)):
            i = corners[c, k]
            mean += space.phi.stress(nodes.point[i].phi)
        means.stress[c] = (real(per_corner) * means.weight[c]) * mean

    return stress_mean


@cache
def around(space: Space, kind: CellKind, slots: bool, dtype: type) -> wp.Function:
    """(node, its cells, weights, means times weights) → the sums of both over its cells."""
    real, cell_at, place_of = space.real, cell_in_slot(kind), corner_place(kind)

    @wp.func
    def sums(i: int, table: NodeCells, weights: wp.array(dtype=real), means: wp.array(dtype=dtype)):
        weight, mean = real(0.0), dtype()
        if wp.static(slots):
            for k in range(wp.static(kind.corners)):
                c = cell_at(i, k, table)
                if c >= 0:
                    weight += weights[c]
                    mean += means[c]
        else:
            for entry in range(table.first[i], table.first[i + 1]):
                c, _ = place_of(entry, table)
                weight += weights[c]
                mean += means[c]
        return weight, mean

    return sums


@cache
def sharpen_kernel(space: Space, kind: CellKind, slots: bool):
    """K σ of each node."""
    CellNodes, Means = cell_node_types(space)[1], sharp_types(space)
    packed_nodes, packed_means = packed(CellNodes), packed(Means)
    sums = around(space, kind, slots, space.types.stress)

    @forward_kernel
    def sharpen(first: int, table: NodeCells, means: Means, nodes: CellNodes):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_means(means)
        sigma = space.phi.stress(nodes.point[i].phi)
        weight, mean = sums(i, table, means.weight, means.stress)
        nodes.sharpened[i] = sigma + (weight * sigma - mean) / nodes.volume[i]

    return sharpen
