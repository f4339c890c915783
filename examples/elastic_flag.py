"""Elastic flag that bends under its own weight (test CSM3 of Turek and Hron 2006).

A beam 0.35 m long and 0.02 m thick, clamped at its left end and straight at rest, is let go: it swings down, and
comes back to where it began. Plane strain, large rotations. Reference: the tip between −128.8 and +1.5 mm, every
0.913 s (Turek and Hron, finest level, a St. Venant-Kirchhoff solid). A scheme that loses energy or angular
momentum loses the swing.
"""

import numpy as np

from warpsph import BodyForce, Box, Check, Elastic, Fixed, NodeValue, Output, Parameter, Probe, Scene, edge

LENGTH, THICKNESS, GRAVITY = 0.35, 0.02, 2.0  # [m], [m], [m/s²]
LOWEST, HIGHEST, PERIOD = -0.1288, 1.5e-3, 0.913  # of the tip [m], [m]; [s]
SHORT = ("duration=1.9",)
PARAMETERS = (
    Parameter("spacing", 0.005, "m", "distance between neighbouring nodes"),
    Parameter("duration", 2.8, "s", "simulated time: three swings"),
    Parameter("young_modulus", 1.4e6, "Pa", "Young's modulus"),
    Parameter("poisson_ratio", 0.4, "-", "Poisson's ratio"),
    Parameter("density", 1000.0, "kg/m³", "density"),
)


def scene(p):
    return Scene(
        shape=Box((LENGTH, THICKNESS), p.spacing),
        material=Elastic(young_modulus=p.young_modulus, poisson_ratio=p.poisson_ratio, density=p.density),
        conditions=[Fixed(edge("left"))],
        body_force=BodyForce((0.0, -GRAVITY)),
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            interval=2e-3,
            probes=(Probe("tip", "m", NodeValue("displacement", (LENGTH, 0.5 * THICKNESS), component=1)),),
            curve=("time", "tip"),
            curve_reference=("lowest of the reference", LOWEST),
            field="von_mises_stress",
        ),
    )


def checks(run):
    """Each swing's lowest point, and the highest after it: how far below the reference the worst of them are."""
    time, tip = run.history["time"], run.history["tip"]
    swings = [(time > k * PERIOD) & (time <= (k + 1) * PERIOD) for k in range(round(time[-1] / PERIOD))]
    lows = np.array([tip[swing].min() for swing in swings])
    highs = np.array([tip[swing & (time > (k + 0.5) * PERIOD)].max() for k, swing in enumerate(swings)])
    return [
        Check("lowest", float(lows[np.argmax(np.abs(lows - LOWEST))]), LOWEST, "m", 0.02),
        Check("highest", float(highs[np.argmax(np.abs(highs - HIGHEST))]), HIGHEST, "m", 2e-3, relative=False),
    ]
