"""The time step of a scene: from the Courant number and the stiffness of the sources."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..device.precision import PRECISIONS
from ..errors import SceneError
from ..operators.sources import MOST_SUBSTEPS, STIFFNESS_LIMIT
from ..physics.smoothing import SMOOTHING_FUNCTIONS, second_moment
from ..scene.numerics import KERNELS
from ..scene.scene import Scene

ROUNDING = 1e-9
# On an endless lattice the compatible scheme is stable up to 1. Where sums lack neighbours on one side it is up to
# 0.96, in a free square of 3 × 3 cells with ν = 0.499 up to 0.94; small boxes grow by up to 1.4 % a step at 1.
EDGE_LIMIT = 0.9


def courant_limit(scene: Scene) -> float:
    """Largest stable c_p Δt/Δx of the wave part: 2 √m₂ (METHOD section 4), for the compatible scheme 1 in a bar,
    else `EDGE_LIMIT`."""
    numerics, precision = scene.numerics, PRECISIONS["float64"]
    weight = SMOOTHING_FUNCTIONS[numerics.kernel](precision)
    support, dim = KERNELS[numerics.kernel].support, scene.mesh.dim
    moment = second_moment(weight, precision, numerics.smoothing_ratio, support, dim)
    limit = 2.0 * math.sqrt(moment)
    if numerics.unloads:
        return min(limit, 1.0 if dim == 1 else EDGE_LIMIT)
    return limit


def time_step_limit(scene: Scene) -> float:
    """Δt [s]: the one the scene gives, or C Δx/c_p, reduced where sub-stepping could not follow the flow.

    Δx is the smallest initial distance across a cell. RK4 sources are sub-stepped up to `MOST_SUBSTEPS` times
    a half step, each λ Δt ≤ `STIFFNESS_LIMIT`, λ the material's `flow_rate`.

    Raises:
        SceneError: the Courant number (or the given time step) is beyond the wave limit.
    """
    numerics, material, mesh = scene.numerics, scene.material, scene.mesh
    per_courant = mesh.smallest_edge() / material.wave_speed(mesh.dim)
    limit = courant_limit(scene)
    if numerics.time_step is not None:
        if numerics.time_step > limit * per_courant * (1.0 + ROUNDING):
            raise SceneError("time_step", numerics.time_step, f"it must be at most {limit * per_courant:.6g} s")
        return numerics.time_step
    if numerics.courant > limit * (1.0 + ROUNDING):
        raise SceneError(
            "courant",
            numerics.courant,
            f"with kernel {numerics.kernel} and smoothing_ratio {numerics.smoothing_ratio:g} waves are stable "
            f"up to {limit:.4g}",
        )
    dt = numerics.courant * per_courant
    rate = material.flow_rate(mesh.dim)
    if rate > 0.0 and numerics.source_scheme == "rk4":
        dt = min(dt, 2.0 * MOST_SUBSTEPS * STIFFNESS_LIMIT / rate)
    return dt


def divide(duration: float, limit: float) -> tuple[int, float]:
    """Number and length of the equal steps, each at most `limit`, that fill a duration [s].

    Equal steps, because a short last one would filter: the published velocity step smooths by a fixed amount
    a step, however short.

    >>> divide(1.0, 0.3)
    (4, 0.25)
    """
    steps = max(1, math.ceil(duration / limit * (1.0 - ROUNDING)))
    return steps, duration / steps


@dataclass(frozen=True)
class Leg:
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

    def time_after(self, steps: int) -> float | None:
        """Simulated time [s] after so many steps since the run began; None when they lead out of the leg."""
        made = steps - self.first
        return self.start + (self.end - self.start) * (made / self.steps) if 0 <= made <= self.steps else None
