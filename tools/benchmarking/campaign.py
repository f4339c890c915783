"""Runs a campaign: every case in a process of its own, the results kept after each."""

import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

from warpsph.simulation.device import all_cores

from .machine import memory
from .others import ADAPTERS
from .scenes import Case
from .timing import INTERVAL

COMMAND = Path(__file__).resolve().parent.parent / "benchmark.py"
HEADLINE = {"dimension": 2, "material": "viscoplastic", "nodes": 100_000}
START_NODES = 1000
TOLD = {"node_steps_per_second": "node-steps/s", "bytes_per_second": "bytes/s", "seconds": "s"}
MEMORY_SHARE = 0.8  # of what is free that a case may be expected to take
FEWEST_DIGITS = 1e-5  # a spacing below this part of the body leaves float32 no digits for the neighbours


@dataclass(frozen=True)
class Plan:
    """What to measure.

    Attributes:
        dimensions, materials, precisions, nodes: every combination is timed.
        devices: Warp device names; those that Warp finds when empty.
        threads: numbers of threads of CPU kernels.
        seconds: time to fill with steps, a case.
        limit: longest that a case may be expected to take [s]; longer ones are skipped.
        focus: all that for the headline's dimension and material; the others in float64 at the middle size only.
        copies, starts: whether to measure copies of memory and start-up times.
        others: name of an adapter → interpreter that has the solver.
        other_nodes: number of particles for those.
    """

    dimensions: tuple[int, ...] = (1, 2, 3)
    materials: tuple[str, ...] = ("elastic", "viscoplastic")
    precisions: tuple[str, ...] = ("float32", "float64")
    nodes: tuple[int, ...] = (1000, 10_000, 100_000, 1_000_000, 10_000_000)
    devices: tuple[str, ...] = ()
    threads: tuple[int, ...] = (1, all_cores())
    seconds: float = 3.0
    limit: float = 600.0
    focus: bool = False
    copies: bool = True
    starts: bool = True
    others: tuple[tuple[str, str], ...] = ()
    other_nodes: int = HEADLINE["nodes"]


def run(plan: Plan, command: Sequence[str], out: Path, say: Callable[[str], None]) -> dict:
    """Measure everything in the plan; write the results to `out` after each measurement, and return them."""
    found = _job("devices")
    report = {
        "date": time.strftime("%Y-%m-%d %H:%M:%S %z"),
        "command": " ".join(command),
        "machine": found["machine"],
        "copies": [],
        "starts": [],
        "results": [],
        "skipped": [],
        "others": [],
    }
    _keep(report, out)
    places = _places(plan.devices or tuple(found["devices"]), plan.threads)
    for device, threads in places:
        if plan.copies:
            _measure(report, "copies", {"device": device, "threads": threads}, _copy, out, say)
        if plan.starts and device not in {row["device"] for row in report["starts"]}:
            _starts(report, device, threads, out, say)
    for series in _series(plan, places):
        last = None
        for case in series:
            last = _time_case(report, case, last, plan, out, say)
    for name, interpreter in plan.others:
        for threads in sorted(set(plan.threads)):
            key = {"adapter": name, "threads": threads}
            _measure(report, "others", key, _other(name, interpreter, plan.other_nodes), out, say)
    return report


def _places(devices: Iterable[str], threads: Iterable[int]) -> list[tuple[str, int]]:
    """(device, threads) to run on; a GPU has one of the latter only."""
    return [(device, n) for device in devices for n in (sorted(set(threads)) if device == "cpu" else [1])]


def _series(plan: Plan, places: Iterable[tuple[str, int]]) -> list[list[Case]]:
    """The cases, those that differ in size only together, ascending."""
    variants = product(plan.dimensions, plan.materials, plan.precisions, places)
    sizes = sorted(plan.nodes)
    series = []
    for dimension, material, precision, (device, threads) in variants:
        chosen = sizes
        if plan.focus and (dimension, material) != (HEADLINE["dimension"], HEADLINE["material"]):
            chosen = [sizes[len(sizes) // 2]] if precision == "float64" else []
        series.append([Case(dimension, material, precision, device, threads, n) for n in chosen])
    return series


def _time_case(report: dict, case: Case, last: dict | None, plan: Plan, out: Path, say) -> dict | None:
    """Time a case unless it can not be; its row, or that of the last case of the series that could be timed."""
    key, why = asdict(case), _too_much(case, last, plan)
    if why:
        report["skipped"].append({**key, "why": why})
        say(f"{case}: skipped, {why}")
        return last
    row = _measure(report, "results", key, lambda **case: _job("case", case=case, seconds=plan.seconds), out, say)
    if row is None:
        return last
    row["memory_bandwidth_fraction"] = _fraction(row, report["copies"])
    row["growth"] = _growth(row, last)
    _keep(report, out)
    return row


def _too_much(case: Case, last: dict | None, plan: Plan) -> str | None:
    """Why a case should not be tried, if so, judging by the next smaller one."""
    if case.precision == "float32" and case.nodes ** (-1.0 / case.dimension) < FEWEST_DIGITS:
        return f"float32 can not tell neighbours apart at {case.nodes} nodes along one axis"
    if last is None:
        return None
    free, needed = memory("MemAvailable"), last["host_peak_per_node"] * case.nodes
    if free is not None and needed > MEMORY_SHARE * free:
        return f"it would take about {needed / 1e9:.0f} GB of memory, and {free / 1e9:.0f} GB are free"
    # The warm-up, one timed interval and the one for the phases.
    steps = 3 * INTERVAL
    growth = max(1.0, last["growth"] or 1.0)
    expected = steps * last["seconds_per_step"] * (case.nodes / last["nodes"]) ** growth
    if expected > plan.limit:
        return f"it would take about {expected:.0f} s, and the limit is {plan.limit:.0f} s"
    return None


def _fraction(row: dict, copies: list[dict]) -> float | None:
    """Counted bytes a second over those of a plain copy on the same device with the same threads."""
    place = row["device"], row["threads"]
    rates = [copy["bytes_per_second"] for copy in copies if (copy["device"], copy["threads"]) == place]
    return row["bytes_per_second"] / rates[0] if rates else None


def _growth(row: dict, last: dict | None) -> float | None:
    """Exponent with which a step's cost grew from the next smaller case: 1 is proportional to size."""
    if last is None:
        return None
    cost = math.log(row["seconds_per_step"] / last["seconds_per_step"])
    return cost / math.log(row["lattice_nodes"] / last["lattice_nodes"])


def _starts(report: dict, device: str, threads: int, out: Path, say) -> None:
    """The same start twice from a kernel cache that is empty at first."""
    case = Case(HEADLINE["dimension"], HEADLINE["material"], "float64", device, threads, START_NODES)
    with tempfile.TemporaryDirectory(prefix="warpsph-cold-") as folder:
        for state in ("cold", "cached"):
            key = {"device": device, "threads": threads, "cache": state}
            _measure(report, "starts", key, lambda **key: _start(case, folder), out, say)


def _start(case: Case, cache: str) -> dict:
    begin = time.perf_counter()
    result = _job("start", {"WARP_CACHE_PATH": cache}, case=asdict(case))
    return result | {"seconds": time.perf_counter() - begin}


def _copy(device: str, threads: int) -> dict:
    return _job("copy", device=device, threads=threads)


def _other(name: str, interpreter: str, nodes: int) -> Callable[..., dict]:
    def measure(adapter: str, threads: int) -> dict:
        script = str(ADAPTERS[name])
        return _process([interpreter, script, "--nodes", str(nodes), "--threads", str(threads)], {})

    return measure


def _measure(report: dict, part: str, key: dict, job: Callable[..., dict], out: Path, say) -> dict | None:
    """Do a job and keep its row under `part`, or under `skipped` if there is none; the row or None."""
    result = job(**key)
    label = str(Case(**key)) if part == "results" else f"{part}: {', '.join(map(str, key.values()))}"
    why = result.get("failed") or result.get("skipped")
    if why:
        report["skipped"].append({"part": part, **key, "why": why})
        say(f"{label}: skipped, {why}")
    else:
        report[part].append({**key, **result})
        say(f"{label}: " + next(f"{result[name]:.3g} {unit}" for name, unit in TOLD.items() if name in result))
    _keep(report, out)
    return None if why else report[part][-1]


def _job(name: str, environment: dict[str, str] | None = None, **arguments) -> dict:
    """What a job of `work` gives in a fresh process."""
    command = [sys.executable, str(COMMAND), "--work", json.dumps({"do": name, **arguments})]
    return _process(command, environment or {})


def _process(command: Sequence[str], environment: dict[str, str]) -> dict:
    """The JSON object in the last line that a process prints."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})
        return json.loads(done.stdout.splitlines()[-1])
    except OSError as error:
        return {"failed": f"{command[0]} can not be run ({error})"}
    except (IndexError, ValueError):
        last = (done.stderr.strip().splitlines() or ["it printed no result"])[-1]
        return {"failed": f"status {done.returncode}: {last}"}


def _keep(report: dict, out: Path) -> None:
    out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
