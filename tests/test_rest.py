"""Bodies at rest stay there: soil under its weight for ever, and what has come to rest does not creep."""

import numpy as np
import pytest

from tests.test_conjugate_cells import BODIES
from warpsph import BodyForce, Box, Elastic, Fixed, PerzynaVonMises, Ramp, Roller, Scene, Simulation, edge

GRAVITY = 9.81
SOIL = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=2000.0)


def column(kind, damping):
    """Soil 1 m high between smooth walls, with the linear stresses at rest that balance its weight exactly."""
    dim, cells = BODIES[kind]
    k0 = SOIL.poisson_ratio / (1.0 - SOIL.poisson_ratio)

    def at_rest(*x):
        down = -SOIL.density * GRAVITY * (1.0 - x[-1])
        rest = 0.0 * down
        return (k0 * down, down, rest, k0 * down) if dim == 2 else (k0 * down, k0 * down, down, rest, rest, rest)

    sides = ("left", "right", "front", "back")[: 2 * (dim - 1)]
    scene = Scene(
        shape=Box((*(0.5,) * (dim - 1), 1.0), 0.1 if dim == 2 else 0.25, cells=cells),
        material=SOIL,
        conditions=[Fixed(edge("bottom")), *(Roller(edge(side)) for side in sides)],
        body_force=BodyForce((*(0.0,) * (dim - 1), -GRAVITY)),
        damping=damping,
        stress=at_rest,
        duration=1e9,
    )
    return Simulation(scene, device="cpu")


def assert_column_rests(simulation, steps):
    stress = simulation.field("stress").copy()
    simulation.run(until=steps * simulation.time_step_limit)
    dim = simulation.mesh.dim
    assert np.abs(simulation.field("velocity")).max() <= 1e-12 * GRAVITY * simulation.time
    assert simulation.field("stress") == pytest.approx(stress, abs=1e-10 * np.abs(stress).max())
    weight = SOIL.density * GRAVITY * 0.5 ** (dim - 1)
    assert simulation.stepper.reactions.numpy()[:, dim - 1].sum() == pytest.approx(weight, rel=1e-10)


@pytest.mark.parametrize("damping", [0.0, 20.0])
@pytest.mark.parametrize("kind", ["quads", "triangles", "hexahedra", "tetrahedra"])
def test_soil_at_rest_stays_at_rest(kind, damping):
    assert_column_rests(column(kind, damping), 2000)


@pytest.mark.long
@pytest.mark.parametrize("damping", [0.0, 20.0])
@pytest.mark.parametrize("kind", ["quads", "triangles", "hexahedra", "tetrahedra"])
def test_soil_at_rest_stays_at_rest_for_a_million_steps(kind, damping):
    """Stresses drift by 2e-13 of the largest, speeds stay below 3e-16 m/s."""
    assert_column_rests(column(kind, damping), 1_000_000)


BARS = {"hung": ((0.2, 1.0), "top"), "pressed": ((0.2, 1.0), "bottom"), "bent": ((1.0, 0.2), "left")}


def bar(case):
    """A soft bar that its weight deflects by up to a tenth of its length."""
    size, clamped = BARS[case]
    return {"shape": size, "material": SOIL, "conditions": [Fixed(edge(clamped))]}


def yielding_column():
    """Half of a block of clay, 1 m high: γH/c_u = 3.4 of the 3.78 at which a vertical face of it fails."""
    clay = PerzynaVonMises(young_modulus=1e6, poisson_ratio=0.3, density=1000.0, fluidity=10.0, yield_size=5e3)
    return {
        "shape": (1.0, 1.0),
        "material": clay,
        "conditions": [Fixed(edge("bottom")), Roller(edge("left"))],
    }


@pytest.mark.parametrize("cells", ["lattice", "triangles"])
@pytest.mark.parametrize("case", [*BARS, "yielding"])
def test_what_has_come_to_rest_does_not_creep(case, cells):
    """A step moves it by less than 1e-9 of its deflection: by rounding."""
    given = yielding_column() if case == "yielding" else bar(case)
    given["shape"] = Box(given["shape"], 0.1, cells=cells)
    scene = Scene(**given, body_force=BodyForce((0.0, -GRAVITY), Ramp(0.5)), damping=20.0, duration=1e9)
    simulation = Simulation(scene, device="cpu")
    simulation.run(until=20.0)
    deflection, steps = simulation.field("displacement").copy(), simulation.steps
    simulation.run(until=25.0)
    crept = np.abs(simulation.field("displacement") - deflection).max() / (simulation.steps - steps)
    assert crept <= 1e-9 * np.abs(deflection).max()
    assert np.abs(simulation.field("velocity")).max() <= 1e-12 * GRAVITY * simulation.time
    if case == "yielding":
        assert simulation.field("equivalent_plastic_strain").max() > 0.005
