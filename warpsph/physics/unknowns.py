"""The unknowns φ of a node: named blocks of one vector, since sums over neighbours treat all of them alike.

Whoever changes one block leaves the others as they are, also those that he does not know of.
"""

from collections.abc import Iterable
from functools import cache

import warp as wp

from ..device.precision import Precision
from ..mesh.continuum import Continuum


class Unknowns:
    """φ and its gradient, and three functions a block, here of the block called `velocity`.

    Attributes:
        phi: vector of as many numbers as all blocks have.
        gradient: matrix ∂φ_k/∂x_l.
        velocity: φ → v.
        with_velocity: (φ, v) → φ with that v, all else as it was.
        velocity_gradient: ∇φ → ∇v.

    Args:
        dim: number of dimensions, the columns of ∇φ.
        precision: float32 or float64.
        blocks: the name and the length of each block, in their order in φ.
    """

    def __init__(self, dim: int, precision: Precision, blocks: Iterable[tuple[str, int]]):
        blocks = tuple(blocks)
        size = sum(length for _, length in blocks)
        self.phi, self.gradient = precision.vec(size), precision.mat(size, dim)
        start = 0
        for name, length in blocks:
            self._add(name, start, start + length, precision.vec(length))
            start += length

    def _add(self, name: str, start: int, end: int, block: type) -> None:
        @wp.func
        def get(values: self.phi):
            return values[wp.static(start) : wp.static(end)]

        @wp.func
        def replace(values: self.phi, new: block):
            result = values
            result[wp.static(start) : wp.static(end)] = new
            return result

        @wp.func
        def gradient(grad: self.gradient):
            return grad[wp.static(start) : wp.static(end)]

        for key, function in ((name, get), (f"with_{name}", replace), (f"{name}_gradient", gradient)):
            setattr(self, key, function)


@cache
def unknowns(continuum: Continuum, precision: Precision) -> Unknowns:
    """φ = (v [m/s], σ [Pa]) of one continuum in one precision."""
    return Unknowns(continuum.dim, precision, (("velocity", continuum.dim), ("stress", continuum.stress_size)))
