"""One thread of a process works with Warp at a time.

What a thread launches while another one records goes into that recording, and two recordings at once are an error:
both are of the process, not of a thread. So simulations in several threads take turns; between steps they switch.
"""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable

_lock = threading.RLock()


def exclusive(method: Callable) -> Callable:
    """A method that waits until no other thread is in one of these."""

    @functools.wraps(method)
    def alone(*arguments, **options):
        with _lock:
            return method(*arguments, **options)

    return alone


def _renew() -> None:
    global _lock
    _lock = threading.RLock()  # the thread that may have held it is not in the new process


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew)
