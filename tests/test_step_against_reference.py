"""One step on a random smooth state against the slow NumPy loops of `tests.reference`."""

import numpy as np
import pytest

from tests.reference.slow_cells import slow_cells_step
from tests.reference.slow_step import slow_step
from warpsph import (
    BodyForce,
    Box,
    Fixed,
    Free,
    Numerics,
    PerzynaVonMises,
    PrescribedVelocity,
    Ramp,
    Roller,
    Scene,
    Simulation,
    edge,
    where,
)

SPACING = 0.1
SIZE = (1.2, 0.8)
MATERIAL = PerzynaVonMises(
    young_modulus=8e7,
    poisson_ratio=0.3,
    density=2000.0,
    fluidity=3.0,
    exponent=1.5,
    yield_size=2e5,
    hardening=-4e5,
    residual_ratio=0.2,
)
GRAVITY = BodyForce((1.5, -9.81), Ramp(1e-3))
DAMPING = 50.0
TOLERANCE = {"float64": 1e-12, "float32": 1e-5}


def footing(t):
    return -0.3 * (1.0 + t)


def random_smooth(rng, scale):
    """A sum of three long waves with random amplitudes, directions and phases, as a function of (x, y)."""
    waves = rng.uniform(-1.0, 1.0, size=(3, 4)) * [1.0, 3.0, 3.0, np.pi]
    return lambda x, y: scale * sum(a * np.sin(kx * x + ky * y + p) for a, kx, ky, p in waves)


def make_scene(numerics, small_strain, cells="lattice", speed=1.0):
    """A jittered box; the part of its top that is not moved has no condition."""
    rng = np.random.default_rng(2012)
    stress = [random_smooth(rng, 2e5) for _ in range(4)]
    velocity = [random_smooth(rng, speed) for _ in range(2)]
    jitter = [random_smooth(rng, 0.02) for _ in range(2)]
    shape = Box(SIZE, SPACING, cells=cells).mapped(lambda x, y: (x + jitter[0](x, y), y + jitter[1](x, y)))
    moved = edge("top") & where(lambda x, y: x > 0.62)
    return Scene(
        shape=shape,
        material=MATERIAL,
        duration=1.0,
        conditions=[
            Roller(edge("left"), normal=(-1.0, 0.0)),
            Fixed(edge("bottom")),
            Free(edge("right"), normal=(1.0, 0.0)),
            PrescribedVelocity(moved, (None, footing), normal=(0.0, 1.0)),
        ],
        body_force=GRAVITY,
        damping=DAMPING,
        velocity=lambda x, y: [f(x, y) for f in velocity],
        stress=lambda x, y: [f(x, y) for f in stress],
        large_displacements=not small_strain,
        numerics=numerics,
    )


def state_of(simulation):
    names = {
        "v": "velocity",
        "sigma": "stress",
        "eps": "equivalent_plastic_strain",
        "rho": "density",
        "L": "velocity_gradient",
    }
    x = simulation.nodes.point.numpy()["x"].astype(float) + simulation.mesh.middle  # where sums see the nodes
    return {"x": x} | {key: simulation.field(name).astype(float) for key, name in names.items()}


def cells_state_of(simulation):
    more = {"a": simulation.nodes.acceleration, "flowed": simulation.nodes.flowed}
    return state_of(simulation) | {name: array.numpy().astype(float) for name, array in more.items()}


def model_of(scene):
    nodes, numerics = scene.mesh.nodes, scene.numerics
    share, volume = scene.mesh.node_volumes(), scene.mesh.node_weights()
    sums = {}
    if numerics.scheme.sums is not None:
        sums = {"h0": numerics.smoothing_ratio * np.sqrt(volume), "kernel": numerics.kernel}
    return sums | {
        "E": MATERIAL.young_modulus,
        "nu": MATERIAL.poisson_ratio,
        "rho0": MATERIAL.density,
        "gamma": MATERIAL.fluidity,
        "N": MATERIAL.exponent,
        "Y0": MATERIAL.yield_size,
        "H": MATERIAL.hardening,
        "r": MATERIAL.residual_ratio,
        "V0": volume,
        "mass": MATERIAL.density * share,
        "cells": scene.mesh.cells,
        "scheme": numerics.velocity_scheme,
        "small_strain": not scene.large_displacements,
        "body_force": GRAVITY,
        "damping": DAMPING,
        "left": edge("left").nodes(scene.mesh),
        "bottom": edge("bottom").nodes(scene.mesh),
        "right": edge("right").nodes(scene.mesh),
        "top": edge("top").nodes(scene.mesh) & (nodes[:, 0] > 0.62),
        "top_velocity": footing,
        "x0": nodes,
        "wave_speed": MATERIAL.wave_speed(2),
    }


@pytest.mark.parametrize(
    ("scheme", "kernel", "small_strain"),
    [
        ("blanc-pastor", "gaussian", False),
        ("taylor", "gaussian", False),
        ("taylor", "cubic_spline", False),
        ("blanc-pastor", "wendland_c2", False),
        ("taylor", "gaussian", True),
    ],
)
def test_second_step_equals_slow_loops(device, precision, scheme, kernel, small_strain):
    """The second step, so that strain, density and velocity gradient are no longer those of the start.

    Both do the same sums in another order, so they differ by round-off alone: relative to each field's
    largest value, with the scale of the elastic increment for the stress.
    """
    numerics = Numerics(velocity_scheme=scheme, source_scheme="rk4", kernel=kernel, courant=0.5)
    scene = make_scene(numerics, small_strain)
    simulation = Simulation(scene, device=device, precision=precision)
    dt = simulation.time_step_limit
    simulation.step()
    before = state_of(simulation)
    assert before["eps"].max() > 0.0, "the state must flow for this test to mean anything"
    simulation.step()
    after = state_of(simulation)
    expected = slow_step(before, model_of(scene), dt, dt)
    for key, reference in expected.items():
        difference = np.abs(after[key] - reference).max() / np.abs(reference).max()
        assert difference <= TOLERANCE[precision], key


@pytest.mark.parametrize("cells", ["lattice", "triangles"])
@pytest.mark.parametrize(("small_strain", "courant", "speed"), [(False, 0.8, 1.0), (True, 0.4, 100.0)])
def test_second_step_of_cells_equals_slow_loops(device, precision, small_strain, courant, speed, cells):
    """The same for the scheme `cells`; accelerations are those of all forces but the conditions'.

    With the higher speed soil flows so fast that the bound of its viscosity counts.
    """
    numerics = Numerics(velocity_scheme="cells", courant=courant, sharpening=0.0)
    scene = make_scene(numerics, small_strain, cells, speed)
    simulation = Simulation(scene, device=device, precision=precision)
    first = simulation.time_step_limit
    simulation.step()
    dt = simulation.time_step_limit
    before = cells_state_of(simulation)
    assert before["eps"].max() > 0.0, "the state must flow for this test to mean anything"
    simulation.step()
    after = cells_state_of(simulation)
    expected = slow_cells_step(before, model_of(scene), first, dt)
    for key, reference in expected.items():
        difference, scale = np.abs(after[key] - reference).max(), np.abs(reference).max()
        assert difference <= TOLERANCE[precision] * scale, key
