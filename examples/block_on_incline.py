"""Block on an incline: it slides by ½ g t² (sin θ − μ cos θ), or sticks where μ ≥ tan θ.

An elastic block without damping stands on rough rigid ground under 30° and is let go at t = 0. Its sides lie along
the force that the ground takes up, (μ, −1) times the weight across the incline, or along the weight where it
sticks: then it is in uniaxial stress, and at rest from the start. x is along the incline, downwards.

Friction follows the pressure with a `lag` of the time that waves need along the block. With `--set lag=0` the law
of Coulomb itself makes waves grow: near the limit they shake the block within a second, parts of it stick and lift
in turn, and it slides too far.
"""

import math

from warpsph import (
    BodyForce,
    Box,
    Check,
    Coulomb,
    Elastic,
    Output,
    Parameter,
    Plane,
    Probe,
    Scene,
    ToolForce,
)

LENGTH, HEIGHT = 0.4, 0.1  # [m]
GRAVITY, ANGLE = 9.81, math.radians(30.0)  # [m/s²], of the incline
PARAMETERS = (
    Parameter("spacing", 0.05, "m", "distance between neighbouring nodes"),
    Parameter("friction", 0.9, "-", "μ over tan θ: from 1 on it sticks"),
    Parameter("lag", 5e-3, "s", "by which friction follows the pressure"),
    Parameter("duration", 1.0, "s", "simulated time"),
    Parameter("young_modulus", 1e7, "Pa", "Young's modulus"),
)


def scene(p):
    block = Elastic(young_modulus=p.young_modulus, poisson_ratio=0.3, density=2000.0)
    lean = math.tan(ANGLE) * min(p.friction, 1.0)  # of the sides, and of the force on the ground
    weight = block.density * GRAVITY * math.cos(ANGLE)

    def stress(x, y):
        across = -weight * (HEIGHT - y)
        return across * lean**2, across, -across * lean, block.poisson_ratio * across * (1.0 + lean**2)

    ground = Coulomb(p.friction * math.tan(ANGLE), p.lag)
    return Scene(
        shape=Box((LENGTH, HEIGHT), p.spacing).mapped(lambda x, y: (x + lean * (HEIGHT - y), y)),
        material=block,
        stress=stress,
        tools=[Plane((0.0, 0.0), (0.0, 1.0), interface=ground, name="ground")],
        body_force=BodyForce((GRAVITY * math.sin(ANGLE), -GRAVITY * math.cos(ANGLE))),
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            probes=(
                Probe("slip", "m", slip),
                Probe("friction", "N/m", ToolForce("ground", axis=0)),
                Probe("pressure", "N/m", ToolForce("ground", axis=1)),
            ),
            curve=("time", "slip"),
            field="displacement",
        ),
    )


def slip(simulation):
    """How far the middle of mass has come along the incline [m]."""
    mass = simulation.field("mass")
    return mass @ simulation.field("displacement")[:, 0] / mass.sum()


def exact(p, time):
    """The same of a rigid block [m]."""
    return 0.5 * GRAVITY * math.sin(ANGLE) * max(0.0, 1.0 - p.friction) * time**2


def checks(run):
    """How far it came, that nothing is in the ground, and that the energy is accounted for."""
    energy, spacing = run.simulation.energy(), run.parameters.spacing
    far, depth = float(run.history["slip"][-1]), -float(run.simulation.field("position")[:, 1].min())
    reference = exact(run.parameters, run.simulation.time)
    if reference > 0.0:
        moved = Check("slip", far, reference, "m", 1e-3)
    else:
        moved = Check("slip", far, 0.0, "m", 1e-6 * spacing, relative=False)
    inside = Check("depth", max(0.0, depth), 0.0, "m", 1e-3 * spacing, relative=False)
    missing = abs(energy.unaccounted) / energy.largest
    return [moved, inside, Check("unaccounted", missing, 0.0, "of the energy", 1e-3, relative=False)]
