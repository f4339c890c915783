"""The command `warpsph plot`."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import SceneError, one_of
from ..validate import number
from .keeping import kept_frames

MOVIES = ("gif", "mp4")


def add_plot(commands) -> None:
    """Add the command."""
    plotting = commands.add_parser(
        "plot",
        help="draw a run from its frames",
        description="Draws the whole run on one sheet (DIR/overview.png), or one time, or an animation.",
    )
    plotting.add_argument("dir", metavar="DIR", help="folder of a run")
    plotting.add_argument(
        "--field", metavar="NAME", help="what to draw, e.g. velocity:y (default: the scene's field)"
    )
    plotting.add_argument("--time", metavar="T", help="draw the frame nearest to this time [s]")
    plotting.add_argument("--animate", nargs="?", const="gif", metavar="|".join(MOVIES), help="draw all frames")
    plotting.set_defaults(command=_plot)


def _plot(options: argparse.Namespace) -> int:
    from ..export.pictures.field import animate, plot_frame  # matplotlib is slow to import
    from ..export.pictures.sheet import plot_overview
    from ..export.quantity import quantity

    frames = kept_frames(options.dir)
    shown, folder = quantity(options.field, frames), Path(options.dir)
    if options.animate is not None and options.animate not in MOVIES:
        raise SceneError("--animate", options.animate, one_of(MOVIES, options.animate))
    try:
        if options.animate:
            path = folder / f"{shown.name}.{options.animate}"
            animate(frames, shown, path=path)
        elif options.time is not None:
            frame = frames.nearest(_time(options.time))
            path = folder / f"{shown.name}_{frame.number:06d}.png"
            plot_frame(frames, shown, frame=frame, path=path)
        else:
            path = folder / "overview.png"
            plot_overview(frames, shown, path=path)
    except OSError as error:
        raise SceneError("DIR", options.dir, f"it must be a folder that can be written ({error})") from None
    print(path)
    return 0


def _time(text: str) -> float:
    try:
        return number("--time", float(text), at_least=0.0)
    except ValueError:
        raise SceneError("--time", text, "it must be a number, at least 0 [s]") from None
