"""Column of clay that collapses over rough ground, with cells that are made anew as it flows.

It is 2 m wide and high. With γH/c_u of 11.8 it comes to rest with both sides 4.23 m from the middle (4.22 to 4.24
m by an independent program that flips edges, and adds and merges nodes), strained by several hundred per cent. The
ground carries the clay's own strength, and then the clay slips over it.
"""

import numpy as np

from warpsph import (
    BodyForce,
    Box,
    Check,
    Output,
    Parameter,
    PerzynaVonMises,
    Plane,
    Probe,
    Remade,
    Rough,
    Scene,
)

HEIGHT, GRAVITY, RUN_OUT = 2.0, 9.81, 4.23  # [m], [m/s²], [m]
CLAY = PerzynaVonMises(
    young_modulus=1e6, poisson_ratio=0.45, density=1800.0, fluidity=100.0, yield_size=3.0**0.5 * 2993.0
)
PARAMETERS = (
    Parameter("spacing", 0.1, "m", "distance between neighbouring nodes"),
    Parameter("duration", 2.0, "s", "simulated time"),
    Parameter("every", 20, "-", "steps between two looks at the cells"),
    *Parameter.of(CLAY),
)


def scene(p):
    return Scene(
        shape=Box((HEIGHT, HEIGHT), p.spacing, origin=(-0.5 * HEIGHT, 0.0), cells="triangles"),
        material=CLAY.with_parameters(p),
        tools=[Plane((0.0, 0.0), (0.0, 1.0), interface=Rough())],
        body_force=BodyForce((0.0, -GRAVITY)),
        cells=Remade(every=int(p.every)),
        duration=p.duration,
        numerics=p.numerics,
        output=Output(
            probes=(
                Probe("run_out", "m", lambda s: np.abs(s.field("position")[:, 0]).max()),
                Probe("height", "m", lambda s: s.field("position")[:, 1].max()),
            ),
            curve=("time", "run_out"),
            curve_reference=("other program", RUN_OUT),
            field="equivalent_plastic_strain",
        ),
    )


def checks(run):
    """Where it comes to rest, its area, and that the energy is accounted for."""
    simulation, energy = run.simulation, run.simulation.energy()
    area = simulation.present_mesh.with_nodes(simulation.field("position")).cell_volumes().sum()
    unaccounted = abs(energy.unaccounted) / energy.gravity
    return [
        Check("run_out", float(run.history["run_out"][-1]), RUN_OUT, "m", 0.03),
        Check("area", float(area), HEIGHT**2, "m²", 0.002),
        Check("unaccounted", unaccounted, 0.0, "of gravity's work", 1e-3, relative=False),
    ]
