"""Floating-point precision, and the Warp vector and matrix types that follow from it."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..errors import SceneError, one_of


@dataclass(frozen=True)
class Precision:
    """A floating-point type.

    Attributes:
        name: `float32` or `float64`.
        real: the Warp scalar type.
        dtype: the NumPy scalar type.
    """

    name: str
    real: type
    dtype: type

    def vec(self, length: int) -> type:
        """Warp vector type of this precision."""
        return _vec(length, self.real)

    def mat(self, rows: int, columns: int) -> type:
        """Warp matrix type of this precision."""
        return _mat(rows, columns, self.real)


PRECISIONS = {
    "float32": Precision("float32", wp.float32, np.float32),
    "float64": Precision("float64", wp.float64, np.float64),
}


def precision(name: str) -> Precision:
    """The precision of that name; `SceneError` for any other."""
    if name not in PRECISIONS:
        raise SceneError("precision", name, one_of(PRECISIONS, name))
    return PRECISIONS[name]


# Warp compares types by identity in places: make each one once.
@cache
def _vec(length: int, real: type) -> type:
    return wp.types.vector(length=length, dtype=real)


@cache
def _mat(rows: int, columns: int, real: type) -> type:
    return wp.types.matrix(shape=(rows, columns), dtype=real)
