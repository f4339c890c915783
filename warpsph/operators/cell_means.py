"""Means over a cell's corners and over a node's cells: averages that no distortion can throw off balance.

A mean over a cell's corners is exact for linear fields in any configuration, since an auxiliary node stands in the
middle of its corners, and its weights are positive; on a lattice, so is a mean over the cells of a node.

Of a field f at the corners, at ξ_a = ±½ along each axis a, a cell's mean and its gradient miss the parts that
alternate along two axes or three, f_S = Σ s_S f/2ᵈ with s_S = Π_{a in S} 2ξ_a: the hourglass modes (Flanagan and
Belytschko 1981). In f = … + Σ_S f_S Π_{a in S} 2ξ_a they are its mixed derivatives, and they serve twice:

- the gradient at a corner differs from that in the middle: ∂f/∂ξ_a gains 2 f_S Π_{b in S, b ≠ a} 2ξ_b. The
  velocity's is taken towards the corner, for the strain of bending; the stress's never (`corner_share`);
- they are all of a checkerboard that can be seen: it has no mean and no gradient. f − θ mean(s_S f_S) damps it and
  keeps Σ m f. As a product of second differences along two axes it leaves alone what varies along one axis only,
  such as the kink of the stress under a free edge.

Where the cell is no parallelogram the linear part of f has such modes as well; it is taken out first.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..device.arrays import natural, packed
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cells import CellStore, NodeCells, cell_in_slot, cell_store, corner_place

# A cell with less than this share of the volume of a box with edges as long has folded: it has no frame that sums
# could follow, and ends a run whose nodes move.
FOLDED = 0.05
# Towards the corners of a cell n times as long as high the strain rate is taken by no more than 2.2/n, since
# `corner_share` balances square cells: with more, waves in flat ones grow (tests/test_breakdown.py).
FLATTEST = 2.2


@dataclass(frozen=True)
class CellMeans:
    """Means over cells of one kind.

    Attributes:
        store: how a cell is kept between the passes.
        describe: (cell, auxiliary nodes, nodes) → mean of φ, Cell without its gradient.
        gather: (node, NodeCells, numbers, auxiliary points, κ) → means over the cells of a node: of the auxiliary
            nodes' values, of ∇φ (∇v a share κ of the way to the node's corner), of Σ_S s_S f_S, and of the frames.
    """

    store: CellStore
    describe: wp.Function
    gather: wp.Function


def numbers_side_by_side(device: wp.Device) -> bool:
    """Whether the same number of consecutive cells stands side by side: for neighbouring threads of a GPU."""
    return not device.is_cpu


@cache
def cell_means(space: Space, kind: CellKind, *, slots: bool = True, by_number: bool = False) -> CellMeans:
    """The means of one continuum in one precision.

    Args:
        space: the continuum and the precision.
        kind: of the cells.
        slots: whether `NodeCells` has slots.
        by_number: as for `CellStore`.
    """
    store = cell_store(space, kind, by_number)
    return CellMeans(store, _describe(space, kind, store), _gather(space, kind, store, slots))


def corner_gradients(space: Space, kind: CellKind) -> tuple[object, float]:
    """∂N_k/∂ξ_a in the middle of a cell as a Warp matrix, a corner a row, and a factor that is left out of it.

    With the factor out a matrix of ±1 is left on a grid, and products become sums.
    """
    factor = float(np.abs(kind.gradients).max())
    return space.mat(kind.corners, space.dim)(*(np.ravel(kind.gradients) / factor).tolist()), factor


@cache
def edges_function(space: Space, kind: CellKind) -> wp.Function:
    """(cell, auxiliary nodes, nodes) → its edges ∂x/∂ξ_a in the middle, in column a."""
    slope, factor = corner_gradients(space, kind)

    @wp.func
    def edges_of(a: int, auxiliary: space.types.AuxiliaryNodes, nodes: wp.array(dtype=space.types.Point)):
        edges = space.types.tensor()
        for k in range(wp.static(kind.corners)):
            i = auxiliary.cell[a, k]
            edges += wp.outer(nodes[i].x, slope[k])
        return space.real(factor) * edges

    return edges_of


@cache
def folded_function(space: Space) -> wp.Function:
    """Edges ∂x/∂ξ_a of a cell in column a → whether it has folded."""

    @wp.func
    def has_folded(edges: space.types.tensor):
        columns_of = wp.transpose(edges)
        box = space.real(1.0)
        for a in range(wp.static(space.dim)):
            box *= wp.length(columns_of[a])
        return space.algebra.determinant(edges) <= space.real(FOLDED) * box

    return has_folded


@cache
def frame_function(space: Space) -> wp.Function:
    """Edges ∂x/∂ξ_a of a cell in column a → ∇ξ_a in row a; zero for a folded cell."""
    has_folded = folded_function(space)

    @wp.func
    def frame_of(edges: space.types.tensor):
        if has_folded(edges):
            return space.types.tensor()
        return space.algebra.inverse(edges)

    return frame_of


def _signs(space: Space, kind: CellKind, store: CellStore):
    """±1 of each corner in each hourglass mode, as a Warp matrix; a column of zeros where there is no mode."""
    signs = np.zeros((kind.corners, store.columns))
    signs[:, : len(kind.modes)] = kind.signs
    return space.mat(*signs.shape)(*signs.ravel().tolist())


@cache
def _reach(space: Space) -> wp.Function:
    """Frame of a cell → how far towards its corners strain rates may be taken (`FLATTEST`); 1 for a folded one."""

    @wp.func
    def reach_of(frame: space.types.tensor):
        least, most = wp.length_sq(frame[0]), wp.length_sq(frame[0])
        for b in range(1, wp.static(space.dim)):
            least = wp.min(least, wp.length_sq(frame[b]))
            most = wp.max(most, wp.length_sq(frame[b]))
        if most <= space.real(0.0):
            return space.real(1.0)
        return space.real(FLATTEST) * wp.sqrt(least / most)

    return reach_of


@cache
def _describe(space: Space, kind: CellKind, store: CellStore) -> wp.Function:
    types, sign, (slope, factor) = space.types, _signs(space, kind, store), corner_gradients(space, kind)
    frame_of, reach_of = frame_function(space), _reach(space)
    position_modes = space.mat(space.dim, store.columns)
    packed_points, packed_table = packed(wp.array(dtype=types.Point)), packed(wp.array2d(dtype=wp.int32))

    @wp.func
    def describe(a: int, auxiliary: types.AuxiliaryNodes, nodes: wp.array(dtype=types.Point)):
        packed_points(nodes)
        packed_table(auxiliary.cell)
        cell = store.Cell()
        mean, slopes, edges, bends = types.phi(), types.phi_gradient(), types.tensor(), position_modes()
        for k in range(wp.static(kind.corners)):
            i = auxiliary.cell[a, k]
            natural(i)
            point = nodes[i]
            mean += point.phi
            edges += wp.outer(point.x, slope[k])
            slopes += wp.outer(point.phi, slope[k])
            cell.modes += wp.outer(point.phi, sign[k])
            bends += wp.outer(point.x, sign[k])
        share = space.real(wp.static(1.0 / kind.corners))
        cell.frame = frame_of(space.real(factor) * edges)
        cell.modes = share * (cell.modes - (space.real(factor) * slopes) * (cell.frame * bends))
        cell.reach = reach_of(cell.frame)
        return share * mean, cell

    return describe


@cache
def _mode_slopes(space: Space, kind: CellKind, columns: int) -> wp.Function:
    """(2ξ of a corner, share) → ∂/∂ξ_a of mode S that share of the way to the corner, in row S and column a."""
    slopes_type, modes = space.mat(columns, space.dim), kind.modes

    @wp.func
    def mode_slopes(end: space.types.vector, share: space.real):
        slopes = slopes_type()
        for s in range(wp.static(len(modes))):
            for a in range(wp.static(space.dim)):
                if wp.static(a in modes[s]):
                    slope = space.real(2.0)
                    for b in range(wp.static(space.dim)):
                        if wp.static(b != a and b in modes[s]):
                            slope *= share * end[b]
                    slopes[s, a] = slope
        return slopes

    return mode_slopes


@cache
def _gather(space: Space, kind: CellKind, store: CellStore, slots: bool) -> wp.Function:
    types, sign = space.types, _signs(space, kind, store)
    side = space.mat(kind.corners, space.dim)(*kind.sides.ravel().tolist())
    mode_slopes, place_of, cell_at = (
        _mode_slopes(space, kind, store.columns),
        corner_place(kind),
        cell_in_slot(kind),
    )
    packed_points = packed(wp.array(dtype=types.Point))

    @wp.func
    def gather(
        i: int,
        table: NodeCells,
        numbers: wp.array2d(dtype=space.real),
        auxiliary: wp.array(dtype=types.Point),
        share: space.real,
    ):
        store.packed(numbers)
        packed_points(auxiliary)
        value, gradient, checkerboard, frame = types.phi(), types.phi_gradient(), types.phi(), types.tensor()
        beyond = types.tensor()  # what ∇v has beyond that in the middles
        found = space.real(0.0)
        if wp.static(slots):
            for k in range(wp.static(kind.corners)):
                a = cell_at(i, k, table)
                if a >= 0:
                    found += space.real(1.0)
                    value += auxiliary[a].phi
                    cell = store.read(a, numbers)
                    gradient += cell.gradient
                    frame += cell.frame
                    if wp.static(len(kind.modes) > 0):
                        slopes = mode_slopes(side[k], wp.min(share, cell.reach))
                        beyond += cell.modes[: wp.static(space.dim)] * (slopes * cell.frame)
                        checkerboard += cell.modes * sign[k]
        else:  # the same, entry by entry
            for entry in range(table.first[i], table.first[i + 1]):
                a, k = place_of(entry, table)
                found += space.real(1.0)
                value += auxiliary[a].phi
                cell = store.read(a, numbers)
                gradient += cell.gradient
                frame += cell.frame
                if wp.static(len(kind.modes) > 0):
                    slopes = mode_slopes(side[k], wp.min(share, cell.reach))
                    beyond += cell.modes[: wp.static(space.dim)] * (slopes * cell.frame)
                    checkerboard += cell.modes * sign[k]
        for row in range(wp.static(space.dim)):
            gradient[row] += beyond[row]
        part = space.real(1.0) / found
        return part * value, part * gradient, part * checkerboard, part * frame

    return gather
