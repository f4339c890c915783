"""Boundary conditions on the material nodes, as resolved by `warpsph.scene.resolve`.

Edges given by selection are all in here; one that moves is added by `warpsph.operators.surface`.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..physics.space import Space
from ..physics.types import NodeTypes
from ..scene.resolve import BoundaryTable
from ..state.clock import END, Clock


@dataclass(frozen=True)
class ConditionTypes:
    """Warp side of the conditions.

    Attributes:
        Table: struct of arrays: `row` (n,), the row of each node or −1; P, Π, amplitudes and functions a row,
            `drive`, the values of the functions of time (see `Clock`); `turned`, the rotation R of Π's directions.
        apply: (node, φ, HALF or END, Table) → φ after v ← P v + Σ a_k f_k, σ ← R Π(Rᵀ σ R) Rᵀ.
    """

    Table: type
    apply: wp.Function


@cache
def condition_types(space: Space) -> ConditionTypes:
    """The table and the function of one continuum in one precision."""
    types, phi = space.types, space.phi
    velocity_of, stress_of, join = phi.velocity, phi.stress, phi.join
    vector, real, transform = types.vector, space.real, space.stress.transform
    stress_matrix = space.mat(space.continuum.stress_size, space.continuum.stress_size)

    @wp.struct
    class Table:
        row: wp.array(dtype=wp.int32)
        velocity_projector: wp.array(dtype=types.tensor)
        stress_projector: wp.array(dtype=stress_matrix)
        amplitude: wp.array2d(dtype=vector)
        function: wp.array2d(dtype=wp.int32)
        drive: wp.array2d(dtype=real)
        turned: wp.array(dtype=types.tensor)

    @wp.func
    def apply(i: int, values: phi.phi, when: int, table: Table):
        row = table.row[i]
        if row < 0:
            return values
        v = table.velocity_projector[row] * velocity_of(values)
        for k in range(table.amplitude.shape[1]):
            v += table.drive[when, table.function[row, k]] * table.amplitude[row, k]
        R = table.turned[row]
        left = table.stress_projector[row] * transform(stress_of(values), wp.transpose(R))
        return join(v, transform(left, R))

    return ConditionTypes(Table, apply)


class Conditions:
    """The conditions of a scene on one device.

    Args:
        boundary: the resolved conditions.
        n: number of material nodes.
        clock: drives the conditions.
        turns: whether the directions of edges that nobody moves turn with their nodes.

    Attributes:
        types: types of the table and its function.
        table: the conditions, for `types.apply`.
        kernels: the kernels that apply them.
    """

    def __init__(
        self,
        boundary: BoundaryTable,
        n: int,
        space: Space,
        launcher: Launcher,
        clock: Clock,
        turns: bool = False,
    ):
        types, device = space.types, launcher.device
        self._launcher, self._clock = launcher, clock
        self.types = condition_types(space)
        self.table = self.types.Table()
        self._kernel = apply_kernel(space, self.types)
        free = ~boundary.moved if turns else np.zeros(len(boundary.nodes), dtype=bool)
        self._any_turns = bool(free.any())
        self._turns = wp.array(free.astype(np.int32), dtype=wp.int32, device=device)
        self._turn = turn_kernel(space, self.types)
        self.kernels = (self._kernel, self._turn)
        row = np.full(n, -1, dtype=np.int32)
        row[boundary.nodes] = np.arange(len(boundary.nodes), dtype=np.int32)
        self._fill(row, boundary, types, space, device)

    def _fill(self, row, boundary, types: NodeTypes, space, device) -> None:
        def array(values, dtype, **options):
            return wp.array(np.ascontiguousarray(values), dtype=dtype, device=device, **options)

        size, table = space.continuum.stress_size, self.table
        table.row = array(row, wp.int32)
        table.velocity_projector = array(boundary.velocity_projector, types.tensor)
        table.stress_projector = array(boundary.stress_projector, space.mat(size, size))
        rows, terms = boundary.function.shape
        table.turned = array(np.tile(np.eye(space.dim), (rows, 1, 1)), types.tensor)
        table.amplitude = wp.zeros((rows, terms), dtype=types.vector, device=device)
        table.function = wp.zeros((rows, terms), dtype=wp.int32, device=device)
        if terms:
            table.amplitude.assign(boundary.amplitude)
            table.function.assign(boundary.function)
        table.drive = self._clock.drive

    def refresh(self) -> None:
        """Nothing: all conditions are on nodes chosen once and for all."""

    def turn(self, nodes, dt: wp.array) -> None:
        """Turn the directions of edges that nobody moves as the stresses turn in half a time step."""
        if self._any_turns:
            self._launcher.launch(self._turn, nodes.point, [nodes, self._turns, dt, self.table], gathers=False)

    def apply(self, nodes) -> None:
        """Step 13: impose the conditions at the end of the step on the nodes, in place; note values not finite."""
        inputs = [self.table, nodes, self._clock.non_finite]
        self._launcher.launch(self._kernel, nodes.point, inputs, gathers=False)


@cache
def apply_kernel(space: Space, conditions: ConditionTypes):
    """The kernel of step 13."""
    MaterialNodes = space.types.MaterialNodes
    Table, apply = conditions.Table, conditions.apply

    @forward_kernel
    def apply_conditions(first: int, table: Table, nodes: MaterialNodes, non_finite: wp.array(dtype=wp.int32)):
        i = first + wp.tid()
        phi = apply(i, nodes.point[i].phi, END, table)
        nodes.point[i].phi = phi
        u = nodes.displacement[i]
        # A NaN position is nobody's neighbour, so that it would never show in φ.
        if not wp.isfinite(wp.dot(phi, phi) + wp.dot(u, u)):
            non_finite[0] = 1

    return apply_conditions


@cache
def turn_kernel(space: Space, conditions: ConditionTypes):
    """The kernel that turns the directions of some rows with the spin of their nodes."""
    MaterialNodes, real = space.types.MaterialNodes, space.real
    Table, rotation = conditions.Table, space.algebra.rotation

    @forward_kernel
    def turn(
        first: int,
        nodes: MaterialNodes,
        turns: wp.array(dtype=wp.int32),
        dt: wp.array(dtype=real),
        table: Table,
    ):
        i = first + wp.tid()
        row = table.row[i]
        if row < 0:
            return
        if turns[row] == 1:
            R = rotation(nodes.velocity_gradient[i], real(0.5) * dt[0])
            table.turned[row] = R * table.turned[row]

    return turn
