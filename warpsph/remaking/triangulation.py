"""The cells of a body in the plane, made from the places of its nodes: all, or those that no longer serve."""

from __future__ import annotations

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..device.precision import Precision
from ..state.cells import NodeCells
from .checking import check, follow
from .chosen import Chosen
from .exact import REACH
from .outline import INSIDE, Outline, OutlineArrays
from .sites import Sites
from .surfacing import Surfacing
from .tables import CellTables
from .wrapping import CERTAIN, MOST_NEIGHBOURS, Stars, wrap_kernel

MOST_NEAR, MOST_FAR = (64, 48), (256, 96)  # nodes, and edges of the outline, that a star sees near, and in all
ROUNDED = 1.001  # places in the grid are rounded to float32


class Triangulation:
    """Cells of Delaunay inside an outline, or of a power diagram where nodes have weights.

    Args:
        outline: the outline of the body.
        near: how far a star looks first [m]: two spacings.
        reach: how far it sees [m]; three spacings serve where nodes are spread evenly.
        weight: the largest weight of a node [m²]: with it cells of a lattice that turns stay what they are.
        precision: of the positions.
        launcher: launches the kernels.

    Attributes:
        outline: `OutlineArrays`, the outline as it is.
        surfacing: takes nodes onto it, and off it.
        tables: the cells, and those around each node.
        sound: whether there are cells to renew.
        generation: for who uses them: which cells these are.
        wrapped: how many stars were wrapped when it was last made or renewed.
        kernels: all that it launches.
    """

    def __init__(
        self,
        outline: Outline,
        *,
        near: float,
        reach: float,
        weight: float = 0.0,
        precision: Precision,
        launcher: Launcher,
    ):
        n, device = len(outline.after), launcher.device
        self._launcher, self.generation, self.wrapped, self.sound, self._near = launcher, 0, 0, False, near / reach
        self._looks = ((self._near, wrap_kernel(*MOST_NEAR)), (1.0, wrap_kernel(*MOST_FAR)))
        self._sites = Sites(outline, reach=reach, weight=weight, precision=precision, launcher=launcher)
        self._sorted = False
        self._chosen, self.tables, self._stars = Chosen(n, launcher), CellTables(n, launcher), Stars()
        self._stars.degree, self._stars.fate, self._fresh = (
            wp.zeros(n, dtype=wp.int32, device=device) for _ in range(3)
        )
        self._stars.row = wp.zeros((n, MOST_NEIGHBOURS), dtype=wp.int32, device=device)
        self.outline, self.surfacing = self._sites.outline, Surfacing(n, 0.5 * near, precision, launcher)
        parts = (self._sites, self._chosen, self.tables, self.surfacing)
        self.kernels = (check, follow, _look_farther, _adopt, *(kernel for _, kernel in self._looks))
        self.kernels += tuple(kernel for part in parts for kernel in part.kernels)

    def make(self, positions: wp.array) -> bool:
        """Make all cells anew.

        Args:
            positions: of the nodes, from a fixed origin [m], shape (n,).

        Returns:
            Whether they are the triangulation. If not, the tables are of no use: the outline crosses itself or is
            crossed by a node, nodes are in one place, or cells are larger than the reach.
        """
        self._place(positions)
        self._chosen.flags.fill_(1)
        self._wrap(self._chosen.nodes())
        return self._fill()

    def renew(self, positions: wp.array) -> bool:
        """The same cells as `make`, from those there are: only stars that no longer serve are wrapped anew."""
        if not self.sound:
            return self.make(positions)
        self._place(positions)
        launch, site, stars = self._launcher.launch, self._sites.site, self._stars
        launch(check, site, [site, self._sites.outline.before, stars, self._chosen.flags])
        while (nodes := self._chosen.nodes()) is not None:
            self._wrap(nodes)
            launch(follow, site, [site, self._fresh, stars, self._chosen.flags])
        return self._fill() if self.wrapped else True

    def adopt(self, corners: wp.array, node_cells: NodeCells) -> None:
        """Take cells that `tables` had once for those there are, to renew them."""
        inputs = [corners, node_cells, self.outline, self._stars]
        self._launcher.launch(_adopt, self._stars.degree, inputs)
        self.sound = True

    def join(self, positions: wp.array, ways: wp.array) -> None:
        """Take nodes [m] onto the outline before cells are renewed; `ways`: see `Surfacing.join`."""
        self.surfacing.join(positions, ways, self._stars, self.outline)

    def leave(self, positions: wp.array) -> None:
        """Take nodes [m] off the outline before cells are renewed."""
        self.surfacing.leave(positions, self._stars, self.outline)

    def _place(self, positions: wp.array) -> None:
        self._sites.place(positions)
        self._sorted, self.wrapped = False, 0
        self._fresh.zero_()

    def _wrap(self, nodes: wp.array) -> None:
        """Wrap the stars of some nodes, which are flagged, those that may not be certain with a longer reach."""
        sites, self.wrapped = self._sites, self.wrapped + len(nodes)
        if not self._sorted:
            sites.sort(self._near)
            self._sorted = True
        for share, wrap in self._looks:
            inputs = [nodes, sites.grid.id, sites.spots, share * ROUNDED, int(share * REACH), sites.weight]
            self._launcher.launch(wrap, nodes, [*inputs, sites.site, sites.outline.before, self._stars])
            inputs = [self._stars.fate, self._fresh, self._chosen.flags]
            self._launcher.launch(_look_farther, self._chosen.flags, inputs)
            if (nodes := self._chosen.nodes()) is None:
                return

    def _fill(self) -> bool:
        self.sound = not self._sites.far.numpy()[0] and self.tables.fill(self._sites.site, self._stars)
        return self.sound


@forward_kernel
def _look_farther(
    first: int,
    fate: wp.array(dtype=wp.int32),
    fresh: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int32),
):
    """Flagged nodes have been wrapped: they are fresh, and stay flagged where their star is not certain."""
    i = first + wp.tid()
    if flags[i] != 0:
        fresh[i] = 1
        flags[i] = int(fate[i] != CERTAIN)


@forward_kernel
def _adopt(
    first: int,
    corners: wp.array2d(dtype=wp.int32),
    node_cells: NodeCells,
    outline: OutlineArrays,
    stars: Stars,
):
    """The star of a node from the cells around it, which stand in its order."""
    i = first + wp.tid()
    start, cells = node_cells.first[i], node_cells.first[i + 1] - node_cells.first[i]
    for k in range(cells):
        place = node_cells.place[start + k]
        stars.row[i, k] = corners[place // 3, (place + 1) % 3]
        if k == cells - 1 and outline.after[i] != INSIDE:
            stars.row[i, cells] = corners[place // 3, (place + 2) % 3]
    stars.degree[i] = wp.where(outline.after[i] != INSIDE, cells + 1, cells)
