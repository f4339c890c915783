"""The command `warpsph export`."""

from __future__ import annotations

import argparse
from importlib import import_module

from ..errors import SceneError
from ..export.frames import Frames
from ..storage.owner import owned_file
from ..validate import number
from .keeping import USD, kept_frames, target
from .stopping import waiting

# Kinds of files, and the module that writes each: they import USD or VTK, which a plain run does not need.
WRITERS = {".usdc": "usd", ".usda": "usd", ".pvd": "paraview"}


def add_export(commands) -> None:
    """Add the command `warpsph export`."""
    exporting = commands.add_parser(
        "export",
        help="write the frames of a run as USD or for ParaView",
        description="Writes the frames of a run as one USD stage (.usdc, .usda) or as VTK point data (.pvd).",
    )
    exporting.add_argument("dir", metavar="DIR", help="folder of a run")
    exporting.add_argument("file", metavar="FILE", help=f"what to write: {', '.join(WRITERS)}")
    exporting.add_argument(
        "--field", metavar="NAME", help="USD: field to colour by, e.g. velocity:y (default: the scene's)"
    )
    exporting.add_argument("--colour-map", metavar="MAP", help="USD: a matplotlib colour map (default: cividis)")
    exporting.add_argument(
        "--range",
        metavar="LOW,HIGH",
        help="USD: values at the ends of the map, e.g. --range=-1e5,0 (default: of all frames)",
    )
    exporting.set_defaults(command=_export)


def _export(options: argparse.Namespace) -> int:
    frames = kept_frames(options.dir)
    path = target("FILE", options.file, tuple(WRITERS))
    with waiting():
        writer = import_module(f"..export.{WRITERS[path.suffix]}", __package__)
    if path.suffix in USD:
        colouring = _colouring(options, frames)
    else:
        _refuse_colours(options)
    try:
        with owned_file(path, "FILE"):
            if path.suffix in USD:
                writer.write_stage(frames, path, colouring)
            else:
                writer.write_series(frames, path)
    except OSError as error:
        raise SceneError("FILE", options.file, f"it must be a file that can be written ({error})") from None
    print(f"{path}: {len(frames)} frames, {len(frames.mesh.nodes)} nodes")
    return 0


def _refuse_colours(options: argparse.Namespace) -> None:
    for name in ("field", "colour_map", "range"):
        value = getattr(options, name)
        if value is not None:
            raise SceneError(
                f"--{name.replace('_', '-')}", value, "it is for USD; ParaView colours by any field itself"
            )


def _colouring(options: argparse.Namespace, frames: Frames):
    from ..export.colours import Colouring, named_map, whole_span
    from ..export.quantity import quantity

    shown, colour_map = quantity(options.field, frames), named_map(options.colour_map)
    if options.range is None:
        return Colouring(shown, whole_span(shown, frames), colour_map)
    try:
        low, high = (number("--range", float(text)) for text in options.range.split(","))
        number("--range", high, above=low)
    except ValueError:
        raise SceneError("--range", options.range, "it must be LOW,HIGH: two numbers, the second larger") from None
    return Colouring(shown, (low, high), colour_map)
