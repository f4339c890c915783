"""Runs one scene file: progress, history, checks, pictures, summary."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Protocol

from .. import __version__
from ..errors import NonFiniteError, SceneError, StoppedError
from ..export.pictures.field import plot_field
from ..export.pictures.history import plot_history
from ..export.pictures.surface import plot_surface
from ..scene.check import Check
from ..scene.output import component
from ..scene.scene import Scene
from ..simulation.history import History
from ..simulation.simulation import Observer, Simulation
from ..simulation.summary import summarise, write_json
from .catalogue import SceneFile
from .progress import Progress
from .restart import Restart
from .settings import Settings
from .stored import StoredScene, store

SUMMARY = "summary.json"
PICTURES = ("history.png", "field.png", "surface.png")


class ClosingObserver(Observer, Protocol):
    """An observer that finishes its work when the run ends, however it ends."""

    def close(self) -> None:
        """Finish."""


def run(
    file: SceneFile | StoredScene,
    scene: Scene,
    parameters: Mapping[str, object],
    settings: Settings,
    folder: Path,
    *,
    quiet: bool,
    watching: Sequence[Callable[[Simulation], ClosingObserver]] = (),
    restart: Restart | None = None,
) -> bool:
    """Run a scene and write its results into a folder; True when it finished and all checks passed.

    `watching` makes further observers of the simulation; they are closed before the summary is written. `restart`
    goes on from a checkpoint and writes new ones.

    Raises:
        StoppedError: a signal asked the run to stop; summary and pictures show what there is.
    """
    say = (lambda text: None) if quiet else print
    start = clock.perf_counter()
    simulation = Simulation(scene, device=settings.device, precision=settings.precision, threads=settings.threads)
    settings = replace(settings, device=simulation.device.alias)
    component("Output", simulation.field(scene.output.field), scene.output.component)  # refused now, not after it
    folder = writable(folder)
    restart = Restart() if restart is None else restart
    restart.begin(simulation, folder)
    for name in (SUMMARY, *PICTURES):
        (folder / name).unlink(missing_ok=True)  # a former run's would be taken for this one's
    store(folder, file, scene, parameters, settings)
    where = simulation.device.alias + (f", {simulation.threads} threads" if simulation.threads > 1 else "")
    say(
        f"{scene.name}: {len(simulation.mesh.nodes)} nodes, {len(simulation.mesh.cells)} auxiliary nodes, "
        f"{simulation.precision.name} on {where}, time step {simulation.time_step_limit:.4g} s "
        f"(ready after {clock.perf_counter() - start:.1f} s)"
    )
    if simulation.steps:
        say(f"goes on from step {simulation.steps}, t = {simulation.time:.6g} s")
    end = scene.duration if settings.until is None else settings.until
    with file.errors_located():
        history = History(simulation, folder / "history.csv", restart.history)
    progress = Progress(simulation, end, show=not quiet and sys.stderr.isatty())
    observers = [history, progress, *(watch(simulation) for watch in watching)]
    begin, error, stop = clock.perf_counter(), None, None
    try:
        with file.errors_located(), restart.watching(simulation, history, folder, settings) as checkpoints:
            simulation.run(until=end, observers=[*observers, checkpoints])
            history.sample(simulation)
    except NonFiniteError as failure:
        error = str(failure)
    except StoppedError as asked:
        stop = asked
    finally:
        for observer in observers:
            observer.close()
    wall_time = clock.perf_counter() - begin + restart.wall_time
    checks: list[Check] = []
    finished = error is None and simulation.time >= scene.duration * (1.0 - 1e-9)
    try:
        if finished:
            outcome = SimpleNamespace(
                simulation=simulation, scene=scene, history=history, parameters=SimpleNamespace(**parameters)
            )
            checks = file.checks(outcome)
    finally:  # the run keeps its summary when its checks fail to work
        summary = summarise(simulation, parameters, checks, wall_time, __version__, error, stop is not None)
        write_json(folder / SUMMARY, summary)
    drawn = [plot_history(simulation, history, folder / PICTURES[0])]
    if error is None:
        plot_field(simulation, folder / PICTURES[1])
        drawn += [True, plot_surface(simulation, folder / PICTURES[2])]
    pictures = [name for name, there in zip(PICTURES, drawn, strict=False) if there]
    say(
        f"{simulation.steps} steps to t = {simulation.time:.6g} s in {wall_time:.1f} s, "
        f"{summary['node_steps_per_second']:.3g} node-steps/s"
    )
    if error:
        print(f"warpsph: {error}", file=sys.stderr)
    elif not finished and stop is None:
        say(f"checks skipped: they need the whole duration of {scene.duration:g} s")
    passed = error is None and all(check.passed for check in checks)
    if checks and not (quiet and passed):
        print(table(checks))
    say(f"results in {folder}/: {', '.join([SUMMARY, 'history.csv', 'scene.toml', *pictures])}")
    if settings.frames:
        say(f"all times on one sheet: warpsph plot {folder}")
    if stop is not None:
        raise stop
    return passed


def table(checks: Sequence[Check]) -> str:
    """The checks as aligned text."""
    rows = [("check", "value", "reference", "unit", "error", "bound", "")]
    for check in checks:
        error, bound = (
            (f"{100 * check.error:.3g} %", f"{100 * check.applied_bound:.3g} %")
            if check.relative
            else (f"{check.error:.3g}", f"{check.applied_bound:.3g}")
        )
        verdict = "passed" if check.passed else "FAILED"
        rows.append(
            (check.name, f"{check.value:.6g}", f"{check.reference:.6g}", check.unit, error, bound, verdict)
        )
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join(
        "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def writable(folder: Path) -> Path:
    """The folder, made if need be; refused when it can not be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".warpsph"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise SceneError("--out", str(folder), f"it must be a folder that can be written ({error})") from None
    return folder
