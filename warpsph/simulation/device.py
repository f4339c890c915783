"""Starting Warp and choosing the device."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile

import warp as wp

from ..device.compiling import use_temporary_cache
from ..errors import SceneError
from ..validate import index

NODES_A_THREAD = 1000  # with fewer, threads wait for each other longer than they work
THREADS = "WARPSPH_THREADS"  # the environment variable that says how many a process may use


def start_warp() -> None:
    """Initialise Warp quietly; use a temporary kernel cache where the usual one can not be written."""
    if hasattr(wp.config, "log_level"):
        wp.config.log_level = wp.LOG_ERROR
    else:
        wp.config.quiet = True
    try:
        with _without_driver_notice():
            wp.init()
    except OSError as error:
        use_temporary_cache(error)
        with _without_driver_notice():
            wp.init()


@contextlib.contextmanager
def _without_driver_notice():
    """Drops the line that Warp's native code prints where there is no CUDA driver; passes on all others."""
    sys.stderr.flush()
    with tempfile.TemporaryFile() as caught:
        try:
            original = os.dup(2)
        except OSError:  # no standard error at all
            yield
            return
        os.dup2(caught.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(original, 2)
            os.close(original)
            caught.seek(0)
            lines = caught.read().decode(errors="replace").splitlines(keepends=True)
            sys.stderr.write("".join(line for line in lines if "CUDA driver" not in line))


def choose_device(name: str | None) -> wp.Device:
    """The Warp device of that name; the first CUDA device, or else the CPU, when None.

    Raises:
        SceneError: there is no such device.
    """
    start_warp()
    if name is None:
        name = "cuda:0" if wp.get_cuda_device_count() else "cpu"
    available = [device.alias for device in wp.get_devices()]
    try:
        return wp.get_device(name)
    except Exception:  # Warp raises ValueError, RuntimeError or TypeError, by version
        raise SceneError("device", name, f"it must be one of {', '.join(available)}") from None


def all_cores() -> int:
    """Number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def choose_threads(threads: int | None, n: int) -> int:
    """Number of CPU threads for n nodes: as many as are given, or else as pay off, at most `WARPSPH_THREADS`.

    Raises:
        SceneError: `threads`, or the environment variable, is not a whole number above 0.
    """
    if threads is not None:
        return index("threads", threads, at_least=1)
    most = os.environ.get(THREADS, str(all_cores()))
    if not most.isdecimal() or int(most) < 1:
        raise SceneError(THREADS, most, "it must be a whole number, at least 1")
    return max(1, min(int(most), n // NODES_A_THREAD))
