"""Materials a user can name. The laws themselves are in `warpsph.materials`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..mesh.continuum import Continuum
from ..validate import number


@dataclass(frozen=True, kw_only=True)
class Elastic:
    """Isotropic linear elasticity.

    Args:
        young_modulus: E [Pa], > 0.
        poisson_ratio: ν [-], in (−1, 0.5); unused by a bar, which is in uniaxial stress.
        density: ρ [kg/m³], > 0.

    Raises:
        SceneError: a parameter is not allowed.

    >>> Elastic(young_modulus=8e7, density=2000.0).wave_speed(dim=1)
    200.0
    >>> Elastic(young_modulus=8e7, density=-1.0)
    Traceback (most recent call last):
    warpsph.errors.SceneError: density = -1.0 is not allowed: it must be a finite number above 0.0
    """

    young_modulus: float
    density: float
    poisson_ratio: float = 0.0

    def __post_init__(self):
        self._check("young_modulus", above=0.0)
        self._check("density", above=0.0)
        self._check("poisson_ratio", above=-1.0, below=0.5)

    def _check(self, field: str, **bounds: float) -> None:
        object.__setattr__(self, field, number(field, getattr(self, field), **bounds))

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + ν)) [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_modulus(self) -> float:
        """λ = E ν / ((1 + ν)(1 − 2ν)) [Pa]."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    def stiffness(self, continuum: Continuum) -> np.ndarray:
        """Dₑ [Pa] from strains (engineering shear) to the stored stresses, shape (s, s); E for a bar."""
        if continuum.dim == 1:
            return np.array([[self.young_modulus]])
        normal = np.array([i == j for i, j in continuum.pairs])
        shear = self.shear_modulus * np.where(normal, 2.0, 1.0)
        return self.lame_modulus * np.outer(normal, normal) + np.diag(shear)

    def wave_speed(self, dim: int) -> float:
        """Speed of the fastest wave [m/s]: √(E/ρ) in a bar, √((λ + 2G)/ρ) otherwise."""
        modulus = self.young_modulus if dim == 1 else self.lame_modulus + 2.0 * self.shear_modulus
        return math.sqrt(modulus / self.density)

    def shear_wave_speed(self) -> float:
        """√(G/ρ) [m/s]."""
        return math.sqrt(self.shear_modulus / self.density)

    def relaxation_modulus(self, dim: int) -> float:
        """−dq/dε̄ at fixed strain [Pa]: how fast inelastic flow relaxes q; E in a bar, 3G otherwise."""
        return self.young_modulus if dim == 1 else 3.0 * self.shear_modulus

    def flow_rate(self, dim: int) -> float:
        """Fastest rate at which inelastic flow relaxes the stress in slow loading [1/s]; 0 where nothing flows."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class PerzynaVonMises(Elastic):
    """Perzyna viscoplasticity with von Mises yield: dε̄/dt = γ ⟨(q − Y)/Y⟩ᴺ, Y = max(Y0 + H ε̄, r Y0).

    Args:
        fluidity: γ [1/s], ≥ 0.
        yield_size: initial size of the yield surface Y0 [Pa], > 0; a uniaxial yield stress.
        exponent: N [-], ≥ 1.
        hardening: H = dY/dε̄ [Pa]; negative softens.
        residual_ratio: r [-], in (0, 1]: softening ends at Y = r Y0 (the paper lets Y reach zero).

    Raises:
        SceneError: a parameter is not allowed.

    Source: Blanc and Pastor (2012), with the flow along ∂q/∂σ; docs/method.md, section 1.

    >>> soil = PerzynaVonMises(young_modulus=8e7, density=2000.0, fluidity=1.0, yield_size=2e5)
    >>> soil.flow_rate(dim=1)  # E γ N/Y0 in a bar
    400.0
    """

    fluidity: float
    yield_size: float
    exponent: float = 1.0
    hardening: float = 0.0
    residual_ratio: float = 0.1

    def __post_init__(self):
        super().__post_init__()
        self._check("fluidity", at_least=0.0)
        self._check("yield_size", above=0.0)
        self._check("exponent", at_least=1.0)
        self._check("hardening", above=-self.young_modulus)
        self._check("residual_ratio", above=0.0, at_most=1.0)

    def flow_rate(self, dim: int) -> float:
        """Fastest rate of the overstress in slow loading [1/s]: at q = 2Y, where N > 1 is as stiff as it gets."""
        smallest_yield_size = self.yield_size * (self.residual_ratio if self.hardening < 0.0 else 1.0)
        return self.relaxation_modulus(dim) * self.fluidity * self.exponent / smallest_yield_size
