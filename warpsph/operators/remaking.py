"""Cells of a body that are made anew as it flows, see `warpsph.scene.remade` and `warpsph.remaking`."""

from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..remaking.outline import copy_outline, outline_arrays, outline_of
from ..remaking.tables import CellTables
from ..remaking.triangulation import Triangulation
from ..state.cell_body import ELASTIC, FORCES, REMADE, CellBody, cell_node_types, enter
from ..state.cells import NodeCells, corner_place
from ..state.clock import Clock
from ..state.part import Part
from .cell_shape import cell_shape

NEAR, SEEN = 2.0, 6.0  # spacings: how far a star looks first, and at all
# Of Δx²: the largest weight of a node. Cells of a lattice that turns change by rounding without.
WEIGHT = 5e-3
# Cells are made anew as soon as one has lost so much of A/Σl², its area over the squares of its edges.
WORN = 0.4


class Remaking:
    """A `Part`: cells, made anew; without any asked for it does nothing.

    Args:
        body: the body in its initial state; its arrays of cells are written.
        clock: gives the flag that says that it is time to look.
        limit: is refreshed where cells are new; its flag is before this one's.

    Attributes:
        on: whether it was asked for.
        outline: `OutlineArrays`, or None.
        begun: whether cells have been made anew yet.
        joining: whether nodes join the outline, at the next look, or leave it.
        made, refused: how often they were, and how often they could not be, since the outline crosses itself.
        kernels: all that it launches.
    """

    def __init__(self, body: CellBody, clock: Clock, limit: Part):
        scene, space, launcher = body.scene, body.space, body.launcher
        self._body, self._clock, self._limit = body, clock, limit
        self.on, self.kernels = scene.cells is not None, ()
        self.begun, self.joining, self.made, self.refused, self.outline = False, True, 0, 0, None
        if not self.on:
            return
        n, device, spacing, real = body.nodes.mass.shape[0], launcher.device, scene.mesh.spacing, space.real
        self.outdated, self._every = clock.new_flag(), scene.cells.every
        self._steps = wp.zeros(1, dtype=wp.int32, device=device)
        self._shape = wp.zeros(body.corners.shape[0], dtype=real, device=device)
        outline, triangulation = outline_of(scene.mesh), {"precision": space.precision, "launcher": launcher}
        made = Triangulation(
            outline, near=NEAR * spacing, reach=SEEN * spacing, weight=WEIGHT * spacing**2, **triangulation
        )
        held = np.zeros(n, dtype=np.int32)
        held[scene.boundary.nodes] = 1
        made.surfacing.held.assign(held)
        self.outline = made.outline
        self._triangulation, self._kept = made, outline_arrays(outline, device)
        self._positions = wp.zeros(n, dtype=space.types.vector, device=device)
        self._volume = wp.zeros(n, dtype=real, device=device)
        self._flag = wp.zeros(1, dtype=wp.int32, device=device)
        self._positions_of, self._wear = _positions_kernel(space), _wear_kernel(space, body.kind)
        self._measure, self._install = _volume_kernel(space, body.kind), _install_kernel(space, body.kind)
        self._book, self._move = _book_kernel(space, body.law), _move_kernel(space)
        self.kernels = (_count, self._positions_of, self._wear, self._measure, self._install)
        self.kernels += (self._book, self._move, *made.kernels)
        self._worn()

    def count(self) -> None:
        """Count a step."""
        if self.on:
            self._body.launcher.launch(_count, self._steps, [self._every, self._steps, self.outdated])

    def refresh(self) -> None:
        """Look at the cells, if it is time to, and make anew those that no longer serve."""
        if self._steps.numpy()[0] < self._every:
            return
        self._steps.zero_()
        self.outdated.zero_()
        triangulation, kept = self._triangulation, self._kept
        if not self.begun:
            if self._worn():
                self.begun = triangulation.make(self._places())
                if self.begun:
                    self._replace(triangulation.tables)
                else:
                    self.refused += 1
            return
        copy_outline(kept, self.outline)
        sound = self._renew(surfacing=True)
        if not sound:
            copy_outline(self.outline, kept)
            sound = self._renew(surfacing=False)
        self.joining = not self.joining
        if not sound:
            self.refused += 1
        elif triangulation.wrapped:
            self._replace(triangulation.tables)

    def _places(self) -> wp.array:
        """Where the nodes are [m]."""
        self._body.launcher.launch(self._positions_of, self._positions, [self._body.nodes, self._positions])
        return self._positions

    def _worn(self) -> bool:
        """Whether a cell has lost its shape."""
        body, worn = self._body, self._flag
        body.launcher.launch(self._wear, self._shape, [body.corners, body.nodes, self._shape, worn])
        return bool(worn.numpy()[0])

    def _renew(self, *, surfacing: bool) -> bool:
        """Find the cells that there should be, and whether they could be found."""
        triangulation, positions = self._triangulation, self._places()
        if not triangulation.sound or triangulation.generation != self.made:  # or the state is another one's
            triangulation.adopt(self._body.corners, self._body.node_cells)
            triangulation.generation = self.made
        if surfacing:
            triangulation.surface(positions, self.joining)
        return triangulation.renew(positions)

    def _replace(self, tables: CellTables) -> None:
        """Put nodes and new cells in place."""
        body, launch = self._body, self._body.launcher.launch
        nodes, table, volume = body.nodes, body.node_cells, self._volume
        launch(self._move, self._positions, [self._clock.forces, self._positions, nodes])
        launch(self._measure, volume, [body.corners, table, nodes, volume])
        launch(self._book, volume, [body.parameters, volume, wp.float64(1.0), nodes])
        wp.copy(table.first, tables.node_cells.first, count=len(tables.node_cells.first))
        wp.copy(table.place, tables.node_cells.place, count=3 * tables.cells)
        launch(self._measure, volume, [tables.corners, table, nodes, volume])
        launch(self._book, volume, [body.parameters, volume, wp.float64(-1.0), nodes])
        inputs = [tables.cells, tables.corners, nodes, volume, body.corners, body.cell_mass]
        launch(self._install, body.cell_mass, inputs)
        self._limit.refresh()
        self.made += 1
        self._triangulation.generation = self.made


@forward_kernel
def _count(first: int, every: int, steps: wp.array(dtype=wp.int32), outdated: wp.array(dtype=wp.int32)):
    steps[0] = steps[0] + 1
    if steps[0] >= every:
        outdated[0] = 1


@cache
def _positions_kernel(space: Space):
    CellNodes = cell_node_types(space)[1]

    @forward_kernel
    def positions(first: int, nodes: CellNodes, result: wp.array(dtype=space.types.vector)):
        i = first + wp.tid()
        result[i] = nodes.point[i].x

    return positions


@cache
def _move_kernel(space: Space):
    """Put nodes where they were moved to, and book what the body force would have done; all others stay."""
    CellNodes, vector = cell_node_types(space)[1], space.types.vector

    @forward_kernel
    def move(first: int, body_force: wp.array(dtype=vector), positions: wp.array(dtype=vector), nodes: CellNodes):
        i = first + wp.tid()
        shift = positions[i] - nodes.point[i].x
        if wp.length_sq(shift) > space.real(0.0):
            work = wp.float64(nodes.mass[i] * wp.dot(body_force[0], shift))
            enter(FORCES, i, work, nodes.books)
            enter(REMADE, i, work, nodes.books)
            u = nodes.displacement[i] + shift
            nodes.displacement[i] = u
            nodes.point[i].x = nodes.reference[i] + u

    return move


@cache
def _area(space: Space, kind: CellKind):
    """(cell, corners, nodes) → its modes B, its area."""
    shape, CellNodes = cell_shape(space, kind), cell_node_types(space)[1]
    T = shape.weights

    @wp.func
    def area(c: int, corners: wp.array2d(dtype=wp.int32), nodes: CellNodes):
        x = shape.Modes()
        for k in range(wp.static(kind.corners)):
            i = corners[c, k]
            x += wp.outer(T[k], nodes.point[i].x)
        _, volume, _ = shape.measure(x)
        return volume

    return area


@cache
def _wear_kernel(space: Space, kind: CellKind):
    """Raise a flag where a cell has lost too much of its shape; where none is stored yet, store it."""
    real, CellNodes, area = space.real, cell_node_types(space)[1], _area(space, kind)

    @forward_kernel
    def wear(
        first: int,
        corners: wp.array2d(dtype=wp.int32),
        nodes: CellNodes,
        shape: wp.array(dtype=real),
        worn: wp.array(dtype=wp.int32),
    ):
        c = first + wp.tid()
        edges = real(0.0)
        for k in range(wp.static(kind.corners)):
            i = corners[c, k]
            j = corners[c, (k + 1) % wp.static(kind.corners)]
            edges += wp.length_sq(nodes.point[i].x - nodes.point[j].x)
        now = area(c, corners, nodes) / edges
        if shape[c] == real(0.0):
            shape[c] = now
        elif now < real(wp.static(1.0 - WORN)) * shape[c]:
            worn[0] = 1

    return wear


@cache
def _volume_kernel(space: Space, kind: CellKind):
    """Σ A_T/n of each node."""
    real, CellNodes, area, place_of = space.real, cell_node_types(space)[1], _area(space, kind), corner_place(kind)
    per_corner = 1.0 / kind.corners

    @forward_kernel
    def volumes(
        first: int,
        corners: wp.array2d(dtype=wp.int32),
        table: NodeCells,
        nodes: CellNodes,
        result: wp.array(dtype=real),
    ):
        i = first + wp.tid()
        total = real(0.0)
        for entry in range(table.first[i], table.first[i + 1]):
            c, _ = place_of(entry, table)
            total += area(c, corners, nodes)
        result[i] = real(per_corner) * total

    return volumes


@cache
def _book_kernel(space: Space, law):
    """Move the elastic energy of volumes, times a sign, from what stays elastic to what re-making takes."""
    real, CellNodes = space.real, cell_node_types(space)[1]

    @forward_kernel
    def book(
        first: int,
        material: law.Parameters,
        volume: wp.array(dtype=real),
        sign: wp.float64,
        nodes: CellNodes,
    ):
        i = first + wp.tid()
        sigma = space.phi.stress(nodes.point[i].phi)
        twice = space.stress.complementary(sigma, sigma, material.lame, material.shear, material.young)
        energy = sign * wp.float64(real(0.5) * volume[i] * twice)
        enter(REMADE, i, energy, nodes.books)
        enter(ELASTIC, i, -energy, nodes.books)

    return book


@cache
def _install_kernel(space: Space, kind: CellKind):
    """Corners and masses of the new cells: no corner has more mass than its node. What is left over loses none."""
    real, CellNodes, area = space.real, cell_node_types(space)[1], _area(space, kind)

    @forward_kernel
    def install(
        first: int,
        cells: int,
        made: wp.array2d(dtype=wp.int32),
        nodes: CellNodes,
        volume: wp.array(dtype=real),
        corners: wp.array2d(dtype=wp.int32),
        cell_mass: wp.array(dtype=real),
    ):
        c = first + wp.tid()
        source = wp.min(c, cells - 1)
        density = real(wp.inf)
        for k in range(wp.static(kind.corners)):
            i = made[source, k]
            corners[c, k] = i
            density = wp.min(density, nodes.mass[i] / volume[i])
        mass = density * area(source, made, nodes)
        cell_mass[c] = wp.where(c < cells, mass, real(0.0))

    return install
