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
from ..storage.reading import check_array, digest, read_arrays, reading, require
from .history import History, columns_of
from .simulation import COUNTERS, Simulation
from .time_step import Stretch

CHECKPOINT = "checkpoint.npz"
STATE, HISTORY = "state/", "history/"
PYTHON = f"Python {sys.version_info[0]}.{sys.version_info[1]}"


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
        """Read a checkpoint; every byte of it is checked.

        Raises:
            SceneError: there is none, it is damaged, or another version wrote it.
        """
        path = Path(path)
        if not path.exists():
            raise SceneError("checkpoint", str(path), "there is no checkpoint (No such file or directory)")
        damaged = "it is damaged or no checkpoint ({error})"
        content = read_arrays("checkpoint", path, damaged)
        with reading("checkpoint", path, damaged):
            header = json.loads(content.pop("header").tobytes())
            require(isinstance(header, dict) and isinstance(header.get("version"), str), "its header is not ours")
        if header["version"] != __version__:
            allowed = f"it is of warpsph {header['version']}, this is {__version__}"
            raise SceneError("checkpoint", str(path), allowed)
        with reading("checkpoint", path, damaged):
            _check_header(header)
            require(header["content"] == seal(header, content), "it is not what was written")
        state, history = (
            {name.removeprefix(part): value for name, value in content.items() if name.startswith(part)}
            for part in (STATE, HISTORY)
        )
        with reading("checkpoint", path, damaged):
            check_array("rows", history["rows"], shape=(None, None), finite=False) if history else None
            require(not history or history["next"].shape == (), "its history is of another form")
        return Checkpoint(path, header, state, history)

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
        for name, identity in simulation.scene.probe_identities.items():
            if self.header["probes"].get(name) != identity:
                why = "" if self.header["python"] == PYTHON else f", or was compiled by {self.header['python']}"
                allowed = f"it was recorded with another function of the probe {name!r}{why}; start again"
                raise SceneError("checkpoint", str(self.path), allowed)
        with reading("checkpoint", self.path, "it holds another state ({error})"):
            columns = len(columns_of(simulation))
            require(not self.history or self.history["rows"].shape[1] == columns, "other columns of the history")
            simulation.restore(self.arrays, self.header["values"])


def _check_header(header: Mapping) -> None:
    """Refuse, inside of `reading`, a header whose entries are not of the kind that is written."""
    for name in ("scene", "precision", "device", "python", "content"):
        require(isinstance(header.get(name), str), f"{name} is no text")
    for name in ("values", "run", "probes"):
        require(isinstance(header.get(name), dict), f"{name} is no table")
    values = header["values"]
    numbers = [values[name] for name in COUNTERS] + [values.get("wall_time", 0.0)]
    require(all(isinstance(value, int | float) and value >= 0 for value in numbers), "its numbers are not ours")
    require(isinstance(values["steps"], int) and math.isfinite(values["time"]), "its numbers are not ours")
    require(isinstance(values["stepper"], dict), "its numbers are not ours")
    stretch = values["stretch"]
    if stretch is not None:
        require(sorted(stretch) == sorted(Stretch.__dataclass_fields__), "its steps are not ours")
        counts = stretch["steps"], stretch["first"]
        require(all(isinstance(count, int) for count in counts) and counts[0] > 0, "its steps are not ours")
        require(all(math.isfinite(stretch[name]) for name in ("start", "end")), "its steps are not ours")


def seal(header: Mapping, arrays: Mapping[str, np.ndarray]) -> str:
    """SHA-256 of all that is in a checkpoint but this itself, its header's `content`, as hexadecimal digits."""
    told = json.dumps({name: value for name, value in header.items() if name != "content"})
    return digest({**arrays, "header": np.frombuffer(told.encode("utf-8"), dtype=np.uint8)})


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
        "probes": simulation.scene.probe_identities,
        "python": PYTHON,
    }
    content = {f"{STATE}{name}": value for name, value in arrays.items()}
    content |= {f"{HISTORY}{name}": value for name, value in (history.state() if history else {}).items()}
    header["content"] = seal(header, content)
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
