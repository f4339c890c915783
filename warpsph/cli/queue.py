"""Makes the runs that are missing, some at a time, with one display for all of them."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import sys
import threading
import time as clock
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, ProcessPoolExecutor, wait
from pathlib import Path

from ..errors import DamagedError
from ..simulation.device import THREADS, all_cores
from .parent import end_with_parent, for_child
from .progress import bar
from .scene_run import SceneRun
from .stopping import TERMINAL, starting_processes

try:
    from multiprocessing import resource_tracker
except ImportError:  # not on Windows
    resource_tracker = None

POLL = 1.0  # [s]
MANY = 500  # runs; of more it would take too long to find how much work each is
AT_ONCE = 256  # runs handed out: as many as any machine or cluster makes side by side


class Processes(ProcessPoolExecutor):
    """Processes of this machine, which leave the signals of the terminal to this one from their start."""

    def submit(self, *arguments, **named):
        """As of every executor; it may start a process."""
        with starting_processes():
            return super().submit(*arguments, **named)

    def stop(self) -> None:
        """Ask those at work to end, and begin no more.

        What waits is cancelled by the executor's own thread: that of ours could do it just as that one says of the
        same run that its process has gone, which is an error there.
        """
        ending = threading.Thread(target=self.shutdown, kwargs={"cancel_futures": True})
        ending.start()
        for process in multiprocessing.active_children():
            process.terminate()
        ending.join()


def processes(jobs: int) -> Executor:
    """Makes each run in a process of this machine, which share the cores and end with this one."""
    context = multiprocessing.get_context("spawn")  # Warp's threads do not survive a fork
    threads = max(1, all_cores() // jobs)
    arguments = (threads, for_child())
    with starting_processes():  # or a semaphore would be left that nobody knows of yet
        if resource_tracker is not None:
            resource_tracker.ensure_running()  # multiprocessing's own process, which a terminal ends with itself
        return Processes(max_workers=jobs, mp_context=context, initializer=_begin, initargs=arguments)


def make_missing(
    runs: Sequence[SceneRun], folder: Path, device: str | None, workers: Executor, quiet: bool
) -> dict[SceneRun, BaseException]:
    """Make every run whose folder does not hold it yet, the longest first where they are few enough to look.

    Args:
        runs: all runs; their names differ.
        folder: gets a folder a run.
        device: Warp device.
        workers: make them; shut down at the end.
        quiet: whether to say nothing.

    Returns: the runs that raised, and what; the others are made all the same.
    """
    if not quiet and len(runs) > MANY:
        print(f"{len(runs)} runs; looking for what is done already", flush=True)
    missing, failed = _missing(runs, folder)
    cost = dict.fromkeys(missing, 1.0)
    if len(missing) <= MANY:
        cost = {run: run.cost() for run in missing}
        missing.sort(key=cost.get, reverse=True)
    if not quiet:
        done = len(runs) - len(missing) - len(failed)
        print(f"{len(runs)} runs, {done} of them done already, in {folder}/", flush=True)
    show = not quiet and sys.stderr.isatty()
    form = "{percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"
    with bar(show, total=sum(cost.values()), bar_format=form) as shown, workers:
        failed |= _Queue(missing, cost, folder, device, workers, shown, quiet).make()
    return failed


def _missing(runs: Sequence[SceneRun], folder: Path) -> tuple[list[SceneRun], dict[SceneRun, BaseException]]:
    """The runs to make, and those whose folder can not be read, which stay as they are."""
    there = set(os.listdir(folder)) if folder.is_dir() else set()
    missing, unreadable = [], {}
    for run in runs:
        try:
            if run.name not in there or not run.done(folder / run.name):
                missing.append(run)
        except DamagedError as error:
            unreadable[run] = error
    return missing, unreadable


class _Queue:
    """Runs under way, and those that wait: a few more are handed out than can be made at once."""

    def __init__(self, missing, cost, folder, device, workers, bar, quiet):
        self._missing, self._cost, self._folder, self._device = missing, cost, folder, device
        self._workers, self._bar, self._quiet = workers, bar, quiet
        self._begin, self._finished, self._ready = clock.perf_counter(), 0, 0.0

    def make(self) -> dict[SceneRun, BaseException]:
        """Make all; the runs that raised, and what."""
        waiting, pending, failed = iter(self._missing), {}, {}
        try:
            while True:
                for run in itertools.islice(waiting, AT_ONCE - len(pending)):
                    pending[self._workers.submit(run.make, self._folder / run.name, self._device)] = run
                if not pending:
                    return failed
                timeout = None if self._bar.disable else POLL
                for future in wait(pending, timeout=timeout, return_when=FIRST_COMPLETED).done:
                    run, error = pending.pop(future), future.exception()
                    if error is not None:
                        failed[run] = error
                    self._say(run, error)
                self._show([run for future, run in pending.items() if future.running()])
        except BaseException:  # an interrupt above all: what is done stays
            if isinstance(self._workers, Processes):
                self._workers.stop()
            for future in pending:
                future.cancel()
            raise

    def _say(self, run: SceneRun, error: BaseException | None) -> None:
        self._finished, self._ready = self._finished + 1, self._ready + self._cost[run]
        if not self._quiet:
            elapsed, reason = clock.perf_counter() - self._begin, "" if error is None else f": {error}"
            line = f"[{self._finished}/{len(self._missing)}] {run.name} ({elapsed:.0f} s){reason}"
            self._bar.write(line, file=sys.stdout)
            sys.stdout.flush()

    def _show(self, running: Sequence[SceneRun]) -> None:
        if not self._bar.disable:
            part = sum(self._cost[run] * run.progress(self._folder / run.name) for run in running)
            self._bar.set_postfix_str(", ".join(run.name for run in running), refresh=False)
            self._bar.n = self._ready + part
            self._bar.refresh()


def _begin(threads: int, environment: Mapping[str, str]) -> None:
    for each in TERMINAL:  # the parent's business
        signal.signal(each, signal.SIG_IGN)
    os.environ.setdefault(THREADS, str(threads))
    os.environ.update(environment)
    end_with_parent()
