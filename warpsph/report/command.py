"""The command `warpsph report`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..cli.settings import MOST_THREADS
from ..cli.stopping import interrupting, status_of
from ..storage.owner import owned
from ..validate import index


def add_parser(commands) -> None:
    """Add the command to the others."""
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


def _report(options: argparse.Namespace) -> int:
    from .make import make_report  # all cases: slow to import

    index("--jobs", options.jobs, at_least=1, below=MOST_THREADS + 1)
    default = Path("runs") / ("report-quick" if options.quick else "report")
    folder = Path(options.out or default)
    try:
        with owned(folder), interrupting():
            make_report(folder, quick=options.quick, device=options.device, jobs=options.jobs)
    except KeyboardInterrupt as stop:
        print("warpsph: interrupted; the same command goes on from here", file=sys.stderr)
        return status_of(stop)
    return 0
