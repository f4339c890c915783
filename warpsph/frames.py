"""The frames of a run: whole fields at chosen times, written as it goes on and read back (`docs/output.md`)."""

from .export.frames import Frame, Frames, FrameWriter, evenly

__all__ = ["Frame", "FrameWriter", "Frames", "evenly"]
