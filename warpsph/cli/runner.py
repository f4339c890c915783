"""Runs one scene file from end to end: it is prepared, advanced, judged, drawn and told."""

from __future__ import annotations

import contextlib
import sys
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Protocol

from .. import __version__
from ..errors import BreakdownError, FunctionError, SceneError, StoppedError
from ..export.frame_files import read_about, times_of_frames
from ..export.pictures.energy import plot_energy
from ..export.pictures.field import plot_field
from ..export.pictures.history import plot_history
from ..export.pictures.surface import plot_surface
from ..scene.check import Check
from ..scene.output import Probe, component
from ..scene.scene import Scene
from ..simulation.history import History
from ..simulation.simulation import Observer, Simulation
from ..simulation.summary import summarise
from ..state.energy import GIVEN, TAKEN
from ..storage.files import write_json
from ..storage.owner import owned, owned_file
from ..validate import number
from .catalogue import SceneFile
from .progress import Progress
from .restart import Restart
from .run_folder import (
    ENERGY_PICTURE,
    FIELD_PICTURE,
    HISTORY,
    HISTORY_PICTURE,
    SUMMARY,
    SURFACE_PICTURE,
    check_free,
    remove_results,
    remove_run,
)
from .settings import Settings
from .stored import StoredScene, store

SHORTEST = 1e-12  # of a time step: what is shorter changes nothing, and its square is no number any more


class ClosingObserver(Observer, Protocol):
    """An observer that finishes its work when the run ends, however it ends."""

    def close(self) -> None:
        """Finish."""


@dataclass
class Course:
    """A run on its way.

    Attributes:
        file: the scene's file.
        simulation: the simulation.
        parameters: of the scene, name → value.
        settings: how it is run.
        folder: its results.
        history: its probes; None before it begins.
        error: why it broke down, or None.
        stop: what asked it to stop, or None.
        wall_time: how long it took so far [s].
    """

    file: SceneFile | StoredScene
    simulation: Simulation
    parameters: Mapping[str, object]
    settings: Settings
    folder: Path
    history: History | None = None
    error: str | None = None
    stop: StoppedError | None = None
    wall_time: float = 0.0
    checks: list[Check] = field(default_factory=list)

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.simulation.scene

    @property
    def end(self) -> float:
        """Simulated time at which it ends [s]."""
        return self.scene.duration if self.settings.until is None else self.settings.until

    @property
    def finished(self) -> bool:
        """Whether it has reached the scene's duration, where its checks count."""
        return self.error is None and self.simulation.time >= self.scene.duration * (1.0 - 1e-9)

    @property
    def passed(self) -> bool:
        """Whether nothing speaks against it."""
        return self.error is None and all(check.passed for check in self.checks)


def run(
    file: SceneFile | StoredScene,
    scene: Scene,
    parameters: Mapping[str, object],
    settings: Settings,
    folder: Path,
    *,
    quiet: bool,
    overwrite: bool = False,
    watching: Sequence[Callable[[Simulation], ClosingObserver]] = (),
    restart: Restart | None = None,
) -> bool:
    """Run a scene and write its results into a folder; True when it finished and all checks passed.

    Args:
        file: where the scene came from.
        scene: the scene.
        parameters: of the scene, name → value.
        settings: how it is run.
        folder: gets the results; nothing in it is touched before the run can begin.
        quiet: whether to say nothing unless something fails.
        overwrite: whether a former run in the folder may go.
        watching: make further observers of the simulation; they are closed before the summary is written.
        restart: goes on from a checkpoint and writes new ones.

    Raises:
        SceneError: something is not allowed; a former run in the folder is then as it was.
        StoppedError: a signal asked the run to stop; summary and pictures show what there is.
    """
    say = (lambda text: None) if quiet else print
    restart = Restart() if restart is None else restart
    stored = file.path if isinstance(file, StoredScene) else None
    anew = restart.checkpoint is None
    if anew:
        check_free(folder, overwrite, stored)
    course = _prepare(file, scene, parameters, settings, folder, restart, say)
    usd = course.settings.usd
    with owned(folder), owned_file(Path(usd), "--usd") if usd else contextlib.nullcontext():
        if anew:
            check_free(folder, overwrite, stored)  # nobody can come in between any more
            remove_run(folder, stored)
        else:
            remove_results(folder)
        store(folder, file, scene, parameters, course.settings)
        _advance(course, restart, watching, show=not quiet and sys.stderr.isatty())
        summary = _judge(course)
        pictures = _draw(course)
    _tell(course, summary, pictures, quiet, say)
    if course.stop is not None:
        raise course.stop
    return course.passed


def _prepare(file, scene, parameters, settings, folder, restart, say) -> Course:
    """The simulation where it begins; all that can be refused is refused here, before a file is touched."""
    start = clock.perf_counter()
    simulation = Simulation(scene, device=settings.device, precision=settings.precision, threads=settings.threads)
    settings = replace(settings, device=simulation.device.alias)
    component("Output", simulation.field(scene.output.field), scene.output.component)
    _ = scene.probe_identities  # of the probes as they are before they are called
    if restart.checkpoint is not None:
        restart.checkpoint.restore(simulation)
        about = read_about(folder)
        _ = about and times_of_frames(folder, about)  # refused now, not when half of it is done
    else:
        with file.errors_located():
            for probe in scene.output.probes:
                _check_probe(probe, probe.function(simulation))
    if settings.until is not None:
        shortest = SHORTEST * simulation.time_step_limit
        number("until", settings.until, at_least=simulation.time if simulation.steps else shortest)
    where = simulation.device.alias + (f", {simulation.threads} threads" if simulation.threads > 1 else "")
    say(
        f"{scene.name}: {len(simulation.mesh.nodes)} nodes, {len(simulation.mesh.cells)} cells, "
        f"{simulation.precision.name} on {where}, time step {simulation.time_step_limit:.4g} s "
        f"(ready after {clock.perf_counter() - start:.1f} s)"
    )
    if simulation.steps:
        say(f"goes on from step {simulation.steps}, t = {simulation.time:.6g} s")
    return Course(file, simulation, parameters, settings, folder)


def _check_probe(probe: Probe, value: object) -> None:
    try:
        float(value)
    except (TypeError, ValueError):
        raise SceneError(f"Probe({probe.name!r}).function", value, "it must return a number") from None


def _advance(course: Course, restart: Restart, watching: Sequence[Callable], show: bool) -> None:
    """Take the run to its end, or to where something ends it."""
    simulation = course.simulation
    with course.file.errors_located():
        course.history = History(simulation, course.folder / HISTORY, restart.history)
    progress = Progress(simulation, course.end, show)
    observers = [course.history, progress, *(watch(simulation) for watch in watching)]
    begin = clock.perf_counter()
    try:
        with (
            course.file.errors_located(),
            restart.watching(simulation, course.history, course.folder, course.settings) as checkpoints,
        ):
            simulation.run(until=course.end, observers=[*observers, checkpoints])
            course.history.sample(simulation)
    except (BreakdownError, FunctionError) as failure:
        course.error = str(failure)
    except StoppedError as asked:
        course.stop = asked
    finally:
        for observer in observers:
            observer.close()
    course.wall_time = clock.perf_counter() - begin + restart.wall_time


def _judge(course: Course) -> Mapping:
    """Make the checks of a run that has finished, and write its summary also when they fail to work."""
    try:
        if course.finished:
            outcome = SimpleNamespace(
                simulation=course.simulation,
                scene=course.scene,
                history=course.history,
                parameters=SimpleNamespace(**course.parameters),
            )
            course.checks = course.file.checks(outcome)
    finally:
        summary = summarise(
            course.simulation,
            course.parameters,
            course.checks,
            course.wall_time,
            __version__,
            course.error,
            course.stop is not None,
            course.history.digest,
        )
        write_json(course.folder / SUMMARY, summary)
    return summary


def _draw(course: Course) -> list[str]:
    """Draw what can be drawn; the names of the pictures."""
    simulation, folder, drawn = course.simulation, course.folder, []
    if plot_history(simulation, course.history, folder / HISTORY_PICTURE):
        drawn.append(HISTORY_PICTURE)
    if plot_energy(simulation, course.history, folder / ENERGY_PICTURE):
        drawn.append(ENERGY_PICTURE)
    if course.error is None:
        plot_field(simulation, folder / FIELD_PICTURE)
        drawn.append(FIELD_PICTURE)
        if plot_surface(simulation, folder / SURFACE_PICTURE):
            drawn.append(SURFACE_PICTURE)
    return drawn


def _tell(course: Course, summary: Mapping, pictures: list[str], quiet: bool, say: Callable[[str], None]) -> None:
    """Say how it went and where the results are."""
    simulation, folder = course.simulation, course.folder
    say(
        f"{simulation.steps} steps to t = {simulation.time:.6g} s in {course.wall_time:.1f} s, "
        f"{summary['node_steps_per_second']:.3g} node-steps/s"
    )
    if summary["energy"]:
        say(_energy_line(summary["energy"]))
    if course.error:
        print(f"warpsph: {course.error}", file=sys.stderr)
    elif not course.finished and course.stop is None:
        say(f"checks skipped: they need the whole duration of {course.scene.duration:g} s")
    if course.checks and not (quiet and course.passed):
        print(table(course.checks))
    say(f"results in {folder}/: {', '.join([SUMMARY, HISTORY, 'scene.toml', *pictures])}")
    if course.settings.frames:
        say(f"all times on one sheet: warpsph plot {folder}")


def _energy_line(energy: Mapping) -> str:
    """What came in, where it is or went, and what is unaccounted for, without what is less than a thousandth."""
    values = {name: energy[name] for name in ("initial", *GIVEN, *TAKEN)}
    if any(value is None for value in values.values()):
        return "energy: not finite any more"
    least = 1e-3 * max(abs(value) for value in values.values())

    def told(names):
        return ", ".join(f"{name} {values[name]:.3g}" for name in names if abs(values[name]) > least) or "nothing"

    return (
        f"energy [{energy['unit']}]: {told(('initial', *GIVEN))} came in; {told(TAKEN)}; "
        f"{100.0 * energy['unaccounted_share']:.2g} % unaccounted for"
    )


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
