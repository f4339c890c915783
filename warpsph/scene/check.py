"""A check of a run: a value against a reference, with a bound on the error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real

from ..errors import SceneError
from ..validate import instance, number


@dataclass(frozen=True)
class Check:
    """One line of the table that judges a run.

    Args:
        name: what is checked.
        value: what the run gave.
        reference: what it should be.
        unit: unit of both.
        bound: largest allowed error.
        relative: whether the error is |value − reference| / |reference|; the plain difference if not.
        bound_below: largest allowed error of a value below the reference; `bound` unless given.

    >>> check = Check("limit_load", value=91.5e3, reference=89.06e3, unit="N", bound=0.03)
    >>> round(check.error, 4), check.passed
    (0.0274, True)
    """

    name: str
    value: float
    reference: float
    unit: str
    bound: float
    relative: bool = True
    bound_below: float | None = None

    def __post_init__(self):
        for field in ("name", "unit"):
            instance(f"Check.{field}", getattr(self, field), str, "a text")
        for field in ("value", "reference"):
            instance(f"Check.{field}", getattr(self, field), Real, "a number")
        number("Check.bound", self.bound, at_least=0.0)
        if self.bound_below is not None:
            number("Check.bound_below", self.bound_below, at_least=0.0)
        if self.relative and self.reference == 0.0:
            raise SceneError("Check.reference", self.reference, "with relative=True it must not be zero")

    @property
    def error(self) -> float:
        """The error, relative or absolute."""
        difference = abs(self.value - self.reference)
        return difference / abs(self.reference) if self.relative else difference

    @property
    def applied_bound(self) -> float:
        """The bound on the side of the reference on which the value lies."""
        return self.bound if self.bound_below is None or self.value >= self.reference else self.bound_below

    @property
    def passed(self) -> bool:
        """Whether the error is finite and within the bound."""
        return math.isfinite(self.error) and self.error <= self.applied_bound

    def as_dict(self) -> dict:
        """The check as it stands in `summary.json`."""
        return {
            "name": self.name,
            "value": float(self.value),
            "reference": float(self.reference),
            "unit": self.unit,
            "error": float(self.error),
            "bound": float(self.applied_bound),
            "passed": bool(self.passed),
        }
