"""Material laws: one file each, and one row here; see docs/materials.md."""

from __future__ import annotations

from ..errors import SceneError, one_of
from ..physics.space import Space
from ..scene.material import Elastic, PerzynaVonMises
from .elastic import elastic
from .law import Law
from .perzyna_von_mises import perzyna_von_mises

LAWS = {Elastic: elastic, PerzynaVonMises: perzyna_von_mises}


def law(material: Elastic, space: Space) -> Law:
    """The law of a scene's material.

    Raises:
        SceneError: `LAWS` has no row for it.
    """
    if type(material) not in LAWS:
        raise SceneError("material", material, one_of([kind.__name__ for kind in LAWS]))
    return LAWS[type(material)](space)
