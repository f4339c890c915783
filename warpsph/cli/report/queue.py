"""Makes the runs that are missing, some at a time, each in a process of its own."""

from __future__ import annotations

import multiprocessing
import sys
import time as clock
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from pathlib import Path

from tqdm import tqdm

from .runs import Run

POLL = 1.0  # [s]


def make_missing(runs: Sequence[Run], folder: Path, device: str | None, jobs: int, quiet: bool) -> None:
    """Make every run whose folder does not hold it yet, the longest first.

    A CPU kernel runs on one thread, so that separate processes are what uses several cores.
    """
    missing = sorted((run for run in runs if not run.done(folder / run.name)), key=Run.cost, reverse=True)
    if not quiet:
        print(f"{len(runs)} runs, {len(runs) - len(missing)} of them done already, in {folder}/", flush=True)
    if not missing:
        return
    begin, cost = clock.perf_counter(), {run: run.cost() for run in missing}
    show = not quiet and sys.stderr.isatty()
    form = "{percentage:3.0f}%|{bar}| {elapsed}<{remaining} {postfix}"
    context = multiprocessing.get_context("spawn")  # Warp's threads do not survive a fork
    with (
        tqdm(total=sum(cost.values()), disable=not show, leave=False, bar_format=form) as bar,
        ProcessPoolExecutor(max_workers=jobs, mp_context=context) as pool,
    ):
        pending = {pool.submit(run.make, folder / run.name, device): run for run in missing}
        finished, ready = 0, 0.0
        try:
            while pending:
                for future in wait(pending, timeout=POLL if show else None, return_when=FIRST_COMPLETED).done:
                    run = pending.pop(future)
                    future.result()
                    finished, ready = finished + 1, ready + cost[run]
                    if not quiet:
                        elapsed = clock.perf_counter() - begin
                        bar.write(f"[{finished}/{len(missing)}] {run.name} ({elapsed:.0f} s)", file=sys.stdout)
                        sys.stdout.flush()
                if show:
                    running = [run for future, run in pending.items() if future.running()]
                    part = sum(cost[run] * run.progress(folder / run.name) for run in running)
                    bar.set_postfix_str(", ".join(run.name for run in running[:jobs]), refresh=False)
                    bar.n = ready + part
                    bar.refresh()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
