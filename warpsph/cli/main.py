"""The command `warpsph`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from .. import __version__
from ..errors import SceneError, StoppedError
from ..storage.names import printable
from ..storage.owner import owned
from . import new, sweep_command
from .catalogue import load, shipped
from .exporting import add_export
from .parent import end_with_parent
from .plotting import add_plot
from .run_command import add_run
from .stopping import interrupting
from .streams import steady_streams


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the exit status is 0 for success, 1 for a failed check or run, 2 for bad input."""
    with steady_streams():
        end_with_parent()
        options = _parser().parse_args(arguments)
        try:
            for text in sys.argv[1:] if arguments is None else arguments:
                printable("argument", text)
            return options.command(options)
        except SceneError as error:
            print(f"warpsph: {error}", file=sys.stderr)
            return 2
        except StoppedError as stop:
            print(f"warpsph: {stop}", file=sys.stderr)
            return stop.status
        except KeyboardInterrupt:
            print("warpsph: interrupted; what was recorded so far is kept", file=sys.stderr)
            return 130
        except OSError as error:  # a disk that is full, above all
            print(f"warpsph: {error}", file=sys.stderr)
            return 1


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

    reporting = commands.add_parser(
        "report",
        help="run every case of the paper and lay it out beside the paper's and the exact results",
        description="Runs every case of the paper and writes report.html and report.md. Runs that a former call "
        "of this version with these parameters has finished are kept; delete a run's folder to repeat it.",
    )
    reporting.add_argument("--quick", action="store_true", help="coarser and shorter where a case takes minutes")
    reporting.add_argument(
        "--out", metavar="DIR", help="folder of the report (default: runs/report, or report-quick)"
    )
    reporting.add_argument("--device", help="Warp device, e.g. cpu or cuda:0 (default: a GPU if there is one)")
    reporting.add_argument("--jobs", type=int, default=2, help="runs at a time (default: 2)")
    reporting.set_defaults(command=_report)
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


def _report(options: argparse.Namespace) -> int:
    from ..report.command import report  # matplotlib, and all cases: slow to import

    if options.jobs < 1:
        raise SceneError("--jobs", options.jobs, "it must be at least 1")
    default = Path("runs") / ("report-quick" if options.quick else "report")
    folder = Path(options.out or default)
    try:
        with owned(folder), interrupting():
            report(folder, quick=options.quick, device=options.device, jobs=options.jobs)
    except KeyboardInterrupt:
        print("warpsph: interrupted; the same command goes on from here", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
