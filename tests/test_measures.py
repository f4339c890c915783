"""Measures on synthetic fields whose answer is known."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from warpsph import Box, Check
from warpsph.analysis import (
    Sampler,
    band_profile,
    checkerboard,
    checkerboard_amplitude,
    fit_band,
    growth_rate,
    smallest_distance,
    split_cells,
    trace_ridge,
    width_at_half,
)


def alternating(mesh):
    """(−1)^{i+j+…} at the nodes of a box whose spacing is 0.1."""
    return (-1.0) ** np.rint(mesh.nodes / 0.1).astype(int).sum(axis=1)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_checkerboard_on_a_bilinear_field_is_found_exactly(dim):
    """Σ s_k f_k over a cell is zero for every field linear in each coordinate, and 2ᵈ A for a checkerboard."""
    mesh = Box((0.7, 0.5, 0.4)[:dim], 0.1).mesh()
    smooth = 3.0 + np.prod(1.0 + 5.0 * mesh.nodes, axis=1)
    if dim == 1:
        smooth[:] = 3.0 + 5.0 * mesh.nodes[:, 0]
        # In a bar the stencil is [−1 2 −1]/4, which is zero for linear fields.
    amplitude = 0.02
    found = checkerboard_amplitude(mesh, smooth + amplitude * alternating(mesh))
    assert found == pytest.approx(amplitude, rel=1e-12)
    assert checkerboard_amplitude(mesh, smooth) < 1e-14


def test_checkerboard_is_the_nine_point_stencil():
    """[1 −2 1] ⊗ [1 −2 1]/16 at the interior nodes, for any field."""
    mesh = Box((0.6, 0.4), 0.1).mesh()
    field = np.random.default_rng(1).normal(size=(7, 5))
    values = field[tuple(np.rint(mesh.nodes / 0.1).astype(int).T)]
    expected = sum(
        (1.0, -2.0, 1.0)[a] * (1.0, -2.0, 1.0)[b] / 16.0 * field[a : a + 5, b : b + 3]
        for a, b in itertools.product(range(3), repeat=2)
    )
    np.testing.assert_allclose(checkerboard(mesh, values), expected.ravel(), atol=1e-14)


@given(st.integers(2, 40), st.integers(0, 10**6))
def test_smallest_distance_is_that_of_all_pairs(n, seed):
    points = np.random.default_rng(seed).normal(size=(n, 2))
    every = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(n, 1)]
    assert smallest_distance(points) == pytest.approx(every.min(), rel=1e-12)


def test_growth_rate_of_an_exponential_that_starts_from_a_floor_and_saturates():
    t = np.linspace(0.0, 1.0, 2001)
    amplitude = np.minimum(1e-6 * np.sqrt(1.0 + np.exp(40.0 * t)), 1.0)  # rate 20 once the floor is passed
    assert growth_rate(t, amplitude, low=1e-4, high=1e-1) == pytest.approx(20.0, rel=1e-3)
    assert growth_rate(t, np.exp(-3.0 * t), low=2.0, high=5.0) == pytest.approx(-3.0, rel=1e-9)


def band_of(angle, half_width, half_length, cells=80):
    """A box of 8 m with a straight band of Gaussian profile through its middle."""
    mesh = Box((8.0, 8.0), 8.0 / cells).mesh()
    away = mesh.nodes - 4.0
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    xi, eta = away @ along, away @ np.array([-along[1], along[0]])
    return mesh, np.where(np.abs(xi) <= half_length, np.exp(-((eta / half_width) ** 2)), 0.0)


@pytest.mark.parametrize("angle", [-60.0, -45.0, 0.0, 30.0, 45.0, 75.0])
def test_band_angle_and_length(angle):
    """A band's ends cut the lattice: that leaves at most Δx/length of its angle (1°) and 2 Δx of its length."""
    mesh, strain = band_of(angle, half_width=0.4, half_length=3.0)
    band = fit_band(mesh.nodes, strain)
    assert band.angle == pytest.approx(angle, abs=1.0)
    assert band.length == pytest.approx(6.0, abs=0.2)
    np.testing.assert_allclose(band.centre, (4.0, 4.0), atol=0.1)


def test_band_fit_ignores_a_single_crushed_node():
    mesh, strain = band_of(45.0, half_width=0.4, half_length=3.0)
    strain[np.argmin(((mesh.nodes - (4.0, 1.0)) ** 2).sum(axis=1))] = 3.0
    assert fit_band(mesh.nodes, strain).angle == pytest.approx(45.0, abs=1.5)


@pytest.mark.parametrize("half_width", [0.3, 0.6])
def test_band_width_of_a_gaussian_profile(half_width):
    """Full width at half maximum 2 √(ln 2) w; linear interpolation between nodes adds up to Δx²/w² of it."""
    mesh, strain = band_of(-45.0, half_width, half_length=3.5)
    across, profile = band_profile(Sampler(mesh, strain), fit_band(mesh.nodes, strain), reach=2.0)
    expected = 2.0 * np.sqrt(np.log(2.0)) * half_width
    assert width_at_half(across, profile) == pytest.approx(expected, rel=(0.1 / half_width) ** 2)


def test_width_of_a_triangle_is_half_its_base_and_none_without_flanks():
    x = np.linspace(-2.0, 2.0, 401)
    assert width_at_half(x, np.maximum(0.0, 1.0 - np.abs(x - 0.3))) == pytest.approx(1.0, rel=1e-12)
    assert np.isnan(width_at_half(x, 1.0 + 0.1 * x))


def test_sampler_is_exact_for_linear_fields_and_has_no_value_outside():
    mesh = Box((1.0, 1.0), 0.25).rotated(0.4).mesh()
    sample = Sampler(mesh, 2.0 - 3.0 * mesh.nodes[:, 0] + mesh.nodes[:, 1])
    inside = mesh.nodes.mean(axis=0) + np.random.default_rng(2).uniform(-0.3, 0.3, size=(50, 2))
    np.testing.assert_allclose(sample(inside), 2.0 - 3.0 * inside[:, 0] + inside[:, 1], rtol=1e-12)
    assert np.isnan(sample(np.array([[5.0, 5.0]]))).all()


def test_cells_are_split_without_gap_or_overlap():
    mesh = Box((1.0, 0.5), 0.25).mapped(lambda x, y: (x + 0.2 * x * y, y - 0.1 * x)).mesh()
    corners, triangles, values = split_cells(mesh, alternating(mesh))
    a, b, c = corners[triangles].transpose(1, 0, 2)
    areas = 0.5 * np.linalg.det(np.stack([b - a, c - a], axis=1))
    assert (np.abs(areas) > 0.0).all() and len(set(np.sign(areas))) == 1
    assert np.abs(areas).sum() == pytest.approx(mesh.cell_volumes().sum(), rel=1e-12)
    assert len(values) == len(mesh.nodes) + len(mesh.cells)


@pytest.mark.parametrize("smoothing", [0.0, 0.2])
def test_ridge_of_a_ring_and_its_gap(smoothing):
    """A ring about (4, 4) of radius 2 with a gap: found to Δx/2, and empty in the gap."""
    mesh = Box((8.0, 8.0), 0.1).mesh()
    away = mesh.nodes - 4.0
    strain = np.exp(-(((np.hypot(*away.T) - 2.0) / 0.3) ** 2))
    strain[np.abs(np.degrees(np.arctan2(away[:, 1], away[:, 0]))) < 20.0] = 0.0
    sample = Sampler(mesh, strain)
    along = {"nearest": 1.0, "farthest": 3.5, "smoothing": smoothing}
    ring = trace_ridge(sample, (4.0, 4.0), angles=np.arange(30.0, 331.0, 10.0), **along)
    np.testing.assert_allclose(ring.radius, 2.0, atol=0.05)
    np.testing.assert_allclose(np.linalg.norm(ring.points - 4.0, axis=1), ring.radius, rtol=1e-12)
    assert (ring.strain > 0.9).all()
    assert trace_ridge(sample, (4.0, 4.0), angles=np.array([0.0]), **along).strain < 1e-12


@pytest.mark.parametrize(("value", "passed"), [(97.0, False), (98.5, True), (109.0, True), (111.0, False)])
def test_check_with_another_bound_below_its_reference(value, passed):
    check = Check("load", value, 100.0, "N", bound=0.10, bound_below=0.02)
    assert check.passed is passed
    assert check.as_dict()["bound"] == (0.02 if value < 100.0 else 0.10)
