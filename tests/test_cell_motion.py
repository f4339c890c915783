"""Densities from cell volumes under homogeneous motions, and the spacing that the time step follows."""

import itertools

import numpy as np
import pytest

from warpsph import Box, Elastic, Numerics, Scene, Simulation
from warpsph.operators.cell_motion import LEAST_VOLUME_SHARE
from warpsph.scene import KERNELS

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


def move(simulation, dt):
    """Step 14 alone."""
    stepper = simulation.stepper
    stepper.clock.begin([0.0], dt)
    stepper.lists.motion.move(stepper.clock.time_step)


def moved(simulation, F):
    """Moved by x → F x in four unequal steps of the cells' motion."""
    reference = simulation.mesh.nodes
    there, done = reference @ F.T, 0.0
    for part in (0.1, 0.4, 0.3, 0.2):
        dt = 0.5
        simulation.nodes.half_velocity.assign(part / dt * (there - reference))
        move(simulation, dt)
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
    """ρ = ρ₀/det F at every node and cell, edges, corners and distorted cells included."""
    F = MOTIONS[name](dim)
    simulation = simulation_of(dim, device, precision)
    mass = simulation.field("mass")
    weight = simulation.nodes.weight.numpy()
    moved(simulation, F)
    ratio, tolerance = np.linalg.det(F), 10 * ROUNDING[precision]
    np.testing.assert_allclose(simulation.field("position"), simulation.mesh.nodes @ F.T, atol=tolerance)
    np.testing.assert_allclose(simulation.field("density"), SOFT.density / ratio, rtol=tolerance)
    np.testing.assert_allclose(simulation.auxiliary.density.numpy(), SOFT.density / ratio, rtol=tolerance)
    volume = simulation.auxiliary.volume.numpy()
    np.testing.assert_allclose(volume, simulation.mesh.middle_volumes() * ratio, rtol=tolerance)
    held = simulation.nodes.volume.numpy() * simulation.field("density")
    np.testing.assert_allclose(held, weight, rtol=tolerance)
    np.testing.assert_array_equal(simulation.field("mass"), mass)


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_smoothing_lengths_follow_the_longest_edge_or_diagonal(device, precision, dim, name):
    """On a lattice, at cells and nodes alike, whose cells have all one shape."""
    F, ratio = MOTIONS[name](dim), 0.8
    simulation = moved(simulation_of(dim, device, precision, mapped=None, smoothing_ratio=ratio), F)
    edges = 0.25 * F.T
    pairs = list(itertools.combinations(edges, 2))
    lengths = [np.linalg.norm(e) for e in edges]
    lengths += [np.linalg.norm(d) / np.sqrt(2.0) for e, f in pairs for d in (e + f, e - f)]
    expected, tolerance = ratio * max(lengths), 10 * ROUNDING[precision]
    np.testing.assert_allclose(simulation.auxiliary.smoothing_length.numpy(), expected, rtol=tolerance)
    np.testing.assert_allclose(simulation.field("smoothing_length"), expected, rtol=tolerance)


def mean_edges(corners):
    """∂x/∂ξ_a in column a: the mean of the differences along each axis; corners (2ᵈ, d)."""
    dim = corners.shape[1]
    grid = corners.reshape((2,) * dim + (dim,))
    return np.stack([np.diff(grid, axis=a).reshape(-1, dim).mean(axis=0) for a in range(dim)], axis=1)


def edges_of(simulation):
    """Of every cell where the nodes are now, shape (m, d, d)."""
    position = simulation.field("position").astype(float)
    return np.array([mean_edges(corners) for corners in position[simulation.mesh.cells]])


def missed_neighbours(simulation):
    """How many nodes, and cells, within a stretched support the pair lists do not hold."""
    mesh, numerics, stepper = simulation.mesh, simulation.scene.numerics, simulation.stepper
    reach = 0.999 * KERNELS[numerics.kernel].support * numerics.smoothing_ratio
    frames = np.linalg.inv(edges_of(simulation))
    of_nodes = [frames[(mesh.cells == i).any(axis=1)].mean(axis=0) for i in range(len(mesh.nodes))]
    nodes, cells = (part.point.numpy()["x"].astype(float) for part in (simulation.nodes, simulation.auxiliary))
    missed = 0
    for pairs, targets, sources, metrics in (
        (stepper.lists.around_auxiliary, cells, nodes, frames),
        (stepper.lists.around_nodes, nodes, cells, of_nodes),
    ):
        start, index = pairs.start.numpy(), pairs.index.numpy()
        for i, metric in enumerate(metrics):
            within = np.flatnonzero(np.linalg.norm((sources - targets[i]) @ metric.T, axis=1) < reach)
            missed += len(np.setdiff1d(within, index[start[i] : start[i + 1]]))
    return missed


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_lists_hold_all_of_the_stretched_supports(device, dim, name):
    """The supports are ellipses, the lists are made for circles."""
    simulation = moved(simulation_of(dim, device, "float64"), MOTIONS[name](dim))
    simulation.stepper.lists.refresh()
    assert missed_neighbours(simulation) == 0


@pytest.mark.parametrize("large", [True, False])
def test_the_first_lists_hold_all_of_the_stretched_supports(device, large):
    """A shape whose cells are twice as long as high from the start, moving or not."""
    scene = Scene(
        shape=Box((1.0, 1.0), 0.125).mapped(lambda x, y: (2.0 * x, y)),
        material=SOFT,
        duration=1.0,
        numerics=Numerics(smoothing_ratio=0.85),
        large_displacements=large,
    )
    assert missed_neighbours(Simulation(scene, device=device, precision="float64")) == 0


def test_a_folded_cell_keeps_a_tenth_of_its_volume(device, precision):
    """A corner pushed far through its cell: the cell's volume would be negative."""
    simulation = simulation_of(2, device, precision, mapped=None)
    corner, velocity = simulation.nearest_node((0.0, 0.0)), np.zeros((25, 2))
    velocity[corner] = (0.6, 0.6)
    simulation.nodes.half_velocity.assign(velocity)
    move(simulation, 1.0)
    density = simulation.field("density")
    assert density[corner] == pytest.approx(SOFT.density / LEAST_VOLUME_SHARE, rel=ROUNDING[precision])
    assert np.isfinite(density).all() and density.min() >= SOFT.density * (1 - ROUNDING[precision])


# ---------------------------------------------------------------------------------------------------------
# Spacing
# ---------------------------------------------------------------------------------------------------------


def shrinkage_after(simulation, F):
    stepper = moved(simulation, F).stepper
    stepper.lists.refresh()
    return stepper.lists.shrinkage


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("factor", [1.4, 1.0, 0.7, 0.5])
def test_uniform_stretch_and_compression_change_the_step(device, precision, dim, factor):
    """c_p ∝ ρ^−½ = factor^{d/2}, distances by the factor, whatever the cells; never longer than at first."""
    simulation = simulation_of(dim, device, precision)
    limit, tolerance = simulation.time_step_limit, 10 * ROUNDING[precision]
    expected = min(1.0, factor ** (1.0 - 0.5 * dim))
    assert shrinkage_after(simulation, factor * np.eye(dim)) == pytest.approx(expected, rel=tolerance)
    assert simulation.time_step_limit == pytest.approx(expected * limit, rel=tolerance)


def test_the_step_follows_a_cell_however_flat_it_gets(device, precision):
    """No floor: a step that is too long for its cells is where a run breaks down. The volume stays."""
    simulation = simulation_of(2, device, precision, mapped=None)
    assert shrinkage_after(simulation, np.diag([0.1, 10.0])) == pytest.approx(0.1, rel=100 * ROUNDING[precision])


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_spacing_is_the_least_singular_value_of_the_edges_times_the_root_of_the_density(precision, dim, name):
    """Of every cell of a distorted lattice; the power method may be 0.3 % above, and never below."""
    simulation = simulation_of(dim, "cpu", precision)
    shrinkage_after(simulation, MOTIONS[name](dim))
    spacing = 1.0 / simulation.stepper.lists.motion._spacing._rate.numpy()
    edges = edges_of(simulation)
    density = SOFT.density * simulation.mesh.middle_volumes() / np.abs(np.linalg.det(edges))
    error = spacing / (np.linalg.svd(edges, compute_uv=False).min(axis=1) * np.sqrt(density)) - 1.0
    assert error.min() >= -100 * ROUNDING[precision]
    assert error.max() <= 0.003


@pytest.mark.parametrize("dim", [2, 3])
def test_spacing_does_not_depend_on_the_direction_of_the_compression(precision, dim):
    """A lattice compressed by 0.8, along its axes or across them, and turned: 0.8 √(1/0.8)."""
    straight = np.eye(dim)
    straight[0, 0] = 0.8
    for angle in np.deg2rad([0.0, 20.0, -37.57, 52.43, 90.0]):
        turn = np.eye(dim)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        for F in (turn @ straight, turn @ straight @ turn.T):
            found = shrinkage_after(simulation_of(dim, "cpu", precision, mapped=None), F)
            assert found == pytest.approx(np.sqrt(0.8), rel=100 * ROUNDING[precision])


def test_a_folded_cell_does_not_shorten_the_step(precision):
    """A corner pushed through its cell; without it the others keep their spacing and decide."""
    simulation = simulation_of(2, "cpu", precision, mapped=None)
    corner, velocity = simulation.nearest_node((0.0, 0.0)), np.zeros((25, 2))
    velocity[corner] = (0.6, 0.6)
    simulation.nodes.half_velocity.assign(velocity)
    move(simulation, 1.0)
    simulation.stepper.lists.refresh()
    assert simulation.stepper.lists.shrinkage == pytest.approx(1.0, rel=ROUNDING[precision])
