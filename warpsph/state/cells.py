"""Cells on the device: which cells a node is a corner of, and what a pass over the cells leaves of each."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..device.arrays import natural, packed
from ..errors import SceneError
from ..mesh.kinds import CellKind
from ..mesh.mesh import Mesh
from ..physics.space import Space

ALIGNED = 4  # a cell begins at a multiple of so many numbers, for vector registers


@wp.struct
class NodeCells:
    """The cells around node i: place[first[i]], …, place[first[i + 1] − 1], each cell · corners + corner.

    With slots, as a lattice has them, place[corners · i + k] is the cell whose corner k node i is, or −1.
    """

    first: wp.array(dtype=wp.int32)
    place: wp.array(dtype=wp.int32)


def cell_table(mesh: Mesh, kind: CellKind, device: wp.Device) -> wp.array:
    """The corners of each cell, shape (m, c), for kernels that were built for a kind.

    Raises:
        SceneError: the cells have another number of corners; kernels would read across their rows.
    """
    if mesh.cells.shape[1] != kind.corners:
        allowed = f"kernels built for a {kind.name} read {kind.corners} corners a cell"
        raise SceneError("cells", f"{mesh.cells.shape[1]} corners", allowed)
    return wp.array(mesh.cells, dtype=wp.int32, device=device)


def has_slots(mesh: Mesh) -> bool:
    """Whether no node is the same corner of two cells, as in a lattice, so that each corner can have a slot."""
    corners = mesh.kind.corners
    return bool(np.bincount((mesh.cells * corners + np.arange(corners)).ravel()).max() == 1)


def node_cells(mesh: Mesh, slots: bool, device: wp.Device, without: np.ndarray | None = None) -> NodeCells:
    """The cells around each node, in the order of the corners it is of them.

    Args:
        mesh: the mesh.
        slots: whether each corner has one.
        device: where the table is for.
        without: cells to leave out, boolean, shape (m,).

    In slots they are found without a look at where a row begins, and loops over them are unrolled, with the corner
    known to the compiler: 3 % of a step in the plane.
    """
    (first, place), corners = mesh.cells_of_nodes(), mesh.kind.corners
    if without is not None:
        kept = ~without[place // corners]
        first, place = np.append(0, np.cumsum(kept))[first], place[kept]
    if slots:
        rows = corners * np.arange(len(mesh.nodes) + 1)
        cells = np.full(rows[-1], -1)
        cells[np.repeat(rows[:-1], np.diff(first)) + place % corners] = place // corners
        first, place = rows, cells
    table = NodeCells()
    table.first, table.place = (wp.array(row, dtype=wp.int32, device=device) for row in (first, place))
    return table


@cache
def cell_in_slot(kind: CellKind) -> wp.Function:
    """(node, corner, NodeCells with slots) → the cell whose corner the node is, or −1."""
    packed_table = packed(NodeCells)

    @wp.func
    def cell_at(i: int, k: int, table: NodeCells):
        packed_table(table)
        natural(i)
        return table.place[wp.static(kind.corners) * i + k]

    return cell_at


@cache
def corner_place(kind: CellKind) -> wp.Function:
    """(number of an entry, NodeCells) → (cell, which corner of it the node is)."""
    packed_table = packed(NodeCells)

    @wp.func
    def place_of(entry: int, table: NodeCells):
        packed_table(table)
        place = table.place[entry]
        natural(place)
        cell = place // wp.static(kind.corners)
        return cell, place - wp.static(kind.corners) * cell

    return place_of


@dataclass(frozen=True)
class CellStore:
    """What is kept of each cell from one pass to the next, as numbers side by side.

    Attributes:
        columns: number of hourglass modes kept; at least one, since Warp has no matrix without columns.
        Cell: of one cell ∇φ in its middle `gradient`, `modes` (a column each), `frame` (∇ξ_a in row a), `reach`,
            how far towards its corners strain rates may be taken.
        by_number: whether the same number of consecutive cells stands side by side in memory, for a GPU whose
            threads read it together, or all the numbers of a cell, for the vector registers of a CPU.
        size: how many numbers a cell has, spare ones included.
        write: (cell, Cell, numbers) → nothing.
        read: (cell, numbers) → Cell.
        packed: (numbers) → nothing: for the compiler, see `warpsph.device.arrays`.
    """

    columns: int
    Cell: type
    by_number: bool
    size: int
    write: wp.Function
    read: wp.Function
    packed: wp.Function

    def new(self, m: int, space: Space, device: wp.Device) -> wp.array:
        """The numbers of m cells, zero, shape (size, m)."""
        if self.by_number:
            return wp.zeros((self.size, m), dtype=space.real, device=device)
        return wp.zeros((m, self.size), dtype=space.real, device=device).transpose()


@cache
def cell_store(space: Space, kind: CellKind, by_number: bool) -> CellStore:
    """How the cells of a kind are kept."""
    d, size, columns = space.dim, space.types.size, max(1, len(kind.modes))
    modes_at = size * d  # where a cell's modes begin among its numbers, its frame and its reach
    frame_at = modes_at + size * columns
    reach_at = frame_at + d * d
    packed_numbers = packed(wp.array2d(dtype=space.real), axis=1 if by_number else 0)

    @wp.struct
    class Cell:
        gradient: space.types.phi_gradient
        modes: space.mat(size, columns)
        frame: space.types.tensor
        reach: space.real

    @wp.func
    def write(a: int, cell: Cell, numbers: wp.array2d(dtype=space.real)):
        packed_numbers(numbers)
        for i in range(wp.static(size)):
            for j in range(wp.static(d)):
                numbers[d * i + j, a] = cell.gradient[i, j]
            for j in range(wp.static(columns)):
                numbers[modes_at + columns * i + j, a] = cell.modes[i, j]
        for i in range(wp.static(d)):
            for j in range(wp.static(d)):
                numbers[frame_at + d * i + j, a] = cell.frame[i, j]
        numbers[reach_at, a] = cell.reach

    @wp.func
    def read(a: int, numbers: wp.array2d(dtype=space.real)):
        cell = Cell()
        for i in range(wp.static(size)):
            for j in range(wp.static(d)):
                cell.gradient[i, j] = numbers[d * i + j, a]
            for j in range(wp.static(columns)):
                cell.modes[i, j] = numbers[modes_at + columns * i + j, a]
        for i in range(wp.static(d)):
            for j in range(wp.static(d)):
                cell.frame[i, j] = numbers[frame_at + d * i + j, a]
        cell.reach = numbers[reach_at, a]
        return cell

    whole = -(-(reach_at + 1) // ALIGNED) * ALIGNED
    return CellStore(columns, Cell, by_number, whole, write, read, packed_numbers)
