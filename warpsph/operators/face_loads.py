"""Loads on faces as forces on nodes (`warpsph.scene.face_loads`), added to what cells do to their corners."""

from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..scene.face_loads import surface_rule
from ..state.cell_body import CellBody, cell_node_types
from ..state.clock import END, Clock
from .face_shares import face_function


@cache
def loaded_type(space: Space) -> type:
    """Loads a row: row k of the cells has those from first[k] to first[k + 1]."""

    @wp.struct
    class Loaded:
        cell: wp.array(dtype=wp.int32)
        first: wp.array(dtype=wp.int32)
        faces: wp.array2d(dtype=wp.int32)
        corner: wp.array2d(dtype=wp.int32)
        sign: wp.array(dtype=space.real)
        traction: wp.array2d(dtype=space.types.vector)
        pressure: wp.array2d(dtype=space.real)
        follows: wp.array(dtype=wp.int32)
        function: wp.array(dtype=wp.int32)

    return Loaded


class LoadedFaces:
    """The loads of a scene; without any it does nothing.

    Args:
        body: the body.
        clock: drives them.
        offset: where their functions of time begin among the clock's.

    Attributes:
        work: done by the loads [J], a number a loaded cell: trapezia of the force in time.
        kernels: what it launches.
    """

    def __init__(self, body: CellBody, clock: Clock, offset: int):
        loads, space, device = body.scene.loads, body.space, body.launcher.device
        self._body, self._clock = body, clock
        cells, first = np.unique(loads.cell, return_index=True)
        self._any, self._table = len(cells) > 0, loaded_type(space)()
        for name, values, dtype in (
            ("cell", cells, wp.int32),
            ("first", np.append(first, len(loads.cell)), wp.int32),
            ("faces", loads.faces, wp.int32),
            ("corner", loads.corner, wp.int32),
            ("sign", loads.sign, space.real),
            ("traction", loads.values[:, :, :-1], space.types.vector),
            ("pressure", loads.values[:, :, -1], space.real),
            ("follows", loads.follows, wp.int32),
            ("function", loads.function + offset, wp.int32),
        ):
            shape = values.shape[:2] if dtype is space.types.vector else values.shape
            setattr(self._table, name, wp.array(values, dtype=dtype, shape=shape, device=device))
        shape = (len(cells), body.kind.corners)
        self._forces = wp.zeros(shape, dtype=space.types.vector, device=device)
        self.work = wp.zeros(len(cells), dtype=wp.float64, device=device)
        self._kernel = load_kernel(space, body.kind) if self._any else None
        self.kernels = (self._kernel,) if self._any else ()

    def add(self, forces: wp.array) -> None:
        """Add the loads at t + Δt, on the faces as they are now, to the forces of cells on their corners."""
        if self._any:
            body, clock = self._body, self._clock
            inputs = [self._table, clock.drive, clock.time_step, body.corners, body.nodes, self._forces, self.work]
            body.launcher.launch(self._kernel, self.work, [*inputs, forces])


@cache
def load_kernel(space: Space, kind: CellKind):
    """Of each cell with loads: what they do to its corners, and their work since they were looked at before."""
    real, types = space.real, space.types
    Loaded, CellNodes = loaded_type(space), cell_node_types(space)[1]
    corners, size, points = kind.corners, len(kind.faces[0]), len(surface_rule(kind))
    weights, shares, slope_at, Along, area_vector = face_function(space, kind)

    @forward_kernel
    def load(
        first: int,
        table: Loaded,
        drive: wp.array2d(dtype=real),
        time_step: wp.array(dtype=real),
        corner_nodes: wp.array2d(dtype=wp.int32),
        nodes: CellNodes,
        own: wp.array2d(dtype=types.vector),
        work: wp.array(dtype=wp.float64),
        forces: wp.array2d(dtype=types.vector),
    ):
        row = first + wp.tid()
        c, done = table.cell[row], real(0.0)
        for k in range(wp.static(corners)):
            i = corner_nodes[c, k]
            done += wp.dot(own[row, k], nodes.half[i].v)
            own[row, k] = types.vector()
        for at in range(table.first[row], table.first[row + 1]):
            factor = drive[END, table.function[at]]
            for q in range(wp.static(points)):
                along = Along()
                traction, pressure = types.vector(), real(0.0)
                for k in range(wp.static(size)):
                    i = table.faces[at, k]
                    x = nodes.reference[i]
                    if table.follows[at] == 1:
                        x = nodes.point[i].x
                    along += wp.outer(slope_at[wp.static(size) * q + k], x)
                    traction += shares[q, k] * table.traction[at, k]
                    pressure += shares[q, k] * table.pressure[at, k]
                area = area_vector(along)
                pushed = wp.length(area) * traction - (table.sign[at] * pressure) * area
                for k in range(wp.static(size)):
                    p = table.corner[at, k]
                    own[row, p] = own[row, p] + (factor * weights[q] * shares[q, k]) * pushed
        for k in range(wp.static(corners)):
            i = corner_nodes[c, k]
            done += wp.dot(own[row, k], nodes.half[i].v)
            forces[c, k] = forces[c, k] + own[row, k]
        work[row] = work[row] + wp.float64(real(0.5) * time_step[0] * done)

    return load
