"""Nodes in the plane as stars see them: places in whole units, weights, outline; and a grid to look around in."""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..device.precision import Precision
from .exact import REACH, hash_of
from .outline import Outline, outline_arrays

FARTHEST = 2**30  # units from the origin, that differences of places are exact
MOST_CELLS = 2048  # of a hash grid along an axis; beyond it places share cells


@wp.struct
class Site:
    """A node.

    Attributes:
        x, y: its place [units].
        weight: w [units²].
        after: the node that follows it along the outline, or `INSIDE`.
    """

    x: int
    y: int
    weight: int
    after: int


class Sites:
    """The nodes of a body, and who is near.

    Args:
        outline: its outline.
        reach: how far a star sees [m].
        weight: the largest weight of a node [m²]; each has its own, 0 to this.
        precision: of the positions.
        launcher: launches the kernels.

    Attributes:
        unit: length of a unit [m].
        weight: the largest weight [units²].
        site: `Site` of each node.
        outline: `OutlineArrays`, which may change between two calls of `place`.
        far: 1 where a node is too far from the origin for its place to be a number of units.
        grid: the hash grid of the nodes.
        spots: their places in it [reach].
        kernels: all that it launches.
    """

    def __init__(self, outline: Outline, *, reach: float, weight: float, precision: Precision, launcher: Launcher):
        n, device = len(outline.after), launcher.device
        self.unit, self._launcher, self._snap = reach / REACH, launcher, snap_kernel(precision)
        self.weight = round(weight / self.unit**2)
        self.site = wp.zeros(n, dtype=Site, device=device)
        self.outline = outline_arrays(outline, device)
        self.spots = wp.zeros(n, dtype=wp.vec3, device=device)
        self.far = wp.zeros(1, dtype=wp.int32, device=device)
        side = min(MOST_CELLS, max(8, 2 * round(n**0.5)))
        self.grid = wp.HashGrid(side, side, 1, device=device)
        self.kernels = (self._snap,)

    def place(self, positions: wp.array) -> None:
        """Snap the nodes' positions [m] to units; they are not moved themselves."""
        self.far.zero_()
        inputs = [positions, self.outline.after, self.unit, self.weight, self.site, self.spots, self.far]
        self._launcher.launch(self._snap, self.site, inputs)

    def sort(self, width: float) -> None:
        """Sort them into the cells of the grid, of that width [reach]."""
        self.grid.build(self.spots, width)


@cache
def snap_kernel(precision: Precision):
    """Places in units, and in the grid."""
    vector, farthest = precision.vec(2), float(FARTHEST)

    @forward_kernel
    def snap(
        first: int,
        positions: wp.array(dtype=vector),
        after: wp.array(dtype=wp.int32),
        unit: wp.float64,
        weight: int,
        site: wp.array(dtype=Site),
        spots: wp.array(dtype=wp.vec3),
        far: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        x = wp.floor(wp.float64(positions[i][0]) / unit + wp.float64(0.5))
        y = wp.floor(wp.float64(positions[i][1]) / unit + wp.float64(0.5))
        if not wp.max(wp.abs(x), wp.abs(y)) < wp.float64(farthest):
            far[0] = 1
            return
        here = Site()
        here.after = after[i]
        here.x = int(x)
        here.y = int(y)
        here.weight = int((wp.uint64(hash_of(i)) * wp.uint64(weight)) >> wp.uint64(32))
        site[i] = here
        per_reach = wp.float64(wp.static(1.0 / REACH))
        spots[i] = wp.vec3(float(x * per_reach), float(y * per_reach), 0.0)

    return snap
