"""Conditions on nodes in any direction and inside a body, and the forces they take up (scheme `cells`)."""

import math

import numpy as np
import pytest

from tests.test_conjugate_cells import BODIES, NUMERICS
from warpsph import (
    BodyForce,
    Box,
    EdgeForce,
    Elastic,
    Fixed,
    Linear,
    Numerics,
    Output,
    PrescribedVelocity,
    Probe,
    Reaction,
    Roller,
    Rotating,
    Scene,
    SceneError,
    Simulation,
    Traction,
    edge,
    where,
)
from warpsph.scene.document import decode, encode

SOIL = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=2000.0)


def run(duration, **scene):
    scene = {"material": SOIL, "numerics": NUMERICS, "duration": duration} | scene
    simulation = Simulation(Scene(**scene), device="cpu")
    simulation.run()
    return simulation


@pytest.mark.parametrize("kind", BODIES)
def test_a_clamp_inside_a_body_is_as_stiff_as_one_at_its_edge(kind):
    """The half of a body that is held all through takes no part: the other half is as if cut off and fixed there.

    Cells that nobody can strain count in no node's strain: a bar of n cells was 1 + 1/n times as soft.
    """
    dim, cells = BODIES[kind]

    def free_half(begin):
        load = (1e3, -500.0, 300.0)[:dim]
        simulation = run(
            0.3,
            shape=Box((1.0 - begin, 0.5, 0.5)[:dim], 0.125, origin=(begin, 0.0, 0.0)[:dim], cells=cells),
            conditions=[Fixed(where(lambda x, *y: x <= 0.5)), Traction(edge("right"), load)],
            damping=20.0,
        )
        kept = simulation.mesh.nodes[:, 0] >= 0.5
        density = simulation.field("density")
        held = simulation.mesh.nodes[:, 0] < 0.5
        assert density[held] == pytest.approx(2000.0, rel=1e-12)
        beyond = simulation.mesh.nodes[:, 0] > 0.5
        return [simulation.field(name)[kept] for name in ("displacement", "stress")], density[beyond]

    (inside, density), (at_edge, expected) = free_half(0.0), free_half(0.5)
    for one, other in zip(inside, at_edge, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * np.abs(other).max())
    assert density == pytest.approx(expected, rel=1e-9)


def test_a_vane_that_turns_inside_a_body_strains_what_is_around_it():
    """A rigid square that turns in a block: its own cells have no stress, and its torque is the boundary's."""
    inner = where(lambda x, y: (np.abs(x) <= 0.25) & (np.abs(y) <= 0.25))
    simulation = run(
        4.0,
        shape=Box((2.0, 2.0), 0.125, origin=(-1.0, -1.0)),
        conditions=[Fixed(edge("boundary")), Rotating(inner, angular_velocity=0.002)],
        damping=10.0,
        large_displacements=False,
    )
    mesh, stress = simulation.mesh, simulation.field("stress")
    inside = (np.abs(mesh.nodes) < 0.2).all(axis=1)
    assert np.abs(stress[inside]).max() == 0.0 < np.abs(stress).max()
    x, y = mesh.nodes[simulation.scene.boundary.nodes].T
    rows, (fx, fy) = simulation.scene.boundary.nodes, simulation.stepper.reactions.numpy().T
    torque, vane = x * fy - y * fx, inner.nodes(mesh)[rows]
    assert torque[vane].sum() > 0.0
    assert torque[vane].sum() == pytest.approx(-torque[~vane].sum(), rel=0.01)


@pytest.mark.parametrize("kind", ["quads", "triangles"])
@pytest.mark.parametrize("scheme", ["cells", "taylor"])
def test_smooth_walls_and_footings_may_lean(kind, scheme):
    """A block between smooth walls under a smooth footing, however all of it stands: the same block, turned."""
    if scheme == "taylor" and kind == "triangles":
        pytest.skip("it takes quads")

    def block(angle):
        cos, sin = math.cos(angle), math.sin(angle)
        footing = edge("top") & where(lambda x, y: cos * x + sin * y <= 0.5 + 1e-9)
        scene = {
            "shape": Box((1.0, 0.5), 0.125, cells=BODIES[kind][1]).rotated(angle, about=(0.0, 0.0)),
            "conditions": [
                *(Roller(edge(side)) for side in ("left", "right", "bottom")),
                PrescribedVelocity(footing, Linear(-2.0), along=(-2.0 * sin, 2.0 * cos)),
            ],
            "numerics": Numerics(velocity_scheme=scheme),
        }
        simulation = run(0.1, **scene)
        back = np.array([[cos, -sin], [sin, cos]])
        return simulation.field("displacement") @ back

    turned, upright = block(0.6), block(0.0)
    assert np.abs(upright[:, 1]).max() == pytest.approx(0.01, rel=1e-6)
    assert turned == pytest.approx(upright, abs=1e-9 * 0.01)


def test_motions_that_are_equal_at_all_times_may_meet():
    """Along (1, 1) a wall stands still, and so does what goes to the right as fast as it goes down."""
    wall = Roller(edge("left"), normal=(1.0, 1.0))

    def scene(*velocity):
        return Scene(
            shape=Box((1.0, 1.0), 0.25),
            material=SOIL,
            conditions=[wall, PrescribedVelocity(edge("bottom"), velocity)],
            duration=1.0,
            numerics=NUMERICS,
        )

    boundary = scene(Linear(1.0), lambda t: -t).boundary
    corner = boundary.nodes.tolist().index(0)
    assert not boundary.velocity_projector[corner].any()
    for other in (Linear(-0.999), lambda t: -t * (t < 0.5)):
        with pytest.raises(SceneError, match="different velocities in one direction"):
            scene(Linear(1.0), other)


def test_velocities_along_a_direction_are_checked():
    top = edge("top")
    for wrong, message in (
        (
            {"velocity": (0.0, 1.0), "along": (0.0, 1.0)},
            r"^PrescribedVelocity.velocity = .*number or a function of time",
        ),
        ({"velocity": 1.0, "along": (0.0, 0.0)}, r"^PrescribedVelocity.along = .*zero vector"),
        ({"velocity": 1.0, "along": "up"}, r"^PrescribedVelocity.along = 'up'"),
        ({"velocity": 1.0}, r"^PrescribedVelocity.velocity = 1.0 .*needs along"),
    ):
        with pytest.raises(SceneError, match=message):
            PrescribedVelocity(top, **wrong)
    lost = PrescribedVelocity(top, 1.0, along=(1.0, 0.0, 0.0))
    with pytest.raises(SceneError, match=r"^PrescribedVelocity.along = .*2 components"):
        Scene(shape=Box((1.0, 1.0), 0.5), material=SOIL, conditions=[lost], duration=1.0, numerics=NUMERICS)


@pytest.mark.parametrize("kind", BODIES)
def test_reactions_balance_weight_and_loads(kind):
    """A block of any cells on a rough base under a footing: at rest all forces add up to nothing, to rounding."""
    dim, axis = BODIES[kind][0], BODIES[kind][0] - 1
    base, top = ("left", "right") if dim == 1 else ("bottom", "top")
    rng = np.random.default_rng(3)
    footing = edge(top) & where(lambda *x: x[0] <= 0.5) if dim > 1 else edge(top)
    beside = [Traction(edge(top) & where(lambda *x: x[0] >= 0.5), tuple(np.eye(dim)[axis] * -3e3))] * (dim > 1)

    def moved(*x):
        inner = np.all([(part > 1e-6) & (part < 1.0 - 1e-6) for part in x], axis=0)
        return tuple(part + inner * 0.06 * rng.uniform(-1.0, 1.0, np.shape(part)) for part in x)

    held = run(
        15.0,
        shape=Box((1.0,) * dim, 0.25, cells=BODIES[kind][1]).mapped(moved),
        conditions=[Fixed(edge(base)), Fixed(footing) if dim == 1 else Roller(footing), *beside],
        body_force=BodyForce(tuple(np.eye(dim)[axis] * -9.81)),
        damping=60.0,
        large_displacements=False,
    )
    forces = [Reaction(on, axis)(held) for on in (edge(base), footing)]
    expected = -9.81 * 2000.0 - (1.5e3 if dim > 1 else 0.0)
    assert sum(forces) == pytest.approx(expected, rel=1e-10)
    assert Reaction(edge(base) | footing, axis)(held) == pytest.approx(sum(forces), rel=1e-12)


@pytest.mark.parametrize("kind", ["quads", "triangles"])
def test_reaction_and_edge_force_agree_on_sign_and_whole_faces(kind):
    """Pressed between smooth walls: −σ22 on all of the top."""
    simulation = run(
        3.0,
        shape=Box((1.0, 0.5), 0.125, cells=BODIES[kind][1]),
        conditions=[
            *(Roller(edge(side)) for side in ("left", "right", "bottom")),
            PrescribedVelocity(edge("top"), (None, lambda t: -0.01 * (t < 0.1))),
        ],
        damping=100.0,
    )
    for on, axis in ((edge("top"), 1), (edge("bottom"), 1), (edge("right"), 0)):
        assert Reaction(on, axis)(simulation) == pytest.approx(EdgeForce(on, axis)(simulation), rel=1e-6)
    assert Reaction(edge("top"), 1)(simulation) > 1e3


def test_edge_force_counts_half_faces_of_a_solid():
    """Faces of four corners of which three are selected count by their triangle: x + y ≤ 1 is half of the top."""
    scene = Scene(
        shape=Box((1.0, 1.0, 1.0), 0.25),
        material=SOIL,
        stress=lambda x, y, z: (0.0, 0.0, -1e3, 0.0, 0.0, 0.0),
        conditions=[Fixed(edge("bottom"))],
        duration=1.0,
        numerics=NUMERICS,
    )
    simulation = Simulation(scene, device="cpu")
    half = edge("top") & where(lambda x, y, z: x + y <= 1.0 + 1e-9)
    assert EdgeForce(half, 2)(simulation) == pytest.approx(500.0, rel=1e-12)
    assert EdgeForce(edge("top"), 2)(simulation) == pytest.approx(1000.0, rel=1e-12)


@pytest.mark.parametrize(
    ("probe", "more", "message"),
    [
        (lambda: Reaction("top", 1), {}, r"^Reaction.on = 'top'"),
        (lambda: Reaction(edge("top"), -1), {}, r"^Reaction.axis = -1"),
        (lambda: Reaction(edge("bottom"), 2), {}, r"^Reaction.axis = 2 .*below 2"),
        (lambda: Reaction(edge("top"), 1), {}, r"^Reaction.on = .*a node that a condition holds or moves$"),
        (
            lambda: Reaction(edge("bottom"), 1),
            {"numerics": Numerics(velocity_scheme="taylor")},
            r"^Reaction = .*velocity_scheme taylor has no forces on nodes; take EdgeForce$",
        ),
    ],
)
def test_reactions_that_there_are_not_are_refused(probe, more, message):
    with pytest.raises(SceneError, match=message):
        Scene(
            **{
                "shape": Box((1.0, 1.0), 0.25),
                "material": SOIL,
                "conditions": [Fixed(edge("bottom"))],
                "duration": 1.0,
                "numerics": NUMERICS,
                "output": Output(probes=(Probe("base", "N/m", probe()),)),
            }
            | more
        )


def test_velocities_along_a_direction_are_stored_and_read_again():
    leaning = PrescribedVelocity(edge("top"), Linear(-2.0), along=(3.0, 4.0))
    scene = Scene(shape=Box((1.0, 1.0), 0.5), material=SOIL, conditions=[leaning], duration=1.0, numerics=NUMERICS)
    assert leaning.along == (0.6, 0.8)
    assert decode(*encode(scene)).conditions == (leaning,)
