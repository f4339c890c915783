"""Signals that ask a run to stop: it does after the step it is in, with a checkpoint."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator, Sequence

from ..errors import StoppedError
from ..simulation.checkpoint import Checkpoints
from ..simulation.simulation import Simulation

# Ctrl-C and a terminal that was closed: every process of the terminal gets them.
TERMINAL = (signal.SIGINT, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []))
SIGNALS = (*TERMINAL, signal.SIGTERM)  # and a request to end


@contextlib.contextmanager
def handled(handler: Callable[[int, object], None], signals: Sequence[int] = SIGNALS) -> Iterator[None]:
    """Signals that end a process go to a handler meanwhile; those that are ignored stay so.

    Only a main thread can do this; elsewhere nothing changes.
    """
    previous = {}
    if threading.current_thread() is threading.main_thread():
        for each in signals:
            if signal.getsignal(each) is not signal.SIG_IGN:  # a worker leaves interrupts to its parent
                previous[each] = signal.signal(each, handler)
    try:
        yield
    finally:
        for each, former in previous.items():
            signal.signal(each, former)


@contextlib.contextmanager
def _raising(
    error: Callable[[int], KeyboardInterrupt], signals: Sequence[int], tell: Callable[[], None] = lambda: None
) -> Iterator[None]:
    """Signals raise an error meanwhile, after `tell` was called.

    Libraries may make another error of it, as of one that comes while they are imported: that one counts no more.
    """
    came: list[int] = []

    def stop(number: int, frame: object) -> None:
        came.append(number)
        tell()
        raise error(number)

    with handled(stop, signals):
        try:
            yield
        except Exception:
            if came:
                raise error(came[0]) from None
            raise


def interruptible() -> contextlib.AbstractContextManager[None]:
    """Ctrl-C raises a `KeyboardInterrupt` meanwhile, whatever it does before and afterwards."""
    return _raising(lambda number: KeyboardInterrupt(), (signal.SIGINT,))


class Interrupt(KeyboardInterrupt):
    """A signal that ends a process came.

    Attributes:
        status: exit status that says so, 128 + the signal's number.
    """

    def __init__(self, number: int):
        self.status = 128 + number


def status_of(stop: KeyboardInterrupt) -> int:
    """Exit status of a command that was interrupted: by that signal, or by Ctrl-C."""
    return getattr(stop, "status", 128 + signal.SIGINT)


def interrupting(tell: Callable[[], None] = lambda: None) -> contextlib.AbstractContextManager[None]:
    """Every signal that ends a process raises an `Interrupt` meanwhile, after `tell` was called."""
    return _raising(Interrupt, SIGNALS, tell)


@contextlib.contextmanager
def waiting() -> Iterator[None]:
    """Signals that end a process wait meanwhile.

    So must those that come while a library in C++ is imported: it drops the error, says something of its own, and
    goes on with half of itself.
    """
    came: list[int] = []
    with handled(lambda number, frame: came.append(number)):
        yield
    if came:
        signal.raise_signal(came[0])


@contextlib.contextmanager
def starting_processes() -> Iterator[None]:
    """Signals wait meanwhile; processes that are started begin deaf to those of the terminal.

    A mask alone would not do: it is one thread's, and any other one may get a signal for it.
    """
    with waiting():
        former = signal.pthread_sigmask(signal.SIG_BLOCK, TERMINAL) if hasattr(signal, "pthread_sigmask") else ()
        try:
            yield
        finally:
            if hasattr(signal, "pthread_sigmask"):
                signal.pthread_sigmask(signal.SIG_SETMASK, former)


class Stopper:
    """An observer that writes the checkpoints, and ends the run with one when a signal asked for it.

    A second signal does not wait for the step to end.

    Args:
        checkpoints: writes them.
        again: the command that goes on from there.
    """

    def __init__(self, checkpoints: Checkpoints, again: str):
        self._checkpoints, self._again, self._asked = checkpoints, again, None

    @property
    def next_time(self) -> float:
        """When the next checkpoint may be due [s]."""
        return self._checkpoints.next_time

    def ask(self, number: int, frame: object) -> None:
        """Handle a signal."""
        if self._asked is not None:
            raise KeyboardInterrupt
        self._asked = number

    def observe(self, simulation: Simulation) -> None:
        """Write a checkpoint when one is due; raise a `StoppedError` when the run was asked to stop."""
        if self._asked is None:
            self._checkpoints.observe(simulation)
            return
        written = self._checkpoints.write(simulation)
        then = f"go on with: {self._again}" if written else "without a checkpoint"
        raise StoppedError(
            f"stopped after step {simulation.steps}, t = {simulation.time:.6g} s; {then}", self._asked
        )
