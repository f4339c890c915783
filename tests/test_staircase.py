"""Bodies whose edge is a staircase of cells: what its names stand for, its inner corners, and a slope at rest."""

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    Disc,
    Elastic,
    Fixed,
    Numerics,
    Polygon,
    Ramp,
    Roller,
    Scene,
    Simulation,
    edge,
)
from warpsph.mesh.lattice import grid_lattice
from warpsph.mesh.reentrant import reentrant_nodes
from warpsph.step.cells import COURANT_LIMIT

ELL = Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 0.25)


def places(mesh, mask):
    return {tuple(point) for point in np.round(mesh.nodes[mask], 9).tolist()}


@pytest.mark.parametrize(
    ("name", "axis", "place", "low", "high"),
    [("left", 0, 0, 0, 2), ("right", 0, 2, 0, 1), ("bottom", 1, 0, 0, 2), ("top", 1, 2, 0, 1)],
)
def test_edge_is_the_end_of_the_lattice_on_that_side(name, axis, place, low, high):
    """Not the sides of the notch at x = 1 and y = 1, which look the same way."""
    mesh = ELL.mesh()
    along = mesh.nodes[:, 1 - axis]
    expected = (mesh.nodes[:, axis] == place) & (along >= low) & (along <= high)
    assert np.array_equal(edge(name).nodes(mesh), expected)


def test_boundary_is_the_whole_outline_with_its_steps():
    mesh = Polygon([(0, 0), (4, 0), (2, 2), (0, 2)], 0.5).mesh()
    named = np.logical_or.reduce([edge(name).nodes(mesh) for name in ("left", "right", "bottom", "top")])
    on = np.zeros(len(mesh.nodes), dtype=bool)
    on[mesh.faces] = True
    assert np.array_equal(edge("boundary").nodes(mesh), on)
    assert places(mesh, on & ~named) == {(3.0, 0.5), (3.0, 1.0), (2.5, 1.0), (2.5, 1.5), (2.0, 1.5)}


def test_inner_corners_of_plane_bodies():
    assert places(ELL.mesh(), reentrant_nodes(ELL.mesh())) == {(1.0, 1.0)}
    turned = ELL.rotated(0.7).mesh()
    assert np.array_equal(reentrant_nodes(turned), reentrant_nodes(ELL.mesh()))
    slope = Polygon([(0, 0), (4, 0), (2, 2), (0, 2)], 0.5).mesh()
    assert places(slope, reentrant_nodes(slope)) == {(3.0, 0.5), (2.5, 1.0), (2.0, 1.5)}
    for convex in (Box((2.0, 1.0), 0.25), Box((1.0,), 0.25), Box((1.0, 0.5, 0.5), 0.25)):
        assert not reentrant_nodes(convex.mesh()).any()


@pytest.mark.parametrize("spacing", [0.2, 0.1, 1 / 13])
def test_inner_corners_of_a_disc_have_three_cells(spacing):
    mesh = Disc(1.0, spacing).mesh()
    cells = np.bincount(mesh.cells.ravel(), minlength=len(mesh.nodes))
    assert np.array_equal(reentrant_nodes(mesh), cells == 3)


def test_a_smooth_hollow_has_no_inner_corner():
    """Its edge turns inwards by a few degrees from face to face."""
    hollow = Box((2.0, 1.0), 0.1).mapped(lambda x, y: (x, y * (1.0 + 0.3 * (x - 1.0) ** 2))).mesh()
    assert not reentrant_nodes(hollow).any()


def test_inner_edge_of_a_solid():
    """An L, three cells deep: the line in its notch, ends included."""
    kept = np.ones((4, 3, 4), dtype=bool)
    kept[2:, :, 2:] = False
    mesh = grid_lattice(kept, spacing=0.5, origin=np.zeros(3), size=np.array([2.0, 1.5, 2.0]))
    assert places(mesh, reentrant_nodes(mesh)) == {(1.0, 0.5 * k, 1.0) for k in range(4)}


def slope_at_rest(shape, duration=5.0, **numerics):
    """Settlement of an elastic slope's crest under its weight [m], and the largest speed at the end [m/s]."""
    scene = Scene(
        shape=shape,
        material=Elastic(young_modulus=20e6, poisson_ratio=0.45, density=1900.0),
        conditions=[Fixed(edge("bottom")), Roller(edge("left")), Roller(edge("right"))],
        body_force=BodyForce((0.0, -9.81), Ramp(1.0)),
        damping=4.0,
        duration=duration,
        numerics=Numerics(**numerics),
    )
    simulation = Simulation(scene, device="cpu")
    simulation.run()
    crest = simulation.field("displacement")[simulation.nearest_node((12.0, 10.0)), 1]
    return -crest, np.abs(simulation.field("velocity")).max()


@pytest.mark.parametrize("run", [1.0, 2.0])
def test_slope_of_steps_rests_as_the_smooth_one_does(run):
    """1 : 1 and 1 : 2, 6 m high, on steps of 1 m. They cut up to a step off the slope, 1/6 of its height: crests
    settle alike to that. One sank more than twice as far while inner corners lost their stress, and exploded while
    the slope's steps counted as the wall on the right.
    """
    foot, right = 12.0 + 6.0 * run, 24.0 + 6.0 * run
    steps = Polygon([(0, 0), (right, 0), (right, 4), (foot, 4), (12, 10), (0, 10)], 1.0)

    def smooth(x, y):
        return x, y * (10.0 - np.clip((x - 12.0) / run, 0.0, 6.0)) / 10.0

    expected, _ = slope_at_rest(Box((right, 10.0), 1.0).mapped(smooth))
    settlement, speed = slope_at_rest(steps)
    assert settlement == pytest.approx(expected, rel=1 / 6)
    assert speed < 1e-3 * 9.81 / 4.0  # of what falls freely, damped as it is


def test_slope_of_steps_rests_at_any_courant_number():
    """Where it does at another, to 1 %: how far stresses are sharpened goes with it."""
    steps = Polygon([(0, 0), (36, 0), (36, 4), (24, 4), (12, 10), (0, 10)], 1.0)
    rests = [slope_at_rest(steps, duration=10.0, courant=courant) for courant in (0.4, 0.6, COURANT_LIMIT)]
    for settlement, speed in rests:
        assert settlement == pytest.approx(rests[-1][0], rel=0.01)
        assert speed < 1e-5 * 9.81 / 4.0
