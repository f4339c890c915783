"""The command `warpsph`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module

from .. import __version__
from ..errors import SceneError, StoppedError
from ..storage.names import printable
from . import new, sweep_command
from .catalogue import load, shipped
from .exporting import add_export
from .parent import end_with_parent
from .plotting import add_plot
from .run_command import add_run
from .stopping import interruptible, status_of
from .streams import steady_streams

# Rooms above this one add their commands by these modules: a name, since imports point down.
FURTHER = ("warpsph.report.command",)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the exit status is 0 for success, 1 for a failed check or run, 2 for bad input."""
    with steady_streams():
        try:
            with interruptible():
                return _run(arguments)
        except SceneError as error:
            print(f"warpsph: {error}", file=sys.stderr)
            return 2
        except StoppedError as stop:
            print(f"warpsph: {stop}", file=sys.stderr)
            return stop.status
        except KeyboardInterrupt as stop:
            print("warpsph: interrupted; what was recorded so far is kept", file=sys.stderr)
            return status_of(stop)
        except OSError as error:  # a disk that is full, above all
            print(f"warpsph: {error}", file=sys.stderr)
            return 1


def _run(arguments: Sequence[str] | None) -> int:
    end_with_parent()
    options = _parser().parse_args(arguments)
    for text in sys.argv[1:] if arguments is None else arguments:
        printable("argument", text)
    return options.command(options)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="warpsph", description="Solid and soil dynamics at large deformations by Runge-Kutta Taylor SPH."
    )
    parser.add_argument("--version", action="version", version=f"warpsph {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    listing = commands.add_parser("list", help="list the shipped scenes, or the parameters of one")
    listing.add_argument("scene", nargs="?", help="a shipped scene or the path of a scene file")
    listing.set_defaults(command=_list)

    add_run(commands)
    sweep_command.add_parser(commands)
    new.add_parser(commands)

    add_plot(commands)
    add_export(commands)
    for module in FURTHER:
        import_module(module).add_parser(commands)
    return parser


def _list(options: argparse.Namespace) -> int:
    if options.scene is None:
        files = {name: load(name) for name in shipped()}
        width = max(map(len, files), default=0)
        for name, file in files.items():
            print(f"{name.ljust(width)}  {file.description}")
        return 0
    file = load(options.scene)
    print(f"{file.name}: {file.description}\n")
    rows = [(p.name, "auto" if p.default is None else str(p.default), p.unit, p.meaning) for p in file.parameters]
    widths = [max(len(row[k]) for row in rows) for k in range(3)]
    for row in rows:
        print("  ".join(cell.ljust(w) for cell, w in zip(row, [*widths, 0], strict=True)).rstrip())
    return 0
