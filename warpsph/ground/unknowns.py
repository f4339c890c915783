"""The unknowns φ = (v, σ) of a node as one vector, since both sweeps treat all of them alike."""

from dataclasses import dataclass
from functools import cache

import warp as wp

from ..scene.dimension import Continuum
from .precision import Precision


@dataclass(frozen=True)
class Unknowns:
    """φ and its gradient, and how to take them apart.

    Attributes:
        phi: vector of length d + s.
        gradient: (d + s) × d matrix ∂φ_k/∂x_l.
        velocity, stress: φ → v, φ → σ.
        join: (v, σ) → φ.
        velocity_gradient, stress_gradient: ∇φ → L (d × d), ∇φ → ∇σ (s × d).
    """

    phi: type
    gradient: type
    velocity: wp.Function
    stress: wp.Function
    join: wp.Function
    velocity_gradient: wp.Function
    stress_gradient: wp.Function


@cache
def unknowns(continuum: Continuum, precision: Precision) -> Unknowns:
    """The unknowns of one continuum in one precision."""
    d, s = continuum.dim, continuum.stress_size
    vector, stress_vector, phi = precision.vec(d), precision.vec(s), precision.vec(d + s)
    tensor, gradient_of_stress = precision.mat(d, d), precision.mat(s, d)
    gradient = precision.mat(d + s, d)

    @wp.func
    def velocity(values: phi):
        v = vector()
        for k in range(wp.static(d)):
            v[k] = values[k]
        return v

    @wp.func
    def stress(values: phi):
        sigma = stress_vector()
        for k in range(wp.static(s)):
            sigma[k] = values[wp.static(d) + k]
        return sigma

    @wp.func
    def join(v: vector, sigma: stress_vector):
        values = phi()
        for k in range(wp.static(d)):
            values[k] = v[k]
        for k in range(wp.static(s)):
            values[wp.static(d) + k] = sigma[k]
        return values

    @wp.func
    def velocity_gradient(grad: gradient):
        L = tensor()
        for k in range(wp.static(d)):
            L[k] = grad[k]
        return L

    @wp.func
    def stress_gradient(grad: gradient):
        g = gradient_of_stress()
        for k in range(wp.static(s)):
            g[k] = grad[wp.static(d) + k]
        return g

    return Unknowns(phi, gradient, velocity, stress, join, velocity_gradient, stress_gradient)
