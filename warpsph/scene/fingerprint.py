"""A scene's fingerprint: equal for scenes that compute and record the same, however they were written."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from ..validate import TimeFunction
from .scene import Scene

# Functions of time may be any code: they are compared by their values at so many times.
SAMPLES = 257


def fingerprint(scene: Scene) -> str:
    """SHA-256 of the resolved scene as hexadecimal digits.

    Nodes, cells, resolved conditions, initial fields, material (functions of position by the initial values they
    give), numerics, loads and the history's columns count; names, pictures and checks do not. What the probes
    compute is in `Scene.probe_identities`.
    """
    digest = hashlib.sha256()
    for name, value in _parts(scene):
        values = np.ascontiguousarray(value) if isinstance(value, np.ndarray) else None
        text = repr(value) if values is None else f"{values.dtype.str}{values.shape}"
        digest.update(f"{name}={text};".encode())
        if values is not None:
            digest.update(values.tobytes())
    return digest.hexdigest()


def _parts(scene: Scene) -> Iterator[tuple[str, object]]:
    mesh, output = scene.mesh, scene.output
    times = np.linspace(0.0, scene.duration, SAMPLES).tolist()
    yield from (("nodes", mesh.nodes), ("cells", mesh.cells), ("faces", mesh.faces))
    yield "rigid_cells", scene.rigid_cells
    for name in ("boundary", "loads"):
        table = getattr(scene, name)
        for entry in fields(table):
            if entry.name != "functions":
                yield f"{name}.{entry.name}", getattr(table, entry.name)
        yield f"{name}.functions", np.array([_sample(function, times) for function in table.functions])
    for tool in scene.tools:
        own = {name: value for name, value in vars(tool).items() if name != "velocity"}
        motion = [_sample(function, times) for function in tool.velocity or ()]
        yield "tool", (type(tool).__name__, own, motion)
    yield from (("velocity", scene.initial_velocity), ("stress", scene.initial_stress))
    force = scene.body_force
    yield "body_force", None if force is None else np.array([force(t) for t in times])
    material = scene.material
    own = {name: value for name, value in vars(material).items() if not callable(value)}
    yield from (("material", (type(material).__name__, own)), ("internals", scene.initial_internals))
    for name in ("numerics", "damping", "large_displacements", "free_surface", "duration"):
        yield name, getattr(scene, name)
    yield "columns", [(probe.name, probe.unit) for probe in output.probes]
    yield "interval", output.interval


def _sample(function: TimeFunction, times: list[float]) -> list[float]:
    return [float(function(t)) if callable(function) else float(function) for t in times]
