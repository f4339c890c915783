"""Nodes that join the outline: one inside that has come to an edge of it, and sees it all but straight.

The cell between them would turn over next. The node is moved onto the edge, so that no area is made or lost, and
the edge becomes two. Each node decides for itself, and looks at its own star only.
"""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..device.precision import Precision
from .outline import INSIDE, OutlineArrays
from .wrapping import Stars

# Tangent of what the angle under which a node sees an edge of one spacing lacks to 180 degrees; of one twice as long
# four times as much.
STRAIGHT = 0.0875


class Peeling:
    """Takes nodes onto the outline.

    Args:
        n: number of nodes.
        spacing: length of an edge [m].
        precision: of the positions.
        launcher: launches the kernels.

    Attributes:
        kernels: all that it launches.
    """

    def __init__(self, n: int, spacing: float, precision: Precision, launcher: Launcher):
        self._launcher, self._find = launcher, _find_kernel(precision)
        self._share = STRAIGHT / spacing**2
        self._onto = wp.zeros(n, dtype=wp.int32, device=launcher.device)
        self.kernels = (self._find, _join)

    def peel(self, positions: wp.array, stars: Stars, outline: OutlineArrays) -> None:
        """Move nodes [m] onto edges of the outline, of which they are then a part."""
        launch, onto = self._launcher.launch, self._onto
        launch(self._find, onto, [self._share, positions, stars, outline, onto])
        launch(_join, onto, [onto, stars, outline])


@cache
def _find_kernel(precision: Precision):
    """Of each node the start of the edge that it joins, or `INSIDE`; it is moved there."""
    real, vector = precision.real, precision.vec(2)

    @forward_kernel
    def find(
        first: int,
        share: real,
        positions: wp.array(dtype=vector),
        stars: Stars,
        outline: OutlineArrays,
        onto: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        joined, degree, x, least = wp.int32(INSIDE), stars.degree[i], positions[i], real(wp.inf)
        place = vector()
        if outline.after[i] == INSIDE:
            for k in range(degree):
                a, b = stars.row[i, k], stars.row[i, (k + 1) % degree]
                if outline.after[a] == b:
                    start, end = positions[a] - x, positions[b] - x
                    ahead = -wp.dot(start, end)
                    height = start[0] * end[1] - start[1] * end[0]
                    edge = end - start
                    near = height < share * wp.dot(edge, edge) * ahead
                    if ahead > real(0.0) and near and height < least * ahead:
                        least = height / ahead
                        joined = a
                        place = x + start - (wp.dot(start, edge) / wp.dot(edge, edge)) * edge
        onto[i] = joined
        if joined != INSIDE:
            positions[i] = place

    return find


@forward_kernel
def _join(first: int, onto: wp.array(dtype=wp.int32), stars: Stars, outline: OutlineArrays):
    """The outline goes through nodes that join it. An edge has one cell, and that has one such node."""
    i = first + wp.tid()
    degree, after = stars.degree[i], outline.after[i]
    if after != INSIDE:
        if degree > 2:
            opposite = stars.row[i, 1]
            if onto[opposite] == i:
                outline.after[i] = opposite
            opposite = stars.row[i, degree - 2]
            if onto[opposite] != INSIDE and onto[opposite] == outline.before[i]:
                outline.before[i] = opposite
    elif onto[i] != INSIDE:
        for k in range(degree):
            if stars.row[i, k] == onto[i]:
                outline.before[i] = onto[i]
                outline.after[i] = stars.row[i, (k + 1) % degree]
