"""A block of soil that settles under its own weight."""

# Run it:             warpsph run {name}.py
# What can be set:    warpsph list {name}.py
# With other values:  warpsph run {name}.py --set spacing=0.05 --set density=1800
# All units are SI. Coordinates: x to the right, y upwards; two lengths in the shape's size make it plane strain,
# one a bar, three a solid.

from warpsph import (
    BodyForce,
    Box,
    Check,
    Elastic,
    Fixed,
    Free,
    NodeValue,
    Output,
    Parameter,
    Probe,
    Ramp,
    Roller,
    Scene,
    edge,
)

WIDTH, HEIGHT = 1.0, 1.0  # [m]
GRAVITY = 9.81  # [m/s²]

# What `--set name=value` may change: name, default, unit, meaning.
PARAMETERS = (
    Parameter("spacing", 0.1, "m", "distance between neighbouring nodes"),
    Parameter("duration", 0.4, "s", "simulated time"),
    Parameter("young_modulus", 1e7, "Pa", "Young's modulus"),
    Parameter("poisson_ratio", 0.3, "-", "Poisson's ratio"),
    Parameter("density", 2000.0, "kg/m³", "density"),
)


def scene(p):
    """The scene, from the parameters p."""
    return Scene(
        shape=Box(size=(WIDTH, HEIGHT), spacing=p.spacing),
        # For soil that yields: PerzynaVonMises(…, fluidity=1.0, yield_size=5e3).
        material=Elastic(young_modulus=p.young_modulus, poisson_ratio=p.poisson_ratio, density=p.density),
        # Each edge of the body, or a part of it: edge("top") & where(lambda x, y: x <= 0.5).
        conditions=[
            Fixed(edge("bottom")),
            Roller(edge("left")),
            Roller(edge("right")),
            Free(edge("top")),
            # PrescribedVelocity(edge("top"), (None, Linear(-0.01))) would press the top downwards.
        ],
        body_force=BodyForce((0.0, -GRAVITY), Ramp(0.1)),  # gravity grows for 0.1 s, so that nothing is shaken
        damping=50.0,  # [1/s], brings the block to rest
        duration=p.duration,
        numerics=p.numerics,
        # Probes are the columns of history.csv; the first one is drawn in history.png, the field in field.png.
        output=Output(
            probes=(Probe("settlement", "m", NodeValue("displacement", (0.0, HEIGHT), component=1)),),
            field="displacement",
            component=1,
        ),
    )


def checks(run):
    """What the run is judged by; leave it out when there is no reference.

    At rest, held on both sides: u = −ρ g H²/(2 (λ + 2G)) at the top.
    """
    p, material = run.parameters, run.scene.material
    modulus = material.lame_modulus + 2.0 * material.shear_modulus
    exact = -p.density * GRAVITY * HEIGHT**2 / (2.0 * modulus)
    return [Check("settlement", float(run.history["settlement"][-1]), exact, "m", bound=0.05)]
