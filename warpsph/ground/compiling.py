"""Compiling and loading kernels before they are needed, several at a time."""

import inspect
from collections.abc import Iterable

import warp as wp


def load_kernels(kernels: Iterable[wp.Kernel], device: wp.Device) -> None:
    """Compile the kernels (or fetch them from Warp's cache) side by side, so that no step has to wait for them."""
    modules = list({kernel.module: None for kernel in kernels})
    workers = {"max_workers": None} if "max_workers" in inspect.signature(wp.force_load).parameters else {}
    wp.force_load(device=device, modules=modules, **workers)
