"""How kernels are compiled, and loading them before they are needed."""

import sys
import tempfile
from collections.abc import Callable, Iterable

import warp as wp

# Fused multiplications and additions, and −0 taken for 0, gain a tenth; NaN and infinities stay what they are. The
# stack is aligned for vector registers: else a thread is up to an eighth slower, as its stack happens to begin.
CPU_FLAGS = "-ffp-contract=fast -fno-signed-zeros -mstackrealign"


def forward_kernel(function: Callable) -> wp.Kernel:
    """`wp.kernel` in a module of its own, without derivatives, with `CPU_FLAGS` after those set for Warp."""
    given = wp.config.cpu_compiler_flags
    flags = f"{'-march=native' if given is None else given} {CPU_FLAGS}"
    return wp.kernel(module="unique", enable_backward=False, module_options={"cpu_compiler_flags": flags})(
        function
    )


def load_kernels(kernels: Iterable[wp.Kernel], device: wp.Device) -> None:
    """Compile the kernels (or fetch them from Warp's cache), so that no step has to wait for them.

    One after the other: each thread that compiles reads Warp's headers first, as long as ten kernels take. A
    cache that has them all need not be writable; where one is missing and can not be stored, another is used.
    """
    modules = list({kernel.module: None for kernel in kernels})
    try:
        wp.force_load(device=device, modules=modules)
    except OSError as error:
        use_temporary_cache(error)
        wp.force_load(device=device, modules=modules)


def use_temporary_cache(error: OSError) -> None:
    """Make Warp keep this run's kernels in a temporary folder, and say why."""
    folder = wp.config.kernel_cache_dir = tempfile.mkdtemp(prefix="warpsph-kernels-")
    print(
        f"warpsph: Warp's kernel cache can not be written ({error}); using {folder} for this run. "
        f"Set WARP_CACHE_PATH to a writable folder to keep compiled kernels.",
        file=sys.stderr,
    )
