"""One step on a random smooth state against the slow NumPy loops of `tests.reference`."""

import itertools

import numpy as np
import pytest

from tests.reference.slow_compatible import axes_of, slow_compatible_step
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


def make_scene(scheme, kernel, small_strain, sources="rk4", courant=0.5):
    """A jittered box; the part of its top that is not moved has no condition."""
    rng = np.random.default_rng(2012)
    stress = [random_smooth(rng, 2e5) for _ in range(4)]
    velocity = [random_smooth(rng, 1.0) for _ in range(2)]
    jitter = [random_smooth(rng, 0.02) for _ in range(2)]
    shape = Box(SIZE, SPACING).mapped(lambda x, y: (x + jitter[0](x, y), y + jitter[1](x, y)))
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
        numerics=Numerics(velocity_scheme=scheme, source_scheme=sources, kernel=kernel, courant=courant),
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


def compatible_state_of(simulation):
    table = simulation.stepper.conditions.table
    row, turned = table.held.row.numpy(), table.turned.numpy().astype(float)
    angle = np.where(row >= 0, np.arctan2(turned[row, 1, 0], turned[row, 0, 0]), 0.0)
    return state_of(simulation) | {"u": simulation.field("displacement").astype(float), "angle": angle}


def bare_normals(mesh):
    """{node: outward normal} of the top's sides before the moved part: the mean of those beside the node."""
    top = np.flatnonzero(edge("top").nodes(mesh))
    top = top[np.argsort(mesh.nodes[top, 0])]
    normals = {}
    for a, b in itertools.pairwise(top):
        if mesh.nodes[a, 0] <= 0.62:
            along = mesh.nodes[b] - mesh.nodes[a]
            normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            for node in (a, b):
                normals[int(node)] = normals.get(int(node), 0.0) + normal
    return {node: normal / np.linalg.norm(normal) for node, normal in normals.items()}


def model_of(scene):
    nodes, numerics = scene.mesh.nodes, scene.numerics
    _, volume = scene.mesh.node_volumes()
    return {
        "E": MATERIAL.young_modulus,
        "nu": MATERIAL.poisson_ratio,
        "rho0": MATERIAL.density,
        "gamma": MATERIAL.fluidity,
        "N": MATERIAL.exponent,
        "Y0": MATERIAL.yield_size,
        "H": MATERIAL.hardening,
        "r": MATERIAL.residual_ratio,
        "V0": volume,
        "smoothing_ratio": numerics.smoothing_ratio,
        "h0": numerics.smoothing_ratio * np.sqrt(volume),
        "cells": scene.mesh.cells,
        "kernel": numerics.kernel,
        "scheme": numerics.velocity_scheme,
        "source_scheme": numerics.source_scheme,
        "small_strain": not scene.large_displacements,
        "body_force": GRAVITY,
        "damping": DAMPING,
        "left": edge("left").nodes(scene.mesh),
        "bottom": edge("bottom").nodes(scene.mesh),
        "right": edge("right").nodes(scene.mesh),
        "top": edge("top").nodes(scene.mesh) & (nodes[:, 0] > 0.62),
        "top_velocity": footing,
        "x0": nodes,
        "spacing": min(np.linalg.svd(axes_of(nodes[cell]), compute_uv=False).min() for cell in scene.mesh.cells),
        "wave_speed": MATERIAL.wave_speed(2),
        "bare_normals": bare_normals(scene.mesh),
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
    scene = make_scene(scheme, kernel, small_strain)
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


@pytest.mark.parametrize(
    ("kernel", "small_strain", "sources", "courant"),
    [
        ("gaussian", False, "analytic", 0.9),
        ("gaussian", False, "rk4", 0.5),
        ("gaussian", True, "analytic", 0.9),
        ("cubic_spline", False, "analytic", 0.8),
    ],
)
def test_second_compatible_step_equals_slow_loops(device, precision, kernel, small_strain, sources, courant):
    """The same for the compatible scheme. κ is 0.53 at Courant 0.9 and at its bound of 1 at 0.5."""
    scene = make_scene("compatible", kernel, small_strain, sources, courant)
    simulation = Simulation(scene, device=device, precision=precision)
    first = simulation.time_step_limit
    simulation.step()
    dt = simulation.time_step_limit
    before = compatible_state_of(simulation)
    assert before["eps"].max() > 0.0, "the state must flow for this test to mean anything"
    simulation.step()
    after = compatible_state_of(simulation)
    expected = slow_compatible_step(before, model_of(scene), first, dt)
    for key, reference in expected.items():
        difference, scale = np.abs(after[key] - reference).max(), np.abs(reference).max()
        assert difference <= TOLERANCE[precision] * scale, key
