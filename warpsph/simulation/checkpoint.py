"""Checkpoints: the whole state of a run in one file, from which it goes on bit for bit."""

from __future__ import annotations

import io
import json
import math
import sys
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import __version__
from ..errors import SceneError
from ..scene.fingerprint import fingerprint
from ..storage.files import write_whole
from .history import History
from .simulation import Simulation

CHECKPOINT = "checkpoint.npz"
STATE, HISTORY = "state/", "history/"


@dataclass(frozen=True)
class Interval:
    """How often to write a checkpoint: after so many steps, so much simulated or so much wall time.

    Attributes:
        steps: number of steps.
        time: simulated time [s].
        seconds: wall time [s].
    """

    steps: float = math.inf
    time: float = math.inf
    seconds: float = math.inf


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint as it was read.

    Attributes:
        path: its file.
        header: version, scene, precision, device, the simulation's numbers, and how the run is made.
        arrays: the simulation's arrays by name.
        history: the history's arrays.
    """

    path: Path
    header: Mapping
    arrays: Mapping[str, np.ndarray]
    history: Mapping[str, np.ndarray]

    @staticmethod
    def read(path: Path | str) -> Checkpoint:
        """Read a checkpoint.

        Raises:
            SceneError: there is none, it is damaged, or another version wrote it.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                content = {name: file[name] for name in file.files}
            header = json.loads(content.pop("header").tobytes())
        except OSError as error:
            raise SceneError("checkpoint", str(path), f"there is no checkpoint ({error.strerror})") from None
        except Exception as error:  # reading damaged bytes may raise anything
            raise SceneError("checkpoint", str(path), f"it is damaged or no checkpoint ({error})") from None
        if header["version"] != __version__:
            allowed = f"it is of warpsph {header['version']}, this is {__version__}"
            raise SceneError("checkpoint", str(path), allowed)
        parts = (
            {name.removeprefix(part): value for name, value in content.items() if name.startswith(part)}
            for part in (STATE, HISTORY)
        )
        return Checkpoint(Path(path), header, *parts)

    def restore(self, simulation: Simulation) -> None:
        """Bring a new simulation of the same scene to where this one was.

        Raises:
            SceneError: the checkpoint is of another scene or precision.
        """
        if self.header["precision"] != simulation.precision.name:
            allowed = f"it is in {self.header['precision']}, the run in {simulation.precision.name}"
            raise SceneError("checkpoint", str(self.path), allowed)
        if self.header["scene"] != fingerprint(simulation.scene):
            allowed = f"it is of another scene, or of other parameters, than {simulation.scene.name} now has"
            raise SceneError("checkpoint", str(self.path), allowed)
        try:
            simulation.restore(self.arrays, self.header["values"])
        except KeyError as error:
            raise SceneError("checkpoint", str(self.path), f"it holds other arrays: {error}") from None


def write_checkpoint(
    simulation: Simulation, path: Path | str, history: History | None = None, run: Mapping | None = None
) -> None:
    """Write a simulation into a file that is whole or not there.

    Args:
        simulation: the simulation.
        path: the file.
        history: its history, to go on with it.
        run: how the run is made, to be kept in the header: texts and numbers by name.

    Raises:
        OSError: it can not be written; what stood there stays.
    """
    arrays, values = simulation.state()
    header = {
        "version": __version__,
        "scene": fingerprint(simulation.scene),
        "precision": simulation.precision.name,
        "device": simulation.device.alias,
        "values": values,
        "run": dict(run or {}),
    }
    content = {f"{STATE}{name}": value for name, value in arrays.items()}
    content |= {f"{HISTORY}{name}": value for name, value in (history.state() if history else {}).items()}
    text = np.frombuffer(json.dumps(header).encode("utf-8"), dtype=np.uint8)
    packed = io.BytesIO()  # a disk that fills up then meets one plain write
    np.savez(packed, header=text, **content)
    write_whole(Path(path), lambda file: file.write(packed.getbuffer()))


class Checkpoints:
    """An observer that writes a checkpoint now and then; put it after the history.

    A checkpoint that can not be written does not end the run: the last one stays, and a line says so.

    Args:
        simulation: the simulation.
        history: its history.
        path: the file.
        interval: how often.
        run: see `write_checkpoint`.
    """

    def __init__(
        self,
        simulation: Simulation,
        history: History,
        path: Path,
        interval: Interval,
        run: Mapping | None = None,
    ):
        self._history, self._path, self._interval, self._run = history, path, interval, run
        self._mark(simulation)

    @property
    def next_time(self) -> float:
        """When one may be due [s]: at every step where the interval is one of steps."""
        return -math.inf if self._interval.steps < math.inf else self._time + self._interval.time * (1.0 - 1e-9)

    def observe(self, simulation: Simulation) -> None:
        """Write one when it is due."""
        interval = self._interval
        if (
            simulation.steps - self._steps >= interval.steps
            or simulation.time - self._time >= interval.time * (1.0 - 1e-9)
            or clock.monotonic() - self._clock >= interval.seconds
        ):
            self.write(simulation)

    def write(self, simulation: Simulation) -> bool:
        """Write one now; whether that worked."""
        self._mark(simulation)
        try:
            write_checkpoint(simulation, self._path, self._history, self._run)
        except OSError as error:
            print(f"warpsph: {self._path} can not be written now ({error.strerror})", file=sys.stderr)
            return False
        return True

    def _mark(self, simulation: Simulation) -> None:
        self._steps, self._time, self._clock = simulation.steps, simulation.time, clock.monotonic()
