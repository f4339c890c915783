"""Boundary conditions on the material nodes, as resolved by `warpsph.scene.resolve`.

Edges given by selection are all in here; one that moves is added by `warpsph.operators.surface`.
"""

from dataclasses import dataclass
from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..physics.space import Space
from ..scene.resolve import BoundaryTable
from ..state.clock import END, NON_FINITE, TOO_FAST, Clock
from .held import held_table, held_types

# In one step the surroundings of a node deform by no more than this share of their size. Waves cross less than a
# cell in a step: neighbours would part faster than waves travel. A body that moves as a whole may be of any speed.
MOST_A_STEP = 1.0


@dataclass(frozen=True)
class ConditionTypes:
    """Warp side of the conditions.

    Attributes:
        Table: `held`, the velocities (`warpsph.operators.held`); what `BoundaryTable` has of stresses, a row each.
        apply: (node, φ, HALF or END, Table) → φ after v ← P v + Σ a_k f_k and σ ← Π σ + Σ G_k t_k f_k.
    """

    Table: type
    apply: wp.Function


@cache
def condition_types(space: Space, loaded: bool) -> ConditionTypes:
    """The table and the function of one continuum in one precision; `loaded` where tractions are not all zero."""
    types, phi, size, (Held, hold) = space.types, space.phi, space.continuum.stress_size, held_types(space)

    @wp.struct
    class Table:
        held: Held
        stress_projector: wp.array(dtype=space.mat(size, size))
        traction: wp.array2d(dtype=types.vector)
        traction_stress: wp.array2d(dtype=space.mat(size, space.dim))
        traction_function: wp.array2d(dtype=wp.int32)

    @wp.func
    def apply(i: int, values: phi.phi, when: int, table: Table):
        row = table.held.row[i]
        if row < 0:
            return values
        v = hold(i, phi.velocity(values), when, table.held)
        sigma = table.stress_projector[row] * phi.stress(values)
        if wp.static(loaded):
            for k in range(table.traction.shape[1]):
                traction = table.held.drive[when, table.traction_function[row, k]] * table.traction[row, k]
                sigma += table.traction_stress[row, k] * traction
        return phi.with_stress(phi.with_velocity(values, v), sigma)

    return ConditionTypes(Table, apply)


class Conditions:
    """The conditions of a scene on one device.

    Args:
        boundary: the resolved conditions.
        n: number of material nodes.
        clock: drives the conditions.
        moves: whether displacements are large, so that no body deforms faster than waves travel.

    Attributes:
        types: types of the table and its function.
        table: the conditions, for `types.apply`.
        kernels: the kernels that apply them.
    """

    def __init__(
        self,
        boundary: BoundaryTable,
        n: int,
        *,
        space: Space,
        launcher: Launcher,
        clock: Clock,
        moves: bool = True,
    ):
        self._launcher, self._clock = launcher, clock
        self.types = condition_types(space, boundary.loaded)
        self.table = self.types.Table()
        self._fill(boundary, n, space)
        self._kernel = apply_kernel(space, self.types, moves)
        self.kernels = (self._kernel,)

    def _fill(self, boundary: BoundaryTable, n: int, space: Space) -> None:
        size, types = space.continuum.stress_size, space.types
        for name, values, ndim, dtype in (
            ("stress_projector", boundary.stress_projector, 1, space.mat(size, size)),
            ("traction", boundary.traction, 2, types.vector),
            ("traction_stress", boundary.traction_stress, 2, space.mat(size, space.dim)),
            ("traction_function", boundary.traction_function, 2, wp.int32),
        ):
            shape, device = values.shape[:ndim], self._launcher.device
            setattr(self.table, name, wp.array(values, dtype=dtype, shape=shape, device=device))
        device, clock = self._launcher.device, self._clock
        self.table.held = held_table(boundary, n, space=space, device=device, clock=clock)

    def refresh(self) -> None:
        """Nothing: all conditions are on nodes chosen once and for all."""

    def turn(self, nodes, dt: wp.array) -> None:
        """Nothing: these edges keep their normals."""

    def apply(self, nodes) -> None:
        """Step 13: impose the conditions at the end of the step, in place; note what can not be true."""
        inputs = [self.table, self._clock.time_step, nodes, self._clock.faults]
        self._launcher.launch(self._kernel, nodes.point, inputs, gathers=False)


@cache
def apply_kernel(space: Space, conditions: ConditionTypes, moves: bool):
    """The kernel of step 13."""

    @forward_kernel
    def apply_conditions(
        first: int,
        table: conditions.Table,
        time_step: wp.array(dtype=space.real),
        nodes: space.types.MaterialNodes,
        faults: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        phi = conditions.apply(i, nodes.point[i].phi, END, table)
        nodes.point[i].phi = phi
        u = nodes.displacement[i]
        # A NaN position is nobody's neighbour, so that it would never show in φ.
        if not wp.isfinite(wp.dot(phi, phi) + wp.dot(u, u)):
            faults[NON_FINITE] = 1
        if wp.static(moves):
            deformed = time_step[0] * nodes.velocity_gradient[i]
            if not wp.ddot(deformed, deformed) < space.real(wp.static(MOST_A_STEP**2)):
                faults[TOO_FAST] = 1

    return apply_conditions
