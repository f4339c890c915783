"""A USD stage that grows with the run and can be opened at any time, also after the run was killed.

Time samples can not be appended to a USD file safely. So while the run goes on the file is small, refers to one
file a frame in a folder beside it (USD's value clips), and is replaced whole after every frame; when the run ends
one flattened stage takes its place and the folder goes. A frame costs the same however many were before it.
"""

from __future__ import annotations

import errno
import re
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, Vt

from ..errors import SceneError
from ..storage.files import remove_parts, whole
from ..storage.owner import empty, holds_only, mark
from .colours import Colouring, percentiles, span_of
from .frames import Frames
from .quantity import quantity
from .usd import ROOT, Drawing, check_written, usd_errors, write_stage

CLIP = re.compile(r"\d+-\d{6}\.usdc")


def clips_folder(path: Path) -> Path:
    """Where the clips of a stage stand."""
    return path.with_name(f"{path.name}.frames")


def check_clips(path: Path) -> None:
    """Refuse a stage beside which a folder of its clips' name holds anything else.

    Raises:
        SceneError: it does.
    """
    if not holds_only(clips_folder(path), CLIP):
        allowed = f"{clips_folder(path)} holds what no run has written; choose another name"
        raise SceneError("--usd", str(path), allowed)


class LiveStage:
    """Keeps a USD file up to date with the frames of a run.

    Until the run ends a frame is coloured by the range of what is known so far. The files of a former one stay
    until a new stage refers to new ones.

    Args:
        frames: the frames, which another observer writes.
        path: of the USD file.

    Raises:
        SceneError: a folder of the clips' name is there that holds what no run has written.
    """

    def __init__(self, frames: Frames, path: Path):
        self._frames, self._path = frames, path
        self._folder = clips_folder(path)
        self._shown = quantity(None, frames)
        self._ranges: list[np.ndarray] = []
        self._seen: list[int] = []
        check_clips(path)
        mark(self._folder)
        former = [path for path in self._folder.iterdir() if CLIP.fullmatch(path.name)]
        self._generation = 1 + max((int(path.name.partition("-")[0]) for path in former), default=0)
        self.update()
        for path in former:
            path.unlink(missing_ok=True)
        remove_parts(self._folder)

    def update(self) -> None:
        """Add the frames that are new."""
        new = self._frames.numbers[len(self._seen) :]
        for number in new:
            frame = self._frames.read(number)
            self._ranges.append(percentiles(self._shown(frame)))
            path = self._folder / self._clip(number)
            with usd_errors(path), whole(path) as temporary:
                clip = Usd.Stage.CreateNew(str(temporary))
                drawing = Drawing(clip, self._frames, self._colouring)
                drawing.add(frame)
                clip.Save()
                check_written(temporary)
            self._seen.append(number)
        if new:
            self._refer()

    def _clip(self, number: int) -> str:
        return f"{self._generation}-{number:06d}.usdc"

    @property
    def _colouring(self) -> Colouring:
        return Colouring(self._shown, span_of(self._ranges))

    def _refer(self) -> None:
        """Replace the file by one that refers to all frames so far."""
        stage = Usd.Stage.CreateInMemory()
        drawing = Drawing(stage, self._frames, self._colouring)
        drawing.describe()
        codes = [self._frames.code(number) for number in self._seen]
        drawing.span_time(codes)
        paths = [f"./{self._folder.name}/{self._clip(number)}" for number in self._seen]
        clips = {
            "assetPaths": Sdf.AssetPathArray([Sdf.AssetPath(path) for path in paths]),
            "manifestAssetPath": Sdf.AssetPath(paths[0]),
            "primPath": ROOT,
            "active": Vt.Vec2dArray([Gf.Vec2d(code, k) for k, code in enumerate(codes)]),
            "times": Vt.Vec2dArray([Gf.Vec2d(code, code) for code in codes]),
        }
        layer = stage.GetRootLayer()
        layer.GetPrimAtPath(ROOT).SetInfo("clips", {"default": clips})
        with usd_errors(self._path), whole(self._path) as temporary:
            layer.Export(str(temporary))
            check_written(temporary)

    def close(self) -> None:
        """Put one flattened stage in the place of all.

        Raises:
            OSError: it can not be written, or the frames are gone: a disk or somebody has taken them away.
        """
        if not self._frames:
            raise OSError(errno.ENOENT, "its frames are gone", str(self._frames.run))
        write_stage(self._frames, self._path)
        empty(self._folder, CLIP)
