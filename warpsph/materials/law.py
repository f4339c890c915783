"""What the kernels need to know of a material."""

from collections.abc import Callable
from dataclasses import dataclass

import warp as wp

from ..errors import SceneError
from ..scene.material import InternalVariable, Material


@dataclass(frozen=True, kw_only=True)
class Law:
    """A material law as a parameter struct and pure functions.

    The functions are None for an elastic law, which has no source: then nothing of them is compiled, allocated or
    run. A law that flows has `relax`; the source scheme rk4 asks for the other two as well.

    Args:
        Parameters: Warp struct type; its fields young, lame and shear [Pa] are the moduli of the waves.
        fill: material → instance of `Parameters`.
        internals: those of the material, in the same order; the functions get their values as a vector.
        relax: (σ, internals, Parameters, Δt) → (σ, internals) after inelastic flow alone has acted for Δt, stable
            for any Δt.
        flow: (σ, internals, Parameters) → (dσ/dt, d internals/dt) by that flow.
        flow_stiffness: (σ, internals, Parameters) → the rate λ [1/s] at which it decays, for the step limit.
        shear_strength: (σ, internals, Parameters) → the shear stress [Pa] that it carries where it slips along a
            surface, for tools that are `Rough`.

    Raises:
        SceneError: a function is there without the one that it needs.
    """

    Parameters: type
    fill: Callable[[Material], object]
    internals: tuple[InternalVariable, ...] = ()
    relax: wp.Function | None = None
    flow: wp.Function | None = None
    flow_stiffness: wp.Function | None = None
    shear_strength: wp.Function | None = None

    def __post_init__(self):
        if self.relax is None and self.flow is not None:
            raise SceneError("Law.relax", None, "a law with flow must have relax as well")
        if (self.flow is None) != (self.flow_stiffness is None):
            raise SceneError("Law.flow_stiffness", self.flow_stiffness, "it and flow must be given together")

    @property
    def flows(self) -> bool:
        """Whether there is inelastic flow at all."""
        return self.relax is not None

    @property
    def source_schemes(self) -> tuple[str, ...]:
        """Names of the source schemes that can integrate it."""
        return ("analytic",) if self.flows and self.flow is None else ("analytic", "rk4")
