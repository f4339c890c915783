"""Perzyna viscoplasticity with von Mises yield (METHOD section 1).

d_vp = γ ⟨(q − Y)/Y⟩ᴺ ∂q/∂σ, dε̄/dt = γ ⟨(q − Y)/Y⟩ᴺ, Y = max(Y0 + H ε̄, r Y0). Y is a function of ε̄, so ε̄ is
the only internal variable.
"""

from functools import cache

import warp as wp

from ..physics.space import Space
from ..scene.material import PerzynaVonMises
from .elastic import fill_moduli
from .law import Law

MEAN_YIELD_ITERATIONS = 4


@cache
def perzyna_von_mises(space: Space) -> Law:
    """The viscoplastic law."""
    real = space.real
    stress, scalar = space.vec(space.continuum.stress_size), space.vec(1)
    kin = space.stress
    von_mises, relaxation = kin.von_mises, kin.relaxation
    in_bar = space.dim == 1

    @wp.struct
    class PerzynaParameters:
        young: real
        lame: real
        shear: real
        fluidity: real
        exponent: real
        yield_size: real
        hardening: real
        residual: real
        mean_yield_iterations: wp.int32

    def fill(material: PerzynaVonMises):
        parameters = PerzynaParameters()
        fill_moduli(parameters, material)
        parameters.fluidity = material.fluidity
        parameters.exponent = material.exponent
        parameters.yield_size = material.yield_size
        parameters.hardening = material.hardening
        parameters.residual = material.residual_ratio * material.yield_size
        parameters.mean_yield_iterations = MEAN_YIELD_ITERATIONS if material.hardening else 1
        return parameters

    @wp.func
    def current_yield_size(eps: real, p: PerzynaParameters):
        Y = p.yield_size + p.hardening * eps
        return wp.where(p.residual > Y, p.residual, Y)  # unlike a maximum, keeps a NaN

    @wp.func
    def flow(sigma: stress, internals: scalar, p: PerzynaParameters):
        q = von_mises(sigma)
        Y = current_yield_size(internals[0], p)
        rate = stress()
        eps_rate = scalar()
        if not q <= Y:  # a NaN flows, and shows
            over = (q - Y) / Y
            if p.exponent != real(1.0):
                over = wp.pow(over, p.exponent)
            eps_rate[0] = p.fluidity * over
            rate = -eps_rate[0] * relaxation(sigma, q, p.shear, p.young)
        return rate, eps_rate

    @wp.func
    def flow_stiffness(sigma: stress, internals: scalar, p: PerzynaParameters):
        """A bound of the rate at which the overstress decays: (3G + |H| q/Y) γ N ⟨(q − Y)/Y⟩^{N−1}/Y."""
        q = von_mises(sigma)
        Y = current_yield_size(internals[0], p)
        modulus = real(3.0) * p.shear
        if wp.static(in_bar):
            modulus = p.young
        lam = real(0.0)
        if q > Y:
            slope = p.fluidity / Y
            if p.exponent != real(1.0):
                slope *= p.exponent * wp.pow((q - Y) / Y, p.exponent - real(1.0))
            lam = slope * (modulus + wp.abs(p.hardening) * q / Y)
        return lam

    @wp.func
    def overstress_after(over: real, b: real, Y: real, p: PerzynaParameters, dt: real):
        """F = q − Y after dt of dF/dt = −b γ (F/Y)ᴺ at constant Y: exact for every N."""
        rate = b * p.fluidity * dt / Y
        if p.exponent == real(1.0):
            return over * wp.exp(-rate)
        n = p.exponent - real(1.0)
        return over * wp.pow(real(1.0) + n * rate * wp.pow(over / Y, n), -real(1.0) / n)

    @wp.func
    def relax(sigma: stress, internals: scalar, p: PerzynaParameters, dt: real):
        q = von_mises(sigma)
        eps = internals[0]
        Y = current_yield_size(eps, p)
        if q <= Y:
            return sigma, internals
        modulus = real(3.0) * p.shear
        if wp.static(in_bar):
            modulus = p.young
        over = q - Y
        b = modulus + p.hardening
        if p.hardening < real(0.0) and p.residual >= Y:
            b = modulus
        # Y moves with the flow: take its mean over the step, found by iteration (a contraction, |H| < b).
        strain = real(0.0)
        for _ in range(p.mean_yield_iterations):
            mean = real(0.5) * (Y + current_yield_size(eps + strain, p))
            strain = (over - overstress_after(over, b, mean, p, dt)) / b
        # Where softening ends on the way, the rest of the time passes at the residual size.
        softened = (p.residual - Y) / wp.min(p.hardening, real(-1e-30))
        if p.hardening < real(0.0) and p.residual < Y and strain > softened:
            left = dt * (real(1.0) - softened / strain)
            over = over - b * softened
            strain = softened + (over - overstress_after(over, modulus, p.residual, p, left)) / modulus
        internals_new = internals
        internals_new[0] = eps + strain
        return sigma - strain * relaxation(sigma, q, p.shear, p.young), internals_new

    return Law(
        PerzynaParameters,
        fill,
        internals=(("equivalent_plastic_strain", "-", "equivalent viscoplastic strain ε̄"),),
        flow=flow,
        flow_stiffness=flow_stiffness,
        relax=relax,
    )
