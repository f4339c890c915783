"""Copper rod that hits a rigid wall (Taylor 1948; the benchmark of Kamoulakos 1990).

A rod 32.4 mm long, of the section of a round one with a radius of 3.2 mm but square, hits a smooth wall with
227 m/s. Its foot spreads, and after 80 µs it is at rest and 21.4 mm long (codes agree on 21.2 to 21.7 mm for the
round rod). A quarter of it is computed. `--set dimensions=2` is a plate in plane strain.
"""

import math

import numpy as np

from warpsph import Box, Check, Output, Parameter, PerzynaVonMises, Probe, Roller, Scene, edge, where

LENGTH, RADIUS, SPEED = 32.4e-3, 3.2e-3, 227.0  # [m], [m], [m/s]
WIDTH = 0.5 * math.sqrt(math.pi) * RADIUS  # of a quarter [m]
SHORT = ("spacing=1.4e-3",)
# A fluidity at which the overstress is below one per cent: the benchmark's copper does not depend on the rate.
COPPER = PerzynaVonMises(
    young_modulus=117e9, poisson_ratio=0.35, density=8930.0, fluidity=1e8, yield_size=400e6, hardening=100e6
)
PARAMETERS = (
    Parameter("spacing", 0.7e-3, "m", "distance between neighbouring nodes, roughly: the section has whole cells"),
    Parameter("dimensions", 3, "-", "3, or 2 for plane strain"),
    Parameter("duration", 80e-6, "s", "simulated time"),
    *Parameter.of(COPPER),
)


def scene(p):
    dim = int(p.dimensions)
    spacing = WIDTH / max(2, round(WIDTH / p.spacing))
    height = spacing * round(LENGTH / spacing)

    def stretched(*x):
        return (*x[:-1], x[-1] * LENGTH / height)

    def wall(axis):
        normal = tuple(-1.0 if k == axis else 0.0 for k in range(dim))
        return Roller(edge("boundary") & where(lambda *x: np.abs(x[axis]) < 1e-9), normal=normal)

    return Scene(
        shape=Box((*(WIDTH,) * (dim - 1), height), spacing).mapped(stretched),
        material=COPPER.with_parameters(p),
        conditions=[wall(axis) for axis in range(dim)],
        velocity=lambda *x: (*(0.0 * x[0],) * (dim - 1), -SPEED + 0.0 * x[0]),
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            probes=(
                Probe("length", "m", lambda s: s.field("position")[:, -1].max()),
                Probe("foot", "m", lambda s: s.field("position")[:, 0].max()),
                Probe("largest_strain", "-", lambda s: s.field("equivalent_plastic_strain").max()),
            ),
            curve=("time", "length"),
            curve_reference=("benchmark", 21.4e-3),
            field="equivalent_plastic_strain",
        ),
    )


def checks(run):
    """The length that is left (of a rod), and that the energy is accounted for."""
    energy = run.simulation.energy()
    books = Check(
        "unaccounted", abs(energy.unaccounted) / energy.largest, 0.0, "of the energy", 0.01, relative=False
    )
    if run.parameters.dimensions == 2:
        return [books]
    return [Check("length", float(run.history["length"][-1]), 21.4e-3, "m", 0.02), books]
