"""Perzyna viscoplasticity with von Mises yield (METHOD section 1).

d_vp = γ ⟨(q − Y)/Y⟩ᴺ ∂q/∂σ, dε̄/dt = γ ⟨(q − Y)/Y⟩ᴺ, Y = max(Y0 + H ε̄, r Y0). Y is a function of ε̄, so ε̄ is
the only internal variable.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..physics.space import Space
from ..scene.material import DerivedField, InternalVariable, parameter
from ..scene.registry import register
from .elastic import Elastic, with_moduli
from .law import Law

MEAN_YIELD_ITERATIONS = 4


@register
@dataclass(frozen=True, kw_only=True)
class PerzynaVonMises(Elastic):
    """Perzyna viscoplasticity with von Mises yield: dε̄/dt = γ ⟨(q − Y)/Y⟩ᴺ, Y = max(Y0 + H ε̄, r Y0).

    Raises:
        SceneError: a parameter is not allowed.

    Source: Blanc and Pastor (2012), with the flow along ∂q/∂σ (METHOD section 1); the paper lets Y reach zero.

    >>> soil = PerzynaVonMises(young_modulus=8e7, density=2000.0, fluidity=1.0, yield_size=2e5)
    >>> soil.flow_rate(dim=1)  # E γ N/Y0 in a bar
    400.0
    """

    fluidity: float = parameter("1/s", "fluidity γ", at_least=0.0)
    exponent: float = parameter("-", "exponent N of the overstress", default=1.0, at_least=1.0)
    yield_size: float = parameter("Pa", "initial size Y0 of the yield surface, a uniaxial yield stress", above=0.0)
    hardening: float = parameter("Pa", "H = dY/dε̄, above −E; negative softens", default=0.0)
    residual_ratio: float = parameter(
        "-", "softening ends at this share r of Y0", default=0.1, above=0.0, at_most=1.0
    )

    internals = (InternalVariable("equivalent_plastic_strain", "-", "equivalent viscoplastic strain ε̄"),)
    derived = (
        DerivedField(
            "yield_size",
            "Pa",
            "size of the yield surface Y",
            lambda stress, internals, material: material.yield_size_at(internals[:, 0]),
        ),
    )

    def bounds(self, name: str) -> Mapping[str, float]:
        """Those of the hardening follow from the stiffness: with less the stress would snap back."""
        return {"above": -self.young_modulus} if name == "hardening" else super().bounds(name)

    def flow_rate(self, dim: int) -> float:
        """Fastest rate of the overstress in slow loading [1/s]: at q = 2Y, where N > 1 is as stiff as it gets."""
        smallest_yield_size = self.yield_size * (self.residual_ratio if self.hardening < 0.0 else 1.0)
        return self.relaxation_modulus(dim) * self.fluidity * self.exponent / smallest_yield_size

    def yield_size_at(self, plastic_strain: np.ndarray) -> np.ndarray:
        """Y [Pa] at equivalent plastic strains ε̄, of the same shape."""
        return np.maximum(self.yield_size + self.hardening * plastic_strain, self.residual_ratio * self.yield_size)

    def law(self, space: Space) -> Law:
        """The viscoplastic law."""
        return _law(space)


@cache
def _law(space: Space) -> Law:
    real, scalar = space.real, space.vec(1)

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
        parameters = with_moduli(PerzynaParameters(), material)
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
    def shear_strength(sigma: space.types.stress, internals: scalar, p: PerzynaParameters):
        """Y/√3, that of simple shear."""
        return current_yield_size(internals[0], p) / wp.sqrt(real(3.0))

    @wp.func
    def flow(sigma: space.types.stress, internals: scalar, p: PerzynaParameters):
        q = space.stress.von_mises(sigma)
        Y = current_yield_size(internals[0], p)
        rate = space.types.stress()
        eps_rate = scalar()
        if not q <= Y:  # a NaN flows, and shows
            over = (q - Y) / Y
            if p.exponent != real(1.0):
                over = wp.pow(over, p.exponent)
            eps_rate[0] = p.fluidity * over
            rate = -eps_rate[0] * space.stress.relaxation(sigma, q, p.shear, p.young)
        return rate, eps_rate

    @wp.func
    def flow_stiffness(sigma: space.types.stress, internals: scalar, p: PerzynaParameters):
        """A bound of the rate at which the overstress decays: (3G + |H| q/Y) γ N ⟨(q − Y)/Y⟩^{N−1}/Y."""
        q = space.stress.von_mises(sigma)
        Y = current_yield_size(internals[0], p)
        lam = real(0.0)
        if q > Y:
            slope = p.fluidity / Y
            if p.exponent != real(1.0):
                slope *= p.exponent * wp.pow((q - Y) / Y, p.exponent - real(1.0))
            lam = slope * (space.stress.relaxation_modulus(p.shear, p.young) + wp.abs(p.hardening) * q / Y)
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
    def relax(sigma: space.types.stress, internals: scalar, p: PerzynaParameters, dt: real):
        q = space.stress.von_mises(sigma)
        eps = internals[0]
        Y = current_yield_size(eps, p)
        if q <= Y:
            return sigma, internals
        modulus = space.stress.relaxation_modulus(p.shear, p.young)
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
        return sigma - strain * space.stress.relaxation(sigma, q, p.shear, p.young), internals_new

    return Law(
        Parameters=PerzynaParameters,
        fill=fill,
        internals=PerzynaVonMises.internals,
        relax=relax,
        flow=flow,
        flow_stiffness=flow_stiffness,
        shear_strength=shear_strength,
    )
