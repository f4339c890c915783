"""Small matrices: the inverse of the corrected gradient's, safe when neighbours are missing; determinants."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from .precision import Precision

# A is called rank-deficient when det A < RANK_TOLERANCE (tr A/d)ᵈ: a point that sees its neighbours along one
# line (or plane) only. Warp's inverse would return zeros in silence.
RANK_TOLERANCE = 1e-5
REGULARISATION = 1e-3
DOUBLINGS = 7  # of the power method, which then tells eigenvalues apart that differ by 3 %


@dataclass(frozen=True)
class LinearAlgebra:
    """Functions of d × d matrices, d = 1 included.

    Attributes:
        determinant: A → det A.
        symmetric_inverse: A → A⁻¹ of a symmetric positive semi-definite one, regularised where it has lost rank.
        rotation: (L, Δt) → exp(ω Δt), ω the skew part of L.
        largest: A → its largest eigenvalue, A symmetric and positive semi-definite, not zero.
    """

    determinant: wp.Function
    symmetric_inverse: wp.Function
    rotation: wp.Function
    largest: wp.Function


@cache
def linear_algebra(dim: int, precision: Precision) -> LinearAlgebra:
    """The functions of one dimension in one precision."""
    functions = (determinant_of, symmetric_inverse, rotation_of, largest_of)
    return LinearAlgebra(*(function(dim, precision) for function in functions))


@cache
def symmetric_inverse(dim: int, precision: Precision) -> wp.Function:
    """A⁻¹ of a symmetric positive semi-definite matrix; of A + 10⁻³ tr(A) 1 where A has lost rank.

    The right-hand sides lie in the span of the neighbours' directions, so the regularised inverse acts as a
    pseudo-inverse there: the gradient along directions without neighbours is about zero. A = 0 gives zero.
    """
    real, matrix = precision.real, precision.mat(dim, dim)

    @wp.func
    def inverse(a: matrix):
        tr = wp.trace(a)
        if tr <= real(0.0):
            return matrix()
        per_scale = real(dim) / tr
        n = per_scale * a
        if wp.static(dim == 1):
            n[0, 0] = real(1.0) / n[0, 0]
            return per_scale * n
        else:
            if wp.determinant(n) < real(RANK_TOLERANCE):
                for k in range(wp.static(dim)):
                    n[k, k] += real(wp.static(REGULARISATION * dim))
            return per_scale * wp.inverse(n)

    return inverse


@cache
def determinant_of(dim: int, precision: Precision) -> wp.Function:
    """Determinant of a d × d matrix, d = 1 included."""
    matrix = precision.mat(dim, dim)

    @wp.func
    def determinant(a: matrix):
        if wp.static(dim == 1):
            return a[0, 0]
        else:
            return wp.determinant(a)

    return determinant


@cache
def rotation_of(dim: int, precision: Precision) -> wp.Function:
    """(L, Δt) → R = exp(ω Δt), ω the skew part of L, by Rodrigues' formula, in the plane as in space.

    R = 1 + (sin θ/θ) K + ((1 − cos θ)/θ²) K² with K = ω Δt, θ² = −tr(K²)/2; the series' first terms at small θ.
    """
    real, matrix = precision.real, precision.mat(dim, dim)
    identity = matrix(np.eye(dim))

    @wp.func
    def rotation(L: matrix, dt: real):
        K = (real(0.5) * dt) * (L - wp.transpose(L))
        K2 = K * K
        theta2 = real(-0.5) * wp.trace(K2)
        first = real(1.0) - theta2 / real(6.0)
        second = real(0.5) - theta2 / real(24.0)
        if theta2 > real(1e-4):
            theta = wp.sqrt(theta2)
            first = wp.sin(theta) / theta
            second = (real(1.0) - wp.cos(theta)) / theta2
        return identity + first * K + second * K2

    return rotation


@cache
def largest_of(dim: int, precision: Precision) -> wp.Function:
    """The largest eigenvalue of a symmetric positive semi-definite matrix, by squaring it again and again."""
    matrix = precision.mat(dim, dim)

    @wp.func
    def largest(a: matrix):
        power = a / wp.trace(a)
        for _ in range(DOUBLINGS):
            power = power * power
            power = power / wp.trace(power)
        return wp.trace(a * power)

    return largest
