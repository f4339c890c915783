"""The command `warpsph sweep`: one scene with many values of its parameters."""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from ..device.precision import precision as precision_of
from ..errors import SceneError
from ..simulation.device import THREADS, all_cores, choose_device, start_warp
from ..storage.owner import owned
from ..validate import index
from .catalogue import load
from .settings import MOST_THREADS, count
from .stopping import status_of
from .sweep import FAILED, members, sweep, table


def add_parser(commands) -> None:
    """Add the command to the others."""
    parser = commands.add_parser(
        "sweep",
        help="run a scene with several values of its parameters",
        description="Runs every combination of the values, each into a folder of its own, and collects all checks "
        "and metrics in sweep.csv. What a former call has finished is kept; what it began goes on.",
    )
    parser.add_argument("scene", help="a shipped scene or the path of a scene file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE,…",
        help="values of a parameter; may be repeated",
    )
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time (default: 2)")
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="make the runs on a Dask cluster that sees the same folders, not here"
    )
    parser.add_argument("--device", help="Warp device, e.g. cpu or cuda:0 (default: a GPU if there is one)")
    parser.add_argument("--precision", default="float64", help="float32 or float64 (default: float64)")
    parser.add_argument("--frames", metavar="N", default="0", help="frames each run keeps (default: 0)")
    parser.add_argument("--out", metavar="DIR", help="folder for the results (default: runs/SCENE-sweep)")
    parser.add_argument("--quiet", action="store_true", help="print nothing unless something fails")
    parser.set_defaults(command=_sweep)


def _sweep(options: argparse.Namespace) -> int:
    index("--jobs", options.jobs, at_least=1, below=MOST_THREADS + 1)
    precision_of(options.precision)
    start_warp()
    if options.device and not options.dask:
        choose_device(options.device)
    chosen = members(options.scene, options.set, options.precision, count("--frames", options.frames))
    folder = Path(options.out or Path("runs") / f"{load(options.scene).name}-sweep").absolute()
    try:
        with owned(folder), _workers(options) as workers:
            rows = sweep(chosen, folder, options.device, workers, options.quiet)
    except KeyboardInterrupt as stop:
        print("warpsph: interrupted; the same command goes on from here", file=sys.stderr)
        return status_of(stop)
    passed = all(found["status"] in ("passed", "no checks") for found in rows)
    if not (options.quiet and passed):
        print(table(rows))
    lost = [found for found in rows if found["status"] == FAILED]
    if lost:
        first = f"{lost[0]['run']}: {lost[0]['message']}"
        print(f"warpsph: {len(lost)} of {len(rows)} runs failed to run; {first}", file=sys.stderr)
    if not options.quiet:
        print(f"results in {folder / 'sweep.csv'}")
    return 0 if passed else 1


@contextmanager
def _workers(options: argparse.Namespace):
    if options.dask is None:
        os.environ.setdefault(THREADS, str(max(1, all_cores() // options.jobs)))
        yield ThreadPoolExecutor(options.jobs)  # a thread waits for each process
        return
    try:
        from distributed import Client
    except ImportError:
        raise SceneError("--dask", options.dask, "it needs Dask: pip install distributed") from None
    try:
        client = Client(options.dask, timeout=10)
    except (OSError, ValueError) as error:
        raise SceneError("--dask", options.dask, f"it must be the address of a Dask scheduler ({error})") from None
    with client:
        yield client.get_executor(pure=False)
