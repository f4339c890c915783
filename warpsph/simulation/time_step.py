"""The time step: all that is decided about Δt, from the Courant number, the sources and the deforming body."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..errors import SceneError
from ..operators.sources import MOST_SUBSTEPS, STIFFNESS_LIMIT
from ..physics.smoothing import second_moment
from ..scene.numerics import Numerics
from ..scene.scene import Scene

ROUNDING = 1e-9
# A step that has become too long is shortened by a little more than it must be, so that it is not done every time.
HEADROOM = 0.95


@dataclass(frozen=True)
class Stretch:
    """A stretch of time covered in equal steps.

    Attributes:
        start, end: simulated times [s].
        steps: how many.
        first: number of steps made before it.
    """

    start: float
    end: float
    steps: int
    first: int

    @property
    def time_step(self) -> float:
        """Δt [s]."""
        return (self.end - self.start) / self.steps

    @property
    def last(self) -> int:
        """Number of steps made when it is covered."""
        return self.first + self.steps

    def time_after(self, steps: int) -> float | None:
        """Simulated time [s] after so many steps since the run began; None when they lead out of the stretch."""
        made = steps - self.first
        return self.start + (self.end - self.start) * (made / self.steps) if 0 <= made <= self.steps else None


class TimeStep:
    """Decides how long the steps of a scene are.

    Args:
        scene: the scene.
        shrinkage: tells the least present time of a wave from node to node over the initial one, at most 1.

    Attributes:
        stretch: the equal steps that are under way, or None.

    Raises:
        SceneError: the Courant number, or the given time step, is beyond the limit of the waves.
    """

    def __init__(self, scene: Scene, shrinkage: Callable[[], float]):
        self._initial_limit, self._shrinkage = time_step_limit(scene), shrinkage
        self.stretch: Stretch | None = None

    @property
    def limit(self) -> float:
        """Largest Δt that is allowed now [s]: less than at the start where nodes are closer, or waves faster."""
        return self._initial_limit * self._shrinkage()

    def begin(self, time: float, end: float, steps: int) -> Stretch:
        """The equal steps to a time [s]: those that a run stopped in, or new ones."""
        under_way = self.stretch
        if under_way is None or under_way.end != end or under_way.time_after(steps) != time:
            self.stretch = self._to(time, end, steps, self.limit)
        return self.stretch

    def keep_below_limit(self, time: float, steps: int) -> Stretch:
        """The steps under way, shortened where they have become too long."""
        end = self.stretch.end
        if self.stretch.time_step > self.limit * (1.0 + ROUNDING) and time < end:
            self.stretch = self._to(time, end, steps, HEADROOM * self.limit)
        return self.stretch

    @staticmethod
    def _to(time: float, end: float, steps: int, limit: float) -> Stretch:
        return Stretch(time, end, divide(end - time, limit)[0], steps)


def courant_limit(scene: Scene) -> float:
    """Largest stable c_p Δt/Δx of the wave part: 2 √m₂ of sums over neighbours (METHOD section 4)."""
    numerics = scene.numerics
    if numerics.scheme.courant_limit is not None:
        return numerics.scheme.courant_limit
    moment = second_moment(numerics.smoothing, ratio=numerics.smoothing_ratio, dim=scene.mesh.dim)
    return 2.0 * math.sqrt(moment)


def time_step_limit(scene: Scene) -> float:
    """Δt [s]: the one the scene gives, or C Δx/c_p, reduced where sub-stepping could not follow the flow.

    Δx is the smallest initial distance across a cell. RK4 sources are sub-stepped up to `MOST_SUBSTEPS` times
    a half step, each λ Δt ≤ `STIFFNESS_LIMIT`, λ the material's `flow_rate`.

    Raises:
        SceneError: the Courant number (or the given time step) is beyond the wave limit.
    """
    numerics, material, mesh = scene.numerics, scene.material, scene.mesh
    per_courant = scene.wave_spacing / material.wave_speed(mesh.dim)
    limit = courant_limit(scene)
    if numerics.time_step is not None:
        if numerics.time_step > limit * per_courant * (1.0 + ROUNDING):
            raise SceneError("time_step", numerics.time_step, f"it must be at most {limit * per_courant:.6g} s")
        return numerics.time_step
    if numerics.courant > limit * (1.0 + ROUNDING):
        raise SceneError("courant", numerics.courant, f"{_described(numerics)} waves are stable up to {limit:.4g}")
    dt = numerics.courant * per_courant
    rate = material.flow_rate(mesh.dim)
    if rate > 0.0 and numerics.source_scheme == "rk4":
        dt = min(dt, 2.0 * MOST_SUBSTEPS * STIFFNESS_LIMIT / rate)
    return dt


def _described(numerics: Numerics) -> str:
    if numerics.scheme.sums is None:
        return f"with velocity_scheme {numerics.velocity_scheme}"
    return f"with kernel {numerics.kernel} and smoothing_ratio {numerics.smoothing_ratio:g}"


def divide(duration: float, limit: float) -> tuple[int, float]:
    """Number and length of the equal steps, each at most `limit`, that fill a duration [s].

    Equal steps, because a short last one would filter: the published velocity step smooths by a fixed amount
    a step, however short.

    >>> divide(1.0, 0.3)
    (4, 0.25)
    """
    steps = max(1, math.ceil(duration / limit * (1.0 - ROUNDING)))
    return steps, duration / steps
