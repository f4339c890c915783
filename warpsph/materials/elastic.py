"""Isotropic linear elasticity: ∂σ/∂t = Dₑ : d. Its rate belongs to the waves, so there is no source."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..mesh.continuum import Continuum
from ..physics.space import Space
from ..scene.material import Material, parameter
from ..scene.registry import register
from .law import Law


@register
@dataclass(frozen=True, kw_only=True)
class Elastic(Material):
    """Isotropic linear elasticity; a bar is in uniaxial stress.

    Raises:
        SceneError: a parameter is not allowed.

    >>> Elastic(young_modulus=8e7, density=2000.0).wave_speed(dim=1)
    200.0
    >>> Elastic(young_modulus=8e7, density=-1.0)
    Traceback (most recent call last):
    warpsph.errors.SceneError: density = -1.0 is not allowed: it must be a finite number above 0.0
    """

    young_modulus: float = parameter("Pa", "Young's modulus E", above=0.0)
    poisson_ratio: float = parameter(
        "-", "Poisson's ratio ν, without effect in a bar", default=0.0, above=-1.0, below=0.5
    )

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

    def law(self, space: Space) -> Law:
        """The elastic law."""
        return _law(space)


@cache
def _law(space: Space) -> Law:
    @wp.struct
    class ElasticParameters:
        young: space.real
        lame: space.real
        shear: space.real

    def fill(material: Elastic):
        return with_moduli(ElasticParameters(), material)

    return Law(Parameters=ElasticParameters, fill=fill)


def with_moduli(parameters, material: Elastic):
    """The parameters with the three moduli set that every law has."""
    parameters.young = material.young_modulus
    parameters.lame = material.lame_modulus
    parameters.shear = material.shear_modulus
    return parameters
