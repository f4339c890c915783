"""Block held in tension with one perturbed node: no tensile instability, in contrast to standard SPH.

A square block in plane strain, its edge held, under uniform tension. The node in the middle is displaced by a
ten-thousandth of the spacing and kicked. By standard SPH (`_standard_sph.py`: the same nodes, the same smoothing
function, stresses at the same nodes) the disturbance grows exponentially and the nodes clump; by the two node sets
it does not grow. Clumping is told by the growth of the displacements and the smallest distance of two nodes,
hourglassing by the checkerboard of the velocity, which needs no tension (`--set strain=0`).
"""

import numpy as np
from _standard_sph import StandardSPH, alternating_growth_rate

from warpsph import Box, Check, Elastic, Fixed, Output, Parameter, Probe, Scene, edge
from warpsph.analysis import checkerboard_amplitude, growth_rate, smallest_distance

SIZE = 1.0  # [m]
DISPLACED, KICK = 1e-4, 1e-3  # of the middle node: displacement over spacing, velocity [m/s]
STANDARD_RATIO = 0.6  # h/Δx of standard SPH

PARAMETERS = (
    Parameter("spacing", 0.1, "m", "distance between neighbouring nodes"),
    Parameter("strain", 0.05, "-", "strain of the block in both directions; negative compresses"),
    Parameter("duration", 0.02, "s", "simulated time"),
    Parameter("young_modulus", 8e7, "Pa", "Young's modulus"),
    Parameter("poisson_ratio", 0.3, "-", "Poisson's ratio"),
    Parameter("density", 2000.0, "kg/m³", "density"),
)


def material(p):
    return Elastic(young_modulus=p.young_modulus, poisson_ratio=p.poisson_ratio, density=p.density)


def tension(p):
    """σ11 = σ22 [Pa] at equal strains in both directions of the plane."""
    return 2.0 * (material(p).lame_modulus + material(p).shear_modulus) * p.strain


def scene(p):
    stress, along_z = tension(p), 2.0 * material(p).lame_modulus * p.strain
    middle = p.spacing * round(0.5 * SIZE / p.spacing)

    def perturbed(x, y):
        return np.hypot(x - middle, y - middle) < 0.1 * p.spacing

    return Scene(
        shape=Box((SIZE, SIZE), p.spacing).mapped(
            lambda x, y: (x + np.where(perturbed(x, y), DISPLACED * p.spacing, 0.0), y)
        ),
        material=material(p),
        conditions=[Fixed(edge("boundary"))],
        stress=lambda x, y: (stress, stress, 0.0, along_z),
        velocity=lambda x, y: (np.where(perturbed(x, y), KICK, 0.0), 0.0),
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            interval=0.0,
            probes=(
                Probe("departure", "m", lambda s: departure(s.field("position"), p.spacing)),
                Probe("smallest_distance", "m", lambda s: smallest_distance(s.field("position"))),
                Probe("checkerboard", "m/s", lambda s: checkerboard_amplitude(s.mesh, s.field("velocity")[:, 0])),
            ),
            field="velocity",
        ),
    )


def departure(positions, spacing):
    """RMS distance of the nodes from the regular lattice [m]."""
    return float(np.sqrt(np.mean(np.sum((positions - spacing * np.rint(positions / spacing)) ** 2, axis=1))))


def standard_sph(run_scene, p):
    """The same block by standard SPH: the comparator at the end, and the columns the scene's history has."""
    columns = {"time": [], "departure": [], "smallest_distance": [], "checkerboard": []}

    def observe(sph):
        columns["time"].append(sph.time)
        columns["departure"].append(departure(sph.x, p.spacing))
        columns["smallest_distance"].append(smallest_distance(sph.x))
        columns["checkerboard"].append(checkerboard_amplitude(run_scene.mesh, sph.v[:, 0]))

    sph = StandardSPH(run_scene, STANDARD_RATIO)
    sph.run(p.duration, observe)
    return sph, {name: np.array(values) for name, values in columns.items()}


def growth(history, p):
    """Growth rate of the disturbance [1/s], between 0.01 and 1 % of the spacing."""
    return growth_rate(history["time"], history["departure"], low=1e-4 * p.spacing, high=1e-2 * p.spacing)


def checks(run):
    p = run.parameters
    _, standard = standard_sph(run.scene, p)
    distance = run.history["smallest_distance"].min() / p.spacing
    found = [
        Check("growth_rate", growth(run.history, p), 0.0, "1/s", 1.0, relative=False),
        Check("smallest_distance", float(distance), 1.0 - DISPLACED, "of Δx", 0.01),
    ]
    if p.strain > 0.0:
        theory = alternating_growth_rate(p.spacing, STANDARD_RATIO * p.spacing, tension(p), p.density)
        clumped = float(standard["smallest_distance"].min() / p.spacing)
        found += [
            Check("standard_sph_growth_rate", growth(standard, p), theory, "1/s", 0.2),
            Check("standard_sph_smallest_distance", clumped, 0.0, "of Δx", 0.8, relative=False),
        ]
    return found
