"""A process that was started for another one ends with it, however that ends."""

from __future__ import annotations

import os
import signal
import threading
import time

PARENT = "WARPSPH_PARENT"  # the environment variable that says which process one was started for
LOOK = 0.5  # [s]


def for_child() -> dict[str, str]:
    """What the environment of a process must say that is to end with this one."""
    return {PARENT: str(os.getpid())}


def end_with_parent() -> None:
    """Be asked to end, as by a terminal, when the process is gone that this one was started for, if any."""
    parent = os.environ.pop(PARENT, "")  # its own children are started for it
    if parent.isdecimal() and hasattr(os, "getppid"):
        threading.Thread(target=_watch, args=(int(parent),), daemon=True, name="parent").start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK)
    os.kill(os.getpid(), signal.SIGTERM)
