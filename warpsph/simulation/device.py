"""Starting Warp and choosing the device."""

from __future__ import annotations

import sys
import tempfile

import warp as wp

from ..errors import SceneError


def start_warp() -> None:
    """Initialise Warp quietly; use a temporary kernel cache where the usual one can not be written."""
    if hasattr(wp.config, "log_level"):
        wp.config.log_level = wp.LOG_ERROR
    else:
        wp.config.quiet = True
    try:
        wp.init()
    except OSError as error:
        folder = tempfile.mkdtemp(prefix="warpsph-kernels-")
        print(
            f"warpsph: Warp's kernel cache can not be written ({error}); using {folder} for this run. "
            f"Set WARP_CACHE_PATH to a writable folder to keep compiled kernels.",
            file=sys.stderr,
        )
        wp.config.kernel_cache_dir = folder
        wp.init()


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
