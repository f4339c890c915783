"""Block stretched to twice its length and released: it returns to its length without clumping.

A block 1 m long and 0.5 m high, free all around, in plane strain. It starts stretched uniformly to twice its
length, in the state that such a stretch leaves (logarithmic strains, the lattice stretched with it), and is let go
at once. It swings back and, damped, comes to rest at 1 m. By standard SPH (`_standard_sph.py`) the nodes of the
same block clump within two thousandths of a second.
"""

import math

import numpy as np
from _standard_sph import StandardSPH

from warpsph import Box, Check, Elastic, Free, Output, Parameter, Probe, Scene, edge
from warpsph.analysis import checkerboard_amplitude, smallest_distance

SIZE = (1.0, 0.5)  # unstretched [m]
STANDARD_RATIO = 1.1  # h/Δx of standard SPH: the support must reach the next column of the stretched lattice

PARAMETERS = (
    Parameter("spacing", 0.05, "m", "distance between neighbouring nodes, unstretched"),
    Parameter("stretch", 2.0, "-", "length at the start over unstretched length"),
    Parameter("duration", 0.2, "s", "simulated time"),
    Parameter("damping", 600.0, "1/s", "mass-proportional damping"),
    Parameter("young_modulus", 8e7, "Pa", "Young's modulus"),
    Parameter("poisson_ratio", 0.3, "-", "Poisson's ratio"),
    Parameter("density", 2000.0, "kg/m³", "density of the unstretched block"),
)


def contraction(p):
    """Height at the start over unstretched height: ε22 = −ν/(1 − ν) ε11 in plane strain with σ22 = 0."""
    return p.stretch ** (-p.poisson_ratio / (1.0 - p.poisson_ratio))


def scene(p):
    along, across = p.stretch, contraction(p)
    stress = p.young_modulus / (1.0 - p.poisson_ratio**2) * math.log(along)
    return Scene(
        shape=Box(SIZE, p.spacing).mapped(lambda x, y: (along * x, across * y)),
        material=Elastic(
            young_modulus=p.young_modulus,
            poisson_ratio=p.poisson_ratio,
            density=p.density / (along * across),
        ),
        conditions=[Free(edge("boundary"))],
        stress=lambda x, y: (stress, 0.0, 0.0, p.poisson_ratio * stress),
        damping=p.damping,
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            probes=(
                Probe("length", "m", lambda s: length(s.mesh, s.field("position"))),
                Probe("smallest_distance", "m", lambda s: smallest_distance(s.field("position"))),
                Probe("checkerboard", "m/s", lambda s: checkerboard_amplitude(s.mesh, s.field("velocity")[:, 0])),
            ),
            field="mean_stress",
        ),
    )


def length(mesh, positions):
    """Mean distance of the right edge from the left edge [m]."""
    left, right = (positions[edge(name).nodes(mesh), 0].mean() for name in ("left", "right"))
    return float(right - left)


def standard_sph(run_scene, p):
    """The same block by standard SPH: the comparator at the end, and the columns the scene's history has."""
    columns = {"time": [], "length": [], "smallest_distance": [], "checkerboard": []}

    def observe(sph):
        columns["time"].append(sph.time)
        columns["length"].append(length(run_scene.mesh, sph.x))
        columns["smallest_distance"].append(smallest_distance(sph.x))
        columns["checkerboard"].append(checkerboard_amplitude(run_scene.mesh, sph.v[:, 0]))

    sph = StandardSPH(run_scene, STANDARD_RATIO)
    sph.run(p.duration, observe)
    return sph, {name: np.array(values) for name, values in columns.items()}


def checks(run):
    """The length at rest, and the smallest distance of two nodes on the way, which a block 1/λ long may halve."""
    p, history = run.parameters, run.history
    _, standard = standard_sph(run.scene, p)
    cell = p.spacing * contraction(p)  # the distance at the start
    nearest = float(history["smallest_distance"].min() / cell)
    clumped = float(standard["smallest_distance"].min() / cell)
    return [
        Check("length_at_rest", float(history["length"][-1]), SIZE[0], "m", 0.01),
        Check("smallest_distance", nearest, 1.0, "of the start's", 0.5),
        Check("standard_sph_smallest_distance", clumped, 0.0, "of the start's", 0.1, relative=False),
    ]
