"""Launching kernels: on the CPU split over threads, and recorded sequences of them replayed at next to no cost.

Warp runs a CPU kernel on one thread, but lets go of Python's lock meanwhile. So a kernel here takes the number of
its first element as its first argument, and each thread launches it over a range of its own. Kernels gather and
never scatter: what a thread writes no other one writes, and results do not depend on the number of threads.

A launch from Python costs 10 to 20 µs, one replayed from a recording 0.1 to 0.3 µs: below 10⁴ nodes that decides.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, Protocol

import warp as wp

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
    """Each thread replays its share of a phase, then waits for the others."""

    def __init__(self, launcher: Launcher, phases: list[list[_Launch]], going: wp.array):
        self._phases, self._together, self._going = phases, launcher._together, going
        self._graphs = [
            [_share(phase, thread, launcher) for phase in phases] for thread in range(launcher.threads)
        ]
        self._barrier = threading.Barrier(launcher.threads)

    def run(self) -> None:
        """Replay while the flag is not zero."""
        self._barrier.reset()  # a run before this one may have failed
        self._together(self._replay)

    def _replay(self, thread: int) -> None:
        try:
            while self._going.numpy()[0]:
                for graph in self._graphs[thread]:
                    if graph is not None:
                        wp.capture_launch(graph)
                    self._barrier.wait()
        except threading.BrokenBarrierError:
            pass  # another thread failed, and says why
        except BaseException:
            self._barrier.abort()
            raise


def _share(phase: list[_Launch], thread: int, launcher: Launcher) -> wp.Graph | None:
    if thread and all(launch.over.shape[0] < SMALLEST_SHARE * launcher.threads for launch in phase):
        return None
    with wp.ScopedCapture(device=launcher.device) as capture:
        for launch in phase:
            launch.part(thread, launcher.threads, launcher.device)
    return capture.graph
