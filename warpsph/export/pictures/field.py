"""A quantity on the deformed body: at the end of a run, at one of its frames, or at all of them, moving."""

from __future__ import annotations

from pathlib import Path

from matplotlib import animation

from ...errors import SceneError
from ...simulation.simulation import Simulation
from ...storage.files import whole
from ..frames import Frame, Frames
from ..quantity import Quantity, own_quantity
from .figures import save_picture
from .view import View

FRAMES_A_SECOND = 12
DOTS_PER_INCH = 100  # of an animation
MOVIES = {"gif": animation.PillowWriter, "mp4": animation.FFMpegWriter}


def plot_field(simulation: Simulation, path: Path) -> None:
    """Draw the scene's field as it is now into a PNG."""
    view = View.of([simulation], own_quantity(simulation.scene))
    _plot(view, simulation, simulation.scene.name, path)


def plot_frame(frames: Frames, quantity: Quantity, *, frame: Frame, path: Path) -> None:
    """One frame into a PNG, at the scale and colours of all frames."""
    _plot(View.of(frames, quantity), frame, frames.about["scene"], path)


def _plot(view: View, frame: Frame | Simulation, scene: str, path: Path) -> None:
    figure, axes = view.figure()
    view.draw(axes, frame)
    axes.set_title(_title(scene, frame))
    save_picture(figure, path)


def animate(frames: Frames, quantity: Quantity, *, path: Path) -> None:
    """All frames into a GIF or an MP4, by the ending of the path.

    Raises:
        SceneError: what writes such a file is not installed.
    """
    writer = MOVIES[path.suffix[1:]]
    if not writer.isAvailable():
        raise SceneError("--animate", path.suffix[1:], "it needs ffmpeg, which is not installed here; use gif")
    view = View.of(frames, quantity)
    figure, axes = view.figure()
    movie = writer(fps=FRAMES_A_SECOND)
    with whole(path) as temporary, movie.saving(figure, str(temporary), DOTS_PER_INCH):
        for frame in frames:
            axes.clear()
            view.draw(axes, frame)
            axes.set_title(_title(frames.about["scene"], frame))
            movie.grab_frame()


def _title(scene: str, frame: Frame | Simulation) -> str:
    return f"{scene}, t = {frame.time:.4g} s"
