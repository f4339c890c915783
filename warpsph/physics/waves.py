"""The flux part: ∂φ/∂t + div f(φ) = 0, whose waves are the elastic ones."""

from functools import cache

import warp as wp

from ..device.precision import Precision
from ..mesh.continuum import Continuum
from .stress import kinematics
from .unknowns import unknowns


@cache
def wave_rate(continuum: Continuum, precision: Precision, Parameters: type) -> wp.Function:
    """(∇φ, 1/ρ, material) → −div f(φ) = (div σ/ρ, Dₑ : d). 1/ρ stands outside the sum, exact where ρ varies."""
    kin, phi = kinematics(continuum, precision), unknowns(continuum, precision)
    elastic_rate, divergence, join = kin.elastic_rate, kin.divergence, phi.join
    velocity_gradient, stress_gradient = phi.velocity_gradient, phi.stress_gradient

    @wp.func
    def minus_div_flux(gradient: phi.gradient, per_density: precision.real, material: Parameters):
        L = velocity_gradient(gradient)
        acceleration = per_density * divergence(stress_gradient(gradient))
        return join(acceleration, elastic_rate(L, material.lame, material.shear, material.young))

    return minus_div_flux
