"""Small matrices: the inverse of the corrected gradient's, safe when neighbours are missing; determinants."""

from functools import cache

import warp as wp

from .precision import Precision

# A is called rank-deficient when det A < RANK_TOLERANCE (tr A/d)ᵈ: a point that sees its neighbours along one
# line (or plane) only. Warp's inverse would return zeros in silence.
RANK_TOLERANCE = 1e-5
REGULARISATION = 1e-3


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
        scale = tr / real(dim)
        n = a / scale
        if wp.static(dim == 1):
            n[0, 0] = real(1.0) / n[0, 0]
            return n / scale
        else:
            if wp.determinant(n) < real(RANK_TOLERANCE):
                for k in range(wp.static(dim)):
                    n[k, k] += real(wp.static(REGULARISATION * dim))
            return wp.inverse(n) / scale

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
