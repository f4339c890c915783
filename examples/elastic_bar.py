"""Pulse in an elastic bar between two fixed ends (Blanc and Pastor 2012, section 6.3).

A bar of 1 m, fixed at its left end, is pulled at its right end with 1 m/s for 5 ms and held there afterwards.
Exact solution: d'Alembert's. A pulse as long as the bar runs to and fro; at x = 0.1 m (node 11) it passes every
5 ms with v = +1, −1, +1, … m/s and σ = ρ c v = 4e5 Pa, between plateaus at rest with σ = 0 and 8e5 Pa, and the
displacement swings between 0 and 0.001 m.
"""

import numpy as np

from warpsph import (
    PUBLISHED,
    Box,
    Check,
    Elastic,
    Fixed,
    NodeValue,
    Output,
    Parameter,
    PrescribedVelocity,
    Probe,
    Pulse,
    Scene,
    edge,
)

LENGTH = 1.0  # [m]
POINT = 0.1  # of the history [m]

NUMERICS = PUBLISHED
PARAMETERS = (
    Parameter("spacing", 0.01, "m", "distance between neighbouring nodes"),
    Parameter("velocity", 1.0, "m/s", "velocity of the right end during the pull"),
    Parameter("duration", 0.05, "s", "simulated time"),
    Parameter("young_modulus", 8e7, "Pa", "Young's modulus"),
    Parameter("density", 2000.0, "kg/m³", "density"),
)


def wave_speed(p):
    return (p.young_modulus / p.density) ** 0.5


def scene(p):
    return Scene(
        shape=Box((LENGTH,), p.spacing),
        material=Elastic(young_modulus=p.young_modulus, density=p.density),
        conditions=[
            Fixed(edge("left")),
            PrescribedVelocity(edge("right"), (Pulse(p.velocity, LENGTH / wave_speed(p)),)),
        ],
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            interval=0.0,
            probes=(
                Probe("velocity", "m/s", NodeValue("velocity", (POINT,))),
                Probe("stress", "Pa", NodeValue("stress", (POINT,))),
                Probe("displacement", "m", NodeValue("displacement", (POINT,))),
            ),
            field="stress",
        ),
    )


def checks(run):
    """Plateau values: means over the middle fifth of each exact plateau (the jumps smear over a few nodes)."""
    p, history = run.parameters, run.history
    transit = LENGTH / wave_speed(p)
    near, far = POINT / wave_speed(p), (LENGTH - POINT) / wave_speed(p)
    stress_step = p.density * wave_speed(p) * p.velocity
    speeds, stresses = [], []  # (found, exact)
    for passage in range(int(p.duration / transit) + 1):
        # The pulse's front or its end reaches the point, is reflected at the fixed end, and comes back.
        front = far + passage * transit
        direction = 1.0 if passage % 2 == 0 else -1.0
        at_rest = 2.0 if passage % 2 == 0 else 0.0
        moving = _mean(history, "velocity", front, front + 2.0 * near)
        speeds.append((direction * moving, p.velocity))
        stresses.append((_mean(history, "stress", front, front + 2.0 * near), stress_step))
        rest = _mean(history, "stress", front + 2.0 * near, front + transit)
        stresses.append((rest, at_rest * stress_step))
    swing = 2.0 * near * p.velocity
    displacement = history["displacement"]
    return [
        Check("worst_velocity_plateau", *_worst(speeds), "m/s", 0.05),
        Check("worst_stress_plateau", *_worst(stresses), "Pa", 0.05 * stress_step, relative=False),
        Check("largest_displacement", displacement.max(), swing, "m", 0.05),
        Check("smallest_displacement", displacement.min(), 0.0, "m", 0.05 * swing, relative=False),
    ]


def _worst(pairs):
    """The (found, exact) pair that differs most, of those the run has reached."""
    return max((pair for pair in pairs if np.isfinite(pair[0])), key=lambda pair: abs(pair[0] - pair[1]))


def _mean(history, name, start, end):
    """Mean over the middle fifth of a time interval; nan when the run ends before it."""
    time, middle, half = history["time"], 0.5 * (start + end), 0.1 * (end - start)
    inside = (time >= middle - half) & (time <= middle + half)
    return float(history[name][inside].mean()) if inside.any() else float("nan")
