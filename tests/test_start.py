"""What a start must not take: kernels that were compiled serve every scene that needs the same code."""

import pytest

from warpsph import Box, Elastic, Fixed, Numerics, Scene, Simulation, edge
from warpsph.step import cells

SOFT = {"young_modulus": 1e6, "poisson_ratio": 0.3, "density": 2000.0}
PLATE = Box((1.0, 0.5), 0.25)


def scene_with(**changes):
    given = {"shape": PLATE, "material": Elastic(**SOFT), "conditions": [Fixed(edge("bottom"))], "duration": 1.0}
    return Scene(**given | changes)


@pytest.fixture
def loaded(monkeypatch):
    """The kernels that a simulation of a scene loads."""
    taken = []
    load = cells.load_kernels
    monkeypatch.setattr(
        cells, "load_kernels", lambda kernels, device: (taken.append(kernels), load(kernels, device))
    )

    def kernels_of(scene):
        Simulation(scene, device="cpu", threads=1)
        return set(taken.pop())

    return kernels_of


@pytest.mark.parametrize(
    "changes",
    [
        {"numerics": Numerics(courant=0.5)},
        {"numerics": Numerics(sharpening=0.3)},
        {"shape": PLATE.mapped(lambda x, y: (x + 0.1 * y, 1.1 * y))},
        {"material": Elastic(**SOFT | {"density": 1500.0})},
        {"damping": 2.0, "duration": 2.0},
    ],
    ids=lambda changes: ", ".join(changes),
)
def test_numbers_of_a_scene_are_not_compiled_into_kernels(loaded, changes):
    """Else a kernel is compiled for each of them, and Warp's cache, which tells numbers apart in single precision,
    may give one scene the kernel of another."""
    assert loaded(scene_with(**changes)) == loaded(scene_with())
