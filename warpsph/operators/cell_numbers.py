"""What the strain pass of the scheme `cells` leaves of each cell for the passes after it: numbers side by side."""

from functools import cache

import warp as wp

from ..physics.space import Space
from .cell_shape import CellShape


def numbers_of(space: Space, shape: CellShape) -> int:
    """How many numbers the strain pass leaves of a cell: A/n, e_T, κ_T, (A/n) G v, and each mode's part of it."""
    return 3 + space.dim**2 * (1 + shape.partial)


@cache
def tensors_of(space: Space) -> tuple[wp.Function, wp.Function]:
    """(cell, which, numbers) → one of the tensors that the strain pass has left of a cell, and what leaves it."""
    real, tensor, d = space.real, space.types.tensor, space.dim

    @wp.func
    def tensor_at(c: int, which: int, numbers: wp.array2d(dtype=real)):
        result = tensor()
        for a in range(wp.static(d)):
            for b in range(wp.static(d)):
                result[a, b] = numbers[c, 3 + d * d * which + d * a + b]
        return result

    @wp.func
    def put_tensor(c: int, which: int, value: tensor, numbers: wp.array2d(dtype=real)):
        for a in range(wp.static(d)):
            for b in range(wp.static(d)):
                numbers[c, 3 + d * d * which + d * a + b] = value[a, b]

    return tensor_at, put_tensor
