"""A USD stage that grows with the run and can be opened at any time, also after the run was killed.

Time samples can not be appended to a USD file safely. So while the run goes on the file is small, refers to one
file a frame in a folder beside it (USD's value clips), and is replaced whole after every frame; when the run ends
one flattened stage takes its place and the folder goes. A frame costs the same however many were before it.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, Vt

from ..storage.files import whole
from .colours import Colouring, percentiles, span_of
from .frames import Frames
from .quantity import quantity
from .usd import ROOT, Drawing, write_stage


class LiveStage:
    """Keeps a USD file up to date with the frames of a run.

    Until the run ends a frame is coloured by the range of what is known so far.

    Args:
        frames: the frames, which another observer writes.
        path: of the USD file.
    """

    def __init__(self, frames: Frames, path: Path):
        self._frames, self._path = frames, path
        self._folder = path.with_name(f"{path.name}.frames")
        self._shown = quantity(None, frames)
        self._ranges: list[np.ndarray] = []
        self._seen: list[int] = []
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        self.update()

    def update(self) -> None:
        """Add the frames that are new."""
        new = self._frames.numbers[len(self._seen) :]
        for number in new:
            frame = self._frames.read(number)
            self._ranges.append(percentiles(self._shown(frame)))
            clip = Usd.Stage.CreateNew(str(self._folder / f"{number:06d}.usdc"))
            drawing = Drawing(clip, self._frames, self._colouring)
            drawing.add(frame)
            clip.Save()
            self._seen.append(number)
        if new:
            self._refer()

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
        paths = [f"./{self._folder.name}/{number:06d}.usdc" for number in self._seen]
        clips = {
            "assetPaths": Sdf.AssetPathArray([Sdf.AssetPath(path) for path in paths]),
            "manifestAssetPath": Sdf.AssetPath(paths[0]),
            "primPath": ROOT,
            "active": Vt.Vec2dArray([Gf.Vec2d(code, k) for k, code in enumerate(codes)]),
            "times": Vt.Vec2dArray([Gf.Vec2d(code, code) for code in codes]),
        }
        layer = stage.GetRootLayer()
        layer.GetPrimAtPath(ROOT).SetInfo("clips", {"default": clips})
        with whole(self._path) as temporary:
            layer.Export(str(temporary))

    def close(self) -> None:
        """Put one flattened stage in the place of all."""
        write_stage(self._frames, self._path)
        shutil.rmtree(self._folder, ignore_errors=True)
