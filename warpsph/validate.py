"""Small checks used by every part of a scene: they return the clean value or raise `SceneError`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from numbers import Integral, Real

import numpy as np

from .errors import FunctionError, SceneError, one_of

TimeFunction = float | Callable[[float], float]


def number(
    field: str,
    value: object,
    *,
    above: float | None = None,
    below: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
) -> float:
    """A finite real number inside the given bounds (`above` and `below` are exclusive)."""
    bounds = [
        text
        for limit, text in (
            (above, f"above {above}"),
            (at_least, f"at least {at_least}"),
            (below, f"below {below}"),
            (at_most, f"at most {at_most}"),
        )
        if limit is not None
    ]
    allowed = "it must be a finite number" + (" " + " and ".join(bounds) if bounds else "")
    real = _real(value)
    inside = (
        math.isfinite(real)
        and (above is None or real > above)
        and (below is None or real < below)
        and (at_least is None or real >= at_least)
        and (at_most is None or real <= at_most)
    )
    if not inside:
        raise SceneError(field, value, allowed)
    return real


def _real(value: object) -> float:
    """The value as a float; NaN for what is no real number, or too large to be a float."""
    try:
        return float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        return math.nan


def index(field: str, value: object, below: int | None = None, at_least: int = 0) -> int:
    """A whole number, from 0 on unless said."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not whole or value < at_least or (below is not None and value >= below):
        limit = "" if below is None else f" and below {below}"
        raise SceneError(field, value, f"it must be a whole number, at least {at_least}{limit}")
    return int(value)


def flag(field: str, value: object) -> bool:
    """True or False."""
    if not isinstance(value, bool | np.bool_):
        raise SceneError(field, value, "it must be True or False")
    return bool(value)


def choice(field: str, value: object, options: Iterable[str]) -> str:
    """One of the named options; the error suggests the nearest."""
    options = tuple(options)
    if not isinstance(value, str) or value not in options:
        raise SceneError(field, value, one_of(options, value))
    return value


def vector(field: str, value: object, dim: int | None = None) -> tuple[float, ...]:
    """A sequence of finite numbers, `dim` of them when given; a bare number counts as one component."""
    parts = value.tolist() if isinstance(value, np.ndarray) else value
    parts = (parts,) if isinstance(parts, Real) else parts
    allowed = f"it must be a sequence of {dim or '1, 2 or 3'} finite numbers"
    if not isinstance(parts, Sequence) or isinstance(parts, str | bytes):
        raise SceneError(field, value, allowed)
    if len(parts) != dim if dim else len(parts) not in (1, 2, 3):
        raise SceneError(field, value, allowed)
    try:
        return tuple(number(field, part) for part in parts)
    except SceneError:
        raise SceneError(field, value, allowed) from None


def listed(field: str, value: object, kind: type, allowed: str) -> tuple:
    """A tuple of objects of the given class; `allowed` completes the sentence "it must be …"."""
    try:
        parts = tuple(value)
    except TypeError:
        raise SceneError(field, value, f"it must be {allowed}") from None
    for part in parts:
        instance(field, part, kind, allowed)
    return parts


@dataclass(frozen=True, repr=False)
class FunctionOfTime:
    """A function of time in a field of a scene: f(t) is a finite number, or an error names field and time.

    Args:
        field: name of the field.
        function: f(t), t in [s].
    """

    field: str
    function: Callable[[float], float]

    def __call__(self, t: float) -> float:
        try:
            value = self.function(t)
        except Exception as error:  # a user's function may raise anything
            said = f"it raised {type(error).__name__}: {error}"
            raise self._refusal(t, said) from error
        if type(value) is float and math.isfinite(value):
            return value
        real = _real(value)
        if not math.isfinite(real):
            raise self._refusal(t, f"not {value!r}")
        return real

    def _refusal(self, t: float, said: str) -> FunctionError:
        rounded = float(f"{t:.6g}")
        return FunctionError(self.field, self.function, f"f({rounded}) must return a finite number; {said}")

    def __repr__(self) -> str:
        return repr(self.function)


def time_function(field: str, value: object) -> TimeFunction:
    """A number, or a function of time [s] that returns a finite number; tried once at t = 0."""
    if not callable(value):
        try:
            return number(field, value)
        except SceneError:
            raise SceneError(field, value, "it must be a finite number or a function of time f(t)") from None
    function = FunctionOfTime(field, value.function if isinstance(value, FunctionOfTime) else value)
    function(0.0)
    return function


def instance(field: str, value: object, kind: type | tuple[type, ...], allowed: str) -> object:
    """An object of the given class; `allowed` completes the sentence "it must be …"."""
    if not isinstance(value, kind):
        raise SceneError(field, value, f"it must be {allowed}")
    return value


def field_of_position(field: str, function: Callable, points: np.ndarray, size: int) -> np.ndarray:
    """Values (n, size) of a user's function of position, called as f(x, y, …) with one array a coordinate.

    The function returns `size` parts, each a number or an array of length n (a bare part when size is 1).
    """
    allowed = f"f(x, …) must return {size} finite number(s) or array(s) of one value a node"
    try:
        parts = function(*points.T)
        if size == 1 and np.ndim(parts) < 2 and np.size(parts) in (1, len(points)):
            parts = (np.reshape(parts, -1) if np.ndim(parts) else parts,)
        if len(parts) != size:
            raise ValueError(f"it returned {len(parts)} parts")
        columns = [np.broadcast_to(_reals(part), len(points)) for part in parts]
    except Exception as error:  # a user's function may raise anything
        raise SceneError(field, function, f"{allowed} ({error})") from error
    values = np.stack(columns, axis=1)
    if not np.isfinite(values).all():
        raise SceneError(field, function, allowed)
    return values


def _reals(part: object) -> np.ndarray:
    values = np.asarray(part)
    if values.dtype.kind not in "iuf":
        raise ValueError(f"it returned {values.dtype.name} values")
    return values.astype(float)


def mask_of_position(field: str, function: Callable, points: np.ndarray) -> np.ndarray:
    """Where a user's function of position is true, boolean (n,); called as `field_of_position` calls it."""
    allowed = "f(x, …) must return True or False, or an array of one of them a node, as a comparison does"
    try:
        values = np.asarray(function(*points.T))
        mask = np.broadcast_to(values, len(points))
    except Exception as error:  # a user's function may raise anything
        raise SceneError(field, function, f"{allowed} ({error})") from error
    if values.dtype != bool:
        raise SceneError(field, function, f"{allowed}, not {values.dtype.name} values")
    return mask
