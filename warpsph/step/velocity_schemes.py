"""How the velocity is advanced in step 10b."""

from functools import cache

import warp as wp

from ..physics.space import Space


@cache
def blanc_pastor(space: Space) -> wp.Function:
    """v_adv = 2 v^{n+1/2} − v_s: the published step.

    No checkerboard, but it filters every wave with diffusivity about (2 m₂ − C²/2) Δx²/Δt (METHOD section 4).
    v_s, not vⁿ, stands on the right: with vⁿ step 12 would apply 1.5 times the body force.
    """
    vector = space.types.vector

    @wp.func
    def advance(v_s: vector, v_half: vector, acceleration: vector, dt: space.real):
        return space.real(2.0) * v_half - v_s

    return advance


@cache
def taylor(space: Space) -> wp.Function:
    """v_adv = v_s − Δt div f(φ^{n+1/2}): the complete two-step Taylor scheme; leaves the checkerboard alone."""
    vector = space.types.vector

    @wp.func
    def advance(v_s: vector, v_half: vector, acceleration: vector, dt: space.real):
        return v_s + dt * acceleration

    return advance


VELOCITY_SCHEMES = {"blanc-pastor": blanc_pastor, "taylor": taylor}
