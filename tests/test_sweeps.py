"""Pair lists and corrected sums: against brute force, linear fields, and points that lost their neighbours."""

import numpy as np
import pytest
import warp as wp

from warpsph import Box, Disc, Elastic, Numerics, Scene, Simulation
from warpsph.device.linear_algebra import symmetric_inverse
from warpsph.device.precision import PRECISIONS
from warpsph.operators.neighbour_sums import CPU_BATCH, GPU_BATCH, neighbour_sums
from warpsph.operators.sources import STRESS_INTEGRATORS as SOURCE_TABLE
from warpsph.physics.space import Space
from warpsph.scene import CONTINUA, KERNELS, SOURCE_SCHEMES
from warpsph.state.pairs import PairList

SOFT = Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0)


def test_names_a_scene_may_use_are_those_that_exist_below():
    assert set(SOURCE_SCHEMES) == set(SOURCE_TABLE)


@pytest.mark.parametrize("kernel", KERNELS)
def test_second_weight_is_minus_the_derivative_over_xi(kernel):
    """−W′/ξ up to one constant for all ξ, by central differences (error h² W‴/6, 1e-6 here)."""
    weight = KERNELS[kernel].weights(PRECISIONS["float64"])
    ratios = []
    for xi in np.linspace(0.1, 0.98 * KERNELS[kernel].support, 17):
        if abs(xi - 1.0) < 0.05:  # the cubic spline's third derivative jumps
            continue
        step = 1e-4
        above, below = (float(weight(wp.float64((xi + sign * step) ** 2))[0]) for sign in (1, -1))
        ratios.append(-(above - below) / (2 * step) / xi / float(weight(wp.float64(xi**2))[1]))
    np.testing.assert_allclose(ratios, ratios[0], rtol=1e-4)


@pytest.mark.parametrize("shape", [Box((1.0,), 0.05), Disc(0.5, 0.06), Box((0.5, 0.4, 0.3), 0.1)])
def test_pair_lists_hold_every_neighbour_once(device, precision, shape):
    """Against all distances, for both lists, after the nodes have moved and lists were rebuilt."""
    scene = Scene(
        shape=shape,
        material=SOFT,
        velocity=lambda *x: [80.0 * part * (1 - part) + 3.0 for part in x],
        duration=1.0,
        numerics=Numerics(velocity_scheme="taylor", courant=0.5),
    )
    simulation = Simulation(scene, device=device, precision=precision)
    for _ in range(12):
        simulation.step()
    assert simulation.list_builds > 1
    body, lists = simulation.stepper.body, simulation.stepper.lists
    for pairs, targets, sources in (
        (lists.around_nodes, body.nodes, body.auxiliary),
        (lists.around_auxiliary, body.auxiliary, body.nodes),
    ):
        start, index = pairs.start.numpy(), pairs.index.numpy()
        x, y = targets.point.numpy()["x"], sources.point.numpy()["x"]
        radius = KERNELS["gaussian"].support * targets.smoothing_length.numpy()
        for i in range(len(x)):
            listed = index[start[i] : start[i + 1]]
            assert (np.diff(listed) > 0).all()
            inside = np.flatnonzero(((y - x[i]) ** 2).sum(axis=1) < radius[i] ** 2)
            assert set(inside) <= set(listed)


def probe_kernel(dim, precision, kernel, batch):
    """A kernel that writes the value and the gradient of one sweep."""
    real = PRECISIONS[precision]
    space = Space(CONTINUA[dim], real)
    types, parts = space.types, neighbour_sums(space, KERNELS[kernel], batch)
    Point, phi, vector, matrix = types.Point, types.phi, types.vector, space.phi.gradient

    @wp.kernel(module="unique", enable_backward=False)
    def probe(
        x: wp.array(dtype=vector),
        h: wp.array(dtype=real.real),
        base: phi,
        pairs: PairList,
        sources: wp.array(dtype=Point),
        volume: wp.array(dtype=real.real),
        own: wp.array(dtype=phi),
        values: wp.array(dtype=phi),
        gradients: wp.array(dtype=matrix),
    ):
        i = wp.tid()
        sums = parts.collect(i, x[i], h[i], base, pairs, sources, volume)
        values[i] = parts.value(sums)
        gradients[i] = parts.gradient(sums, own[i])

    return probe, types, matrix


def run_sweep(dim, precision, kernel, x, h, sources, own, base, batch=CPU_BATCH):
    """Value and gradient at points x from source points (position, φ), every pair listed; outputs poisoned."""
    probe, types, matrix = probe_kernel(dim, precision, kernel, batch)
    real = PRECISIONS[precision]
    points = np.zeros(len(sources[0]), dtype=types.Point.numpy_dtype())
    points["x"], points["phi"] = sources[0], sources[1]
    pairs = PairList()
    pairs.start = wp.array(np.arange(len(x) + 1) * len(points), dtype=wp.int32, device="cpu")
    pairs.index = wp.array(np.tile(np.arange(len(points)), len(x)), dtype=wp.int32, device="cpu")
    values = wp.full(len(x), types.phi(np.nan), dtype=types.phi, device="cpu")
    gradients = wp.full(len(x), matrix(np.nan), dtype=matrix, device="cpu")
    inputs = [
        wp.array(x, dtype=types.vector, device="cpu"),
        wp.array(np.full(len(x), h), dtype=real.real, device="cpu"),
        types.phi(*base),
        pairs,
        wp.array(points, dtype=types.Point, device="cpu"),
        wp.array(sources[2], dtype=real.real, device="cpu"),
        wp.array(own, dtype=types.phi, device="cpu"),
    ]
    wp.launch(probe, len(x), inputs=inputs, outputs=[values, gradients], device="cpu")
    return values.numpy(), gradients.numpy()


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_gradients_of_linear_fields_and_values_of_constants_are_exact(precision, kernel, dim):
    """On jittered points with uneven volumes, edges and corners included, to rounding times A's condition."""
    rng = np.random.default_rng(3)
    size = CONTINUA[dim].dim + CONTINUA[dim].stress_size
    nodes = Box((1.0,) * dim, 0.2).mesh()
    sources = nodes.nodes[nodes.cells].mean(axis=1) + rng.uniform(-0.03, 0.03, size=(len(nodes.cells), dim))
    volumes = rng.uniform(0.8, 1.2, size=len(sources))
    slope, constant = rng.normal(size=(size, dim)), rng.normal(size=size)
    h = 0.2 * 1.1 * KERNELS[kernel].smoothing_ratio
    own = nodes.nodes @ slope.T + constant
    values, gradients = run_sweep(
        dim, precision, kernel, nodes.nodes, h, (sources, sources @ slope.T + constant, volumes), own, constant
    )
    tolerance = 1e-11 if precision == "float64" else 2e-3
    np.testing.assert_allclose(gradients, np.tile(slope, (len(own), 1, 1)), atol=tolerance, rtol=tolerance)
    uniform = (sources, np.tile(constant, (len(sources), 1)), volumes)
    values, _ = run_sweep(dim, precision, kernel, nodes.nodes, h, uniform, own, 0 * constant)
    np.testing.assert_allclose(values, np.tile(constant, (len(own), 1)), rtol=1e-6)


@pytest.mark.parametrize("kernel", KERNELS)
def test_nothing_depends_on_how_many_weights_are_found_at_a_time(kernel):
    """A GPU finds one, a CPU 16; 40 neighbours here, most of them outside the support of some points."""
    rng = np.random.default_rng(7)
    sources = (rng.uniform(size=(40, 2)), rng.normal(size=(40, 6)), rng.uniform(0.5, 1.0, size=40))
    arguments = (
        2,
        "float64",
        kernel,
        rng.uniform(size=(9, 2)),
        0.3,
        sources,
        rng.normal(size=(9, 6)),
        np.zeros(6),
    )
    expected = run_sweep(*arguments, batch=GPU_BATCH)
    assert np.ptp(expected[0]) > 0.1
    for batch in (3, CPU_BATCH):
        for found, one_by_one in zip(run_sweep(*arguments, batch=batch), expected, strict=True):
            np.testing.assert_allclose(found, one_by_one, rtol=1e-11, atol=1e-11)


def test_the_gaussian_is_one_as_far_as_it_reaches(precision):
    """Squared four times, so that rounding of the polynomial counts 16 times, in some ten operations each."""
    real = PRECISIONS[precision]
    weights = KERNELS["gaussian"].weights(real)

    @wp.kernel(module="unique", enable_backward=False)
    def probe(s: wp.array(dtype=real.real), out: wp.array(dtype=real.real)):
        w, _ = weights(s[wp.tid()])
        out[wp.tid()] = w

    s = np.linspace(0.0, KERNELS["gaussian"].support ** 2, 1001).astype(real.dtype)
    out = wp.full(len(s), np.nan, dtype=real.real, device="cpu")
    wp.launch(probe, len(s), inputs=[wp.array(s, dtype=real.real, device="cpu")], outputs=[out], device="cpu")
    allowed = max(5e-14, 50 * np.finfo(real.dtype).eps)
    np.testing.assert_allclose(out.numpy(), np.exp(-s.astype(float)), rtol=allowed)


def test_a_point_without_neighbours_keeps_its_value_and_has_no_gradient():
    base = np.arange(6.0)
    far = (np.array([[9.0, 9.0]]), np.ones((1, 6)), np.ones(1))
    values, gradients = run_sweep(2, "float64", "gaussian", np.zeros((1, 2)), 0.1, far, np.ones((1, 6)), base)
    np.testing.assert_array_equal(values[0], base)
    np.testing.assert_array_equal(gradients[0], 0.0)


def test_a_point_that_sees_one_neighbour_has_a_gradient_along_it_only():
    """A has rank one there; Warp's own inverse would be zero (or huge). Slope 3 along (1, 1)/√2, none across."""
    direction = np.array([0.05, 0.05])
    one = (direction[None], np.full((1, 6), 3.0 * np.linalg.norm(direction)), np.ones(1))
    _, gradients = run_sweep(2, "float64", "gaussian", np.zeros((1, 2)), 0.1, one, np.zeros((1, 6)), np.zeros(6))
    unit = direction / np.linalg.norm(direction)
    np.testing.assert_allclose(gradients[0] @ unit, 3.0, rtol=5e-3)
    np.testing.assert_allclose(gradients[0] @ [unit[1], -unit[0]], 0.0, atol=1e-9)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_inverse_of_well_conditioned_matrices_is_exact(precision, dim):
    """Eigenvalues between 0.2 and about 10: the tolerance is the rounding times that."""
    rng = np.random.default_rng(5)
    real = PRECISIONS[precision]
    matrix, inverse = real.mat(dim, dim), symmetric_inverse(dim, real)

    @wp.kernel(module="unique", enable_backward=False)
    def probe(a: wp.array(dtype=matrix), out: wp.array(dtype=matrix)):
        out[wp.tid()] = inverse(a[wp.tid()])

    b = rng.normal(size=(20, dim, dim))
    a = b @ b.transpose(0, 2, 1) + 0.2 * np.eye(dim)
    out = wp.full(20, matrix(np.nan), dtype=matrix, device="cpu")
    wp.launch(probe, 20, inputs=[wp.array(a, dtype=matrix, device="cpu")], outputs=[out], device="cpu")
    product = out.numpy().reshape(20, dim, dim) @ a
    np.testing.assert_allclose(product, np.tile(np.eye(dim), (20, 1, 1)), atol=200 * np.finfo(real.dtype).eps)
