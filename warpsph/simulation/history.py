"""The history of a run: the scene's probes and its energies sampled in time, written as the run goes on."""

from __future__ import annotations

import contextlib
import csv
import hashlib
import io
import math
import os
import re
import sys
from array import array
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from ..scene.output import ENERGY_COLUMN
from ..state.energy import COLUMNS, UNITS
from ..storage.files import whole
from ..storage.reading import reading, require
from .simulation import Simulation


class History:
    """Samples the probes of a scene, and its energy balance where there is one, at its output interval.

    Args:
        simulation: the simulation; sampled at once, then whenever an interval has passed.
        path: CSV file to write, row by row, so that a run that dies leaves what it had. A disk that is full does
            not end the run: what could not be written waits for the next row.
        state: what `state` gave, to go on from there; `simulation` is then not sampled at once.

    Attributes:
        names: column names, `step` and `time` first, then the probes', then `energy.kinetic` and the others.
        next_time: when the next sample is due [s].
        units: their units.

    >>> from warpsph import Box, Elastic, NodeValue, Output, Probe, Scene, Simulation
    >>> scene = Scene(
    ...     shape=Box((1.0,), 0.1),
    ...     material=Elastic(young_modulus=8e7, density=2000.0),
    ...     velocity=lambda x: 0.5,
    ...     duration=1e-3,
    ...     output=Output(interval=0.0, probes=(Probe("u", "m", NodeValue("displacement", (1.0,))),)),
    ... )
    >>> simulation = Simulation(scene, device="cpu")
    >>> history = History(simulation)
    >>> simulation.run(observers=[history])
    >>> history["time"].size == simulation.steps + 1, round(float(history["u"][-1]), 9)
    (True, 0.0005)
    """

    def __init__(self, simulation: Simulation, path: Path | None = None, state: Mapping | None = None):
        output, duration = simulation.scene.output, simulation.scene.duration
        self._probes = output.probes
        self._interval = duration / 400.0 if output.interval is None else output.interval
        columns = columns_of(simulation)
        self.names, self.units = list(columns), list(columns.values())
        self._values = array("d")  # row after row, in few bytes: a run may have millions
        self.next_time = -math.inf  # of the simulation [s], when to sample next
        if state is not None:
            self._values.extend(state["rows"].ravel())
            self.next_time = float(state["next"])
        header = [f"{n} [{u}]" for n, u in zip(self.names, self.units, strict=True)]
        written = _encoded([header, *map(_texts, self._table().tolist())])
        self._hash = hashlib.sha256(written)
        self._file = None if path is None else _Rows(path, written)
        if state is None:
            self.observe(simulation)

    def observe(self, simulation: Simulation) -> None:
        """Sample when the interval has passed."""
        if simulation.time < self.next_time:
            return
        if self._interval > 0.0:
            following = (math.floor(simulation.time / self._interval * (1.0 + 1e-9)) + 1) * self._interval
            self.next_time = following * (1.0 - 1e-9)
        self.sample(simulation)

    def sample(self, simulation: Simulation) -> None:
        """Sample now, unless this step was sampled already."""
        if self._values and self._values[-len(self.names)] == simulation.steps:
            return
        row = [simulation.steps, simulation.time, *(probe.sample(simulation) for probe in self._probes)]
        balance = simulation.energy()
        row += [] if balance is None else balance.columns().values()
        self._values.extend(row)
        written = _encoded([_texts(row)])
        self._hash.update(written)
        if self._file:
            self._file.write(written)

    @property
    def digest(self) -> str:
        """SHA-256 of the file as it is when every row is in it, as hexadecimal digits."""
        return self._hash.hexdigest()

    def state(self) -> dict[str, np.ndarray]:
        """All that is needed to go on: the rows, and when to sample next [s]."""
        return {"rows": self._table(), "next": np.array(self.next_time)}

    def _table(self) -> np.ndarray:
        return np.array(self._values).reshape(-1, len(self.names))

    def __getitem__(self, name: str) -> np.ndarray:
        """All samples of one column."""
        values = self._table()[:, self.names.index(name)].copy()
        return values.astype(int) if name == "step" else values

    def unit(self, name: str) -> str:
        """Unit of a column."""
        return self.units[self.names.index(name)]

    def close(self) -> None:
        """Close the file."""
        if self._file:
            self._file.close()


def columns_of(simulation: Simulation) -> dict[str, str]:
    """The columns of a simulation's history, name → unit."""
    probes = {probe.name: probe.unit for probe in simulation.scene.output.probes}
    unit = UNITS[simulation.mesh.dim]
    energies = {} if simulation.energy() is None else {ENERGY_COLUMN + name: unit for name in COLUMNS}
    return {"step": "-", "time": "s"} | probes | energies


def _texts(row: list[float]) -> list:
    return [int(row[0]), *(repr(float(value)) for value in row[1:])]


def _encoded(rows: Iterable[list]) -> bytes:
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    return text.getvalue().encode("utf-8")


class _Rows:
    """A CSV file that always ends with a whole row, also where the disk fills up.

    It takes the place of a former one when its first rows are in it.

    Raises:
        OSError: the disk does not take them; a former one is then as it was.
    """

    def __init__(self, path: Path, rows: bytes):
        self._path, self._waiting, self._end, self._failed = path, rows, 0, False
        with whole(path) as temporary:
            self._file = temporary.open("wb", buffering=0)
            try:
                self._put()
            except OSError:
                self._file.close()
                raise

    def write(self, rows: bytes) -> None:
        """Add whole rows; those that the disk does not take are kept for the next time."""
        self._waiting += rows
        self._flush()

    def _put(self) -> None:
        left = self._waiting
        while left:
            left = left[self._file.write(left) :]
        self._end, self._waiting = self._end + len(self._waiting), b""

    def _flush(self) -> None:
        try:
            self._put()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.truncate(self._end)
                self._file.seek(self._end)
            if not self._failed:
                print(f"warpsph: {self._path} can not be written now ({error.strerror})", file=sys.stderr)
            self._failed = True

    def close(self) -> None:
        """Try once more what is waiting, and say so when it is lost."""
        self._flush()
        if self._waiting:
            print(f"warpsph: {self._path} lacks its last rows: the disk did not take them", file=sys.stderr)
        with contextlib.suppress(OSError):
            os.fsync(self._file.fileno())
        self._file.close()


def read_history(path: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Columns and units of a history file by name; an unfinished last line is left out.

    Raises:
        SceneError: there is no such file, or it is no history.
    """
    with reading("history", path):
        text = path.read_bytes().decode("utf-8")
        whole_lines = text[: text.rfind("\n") + 1]
        header, *rows = list(csv.reader(io.StringIO(whole_lines, newline=""), strict=True)) or [[]]
        named = [re.fullmatch(r"(.+) \[(.*)\]", cell, re.DOTALL) for cell in header]
        require(all(named), "its columns have no name [unit]")
        units = dict(column.groups() for column in named)
        require([*units][:2] == ["step", "time"], "it does not begin with step and time")
        require(len(units) == len(header), "two of its columns have one name")
        energies = [name.removeprefix(ENERGY_COLUMN) for name in units if name.startswith(ENERGY_COLUMN)]
        require(energies in ([], list(COLUMNS)), "its energies are not those of a balance")
        require(all(len(row) == len(header) for row in rows), "its rows are not of one length")
        table = np.array(rows, dtype=float).reshape(-1, len(header))
        require(bool(np.isfinite(table[:, :2]).all()), "its times are not finite")
    return dict(zip(units, table.T, strict=True)), units
