"""Isotropic linear elasticity: ∂σ/∂t = Dₑ : d. Its rate belongs to the waves, so there is no source."""

from functools import cache

import warp as wp

from ..physics.space import Space
from ..scene.material import Elastic
from .law import Law


@cache
def elastic(space: Space) -> Law:
    """The elastic law."""

    @wp.struct
    class ElasticParameters:
        young: space.real
        lame: space.real
        shear: space.real

    def fill(material: Elastic):
        parameters = ElasticParameters()
        fill_moduli(parameters, material)
        return parameters

    return Law(ElasticParameters, fill)


def fill_moduli(parameters, material: Elastic) -> None:
    """Set the moduli that every law has."""
    parameters.young = material.young_modulus
    parameters.lame = material.lame_modulus
    parameters.shear = material.shear_modulus
