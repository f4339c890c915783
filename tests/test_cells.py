"""Means over cells, their modes, and the pressure at fronts, against fields given by a formula."""

import itertools
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
import warp as wp

from warpsph import Box
from warpsph.device.precision import PRECISIONS
from warpsph.mesh.kinds import GRID_KINDS
from warpsph.operators.cell_means import cell_means
from warpsph.operators.front import ROUGH, front_pressure
from warpsph.operators.neighbour_sums import cell_metric
from warpsph.physics.space import Space
from warpsph.scene import CONTINUA
from warpsph.state.cells import NodeCells, node_cells

DIMENSIONS = [1, 2, 3]
ROUNDING = {"float64": 1e-13, "float32": 1e-4}
CELLS = (4, 3, 3)


def index_of(mesh):
    """Integer coordinates of the nodes of the unmapped box, shape (n, d)."""
    return np.round(mesh.nodes).astype(int)


def box(dim):
    return Box(tuple(float(c) for c in CELLS[:dim]), 1.0).mesh()


def distorted(mesh):
    """No cell is a parallelogram any more."""
    shift = np.random.default_rng(8).uniform(-0.15, 0.15, size=mesh.nodes.shape)
    return mesh.with_nodes(mesh.nodes + shift)


def sheared(mesh):
    """All cells are parallelepipeds; returns the lattice and F."""
    dim = mesh.nodes.shape[1]
    F = np.eye(dim) + np.random.default_rng(9).uniform(-0.25, 0.25, size=(dim, dim))
    return mesh.with_nodes(mesh.nodes @ F.T), F


@dataclass
class Seen:
    """What `describe` and `gather` find of a field."""

    mean: np.ndarray  # of each cell
    modes: np.ndarray
    value: np.ndarray  # at each node: mean over its cells of their means
    gradient: np.ndarray
    checkerboard: np.ndarray
    frame: np.ndarray


@cache
def probes(dim, precision, slots):
    """Kernels that run `describe` on all cells and `gather` on all nodes."""
    real = PRECISIONS[precision]
    space = Space(CONTINUA[dim], real)
    types, means = space.types, cell_means(space, GRID_KINDS[dim], slots=slots)
    phi, phi_gradient, Point, AuxiliaryNodes = types.phi, types.phi_gradient, types.Point, types.AuxiliaryNodes

    @wp.kernel(module="unique", enable_backward=False)
    def describe_all(
        nodes: wp.array(dtype=Point),
        gradients: wp.array(dtype=phi_gradient),
        auxiliary: AuxiliaryNodes,
        cells: wp.array2d(dtype=real.real),
    ):
        a = wp.tid()
        mean, cell = means.describe(a, auxiliary, nodes)
        cell.gradient = gradients[a]
        auxiliary.point[a].phi = mean
        means.store.write(a, cell, cells)

    @wp.kernel(module="unique", enable_backward=False)
    def gather_all(
        auxiliary: AuxiliaryNodes,
        table: NodeCells,
        cells: wp.array2d(dtype=real.real),
        share: real.real,
        values: wp.array(dtype=phi),
        gradients: wp.array(dtype=phi_gradient),
        checkerboards: wp.array(dtype=phi),
        frames: wp.array(dtype=types.tensor),
    ):
        i = wp.tid()
        value, gradient, checkerboard, frame = means.gather(i, table, cells, auxiliary.point, share)
        values[i] = value
        gradients[i] = gradient
        checkerboards[i] = checkerboard
        frames[i] = frame

    return describe_all, gather_all, space, means


def see(mesh, field, precision, middle_gradient=None, share=1.0, slots=True):
    """Run both on node values (n, d + s) and gradients in the middle of the cells (m, d + s, d)."""
    describe_all, gather_all, space, means = probes(mesh.dim, precision, slots)
    types = space.types
    phi, phi_gradient, Point = types.phi, types.phi_gradient, types.Point
    n, m = len(mesh.nodes), len(mesh.cells)
    points = np.zeros(n, dtype=Point.numpy_dtype())
    points["x"], points["phi"] = mesh.nodes, field
    auxiliary, cells = types.AuxiliaryNodes(), means.store.new(m, space, "cpu")
    auxiliary.point = wp.zeros(m, dtype=Point, device="cpu")
    auxiliary.cell = wp.array(mesh.cells, dtype=wp.int32, device="cpu")
    if middle_gradient is None:
        middle_gradient = np.zeros((m, types.size, mesh.dim))
    gradients = wp.array(middle_gradient, dtype=phi_gradient, device="cpu")
    wp.launch(
        describe_all, m, [wp.array(points, dtype=Point, device="cpu"), gradients, auxiliary, cells], device="cpu"
    )
    written = (phi, phi_gradient, phi, types.tensor)
    outputs = [wp.full(n, dtype(np.nan), dtype=dtype, device="cpu") for dtype in written]
    wp.launch(gather_all, n, [auxiliary, node_cells(mesh, slots, "cpu"), cells, share], outputs, device="cpu")
    gradient, modes = types.size * mesh.dim, types.size * means.store.columns
    modes = cells.numpy()[gradient : gradient + modes].T.reshape(m, types.size, -1)
    return Seen(auxiliary.point.numpy()["phi"], modes, *(output.numpy() for output in outputs))


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_entries_and_slots_give_the_same(precision, dim):
    """A mesh that is no lattice has no slots for its corners: one entry after the other, to rounding."""
    mesh, rng = distorted(box(dim)), np.random.default_rng(4)
    field = rng.normal(size=(len(mesh.nodes), size_of(dim)))
    middle = rng.normal(size=(len(mesh.cells), size_of(dim), dim))
    slots, entries = (see(mesh, field, precision, middle, 0.7, way) for way in (True, False))
    for name in ("value", "gradient", "checkerboard", "frame"):
        found, expected = getattr(entries, name), getattr(slots, name)
        np.testing.assert_allclose(found, expected, atol=ROUNDING[precision] * np.abs(expected).max(initial=1.0))


def size_of(dim):
    return dim + CONTINUA[dim].stress_size


def mean_over_cells(mesh, of_cells):
    """Of each node, over the cells it is a corner of."""
    return np.array([of_cells[(mesh.cells == i).any(axis=1)].mean(axis=0) for i in range(len(mesh.nodes))])


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_a_linear_field_on_distorted_cells_is_exact_and_has_no_modes(precision, dim):
    rng = np.random.default_rng(1)
    slope, constant = rng.normal(size=(size_of(dim), dim)), rng.normal(size=size_of(dim))
    mesh = distorted(box(dim))
    middle = mesh.nodes[mesh.cells].mean(axis=1)
    given = np.tile(slope, (len(middle), 1, 1))
    seen = see(mesh, mesh.nodes @ slope.T + constant, precision, given)
    close = {"rtol": 0.0, "atol": 10 * ROUNDING[precision]}
    np.testing.assert_allclose(seen.mean, middle @ slope.T + constant, **close)
    np.testing.assert_allclose(seen.modes, 0.0, **close)
    np.testing.assert_allclose(seen.value, mean_over_cells(mesh, middle) @ slope.T + constant, **close)
    np.testing.assert_allclose(seen.gradient, np.tile(slope, (len(mesh.nodes), 1, 1)), **close)
    np.testing.assert_allclose(seen.checkerboard, 0.0, **close)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_gradient_of_a_multilinear_field_is_exact_on_the_way_to_the_corner(precision, dim, share):
    """Products of two and of three different coordinates of sheared cells: their gradient varies within a cell.

    The velocity's, that is; of the stress the gradient in the middle is asked for.
    """
    rng = np.random.default_rng(2)
    mesh, F = sheared(box(dim))
    products = [s for size in range(1, dim + 1) for s in itertools.combinations(range(dim), size)]
    weights = rng.normal(size=(size_of(dim), len(products)))

    def field(x):
        xi = x @ np.linalg.inv(F).T
        return np.stack([xi[:, s].prod(axis=1) for s in products], axis=1) @ weights.T

    def gradient(x):
        xi = x @ np.linalg.inv(F).T
        by_xi = np.zeros((len(x), len(products), dim))
        for k, s in enumerate(products):
            for a in s:
                by_xi[:, k, a] = xi[:, [b for b in s if b != a]].prod(axis=1)
        return np.einsum("kp,npa,aj->nkj", weights, by_xi, np.linalg.inv(F))

    middle = mesh.nodes[mesh.cells].mean(axis=1)
    seen = see(mesh, field(mesh.nodes), precision, gradient(middle), share)
    for i, x in enumerate(mesh.nodes):
        own = middle[(mesh.cells == i).any(axis=1)]
        expected = gradient(own).mean(axis=0)
        expected[:dim] = gradient(own + share * (x - own)).mean(axis=0)[:dim]
        np.testing.assert_allclose(seen.gradient[i], expected, rtol=0.0, atol=1e3 * ROUNDING[precision])


@pytest.mark.parametrize(("dim", "axes"), [(2, (0, 1)), (3, (0, 1)), (3, (0, 2)), (3, (0, 1, 2))])
def test_a_checkerboard_is_seen_with_its_amplitude(precision, dim, axes):
    """It alternates along two axes or three, on top of a linear field: A at one node, −A at the next.

    On distorted cells too, edges and corners included: no cell's shape has a say in it.
    """
    plain, rng = box(dim), np.random.default_rng(3)
    mesh = distorted(plain)
    sign = (-1.0) ** index_of(plain)[:, axes].sum(axis=1)
    amplitude, slope = rng.normal(size=size_of(dim)), rng.normal(size=(size_of(dim), dim))
    seen = see(mesh, sign[:, None] * amplitude + mesh.nodes @ slope.T, precision)
    close = {"rtol": 0.0, "atol": 10 * ROUNDING[precision]}
    np.testing.assert_allclose(seen.checkerboard, sign[:, None] * amplitude, **close)


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_a_field_that_varies_along_one_axis_is_no_checkerboard(precision, dim):
    """Not even where it alternates, as the stress does across a free edge, and all that a bar can have."""
    rng = np.random.default_rng(4)
    mesh = box(dim)
    for axis in range(dim):
        profile = rng.normal(size=(CELLS[axis] + 1, size_of(dim)))
        seen = see(mesh, profile[index_of(mesh)[:, axis]], precision)
        np.testing.assert_allclose(seen.checkerboard, 0.0, rtol=0.0, atol=10 * ROUNDING[precision])
        np.testing.assert_allclose(seen.gradient, 0.0, rtol=0.0, atol=10 * ROUNDING[precision])


def test_taking_the_checkerboard_off_keeps_the_sum():
    """Σ m f on a lattice, m the number of a node's cells, for any field at all."""
    mesh = box(3)
    field = np.random.default_rng(5).normal(size=(len(mesh.nodes), size_of(3)))
    cells = np.bincount(mesh.cells.ravel())
    lost = cells @ see(mesh, field, "float64").checkerboard
    np.testing.assert_allclose(lost, 0.0, atol=1e-12)


def test_a_folded_cell_has_no_frame():
    """A corner pushed through the opposite one: modes are finite, the gradient is that of the middle."""
    mesh = Box((1.0, 1.0), 1.0).mesh()
    nodes = mesh.nodes.copy()
    nodes[3] = (-1.5, -1.5)
    field, given = np.arange(24.0).reshape(4, 6), np.ones((1, 6, 2))
    seen = see(mesh.with_nodes(nodes), field, "float64", given)
    np.testing.assert_allclose(seen.gradient, 1.0)
    np.testing.assert_allclose(seen.modes[0, :, 0], field.T @ [0.25, -0.25, -0.25, 0.25])
    np.testing.assert_array_equal(seen.frame, 0.0)


def mean_edges(corners):
    """∂x/∂ξ_a in column a: the mean of the differences along each axis; corners (2ᵈ, d)."""
    dim = corners.shape[1]
    grid = corners.reshape((2,) * dim + (dim,))
    return np.stack([np.diff(grid, axis=a).reshape(-1, dim).mean(axis=0) for a in range(dim)], axis=1)


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_the_frame_of_a_node_is_the_mean_of_its_cells(precision, dim):
    """∇ξ of a parallelepiped is the inverse of its edges, all over a sheared lattice; of others the mean."""
    tolerance = 10 * ROUNDING[precision]
    mesh, F = sheared(box(dim))
    seen = see(mesh, np.zeros((len(mesh.nodes), size_of(dim))), precision)
    np.testing.assert_allclose(seen.frame, np.tile(np.linalg.inv(F), (len(mesh.nodes), 1, 1)), atol=tolerance)
    mesh = distorted(box(dim))
    seen = see(mesh, np.zeros((len(mesh.nodes), size_of(dim))), precision)
    frames = np.array([np.linalg.inv(mean_edges(corners)) for corners in mesh.nodes[mesh.cells]])
    np.testing.assert_allclose(seen.frame, mean_over_cells(mesh, frames), atol=tolerance)


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_kernels_follow_the_frame_and_are_round_without_one(precision, dim):
    """M = ∇ξ/(h/Δx), which a node at ξ from the middle sees at |ξ|/(h/Δx); 1/h for the zero frame."""
    real = PRECISIONS[precision]
    space = Space(CONTINUA[dim], real)
    tensor = space.types.tensor
    metric_of = cell_metric(space, 0.6)

    @wp.kernel(module="unique", enable_backward=False)
    def probe(frames: wp.array(dtype=tensor), h: real.real, metrics: wp.array(dtype=tensor)):
        i = wp.tid()
        metrics[i] = metric_of(frames[i], h)

    _, F = sheared(box(dim))
    frames = wp.array(np.array([np.linalg.inv(F), np.zeros((dim, dim))]), dtype=tensor, device="cpu")
    metrics = wp.zeros(2, dtype=tensor, device="cpu")
    wp.launch(probe, 2, [frames, 0.25], [metrics], device="cpu")
    stretched, plain = metrics.numpy().reshape(2, dim, dim)
    np.testing.assert_allclose(stretched @ F, np.eye(dim) / 0.6, atol=10 * ROUNDING[precision])
    np.testing.assert_allclose(plain, 4.0 * np.eye(dim), atol=10 * ROUNDING[precision])


# ---------------------------------------------------------------------------------------------------------
# The pressure at fronts
# ---------------------------------------------------------------------------------------------------------


@cache
def pressure_probe(dim, precision):
    """A kernel that writes q of all cells."""
    real = PRECISIONS[precision]
    space = Space(CONTINUA[dim], real)
    types, front = space.types, front_pressure(space, GRID_KINDS[dim])
    describe, scalar = cell_means(space, GRID_KINDS[dim]).describe, real.real
    AuxiliaryNodes, MaterialNodes = types.AuxiliaryNodes, types.MaterialNodes

    @wp.kernel(module="unique", enable_backward=False)
    def probe(
        auxiliary: AuxiliaryNodes,
        nodes: MaterialNodes,
        rates: wp.array(dtype=scalar),
        strength: scalar,
        dt: scalar,
        out: wp.array(dtype=scalar),
    ):
        a = wp.tid()
        _mean, cell = describe(a, auxiliary, nodes.point)
        out[a] = front(a, rates[a], cell.frame, auxiliary, nodes, strength, dt)

    return probe, types, scalar


def pressures(mesh, gradients, rates, precision, strength=0.75, dt=0.1, density=3.0):
    """q of each cell for node values of L (n, d, d) and tr L in the middle of the cells (m,)."""
    probe, types, scalar = pressure_probe(mesh.dim, precision)
    points = np.zeros(len(mesh.nodes), dtype=types.Point.numpy_dtype())
    points["x"] = mesh.nodes
    auxiliary, nodes, m = types.AuxiliaryNodes(), types.MaterialNodes(), len(mesh.cells)
    nodes.point = wp.array(points, dtype=types.Point, device="cpu")
    nodes.velocity_gradient = wp.array(gradients, dtype=types.tensor, device="cpu")
    auxiliary.cell = wp.array(mesh.cells, dtype=wp.int32, device="cpu")
    auxiliary.density = wp.full(m, density, dtype=scalar, device="cpu")
    out = wp.full(m, np.nan, dtype=scalar, device="cpu")
    inputs = [auxiliary, nodes, wp.array(rates, dtype=scalar, device="cpu"), strength, dt]
    wp.launch(probe, m, inputs, [out], device="cpu")
    return out.numpy()


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_no_pressure_in_a_linear_field_of_rates_nor_in_shear_nor_at_rest(precision, dim):
    """Of tr L, linear in the position, on distorted cells; of a jump in shear; of nothing at all."""
    mesh, rng = distorted(box(dim)), np.random.default_rng(6)
    n, m, slope = len(mesh.nodes), len(mesh.cells), rng.normal(size=dim)
    gradients = np.eye(dim) * ((1.0 + mesh.nodes @ slope) / dim)[:, None, None]
    rates = 1.0 + mesh.nodes[mesh.cells].mean(axis=1) @ slope
    assert np.abs(pressures(mesh, gradients, rates, precision)).max() <= ROUNDING[precision] ** 2 / ROUGH**2 * 1e2
    if dim > 1:
        jump = np.zeros((n, dim, dim))
        jump[: n // 2, 0, 1] = 5.0
        assert not pressures(mesh, jump, np.zeros(m), precision).any()
    assert not pressures(mesh, np.zeros((n, dim, dim)), np.zeros(m), precision).any()


@pytest.mark.parametrize("rate", [-2.0, 2.0])
@pytest.mark.parametrize("dim", DIMENSIONS)
def test_pressure_at_a_jump_is_rho_nu_e_with_the_least_thickness(precision, dim, rate):
    """Cells of 1 × 0.5 × 2: Δ is the least of them. It resists, and grows with the square of a small roughness."""
    stretch = np.array([1.0, 0.5, 2.0])[:dim]
    plain = box(dim)
    mesh = plain.with_nodes(plain.nodes * stretch)
    still, rates = np.zeros((len(mesh.nodes), dim, dim)), np.full(len(mesh.cells), rate)
    full = 3.0 * 0.75 * stretch.min() ** 2 / (4.0 * 0.1) * rate
    np.testing.assert_allclose(pressures(mesh, still, rates, precision), full, rtol=ROUNDING[precision])
    smooth = np.tile(0.9 * rate / dim * np.eye(dim), (len(mesh.nodes), 1, 1))
    expected = full * (0.1 / ROUGH) ** 2
    np.testing.assert_allclose(pressures(mesh, smooth, rates, precision), expected, rtol=10 * ROUNDING[precision])
