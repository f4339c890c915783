"""The one place that builds a simulation, and so the one that knows how a build is given its threads."""

import inspect
import os

from warpsph import Scene, Simulation


def all_cores() -> int:
    """Number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def takes_threads() -> bool:
    """Whether `Simulation` has an option `threads`."""
    return "threads" in inspect.signature(Simulation).parameters


def build(scene: Scene, device: str, precision: str, threads: int) -> Simulation:
    """The simulation, its CPU kernels on that many threads where `takes_threads`, on one where not."""
    options = {"threads": threads} if takes_threads() else {}
    return Simulation(scene, device=device, precision=precision, **options)
