"""One of several runs that are made side by side, each into a folder of its own."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from .. import __version__
from ..scene.scene import Scene
from ..simulation.summary import read_summary
from ..simulation.time_step import divide, time_step_limit
from ..storage.reading import file_digest
from .catalogue import SceneFile, load
from .run_folder import HISTORY, SUMMARY

OVERHEAD = 1000  # nodes whose work costs as much time as starting a step's kernels on a CPU


@dataclass(frozen=True)
class SceneRun:
    """A run of a scene.

    Args:
        name: of its folder.
        scene: a shipped scene, or the path of a scene file.
        settings: its parameters, `name=value` each.
    """

    name: str
    scene: str
    settings: tuple[str, ...] = ()

    def build(self) -> tuple[SceneFile, Scene, dict[str, object]]:
        """The scene file, its scene, and the values of its parameters."""
        file = load(self.scene)
        return file, *file.build(self.settings)

    def cost(self) -> float:
        """How much work it is, in node-steps."""
        _, scene, _ = self.build()
        return (len(scene.mesh.nodes) + OVERHEAD) * divide(scene.duration, time_step_limit(scene))[0]

    def done(self, folder: Path) -> bool:
        """Whether the folder holds this run to its end, by this version, with these parameters.

        A run that broke down is done as well: it would break down again.

        Raises:
            DamagedError: its summary can not be read.
        """
        if not (folder / SUMMARY).exists():
            return False
        summary, (file, _, values) = read_summary(folder / SUMMARY), self.build()
        return (
            not summary["stopped"]
            and summary["warpsph_version"] == __version__
            and summary["scene"] == file.name
            and summary["parameters"] == json.loads(json.dumps(values))
            and summary["history"] == _digest(folder / HISTORY)
        )

    def make(self, folder: Path, device: str | None) -> None:
        """Make it; what it prints goes into `log.txt`."""
        raise NotImplementedError

    def progress(self, folder: Path) -> float:
        """Share of the simulated time that a run in progress has reached, from its history."""
        try:
            with (folder / "history.csv").open("rb") as file:
                file.seek(max(0, file.seek(0, 2) - 300))
                line = file.read().decode(errors="replace").splitlines()[-1]
            return min(1.0, float(line.split(",")[1]) / self.build()[1].duration)
        except (OSError, ValueError, IndexError):
            return 0.0


def _digest(path: Path) -> str | None:
    """Of the history as it is; one that lacks its last rows does not belong to its summary."""
    return file_digest(path) if path.is_file() else None
