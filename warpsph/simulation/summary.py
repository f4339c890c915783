"""The summary of a run as one JSON file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import warp as wp

from ..scene.check import Check
from ..state.energy import UNITS
from ..storage.reading import checked, read_json
from .simulation import Simulation


def summarise(
    simulation: Simulation,
    parameters: Mapping[str, object],
    checks: Sequence[Check],
    wall_time: float,
    version: str,
    error: str | None = None,
    stopped: bool = False,
    history: str | None = None,
) -> dict:
    """What `summary.json` says.

    Args:
        simulation: the run.
        parameters: the scene's parameters, name → value.
        checks: its checks.
        wall_time: seconds of the whole run with its observers, without compilation.
        version: of warpsph.
        error: why the run broke down, or None.
        stopped: whether it was asked to stop on its way.
        history: digest of the history that belongs to it.
    """
    stepped = simulation.steps > 0
    rate = len(simulation.mesh.nodes) * simulation.steps / simulation.wall_time if stepped else 0.0
    return {
        "scene": simulation.scene.name,
        "parameters": dict(parameters),
        "warpsph_version": version,
        "warp_version": wp.config.version,
        "device": simulation.device.alias,
        "device_name": simulation.device.name,
        "threads": simulation.threads,
        "precision": simulation.precision.name,
        "nodes": len(simulation.mesh.nodes),
        "auxiliary_nodes": len(simulation.mesh.cells),
        "steps": simulation.steps,
        "time_step": {
            "min": simulation.shortest_step if stepped else None,
            "max": simulation.longest_step if stepped else None,
        },
        "simulated_time": simulation.time,
        "wall_time": wall_time,
        "node_steps_per_second": rate,
        "neighbour_list_builds": simulation.list_builds,
        "energy": _energy(simulation),
        "stopped": stopped,
        "error": error,
        "history": history,
        "checks": [check.as_dict() for check in checks],
    }


def _energy(simulation: Simulation) -> dict[str, object] | None:
    """The energy balance at the end, its unit, and what is unaccounted for as a share of the largest energy."""
    balance = simulation.energy()
    if balance is None:
        return None
    largest = max(simulation.largest_energy, balance.largest) or 1.0
    numbers = asdict(balance) | {
        "unaccounted": balance.unaccounted,
        "unaccounted_share": balance.unaccounted / largest,
    }
    told = {name: value if math.isfinite(value) else None for name, value in numbers.items()}
    return {"unit": UNITS[simulation.mesh.dim]} | told


def read_summary(path: Path) -> dict:
    """What `summary.json` says, as far as others rely on it.

    Raises:
        SceneError: it is not there, or not as `summarise` makes it.
    """
    return checked("summary", path, read_json("summary", path), RULES)


def _text(value: object) -> bool:
    return isinstance(value, str)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _count(value: object) -> bool:
    return isinstance(value, int) and 0 <= value < 10**18


def _check(value: object) -> bool:
    return (
        isinstance(value, dict)
        and all(_text(value.get(name)) for name in ("name", "unit"))
        and all(value.get(name) is None or _number(value[name]) for name in ("value", "reference", "error"))
        and isinstance(value.get("passed"), bool)
    )


RULES = {
    **dict.fromkeys(("scene", "warpsph_version", "device", "device_name"), _text),
    **dict.fromkeys(("nodes", "steps"), _count),
    **dict.fromkeys(("simulated_time", "wall_time", "node_steps_per_second"), _number),
    **dict.fromkeys(("error", "history"), lambda value: value is None or _text(value)),
    "stopped": lambda value: isinstance(value, bool),
    "parameters": lambda value: isinstance(value, dict),
    "checks": lambda value: isinstance(value, list) and all(map(_check, value)),
}
