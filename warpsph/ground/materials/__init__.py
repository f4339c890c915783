"""Material laws: one file each, and one row here; see docs/materials.md."""

from __future__ import annotations

from ...scene.dimension import Continuum
from ...scene.material import Elastic, PerzynaVonMises
from ..precision import Precision
from .elastic import elastic
from .law import Law
from .perzyna import perzyna_von_mises

LAWS = {Elastic: elastic, PerzynaVonMises: perzyna_von_mises}


def law(material: Elastic, continuum: Continuum, precision: Precision) -> Law:
    """The law of a scene's material."""
    return LAWS[type(material)](continuum, precision)
