"""What `warpsph run` keeps of a run for later: its frames, and the USD stage that follows them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ..errors import SceneError, one_of
from ..export.frames import Follower, Frames, FrameWriter, evenly
from ..simulation.simulation import Simulation
from .settings import Settings
from .stopping import waiting

Made = TypeVar("Made")
USD = (".usdc", ".usda")


def recorders(settings: Settings, folder: Path, end: float) -> list[Callable[[Simulation], Lenient]]:
    """What makes the observer that keeps the frames of a run until `end` [s], and its USD stage."""
    path = target("--usd", settings.usd, USD) if settings.usd else None
    if not settings.frames:
        return []
    followers, times = [], evenly(end, settings.frames)
    if path:
        with waiting():
            from ..export.usd_live import LiveStage, check_clips  # USD is slow to import

        check_clips(path)
        followers.append(lambda frames: Lenient(lambda: LiveStage(frames, path), f"{path} is not written further"))

    def recorder(simulation: Simulation) -> Lenient:
        return Lenient(lambda: FrameWriter(simulation, times, folder, followers), "no further frames are kept")

    return [recorder]


class Lenient:
    """An observer, or a follower of frames, that may fail to write: a full disk must not cost the run its result.

    Args:
        make: makes what it passes on to.
        lost: what is lost when that fails, for the message.
    """

    def __init__(self, make: Callable[[], FrameWriter | Follower], lost: str):
        self._lost, self._works = lost, True
        self._inner = self._attempt(make)

    @property
    def next_time(self) -> float:
        """When the inner observer has to look [s]; never when it has failed."""
        return self._inner.next_time if self._works else math.inf

    def observe(self, simulation: Simulation) -> None:
        """Pass on."""
        self._attempt(lambda: self._inner.observe(simulation))

    def update(self) -> None:
        """Pass on."""
        self._attempt(lambda: self._inner.update())

    def close(self) -> None:
        """Pass on."""
        self._attempt(lambda: self._inner.close())

    def _attempt(self, task: Callable[[], Made]) -> Made | None:
        try:
            return task() if self._works else None
        except (OSError, RuntimeError, SceneError) as error:  # of USD, and of frames that can not be read back
            self._works = False
            print(f"warpsph: {self._lost}, the run goes on ({' '.join(str(error).split())})", file=sys.stderr)
            return None


def kept_frames(text: str) -> Frames:
    """The frames of a run's folder, at least one."""
    frames = Frames(Path(text))
    if not len(frames):
        raise SceneError("DIR", text, "it must be the folder of a run that kept frames (`--frames N`)")
    return frames


def target(option: str, text: str, suffixes: tuple[str, ...]) -> Path:
    """The path of a file to be written, by its suffix one that can be."""
    path = Path(text)
    if path.suffix not in suffixes:
        raise SceneError(option, text, one_of([f"NAME{suffix}" for suffix in suffixes]))
    return path
