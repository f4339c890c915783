"""Smoothing functions W(ξ), ξ = r/h, each as a pure function of ξ².

Values and gradients are corrected (METHOD section 2), so every constant factor of W and of ∇W cancels: a
function returns the pair (W, −W′/ξ), each up to a positive constant of its own. ∇W is then along the second
times the vector from the target to the neighbour.
"""

import math
from functools import cache
from itertools import product

import warp as wp

from .precision import Precision


@cache
def gaussian(precision: Precision) -> wp.Function:
    """W = exp(−ξ²); −W′/ξ = 2 W."""

    @wp.func
    def gaussian_weights(s: precision.real):
        w = wp.exp(-s)
        return w, w

    return gaussian_weights


@cache
def cubic_spline(precision: Precision) -> wp.Function:
    """W = 1 − 3/2 ξ² + 3/4 ξ³ for ξ < 1, (2 − ξ)³/4 for ξ < 2."""
    real = precision.real

    @wp.func
    def cubic_spline_weights(s: real):
        xi = wp.sqrt(s)
        if xi < real(1.0):
            w = real(1.0) - s * (real(1.5) - real(0.75) * xi)
            g = real(3.0) - real(2.25) * xi
        else:
            y = wp.max(real(2.0) - xi, real(0.0))
            w = real(0.25) * y * y * y
            g = real(0.75) * y * y / xi
        return w, g

    return cubic_spline_weights


@cache
def wendland_c2(precision: Precision) -> wp.Function:
    """W = (1 − ξ/2)⁴ (1 + 2ξ) for ξ < 2; −W′/ξ = 5 (1 − ξ/2)³."""
    real = precision.real

    @wp.func
    def wendland_c2_weights(s: real):
        xi = wp.sqrt(s)
        y = wp.max(real(1.0) - real(0.5) * xi, real(0.0))
        y3 = y * y * y
        return y3 * y * (real(1.0) + real(2.0) * xi), y3

    return wendland_c2_weights


# The names, supports and default smoothing ratios are in `warpsph.scene.numerics.KERNELS`.
SMOOTHING_FUNCTIONS = {"gaussian": gaussian, "cubic_spline": cubic_spline, "wendland_c2": wendland_c2}


def second_moment(weight: wp.Function, precision: Precision, ratio: float, support: float, dim: int) -> float:
    """m₂ = Σ W x²/Σ W over the lattice points at ±½, ±3/2, … inside the support, in units of Δx² [-].

    The wave part of the step is stable for c_p Δt/Δx ≤ 2 √m₂ (METHOD section 4). Only the Gaussian, a product
    of functions along the axes, has nearly the same m₂ in every dimension.

    Args:
        weight: one of `SMOOTHING_FUNCTIONS` in the given precision.
        ratio: h/Δx.
        support: radius of the support over h.
        dim: number of space dimensions.
    """
    row = [k + 0.5 for k in range(math.ceil(ratio * support))]
    points = [x for x in product(row, repeat=dim) if sum(c * c for c in x) < (ratio * support) ** 2]
    weights = [float(weight(precision.real(sum(c * c for c in x) / ratio**2))[0]) for x in points]
    return sum(w * x[0] ** 2 for w, x in zip(weights, points, strict=True)) / sum(weights)
