"""A simulation: a scene on a device, run step by step or until a time."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Protocol

import numpy as np

from ..device.exclusive import exclusive
from ..device.launching import Launcher
from ..device.precision import precision as precision_of
from ..errors import SceneError, one_of
from ..mesh.mesh import Mesh
from ..physics.space import Space
from ..scene.place import node_at
from ..scene.scene import Scene
from ..state.clock import LONGEST_RUN
from ..state.energy import Energy
from ..step import scheme  # noqa: F401 — makes the schemes known
from ..validate import instance, number
from .breakdown import FLATTENED, LEAST_STEP_SHARE, MOST_UNACCOUNTED, UNACCOUNTED, breakdown
from .device import choose_device, choose_threads
from .fields import fields_of
from .interrupts import held_back
from .state import arrays, numbers, restore
from .time_step import Stretch, TimeStep

COUNTERS = ("time", "steps", "wall_time", "shortest_step", "longest_step", "largest_energy")
WATCH = 128  # steps between two looks at the energy balance, which takes a tenth of a step
# Node-steps that the device makes on its own: about 0.1 s on a CPU core, 1 s on a GPU. Signals wait as long.
AHEAD_ON_CPU, AHEAD_ON_GPU = 200_000, 1_000_000_000


class Observer(Protocol):
    """Something told after a step. Observers only read.

    One with an attribute `next_time` [s] is told after the first step that ends then or later at the latest, and
    may be told before; one without it after every step. Many steps between looks are made without the host.
    """

    def observe(self, simulation: Simulation) -> None:
        """Look at the simulation."""


class Simulation:
    """Runs a scene. Several may be in use, also in several threads, which take turns.

    Args:
        scene: the scene.
        device: Warp device name, e.g. `cpu` or `cuda:0`; the first GPU, or else the CPU, unless given.
        precision: `float64` or `float32`.
        threads: number of CPU threads; results do not depend on it. Unless given, one for every 1000 nodes, at
            most as many as the environment variable WARPSPH_THREADS says or there are cores.

    Attributes:
        scene: the scene.
        mesh: its initial nodes, cells and boundary faces.
        time: simulated time [s].
        steps: number of steps made.
        shortest_step, longest_step: smallest and largest Δt used so far [s].
        wall_time: seconds spent in steps, without the start.
        largest_energy: largest entry that the energy balance has had, as seen every `WATCH` steps.
        threads: number of CPU threads.
        nodes, internals: the arrays on the device.
        conditions: the boundary conditions on the device, among them the free surface.
        stepper: makes the steps; for developers, its parts may change from version to version.

    Raises:
        SceneError: the device, the precision or the time step is not allowed.
    """

    @exclusive
    def __init__(
        self,
        scene: Scene,
        device: str | None = None,
        precision: str = "float64",
        threads: int | None = None,
    ):
        self.scene = instance("scene", scene, Scene, "a Scene")
        self.precision = precision_of(precision)
        self.device = choose_device(device)
        self.mesh = scene.mesh
        self._time_step = TimeStep(scene, lambda: self.stepper.shrinkage)
        launcher = Launcher(self.device, choose_threads(threads, len(self.mesh.nodes)))
        self.threads = launcher.threads
        self.stepper = scene.numerics.scheme.stepper(scene, Space(self.mesh.continuum, self.precision), launcher)
        body = self.stepper.body
        self.nodes, self.internals = body.nodes, body.internals
        self.conditions = self.stepper.conditions
        self.time, self.steps, self.wall_time = 0.0, 0, 0.0
        self.shortest_step, self.longest_step = float("inf"), 0.0
        self.largest_energy = 0.0

    @property
    def present_mesh(self) -> Mesh:
        """The nodes where they began, with the cells as they are now: `mesh`, unless they are made anew."""
        return self.stepper.body.mesh()

    @property
    def time_step_limit(self) -> float:
        """Largest Δt the scene now allows [s]: less than at the start where nodes are closer, or waves faster."""
        return self._time_step.limit

    def step(self, time_step: float | None = None) -> None:
        """Advance by one time step.

        Args:
            time_step: Δt [s]; `time_step_limit` unless given, which it must not exceed.

        Raises:
            BreakdownError: something can not be true: a value that is not finite (NonFiniteError), a folded cell,
                neighbours that part faster than waves.
        """
        dt = self.time_step_limit
        if time_step is not None:
            dt = number("time_step", time_step, above=0.0, at_most=self.time_step_limit)
        with held_back():
            self._advance([self.time], dt)

    def run(self, until: float | None = None, observers: Iterable[Observer] = ()) -> None:
        """Advance in equal steps until a time, telling the observers on the way.

        A run that was stopped on its way, or restored there, goes on in the steps it had.

        Args:
            until: simulated time [s]; the scene's duration unless given.
            observers: told after every step, or when their `next_time` has come.

        Raises:
            BreakdownError: as for `step`; observers keep what they have.
        """
        end = self.scene.duration if until is None else number("until", until, at_least=self.time)
        observers = tuple(observers)
        if end == self.time:
            return
        stretch = self._time_step.begin(self.time, end, self.steps)
        while self.steps < stretch.last:
            with held_back():
                self._advance(self._starts(stretch, observers), stretch.time_step, stretch.last)
                self.time = stretch.time_after(self.steps)
                stretch = self._time_step.keep_below_limit(self.time, self.steps)
            for observer in observers:
                observer.observe(self)

    def _starts(self, stretch: Stretch, observers: tuple[Observer, ...]) -> list[float]:
        """Where the next steps begin [s], up to the one after which an observer looks."""
        due = min((getattr(observer, "next_time", -math.inf) for observer in observers), default=math.inf)
        ahead = AHEAD_ON_CPU if self.device.is_cpu else AHEAD_ON_GPU
        most = min(LONGEST_RUN, ahead // len(self.mesh.nodes), stretch.last - self.steps)
        most = max(1, min(most, WATCH - self.steps % WATCH))
        times = [stretch.time_after(self.steps + k) for k in range(most + 1)]
        return times[: next((k for k in range(1, most) if times[k] >= due), most)]

    @exclusive
    def _advance(self, times: list[float], dt: float, last: int | None = None) -> None:
        begin = clock.perf_counter()
        outcome = self.stepper.advance(times, dt)
        self.steps += outcome.made
        self.time = times[outcome.made - 1] + dt
        self.shortest_step = min(self.shortest_step, dt)
        self.longest_step = max(self.longest_step, dt)
        self.wall_time += clock.perf_counter() - begin
        flattened = FLATTENED if self.stepper.shrinkage < LEAST_STEP_SHARE else None
        fault = outcome.fault or flattened or self._watch_energy(self.steps == last)
        if fault is not None:
            raise breakdown(self, fault, dt)

    def _watch_energy(self, last: bool) -> str | None:
        """At some steps, whoever observes, and at the last: whether energy has come from nowhere, or gone."""
        regular = self.steps % WATCH == 0
        balance = self.stepper.energy() if regular or last else None
        if balance is None:
            return None
        largest = max(self.largest_energy, balance.largest)
        if regular:  # what goes on is as if it had not ended there
            self.largest_energy = largest
        return UNACCOUNTED if abs(balance.amiss) > MOST_UNACCOUNTED * largest else None

    @exclusive
    def energy(self) -> Energy | None:
        """The energy balance since the start; None with schemes that keep no books."""
        return self.stepper.energy()

    @exclusive
    def state(self) -> tuple[dict[str, np.ndarray], dict[str, object]]:
        """All that the next steps depend on: arrays and numbers by name; see `restore`."""
        own = {name: getattr(self, name) for name in COUNTERS}
        stretch = self._time_step.stretch
        counted = {**own, "stretch": None if stretch is None else asdict(stretch)}
        return arrays(self.stepper), counted | {"stepper": numbers(self.stepper)}

    @exclusive
    def restore(self, state: Mapping[str, np.ndarray], values: Mapping[str, object]) -> None:
        """Go back to what `state` gave, in this simulation or in another one of the same scene and precision.

        Raises:
            KeyError: the state is of another scene.
        """
        restore(self.stepper, state, values["stepper"])
        for name in COUNTERS:
            setattr(self, name, values[name])
        self._time_step.stretch = None if values["stretch"] is None else Stretch(**values["stretch"])

    @exclusive
    def field(self, name: str) -> np.ndarray:
        """A copy of a node field as a NumPy array; see `fields` for the names.

        Raises:
            SceneError: this scene has no field of that name.
        """
        fields = fields_of(self.scene)
        if name not in fields:
            raise SceneError("field", name, one_of(fields, name))
        return fields[name].read(self)

    def fields(self) -> dict[str, str]:
        """The fields of this scene: name → "shape [unit] meaning"."""
        return {
            name: f"{field.shape} [{field.unit}] {field.meaning}" for name, field in fields_of(self.scene).items()
        }

    def nearest_node(self, point: Iterable[float]) -> int:
        """Index of the material node that is initially nearest to a point of the body [m].

        Raises:
            SceneError: the point is not in the body, to within a cell.
        """
        return node_at("point", tuple(point), self.mesh)

    @property
    def list_builds(self) -> int:
        """How often the pair lists were built."""
        return self.stepper.builds
