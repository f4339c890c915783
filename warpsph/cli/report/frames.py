"""Frames: whole fields at chosen times, for the figures that show how a case evolves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...simulation.simulation import Simulation

FIELDS = ("position", "velocity", "equivalent_plastic_strain")


class Frames:
    """An observer that keeps fields at the first step at or after each time, and writes them when closed.

    Args:
        simulation: the simulation; time 0 is taken at once.
        times: rising [s].
        path: the NPZ file: `asked`, the times asked for; `time`, those found; a field each, shape (frames, n, …).
    """

    def __init__(self, simulation: Simulation, times: Sequence[float], path: Path):
        self._asked, self._path = tuple(times), path
        self._fields = [name for name in FIELDS if name in simulation.fields()]
        self._found: list[tuple[float, list[np.ndarray]]] = []
        self.observe(simulation)

    def observe(self, simulation: Simulation) -> None:
        """Keep the fields when the next time has come."""
        while len(self._found) < len(self._asked):
            if simulation.time < self._asked[len(self._found)] * (1.0 - 1e-9):
                return
            self._found.append((simulation.time, [simulation.field(name) for name in self._fields]))

    def close(self) -> None:
        """Write the file."""
        columns = {name: np.array([fields[k] for _, fields in self._found]) for k, name in enumerate(self._fields)}
        np.savez(self._path, asked=self._asked, time=[time for time, _ in self._found], **columns)
