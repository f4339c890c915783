"""Slope of very low cohesion that flows under gravity (Blanc and Pastor 2012, section 6.4).

A vertical slope 4 m long and 2 m high, plane strain, Perzyna and von Mises with Y0 = 2 kPa. Gravity grows over
1 s, a damping −50 v stands for the paper's artificial viscosity. For 35 s the soil flows out to the right like a
viscous fluid. The paper's toe moved 1.5 m; the run-out depends on the damping, with the published scheme on the
time step as well, and is reported, not tuned.
"""

import numpy as np

from warpsph import (
    BodyForce,
    Box,
    Check,
    FreeSurface,
    NodeValue,
    Output,
    Parameter,
    PerzynaVonMises,
    Probe,
    Ramp,
    Roller,
    Scene,
    edge,
)

SIZE = (4.0, 2.0)
TOE, CREST = (4.0, 0.0), (4.0, 2.0)

SHORT = ("spacing=0.2", "duration=5")
SOIL = PerzynaVonMises(young_modulus=8e7, poisson_ratio=0.3, density=2000.0, fluidity=1.0, yield_size=2e3)
PARAMETERS = (
    Parameter("spacing", 0.1, "m", "distance between neighbouring nodes"),
    Parameter("duration", 35.0, "s", "simulated time"),
    Parameter("damping", 50.0, "1/s", "mass-proportional damping"),
    *Parameter.of(SOIL),
)


def scene(p):
    return Scene(
        shape=Box(SIZE, p.spacing),
        material=SOIL.with_parameters(p),
        conditions=[Roller(edge("left")), Roller(edge("bottom"))],
        free_surface=FreeSurface() if p.numerics.scheme.sums else None,  # free edges cost cells nothing
        body_force=BodyForce((0.0, -9.81), Ramp(1.0)),
        damping=p.damping,
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            probes=(
                Probe("toe", "m", NodeValue("displacement", TOE, component=0)),
                Probe("crest_right", "m", NodeValue("displacement", CREST, component=0)),
                Probe("crest_down", "m", lambda s: -s.field("displacement")[s.nearest_node(CREST), 1]),
                Probe("largest_strain", "-", lambda s: s.field("equivalent_plastic_strain").max()),
            ),
            field="equivalent_plastic_strain",
        ),
    )


def checks(run):
    """What holds whatever the run-out: the soil keeps its area, and moves most at the toe, as in the paper."""
    simulation = run.simulation
    area = simulation.mesh.with_nodes(simulation.field("position")).cell_volumes().sum()
    moved = np.linalg.norm(simulation.field("displacement"), axis=1)
    toe = moved[simulation.nearest_node(TOE)]
    return [
        Check("area", float(area), SIZE[0] * SIZE[1], "m²", 0.01),
        Check("toe_over_largest_displacement", float(toe / moved.max()), 1.0, "-", 0.05),
    ]
