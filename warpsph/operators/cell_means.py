"""Cells: the 2ᵈ nodes around each auxiliary node, for averages that no distortion can throw off balance.

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

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..device.arrays import natural, packed
from ..mesh.mesh import Mesh
from ..physics.space import Space

# A cell with less than this share of the volume of a box with edges as long has folded: it has no frame, and its
# modes are taken as they are.
FOLDED = 0.05


@dataclass(frozen=True)
class CellTypes:
    """Warp side of the cells.

    Attributes:
        Cell: of one cell ∇φ in its middle `gradient`, `modes` (a column each) and `frame` (∇ξ_a in row a).
        Cells: `numbers` (c, m), the c numbers of each `Cell`, and `of_node` (n, 2ᵈ), the cell whose corner k a
            node is, or −1.
        new: (lattice, device) → Cells, all numbers zero.
        describe: (cell, auxiliary nodes, nodes) → mean of φ, Cell without its gradient.
        write: (cell, Cell, Cells) → nothing.
        gather: (node, Cells, auxiliary nodes, κ) → means over the cells of a node: of the auxiliary nodes'
            values, of ∇φ (∇v a share κ of the way to the node's corner), of Σ_S s_S f_S, and of the frames.
    """

    Cell: type
    Cells: type
    new: Callable
    describe: wp.Function
    write: wp.Function
    gather: wp.Function


def _ends(dim: int) -> np.ndarray:
    """2ξ of each corner, shape (2ᵈ, d)."""
    return np.array(list(itertools.product((-1.0, 1.0), repeat=dim)))


def corner_sides(space: Space):
    """2ξ of each corner, as a Warp matrix."""
    return space.mat(2**space.dim, space.dim)(*_ends(space.dim).ravel().tolist())


@cache
def edges_function(space: Space) -> wp.Function:
    """(cell, auxiliary nodes, nodes) → its edges ∂x/∂ξ_a, in column a."""
    types, corners = space.types, 2**space.dim
    side = corner_sides(space)

    @wp.func
    def edges_of(a: int, auxiliary: types.AuxiliaryNodes, nodes: wp.array(dtype=types.Point)):
        edges = types.tensor()
        for k in range(wp.static(corners)):
            i = auxiliary.cell[a, k]
            edges += wp.outer(nodes[i].x, side[k])
        return space.real(wp.static(2.0 / corners)) * edges

    return edges_of


@cache
def frame_function(space: Space) -> wp.Function:
    """Edges ∂x/∂ξ_a of a cell in column a → ∇ξ_a in row a; zero for a folded cell."""
    dim, real = space.dim, space.real
    tensor, determinant, inverse = (
        space.mat(dim, dim),
        space.algebra.determinant,
        space.algebra.inverse,
    )

    @wp.func
    def frame_of(edges: tensor):
        columns_of = wp.transpose(edges)
        box = real(1.0)
        for a in range(wp.static(dim)):
            box *= wp.length(columns_of[a])
        if determinant(edges) <= real(FOLDED) * box:
            return tensor()
        return inverse(edges)

    return frame_of


def apart_on(device: wp.Device) -> bool:
    """Whether the numbers of a cell are kept apart from each other: for neighbouring threads of a GPU."""
    return not device.is_cpu


@cache
def cell_types(space: Space, apart: bool = False) -> CellTypes:
    """The types and functions of one continuum in one precision.

    Args:
        apart: whether the same number of consecutive cells stands side by side in memory, for a GPU whose threads
            read it together, or all the numbers of a cell, for the vector registers of a CPU.
    """
    types, dim = space.types, space.dim
    real, phi, tensor, phi_gradient = space.real, types.phi, types.tensor, types.phi_gradient
    AuxiliaryNodes, Point = types.AuxiliaryNodes, types.Point
    corners = 2**dim
    end = _ends(dim)
    subsets = [s for size in range(2, dim + 1) for s in itertools.combinations(range(dim), size)]
    number = len(subsets)
    columns = max(1, number)  # a bar has no such mode, and Warp no matrix without columns
    alternating = np.stack([end[:, s].prod(axis=1) for s in subsets] or [np.zeros(corners)], axis=1)
    slopes_of_modes = space.mat(columns, dim)
    phi_modes, position_modes = space.mat(types.size, columns), space.mat(dim, columns)
    side = corner_sides(space)
    sign = space.mat(corners, columns)(*alternating.ravel().tolist())
    frame_of = frame_function(space)

    @wp.struct
    class Cell:
        gradient: phi_gradient
        modes: phi_modes
        frame: tensor

    @wp.struct
    class Cells:
        numbers: wp.array2d(dtype=real)
        of_node: wp.array2d(dtype=wp.int32)

    modes_at = types.size * dim  # where a cell's modes begin among its numbers, and where its frame does
    frame_at = modes_at + types.size * columns
    packed_points, packed_tables, packed_numbers = (
        packed(wp.array(dtype=Point)),
        packed(wp.array2d(dtype=wp.int32)),
        packed(wp.array2d(dtype=real), axis=1 if apart else 0),
    )

    def new(mesh: Mesh, device: wp.Device):
        cells, m, numbers = Cells(), len(mesh.cells), frame_at + dim * dim
        if apart:
            cells.numbers = wp.zeros((numbers, m), dtype=real, device=device)
        else:
            cells.numbers = wp.zeros((m, numbers), dtype=real, device=device).transpose()
        cells.of_node = wp.array(cells_of_nodes(mesh), dtype=wp.int32, device=device)
        return cells

    @wp.func
    def write(a: int, cell: Cell, cells: Cells):
        packed_numbers(cells.numbers)
        for i in range(wp.static(types.size)):
            for j in range(wp.static(dim)):
                cells.numbers[dim * i + j, a] = cell.gradient[i, j]
            for j in range(wp.static(columns)):
                cells.numbers[modes_at + columns * i + j, a] = cell.modes[i, j]
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                cells.numbers[frame_at + dim * i + j, a] = cell.frame[i, j]

    @wp.func
    def read(a: int, numbers: wp.array2d(dtype=real)):
        cell = Cell()
        for i in range(wp.static(types.size)):
            for j in range(wp.static(dim)):
                cell.gradient[i, j] = numbers[dim * i + j, a]
            for j in range(wp.static(columns)):
                cell.modes[i, j] = numbers[modes_at + columns * i + j, a]
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                cell.frame[i, j] = numbers[frame_at + dim * i + j, a]
        return cell

    @wp.func
    def describe(a: int, auxiliary: AuxiliaryNodes, nodes: wp.array(dtype=Point)):
        packed_points(nodes)
        packed_tables(auxiliary.cell)
        cell = Cell()
        mean, slopes, edges, bends = phi(), phi_gradient(), tensor(), position_modes()
        for k in range(wp.static(corners)):
            i = auxiliary.cell[a, k]
            natural(i)
            point = nodes[i]
            mean += point.phi
            edges += wp.outer(point.x, side[k])
            slopes += wp.outer(point.phi, side[k])
            cell.modes += wp.outer(point.phi, sign[k])
            bends += wp.outer(point.x, sign[k])
        share, twice = real(wp.static(1.0 / corners)), real(wp.static(2.0 / corners))
        cell.frame = frame_of(twice * edges)
        cell.modes = share * (cell.modes - (twice * slopes) * (cell.frame * bends))
        return share * mean, cell

    @wp.func
    def mode_slopes(end: types.vector, share: real):
        """∂/∂ξ_a of mode S a share of the way to a corner, in row S and column a."""
        slopes = slopes_of_modes()
        for s in range(wp.static(number)):
            for a in range(wp.static(dim)):
                if wp.static(a in subsets[s]):
                    slope = real(2.0)
                    for b in range(wp.static(dim)):
                        if wp.static(b != a and b in subsets[s]):
                            slope *= share * end[b]
                    slopes[s, a] = slope
        return slopes

    # The arrays are arguments of their own: of those in a struct compilers find out less.
    @wp.func
    def means(
        i: int,
        of_node: wp.array2d(dtype=wp.int32),
        numbers: wp.array2d(dtype=real),
        auxiliary: wp.array(dtype=Point),
        share: real,
    ):
        packed_tables(of_node)
        packed_numbers(numbers)
        packed_points(auxiliary)
        value, gradient, checkerboard, frame, found = phi(), phi_gradient(), phi(), tensor(), real(0.0)
        beyond = tensor()  # what ∇v has beyond that in the middles
        for k in range(wp.static(corners)):
            a = of_node[i, k]
            if a >= 0:
                found += real(1.0)
                value += auxiliary[a].phi
                cell = read(a, numbers)
                gradient += cell.gradient
                frame += cell.frame
                if wp.static(number > 0):
                    beyond += cell.modes[: wp.static(dim)] * (mode_slopes(side[k], share) * cell.frame)
                    checkerboard += cell.modes * sign[k]
        for row in range(wp.static(dim)):
            gradient[row] += beyond[row]
        part = real(1.0) / found
        return part * value, part * gradient, part * checkerboard, part * frame

    @wp.func
    def gather(i: int, cells: Cells, auxiliary: wp.array(dtype=Point), share: real):
        return means(i, cells.of_node, cells.numbers, auxiliary, share)

    return CellTypes(Cell, Cells, new, describe, write, gather)


def cells_of_nodes(mesh: Mesh) -> np.ndarray:
    """The cell whose corner k each node is, −1 where there is none, shape (n, 2ᵈ)."""
    table = np.full((len(mesh.nodes), mesh.cells.shape[1]), -1, dtype=np.int32)
    for k, corner in enumerate(mesh.cells.T):
        table[corner, k] = np.arange(len(corner))
    return table
