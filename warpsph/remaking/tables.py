"""Cells and the cells around each node, from stars: by scans, each in a place that follows from the stars alone.

A cell belongs to its corner of least index, which is the first in the table; cells stand in the order of their
owners, and round an owner counterclockwise. The cells around a node stand in the order of its star.
"""

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..state.cells import NodeCells
from .outline import INSIDE
from .sites import Site
from .wrapping import Stars, neighbour


class CellTables:
    """The tables of a body of triangles.

    Args:
        n: number of nodes.
        launcher: launches the kernels.

    Attributes:
        corners: node indices of each cell, counterclockwise; with room for 2n cells, more than there can be.
        node_cells: `NodeCells`, with room.
        cells: how many there are.
        kernels: all that it launches.
    """

    def __init__(self, n: int, launcher: Launcher):
        self._launcher, self.kernels, device = launcher, (_count, _fill), launcher.device
        self._owned, self._around, self._first = (wp.zeros(n + 1, dtype=wp.int32, device=device) for _ in range(3))
        self._lost = wp.zeros(1, dtype=wp.int32, device=device)
        self.corners = wp.zeros((2 * n, 3), dtype=wp.int32, device=device)
        self.node_cells, self.cells = NodeCells(), 0
        self.node_cells.first = wp.zeros(n + 1, dtype=wp.int32, device=device)
        self.node_cells.place = wp.zeros(6 * n, dtype=wp.int32, device=device)

    def fill(self, site: wp.array, stars: Stars) -> bool:
        """Make the tables; whether each node has cells, and each cell was found by its three corners.

        If not, the tables are of no use.
        """
        launch, first = self._launcher.launch, self.node_cells.first
        self._lost.zero_()
        launch(_count, site, [site, stars, self._owned, self._around, self._lost])
        wp.utils.array_scan(self._owned, self._first, inclusive=False)
        wp.utils.array_scan(self._around, first, inclusive=False)
        self.cells, around = int(self._first[-1:].numpy()[0]), int(first[-1:].numpy()[0])
        if around != 3 * self.cells or self.cells > len(self.corners):
            return False
        launch(_fill, site, [site, stars, self._first, self.corners, self.node_cells, self._lost])
        return not self._lost.numpy()[0]


@wp.func
def _cells_of(i: int, site: wp.array(dtype=Site), stars: Stars) -> int:
    """How many cells a star has."""
    degree = stars.degree[i]
    if site[i].after != INSIDE:
        return wp.max(degree - 1, 0)
    return degree


@forward_kernel
def _count(
    first: int,
    site: wp.array(dtype=Site),
    stars: Stars,
    owned: wp.array(dtype=wp.int32),
    around: wp.array(dtype=wp.int32),
    lost: wp.array(dtype=wp.int32),
):
    """Cells that a node owns, and that are around it."""
    i = first + wp.tid()
    cells, own = _cells_of(i, site, stars), wp.int32(0)
    if cells == 0:
        lost[0] = 1
    for k in range(cells):
        if i < wp.min(stars.row[i, k], neighbour(i, k + 1, stars.degree[i], stars)):
            own += 1
    owned[i] = own
    around[i] = cells


@wp.func
def _rank(owner: int, a: int, b: int, site: wp.array(dtype=Site), stars: Stars) -> int:
    """Which of its owner's cells (owner, a, b) is, −1 if none."""
    rank, degree = wp.int32(0), stars.degree[owner]
    for k in range(_cells_of(owner, site, stars)):
        p, q = stars.row[owner, k], neighbour(owner, k + 1, degree, stars)
        if owner < wp.min(p, q):
            if p == a:
                if q == b:
                    return rank
                return -1
            rank += 1
    return -1


@forward_kernel
def _fill(
    first: int,
    site: wp.array(dtype=Site),
    stars: Stars,
    first_cell: wp.array(dtype=wp.int32),
    corners: wp.array2d(dtype=wp.int32),
    node_cells: NodeCells,
    lost: wp.array(dtype=wp.int32),
):
    """The cells that a node owns, and the places of all that are around it."""
    i = first + wp.tid()
    start, degree, rank = node_cells.first[i], stars.degree[i], wp.int32(0)
    for k in range(_cells_of(i, site, stars)):
        a, b = stars.row[i, k], neighbour(i, k + 1, degree, stars)
        place = wp.int32(0)
        if i < wp.min(a, b):
            cell = first_cell[i] + rank
            corners[cell, 0] = i
            corners[cell, 1] = a
            corners[cell, 2] = b
            place = 3 * cell
            rank += 1
        elif a < b:  # a's cell goes on to b, then to i
            its = _rank(a, b, i, site, stars)
            place = 3 * (first_cell[a] + its) + 2
            if its < 0:
                lost[0] = 1
        else:
            its = _rank(b, i, a, site, stars)
            place = 3 * (first_cell[b] + its) + 1
            if its < 0:
                lost[0] = 1
        node_cells.place[start + k] = place
