"""What the solver needs to know of a material."""

from collections.abc import Callable
from dataclasses import dataclass

import warp as wp


@dataclass(frozen=True)
class Law:
    """A material law as a parameter struct and pure functions.

    `Parameters` always has the fields young, lame and shear [Pa]. The functions below are None for an elastic
    law, which has no source: then nothing of them is compiled, allocated or run.

    Attributes:
        Parameters: Warp struct type.
        fill: material → instance of `Parameters`.
        internals: name, unit and meaning of each internal variable a node keeps; each is a field of the nodes.
        flow: (σ, internals, Parameters) → (dσ/dt, d internals/dt) by inelastic flow alone.
        flow_stiffness: (σ, internals, Parameters) → the rate λ [1/s] at which it decays, for the step limit.
        relax: (σ, internals, Parameters, Δt) → (σ, internals) after that flow has acted for Δt, stable for any Δt.
    """

    Parameters: type
    fill: Callable[[object], object]
    internals: tuple[tuple[str, str, str], ...] = ()
    flow: wp.Function | None = None
    flow_stiffness: wp.Function | None = None
    relax: wp.Function | None = None
