"""The flux part: ∂φ/∂t + div f(φ) = 0, whose waves are the elastic ones."""

from functools import cache

import warp as wp

from .space import Space


@cache
def wave_rate(space: Space, Parameters: type) -> wp.Function:
    """(∇φ, 1/ρ, material) → −div f(φ) = (div σ/ρ, Dₑ : d). 1/ρ stands outside the sum, exact where ρ varies."""
    kin, phi = space.stress, space.phi
    elastic_rate, divergence, join = kin.elastic_rate, kin.divergence, phi.join
    velocity_gradient, stress_gradient = phi.velocity_gradient, phi.stress_gradient

    @wp.func
    def minus_div_flux(gradient: phi.gradient, per_density: space.real, material: Parameters):
        L = velocity_gradient(gradient)
        acceleration = per_density * divergence(stress_gradient(gradient))
        return join(acceleration, elastic_rate(L, material.lame, material.shear, material.young))

    return minus_div_flux
