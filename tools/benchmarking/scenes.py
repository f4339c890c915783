"""The scenes that are timed: a body that flies through space and shears, with the default numerics."""

from dataclasses import dataclass

from warpsph import Box, Elastic, Free, Material, Numerics, PerzynaVonMises, Scene, edge

TRAVEL = 1.0 / 320.0  # of the body in a step, in spacings
SHEAR = 0.5  # difference in velocity between the body's ends over its mean velocity
YIELD_SIZE = 5e3  # [Pa]

SOIL = {"young_modulus": 8e7, "poisson_ratio": 0.3, "density": 2000.0}
MATERIALS: dict[str, Material] = {
    "elastic": Elastic(**SOIL),
    "viscoplastic": PerzynaVonMises(**SOIL, fluidity=1.0, yield_size=YIELD_SIZE),
}


@dataclass(frozen=True)
class Case:
    """One configuration to time.

    Attributes:
        dimension: 1, 2 or 3.
        material: a name in `MATERIALS`.
        precision: float32 or float64.
        device: Warp device name.
        threads: threads that run a kernel, on a CPU.
        nodes: number of material nodes asked for; the lattice has about as many.
    """

    dimension: int
    material: str
    precision: str
    device: str
    threads: int
    nodes: int

    def __str__(self) -> str:
        where = self.device if self.device != "cpu" else f"cpu, {self.threads} thread(s)"
        return f"{self.dimension}D {self.material} {self.precision} on {where}, {self.nodes} nodes"


def scene(case: Case) -> Scene:
    """A cube of 1 m in the case's dimension, all its edges free, at the verge of yielding and shearing on.

    Flow is active everywhere from the first steps on, as in a body that fails; one sub-step of the default source
    scheme suffices at every size.
    """
    cells = max(2, round(case.nodes ** (1.0 / case.dimension)) - 1)
    spacing, material = 1.0 / cells, MATERIALS[case.material]
    time_step = Numerics().courant * spacing / material.wave_speed(case.dimension)
    speed = TRAVEL * spacing / time_step
    return Scene(
        name=str(case),
        shape=Box(size=(1.0,) * case.dimension, spacing=spacing),
        material=material,
        conditions=[Free(edge("boundary"))],
        velocity=lambda *x: (speed * (1.0 + SHEAR * (x[-1] - 0.5)), *(0.0 for _ in x[1:])),
        stress=lambda *x: _at_yield(case.dimension),
        duration=1.0,
    )


def _at_yield(dimension: int) -> tuple[float, ...]:
    """The stored stresses that the motion above goes on to raise: tension in a bar, else the shear σ1d."""
    shear = YIELD_SIZE / 3.0**0.5
    return {1: (YIELD_SIZE,), 2: (0.0, 0.0, shear, 0.0), 3: (0.0, 0.0, 0.0, 0.0, shear, 0.0)}[dimension]
