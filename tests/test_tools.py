"""Rigid tools in scheme `cells`: nothing passes them, momentum is kept, friction is exact, and nothing is made."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import warp as wp

from warpsph import (
    Adhesive,
    Block,
    BodyForce,
    Box,
    Coulomb,
    Cylinder,
    Elastic,
    Fixed,
    GivenMesh,
    Glued,
    History,
    Linear,
    Output,
    PerzynaVonMises,
    Plane,
    PrescribedVelocity,
    Probe,
    Ramp,
    Roller,
    Rough,
    Scene,
    SceneError,
    Simulation,
    Smooth,
    Sphere,
    ToolForce,
    ToolImpulse,
    ToolTorque,
    edge,
)
from warpsph.device.compiling import forward_kernel
from warpsph.device.launching import Launcher
from warpsph.device.precision import precision as precision_of
from warpsph.mesh.continuum import CONTINUA
from warpsph.operators.tool_forms import distance_function, exact_vector, middle_function, tool_table, tool_types
from warpsph.physics.space import Space
from warpsph.scene.document import decode, encode
from warpsph.scene.fingerprint import fingerprint

G = 9.81
SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
SOIL = PerzynaVonMises(young_modulus=1e6, poisson_ratio=0.3, density=2000.0, fluidity=50.0, yield_size=4e3)
GROUND = Plane((0.0, 0.0), (0.0, 1.0), name="ground")


def run(scene, **more):
    simulation = Simulation(scene, **{"device": "cpu", "threads": 1} | more)
    simulation.run()
    return simulation


def momentum(simulation):
    return simulation.field("mass") @ simulation.field("velocity")


# What tools are: forms

FORMS = {
    "line": (1, Plane((0.3,), (-2.0,))),
    "segment": (1, Block((0.3,), (0.4,))),
    "plane": (2, Plane((0.3, -0.2), (1.0, 2.0))),
    "circle": (2, Cylinder((0.1, 0.2), 0.3)),
    "square": (2, Block((0.1, 0.0), (0.6, 0.3), angle=0.4)),
    "pebble": (2, Block((0.1, 0.0), (0.6, 0.3), angle=-2.0, rounding=0.1)),
    "floor": (3, Plane((0.3, -0.2, 0.1), (1.0, 2.0, -1.0))),
    "sphere": (3, Sphere((0.1, 0.2, 0.0), 0.4)),
    "brick": (3, Block((0.1, 0.2, 0.0), (0.4, 0.6, 0.8), angle=0.7, rounding=0.05)),
    "pipe": (3, Cylinder((0.1, 0.2, 0.0), 0.3, axis=(1.0, 1.0, 0.5))),
    "pile": (3, Cylinder((0.1, 0.2, 0.0), 0.3, axis=(0.0, 1.0, 0.5), length=0.7)),
}


@cache
def _distances(space):
    distance, middle = distance_function(space), middle_function(space)

    @forward_kernel
    def distances(
        first: int,
        x: wp.array(dtype=space.types.vector),
        table: tool_types(space),
        travel: wp.array(dtype=exact_vector(space)),
        gap: wp.array(dtype=space.real),
        way: wp.array(dtype=space.types.vector),
    ):
        i = first + wp.tid()
        d, n = distance(x[i], middle(0, table, travel), 0, table)
        gap[i] = d
        way[i] = n

    return distances


@pytest.mark.parametrize("name", FORMS)
def test_distances_on_the_device_are_those_of_the_form_and_the_way_out_is_their_gradient(name):
    dim, tool = FORMS[name]
    form, space = tool.form(dim), Space(CONTINUA[dim], precision_of("float64"))
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (400, dim))
    origin = (-5.0 if name == "line" else 5.0,) * dim
    scene = Scene(shape=Box((0.2,) * dim, 0.1, origin=origin), material=SOFT, duration=1.0, tools=(tool,))
    launcher, device, vector = Launcher(wp.get_device("cpu")), "cpu", space.types.vector
    x = wp.array(points - scene.mesh.middle, dtype=vector, device=device)
    gap, way = wp.zeros(400, dtype=space.real, device=device), wp.zeros(400, dtype=vector, device=device)
    travel = wp.zeros(1, dtype=exact_vector(space), device=device)
    table = tool_table(scene, space, wp.get_device("cpu"), 0)
    launcher.launch(_distances(space), gap, [x, table, travel, gap, way])
    assert gap.numpy() == pytest.approx(form.distance(points), abs=1e-12)
    step = 1e-6
    ends = [(form.distance(points + step * a), form.distance(points - step * a)) for a in np.eye(dim)]
    slopes = [(high - low) / (2.0 * step) for high, low in ends]
    smooth = np.abs(np.linalg.norm(slopes, axis=0) - 1.0) < 1e-6  # not where two sides are as near
    assert smooth.mean() > 0.95
    assert way.numpy()[smooth] == pytest.approx(np.array(slopes).T[smooth], abs=1e-6)


def test_distances_of_simple_forms_are_known():
    ball, brick = Sphere((0.0, 0.0, 0.0), 1.0).form(3), Block((0.0, 0.0), (2.0, 2.0)).form(2)
    pile = Cylinder((0.0, 0.0, 0.0), 1.0, axis=(0.0, 0.0, 1.0), length=2.0).form(3)
    assert ball.distance(np.array([(3.0, 0.0, 4.0), (0.0, 0.5, 0.0)])).tolist() == [4.0, -0.5]
    assert brick.distance(np.array([(4.0, 5.0), (0.0, 0.25)])).tolist() == [5.0, -0.75]
    assert pile.distance(np.array([(4.0, 0.0, 5.0), (0.0, 0.0, 3.0)])).tolist() == [5.0, 2.0]


# Nothing is passed, nothing is lost but what is given


def falls(dim=2, spacing=0.1, **more):
    """A block that falls on ground, sideways."""
    size = (0.5,) * dim
    given = {
        "shape": Box(size, spacing, origin=(0.0,) * (dim - 1) + (0.01,)),
        "material": SOFT,
        "body_force": BodyForce((1.0,) + (0.0,) * (dim - 2) + (-G,)),
        "tools": (Plane((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,), interface=Coulomb(0.3), name="ground"),),
        "duration": 0.15,
    }
    return Scene(**given | more)


def pressed_by(tool, dim=2, spacing=0.1, material=SOFT, **more):
    """A block on a smooth floor that a tool is pressed into, 0.15 m deep."""
    size = (1.0, 0.6)[-2:] if dim == 2 else (0.8, 0.8, 0.6)
    return Scene(
        shape=Box(size, spacing),
        material=material,
        conditions=[Roller(edge("bottom")), Roller(edge("left"))],
        tools=(tool,),
        duration=0.1,
        damping=20.0,
        **more,
    )


def down(dim, speed=-1.5):
    return (0.0,) * (dim - 1) + (speed,)


CASES = {
    "falls": lambda: falls(),
    "falls in space": lambda: falls(dim=3),
    "falls, triangles": lambda: falls(shape=Box((0.5, 0.5), 0.1, origin=(0.0, 0.01), cells="triangles")),
    "falls into a notch": lambda: falls(
        tools=(
            Plane((0.0, -0.2), (1.0, 1.0), interface=Coulomb(0.2), name="left"),
            Plane((0.5, -0.2), (-1.0, 1.2), name="right"),
        ),
        duration=0.4,
    ),
    "cylinder": lambda: pressed_by(Cylinder((0.45, 0.8), 0.2, velocity=down(2), interface=Coulomb(0.2))),
    "cylinder into soil": lambda: pressed_by(
        Cylinder((0.45, 0.8), 0.2, velocity=down(2), interface=Rough()), material=SOIL
    ),
    "block": lambda: pressed_by(Block((0.45, 0.85), (0.3, 0.4), angle=0.2, rounding=0.02, velocity=down(2))),
    "sphere": lambda: pressed_by(Sphere((0.4, 0.4, 0.8), 0.2, velocity=down(3)), dim=3),
    "pile": lambda: pressed_by(
        Cylinder((0.4, 0.4, 0.9), 0.2, axis=(0.1, 0.0, 1.0), length=0.55, velocity=down(3)), dim=3
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_no_node_is_behind_a_surface(name):
    scene = CASES[name]()
    simulation, dim, met = Simulation(scene, device="cpu", threads=1), scene.mesh.dim, 0.0
    for k in range(1, 31):
        simulation.run(until=k * scene.duration / 30)
        position = simulation.field("position")
        for t, tool in enumerate(scene.tools):
            form, tools = tool.form(dim), simulation.stepper.tools
            gaps = replace(form, centre=form.centre + tools.travel.numpy()[t]).distance(position)
            assert gaps.min() > -1e-5 * scene.mesh.spacing, (tool, simulation.time)
            met = max(met, float(np.abs(tools.impulse(t)).max()))
    assert met > 0.0


def test_a_node_that_lands_is_on_the_surface_at_once():
    simulation = Simulation(falls(), device="cpu", threads=1)
    while not simulation.stepper.tools.impulse(0).any():
        simulation.step()
    lowest = simulation.field("position")[:, 1].min()
    assert -simulation.field("displacement")[:, 1].min() + 1e-6 > 0.01 and abs(lowest) < 1e-12


def spike():
    """A narrow triangle of triangles, its tip down."""
    rows = [[(0.02 * (k - 0.5 * r), 0.05 * r) for k in range(r + 1)] for r in range(5)]
    first = [r * (r + 1) // 2 for r in range(5)]
    up = [(first[r] + k, first[r + 1] + k + 1, first[r + 1] + k) for r in range(4) for k in range(r + 1)]
    down = [(first[r] + k, first[r] + k + 1, first[r + 1] + k + 1) for r in range(4) for k in range(r)]
    return GivenMesh(points=[point for row in rows for point in row], cells=up + down)


@pytest.mark.parametrize("steep", [1.0, 2.0, 3.0])
def test_a_tip_stays_between_two_planes(steep):
    """It falls into a corner of 90 to 37 degrees: both planes push one node."""
    sides = (
        Plane((0.0, -0.05), (steep, 1.0), interface=Coulomb(0.2), name="left"),
        Plane((0.0, -0.05), (-steep, 1.2), name="right"),
    )
    scene = falls(shape=spike(), tools=sides, body_force=BodyForce((1.0, -30.0)), duration=0.3)
    simulation, deepest = Simulation(scene, device="cpu", threads=1), 0.0
    for k in range(1, 101):
        simulation.run(until=k * scene.duration / 100)
        gaps = [side.form(2).distance(simulation.field("position")).min() for side in sides]
        deepest = min(deepest, *gaps)
    assert deepest > -1e-4 * scene.mesh.spacing
    assert all(np.abs(simulation.stepper.tools.impulse(t)).max() > 0.0 for t in (0, 1))
    balance = simulation.energy()
    assert balance.tools < 0.0 and abs(balance.unaccounted) < 0.05 * balance.largest


@pytest.mark.parametrize("name", CASES)
def test_what_tools_get_the_body_lacks(name):
    """Momentum: what came in by gravity and conditions, less what tools got, to 1e-12 of what was exchanged."""
    scene = replace(CASES[name](), damping=0.0, conditions=())
    simulation = run(scene)
    tools = range(len(scene.tools))
    given = sum(np.abs(simulation.stepper.tools.impulse(t)) for t in tools).max()
    fallen = (
        simulation.field("mass").sum()
        * simulation.time
        * (np.zeros(scene.mesh.dim) if scene.body_force is None else scene.body_force(0.0))
    )
    lacks = fallen - momentum(simulation) - sum(simulation.stepper.tools.impulse(t) for t in tools)
    assert given > 0.0 and np.abs(lacks).max() < 1e-12 * (given + np.abs(fallen).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_torque_and_force_balance_momentum_and_its_moment_step_by_step(dim):
    """A spinning body meets a cylinder: force and torque of a step are what it loses in that step."""
    tool = Cylinder((0.25, -0.12), 0.1, interface=Coulomb(0.4))
    if dim == 3:
        tool = replace(tool, centre=(0.25, -0.12, 0.25), axis=(0.0, 0.2, 1.0), radius=0.05)
    spin = {"velocity": lambda x, y, *z: (-2.0 * y, 2.0 * x - 1.0, *(0.0 * c for c in z))}
    scene = Scene(shape=Box((0.5,) * dim, 0.1), material=SOFT, tools=(tool,), duration=0.1, **spin)
    simulation, exchanged = Simulation(scene, device="cpu", threads=1), np.zeros(2)

    def moments():
        mass, x, v = (simulation.field(name) for name in ("mass", "position", "velocity"))
        arm = x - np.array(tool.centre)
        turning = np.cross(np.pad(arm, ((0, 0), (0, 3 - dim))), np.pad(v, ((0, 0), (0, 3 - dim))))
        return mass @ v, mass @ turning

    before = moments()
    for _ in range(60):
        simulation.step()
        after = moments()
        dt = float(simulation.stepper.clock.time_step.numpy()[0])
        force, torque = (getattr(simulation.stepper.tools, name)(0) for name in ("force", "torque"))
        lost = [(a - b) / dt for a, b in zip(before, after, strict=True)]
        sizes = [np.abs(part).max() / dt for part in before]
        assert np.abs(lost[0] - force).max() < 1e-11 * sizes[0]
        assert np.abs(lost[1] - torque).max() < 1e-11 * sizes[1]
        exchanged = np.maximum(exchanged, [np.abs(force).max(), np.abs(torque).max()])
        before = after
    assert (exchanged > 0.0).all()


@pytest.mark.parametrize("name", ["falls", "falls in space", "falls into a notch"])
def test_what_stands_still_never_gives_energy(name):
    scene = CASES[name]()
    simulation, largest = Simulation(scene, device="cpu", threads=1), 0.0
    for k in range(1, 16):
        simulation.run(until=k * scene.duration / 15)
        balance = simulation.energy()
        largest = max(largest, balance.largest)
        assert balance.tools <= 1e-9 * largest
        assert abs(balance.unaccounted) < 0.06 * largest


def test_the_books_close_to_second_order():
    """What landing, sticking and sliding take is booked: what is left over falls with Δt²."""
    left = []
    for courant in (0.8, 0.4, 0.2):
        scene = falls()
        balance = run(replace(scene, numerics=replace(scene.numerics, courant=courant))).energy()
        left.append(abs(balance.unaccounted) / balance.largest)
        assert balance.tools < -0.05 * balance.largest
    assert left[2] < 0.005 and left[0] / left[1] > 2.5 and left[1] / left[2] > 2.5


def test_landing_takes_the_energy_of_one_layer_of_nodes():
    """A bar that hits a wall: the end node's ½ m v² is lost, half a cell's part of the whole; then it may ring."""
    taken = []
    for n in (20, 40, 80):
        scene = Scene(
            shape=Box((1.0,), 1.0 / n, origin=(0.5 / n,)),
            material=SOFT,
            tools=(Plane((0.0,), (1.0,)),),
            velocity=lambda x: -1.0 + 0.0 * x,
            duration=0.03,
        )
        balance = run(scene).energy()
        taken.append(-balance.tools / balance.initial)
    assert np.array(taken) == pytest.approx([0.5 / 20, 0.5 / 40, 0.5 / 80], rel=0.25)


# Against conditions


def compared(scene, other, names=("displacement", "stress")):
    first, second = run(scene), run(other)
    for name in names:
        a, b = first.field(name), second.field(name)
        assert np.abs(a).max() > 0.0 and a == pytest.approx(b, abs=1e-11 * np.abs(b).max()), name


def test_a_plane_that_presses_is_a_prescribed_velocity():
    common = {"shape": Box((1.0, 0.6), 0.1), "material": SOIL, "duration": 0.1, "damping": 5.0}
    bottom = Roller(edge("bottom"))
    moved = PrescribedVelocity(edge("top"), (None, Linear(-8.0)))
    plate = Plane((0.0, 0.6), (0.0, -1.0), velocity=(0.0, Linear(-8.0)))
    names = ("displacement", "stress", "velocity")
    compared(
        Scene(conditions=[bottom], tools=(plate,), **common), Scene(conditions=[bottom, moved], **common), names
    )


@pytest.mark.parametrize("interface", [Glued(), Rough()])
def test_a_body_that_is_glued_or_rough_below_its_strength_is_held(interface):
    common = {"shape": Box((1.0, 0.6), 0.1), "material": SOFT, "body_force": BodyForce((2.0, -G)), "damping": 5.0}
    common["duration"] = 0.2 if interface == Rough() else 0.6
    if interface == Glued():  # hangs
        common["body_force"] = BodyForce((2.0, G))
    ground = replace(GROUND, interface=interface)
    if interface == Rough():  # at rest the outer nodes are pulled up, and come off: they are pressed
        common["stress"] = lambda x, y: (0.0, -2e4, 0.0, 0.0)
        common["conditions"] = [PrescribedVelocity(edge("top"), (0.0, 0.0))]
    held = (*common.pop("conditions", ()), Fixed(edge("bottom")))
    compared(
        Scene(conditions=held[:-1], tools=(ground,), **common),
        Scene(conditions=held, **common),
        ("displacement", "stress", "velocity"),
    )


def test_what_is_pulled_comes_off_unless_it_is_glued():
    for interface, hangs in ((Smooth(), False), (Adhesive(1e6), False), (Rough(), False), (Glued(), True)):
        ceiling = Plane((0.0, 0.5), (0.0, -1.0), interface=interface)
        simulation = run(falls(shape=Box((0.5, 0.5), 0.1), tools=(ceiling,)))
        top = simulation.field("displacement")[simulation.mesh.nodes[:, 1] > 0.49]
        fallen = np.array((0.5, -0.5 * G)) * simulation.time**2 if not hangs else np.zeros(2)
        assert top == pytest.approx(np.broadcast_to(fallen, top.shape), abs=1e-12)


def test_ground_carries_the_weight():
    simulation = run(falls(damping=100.0, duration=2.0, body_force=BodyForce((0.0, -G))))
    weight = simulation.field("mass").sum() * G
    force, torque = (getattr(simulation.stepper.tools, name)(0) for name in ("force", "torque"))
    assert force == pytest.approx((0.0, -weight), abs=1e-9 * weight)
    assert torque == pytest.approx((0.0, 0.0, 0.0), abs=1e-9 * weight)  # about the point below the middle
    assert np.abs(simulation.field("velocity")).max() < 1e-12


# Friction

ANGLE = math.radians(30.0)


def leaning(slope, *, angle=ANGLE, interface, material, cells="lattice", **more):
    """A block on an incline, its sides along the force (slope, −1) that ground takes up: in uniaxial stress."""
    height, pressure = 0.1, material.density * G * math.cos(angle)

    def stress(x, y):
        s = -pressure * (height - y)
        return s * slope**2, s, -s * slope, material.poisson_ratio * s * (1.0 + slope**2)

    return Scene(
        shape=Box((0.4, height), 0.05, cells=cells).mapped(lambda x, y: (x + slope * (height - y), y)),
        material=material,
        stress=stress,
        body_force=BodyForce((G * math.sin(angle), -G * math.cos(angle))),
        tools=(Plane((0.0, 0.0), (0.0, 1.0), interface=interface),),
        **{"duration": 0.5} | more,
    )


def moved(scene):
    simulation = run(scene)
    mass = simulation.field("mass")
    return float(mass @ simulation.field("displacement")[:, 0] / mass.sum())


STIFF = Elastic(young_modulus=1e7, poisson_ratio=0.3, density=2000.0)


@pytest.mark.parametrize("cells", ["lattice", "triangles"])
@pytest.mark.parametrize("share", [0.5, 0.9, 0.99, 1.01, 1.1, 2.0])
def test_a_block_slides_from_rest_or_sticks(share, cells):
    """x = ½ g t² (sin θ − μ cos θ), and μ = `share` tan θ; for more it stays where it is."""
    tan = math.tan(math.radians(30.0))
    interface = Coulomb(share * tan, lag=5e-3)
    scene = leaning(min(share, 1.0) * tan, interface=interface, material=STIFF, cells=cells)
    exact = 0.5 * G * math.sin(math.radians(30.0)) * max(0.0, 1.0 - share) * scene.duration**2
    assert moved(scene) == pytest.approx(exact, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("interface", [Adhesive(300.0), Adhesive(200.0, friction=0.1), Rough()])
def test_strength_counts_by_area(interface):
    """c per area of ground: x = ½ t² (g sin θ − μ g cos θ − c/(ρ h)) of a block of height h."""
    angle, pressure = math.radians(30.0), STIFF.density * G * math.cos(math.radians(30.0)) * 0.1
    soil = PerzynaVonMises(
        young_modulus=1e7, poisson_ratio=0.3, density=2000.0, fluidity=0.0, yield_size=300.0 * math.sqrt(3.0)
    )
    strength = 200.0 + 0.1 * pressure if interface == Adhesive(200.0, friction=0.1) else 300.0
    scene = leaning(strength / pressure, interface=interface, material=soil, duration=0.2)
    exact = 0.5 * scene.duration**2 * (G * math.sin(angle) - strength / (STIFF.density * 0.1))
    assert moved(scene) == pytest.approx(exact, rel=1e-4)


def test_without_lag_sliding_is_unstable_and_with_one_it_is_not():
    """Waves of an undamped elastic body that slides feed on Coulomb friction: within a second they make it stick
    and lift in turn. That is in the law itself. With a lag they find nothing."""
    tan = math.tan(math.radians(30.0))
    shaken = {}
    for lag in (0.0, 5e-3):
        simulation = run(leaning(0.99 * tan, interface=Coulomb(0.99 * tan, lag), material=STIFF, duration=1.5))
        velocity = simulation.field("velocity")
        shaken[lag] = np.abs(velocity - simulation.field("mass") @ velocity / simulation.field("mass").sum()).max()
    assert shaken[0.0] > 1e-2 and shaken[5e-3] < 1e-12


def test_friction_that_lags_is_that_of_the_pressure_before():
    """An upright block, weight rising within 0.2 s: it slides by (g sin θ f − μ g cos θ f̄), f̄' = (f − f̄)/lag."""
    angle, share, lag = math.radians(30.0), 0.9, 5e-3

    def rise(t):
        s = min(t / 0.2, 1.0)
        return s * s * s * (10.0 + s * (6.0 * s - 15.0))

    scene = leaning(0.0, interface=Coulomb(share * math.tan(angle), lag), material=STIFF, duration=0.5)
    weight = replace(scene.body_force, factor=rise)
    scene = replace(scene, stress=None, shape=Box((0.4, 0.1), 0.05), body_force=weight)
    time = np.linspace(0.0, scene.duration, 20001)
    dt, behind, v, x = time[1], 0.0, 0.0, 0.0
    for t in time[1:]:
        behind += (1.0 - math.exp(-dt / lag)) * (rise(t - 0.5 * dt) - behind)
        v += dt * G * math.sin(angle) * (rise(t) - share * behind)
        x += dt * v
    assert moved(scene) == pytest.approx(x, rel=1e-4)


def test_a_belt_carries_a_block_until_both_are_of_one_speed():
    """Ground that moves on its own path: v = μ g t up to its speed, and the book of its work is what it gave."""
    ground = replace(GROUND, interface=Coulomb(0.2), velocity=(0.3, 0.0))
    scene = Scene(
        shape=Box((0.4, 0.1), 0.05),
        material=replace(STIFF, poisson_ratio=0.0),
        body_force=BodyForce((0.0, -G)),
        stress=lambda x, y: (0.0, -STIFF.density * G * (0.1 - y), 0.0, 0.0),
        tools=(ground,),
        damping=0.0,
        duration=0.4,
    )
    simulation = run(scene)
    mass = simulation.field("mass")
    assert momentum(simulation)[0] / mass.sum() == pytest.approx(0.3, rel=1e-2)
    assert simulation.energy().tools == pytest.approx(0.5 * mass.sum() * 0.3**2, rel=5e-2)


# What a run keeps


def documented():
    tools = (
        Plane((0.0, 0.0), (0.0, 1.0), interface=Coulomb(0.3, lag=0.01), name="ground"),
        Cylinder((0.25, 0.85), 0.25, interface=Rough(), velocity=(0.0, Linear(-20.0))),
        Block((2.0, 0.5), (0.4, 0.4), angle=0.3, rounding=0.1, interface=Adhesive(5.0, 0.1)),
        Plane((-1.0, 0.0), (1.0, 0.0), interface=Glued(), velocity=(lambda t: 0.1 * t, 0.0), name="wall"),
    )
    probes = (
        Probe("load", "N/m", ToolForce("cylinder", axis=1)),
        Probe("torque", "N", ToolTorque("cylinder")),
        Probe("given", "N s/m", ToolImpulse("ground", axis=1)),
    )
    return falls(tools=tools, output=Output(probes=probes, interval=0.01))


def test_a_document_says_all_of_it():
    scene = documented()
    document, arrays = encode(scene)
    assert document["tools"][1]["velocity"] == [0.0, {"type": "Linear", "rate": -20.0}]
    assert document["tools"][3]["velocity"][0] == {"code": "tools.3.velocity.0"}
    again = decode(document, arrays, lambda place: scene)
    assert again.tools == scene.tools and fingerprint(again) == fingerprint(scene)


@pytest.mark.parametrize(
    "other",
    [
        {"interface": Coulomb(0.31, lag=0.01)},
        {"interface": Coulomb(0.3)},
        {"interface": Smooth()},
        {"velocity": (0.0, 0.0)},
        {"normal": (0.1, 1.0)},
        {"point": (0.0, -0.1)},
    ],
)
def test_a_checkpoint_fits_no_other_tools(other):
    scene = documented()
    changed = replace(scene, tools=(replace(scene.tools[0], **other), *scene.tools[1:]))
    assert fingerprint(changed) != fingerprint(scene)


def test_probes_of_tools_are_columns_of_the_history():
    simulation = Simulation(documented(), device="cpu", threads=1)
    history = History(simulation)
    simulation.run(observers=[history])
    tools = simulation.stepper.tools
    assert history["load"][-1] == tools.force(1)[1] != 0.0
    assert history["torque"][-1] == tools.torque(1)[2] != 0.0
    assert history["given"][-1] == tools.impulse(0)[1] < 0.0
    assert history["energy.tools"][-1] == simulation.energy().tools


@pytest.mark.parametrize("steps", [2_000, pytest.param(1_000_000, marks=pytest.mark.long)])
def test_a_heap_at_rest_does_not_creep(steps):
    """Of soil, on ground that leans a little: held by friction, node by node."""
    scene = Scene(
        shape=Box((0.8, 0.2), 0.1, origin=(-0.4, 0.0)).mapped(lambda x, y: (x * (1.0 - 1.5 * y), y)),
        material=SOIL,
        body_force=BodyForce((0.5, -G), Ramp(0.5)),
        damping=20.0,
        tools=(replace(GROUND, interface=Coulomb(0.4)),),
        duration=1e5,
    )
    simulation = Simulation(scene, device="cpu", threads=1)
    simulation.run(until=6.0)
    before, weight = simulation.field("position"), simulation.field("mass").sum() * np.array([0.5, -G])
    simulation.run(until=simulation.time + steps * simulation.time_step_limit)
    assert simulation.field("position") == pytest.approx(before, abs=1e-14)
    assert np.abs(simulation.field("velocity")).max() < 1e-14
    assert simulation.stepper.tools.force(0) == pytest.approx(weight, rel=1e-10)


# Bits

FIELDS = ("displacement", "velocity", "stress")


def test_a_tool_that_is_never_met_changes_no_bit():
    scene = falls(tools=())
    away = (Plane((0.0, -50.0), (0.0, 1.0)), Cylinder((9.0, 9.0), 1.0, velocity=(0.1, 0.0)))
    far = run(replace(scene, tools=away))
    alone = run(scene)
    for name in FIELDS:
        assert (far.field(name) == alone.field(name)).all()


@pytest.mark.parametrize("name", ["falls into a notch", "cylinder into soil", "sphere"])
def test_threads_give_the_same_bits(name):
    one, two = (run(CASES[name](), threads=threads) for threads in (1, 2))
    for field in FIELDS:
        assert (one.field(field) == two.field(field)).all()
    assert one.stepper.tools.impulse(0).tolist() == two.stepper.tools.impulse(0).tolist()
    assert one.energy() == two.energy()


@pytest.mark.parametrize("name", ["falls into a notch", "cylinder into soil", "pile"])
def test_a_run_goes_on_from_a_state_bit_for_bit(name):
    scene = CASES[name]()
    whole = run(scene)
    first = Simulation(scene, device="cpu", threads=1)
    first.run(until=0.6 * scene.duration)
    twin = Simulation(scene, device="cpu", threads=1)
    twin.run(until=0.6 * scene.duration)
    second = Simulation(scene, device="cpu", threads=1)
    second.restore(*first.state())
    for simulation in (second, twin):
        simulation.run()
    for field in FIELDS:
        assert (second.field(field) == twin.field(field)).all()
    assert second.energy() == twin.energy()
    assert second.stepper.tools.impulse(0).tolist() == twin.stepper.tools.impulse(0).tolist()
    assert whole.time == second.time


def test_a_mirrored_scene_is_the_mirror_image():
    common = {"material": SOFT, "body_force": BodyForce((0.0, -G)), "duration": 0.3}
    left = Plane((0.0, -0.3), (1.0, 1.0), interface=Coulomb(0.3), name="left")
    right = Cylinder((0.4, -0.3), 0.2, interface=Coulomb(0.1), name="right")
    mirrored = (replace(left, normal=(-1.0, 1.0)), replace(right, centre=(-0.4, -0.3)))
    scenes = (
        Scene(shape=Box((0.5, 0.5), 0.1, origin=(-0.2, 0.05)), tools=(left, right), **common),
        Scene(shape=Box((0.5, 0.5), 0.1, origin=(-0.3, 0.05)), tools=mirrored, **common),
    )
    one, two = (run(scene).field("position").reshape(6, 6, 2) for scene in scenes)
    assert one == pytest.approx(two[::-1] * (-1.0, 1.0), abs=1e-10)


def test_both_precisions_agree():
    exact, rounded = (run(CASES["cylinder into soil"](), precision=name) for name in ("float64", "float32"))
    size = np.abs(exact.field("displacement")).max()
    assert rounded.field("displacement") == pytest.approx(exact.field("displacement"), abs=1e-3 * size)


# Wrong input

WRONG = {
    "inside": (lambda: falls(tools=(Sphere((0.0, 0.0, 0.0), 0.2),)), "in the plane take Cylinder"),
    "body inside": (lambda: falls(tools=(Cylinder((0.2, -0.2), 0.25),)), "0.04 m inside it"),
    "swallowed": (lambda: falls(tools=(Cylinder((0.25, 0.26), 0.01),)), "it is inside the body"),
    "friction": (lambda: Coulomb(-0.1), "Coulomb.friction = -0.1 is not allowed: it must be"),
    "strength": (lambda: Adhesive(-1.0), "Adhesive.strength = -1.0"),
    "lag": (lambda: Coulomb(0.1, lag=-1.0), "Coulomb.lag = -1.0"),
    "radius": (lambda: Cylinder((0.0, 0.0), 0.0), "Cylinder.radius = 0.0"),
    "far": (lambda: Block((1e308, 0.0), (1.0, 1.0)), "Block.centre = 1e+308 is not allowed: it must be"),
    "large": (lambda: Cylinder((0.0, 0.0), 1e200), "Cylinder.radius = 1e+200"),
    "normal": (lambda: Plane((0.0, 0.0), (0.0, 0.0)), "must not be the zero vector"),
    "dimension": (lambda: falls(tools=(Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),)), "Plane.point"),
    "axis": (lambda: falls(dim=3, tools=(Cylinder((0.0, 0.0, -2.0), 0.1),)), "Cylinder.axis = None"),
    "length": (lambda: falls(tools=(Cylinder((0.0, -2.0), 0.1, length=1.0),)), "Cylinder.length = 1.0"),
    "velocity": (lambda: falls(tools=(replace(GROUND, velocity=(1.0,)),)), "Plane.velocity"),
    "function": (lambda: Plane((0.0, 0.0), (0.0, 1.0), velocity=("fast", 0.0)), "Plane.velocity = 'fast'"),
    "no tool": (lambda: falls(tools=(Roller(edge("left")),)), "tools = Roller"),
    "twins": (lambda: falls(tools=(GROUND, GROUND)), "tools[1].name = 'ground'"),
    "interface": (lambda: Plane((0.0, 0.0), (0.0, 1.0), interface=0.5), "Plane.interface = 0.5"),
    "rounding": (lambda: Block((0.0, 0.0), (1.0, 0.2), rounding=0.2), "Block.rounding = 0.2"),
    "probe": (
        lambda: falls(output=Output(probes=(Probe("f", "N", ToolForce("grond", 0)),))),
        "ToolForce.tool = 'grond' is not allowed: it must be one of ground (did you mean ground?)",
    ),
    "probe's axis": (
        lambda: falls(output=Output(probes=(Probe("f", "N", ToolForce("ground", 2)),))),
        "ToolForce.axis = 2",
    ),
    "torque's axis": (
        lambda: falls(output=Output(probes=(Probe("f", "N", ToolTorque("ground", 0)),))),
        "ToolTorque.axis = 0",
    ),
    "small": (lambda: falls(large_displacements=False), "take large_displacements=True"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_in_one_line(name):
    build, said = WRONG[name]
    with pytest.raises(SceneError) as error:
        build()
    assert said in str(error.value) and "\n" not in str(error.value)


def test_published_schemes_have_no_tools():
    scene = falls()
    with pytest.raises(SceneError, match="velocity_scheme taylor has no forces on nodes; take cells"):
        replace(scene, numerics=replace(scene.numerics, velocity_scheme="taylor"))
