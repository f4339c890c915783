"""A run of a sweep: the command `warpsph run` in a process of its own."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ..errors import DamagedError, SceneError
from ..simulation.checkpoint import CHECKPOINT, Checkpoint
from ..simulation.device import THREADS
from ..storage.reading import file_digest, read_toml
from .catalogue import load
from .children import CHILDREN
from .run_folder import SCENE, SUMMARY
from .scene_run import SceneRun


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
        """Whether the folder holds this run, of the scene file as it is now, this precision and frames.

        Raises:
            DamagedError: what it holds can not be read, and so not be told from what is missing.
        """
        if not (folder / SUMMARY).exists() or not (folder / SCENE).exists():
            return False
        path = Path(load(self.scene).module.__file__)
        stored = read_toml("scene", folder / SCENE)
        code, how = stored.get("code"), stored.get("run")
        same = isinstance(code, dict) and code.get("sha256") == file_digest(path)
        same = same and isinstance(how, dict)
        same = same and (how.get("precision"), how.get("frames")) == (self.precision, self.frames)
        return same and super().done(folder)

    def make(self, folder: Path, device: str | None) -> None:
        """Make it, from its checkpoint where it has one; what it prints goes into `log.txt`."""
        folder.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-m", "warpsph", "run", self.scene]
        command += [part for setting in self.settings for part in ("--set", setting)]
        command += ["--precision", self.precision, "--frames", str(self.frames)]
        command += ["--device", device] if device else []
        anew = [*command, "--out", str(folder), "--overwrite"]
        status = 2
        if _has_checkpoint(folder / CHECKPOINT):
            status = _call([*command, "--resume", str(folder)], folder)
        if status == 2:  # there is no checkpoint, or it is of another scene
            status = _call(anew, folder)
        if status not in (0, 1):
            (folder / SUMMARY).unlink(missing_ok=True)  # its checks raised: it is not done
            raise RuntimeError(last_line(folder) if status > 0 else f"its process ended by signal {-status}")
        if not (folder / SUMMARY).is_file():
            raise RuntimeError(last_line(folder))


def _has_checkpoint(path: Path) -> bool:
    """Whether there is one of this version; a damaged one is not the same as none."""
    try:
        Checkpoint.read(path)
    except DamagedError:
        raise
    except SceneError:
        return False
    return True


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
