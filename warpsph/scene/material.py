"""Materials a user can name. The laws themselves are in `warpsph.materials`."""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass, field, fields, replace

import numpy as np

from ..mesh.continuum import Continuum
from ..validate import number


def parameter(unit: str, meaning: str, *, default: object = MISSING, **bounds: float):
    """A parameter of a material: the one place of its unit, its meaning and its bounds, those of `number`."""
    return field(default=default, metadata={"unit": unit, "meaning": meaning, "bounds": bounds})


@dataclass(frozen=True, kw_only=True)
class Elastic:
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
    density: float = parameter("kg/m³", "density ρ", above=0.0)

    def __post_init__(self):
        for entry in fields(self):
            if "bounds" in entry.metadata:
                self._check(entry.name, **entry.metadata["bounds"])

    def _check(self, name: str, **bounds: float) -> None:
        object.__setattr__(self, name, number(name, getattr(self, name), **bounds))

    def with_parameters(self, values: object) -> Elastic:
        """The material with what `values`, a scene's p, has of its parameters; see `Parameter.of`."""
        given = {entry.name: getattr(values, entry.name) for entry in fields(self) if hasattr(values, entry.name)}
        return replace(self, **given)

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

    def __post_init__(self):
        super().__post_init__()
        self._check("hardening", above=-self.young_modulus)

    def flow_rate(self, dim: int) -> float:
        """Fastest rate of the overstress in slow loading [1/s]: at q = 2Y, where N > 1 is as stiff as it gets."""
        smallest_yield_size = self.yield_size * (self.residual_ratio if self.hardening < 0.0 else 1.0)
        return self.relaxation_modulus(dim) * self.fluidity * self.exponent / smallest_yield_size
