"""Densities from cell volumes under homogeneous motions, and the spacing that the time step follows."""

import itertools

import numpy as np
import pytest
import warp as wp

from warpsph import Box, Elastic, Numerics, Scene, Simulation
from warpsph.ground.precision import PRECISIONS
from warpsph.ground.smoothing import SMOOTHING_FUNCTIONS, second_moment
from warpsph.operators.cell_motion import SMALLEST as SMALLEST_VOLUME
from warpsph.operators.spacing import SMALLEST as SMALLEST_SPACING
from warpsph.operators.spacing import Spacing
from warpsph.operators.sweep import EDGE
from warpsph.scene import CONTINUA, KERNELS

SOFT = Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0)
ROUNDING = {"float64": 1e-12, "float32": 1e-5}


def jitter(*x):
    """Cells that are no parallelograms."""
    return tuple(part + 0.02 * np.sin(7.0 * sum(x) + 9.0 * k * x[0] + k) for k, part in enumerate(x))


def simulation_of(dim, device, precision, cells=4, mapped=jitter, **numerics):
    shape = Box((1.0,) * dim, 1.0 / cells)
    scene = Scene(
        shape=shape.mapped(mapped) if mapped and dim > 1 else shape,
        material=SOFT,
        duration=1.0,
        numerics=Numerics(**({"smoothing_ratio": 0.8} | numerics)),
    )
    return Simulation(scene, device=device, precision=precision)


def moved(simulation, F):
    """Moved by x → F x in four unequal steps of the cells' motion."""
    motion, reference = simulation._stepper._motion, simulation.lattice.nodes
    there, done = reference @ F.T, 0.0
    for part in (0.1, 0.4, 0.3, 0.2):
        dt = 0.5
        simulation.nodes.half_velocity.assign(part / dt * (there - reference))
        motion.move(simulation.nodes, simulation.auxiliary, dt)
        done += part
    assert done == pytest.approx(1.0)
    return simulation


MOTIONS = {
    "stretch": lambda dim: 1.3 * np.eye(dim),
    "compression": lambda dim: 0.6 * np.eye(dim),
    "one axis": lambda dim: np.diag([0.5, 1.0, 1.0][:dim]),
    "shear": lambda dim: np.eye(dim) + 0.8 * np.eye(dim, k=1),
    "all": lambda dim: np.eye(dim) + np.random.default_rng(1).uniform(-0.3, 0.3, size=(dim, dim)),
}


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_densities_are_exact_in_a_homogeneous_motion(device, precision, dim, name):
    """ρ = ρ₀/det F at every node and cell, edges, corners and distorted cells included; h = h₀ (det F)^{1/d}."""
    F = MOTIONS[name](dim)
    simulation = simulation_of(dim, device, precision)
    mass, length = simulation.field("mass"), simulation.field("smoothing_length")
    weight = simulation.nodes.weight.numpy()
    moved(simulation, F)
    ratio, tolerance = np.linalg.det(F), 10 * ROUNDING[precision]
    np.testing.assert_allclose(simulation.field("position"), simulation.lattice.nodes @ F.T, atol=tolerance)
    np.testing.assert_allclose(simulation.field("density"), SOFT.density / ratio, rtol=tolerance)
    np.testing.assert_allclose(simulation.auxiliary.density.numpy(), SOFT.density / ratio, rtol=tolerance)
    np.testing.assert_allclose(simulation.field("smoothing_length"), length * ratio ** (1.0 / dim), rtol=tolerance)
    volume = simulation.auxiliary.point.numpy()["volume"]
    np.testing.assert_allclose(volume, simulation.lattice.cell_volumes() * ratio, rtol=tolerance)
    held = simulation.nodes.point.numpy()["volume"] * simulation.field("density")
    np.testing.assert_allclose(held, weight, rtol=tolerance)
    np.testing.assert_array_equal(simulation.field("mass"), mass)


def test_a_folded_cell_keeps_a_tenth_of_its_volume(device, precision):
    """A corner pushed far through its cell: the cell's volume would be negative."""
    simulation = simulation_of(2, device, precision, mapped=None)
    corner, velocity = simulation.nearest_node((0.0, 0.0)), np.zeros((25, 2))
    velocity[corner] = (0.6, 0.6)
    simulation.nodes.half_velocity.assign(velocity)
    simulation._stepper._motion.move(simulation.nodes, simulation.auxiliary, 1.0)
    density = simulation.field("density")
    assert density[corner] == pytest.approx(SOFT.density / SMALLEST_VOLUME, rel=ROUNDING[precision])
    assert np.isfinite(density).all() and density.min() >= SOFT.density * (1 - ROUNDING[precision])


# ---------------------------------------------------------------------------------------------------------
# Spacing
# ---------------------------------------------------------------------------------------------------------


def shrinkage_after(simulation, F):
    stepper = moved(simulation, F)._stepper
    simulation.nodes.half_velocity.zero_()
    # Once more in place: the cells' smoothing lengths follow a step behind the nodes'.
    stepper._motion.move(simulation.nodes, simulation.auxiliary, 1.0)
    stepper._build_lists()
    return stepper.shrinkage


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize(("factor", "expected"), [(1.4, 1.0), (1.0, 1.0), (0.7, 0.7), (0.5, 0.5)])
def test_uniform_stretch_and_compression_change_the_step(device, precision, dim, kernel, factor, expected):
    """By their factor, whatever the cells' shapes; a step is never longer than at the start."""
    ratio = 1.1 * KERNELS[kernel].smoothing_ratio  # no neighbour on the very edge of the support
    simulation = simulation_of(dim, device, precision, kernel=kernel, smoothing_ratio=ratio)
    limit, tolerance = simulation.time_step_limit, 10 * ROUNDING[precision]
    assert shrinkage_after(simulation, factor * np.eye(dim)) == pytest.approx(expected, rel=tolerance)
    assert simulation.time_step_limit == pytest.approx(expected * limit, rel=tolerance)


@pytest.mark.parametrize("dim", [1, 2])
def test_a_step_is_never_shorter_than_a_quarter(device, precision, dim):
    simulation = simulation_of(dim, device, precision)
    assert shrinkage_after(simulation, 0.1 * np.eye(dim)) == SMALLEST_SPACING == 0.25


def spacing_inside(dim, kernel, precision, stretch, cells=5):
    """The spacing measured in the middle of a lattice whose cells are boxes with these edges, and their h."""
    plain = Box((1.0,) * dim, 1.0 / cells)
    edges = np.ones(dim)
    edges[0] = stretch
    shape = (
        plain.mapped(lambda *x: tuple(e * part for e, part in zip(edges, x, strict=True))) if dim > 1 else plain
    )
    numerics = Numerics(kernel=kernel)
    simulation = Simulation(Scene(shape=shape, material=SOFT, duration=1.0, numerics=numerics), "cpu", precision)
    stepper, real = simulation._stepper, PRECISIONS[precision]
    measure = Spacing(cells**dim, CONTINUA[dim], real, kernel, simulation.device)
    measure.shrinkage(stepper._around_auxiliary.pairs, simulation.nodes, simulation.auxiliary)
    return measure._spacing.numpy()[cells**dim // 2], edges / cells, simulation.auxiliary.smoothing_length.numpy()


def expected_spacing(kernel, edges, h):
    """2 √m₂ Δx by its definition: the least over the axes of 2 √(Σ g x²/Σ g), over the nodes around a cell."""
    weights = SMOOTHING_FUNCTIONS[kernel](PRECISIONS["float64"])
    reach, moments, total = KERNELS[kernel].support, np.zeros(len(edges)), 0.0
    for corner in itertools.product(np.arange(-3.5, 4.0), repeat=len(edges)):
        x = edges * corner
        s = (x @ x) / h**2
        if s < EDGE * reach**2:
            g = float(weights(wp.float64(s))[1])
            total += g
            moments += g * x**2
    return 2.0 * np.sqrt(moments.min() / total)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("dim", "stretch"), [(1, 1.0), (2, 1.0), (3, 1.0), (2, 0.8), (2, 0.9), (3, 0.8)])
def test_spacing_is_twice_the_root_of_the_second_moment(precision, dim, stretch, kernel):
    """To rounding where all axes are alike; where one is shorter to 0.3 %, and never below."""
    spacing, edges, h = spacing_inside(dim, kernel, precision, stretch)
    expected = expected_spacing(kernel, edges, h[len(h) // 2])
    upper = 10 * ROUNDING[precision] if stretch == 1.0 else 0.003
    assert -10 * ROUNDING[precision] <= spacing / expected - 1.0 <= upper


def test_spacing_of_a_bar_is_the_limit_of_the_courant_number(precision):
    """2 √m₂ Δx of METHOD section 3, from the values' weights; the Gaussian's gradient has the same."""
    spacing, edges, _ = spacing_inside(1, "gaussian", precision, 1.0)
    weight = SMOOTHING_FUNCTIONS["gaussian"](PRECISIONS["float64"])
    moment = second_moment(weight, PRECISIONS["float64"], 0.6, KERNELS["gaussian"].support)
    assert spacing == pytest.approx(2.0 * np.sqrt(moment) * edges[0], rel=ROUNDING[precision])


@pytest.mark.parametrize("dim", [2, 3])
def test_spacing_does_not_depend_on_the_direction_of_the_compression(precision, dim):
    """A lattice compressed by 0.8 and turned, whichever way: across (1, 1.3) as well as along an axis."""
    straight, found = np.eye(dim), []
    straight[0, 0] = 0.8
    for angle in np.deg2rad([0.0, 20.0, -37.57, 52.43, 90.0]):
        turn = np.eye(dim)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        simulation = simulation_of(dim, "cpu", precision, mapped=None)
        found.append(shrinkage_after(simulation, turn @ straight))
    np.testing.assert_allclose(found, found[0], rtol=1e3 * ROUNDING[precision])
    assert 0.75 < found[0] < 0.9


def test_a_cell_that_sees_no_node_does_not_stop_the_run(precision):
    """Pulled to four times its length at a constant volume, its corners are beyond its support."""
    simulation = simulation_of(2, "cpu", precision, mapped=None, smoothing_ratio=0.6)
    assert shrinkage_after(simulation, np.diag([4.0, 0.25])) > 0.0
    assert np.isfinite(simulation.time_step_limit)
