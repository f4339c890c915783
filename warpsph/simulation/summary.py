"""The summary of a run as one JSON file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import warp as wp

from ..scene.check import Check
from ..storage.files import write_whole
from .simulation import Simulation


def summarise(
    simulation: Simulation,
    parameters: Mapping[str, object],
    checks: Sequence[Check],
    wall_time: float,
    version: str,
    error: str | None = None,
    stopped: bool = False,
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
        "stopped": stopped,
        "error": error,
        "checks": [check.as_dict() for check in checks],
    }


def write_json(path: Path, content: Mapping) -> None:
    """Write a JSON file whole or not at all; non-finite numbers become null."""
    text = json.dumps(_finite(content), indent=2, ensure_ascii=False) + "\n"
    write_whole(path, lambda file: file.write(text.encode("utf-8")))


def _finite(value):
    if isinstance(value, Mapping):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
