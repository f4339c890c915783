"""Cells on the device: their corners, and which cells a node is a corner of."""

from functools import cache

import numpy as np
import warp as wp

from ..device.arrays import natural, packed
from ..errors import SceneError
from ..mesh.kinds import CellKind
from ..mesh.mesh import Mesh


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


def with_room(corners: wp.array, table: NodeCells, nodes: int) -> wp.array:
    """The corners of triangles with room for as many as the nodes can have; so is the table, from now on."""
    corners = corners.numpy()
    room = np.concatenate([corners, np.repeat(corners[:1], 2 * nodes - len(corners), axis=0)])
    last = np.full(room.size - corners.size, room.size - 1, dtype=np.int32)
    table.place = wp.array(np.append(table.place.numpy(), last), dtype=wp.int32, device=table.place.device)
    table.first = wp.array(np.append(table.first.numpy(), room.size), dtype=wp.int32, device=table.place.device)
    return wp.array(room, dtype=wp.int32, device=table.place.device)


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
