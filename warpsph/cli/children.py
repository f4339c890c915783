"""The processes that a sweep has started: told to stop together when it is."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Mapping, Sequence
from typing import IO

from .parent import for_child

INTERRUPTED = 128 + signal.SIGINT


class Children:
    """Commands in processes of their own, which only their parent passes signals on to."""

    def __init__(self):
        self._running: set[subprocess.Popen] = set()
        self._stopping = threading.Event()

    def begin(self) -> None:
        """Forget that they were stopped before."""
        self._stopping.clear()

    def call(self, command: Sequence[str], output: IO, environment: Mapping[str, str]) -> int:
        """Exit status of a command; the negative number of the signal that ended it.

        Args:
            command: the command; it is not started any more when all are to stop.
            output: an open file for all it says.
            environment: what is set for it, unless the parent's environment says otherwise.
        """
        if self._stopping.is_set():
            return INTERRUPTED
        process = subprocess.Popen(
            command,
            stdout=output,
            stderr=output,
            start_new_session=True,
            env={**environment, **os.environ, **for_child()},
        )
        self._running.add(process)
        if self._stopping.is_set():  # the signal came just before
            process.terminate()
        try:
            return process.wait()
        finally:
            self._running.discard(process)

    def stop(self) -> None:
        """Ask all to end, and start no more."""
        self._stopping.set()
        for process in list(self._running):
            process.terminate()


CHILDREN = Children()  # of this process
