"""Output streams that never end a run: closed, full or of another encoding, what they do not take is dropped."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from typing import TextIO


class Steady(io.TextIOBase):
    """A text stream that writes to another as long as that works.

    Args:
        stream: the other one; None where the process has none.
    """

    def __init__(self, stream: TextIO | None):
        self._stream = stream
        # A letter that it can not show is written otherwise. What waits in it is written first, and may not go.
        self._try(lambda: stream.reconfigure(errors="backslashreplace"))

    @property
    def encoding(self) -> str:
        """Encoding of the other stream."""
        return getattr(self._stream, "encoding", None) or "utf-8"

    def writable(self) -> bool:
        """Always."""
        return True

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        return bool(self._try(lambda: self._stream.isatty()))

    def fileno(self) -> int:
        """Number of the other stream's file."""
        if self._stream is None:
            raise io.UnsupportedOperation("fileno")
        return self._stream.fileno()

    def write(self, text: str) -> int:
        """Write what can be written."""
        self._try(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        """Bring it out; what does not go is dropped, or it would be tried again at the end."""
        if self._stream is not None and self._try(self._flush) is None and not self._stream.closed:
            with contextlib.suppress(OSError, ValueError):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, self._stream.fileno())
                os.close(nowhere)
                self._stream.flush()

    def _flush(self) -> bool:
        self._stream.flush()
        return True

    def _try(self, task):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            return task()


@contextlib.contextmanager
def steady_streams() -> Iterator[None]:
    """Standard output and error are `Steady` meanwhile; a process that was started without them gets none."""
    _fill_closed()
    former = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = Steady(former[0]), Steady(former[1])
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = former


def _fill_closed() -> None:
    """Open the null device where a standard stream is closed; else the next file to be opened is in its place."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free
