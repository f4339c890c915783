"""Bodies one cell thick between two free faces are refused; between walls, or on one, one cell is enough."""

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    Disc,
    Elastic,
    Fixed,
    Free,
    FreeSurface,
    Numerics,
    Polygon,
    PrescribedVelocity,
    Roller,
    Scene,
    SceneError,
    Simulation,
    edge,
)

STRIP, LAYER, PLATE = Box((1.0, 0.1), 0.1), Box((1.0, 0.2), 0.1), Box((0.5, 0.5, 0.1), 0.1)
PUBLISHED = Numerics(velocity_scheme="blanc-pastor")
FACES = [Free(edge("top")), Free(edge("bottom"))]


def scene(shape, **changes):
    return Scene(shape=shape, material=Elastic(young_modulus=1e6, density=1e3), **{"duration": 1.0, **changes})


def ring(rows):
    bar = Box((8.0, 0.25 * rows), 0.25)
    return bar.mapped(lambda x, y: ((3.0 - y) * np.cos(0.5 * x), (3.0 - y) * np.sin(0.5 * x)))


@pytest.mark.parametrize(
    ("shape", "changes", "place"),
    [
        (STRIP, {}, "(0.05, 0.05)"),
        (STRIP, {"conditions": [Fixed(edge("left"))]}, "(0.15, 0.05)"),
        (STRIP, {"conditions": [Roller(edge("left")), PrescribedVelocity(edge("right"), (1.0, None))]}, "(0.15, "),
        (STRIP, {"free_surface": FreeSurface(), "numerics": PUBLISHED}, "(0.05, 0.05)"),
        (STRIP, {"numerics": PUBLISHED, "conditions": FACES}, "(0.05, 0.05)"),
        (STRIP.rotated(0.5 * np.pi), {}, "(-0.05, 0.05)"),
        (PLATE, {}, "(0.05, 0.05, 0.05)"),
        (PLATE, {"free_surface": FreeSurface(), "numerics": PUBLISHED}, "(0.05, 0.05, 0.05)"),
        (Box((0.1,), 0.1), {}, "(0.05)"),
        (ring(1), {}, ""),
        (
            Polygon([(0, 0), (2, 0), (2, 1), (0.6, 1), (0.6, 2), (0.5, 2), (0.5, 1), (0, 1)], 0.1),
            {},
            "(0.55, 1.15)",
        ),
    ],
)
def test_one_cell_between_two_free_faces_is_refused(shape, changes, place):
    with pytest.raises(SceneError) as caught:
        scene(shape, **changes)
    message = str(caught.value)
    assert caught.value.field == "spacing" and "\n" not in message
    assert f"at {place}" in message and "one cell thick between two free faces" in message


@pytest.mark.parametrize(
    ("shape", "changes"),
    [
        (LAYER, {}),
        (ring(2), {}),
        (STRIP, {"conditions": [Fixed(edge("bottom"))]}),
        (STRIP, {"conditions": [Roller(edge("top"))], "free_surface": FreeSurface(), "numerics": PUBLISHED}),
        (STRIP, {"conditions": [Roller(edge("bottom")), Roller(edge("top"))]}),
        (STRIP, {"numerics": PUBLISHED}),  # its faces keep the tractions that they have
        (STRIP, {"numerics": PUBLISHED, "conditions": FACES[:1]}),
        (PLATE, {"conditions": [Roller(edge("front")), Roller(edge("bottom"))]}),
        (Box((0.1,), 0.1), {"conditions": [Fixed(edge("left"))]}),
        (Disc(1.0, 0.3), {}),
        (Polygon([(0, 0), (2, 0), (0, 2)], 0.2), {}),
    ],
)
def test_two_cells_or_a_wall_are_enough(shape, changes):
    assert len(scene(shape, **changes).mesh.cells)


def test_cantilever_two_cells_thick_rests():
    """It hangs as a beam does, w = q L⁴/(8 E I) + q L²/(2 κ G A), κ = 5/6, ν = 0, but softer with so few cells.

    One cell thick, and not refused, it falls at the speed g/c at which damping holds a free body.
    """
    gravity, length, height, modulus = 0.01, 1.0, 0.2, 1e6
    load, inertia = 1e3 * gravity * height, height**3 / 12.0
    bending = load * length**4 / (8.0 * modulus * inertia)
    shear = load * length**2 / (2.0 * 5.0 / 6.0 * 0.5 * modulus * height)
    clamped = scene(
        LAYER,
        conditions=[Fixed(edge("left"))],
        body_force=BodyForce((0.0, -gravity)),
        damping=8.0,
        duration=5.0,
    )
    simulation = Simulation(clamped, device="cpu")
    simulation.run()
    settlement = -simulation.field("displacement")[simulation.nearest_node((1.0, 0.1)), 1]
    assert bending + shear < settlement < 2.0 * (bending + shear)
    assert np.abs(simulation.field("velocity")).max() < 0.02 * gravity / 8.0
