"""Checkpoints from the command line: when to write them, how to go on from one, and what signals do."""

from __future__ import annotations

import contextlib
import math
import re
import signal
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..errors import SceneError, StoppedError
from ..simulation.checkpoint import CHECKPOINT, Checkpoint, Checkpoints, Interval
from ..simulation.history import History
from ..simulation.simulation import Observer, Simulation
from .settings import Settings

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@dataclass(frozen=True)
class Restart:
    """How a run goes on from a checkpoint and writes new ones.

    Args:
        interval: how often to write one; never by itself when None.
        checkpoint: the one to go on from; a start from the scene's initial state when None.
    """

    interval: Interval | None = None
    checkpoint: Checkpoint | None = None

    @property
    def wall_time(self) -> float:
        """Seconds that the run had taken up to the checkpoint."""
        return 0.0 if self.checkpoint is None else self.checkpoint.header["values"]["wall_time"]

    @property
    def history(self) -> Mapping | None:
        """What the history had; None for a new run."""
        return None if self.checkpoint is None else self.checkpoint.history

    def begin(self, simulation: Simulation, folder: Path) -> None:
        """Bring the simulation to the checkpoint; a new run removes that of the run before it."""
        if self.checkpoint is None:
            (folder / CHECKPOINT).unlink(missing_ok=True)
        else:
            self.checkpoint.restore(simulation)

    @contextlib.contextmanager
    def watching(
        self, simulation: Simulation, history: History, folder: Path, settings: Settings
    ) -> Iterator[Observer]:
        """An observer that writes the checkpoints; while it is in use, signals stop the run between steps.

        A second signal does not wait for them to end. The settings are kept in the checkpoints.
        """
        if self.interval is None:
            yield _Nothing()
            return
        checkpoints = Checkpoints(simulation, history, folder / CHECKPOINT, self.interval, settings.table())
        stopper = _Stopper(checkpoints, folder)
        previous = {}
        if threading.current_thread() is threading.main_thread():
            for each in SIGNALS:
                if signal.getsignal(each) is not signal.SIG_IGN:  # a worker leaves interrupts to its parent
                    previous[each] = signal.signal(each, stopper.ask)
        try:
            yield stopper
        finally:
            for each, handler in previous.items():
                signal.signal(each, handler)


class _Nothing:
    next_time = math.inf

    def observe(self, simulation: Simulation) -> None:
        """Nothing."""


class _Stopper:
    def __init__(self, checkpoints: Checkpoints, folder: Path):
        self._checkpoints, self._folder, self._asked = checkpoints, folder, None

    @property
    def next_time(self) -> float:
        return self._checkpoints.next_time

    def ask(self, number: int, frame: object) -> None:
        if self._asked is not None:
            raise KeyboardInterrupt
        self._asked = number

    def observe(self, simulation: Simulation) -> None:
        if self._asked is None:
            self._checkpoints.observe(simulation)
            return
        written = self._checkpoints.write(simulation)
        then = f"go on with: warpsph run --resume {self._folder}" if written else "without a checkpoint"
        raise StoppedError(
            f"stopped after step {simulation.steps}, t = {simulation.time:.6g} s; {then}", self._asked
        )


def settings_of(checkpoint: Checkpoint) -> Settings:
    """How the run was made that left a checkpoint."""
    header = checkpoint.header
    leg = header["values"]["leg"] or {}
    found = {"device": header["device"], "precision": header["precision"], "until": leg.get("end")}
    return Settings.read({name: value for name, value in (found | header["run"]).items() if value is not None})


def parse_interval(text: str) -> Interval:
    """How often, from a text such as 500, 0.2s, 10min or 1h.

    >>> parse_interval("500").steps, parse_interval("0.2s").time, parse_interval("1.5h").seconds
    (500, 0.2, 5400.0)
    """
    found = re.fullmatch(r"\s*([0-9.]+(?:e[+-]?[0-9]+)?)\s*(s|min|h|)\s*", text, re.IGNORECASE)
    allowed = "it must be a number of steps (500), a simulated time (0.2s) or a wall time (10min, 1h), above 0"
    try:
        amount, unit = float(found[1]), found[2].lower()
    except (TypeError, ValueError):
        amount, unit = math.nan, ""
    if not 0.0 < amount < math.inf or (not unit and amount != int(amount)):
        raise SceneError("--checkpoint-every", text, allowed)
    if unit == "s":
        return Interval(time=amount)
    return Interval(seconds=amount * {"min": 60.0, "h": 3600.0}[unit]) if unit else Interval(steps=int(amount))
