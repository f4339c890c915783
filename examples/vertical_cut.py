"""Vertical cut under a rigid footing: limit load and shear band (Blanc and Pastor 2012, section 6.5).

A cut 10 m high and 10 m long, plane strain, von Mises, without gravity; a smooth rigid footing on its right half
is pressed down with a velocity that grows linearly. Exact limit load, rate independent: 2 b Y0/√3 = 1154.7 N/m, by
one straight band at 45° from the footing's left end to the middle of the cut. `--set hardening=-1e3` softens.

The load is pressed onto nodes, which the sliding block carries outwards by about the settlement s: the width they
cover grows from b to b + s, and with it the exact load. The checks refer the load to the footing's width b.
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
from warpsph.analysis import fit_band

SIZE = (10.0, 10.0)
WIDTH = 5.0  # of the footing [m]
MECHANISM = (0.05, 0.15)  # settlements between which the mechanism stands and the shape has hardly changed [m]

SOIL = PerzynaVonMises(young_modulus=1e5, poisson_ratio=0.35, density=2000.0, fluidity=2.0, yield_size=200.0)
PARAMETERS = (
    Parameter("spacing", 0.5, "m", "distance between neighbouring nodes"),
    Parameter("acceleration", 3e-5, "m/s²", "rate at which the footing's velocity grows"),
    Parameter("settlement", 0.45, "m", "settlement of the footing at the end"),
    *Parameter.of(SOIL),
)


def limit_load(p):
    """Exact limit load [N per metre]."""
    return 2.0 * WIDTH * p.yield_size / math.sqrt(3.0)


def scene(p):
    footing = edge("top") & where(lambda x, y: x >= SIZE[0] - WIDTH)
    beside = edge("top") & where(lambda x, y: x < SIZE[0] - WIDTH)
    return Scene(
        shape=Box(SIZE, p.spacing),
        material=SOIL.with_parameters(p),
        conditions=[
            Roller(edge("left")),
            Fixed(edge("bottom")),
            Free(edge("right")),
            PrescribedVelocity(footing, (None, Linear(-p.acceleration))),
            Roller(beside),
        ],
        duration=math.sqrt(2.0 * p.settlement / p.acceleration),
        numerics=p.numerics,
        output=Output(
            probes=(
                Probe("settlement", "m", lambda s: -s.field("displacement")[s.nearest_node(SIZE), 1]),
                Probe("load", "N/m", EdgeForce(footing, axis=1)),
                Probe("width", "m", lambda s: width(s.mesh, s.field("position"))),
                Probe("band_angle", "°", lambda s: angle(s.mesh, s.field("equivalent_plastic_strain"))),
            ),
            curve=("settlement", "load"),
            curve_reference=("exact limit load", limit_load(p)),
            field="equivalent_plastic_strain",
        ),
    )


def width(mesh, positions):
    """Width that the footing's nodes now cover [m]."""
    x = positions[(edge("top") & where(lambda x, y: x >= SIZE[0] - WIDTH)).nodes(mesh), 0]
    return float(x.max() - x.min())


def band(mesh, strain):
    """The shear band, fitted to the strain ε̄ (n,) of the interior nodes where they were initially.

    Edge nodes are left out: ε̄ peaks where the band meets the footing's end.
    """
    inside = ~edge("boundary").nodes(mesh)
    return fit_band(mesh.nodes[inside], strain[inside])


def angle(mesh, strain):
    """Angle of the band to the horizontal [°]; 0 while nothing flows."""
    return abs(band(mesh, strain).angle) if strain.max() > 0.0 else 0.0


def checks(run):
    """The limit load over the footing's width, and the band's angle while the mechanism stands.

    Later the soil that has passed through the band turns the fit, which is made in initial positions.
    The largest ε̄ (the paper's is 0.73) is none of them: it is in one node, where the band meets an edge, and grows
    as the spacing falls. There is no exact value.
    """
    p, settlement = run.parameters, run.history["settlement"]
    load = run.history["load"] * WIDTH / run.history["width"]
    formed = (settlement >= MECHANISM[0]) & (settlement <= MECHANISM[1])
    mean_angle = float(run.history["band_angle"][formed].mean())
    steepness = Check("band_angle", mean_angle, 45.0, "°", 1.0, relative=False)
    if p.hardening < 0.0:
        left = float(load[-1] / load.max())
        return [steepness, Check("load_left", left, p.residual_ratio, "of the peak", 0.5, relative=False)]
    return [
        Check("limit_load", float(np.mean(load[formed])), limit_load(p), "N/m", bound=0.02),
        Check("highest_load", float(np.max(load[formed])), limit_load(p), "N/m", bound=0.03),
        steepness,
    ]
