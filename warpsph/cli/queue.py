"""Makes the runs that are missing, some at a time, with one display for all of them."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time as clock
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, ProcessPoolExecutor, wait
from pathlib import Path

from tqdm import tqdm

from ..simulation.device import THREADS, all_cores
from .scene_run import SceneRun

POLL = 1.0  # [s]


def processes(jobs: int) -> Executor:
    """Makes each run in a process of this machine, which share the cores."""
    context = multiprocessing.get_context("spawn")  # Warp's threads do not survive a fork
    threads = max(1, all_cores() // jobs)
    return ProcessPoolExecutor(max_workers=jobs, mp_context=context, initializer=_begin, initargs=(threads,))


def make_missing(
    runs: Sequence[SceneRun], folder: Path, device: str | None, workers: Executor, quiet: bool
) -> dict[SceneRun, BaseException]:
    """Make every run whose folder does not hold it yet, the longest first.

    Args:
        runs: all runs; their names differ.
        folder: gets a folder a run.
        device: Warp device.
        workers: make them; shut down at the end.
        quiet: whether to say nothing.

    Returns: the runs that raised, and what; the others are made all the same.
    """
    missing = sorted(
        (run for run in runs if not run.done(folder / run.name)), key=lambda run: run.cost(), reverse=True
    )
    if not quiet:
        print(f"{len(runs)} runs, {len(runs) - len(missing)} of them done already, in {folder}/", flush=True)
    begin, cost = clock.perf_counter(), {run: run.cost() for run in missing}
    failed: dict[SceneRun, BaseException] = {}
    show = not quiet and sys.stderr.isatty()
    form = "{percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"
    with tqdm(total=sum(cost.values()), disable=not show, leave=False, bar_format=form) as bar, workers:
        pending = {workers.submit(run.make, folder / run.name, device): run for run in missing}
        finished, ready = 0, 0.0
        try:
            while pending:
                for future in wait(pending, timeout=POLL if show else None, return_when=FIRST_COMPLETED).done:
                    run = pending.pop(future)
                    error = future.exception()
                    if error is not None:
                        failed[run] = error
                    finished, ready = finished + 1, ready + cost[run]
                    if not quiet:
                        elapsed = clock.perf_counter() - begin
                        reason = "" if error is None else f": {error}"
                        bar.write(
                            f"[{finished}/{len(missing)}] {run.name} ({elapsed:.0f} s){reason}", file=sys.stdout
                        )
                        sys.stdout.flush()
                if show:
                    running = [run for future, run in pending.items() if future.running()]
                    part = sum(cost[run] * run.progress(folder / run.name) for run in running)
                    bar.set_postfix_str(", ".join(run.name for run in running), refresh=False)
                    bar.n = ready + part
                    bar.refresh()
        except BaseException:  # an interrupt above all: what is done stays
            for future in pending:
                future.cancel()
            for process in multiprocessing.active_children():
                process.terminate()
            raise
    return failed


def _begin(threads: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's business
    os.environ.setdefault(THREADS, str(threads))
