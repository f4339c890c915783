"""The scheme `cells`: what it keeps exactly, on any cells, and how near it is to exact motions.

Forces and strain rates are each other's adjoint: Σ m v·a = −Σ V σ:L for any velocities and stresses in any
configuration. From that follow momentum, angular momentum, equilibrium of constant stresses; nothing grows.
"""

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    Elastic,
    Fixed,
    Numerics,
    PerzynaVonMises,
    PrescribedVelocity,
    Roller,
    Scene,
    Simulation,
    edge,
)

NUMERICS = Numerics(velocity_scheme="cells")
SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
BODIES = {
    "segments": (1, "lattice"),
    "quads": (2, "lattice"),
    "triangles": (2, "triangles"),
    "hexahedra": (3, "lattice"),
    "tetrahedra": (3, "tetrahedra"),
}


def body(kind, cells, jitter):
    """A unit box with `cells` cells a side, its nodes anywhere within `jitter` of a spacing along each axis."""
    dim, name = BODIES[kind]
    spacing, rng = 1.0 / cells, np.random.default_rng(3)

    def moved(*x):
        return tuple(part + jitter * spacing * rng.uniform(-1.0, 1.0, np.shape(part)) for part in x)

    return Box((1.0,) * dim, spacing, cells=name).mapped(moved)


def random_state(kind, jitter=None, **more):
    """A body of distorted cells with random velocities and stresses, at t = 0; no cell's corner is folded."""
    jitter = (0.2 if kind == "hexahedra" else 0.3) if jitter is None else jitter
    dim, rng = BODIES[kind][0], np.random.default_rng(7)
    size = {1: 1, 2: 4, 3: 6}[dim]
    more.setdefault("stress", lambda *x: tuple(rng.normal(size=(size, len(x[0])))))
    more.setdefault("velocity", lambda *x: tuple(1e-3 * rng.normal(size=(dim, len(x[0])))))
    scene = Scene(shape=body(kind, 4, jitter), material=SOFT, duration=1.0, numerics=NUMERICS, **more)
    return Simulation(scene, device="cpu")


def tensors(simulation):
    """The stresses that are strained, as d × d matrices."""
    d = simulation.mesh.dim
    stress = simulation.nodes.point.numpy()["phi"][:, d:]
    full = np.zeros((len(stress), d, d))
    for k, (i, j) in enumerate(simulation.mesh.continuum.pairs):
        if max(i, j) < d:
            full[:, i, j] = full[:, j, i] = stress[:, k]
    return full


@pytest.mark.parametrize("kind", BODIES)
def test_forces_are_the_adjoint_of_strain_rates(kind):
    simulation = random_state(kind)
    nodes = simulation.nodes
    mass, volume = nodes.mass.numpy(), nodes.volume.numpy()
    force = mass[:, None] * nodes.acceleration.numpy()
    L, sigma, x = simulation.field("velocity_gradient"), tensors(simulation), simulation.field("position")
    power = volume[:, None, None] * sigma * L
    assert (force * simulation.field("velocity")).sum() == pytest.approx(
        -power.sum(), abs=1e-12 * np.abs(power).sum()
    )
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    torque = np.einsum("ni,nj->ij", x, force)
    assert np.abs(torque - torque.T).max() < 1e-12 * scale


@pytest.mark.parametrize("kind", BODIES)
def test_a_linear_velocity_has_its_gradient_and_a_constant_stress_is_in_equilibrium(kind):
    dim = BODIES[kind][0]
    A = np.random.default_rng(1).normal(size=(dim, dim))
    simulation = random_state(
        kind,
        velocity=lambda *x: tuple(A @ np.array(x)),
        stress=lambda *x: tuple(np.ones(len(x[0])) * (k + 1.0) for k in range({1: 1, 2: 4, 3: 6}[dim])),
    )
    assert simulation.field("velocity_gradient") == pytest.approx(
        np.broadcast_to(A, (len(simulation.mesh.nodes), dim, dim)), abs=1e-12
    )
    inner = np.ones(len(simulation.mesh.nodes), dtype=bool)
    inner[simulation.mesh.faces] = False
    force = simulation.nodes.mass.numpy()[:, None] * simulation.nodes.acceleration.numpy()
    assert np.abs(force[inner]).max() < 1e-13 * np.abs(force).max()


@pytest.mark.parametrize("kind", ["quads", "triangles", "hexahedra", "tetrahedra"])
def test_a_free_body_keeps_momentum_angular_momentum_and_energy_in_two_turns(kind):
    """Rim speed 0.1 c_s, two turns. Leapfrog keeps x × p to rounding."""
    omega = 0.1 * SOFT.shear_wave_speed() / 0.5

    def spin(x, y, *z):
        return (-omega * (y - 0.5), omega * (x - 0.5), *(0.0 * part for part in z))

    scene = Scene(shape=body(kind, 4, 0.15), material=SOFT, duration=1.0, numerics=NUMERICS, velocity=spin)
    simulation = Simulation(scene, device="cpu")
    mass = simulation.nodes.mass.numpy()

    def angular():
        half = simulation.nodes.half.numpy()
        (x, y), (u, v) = half["x"][:, :2].T, half["v"][:, :2].T
        return (mass * (x * v - y * u)).sum()

    simulation.step()
    first, start = angular(), (mass[:, None] * simulation.field("velocity") ** 2).sum()
    simulation.run(until=2 * 2 * np.pi / omega)
    assert angular() == pytest.approx(first, rel=1e-10)
    assert (mass[:, None] * simulation.field("velocity") ** 2).sum() == pytest.approx(start, rel=5e-3)


EDGES = {
    "clamped": [Fixed(edge("left"))],
    "free": [],
    "rollers": [Roller(edge("bottom")), Roller(edge("top"))],
}


def noisy(kind, shape, poisson, edges="clamped"):
    """A body with random velocities."""
    dim, name = BODIES[kind]
    box = Box((4.0,) * dim, 1.0, cells=name)
    rng = np.random.default_rng(2)

    def jittered(*x):
        inner = np.all([(p > 0.5) & (p < 3.5) for p in x], axis=0)
        return tuple(p + inner * rng.uniform(-0.25, 0.25, p.shape) for p in x)

    mapped = {
        "flat": lambda x, *y: (10.0 * x, *y),
        "leaning": lambda x, y, *z: (x + 2.0 * y, y, *z),
        "jittered": jittered,
        "bent": lambda x, y, *z: (x + 0.48 * (-1.0) ** np.rint(x + y), y, *z),
        "quarter disc": lambda x, y, *z: (x * np.sqrt(1.0 - y**2 / 32.0), y * np.sqrt(1.0 - x**2 / 32.0), *z),
    }[shape]
    scene = Scene(
        shape=box.mapped(mapped),
        material=Elastic(young_modulus=1.0, poisson_ratio=poisson, density=1.0),
        conditions=EDGES[edges],
        velocity=lambda *x: tuple(1e-3 * rng.normal(size=(dim, len(x[0])))),
        large_displacements=False,
        duration=1.0,
        numerics=NUMERICS,
    )
    return Simulation(scene, device="cpu")


def kinetic_energy(simulation):
    return 0.5 * (simulation.nodes.mass.numpy()[:, None] * simulation.field("velocity") ** 2).sum()


SOLIDS, POISSON = ("quads", "triangles", "hexahedra", "tetrahedra"), (-0.5, 0.3, 0.49)


@pytest.mark.parametrize("shape", ["flat", "leaning", "jittered", "bent", "quarter disc"])
@pytest.mark.parametrize("kind", SOLIDS)
@pytest.mark.parametrize("poisson", POISSON)
def test_noise_does_not_grow(kind, shape, poisson):
    """5000 steps from random velocities: what is left is no more than was put in."""
    simulation = noisy(kind, shape, poisson)
    start = kinetic_energy(simulation)
    simulation.run(until=5000 * simulation.time_step_limit)
    assert kinetic_energy(simulation) <= start


@pytest.mark.long
@pytest.mark.parametrize("edges", ["free", "rollers"])
@pytest.mark.parametrize("shape", ["flat", "leaning", "jittered", "quarter disc"])
@pytest.mark.parametrize("kind", ["quads", "triangles"])
@pytest.mark.parametrize("poisson", POISSON)
def test_noise_does_not_grow_whatever_holds_the_edges(kind, shape, poisson, edges):
    """Of a plane body, in 100 000 steps."""
    simulation = noisy(kind, shape, poisson, edges)
    simulation.run(until=1000 * simulation.time_step_limit)
    left = simulation.energy()
    simulation.run(until=100_000 * simulation.time_step_limit)
    now = simulation.energy()
    assert now.kinetic + now.elastic <= left.kinetic + left.elastic


@pytest.mark.long
@pytest.mark.parametrize("shape", ["flat", "leaning", "jittered", "bent", "quarter disc"])
@pytest.mark.parametrize("kind", SOLIDS)
@pytest.mark.parametrize("poisson", POISSON)
def test_noise_does_not_grow_in_a_hundred_thousand_steps(kind, shape, poisson):
    simulation = noisy(kind, shape, poisson)
    simulation.run(until=1000 * simulation.time_step_limit)
    left = kinetic_energy(simulation)
    simulation.run(until=100_000 * simulation.time_step_limit)
    assert kinetic_energy(simulation) <= left


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("kind", ["quads", "triangles"])
def test_runs_are_the_same_on_any_number_of_threads_and_after_a_restart(kind, precision):
    clay = PerzynaVonMises(young_modulus=1e6, poisson_ratio=0.3, density=2000.0, fluidity=10.0, yield_size=2e4)
    scene = Scene(
        shape=Box((1.0, 2.0), 0.1, cells=BODIES[kind][1]),
        material=clay,
        conditions=[Fixed(edge("bottom"))],
        body_force=BodyForce((0.0, -9.81)),
        duration=1.0,
        numerics=NUMERICS,
    )
    one, two, resumed = (Simulation(scene, device="cpu", precision=precision, threads=t) for t in (1, 2, 1))
    one.run(until=0.15)
    two.run(until=0.15)
    state, values = two.state()
    resumed.restore(state, values)
    for simulation in (one, resumed):
        simulation.run(until=0.3)
    assert one.field("equivalent_plastic_strain").max() > 1e-3
    for name in one.fields():
        assert np.array_equal(one.field(name), resumed.field(name)), name
    assert one.energy() == resumed.energy() and one.largest_energy == resumed.largest_energy


def test_time_step_follows_cells_that_are_pressed():
    """Uniaxial strain to four fifths of the height, slowly: squares become 5 : 4, and Δx is their height.

    A cell's mass and its stiffness stay, so that waves get slower by √(4/5), and a step is √(4/5) of the first.
    It is measured anew every 2 % of strain; waves of the press itself strain by v/c_p = 0.5 %.
    """
    scene = Scene(
        shape=Box((1.0, 1.0), 0.25),
        material=SOFT,
        conditions=[
            *(Roller(edge(side)) for side in ("left", "right", "bottom")),
            PrescribedVelocity(edge("top"), (None, -0.2)),
        ],
        duration=1.0,
        numerics=NUMERICS,
    )
    simulation = Simulation(scene, device="cpu")
    start = simulation.time_step_limit
    simulation.run()
    assert simulation.field("position")[:, 1].max() == pytest.approx(0.8, abs=1e-9)
    assert simulation.time_step_limit / start == pytest.approx(np.sqrt(0.8), abs=0.015)
