"""The flux part: ∂φ/∂t + div f(φ) = 0, whose waves are the elastic ones."""

from functools import cache

import warp as wp

from .space import Space


@cache
def wave_rate(space: Space, Parameters: type) -> wp.Function:
    """(∇φ, 1/ρ, material) → −div f(φ) = (div σ/ρ, Dₑ : d). 1/ρ stands outside the sum, exact where ρ varies."""
    phi = space.phi

    @wp.func
    def minus_div_flux(gradient: phi.gradient, per_density: space.real, material: Parameters):
        L = phi.velocity_gradient(gradient)
        acceleration = per_density * space.stress.divergence(phi.stress_gradient(gradient))
        stress_rate = space.stress.elastic_rate(L, material.lame, material.shear, material.young)
        return phi.with_stress(phi.with_velocity(phi.phi(), acceleration), stress_rate)

    return minus_div_flux
