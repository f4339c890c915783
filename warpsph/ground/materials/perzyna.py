"""Perzyna viscoplasticity with von Mises yield (METHOD section 1).

d_vp = γ ⟨(q − Y)/Y⟩ᴺ ∂q/∂σ, dε̄/dt = γ ⟨(q − Y)/Y⟩ᴺ, Y = max(Y0 + H ε̄, r Y0). Y is a function of ε̄, so ε̄ is
the only internal variable.
"""

from functools import cache

import warp as wp

from ...scene.dimension import Continuum
from ...scene.material import PerzynaVonMises
from ..kinematics import kinematics
from ..precision import Precision
from .elastic import fill_moduli
from .law import Law


@cache
def perzyna_von_mises(continuum: Continuum, precision: Precision) -> Law:
    """The viscoplastic law."""
    real = precision.real
    stress, scalar = precision.vec(continuum.stress_size), precision.vec(1)
    kin = kinematics(continuum, precision)
    von_mises, relaxation = kin.von_mises, kin.relaxation
    in_bar = continuum.dim == 1

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

    def fill(material: PerzynaVonMises):
        parameters = PerzynaParameters()
        fill_moduli(parameters, material)
        parameters.fluidity = material.fluidity
        parameters.exponent = material.exponent
        parameters.yield_size = material.yield_size
        parameters.hardening = material.hardening
        parameters.residual = material.residual_ratio * material.yield_size
        return parameters

    @wp.func
    def current_yield_size(eps: real, p: PerzynaParameters):
        return wp.max(p.yield_size + p.hardening * eps, p.residual)

    @wp.func
    def flow(sigma: stress, history: scalar, p: PerzynaParameters):
        q = von_mises(sigma)
        Y = current_yield_size(history[0], p)
        rate = stress()
        eps_rate = scalar()
        if q > Y:
            over = (q - Y) / Y
            if p.exponent != real(1.0):
                over = wp.pow(over, p.exponent)
            eps_rate[0] = p.fluidity * over
            rate = -eps_rate[0] * relaxation(sigma, q, p.shear, p.young)
        return rate, eps_rate

    @wp.func
    def flow_stiffness(sigma: stress, history: scalar, p: PerzynaParameters):
        """|∂(dq/dt)/∂q| + |∂(dq/dt)/∂ε̄|-like bound: (3G + |H| q/Y) γ N ⟨·⟩^{N−1}/Y."""
        q = von_mises(sigma)
        Y = current_yield_size(history[0], p)
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

    return Law(
        PerzynaParameters,
        fill,
        history=(("equivalent_plastic_strain", "-"),),
        flow=flow,
        flow_stiffness=flow_stiffness,
    )
