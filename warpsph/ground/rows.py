"""Rows of numbers that are added up in vector registers.

Left to itself, a CPU's compiler keeps sums over neighbours in scalar registers, and where these run out, in space,
a sweep spends most of its time moving them to memory and back.
"""

from functools import cache

import warp as wp

from .precision import Precision

WIDTHS = (8, 4, 2, 1)  # numbers in a piece


@cache
def add_scaled(length: int, precision: Precision) -> wp.Function:
    """(y, a, x) → y + a x, x and y vectors of one length."""
    real, row, number = precision.real, precision.vec(length), f"wp::{precision.name}"
    lines, first = [], 0
    for width in WIDTHS:
        attributes = f"ext_vector_type({width}), aligned(sizeof({number})), may_alias"
        lines.append(f"typedef {number} row_{width} __attribute__(({attributes}));")
        while length - first >= width:
            sum_, y, x = (f"*(row_{width}*)({name}.c + {first})" for name in ("sum", "y", "x"))
            lines.append(f"{sum_} = {y} + a * {x};")
            first += width
    pieces = "\n".join(lines)

    @wp.func_native(f"""
        #if defined(__CUDA_ARCH__)
        return wp::add(y, wp::mul(a, x));
        #else
        wp::vec_t<{length}, {number}> sum;
        {pieces}
        return sum;
        #endif
    """)
    def add_scaled_row(y: row, a: real, x: row) -> row: ...

    return add_scaled_row
