"""What a benchmark ran on, and how fast that machine copies memory."""

import platform
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import warp as wp

import warpsph
from warpsph.simulation.device import all_cores

COPY_BYTES = 2**28  # an array's; beyond every cache
REPEATS = 5


def describe() -> dict:
    """Processor, GPUs, cores, memory, versions and commit."""
    return {
        "processor": _processor(),
        "cores": all_cores(),
        "memory_bytes": memory("MemTotal"),
        "gpus": [f"{device.alias}: {device.name}" for device in wp.get_cuda_devices()],
        "system": platform.platform(),
        "python": platform.python_version(),
        "warp": wp.__version__,
        "numpy": np.__version__,
        "warpsph": warpsph.__version__,
        "commit": _commit(),
    }


def memory(entry: str) -> int | None:
    """An entry of /proc/meminfo [bytes], e.g. MemAvailable; None where there is no such file."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith(f"{entry}:")), None)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    return next(
        (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.processor()
    )


def _commit() -> str | None:
    command = ["git", "describe", "--always", "--dirty"]
    try:
        answer = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip()


def copy_bandwidth(device_name: str, threads: int, size: int = COPY_BYTES) -> float:
    """Bytes read and written a second by the best of some plain copies of large arrays, as STREAM counts them."""
    device = wp.get_device(device_name)
    if device.is_cpu:
        seconds = _copy_on_cpu(size, threads)
    else:
        seconds = _copy_on_gpu(4 * size, device) / 4
    return 2 * size / seconds


def _copy_on_cpu(size: int, threads: int) -> float:
    source, target = np.ones(size // 8), np.ones(size // 8)
    parts = [slice(k * len(source) // threads, (k + 1) * len(source) // threads) for k in range(threads)]
    best = float("inf")
    for _ in range(REPEATS):
        copiers = [threading.Thread(target=np.copyto, args=(target[part], source[part])) for part in parts]
        begin = time.perf_counter()
        for copier in copiers:
            copier.start()
        for copier in copiers:
            copier.join()
        best = min(best, time.perf_counter() - begin)
    return best


def _copy_on_gpu(size: int, device: wp.Device) -> float:
    source, target = (wp.zeros(size, dtype=wp.uint8, device=device) for _ in range(2))
    best = float("inf")
    for _ in range(REPEATS):
        wp.synchronize_device(device)
        begin = time.perf_counter()
        wp.copy(target, source)
        wp.synchronize_device(device)
        best = min(best, time.perf_counter() - begin)
    return best
