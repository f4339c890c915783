"""Runs the members one after the other in this process and keeps each in a CSV file, from which it goes on."""

import csv
import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from warpsph.errors import WarpSPHError

from .cases import CASES
from .settings import NAMES, Setting, parse, variants

FIGURES = ("nodes", "steps", "node_steps", "wall_s", "error")
REPEAT_BELOW = 0.2  # [s]; the first steps of a process with new kernels are slow, and weigh in short runs
HEAD = ("case", *NAMES, *FIGURES, "why")


@dataclass(frozen=True)
class Result:
    """A member that was tried.

    Attributes:
        case: its name in `CASES`.
        setting: its setting.
        nodes, steps, node_steps: its size; 0 when it failed.
        wall_s: seconds in steps, without the start.
        error: as the case defines it [-]; nan when it failed.
        why: why it failed, empty when it did not.
    """

    case: str
    setting: Setting
    nodes: int
    steps: int
    node_steps: int
    wall_s: float
    error: float
    why: str = ""


def members(cases: Iterable[str], rungs: int | None, quick: bool) -> list[tuple[str, Setting]]:
    """Every member of the cases, coarse ones of all first.

    Args:
        cases: names in `CASES`.
        rungs: how many spacings a case at most; all unless given.
        quick: whether only the case's few coarsest.
    """
    ladders = []
    for name in cases:
        case = CASES[name]
        spacings = case.spacings[: case.quick if quick else None][:rungs]
        ladders += [(k, name, spacing) for k, spacing in enumerate(spacings)]
    ladders.sort(key=lambda rung: rung[0])
    return [
        (name, setting)
        for _, name, spacing in ladders
        for setting in variants(spacing, CASES[name].flows, CASES[name].ratios)
    ]


def run(plan: Iterable[tuple[str, Setting]], path: Path, device: str, say: Callable[[str], None]) -> list[Result]:
    """Run what of the plan is not in the file yet; all results of the plan."""
    plan = list(plan)
    done = {(result.case, result.setting): result for result in read(path)} if path.exists() else {}
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        if not path.stat().st_size:
            writer.writerow(HEAD)
        for number, (case, setting) in enumerate(plan, start=1):
            if (case, setting) in done:
                continue
            result = done[case, setting] = _member(case, setting, device)
            figures = (repr(getattr(result, name)) for name in FIGURES)
            writer.writerow((case, *setting.texts(), *figures, result.why))
            file.flush()
            outcome = result.why or f"{100.0 * result.error:.3g} % in {result.wall_s:.2f} s"
            say(f"[{number}/{len(plan)}] {case}, {setting}: {outcome}")
    return [done[member] for member in plan]


def _member(case: str, setting: Setting, device: str) -> Result:
    """One run; what it raises is a failed member, for the others are still wanted."""
    begin = time.perf_counter()
    try:
        simulation, error = CASES[case].run(setting, device)
        wall_time = simulation.wall_time
        if wall_time < REPEAT_BELOW:
            wall_time = min(wall_time, CASES[case].run(setting, device)[0].wall_time)
    except WarpSPHError as refused:
        return _failed(case, setting, begin, str(refused))
    except Exception as broken:  # a member must not end the campaign
        return _failed(case, setting, begin, f"{type(broken).__name__}: {broken}")
    nodes, steps = len(simulation.mesh.nodes), simulation.steps
    if not math.isfinite(error):
        return _failed(case, setting, begin, f"the error is {error}")
    return Result(case, setting, nodes, steps, nodes * steps, wall_time, error)


def _failed(case: str, setting: Setting, begin: float, why: str) -> Result:
    return Result(case, setting, 0, 0, 0, time.perf_counter() - begin, math.nan, " ".join(why.split()))


def read(path: Path) -> Iterator[Result]:
    """The results in a CSV file.

    Raises:
        ValueError: it is not a file of this tool.
    """
    with path.open(newline="", encoding="utf-8") as file:
        rows = csv.DictReader(file)
        if rows.fieldnames is not None and tuple(rows.fieldnames) != HEAD:
            raise ValueError(f"--out = {path.parent} is not allowed: {path.name} there has other columns")
        for row in rows:
            if row["case"] in CASES and row["why"] is not None:
                figures = (int(row[name]) for name in FIGURES[:3])
                yield Result(
                    row["case"], parse(row), *figures, float(row["wall_s"]), float(row["error"]), row["why"]
                )
