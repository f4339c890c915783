"""A run of a sweep: the command `warpsph run` in a process of its own."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ..errors import SceneError
from ..simulation.checkpoint import CHECKPOINT
from ..simulation.device import THREADS
from .catalogue import load
from .children import CHILDREN
from .scene_run import SceneRun
from .stored import SCENE, read_toml


@dataclass(frozen=True)
class Member(SceneRun):
    """A run of a sweep: the command `warpsph run` in a process of its own.

    Args:
        name, scene, settings: see `SceneRun`.
        precision: float32 or float64.
        frames: how many it keeps.
    """

    precision: str = "float64"
    frames: int = 0

    def cost(self) -> float:
        """How much work it is, in node-steps; nothing when its scene is refused."""
        try:
            return super().cost()
        except SceneError:
            return 0.0

    def done(self, folder: Path) -> bool:
        """Whether the folder holds this run, of the scene file as it is now, this precision and frames."""
        try:
            stored = read_toml(folder / SCENE)
            path = Path(load(self.scene).module.__file__)
            same = stored["code"]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
            how = stored["run"]
            same = same and (how["precision"], how["frames"]) == (self.precision, self.frames)
            return same and super().done(folder)
        except (OSError, ValueError, KeyError, SceneError):
            return False

    def make(self, folder: Path, device: str | None) -> None:
        """Make it, from its checkpoint where it has one; what it prints goes into `log.txt`."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "summary.json").unlink(missing_ok=True)
        command = [sys.executable, "-m", "warpsph", "run", self.scene, "--out", str(folder)]
        command += [part for setting in self.settings for part in ("--set", setting)]
        command += ["--precision", self.precision, "--frames", str(self.frames)]
        command += ["--device", device] if device else []
        status = 2
        if (folder / CHECKPOINT).is_file():
            status = _call([*command, "--resume", str(folder)], folder)
        if status == 2:  # there is no checkpoint, or it is refused
            status = _call(command, folder)
        if status not in (0, 1):
            (folder / "summary.json").unlink(missing_ok=True)  # its checks raised: it is not done
            raise RuntimeError(last_line(folder) if status > 0 else f"its process ended by signal {-status}")
        if not (folder / "summary.json").is_file():
            raise RuntimeError(last_line(folder))


def _call(command: Sequence[str], folder: Path) -> int:
    """Exit status of a command that writes into `log.txt`."""
    with (folder / "log.txt").open("w", encoding="utf-8") as log:
        # Runs stand side by side: each on one core, unless told otherwise.
        return CHILDREN.call(command, log, {THREADS: "1"})


def last_line(folder: Path) -> str:
    """The last line of a run's log."""
    with suppress(OSError, IndexError):
        return (folder / "log.txt").read_text(encoding="utf-8").splitlines()[-1].removeprefix("warpsph: ")
    return "it left no log"
