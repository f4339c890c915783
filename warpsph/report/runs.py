"""One run of the report: made into a folder of its own, and read back from there.

Reading back is what lets the report go on where it was interrupted, and be laid out anew without running anything.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from ..cli.catalogue import SceneFile
from ..cli.runner import run as run_scene
from ..cli.scene_run import SceneRun
from ..cli.settings import Settings
from ..errors import SceneError
from ..export.frames import Frames, FrameWriter
from ..mesh.mesh import Mesh
from ..scene.scene import Scene
from ..simulation.history import read_history
from ..simulation.summary import read_summary


@dataclass(frozen=True)
class Run(SceneRun):
    """A run the report needs.

    Args:
        name, scene, settings: see `SceneRun`.
        frames: times at which whole fields are kept [s], rising.
    """

    frames: tuple[float, ...] = ()

    def done(self, folder: Path) -> bool:
        """Whether the folder holds this run with these frames."""
        try:
            asked = Frames(folder).times
        except (OSError, ValueError, KeyError):
            return False
        return asked == self.frames and super().done(folder)

    def make(self, folder: Path, device: str | None) -> None:
        """Run it; what it prints goes into `log.txt`."""
        folder.mkdir(parents=True, exist_ok=True)
        file, scene, values = self.build()
        with (
            (folder / "log.txt").open("w", encoding="utf-8") as log,
            contextlib.redirect_stdout(log),
            contextlib.redirect_stderr(log),
        ):
            try:
                run_scene(
                    file,
                    scene,
                    values,
                    Settings(device=device, frames=len(self.frames)),
                    folder,
                    quiet=False,
                    overwrite=True,
                    watching=[lambda simulation: FrameWriter(simulation, self.frames, folder)],
                )
            except SceneError as error:  # its checks could not be evaluated: the run keeps its summary
                print(f"warpsph: {error}")

    def read(self, folder: Path) -> Result:
        """What it gave."""
        history, _ = read_history(folder / "history.csv")
        summary = read_summary(folder / "summary.json")
        return Result(self, folder, summary, history, Frames(folder))


def published(name: str, scene: str, settings: tuple[str, ...] = (), frames: tuple[float, ...] = ()) -> Run:
    """A run with the numerics that the paper's cases were computed with."""
    return Run(name, scene, ("numerics=published", *settings), frames)


@dataclass(frozen=True)
class Result:
    """A run that is done.

    Attributes:
        run: which.
        folder: where.
        summary: its `summary.json`.
        history: its columns, name → values.
        frames: its frames.
    """

    run: Run
    folder: Path
    summary: Mapping
    history: Mapping[str, np.ndarray]
    frames: Frames

    @cached_property
    def _built(self):
        return self.run.build()

    @property
    def file(self) -> SceneFile:
        """Its scene file."""
        return self._built[0]

    @property
    def scene(self) -> Scene:
        """Its scene."""
        return self._built[1]

    @property
    def parameters(self) -> SimpleNamespace:
        """Its parameters."""
        return SimpleNamespace(**self._built[2])

    @property
    def mesh(self) -> Mesh:
        """Its initial mesh."""
        return self.scene.mesh

    @property
    def seconds(self) -> float:
        """How long it took [s]."""
        return self.summary["wall_time"]

    def check(self, name: str) -> float:
        """Value of a check; NaN where it was not made."""
        values = [check["value"] for check in self.summary["checks"] if check["name"] == name]
        return math.nan if not values or values[0] is None else values[0]

    @property
    def times(self) -> np.ndarray:
        """Times of the frames it has [s]."""
        return np.array([frame.time for frame in self.frames])

    def at(self, field: str, frame: int = -1) -> np.ndarray:
        """A field of a frame."""
        return self.frames[frame].field(field)

    def moved(self, frame: int = -1, *, magnified: float = 1.0) -> Mesh:
        """Its mesh at a frame, displacements magnified."""
        return self.mesh.with_nodes(self.mesh.nodes + magnified * self.at("displacement", frame))
