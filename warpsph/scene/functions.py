"""Functions of time for loads and prescribed motions. Any callable f(t) will do; these have names."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..validate import listed, number


@dataclass(frozen=True)
class Linear:
    """f(t) = rate · t.

    >>> Linear(-2.0)(3.0)
    -6.0
    """

    rate: float

    def __post_init__(self):
        object.__setattr__(self, "rate", number("Linear.rate", self.rate))

    def __call__(self, t: float) -> float:
        return self.rate * t


@dataclass(frozen=True)
class Ramp:
    """Rises linearly from 0 at t = 0 to `value` at t = `duration` [s], then stays.

    >>> Ramp(1.0)(0.25), Ramp(1.0)(7.0)
    (0.25, 1.0)
    """

    duration: float
    value: float = 1.0

    def __post_init__(self):
        object.__setattr__(self, "duration", number("Ramp.duration", self.duration, above=0.0))
        object.__setattr__(self, "value", number("Ramp.value", self.value))

    def __call__(self, t: float) -> float:
        return self.value * min(max(t / self.duration, 0.0), 1.0)


@dataclass(frozen=True)
class Pulse:
    """`value` for 0 ≤ t ≤ `duration` [s], then 0. The end is met to a relative 1e-9, whatever the step.

    >>> Pulse(1.0, duration=0.1)(0.1), Pulse(1.0, duration=0.1)(0.11)
    (1.0, 0.0)
    """

    value: float
    duration: float

    def __post_init__(self):
        object.__setattr__(self, "value", number("Pulse.value", self.value))
        object.__setattr__(self, "duration", number("Pulse.duration", self.duration, above=0.0))

    def __call__(self, t: float) -> float:
        return self.value if t <= self.duration * (1.0 + 1e-9) else 0.0


@dataclass(frozen=True)
class Table:
    """Linear interpolation between (time [s], value) pairs; constant outside them.

    >>> Table(times=(0.0, 1.0), values=(0.0, 4.0))(0.25)
    1.0
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self):
        times, values = (
            tuple(number(name, part) for part in listed(name, given, object, "a sequence of numbers"))
            for name, given in (("Table.times", self.times), ("Table.values", self.values))
        )
        if len(times) != len(values) or len(times) < 2 or np.any(np.diff(times) <= 0):
            raise SceneError("Table.times", times, "it must rise, with as many values as times, two or more")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)

    def __call__(self, t: float) -> float:
        return float(np.interp(t, self.times, self.values))
