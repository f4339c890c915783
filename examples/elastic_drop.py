"""Elastic disc that bounces on rigid ground: no energy is made, and little is lost.

A disc of 1 m falls from a hand's breadth and bounces ten times. What it loses where it lands is the motion of the
nodes that touch the ground, and what viscosity takes of the finest waves: less on finer lattices. More and more of
the energy goes into vibrations, which bounce with it.
"""

import numpy as np

from warpsph import (
    BodyForce,
    Check,
    Disc,
    Elastic,
    Output,
    Parameter,
    Plane,
    Probe,
    Scene,
    ToolForce,
    ToolImpulse,
)

RADIUS, HEIGHT, GRAVITY = 0.5, 0.05, 9.81  # [m], [m], [m/s²]
SHORT = ("spacing=0.025", "duration=0.6")
PARAMETERS = (
    Parameter("spacing", 0.0125, "m", "distance between neighbouring nodes"),
    Parameter("duration", 2.5, "s", "simulated time"),
    Parameter("young_modulus", 1e7, "Pa", "Young's modulus"),
    Parameter("poisson_ratio", 0.3, "-", "Poisson's ratio"),
    Parameter("density", 1000.0, "kg/m³", "density"),
)


def scene(p):
    disc = Disc(RADIUS, p.spacing)
    lowest = disc.mesh().nodes[:, 1].min()
    return Scene(
        shape=disc,
        material=Elastic(young_modulus=p.young_modulus, poisson_ratio=p.poisson_ratio, density=p.density),
        tools=[Plane((0.0, lowest - HEIGHT), (0.0, 1.0), name="ground")],
        body_force=BodyForce((0.0, -GRAVITY)),
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            interval=1e-3,
            probes=(
                Probe("height", "m", height),
                Probe("gap", "m", lambda s: float(s.field("position")[:, 1].min() - lowest + HEIGHT)),
                Probe("force", "N/m", ToolForce("ground", axis=1)),
                Probe("impulse", "N s/m", ToolImpulse("ground", axis=1)),
            ),
            curve=("time", "height"),
            component=1,
        ),
    )


def height(simulation):
    """How far the middle of mass is above where it began [m]."""
    mass = simulation.field("mass")
    return mass @ simulation.field("displacement")[:, 1] / mass.sum()


def bounces(history):
    """Rows at which it has left the ground again."""
    flies = np.diff(history["impulse"], append=0.0) == 0.0
    return np.flatnonzero(flies[1:] & ~flies[:-1]) + 1


def checks(run):
    """Energy: kept at the first bounce to 2 %, never made, accounted for; and nothing is in the ground."""
    history, spacing = run.history, run.parameters.spacing
    fallen = run.simulation.field("mass").sum() * GRAVITY * HEIGHT
    energy = history["energy.kinetic"] + history["energy.elastic"] - history["energy.gravity"] + fallen
    first = bounces(history)[0]
    made = np.max(energy - np.minimum.accumulate(energy)) / fallen
    missing = np.abs(history["energy.unaccounted"]).max() / fallen
    depth = max(0.0, -history["gap"].min())
    return [
        Check("kept_by_a_bounce", float(energy[first] / fallen), 1.0, "of the energy", 0.02),
        Check("made", float(made), 0.0, "of the energy", 2e-3, relative=False),
        Check("unaccounted", float(missing), 0.0, "of the energy", 0.02, relative=False),
        Check("depth", float(depth), 0.0, "m", 1e-3 * spacing, relative=False),
    ]
