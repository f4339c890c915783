"""What a velocity gradient does to stresses and a stress gradient to velocities, in one, two and three dimensions.

`L` is the velocity gradient L_ij = ∂v_i/∂x_j. Stresses are stored as vectors in the order of
`Continuum.pairs`: bar (11), plane strain (11, 22, 12, 33), solid (11, 22, 33, 12, 13, 23).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import warp as wp

from ..device.precision import Precision
from ..mesh.continuum import Continuum
from .types import NodeTypes, node_types


@dataclass(frozen=True, kw_only=True)
class StressFunctions:
    """The pure functions of one continuum in one precision.

    Attributes:
        elastic_rate: (L, λ, G, E) → Dₑ : d.
        divergence: gradient of the stored stresses (s × d) → div σ (d).
        spin: (σ, L) → ω σ − σ ω (Jaumann).
        mean: σ → tr σ/3, tension positive; σ/3 in a bar.
        deviator: σ → s = σ − (tr σ/3) 1 as stored.
        von_mises: σ → q = √(3 J₂); |σ| in a bar.
        relaxation: (σ, q, G, E) → Dₑ : ∂q/∂σ, what a unit of flow along ∂q/∂σ takes off the stress: 3 G s/q;
            E σ/q in a bar.
        relaxation_modulus: (G, E) → what it takes off q, ∂q/∂σ : Dₑ : ∂q/∂σ: 3 G; E in a bar.
        spherical: p → p 1 as stored, σ33 of plane strain included; p in a bar.
        transform: (σ, P) → P σ Pᵀ of the components in space; σ33 of plane strain is kept.
        traction: (σ, n) → σ n.
        complementary: (σ, σ', λ, G, E) → σ : Dₑ⁻¹ : σ', twice the elastic energy a volume has where σ = σ'.
    """

    elastic_rate: wp.Function
    divergence: wp.Function
    spin: wp.Function
    mean: wp.Function
    deviator: wp.Function
    von_mises: wp.Function
    relaxation: wp.Function
    relaxation_modulus: wp.Function
    spherical: wp.Function
    transform: wp.Function
    traction: wp.Function
    complementary: wp.Function


@cache
def stress_functions(continuum: Continuum, precision: Precision) -> StressFunctions:
    """The functions of a continuum."""
    return _OF_CONTINUUM[continuum.name](node_types(continuum, precision), precision.real)


def _bar(types: NodeTypes, real: type) -> StressFunctions:
    """Uniaxial stress: one velocity, one stress, modulus E."""

    @wp.func
    def elastic_rate(L: types.tensor, lame: real, shear: real, young: real):
        return types.stress(young * L[0, 0])

    @wp.func
    def divergence(g: types.tensor):
        return types.vector(g[0, 0])

    @wp.func
    def spin(sigma: types.stress, L: types.tensor):
        return types.stress(real(0.0))

    @wp.func
    def spherical(p: real):
        return types.stress(p)

    @wp.func
    def mean(sigma: types.stress):
        return sigma[0] / real(3.0)

    @wp.func
    def deviator(sigma: types.stress):
        return sigma - spherical(mean(sigma))

    @wp.func
    def von_mises(sigma: types.stress):
        return wp.abs(sigma[0])

    @wp.func
    def relaxation(sigma: types.stress, q: real, shear: real, young: real):
        return (young / q) * sigma

    @wp.func
    def relaxation_modulus(shear: real, young: real):
        return young

    @wp.func
    def transform(sigma: types.stress, P: types.tensor):
        return P[0, 0] * sigma * P[0, 0]

    @wp.func
    def traction(sigma: types.stress, normal: types.vector):
        return types.vector(sigma[0] * normal[0])

    @wp.func
    def complementary(a: types.stress, b: types.stress, lame: real, shear: real, young: real):
        return a[0] * b[0] / young

    return StressFunctions(
        traction=traction,
        complementary=complementary,
        elastic_rate=elastic_rate,
        divergence=divergence,
        spin=spin,
        mean=mean,
        von_mises=von_mises,
        spherical=spherical,
        transform=transform,
        deviator=deviator,
        relaxation=relaxation,
        relaxation_modulus=relaxation_modulus,
    )


def _flow(types: NodeTypes, real: type, mean: wp.Function, spherical: wp.Function) -> dict[str, wp.Function]:
    """What deviatoric flow is made of wherever the whole mean stress is stored."""

    @wp.func
    def deviator(sigma: types.stress):
        return sigma - spherical(mean(sigma))

    @wp.func
    def relaxation(sigma: types.stress, q: real, shear: real, young: real):
        return (real(3.0) * shear / q) * deviator(sigma)

    @wp.func
    def relaxation_modulus(shear: real, young: real):
        return real(3.0) * shear

    return {"deviator": deviator, "relaxation": relaxation, "relaxation_modulus": relaxation_modulus}


def _complementary(types: NodeTypes, real: type, mean: wp.Function, double_dot: wp.Function) -> wp.Function:
    """σ : Dₑ⁻¹ : σ' = (σ : σ' − ν/(1 + ν) tr σ tr σ')/2G, ν/(1 + ν) = λ/(3λ + 2G)."""

    @wp.func
    def complementary(a: types.stress, b: types.stress, lame: real, shear: real, young: real):
        share = real(9.0) * lame / (real(3.0) * lame + real(2.0) * shear)
        return (double_dot(a, b) - share * mean(a) * mean(b)) / (real(2.0) * shear)

    return complementary


def _plane_strain(types: NodeTypes, real: type) -> StressFunctions:
    """Two velocities; stresses 11, 22, 12, 33 with d33 = 0."""

    @wp.func
    def elastic_rate(L: types.tensor, lame: real, shear: real, young: real):
        volumetric = lame * (L[0, 0] + L[1, 1])
        two_g = real(2.0) * shear
        return types.stress(
            volumetric + two_g * L[0, 0],
            volumetric + two_g * L[1, 1],
            shear * (L[0, 1] + L[1, 0]),
            volumetric,
        )

    @wp.func
    def divergence(g: types.stress_gradient):
        return types.vector(g[0, 0] + g[2, 1], g[2, 0] + g[1, 1])

    @wp.func
    def spin(sigma: types.stress, L: types.tensor):
        w = real(0.5) * (L[0, 1] - L[1, 0])
        turn = real(2.0) * w * sigma[2]
        return types.stress(turn, -turn, w * (sigma[1] - sigma[0]), real(0.0))

    @wp.func
    def von_mises(sigma: types.stress):
        a = sigma[0] - sigma[1]
        b = sigma[1] - sigma[3]
        c = sigma[3] - sigma[0]
        return wp.sqrt(real(0.5) * (a * a + b * b + c * c) + real(3.0) * sigma[2] * sigma[2])

    @wp.func
    def mean(sigma: types.stress):
        return (sigma[0] + sigma[1] + sigma[3]) / real(3.0)

    @wp.func
    def spherical(p: real):
        return types.stress(p, p, real(0.0), p)

    @wp.func
    def transform(sigma: types.stress, P: types.tensor):
        s = P * types.tensor(sigma[0], sigma[2], sigma[2], sigma[1]) * wp.transpose(P)
        return types.stress(s[0, 0], s[1, 1], s[0, 1], sigma[3])

    @wp.func
    def traction(sigma: types.stress, n: types.vector):
        return types.vector(sigma[0] * n[0] + sigma[2] * n[1], sigma[2] * n[0] + sigma[1] * n[1])

    @wp.func
    def double_dot(a: types.stress, b: types.stress):
        return wp.dot(a, b) + a[2] * b[2]

    return StressFunctions(
        traction=traction,
        complementary=_complementary(types, real, mean, double_dot),
        elastic_rate=elastic_rate,
        divergence=divergence,
        spin=spin,
        mean=mean,
        von_mises=von_mises,
        spherical=spherical,
        transform=transform,
        **_flow(types, real, mean, spherical),
    )


def _solid(types: NodeTypes, real: type) -> StressFunctions:
    """Three velocities; stresses 11, 22, 33, 12, 13, 23."""

    @wp.func
    def tensor(s: types.stress):
        return types.tensor(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2])

    @wp.func
    def stored(m: types.tensor):
        return types.stress(m[0, 0], m[1, 1], m[2, 2], m[0, 1], m[0, 2], m[1, 2])

    @wp.func
    def elastic_rate(L: types.tensor, lame: real, shear: real, young: real):
        volumetric = lame * wp.trace(L)
        return stored(volumetric * wp.identity(n=3, dtype=real) + shear * (L + wp.transpose(L)))

    @wp.func
    def divergence(g: types.stress_gradient):
        return types.vector(
            g[0, 0] + g[3, 1] + g[4, 2],
            g[3, 0] + g[1, 1] + g[5, 2],
            g[4, 0] + g[5, 1] + g[2, 2],
        )

    @wp.func
    def spin(sigma: types.stress, L: types.tensor):
        omega = real(0.5) * (L - wp.transpose(L))
        s = tensor(sigma)
        return stored(omega * s - s * omega)

    @wp.func
    def von_mises(sigma: types.stress):
        a = sigma[0] - sigma[1]
        b = sigma[1] - sigma[2]
        c = sigma[2] - sigma[0]
        shear2 = sigma[3] * sigma[3] + sigma[4] * sigma[4] + sigma[5] * sigma[5]
        return wp.sqrt(real(0.5) * (a * a + b * b + c * c) + real(3.0) * shear2)

    @wp.func
    def mean(sigma: types.stress):
        return (sigma[0] + sigma[1] + sigma[2]) / real(3.0)

    @wp.func
    def spherical(p: real):
        return types.stress(p, p, p, real(0.0), real(0.0), real(0.0))

    @wp.func
    def transform(sigma: types.stress, P: types.tensor):
        return stored(P * tensor(sigma) * wp.transpose(P))

    @wp.func
    def traction(sigma: types.stress, n: types.vector):
        return tensor(sigma) * n

    @wp.func
    def double_dot(a: types.stress, b: types.stress):
        return wp.dot(a, b) + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]

    return StressFunctions(
        traction=traction,
        complementary=_complementary(types, real, mean, double_dot),
        elastic_rate=elastic_rate,
        divergence=divergence,
        spin=spin,
        mean=mean,
        von_mises=von_mises,
        spherical=spherical,
        transform=transform,
        **_flow(types, real, mean, spherical),
    )


_OF_CONTINUUM: dict[str, Callable[[NodeTypes, type], StressFunctions]] = {
    "bar": _bar,
    "plane_strain": _plane_strain,
    "solid": _solid,
}
