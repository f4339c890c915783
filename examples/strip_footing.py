"""Shallow stratum under a wide strip footing: bearing capacity (Blanc and Pastor 2012, section 6.6).

Half of a stratum 14 m wide and 3 m deep under a smooth rigid footing 2 m wide, plane strain, von Mises. The
footing is pressed down with a velocity that grows linearly. Exact limit load of the whole footing, rate
independent: (2 + π) b Y0/√3 = 89.06 kN/m. `--set hardening=-1e6` softens: the soil then fails along two bands,
a straight one from the footing's edge to the axis of symmetry and a curved one from there to the surface.
"""

import math

import numpy as np

from warpsph import (
    Box,
    Check,
    EdgeForce,
    Fixed,
    Free,
    Linear,
    Output,
    Parameter,
    PerzynaVonMises,
    PrescribedVelocity,
    Probe,
    Roller,
    Scene,
    edge,
    where,
)
from warpsph.analysis import Sampler, trace_ridge

HALF_WIDTH = 1.0  # of the footing [m]
SIZE = (7.0, 3.0)
EDGE = (HALF_WIDTH, SIZE[1])  # of the footing; the curved band turns about it
# Rays from there on which the curved band is looked for [°]: from near the axis of symmetry to the surface, where
# one that grazes the edge nodes is left out; far enough out [m] not to find the crushed soil at the edge itself.
RAYS = np.append(np.arange(-115.0, -4.9, 2.5), 0.0)
NEAREST, FARTHEST = 1.2, 3.0
SMOOTHING = 0.3  # of the strain along a ray [m]

SOIL = PerzynaVonMises(young_modulus=2.5e7, poisson_ratio=0.4, density=2000.0, fluidity=2.0, yield_size=15e3)
PARAMETERS = (
    Parameter("spacing", 0.1, "m", "distance between neighbouring nodes"),
    Parameter("acceleration", 3e-3, "m/s²", "rate at which the footing's velocity grows"),
    Parameter("duration", 3.2, "s", "simulated time"),
    *Parameter.of(SOIL),
)


def limit_load(p):
    """Prandtl's limit load of the whole footing [N per metre]."""
    return (2.0 + math.pi) * 2.0 * HALF_WIDTH * p.yield_size / math.sqrt(3.0)


def scene(p):
    footing = edge("top") & where(lambda x, y: x <= HALF_WIDTH)
    beside = edge("top") & where(lambda x, y: x > HALF_WIDTH)
    half_load = EdgeForce(footing, axis=1)
    return Scene(
        shape=Box(SIZE, p.spacing),
        material=SOIL.with_parameters(p),
        conditions=[
            Roller(edge("left")),
            Roller(edge("right")),
            Fixed(edge("bottom")),
            PrescribedVelocity(footing, (None, Linear(-p.acceleration))),
            Free(beside),
        ],
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            probes=(
                Probe("settlement", "m", lambda s: -s.field("displacement")[s.nearest_node((0.0, SIZE[1])), 1]),
                Probe("load", "N/m", lambda s: 2.0 * half_load(s)),
            ),
            curve=("settlement", "load"),
            curve_reference=("exact limit load", limit_load(p)),
            field="equivalent_plastic_strain",
        ),
    )


def second_band(mesh, strain):
    """The curved band: where ε̄ (n,) is largest on each ray from the footing's edge, in initial positions."""
    strain_at = Sampler(mesh, strain)
    return trace_ridge(strain_at, EDGE, angles=RAYS, nearest=NEAREST, farthest=FARTHEST, smoothing=SMOOTHING)


def checks(run):
    """The mean load once the mechanism has formed (settlements from 9 mm on, t ≥ 2.45 s), and the second band.

    The band reaches the surface when no ray has less than a quarter of its median strain. With softening the load
    falls instead, towards the residual strength.
    """
    p, load, settlement = run.parameters, run.history["load"], run.history["settlement"]
    strain = second_band(run.simulation.mesh, run.simulation.field("equivalent_plastic_strain")).strain
    median = float(np.median(strain))
    reaches = Check("second_band_weakest", float(strain.min()), median, "-", bound=0.75)
    if p.hardening < 0.0:
        left = float(load[-1] / load.max())
        return [reaches, Check("load_left", left, p.residual_ratio, "of the peak", 0.5, relative=False)]
    plateau = settlement >= 0.6 * settlement[-1]
    return [Check("limit_load", float(np.mean(load[plateau])), limit_load(p), "N/m", bound=0.02), reaches]
