"""Materials, one file each: a dataclass for the scene and its law for the kernels; see docs/materials.md.

What a material of one's own is made of is here as well: `Material` or a subclass with a `parameter` each, what its
nodes remember (`InternalVariable`) and show (`DerivedField`), the `Law` in a `Space`, `with_moduli` to fill it.
"""

from ..physics.space import Space
from ..scene.material import DerivedField, InternalVariable, Material, parameter
from .elastic import Elastic, with_moduli
from .law import Law
from .perzyna_von_mises import PerzynaVonMises

__all__ = [
    "DerivedField",
    "Elastic",
    "InternalVariable",
    "Law",
    "Material",
    "PerzynaVonMises",
    "Space",
    "parameter",
    "with_moduli",
]
