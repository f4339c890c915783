"""The unknowns φ = (v, σ) of a node as one vector, since both sweeps treat all of them alike."""

from dataclasses import dataclass
from functools import cache

import warp as wp

from ..device.precision import Precision
from ..mesh.continuum import Continuum


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
    gradient = precision.mat(d + s, d)

    @wp.func
    def velocity(values: phi):
        return values[: wp.static(d)]

    @wp.func
    def stress(values: phi):
        return values[wp.static(d) :]

    @wp.func
    def join(v: vector, sigma: stress_vector):
        values = phi()
        values[: wp.static(d)] = v
        values[wp.static(d) :] = sigma
        return values

    @wp.func
    def velocity_gradient(grad: gradient):
        return grad[: wp.static(d)]

    @wp.func
    def stress_gradient(grad: gradient):
        return grad[wp.static(d) :]

    return Unknowns(phi, gradient, velocity, stress, join, velocity_gradient, stress_gradient)
