"""Isotropic linear elasticity: ∂σ/∂t = Dₑ : d. Its rate belongs to the waves, so there is no source."""

from functools import cache

import warp as wp

from ..device.precision import Precision
from ..mesh.continuum import Continuum
from ..scene.material import Elastic
from .law import Law


@cache
def elastic(continuum: Continuum, precision: Precision) -> Law:
    """The elastic law."""

    @wp.struct
    class ElasticParameters:
        young: precision.real
        lame: precision.real
        shear: precision.real

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
