"""Viscoplastic bar struck at its end, against the exact solution with a Bessel function.

A half-infinite bar, Perzyna with N = 1 and H = 0, whose end moves with constant velocity v0 from t = 0 on. With
x the distance from that end and λ = E γ/Y, behind the front (x < c t)

    |σ| = Y + (ρ c v0 − Y) exp(−λ t/2) I₀(½ λ √(t² − x²/c²)),

and 0 ahead of it. Small strains.
"""

import numpy as np

from warpsph import (
    PUBLISHED,
    Box,
    Check,
    Fixed,
    NodeValue,
    Output,
    Parameter,
    PerzynaVonMises,
    PrescribedVelocity,
    Probe,
    Scene,
    edge,
)

LENGTH = 1.0  # [m]; the front does not reach the far end

NUMERICS = {**PUBLISHED, "smoothing_ratio": 0.5}
MATERIAL = PerzynaVonMises(young_modulus=8e7, density=2000.0, fluidity=1.0, yield_size=2e5)
PARAMETERS = (
    Parameter("spacing", 0.01, "m", "distance between neighbouring nodes"),
    Parameter("velocity", 1.0, "m/s", "velocity v0 of the end"),
    Parameter("duration", 4e-3, "s", "simulated time"),
    *Parameter.of(MATERIAL, "young_modulus", "density", "fluidity", "yield_size"),
)


def wave_speed(p):
    return (p.young_modulus / p.density) ** 0.5


def exact_stress(x, t, p):
    """|σ| [Pa] at distances x [m] from the struck end."""
    c, relaxation = wave_speed(p), p.young_modulus * p.fluidity / p.yield_size
    behind = x < c * t
    root = np.sqrt(np.maximum(t**2 - (x / c) ** 2, 0.0))
    over = (p.density * c * p.velocity - p.yield_size) * np.exp(-0.5 * relaxation * t)
    return np.where(behind, p.yield_size + over * np.i0(0.5 * relaxation * root), 0.0)


def scene(p):
    return Scene(
        shape=Box((LENGTH,), p.spacing),
        material=MATERIAL.with_parameters(p),
        conditions=[Fixed(edge("left")), PrescribedVelocity(edge("right"), (p.velocity,))],
        duration=p.duration,
        large_displacements=False,
        numerics=p.numerics,
        output=Output(
            interval=0.0,
            probes=(Probe("end_stress", "Pa", NodeValue("stress", (LENGTH,))),),
            field="stress",
        ),
    )


def checks(run):
    """RMS over all nodes but the one on the front itself, where the exact stress jumps and has no value."""
    p, simulation = run.parameters, run.simulation
    x = LENGTH - simulation.mesh.nodes[:, 0]
    front = np.abs(x - wave_speed(p) * simulation.time) < 0.5 * p.spacing
    difference = simulation.field("stress")[:, 0] - exact_stress(x, simulation.time, p)
    scale = p.density * wave_speed(p) * p.velocity
    rms = float(np.sqrt(np.mean(difference[~front] ** 2)) / scale)
    return [Check("stress_rms_error", rms, 0.0, "of ρ c v0", 0.0015, relative=False)]
