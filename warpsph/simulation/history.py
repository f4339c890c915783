"""The history of a run: the scene's probes sampled in time, written as the run goes on."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from .simulation import Simulation


class History:
    """Samples the probes of a scene at its output interval.

    Args:
        simulation: the simulation; sampled at once, then whenever an interval has passed.
        path: CSV file to write, row by row, so that a run that dies leaves what it had.

    Attributes:
        names: column names, `step` and `time` first.
        units: their units.
    """

    def __init__(self, simulation: Simulation, path: Path | None = None):
        output, duration = simulation.scene.output, simulation.scene.duration
        self._probes = output.probes
        self._interval = duration / 400.0 if output.interval is None else output.interval
        self.names = ["step", "time", *(probe.name for probe in self._probes)]
        self.units = ["-", "s", *(probe.unit for probe in self._probes)]
        self._rows: list[list[float]] = []
        self._next = 0.0
        self._file = path.open("w", newline="", encoding="utf-8") if path else None
        self._writer = None if self._file is None else csv.writer(self._file)
        if self._writer:
            self._writer.writerow(f"{n} [{u}]" for n, u in zip(self.names, self.units, strict=True))
        self.observe(simulation)

    def observe(self, simulation: Simulation) -> None:
        """Sample when the interval has passed."""
        if simulation.time < self._next * (1.0 - 1e-9):
            return
        if self._interval > 0.0:
            self._next = (math.floor(simulation.time / self._interval * (1.0 + 1e-9)) + 1) * self._interval
        self.sample(simulation)

    def sample(self, simulation: Simulation) -> None:
        """Sample now, unless this step was sampled already."""
        if self._rows and self._rows[-1][0] == simulation.steps:
            return
        row = [simulation.steps, simulation.time, *(probe.function(simulation) for probe in self._probes)]
        self._rows.append(row)
        if self._writer:
            self._writer.writerow([row[0], *(repr(float(value)) for value in row[1:])])
            self._file.flush()

    def __getitem__(self, name: str) -> np.ndarray:
        """All samples of one column."""
        column = self.names.index(name)
        return np.array([row[column] for row in self._rows])

    def unit(self, name: str) -> str:
        """Unit of a column."""
        return self.units[self.names.index(name)]

    def close(self) -> None:
        """Close the file."""
        if self._file:
            self._file.close()


def read_history(path: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Columns and units of a history file by name; an unfinished last line is left out.

    Raises:
        OSError: there is no such file.
    """
    with path.open(newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file)) or [[]]
    names = [cell.rsplit(" [", 1)[0] for cell in header]
    units = [cell.rsplit(" [", 1)[-1].rstrip("]") for cell in header]
    table = np.array([row for row in rows if len(row) == len(header)], dtype=float).reshape(-1, len(header))
    return dict(zip(names, table.T, strict=True)), dict(zip(names, units, strict=True))
