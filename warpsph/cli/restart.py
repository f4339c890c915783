"""How a run goes on from a checkpoint and writes new ones."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..simulation.checkpoint import CHECKPOINT, Checkpoint, Checkpoints, Interval
from ..simulation.history import History
from ..simulation.simulation import Observer, Simulation
from .run_folder import resume_command
from .settings import Settings
from .stopping import Stopper, handled


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
        path, table = folder / CHECKPOINT, settings.table(folder)
        checkpoints = Checkpoints(simulation, history, path, self.interval, table)
        stopper = Stopper(checkpoints, resume_command(folder, settings.usd))
        with handled(stopper.ask):
            yield stopper


class _Nothing:
    next_time = math.inf

    def observe(self, simulation: Simulation) -> None:
        """Nothing."""


def settings_of(checkpoint: Checkpoint, folder: Path, usd: str | None = None) -> Settings:
    """How the run was made that left a checkpoint in a folder; `usd` as in `Settings.read`."""
    header = checkpoint.header
    stretch = header["values"]["stretch"] or {}
    found = {"device": header["device"], "precision": header["precision"], "until": stretch.get("end")}
    table = {name: value for name, value in (found | header["run"]).items() if value is not None}
    return Settings.read(table, folder, usd)
