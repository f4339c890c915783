"""Pair lists of one node set around the other, filled from `wp.HashGrid` queries and kept with a skin.

A list holds for each target point the source points within its search radius, its support plus a skin. While
no point has used up half the skin the list contains every neighbour, and the sweep drops the few that lie
outside the support. Building costs about six sweeps (measured: 48 ms against 7.4 ms at 10⁵ points), so a list
pays off after a few steps; nodes move about 10⁻³ Δx a step.

Neighbours are listed in the order of their indices, whatever that of the grid's cells: so sums do not depend on
the grid, and consecutive targets, whose n-th neighbours are then consecutive too, read from the same cache lines:
on a GPU half as many as in the grid's order.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..device.precision import PRECISIONS
from ..device.reduction import LargestMagnitude
from ..physics.space import Space

SKIN = 0.25
"""Skin in lattice spacings. With the default support of 1.8 spacings the radius 2.05 still ends before the next
shell of an undeformed lattice (2.12), so the skin costs no extra pair there."""


@wp.struct
class PairList:
    """Neighbours of target t: index[start[t]] < … < index[start[t + 1] − 1]."""

    start: wp.array(dtype=wp.int32)
    index: wp.array(dtype=wp.int32)


class Search(NamedTuple):
    """How far a list reaches.

    Attributes:
        support: radius of the support in smoothing lengths.
        spacing: lattice spacing [m].
        skin: extra search radius [m].
    """

    support: float
    spacing: float
    skin: float


class Neighbours:
    """The pair list of the sources around each target.

    Args:
        space: what the points are.
        launcher: launches the kernels that make it.
        targets, sources: node structs (material or auxiliary).
        search: how far it reaches.

    Attributes:
        pairs: the list, once built.
        kernels: the kernels that make it.
    """

    def __init__(self, space: Space, launcher: Launcher, *, targets, sources, search: Search):
        self.pairs = PairList()
        self._launcher, self._targets, self._sources, self._search = launcher, targets, sources, search
        self._kernels = _list_kernels(space)
        device, n, m = sources.point.device, targets.point.shape[0], sources.point.shape[0]
        self._origin = np.array(sources.point.numpy()["x"].mean(axis=0), dtype=float)
        self._grid_points = wp.zeros(m, dtype=wp.vec3, device=device)
        self._grid = wp.HashGrid(*_grid_size(sources, search.spacing, space.dim), device=device)
        self._counts = wp.zeros(n + 1, dtype=wp.int32, device=device)
        self.pairs.start = wp.zeros(n + 1, dtype=wp.int32, device=device)
        self._extent = LargestMagnitude(3 * m, PRECISIONS["float32"], launcher)
        self._largest_h = LargestMagnitude(n, space.precision, launcher)
        self.kernels = (*self._kernels, *self._extent.kernels, *self._largest_h.kernels)
        self._vector = space.types.vector

    def build(self) -> None:
        """Make the list anew for the present positions and smoothing lengths."""
        kernels, search, device = self._kernels, self._search, self._grid_points.device
        n = self._targets.point.shape[0]
        origin = self._vector(*self._origin.tolist())
        copied = [self._sources.point, origin, self._grid_points]
        self._launcher.launch(kernels.copy_points, self._grid_points, copied)
        # The grid works in float32: widen its queries by what rounding can do, the sweep tests exactly.
        margin = search.skin + 1e-4 * search.spacing + 1e-6 * self._extent.of(self._grid_points)
        radius = search.support * self._largest_h.of(self._targets.smoothing_length) + margin
        self._grid.build(self._grid_points, radius)
        query = [self._grid.id, self._grid_points, self._targets.point, self._targets.smoothing_length]
        query += [origin, search.support, margin]
        self._launcher.launch(kernels.count, self._targets.point, [*query, self._counts])
        wp.utils.array_scan(self._counts, self.pairs.start, inclusive=False)
        total = int(self.pairs.start[n : n + 1].numpy()[0])
        if self.pairs.index is None or self.pairs.index.shape[0] < total:
            self.pairs.index = wp.empty(int(1.1 * total) + 1, dtype=wp.int32, device=device)
        self._launcher.launch(kernels.fill, self._targets.point, [*query, self.pairs])


def _grid_size(sources, spacing: float, dim: int) -> tuple[int, int, int]:
    """Cells of the hash grid along each axis: about one a search radius, flat where there is no axis.

    No more of them than points, for bodies that fill little of their box: cells wrap around.
    """
    x = sources.point.numpy()["x"]
    cells = np.maximum(np.ceil(np.ptp(x, axis=0) / (2.0 * spacing)), 1.0)
    cells *= min(1.0, len(x) / cells.prod()) ** (1.0 / dim)
    return tuple(np.ceil(cells).astype(int).tolist() + [1] * (3 - dim))


class _Kernels(NamedTuple):
    copy_points: wp.Kernel
    count: wp.Kernel
    fill: wp.Kernel


@cache
def _list_kernels(space: Space) -> _Kernels:
    Point, vector, real = space.types.Point, space.types.vector, space.real

    @wp.func
    def grid_point(x: vector, origin: vector):
        r = x - origin
        p = wp.vec3()
        for k in range(wp.static(space.dim)):
            p[k] = wp.float32(r[k])
        return p

    @forward_kernel
    def copy_points(first: int, points: wp.array(dtype=Point), origin: vector, out: wp.array(dtype=wp.vec3)):
        i = first + wp.tid()
        out[i] = grid_point(points[i].x, origin)

    @forward_kernel
    def count(
        first: int,
        grid: wp.uint64,
        grid_points: wp.array(dtype=wp.vec3),
        targets: wp.array(dtype=Point),
        smoothing_length: wp.array(dtype=real),
        origin: vector,
        support: float,
        margin: float,
        counts: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        p = grid_point(targets[i].x, origin)
        radius = support * wp.float32(smoothing_length[i]) + margin
        found = wp.int32(0)
        for j in wp.hash_grid_query(grid, p, radius):
            if wp.length_sq(grid_points[j] - p) < radius * radius:
                found += 1
        counts[i] = found

    @forward_kernel
    def fill(
        first: int,
        grid: wp.uint64,
        grid_points: wp.array(dtype=wp.vec3),
        targets: wp.array(dtype=Point),
        smoothing_length: wp.array(dtype=real),
        origin: vector,
        support: float,
        margin: float,
        pairs: PairList,
    ):
        i = first + wp.tid()
        p = grid_point(targets[i].x, origin)
        radius = support * wp.float32(smoothing_length[i]) + margin
        start = pairs.start[i]
        end = int(start)
        for j in wp.hash_grid_query(grid, p, radius):
            if wp.length_sq(grid_points[j] - p) < radius * radius:
                k = int(end)
                while k > start and pairs.index[k - 1] > j:
                    pairs.index[k] = pairs.index[k - 1]
                    k -= 1
                pairs.index[k] = j
                end += 1

    return _Kernels(copy_points, count, fill)
