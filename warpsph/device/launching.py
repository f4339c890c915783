"""Launching kernels: on the CPU split over threads, and recorded sequences of them replayed at next to no cost.

Warp runs a CPU kernel on one thread, but lets go of Python's lock meanwhile. So a kernel here takes the number of
its first element as its first argument, and each thread launches it over a range of its own. Kernels gather and
never scatter: what a thread writes no other one writes, and results do not depend on the number of threads.

A launch from Python costs 10 to 20 µs, one replayed from a recording 0.1 to 0.3 µs: below 10⁴ nodes that decides.
"""

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple, Protocol

import warp as wp

from ..errors import SceneError

# Fewer elements than this are not worth a second thread.
SMALLEST_SHARE = 64


class Recording(Protocol):
    """A recorded sequence of launches."""

    def run(self) -> None:
        """Replay it while the flag it was recorded with is not zero; one of its own kernels must clear that."""


class _Launch(NamedTuple):
    kernel: wp.Kernel
    over: wp.array  # whose elements the kernel writes: its domain
    inputs: Sequence

    def part(self, thread: int, threads: int, device: wp.Device) -> None:
        """Launch what one of the threads has to do."""
        size = self.over.shape[0]
        shares = threads if size >= SMALLEST_SHARE * threads else 1
        if thread >= shares:
            return
        first, end = size * thread // shares, size * (thread + 1) // shares
        if end > first:
            wp.launch(self.kernel, end - first, inputs=[first, *self.inputs], device=device)


class Launcher:
    """Launches kernels on a device.

    Args:
        device: the Warp device.
        threads: number of threads; a GPU needs one.

    Attributes:
        device: the Warp device.
    """

    def __init__(self, device: wp.Device, threads: int = 1):
        self.device = device
        self._process = os.getpid()
        self._helpers = tuple(range(1, threads if device.is_cpu else 1))
        self._pool = ThreadPoolExecutor(len(self._helpers)) if self._helpers else None
        self._recorded: list[list[_Launch]] | None = None

    @property
    def threads(self) -> int:
        """Number of threads."""
        return 1 + len(self._helpers)

    def launch(self, kernel: wp.Kernel, over: wp.array, inputs: Sequence, gathers: bool = True) -> None:
        """Launch a kernel over the elements of an array, now or, while `record` listens, later.

        Args:
            kernel: its first argument is the number of its first element.
            over: the array; thread k works on elements that only it has.
            inputs: all further arguments.
            gathers: whether the kernel reads what others have written. One that does not, over the same array as
                the one before it, need not wait for the other threads.
        """
        launch = _Launch(kernel, over, inputs)
        if self._recorded is None:
            self._together(lambda thread: launch.part(thread, self.threads, self.device))
        elif not gathers and self._recorded and self._recorded[-1][-1].over.ptr == over.ptr:
            self._recorded[-1].append(launch)
        else:
            self._recorded.append([launch])

    def record(self, sequence: Callable[[], None], going: wp.array) -> Recording:
        """Record the launches of a function, without running them.

        Args:
            sequence: calls `launch`, and does nothing else on the device.
            going: one integer on the device, see `Recording.run`.
        """
        self._recorded = []
        try:
            sequence()
            phases = self._recorded
        finally:
            self._recorded = None
        if self._helpers or not _loops_itself(self.device):
            return _Lockstep(self, phases, going)
        return _Loop(self, phases, going)

    def _together(self, task: Callable[[int], None]) -> None:
        """Do a task on every thread, this one included, and wait for all."""
        if self._helpers and os.getpid() != self._process:
            allowed = (
                "a forked process has no threads of its parent's; make the simulation there, or with threads=1"
            )
            raise SceneError("threads", self.threads, allowed)
        others = [self._pool.submit(task, thread) for thread in self._helpers]
        try:
            task(0)
        finally:
            for other in others:
                other.result()


def _loops_itself(device: wp.Device) -> bool:
    """Whether a recording can hold a loop; CUDA can from driver 12.4 on."""
    return device.is_cpu or wp.is_conditional_graph_supported()


class _Loop:
    """The loop is part of the recording: nothing goes through the host until it ends."""

    def __init__(self, launcher: Launcher, phases: list[list[_Launch]], going: wp.array):
        self._phases = phases  # holds the arrays

        def once() -> None:
            for phase in phases:
                for launch in phase:
                    launch.part(0, 1, launcher.device)

        with wp.ScopedCapture(device=launcher.device) as capture:
            wp.capture_while(going, once)
        self._graph = capture.graph

    def run(self) -> None:
        """Replay while the flag is not zero."""
        wp.capture_launch(self._graph)


class _Lockstep:
    """Each thread replays its share of a phase, then waits for the others.

    Phases too small for that are replayed by the one who comes last, while the others still wait.
    """

    def __init__(self, launcher: Launcher, phases: list[list[_Launch]], going: wp.array):
        self._phases, self._together, self._going = phases, launcher._together, going
        threads = launcher.threads
        shared: list[list[_Launch]] = []
        alone: list[list[_Launch]] = []  # what is done after the shared phase in the same place
        for phase in phases:
            small = all(launch.over.shape[0] < SMALLEST_SHARE * threads for launch in phase)
            if not small or not shared:
                shared.append([] if small else phase)
                alone.append([])
            if small:
                alone[-1] += phase
        self._graphs = [[_graph(phase, k, threads, launcher) for phase in shared] for k in range(threads)]
        self._barriers = [
            threading.Barrier(threads, partial(_replay, _graph(phase, 0, 1, launcher))) for phase in alone
        ]

    def run(self) -> None:
        """Replay while the flag is not zero."""
        for barrier in self._barriers:
            barrier.reset()  # a run before this one may have failed
        self._together(self._run)

    def _run(self, thread: int) -> None:
        stages = list(zip(self._graphs[thread], self._barriers, strict=True))
        try:
            while self._going.numpy()[0]:
                for graph, barrier in stages:
                    _replay(graph)
                    barrier.wait()
        except threading.BrokenBarrierError:
            pass  # another thread failed, and says why
        except BaseException:
            for barrier in self._barriers:
                barrier.abort()
            raise


def _graph(phase: list[_Launch], thread: int, threads: int, launcher: Launcher) -> wp.Graph | None:
    """What one of the threads has to do in a phase; None for nothing."""
    if not phase:
        return None
    with wp.ScopedCapture(device=launcher.device) as capture:
        for launch in phase:
            launch.part(thread, threads, launcher.device)
    return capture.graph


def _replay(graph: wp.Graph | None) -> None:
    if graph is not None:
        wp.capture_launch(graph)
