"""Rows of numbers that are added up in vector registers.

Left to itself, a CPU's compiler keeps sums over neighbours in scalar registers, and where these run out, in space,
a sweep spends most of its time moving them to memory and back.
"""

from functools import cache

import warp as wp

from .precision import Precision

WIDTHS = (8, 4, 2, 1)  # numbers in a piece of a row


@cache
def add_outer(rows: int, columns: int, precision: Precision) -> wp.Function:
    """(y, a, x) → y + a ⊗ x, a row of it in as few pieces as its length allows."""
    matrix, column, row = precision.mat(rows, columns), precision.vec(rows), precision.vec(columns)
    number, lines, first = f"wp::{precision.name}", [], 0
    for width in WIDTHS:
        attributes = f"ext_vector_type({width}), aligned(sizeof({number})), may_alias"
        lines.append(f"typedef {number} piece_{width} __attribute__(({attributes}));")
        while columns - first >= width:
            pointer = f"(piece_{width}*)"
            for r in range(rows):
                sum_, y = (f"*{pointer}({name}.data[{r}] + {first})" for name in ("sum", "y"))
                lines.append(f"{sum_} = {y} + a.c[{r}] * *{pointer}(x.c + {first});")
            first += width
    pieces = "\n".join(lines)

    @wp.func_native(f"""
        #if defined(__CUDA_ARCH__)
        return wp::add(y, wp::outer(a, x));
        #else
        wp::mat_t<{rows}, {columns}, {number}> sum;
        {pieces}
        return sum;
        #endif
    """)
    def with_outer(y: matrix, a: column, x: row) -> matrix: ...

    return with_outer
