"""Scenes with a known answer that several tests run, and the energy of a run."""

import numpy as np

from warpsph import (
    BodyForce,
    Box,
    Elastic,
    Fixed,
    NodeValue,
    Numerics,
    Output,
    Probe,
    Roller,
    Scene,
    Simulation,
    edge,
)

SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
EDGES = ("left", "right", "bottom", "top")


def standing_mode(kind, cells, periods=2.0, material=SOFT, shape=None, amplitude=1.0, **numerics):
    """A standing mode of the unit square at small displacements, k = π; after whole periods the start is back.

    S, P: between roller walls on 0 ≤ x, y ≤ 1, v = (sin kx cos ky, ∓cos kx sin ky), ω = √2 k c_s or √2 k c_p.
    Lamé: all sides free, |x|, |y| ≤ ½, the velocity of S. With div v = 0 and v ∝ (sin kx cos ky, −cos kx sin ky),
    σ12 = 0 everywhere and σ11 = −σ22 ∝ cos kx cos ky, which vanishes on all four sides: exact, for any ν.
    """
    free = kind == "Lamé"
    sign = 1.0 if kind == "P" else -1.0
    speed = material.wave_speed(2) if kind == "P" else material.shear_wave_speed()
    k, origin = np.pi, (-0.5, -0.5) if free else (0.0, 0.0)
    return Scene(
        shape=shape or Box((1.0, 1.0), 1.0 / cells, origin),
        material=material,
        conditions=[] if free else [Roller(edge(name)) for name in EDGES],
        velocity=lambda x, y: (
            amplitude * np.sin(k * x) * np.cos(k * y),
            sign * amplitude * np.cos(k * x) * np.sin(k * y),
        ),
        duration=periods * 2.0 * np.pi / (np.sqrt(2.0) * k * speed),
        large_displacements=False,
        numerics=Numerics(**numerics),
    )


def return_error(scene, precision="float64"):
    """Relative L2 difference of the velocity after the run from that at the start."""
    simulation = Simulation(scene, device="cpu", precision=precision)
    simulation.run()
    start = scene.initial_velocity
    return np.linalg.norm(simulation.field("velocity") - start) / np.linalg.norm(start)


CANTILEVER_PERIOD = 0.2552  # [s], by Ritz: see test_cantilever_period


def cantilever(across, periods, poisson_ratio=0.3975, **numerics):
    """A cantilever that swings freely, ten times as long as high.

    It starts with the velocity of its first mode (Euler, Bernoulli).
    """
    length, height, amplitude = 0.2, 0.02, 0.01
    b = 1.8751040687 / length
    ratio = (np.cosh(b * length) + np.cos(b * length)) / (np.sinh(b * length) + np.sin(b * length))

    def slope(x):
        return b * (np.sinh(b * x) + np.sin(b * x) - ratio * (np.cosh(b * x) - np.cos(b * x)))

    def deflection(x):
        return np.cosh(b * x) - np.cos(b * x) - ratio * (np.sinh(b * x) - np.sin(b * x))

    return Scene(
        shape=Box((length, height), height / across, (0.0, -0.5 * height)),
        material=Elastic(young_modulus=2e6, poisson_ratio=poisson_ratio, density=1000.0),
        conditions=[Fixed(edge("left"))],
        velocity=lambda x, y: (-0.5 * amplitude * y * slope(x), 0.5 * amplitude * deflection(x)),
        duration=periods * CANTILEVER_PERIOD,
        numerics=Numerics(**numerics),
        output=Output(interval=5e-4, probes=(Probe("tip", "m", NodeValue("displacement", (length, 0.0), 1)),)),
    )


def zero_crossings(time, value):
    """Times at which a signal that starts away from zero changes its sign, linear between samples."""
    at = np.flatnonzero(value[:-1] * value[1:] < 0.0)
    return time[at] - value[at] * (time[at + 1] - time[at]) / (value[at + 1] - value[at])


HANGING = Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0)


def hanging_bar(cells, periods, material=HANGING, large_displacements=True, **numerics):
    """examples/hanging_bar.py, elastic: gravity at once; it swings in 4 L/c, c = √(E/(1 − ν²)/ρ)."""
    speed = (material.young_modulus / (1.0 - material.poisson_ratio**2) / material.density) ** 0.5
    return Scene(
        shape=Box((0.2, 1.0), 1.0 / cells),
        material=material,
        conditions=[Fixed(edge("top"))],
        body_force=BodyForce((0.0, -9.81)),
        duration=periods * 4.0 / speed,
        large_displacements=large_displacements,
        numerics=Numerics(**numerics),
    )


class Energies:
    """Kinetic, elastic and potential energy of a run, sampled as it goes.

    On a lattice the nodes' volumes are the weights of the trapezium rule. The elastic energy is taken of the
    stresses that are strained, with the initial volumes, or of their means over the cells (`bending`). With
    Δt²/8 of m a² off the kinetic energy, the sum is what leapfrog keeps of linear motion; it swings without.
    """

    def __init__(self, simulation, every=1, observe=lambda simulation: None, bending=False):
        scene = simulation.scene
        self._every, self._also = every, observe
        self._volume = scene.mesh.node_volumes()
        self._mass = scene.material.density * self._volume
        self._compliance = compliance(scene)
        self._cells = scene.mesh.cells if bending else np.arange(len(self._volume))[:, None]
        self._weight = scene.mesh.cell_volumes() if bending else self._volume
        self._force = np.zeros(scene.mesh.dim) if scene.body_force is None else scene.body_force(0.0)
        self.time, self.kinetic, self.elastic, self.potential, self.also = [], [], [], [], []
        self.sample(simulation)

    def observe(self, simulation):
        if simulation.steps % self._every == 0:
            self.sample(simulation)

    def sample(self, simulation):
        phi, dim = simulation.nodes.point.numpy()["phi"].astype(float), simulation.mesh.dim
        v, s = phi[:, :dim], phi[:, dim:][self._cells].mean(axis=1)
        self.time.append(simulation.time)
        a = simulation.nodes.acceleration.numpy().astype(float)
        held = simulation.scene.boundary.nodes
        a[held] += simulation.stepper.reactions.numpy()[: len(held)] / self._mass[held, None]
        step = 0.0 if simulation.steps == 0 else simulation.longest_step
        self.kinetic.append(0.5 * self._mass @ (v**2 - 0.25 * step**2 * a**2).sum(axis=1))
        self.elastic.append(0.5 * self._weight @ np.einsum("ni,ij,nj->n", s, self._compliance, s))
        self.potential.append(-self._mass @ (simulation.field("displacement") @ self._force))
        self.also.append(self._also(simulation))

    @property
    def total(self):
        return np.add(np.add(self.kinetic, self.elastic), self.potential)


def compliance(scene):
    """Strain energy ½ σ · S σ of the stored stresses, each shear once a component; plane strain with σ33."""
    E, nu = scene.material.young_modulus, scene.material.poisson_ratio
    pairs = scene.mesh.continuum.pairs
    if len(pairs) == 1:
        return np.array([[1.0 / E]])
    normal = np.array([i == j for i, j in pairs])
    return -nu / E * np.outer(normal, normal) + np.diag(np.where(normal, (1.0 + nu) / E, 2.0 * (1.0 + nu) / E))
