"""Conditions on velocities, as `warpsph.scene.resolve` puts them: v ← P v + Σ_k a_k f_k(t) at the node."""

from functools import cache

import numpy as np
import warp as wp

from ..physics.space import Space
from ..scene.resolve import BoundaryTable
from ..state.clock import Clock


@cache
def held_types(space: Space) -> tuple[type, wp.Function]:
    """The table, `row` of each node or −1, and (node, v, HALF or END, table) → v as the conditions ask for."""
    vector = space.types.vector

    @wp.struct
    class Held:
        row: wp.array(dtype=wp.int32)
        projector: wp.array(dtype=space.types.tensor)
        amplitude: wp.array2d(dtype=vector)
        function: wp.array2d(dtype=wp.int32)
        drive: wp.array2d(dtype=space.real)

    @wp.func
    def hold(i: int, v: vector, when: int, table: Held):
        row = table.row[i]
        result = v
        if row >= 0:
            result = table.projector[row] * v
            for k in range(table.amplitude.shape[1]):
                result += table.drive[when, table.function[row, k]] * table.amplitude[row, k]
        return result

    return Held, hold


def held_table(boundary: BoundaryTable, n: int, *, space: Space, device: wp.Device, clock: Clock):
    """The table of resolved conditions on n nodes."""
    table, types = held_types(space)[0](), space.types
    row = np.full(n, -1, dtype=np.int32)
    row[boundary.nodes] = np.arange(len(boundary.nodes), dtype=np.int32)
    shape = boundary.amplitude.shape[:2]
    table.row = wp.array(row, dtype=wp.int32, device=device)
    table.projector = wp.array(boundary.velocity_projector, dtype=types.tensor, device=device)
    table.amplitude = wp.array(boundary.amplitude, dtype=types.vector, shape=shape, device=device)
    table.function = wp.array(boundary.function, dtype=wp.int32, shape=shape, device=device)
    table.drive = clock.drive
    return table
