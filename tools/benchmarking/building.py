"""The one place that builds a simulation."""

from warpsph import Scene, Simulation


def build(scene: Scene, device: str, precision: str, threads: int) -> Simulation:
    """The simulation, its CPU kernels on that many threads."""
    return Simulation(scene, device=device, precision=precision, threads=threads)
