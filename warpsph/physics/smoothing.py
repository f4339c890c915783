"""Smoothing functions W(ξ), ξ = r/h, each as a pure function of ξ².

Values and gradients are corrected (METHOD section 2), so every constant factor of W and of ∇W cancels: a
function returns the pair (W, −W′/ξ), each up to a positive constant of its own. ∇W is then along the second
times the vector from the target to the neighbour.
"""

import math
from functools import cache
from itertools import product

import numpy as np
import warp as wp
from numpy.polynomial import Chebyshev, Polynomial

from ..device.precision import PRECISIONS, Precision
from ..scene.registry import register
from ..scene.smoothing import SmoothingKernel

GAUSSIAN_SUPPORT = 3.0


@cache
def gaussian(precision: Precision) -> wp.Function:
    """W = exp(−ξ²) inside the support, to 5·10⁻¹⁴ (4·10⁻⁶ in float32); −W′/ξ = 2 W.

    As p(ξ²)¹⁶ with a polynomial p, Chebyshev's of exp(−ξ²/16): a call of exp would cost as much as the rest of a
    pair, and could not be taken for several neighbours at a time. Odd and even powers go side by side.
    """
    real, degree = precision.real, {"float32": 5, "float64": 9}[precision.name]
    root = Chebyshev.interpolate(lambda s: np.exp(-s / 16.0), degree, domain=[0.0, GAUSSIAN_SUPPORT**2])
    c = precision.vec(degree + 1)(*root.convert(kind=Polynomial).coef)

    @wp.func
    def gaussian_weights(s: real):
        even, odd, s2 = real(0.0), real(0.0), s * s
        for k in range(wp.static(degree - 1), -1, -2):
            even = even * s2 + c[k]
            odd = odd * s2 + c[k + 1]
        w = even + s * odd
        for _ in range(4):
            w *= w
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


# The ratios reach 1.8 Δx, a little beyond the 1.58 Δx (1.66 in 3D) that a corner node needs.
register(SmoothingKernel(name="gaussian", support=GAUSSIAN_SUPPORT, smoothing_ratio=0.6, weights=gaussian))
register(SmoothingKernel(name="cubic_spline", support=2.0, smoothing_ratio=0.9, weights=cubic_spline))
register(SmoothingKernel(name="wendland_c2", support=2.0, smoothing_ratio=0.9, weights=wendland_c2))


def second_moment(kernel: SmoothingKernel, *, ratio: float, dim: int) -> float:
    """m₂ = Σ W x²/Σ W over the lattice points at ±½, ±3/2, … inside the support, in units of Δx² [-].

    The wave part of the step is stable for c_p Δt/Δx ≤ 2 √m₂ (METHOD section 4). Only the Gaussian, a product
    of functions along the axes, has nearly the same m₂ in every dimension.

    Args:
        kernel: the smoothing kernel.
        ratio: h/Δx.
        dim: number of space dimensions.
    """
    precision, reach = PRECISIONS["float64"], ratio * kernel.support
    weight = kernel.weights(precision)
    row = [k + 0.5 for k in range(math.ceil(reach))]
    points = [x for x in product(row, repeat=dim) if sum(c * c for c in x) < reach**2]
    weights = [float(weight(precision.real(sum(c * c for c in x) / ratio**2))[0]) for x in points]
    return sum(w * x[0] ** 2 for w, x in zip(weights, points, strict=True)) / sum(weights)
