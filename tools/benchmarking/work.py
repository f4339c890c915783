"""What is done in a process of its own: its memory is its own, threads are set once, a failure stays one."""

import json
import time

import warp as wp

from warpsph import Simulation
from warpsph.errors import WarpSPHError
from warpsph.simulation.device import start_warp

from . import counting, machine, timing
from .scenes import Case, scene


def work(job: str) -> None:
    """Do a job, {"do": name, …}, and print what came out of it as one line of JSON."""
    start_warp()
    job = json.loads(job)
    try:
        result = JOBS[job.pop("do")](**job)
    except (WarpSPHError, MemoryError, RuntimeError) as error:
        result = {"failed": " ".join(f"{type(error).__name__}: {error}".split())[:300]}
    print(json.dumps(result))


def time_case(case: dict, seconds: float) -> dict:
    """Everything that is measured of one case."""
    case = Case(**case)
    empty = counting.peak_host_memory()
    begin = time.perf_counter()
    simulation = Simulation(scene(case), case.device, case.precision, case.threads)
    ready = time.perf_counter() - begin
    n = len(simulation.mesh.nodes)
    result = {"lattice_nodes": n, **timing.time_steps(simulation, seconds), "build_seconds": ready}
    result["node_steps_per_second"] = n / result["seconds_per_step"]
    result["phases"] = timing.time_phases(simulation)
    moved = counting.bytes_per_node_step(simulation)
    result |= {
        "bytes_per_node_step": sum(moved.values()),
        "bytes_by_phase": moved,
        "bytes_per_second": sum(moved.values()) * result["node_steps_per_second"],
        "memory_per_node": counting.memory_per_node(simulation),
        "host_peak_per_node": (counting.peak_host_memory() - empty) / n,
    }
    return result


def start_up(case: dict) -> dict:
    """Seconds to a first step, without imports; the kernel cache is whatever the environment says."""
    case = Case(**case)
    begin = time.perf_counter()
    simulation = Simulation(scene(case), case.device, case.precision, case.threads)
    built = time.perf_counter()
    simulation.step()
    wp.synchronize_device(simulation.device)
    return {
        "build_seconds": built - begin,
        "first_step_seconds": time.perf_counter() - built,
    }


def devices() -> dict:
    """The machine, and the names of the devices that Warp finds on it."""
    return {"machine": machine.describe(), "devices": [device.alias for device in wp.get_devices()]}


def copy(device: str, threads: int) -> dict:
    """Bandwidth of plain copies."""
    return {"bytes_per_second": machine.copy_bandwidth(device, threads)}


JOBS = {"case": time_case, "start": start_up, "devices": devices, "copy": copy}
