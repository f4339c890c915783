"""Tractions and pressures as forces on nodes (scheme `cells`), against exact states, balances and motions."""

from dataclasses import replace

import numpy as np
import pytest

from tests.test_conjugate_cells import BODIES, NUMERICS, SOFT
from warpsph import (
    BodyForce,
    Box,
    Elastic,
    Fixed,
    Free,
    Linear,
    Numerics,
    Output,
    PrescribedVelocity,
    Pressure,
    Probe,
    Ramp,
    Reaction,
    Roller,
    Scene,
    SceneError,
    Simulation,
    Traction,
    edge,
    where,
)
from warpsph.errors import FunctionError
from warpsph.scene.document import decode, encode
from warpsph.scene.fingerprint import fingerprint

STRESS = {1: (3e3,), 2: (3e3, -1e3, 2e3, 600.0), 3: (3e3, -1e3, 2e3, 500.0, 700.0, -300.0)}  # [Pa], σ33 = ν tr
SOIL = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=2000.0)


def body(kind, cells, jitter, all_nodes=False):
    """A unit box, its inner nodes, or all of them, anywhere within `jitter` of a spacing along each axis."""
    dim, name = BODIES[kind]
    rng = np.random.default_rng(3)

    def moved(*x):
        inner = np.all([(part > 1e-6) & (part < 1.0 - 1e-6) for part in x], axis=0) | all_nodes
        return tuple(part + inner * jitter / cells * rng.uniform(-1.0, 1.0, np.shape(part)) for part in x)

    return Box((1.0,) * dim, 1.0 / cells, cells=name).mapped(moved)


def tractions_of(stress, mesh):
    """On each side of a box the traction of a uniform stress, stored components."""
    full = np.zeros((3, 3))
    for k, (i, j) in enumerate(mesh.continuum.pairs):
        full[i, j] = full[j, i] = stress[k]
    normals, names = mesh.face_normals(), mesh.continuum.edges
    sides = [normals[mesh.face_side == side][0] for side in range(len(names))]
    return [
        Traction(edge(name), tuple(full[: mesh.dim, : mesh.dim] @ normal))
        for name, normal in zip(names, sides, strict=True)
    ]


def at_rest(**scene):
    """A simulation of a scene that was damped to rest."""
    simulation = Simulation(Scene(**{"material": SOIL, "numerics": NUMERICS} | scene), device="cpu")
    simulation.run()
    return simulation


@pytest.mark.parametrize("kind", BODIES)
def test_a_free_block_under_tractions_comes_to_a_uniform_stress(kind):
    """Tension, compression and shear at once, on sides that meet at edges and corners; from nothing."""
    dim, shape = BODIES[kind][0], body(kind, 3, 0.25)
    simulation = at_rest(
        shape=shape,
        conditions=tractions_of(STRESS[dim], shape.mesh()),
        damping=60.0,
        duration=24.0,
        large_displacements=False,
    )
    assert np.abs(simulation.field("stress") - STRESS[dim]).max() <= 3e3 * 1e-10
    assert np.abs(simulation.field("velocity")).max() <= 1e-10


@pytest.mark.parametrize("kind", BODIES)
def test_a_pressure_all_around_is_in_equilibrium(kind):
    """On any surface, of warped faces as well; the body is at rest in the configuration it has."""
    dim = BODIES[kind][0]
    pressed = {1: (-1e3,), 2: (-1e3, -1e3, 0.0, -1e3), 3: (-1e3, -1e3, -1e3, 0.0, 0.0, 0.0)}[dim]
    scene = Scene(
        shape=body(kind, 3, 0.3, all_nodes=True),
        material=SOIL,
        stress=lambda *x: pressed,
        conditions=[Pressure(edge("boundary"), 1e3)],
        duration=0.1,
        numerics=NUMERICS,
    )
    simulation = Simulation(scene, device="cpu")
    simulation.run()
    assert np.abs(simulation.field("stress") - pressed).max() <= 1e-9
    assert np.abs(simulation.field("velocity")).max() <= 1e-13


def force_and_moment(simulation):
    """Of all forces on nodes, about the origin; those of cells have none."""
    force = simulation.nodes.mass.numpy()[:, None] * simulation.nodes.acceleration.numpy()
    moment = np.einsum("ni,nj->ij", simulation.field("position"), force)
    return force.sum(axis=0), moment - moment.T, np.abs(force).sum()


@pytest.mark.parametrize("follows", [True, False])
@pytest.mark.parametrize("kind", BODIES)
def test_a_pressure_all_around_has_no_force_and_a_following_one_no_moment(kind, follows):
    """In a configuration that random velocities have made."""
    dim, rng = BODIES[kind][0], np.random.default_rng(5)
    scene = Scene(
        shape=body(kind, 3, 0.3, all_nodes=True),
        material=SOIL,
        conditions=[Pressure(edge("boundary"), 1e4, Linear(1.0), follows=follows)],
        velocity=lambda *x: tuple(3.0 * rng.normal(size=(dim, len(x[0])))),
        duration=1.0,
        numerics=NUMERICS,
    )
    simulation = Simulation(scene, device="cpu")
    for _ in range(10):
        simulation.step()
    force, moment, scale = force_and_moment(simulation)
    assert np.abs(simulation.field("displacement")).max() > 0.02
    assert np.abs(force).max() <= 1e-12 * scale
    if follows:
        assert np.abs(moment).max() <= 1e-12 * scale
    elif dim > 1:
        assert np.abs(moment).max() > 1e-6 * scale, "that of the faces as they were"


@pytest.mark.parametrize("kind", BODIES)
def test_a_linear_pressure_has_the_force_and_the_moment_of_water(kind):
    """Archimedes: upwards the weight of what is displaced, through its middle; sides of any cells."""
    dim, axis = BODIES[kind][0], BODIES[kind][0] - 1
    scene = Scene(
        shape=body(kind, 3, 0.3),
        material=SOIL,
        conditions=[Pressure(edge("boundary"), lambda *x: 9.81e3 * (1.0 - x[-1]))],
        duration=1.0,
        numerics=NUMERICS,
    )
    force, moment, scale = force_and_moment(Simulation(scene, device="cpu"))
    expected = 9.81e3 * np.eye(dim)[axis]
    arm = np.full(dim, 0.5)
    assert np.abs(force - expected).max() <= 1e-12 * scale
    assert np.abs(moment - np.outer(arm, expected) + np.outer(expected, arm)).max() <= 1e-12 * scale


@pytest.mark.parametrize("kind", ["quads", "triangles"])
def test_a_body_that_spins_under_a_following_pressure_keeps_its_angular_momentum(kind):
    omega = 0.1 * SOFT.shear_wave_speed() / 0.5
    scene = Scene(
        shape=body(kind, 4, 0.2, all_nodes=True),
        material=SOFT,
        conditions=[Pressure(edge("boundary"), 2e4)],
        stress=lambda x, y: (-2e4, -2e4, 0.0, -2e4),
        velocity=lambda x, y: (-omega * (y - 0.5), omega * (x - 0.5)),
        duration=2.0 * np.pi / omega,
        numerics=NUMERICS,
    )
    simulation = Simulation(scene, device="cpu")

    def angular():
        half = simulation.nodes.half.numpy()
        (x, y), (u, v) = half["x"].T, half["v"].T
        return (simulation.nodes.mass.numpy() * (x * v - y * u)).sum()

    simulation.step()
    first = angular()
    simulation.run()
    assert angular() == pytest.approx(first, rel=1e-10)
    assert simulation.field("mean_stress").mean() == pytest.approx(-2e4, rel=0.1)


@pytest.mark.parametrize("kind", BODIES)
def test_a_confined_column_settles_as_it_should_and_its_base_carries_all(kind):
    """u = −q H/M at the top, M = λ + 2G or E of a bar; the base's reaction is q and the weight, to rounding."""
    dim = BODIES[kind][0]
    axis, sides = dim - 1, ("left", "right", "front", "back")[: 2 * (dim - 1)]
    base, top = ("left", "right") if dim == 1 else ("bottom", "top")
    modulus = SOIL.young_modulus if dim == 1 else SOIL.lame_modulus + 2.0 * SOIL.shear_modulus
    load = np.eye(dim)[axis] * -1e3

    def run(**more):
        return at_rest(
            shape=body(kind, 4, 0.0 if more else 0.25),
            conditions=[
                Roller(edge(base)),
                *(Roller(edge(side)) for side in sides),
                Traction(edge(top), tuple(load), Ramp(0.05)),
            ],
            damping=60.0,
            duration=15.0,
            large_displacements=False,
            **more,
        )

    simulation = run()
    highest = edge(top).nodes(simulation.mesh)
    assert simulation.field("displacement")[highest, axis] == pytest.approx(-1e3 / modulus, rel=1e-10)
    assert Reaction(edge(base), axis)(simulation) == pytest.approx(-1e3, rel=1e-10)
    heavy = run(body_force=BodyForce(tuple(-9.81 * np.eye(dim)[axis])))
    assert Reaction(edge(base), axis)(heavy) == pytest.approx(-1e3 - 9.81 * 2000.0, rel=1e-10)


def pull(t):
    """Rises smoothly from 0 to 1 in 30 ms."""
    return np.sin(0.5 * np.pi * min(max(t, 0.0) / 0.03, 1.0)) ** 4


@pytest.mark.parametrize("kind", ["segments", "quads", "triangles"])
def test_wave_of_an_end_that_is_pulled(kind):
    """d'Alembert: σ11 = t and v1 = t/(ρ c), (L − x)/c later; of second order. Its energy is the load's work."""
    dim, cells = BODIES[kind]
    speed = SOIL.wave_speed(dim)

    def error(n):
        scene = Scene(
            shape=Box((1.0, 0.2)[:dim], 1.0 / n, cells=cells),
            material=SOIL,
            conditions=[
                Roller(edge("left")),
                Traction(edge("right"), (1.0,) + (0.0,) * (dim - 1), pull),
                *(Roller(edge(name)) for name in ("bottom", "top")[: 2 * (dim - 1)]),
            ],
            duration=0.9 / speed,
            large_displacements=False,
            numerics=NUMERICS,
        )
        simulation = Simulation(scene, device="cpu")
        simulation.run()
        wave = np.array([pull(simulation.time - (1.0 - x) / speed) for x in scene.mesh.nodes[:, 0]])
        velocity = SOIL.density * speed * simulation.field("velocity")[:, 0]
        mass = simulation.nodes.mass.numpy()
        carried = (mass * (wave / (SOIL.density * speed)) ** 2).sum()
        assert simulation.stepper.loads.work.numpy().sum() == pytest.approx(carried, rel=0.01)
        return np.sqrt(np.mean(np.square([simulation.field("stress")[:, 0] - wave, velocity - wave]), axis=1))

    coarse, fine = error(20), error(40)
    assert (np.log2(coarse / fine) >= 1.7).all()
    assert (fine <= 0.01).all()


def ring(kind, n):
    """A quarter of a ring, radii 1 and 2 m, n cells thick; its inner side is `left`, the outer `right`."""
    box = Box((1.0, 1.5), 1.0 / n, cells=BODIES[kind][1])
    return box.mapped(lambda x, y: ((1.0 + x) * np.cos(np.pi / 3.0 * y), (1.0 + x) * np.sin(np.pi / 3.0 * y)))


@pytest.mark.parametrize("kind", ["quads", "triangles"])
def test_pressure_in_a_ring(kind):
    """Lamé: u_r = (1 + ν)/E · p a²/(b² − a²) ((1 − 2ν) r + b²/r) in plane strain, of second order."""
    errors = []
    for n in (8, 16):
        simulation = at_rest(
            shape=ring(kind, n),
            conditions=[
                Roller(edge("bottom")),
                Roller(edge("top")),
                Pressure(edge("left"), 1e3, Ramp(0.1)),
            ],
            damping=20.0,
            duration=10.0,
            large_displacements=False,
        )
        x, u, s = simulation.mesh.nodes, simulation.field("displacement"), simulation.field("stress")
        r = np.linalg.norm(x, axis=1)
        exact = 1.3 / 1e6 * 1e3 / 3.0 * (0.4 * r + 4.0 / r)
        radial = np.sum(x * u, axis=1) / r
        hoop = (s[:, 0] * x[:, 1] ** 2 + s[:, 1] * x[:, 0] ** 2 - 2.0 * s[:, 2] * x[:, 0] * x[:, 1]) / r**2
        stress = 1e3 / 3.0 * (1.0 + 4.0 / r**2)
        inner = (r > 1.2) & (r < 1.8)
        errors.append(
            [
                np.sqrt(np.mean((radial - exact) ** 2)) / exact.max(),
                np.sqrt(np.mean((hoop - stress)[inner] ** 2)) / stress.max(),
            ]
        )
        assert Reaction(edge("bottom"), 1)(simulation) == pytest.approx(1e3, rel=0.02)
        assert np.abs(simulation.field("velocity")).max() <= 1e-8
    order = np.log2(np.divide(*errors))
    assert (order >= 1.7).all() and (order <= 2.3).all()
    assert max(errors[1]) <= 0.0035


def strip(x, y):
    """Stresses under a strip |x| ≤ 1 of unit pressure on the half plane y ≤ 0: (σ11, σ22, σ12)."""
    depth = np.maximum(-y, 1e-300)
    one, two = np.arctan2(x - 1.0, depth), np.arctan2(x + 1.0, depth)
    alpha, beta = two - one, one + two
    return (
        -(alpha - np.sin(alpha) * np.cos(beta)) / np.pi,
        -(alpha + np.sin(alpha) * np.cos(beta)) / np.pi,
        np.sin(alpha) * np.sin(beta) / np.pi,
    )


@pytest.mark.parametrize("kind", ["quads", "triangles"])
def test_strip_load_on_a_block(kind):
    """The right half of a block cut out of Flamant's half plane, loaded on all sides by what it had there.

    Without sharpening, which makes quads slow to settle.
    """
    errors = []
    for n in (8, 16):
        simulation = at_rest(
            shape=Box((3.0, 2.0), 1.0 / n, origin=(0.0, -2.0), cells=BODIES[kind][1]),
            conditions=[
                Roller(edge("left")),
                PrescribedVelocity(edge("left") & edge("bottom"), (0.0, 0.0)),
                Traction(edge("right"), lambda x, y: (1e3 * strip(x, y)[0], 1e3 * strip(x, y)[2])),
                Traction(edge("bottom"), lambda x, y: (-1e3 * strip(x, y)[2], -1e3 * strip(x, y)[1])),
                Pressure(edge("top") & where(lambda x, y: x <= 1.0), 1e3),
            ],
            damping=12.0,
            duration=5.0,
            large_displacements=False,
            numerics=replace(NUMERICS, sharpening=0.0),
        )
        x, y = simulation.mesh.nodes.T
        below = (y < -0.4) & (y > -1.6) & (x > 0.2) & (x < 2.6)
        found = simulation.field("stress")[below][:, :3]
        exact = 1e3 * np.stack(strip(x[below], y[below]), axis=1)
        errors.append(np.sqrt(np.mean((found - exact) ** 2)) / 1e3)
        assert Reaction(edge("left") & edge("bottom"), 1)(simulation) == pytest.approx(0.0, abs=2.0)
    assert 1.7 <= np.log2(errors[0] / errors[1]) <= 2.3
    assert errors[1] <= 0.0012


@pytest.mark.parametrize("kind", ["quads", "triangles"])
def test_loads_on_one_face_add_and_their_work_is_in_the_energy(kind):
    """A block that is pulled and released, undamped: kinetic + elastic + lost = work of loads and conditions."""
    top = edge("top")

    def run(*loads):
        scene = Scene(
            shape=body(kind, 6, 0.2),
            material=SOIL,
            conditions=[Fixed(edge("bottom")), *loads],
            duration=0.4,
            numerics=NUMERICS,
        )
        simulation = Simulation(scene, device="cpu")
        simulation.run()
        return simulation

    one = run(Traction(top, (4e3, 2e3), Ramp(0.1)))
    two = run(Traction(top, (4e3, 0.0), Ramp(0.1)), Traction(top, (0.0, 1.0), Ramp(0.1, 2e3)))
    assert two.field("velocity") == pytest.approx(one.field("velocity"), rel=1e-9, abs=1e-12)
    energy = one.energy()
    assert energy.gravity == energy.walls == energy.flow == 0.0
    assert energy.loads > 0.0 and abs(energy.unaccounted) <= 1e-3 * energy.loads


def test_dead_loads_stay_and_others_follow_the_area():
    """A block that is pulled gets narrower: a load on its present area pulls by less."""

    def base(follows):
        simulation = at_rest(
            shape=Box((1.0, 1.0), 0.25),
            conditions=[
                Roller(edge("left")),
                Roller(edge("bottom")),
                Traction(edge("top"), (0.0, 2e5), Ramp(0.2), follows=follows),
            ],
            damping=40.0,
            duration=3.0,
        )
        top = simulation.field("position")[edge("top").nodes(simulation.mesh)]
        length = np.linalg.norm(np.diff(top[top[:, 0].argsort()], axis=0), axis=1).sum()
        return Reaction(edge("bottom"), 1)(simulation), length

    (following, width), (dead, _) = base(True), base(False)
    assert width < 0.95
    assert following == pytest.approx(2e5 * width, rel=1e-10)
    assert dead == pytest.approx(2e5, rel=1e-10)


def test_conditions_beat_loads_direction_by_direction():
    """A smooth wall takes up what is along its normal; a traction on the same face moves the block along it."""
    scene = Scene(
        shape=Box((1.0, 1.0), 0.25),
        material=SOIL,
        conditions=[
            Roller(edge("bottom")),
            Traction(edge("bottom"), (200.0, 0.0), follows=False),
            Traction(edge("top"), (300.0, -500.0), follows=False),
        ],
        stress=lambda x, y: (0.0, -500.0, 0.0, -150.0),
        duration=0.1,
        numerics=NUMERICS,
    )
    simulation = Simulation(scene, device="cpu")
    assert Reaction(edge("bottom"), 1)(simulation) == pytest.approx(-500.0, rel=1e-12), "before any step"
    mass = simulation.nodes.mass.numpy()
    assert mass @ simulation.nodes.acceleration.numpy()[:, 0] == pytest.approx(500.0, rel=1e-12)
    simulation.run()
    assert mass @ simulation.field("velocity")[:, 0] == pytest.approx(500.0 * 0.1, rel=1e-12)
    assert not simulation.field("velocity")[edge("bottom").nodes(scene.mesh), 1].any()


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("kind", BODIES)
def test_runs_are_the_same_on_any_number_of_threads_and_after_a_restart(kind, precision):
    dim = BODIES[kind][0]
    scene = Scene(
        shape=body(kind, 6, 0.2),
        material=SOFT,
        conditions=[
            Fixed(edge("left")),
            Pressure(edge("right"), 3e4, Ramp(0.05)),
            *[Traction(edge("top"), (0.0, 1e4, 0.0)[:dim])] * (dim > 1),
        ],
        duration=0.1,
        numerics=NUMERICS,
    )
    one, two, resumed = (Simulation(scene, device="cpu", precision=precision, threads=t) for t in (1, 2, 1))
    one.run(until=0.05)
    two.run(until=0.05)
    resumed.restore(*two.state())
    for simulation in (one, resumed):
        simulation.run(until=0.1)
    assert np.abs(one.field("displacement")).max() > 0.01
    for name in one.fields():
        assert np.array_equal(one.field(name), resumed.field(name)), name
    assert one.stepper.loads.work.numpy().sum() == resumed.stepper.loads.work.numpy().sum() > 0.0


BLOCK = {"shape": Box((1.0, 1.0), 0.25), "material": SOIL, "duration": 1.0, "numerics": NUMERICS}
TOP = edge("top")


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (lambda: Traction(TOP, "down"), r"^Traction.traction = 'down' .*finite numbers"),
        (lambda: Traction(TOP, (0.0, np.nan)), r"^Traction.traction = .*finite numbers"),
        (lambda: Traction(TOP, Ramp(1.0)), r"^Traction.traction = Ramp.*not be a function of time; .*factor"),
        (lambda: Traction(TOP, (0.0, 1.0), factor="x"), r"^Traction.factor = 'x'"),
        (lambda: Traction(TOP, (0.0, 1.0), follows=1), r"^Traction.follows = 1 .*True or False"),
        (
            lambda: Traction(TOP, (0.0, 1.0), lambda t: 1.0 / t),
            r"^Traction.factor = .*f\(0.0\) must return a finite",
        ),
        (
            lambda: Pressure(TOP, (1.0,)),
            r"^Pressure.pressure = \(1.0,\) .*finite number or a function of position",
        ),
        (lambda: Pressure(TOP, np.inf), r"^Pressure.pressure = inf"),
        (lambda: Pressure(TOP, Linear(1.0)), r"^Pressure.pressure = Linear.*not be a function of time; .*factor"),
        (lambda: Pressure(TOP, 1.0, follows=None), r"^Pressure.follows = None"),
    ],
)
def test_loads_that_can_not_be_are_refused(load, message):
    with pytest.raises(SceneError, match=message) as caught:
        load()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("conditions", "message"),
    [
        ([Traction(TOP, (1.0,))], r"^Traction.traction = \(1.0,\) .* 2 components$"),
        ([Traction(TOP, lambda x, y: (x, y, x))], r"^Traction.traction = .*must return 2 finite"),
        ([Pressure(TOP, lambda x, y: np.where(x > 0.5, np.inf, x))], r"^Pressure.pressure = .*finite"),
        ([Pressure(TOP, lambda x: x)], r"^Pressure.pressure = .*must return 1 finite"),
        (
            [Pressure(where(lambda x, y: (x == 0.5) & (y == 0.5)), 1.0)],
            r"^conditions\[0\] = .*all nodes of at least one boundary face$",
        ),
        (
            [Pressure(TOP & where(lambda x, y: x == 0.5), 1.0)],
            r"^conditions\[0\] = .*all nodes of at least one boundary face$",
        ),
        (
            [Pressure(where(lambda x, y: y >= 0.75), 1.0)],
            r"^conditions\[0\] = .*node 8 at \(0.25, 0.75\) lies on no boundary face, which alone are loaded$",
        ),
        (
            [Fixed(TOP), Traction(TOP, (1.0, 0.0))],
            r"^conditions\[1\] = .*shares 4 boundary face\(s\) with conditions\[0\] .*holds them along the load$",
        ),
        (
            [Traction(TOP, (1.0, -1.0)), PrescribedVelocity(TOP, (None, -1.0))],
            r"^conditions\[0\] = .*with conditions\[1\] .*moves or holds them along the load$",
        ),
        (
            [Pressure(edge("boundary"), 1.0), Roller(edge("bottom"))],
            r"^conditions\[0\] = .*shares 4 .*with conditions\[1\] .*moves or holds them along the load$",
        ),
        (
            [Free(TOP), Pressure(TOP, 1.0)],
            r"^conditions\[1\] = .*with conditions\[0\] .*says that nothing is on them$",
        ),
    ],
)
def test_loads_that_do_not_fit_the_scene_are_refused(conditions, message):
    with pytest.raises(SceneError, match=message) as caught:
        Scene(**BLOCK, conditions=conditions)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (Pressure(TOP, 1.0), "velocity_scheme taylor has loads on present areas in directions that stay"),
        (Traction(TOP, (1.0, 0.0), follows=False), "velocity_scheme taylor has loads on present areas"),
        (
            Traction(where(lambda x, y: y >= 0.75), (1.0, 0.0)),
            "lies on no boundary face, which alone are loaded",
        ),
    ],
)
def test_published_schemes_refuse_what_they_can_not_do(load, message):
    with pytest.raises(SceneError, match=message):
        Scene(**BLOCK | {"numerics": Numerics(velocity_scheme="taylor")}, conditions=[load])


def test_published_schemes_take_a_pressure_where_nothing_turns():
    common = BLOCK | {"large_displacements": False, "numerics": Numerics(velocity_scheme="taylor")}
    one, two = (
        Scene(**common, conditions=[load]).boundary
        for load in (Pressure(TOP, 7.0), Traction(TOP, (0.0, -7.0), follows=False))
    )
    assert np.array_equal(one.traction, two.traction) and one.loaded


def test_a_load_that_is_not_finite_later_ends_the_run_in_one_line():
    wild = Traction(TOP, (0.0, 1.0), lambda t: np.nan if t > 0.01 else 1.0)
    simulation = Simulation(Scene(**BLOCK, conditions=[Fixed(edge("bottom")), wild]), device="cpu")
    with pytest.raises(FunctionError, match=r"^Traction.factor = .*must return a finite number; not nan$"):
        simulation.run()


class Suction(Free):
    """A condition of one's own, as docs/conditions.md says: it pulls along the normal."""

    def tractions(self, points, normal):
        return [(np.broadcast_to(1e3 * normal, points.shape), 1.0)]


def test_tractions_of_ones_own_are_forces_too():
    stress = {"stress": lambda x, y: (1e3, 1e3, 0.0, 1e3)}
    simulation = Simulation(Scene(**BLOCK | stress, conditions=[Suction(edge("boundary"))]), device="cpu")
    for _ in range(20):
        simulation.step()
    assert np.abs(simulation.field("velocity")).max() <= 1e-12


@pytest.mark.parametrize("name", ["Traction", "Pressure"])
def test_loads_are_stored_and_read_again(name):
    loads = {
        "Traction": Traction(TOP, (0.0, -1e3), Ramp(0.5), follows=False),
        "Pressure": Pressure(edge("left"), 1e3, Linear(2.0)),
    }
    probe = Probe("base", "N/m", Reaction(edge("bottom"), 1))
    scene = Scene(**BLOCK, conditions=[Fixed(edge("bottom")), loads[name]], output=Output(probes=(probe,)))
    document, arrays = encode(scene)
    again = decode(document, arrays)
    assert again.conditions[1] == loads[name]
    assert again.output.probes == (probe,)
    assert fingerprint(again) == fingerprint(scene)
    bare = Scene(**BLOCK, conditions=[Fixed(edge("bottom"))], output=scene.output)
    assert fingerprint(bare) != fingerprint(scene)
