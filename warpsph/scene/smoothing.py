"""Smoothing kernels a scene can name. The functions themselves are in `warpsph.physics.smoothing`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..validate import instance, number


@dataclass(frozen=True, kw_only=True)
class SmoothingKernel:
    """A smoothing function W(ξ), ξ = r/h, with all that belongs to it.

    Args:
        name: what `Numerics.kernel` calls it.
        support: radius of the support in smoothing lengths [-], > 0.
        smoothing_ratio: h/Δx unless a scene gives another [-], > 0. Support times ratio should reach 1.8 Δx, a
            little beyond the 1.58 Δx (1.66 in 3D) that a corner node needs.
        weights: precision → Warp function of ξ² that returns W and −W′/ξ, each up to a positive constant of its
            own; cached, since every call compiles anew.

    Raises:
        SceneError: an argument is not allowed.
    """

    name: str
    support: float
    smoothing_ratio: float
    weights: Callable

    def __post_init__(self):
        instance("SmoothingKernel.name", self.name, str, "a text")
        for field in ("support", "smoothing_ratio"):
            value = number(f"SmoothingKernel.{field}", getattr(self, field), above=0.0)
            object.__setattr__(self, field, value)
        instance("SmoothingKernel.weights", self.weights, Callable, "a function of the precision")
