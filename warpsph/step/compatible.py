"""Steps 3-10 without the published viscosity: means over cells, corrected gradients (docs/velocity_steps.md).

3-6.  φ_aux is the mean of the cell's corners, ∇φ there the corrected gradient. The auxiliary node hands on
      ∇φ and δφ = −(Δt/2) div f(φ_s), after flow. Only smooth strain flows: the rest, elastic, damps what is rough.
7.    φ_node^{n+1/2} = φ_s + the mean δφ of the node's cells, with the conditions: a node keeps its own value.
8-9.  ∇φ^{n+1/2} = the mean of the cells' gradients, ∇v towards the node's corner, + the corrected gradient of δφ.
10.   φ_adv = φ_s − Δt div f(φ^{n+1/2}) − θ (checkerboard of φ_s), the stress's part bounded.

On a lattice, in space, with ∇v of the middle as well, this is a summation by parts in the norm of the elastic
energy: what Σ m v·dv/dt and Σ V σ:Dₑ⁻¹:dσ/dt gain together is what the edges let through, to rounding. With ∇v
towards the corner the energy that does not grow is that of the cells' mean stresses. Tractions must vanish
orthogonally, by elastic unloading. Kernels are stretched and turned with the cells, so that this survives strain.
"""

from functools import cache

import warp as wp

from ..device.arrays import packed
from ..device.compiling import forward_kernel
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..operators.cell_means import CellMeans, cell_means, numbers_side_by_side
from ..operators.cell_motion import CellMotion
from ..operators.checkerboard import taken_off
from ..operators.conditions import Conditions, ConditionTypes
from ..operators.front import STRENGTH, front_pressure
from ..operators.motion import half_step_gradient, initial_gradient
from ..operators.neighbour_sums import NeighbourSums, batch_on, cell_metric, neighbour_sums
from ..physics.space import Space
from ..physics.waves import wave_rate
from ..scene.scheme import Scheme, wave_limit
from ..state.body import Body
from ..state.cells import NodeCells
from ..state.clock import HALF, write_values
from ..state.pairs import PairList

# θ of the velocity: the share of its checkerboard taken off in a step. It costs little: with 20 cells a half
# wavelength (kΔ)⁴/16 = 4·10⁻⁵ of a wave.
VELOCITY_SHARE = 1.0
MARGIN = 0.9
WIDEST = 2.12  # [Δx], 3/√2, where a diagonal neighbour joins: beyond, strain rates of corners make waves grow


def corner_share(courant: float, dim: int, reach: float) -> float:
    """κ: how far from a cell's middle to its corner the strain rate is taken, 0 … 1 [-].

    In the middle, a lattice n cells across bends with 1 − 3/n² of its stiffness, with κ = 1 with 1 − 1/n². Yet
    κ takes from the damping of Lax and Wendroff, which a long compression wave along a diagonal loses first. With
    s = sin(kΔ/2) its growth in a step is s⁴ times

        2D:  ½ C² (16 C² − 16 + 8 κ) − θ,        3D:  ½ C² (36 C² − 36 + 24 κ) − 3 θ,

    θ the mean share of the checkerboard taken off, of the velocity's alone, since the stress's is bounded
    (`warpsph.operators.checkerboard`). κ is the most for which it is not positive, with a margin; all other waves
    are damped then (tests/test_stability.py), for any Poisson's ratio.

    The stress's gradient stays that of the middle. Were it taken towards the corner as well, nodes in equilibrium
    would have cells that are not, δv would strain the body step by step, and what has come to rest would flow.

    Args:
        courant: C = c_p Δt/Δx.
        dim: number of dimensions.
        reach: radius of the kernel's support [Δx].
    """
    if dim == 1 or reach > WIDEST:
        return 0.0
    if courant**2 <= 0.0:  # also of a step so short that its square is nothing
        return 1.0
    theta = MARGIN * 0.5 * VELOCITY_SHARE
    undamped = (2.0 if dim == 2 else 1.5) * (1.0 - courant**2)
    return min(1.0, max(0.0, undamped + theta / (4.0 * courant**2)))


class CompatibleFluxes:
    """The two passes of the compatible scheme.

    Args:
        body: the body.
        conditions: its boundary conditions.
        around_auxiliary, around_nodes: the pair lists.

    Attributes:
        kernels: the kernels of the two passes.
    """

    def __init__(
        self,
        body: Body,
        *,
        conditions: Conditions,
        around_auxiliary: PairList,
        around_nodes: PairList,
    ):
        self._body, self._conditions = body, conditions
        self._around_auxiliary, self._around_nodes = around_auxiliary, around_nodes
        scene, space, law, device = body.scene, body.space, body.law, body.launcher.device
        self._front, self._corner_share = (wp.zeros(1, dtype=space.real, device=device) for _ in range(2))
        means = cell_means(space, body.kind, slots=body.slots, by_number=numbers_side_by_side(device))
        self._cells = means.store.new(len(scene.mesh.cells), space, device)
        sums = neighbour_sums(space, scene.numerics.smoothing, batch_on(device))
        metric = cell_metric(space, scene.numerics.smoothing_ratio)
        to_half_step = (half_step_gradient if scene.large_displacements else initial_gradient)(space)
        self._to_auxiliary = _to_auxiliary_kernel(space, body.kind, law, means, sums, metric)
        self._to_nodes = _to_nodes_kernel(space, law, means, sums, metric, to_half_step, conditions.types)
        self.kernels = (self._to_auxiliary, self._to_nodes)

    def set_courant(self, courant: float) -> None:
        """The Courant number C = c_p Δt/Δx of the steps to come."""
        reach = self._body.scene.numerics.support
        write_values(self._front, (STRENGTH * max(1.0 - courant**2, 0.0),))
        write_values(self._corner_share, (corner_share(courant, self._body.space.dim, reach),))

    def to_auxiliary(self, dt: wp.array) -> None:
        """Steps 3-6: φ_aux = mean of φ_s, then φ_aux^{n+1/2} = φ_aux − (Δt/2) div f(φ_s)."""
        body = self._body
        inputs = [body.parameters, dt, self._front, self._around_auxiliary]
        inputs += [body.nodes, body.internals, body.auxiliary, self._cells]
        body.launcher.launch(self._to_auxiliary, body.auxiliary.point, inputs)

    def to_nodes(self, dt: wp.array) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""
        body = self._body
        inputs = [body.parameters, self._conditions.table, dt, self._corner_share, self._around_nodes]
        inputs += [body.auxiliary, body.node_cells, self._cells, body.nodes]
        body.launcher.launch(self._to_nodes, body.nodes.point, inputs)


@cache
def _to_auxiliary_kernel(
    space: Space, kind: CellKind, law: Law, means: CellMeans, sums: NeighbourSums, metric_of: wp.Function
):
    types, real, internal = space.types, space.real, space.vec(max(1, len(law.internals)))
    rate, front_pressure_at = wave_rate(space, law.Parameters), front_pressure(space, kind)
    packed_nodes, packed_auxiliary = packed(types.MaterialNodes), packed(types.AuxiliaryNodes)

    @forward_kernel
    def to_auxiliary(
        first: int,
        material: law.Parameters,
        time_step: wp.array(dtype=real),
        front: wp.array(dtype=real),
        pairs: PairList,
        nodes: types.MaterialNodes,
        internals: wp.array(dtype=internal),
        auxiliary: types.AuxiliaryNodes,
        cells: wp.array2d(dtype=real),
    ):
        a = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        dt, point = time_step[0], auxiliary.point[a]
        phi, cell = means.describe(a, auxiliary, nodes.point)  # 3
        metric = metric_of(cell.frame, auxiliary.smoothing_length[a])
        around = sums.collect(a, point.x, metric, phi, pairs, nodes.point, nodes.volume)
        cell.gradient = sums.gradient(around, phi)
        minus_div_f = rate(cell.gradient, real(1.0) / auxiliary.density[a], material)  # 4-5
        L = space.phi.velocity_gradient(cell.gradient)
        q = front_pressure_at(a, wp.trace(L), cell.frame, auxiliary, nodes, front[0], dt)
        half = phi + real(0.5) * dt * minus_div_f  # 6
        if wp.static(law.flows):
            mean, smooth = internal(), types.tensor()
            for k in range(wp.static(kind.corners)):
                i = auxiliary.cell[a, k]
                if wp.static(len(law.internals) > 0):
                    mean += internals[i] / real(wp.static(kind.corners))
                smooth += nodes.velocity_gradient[i] / real(wp.static(kind.corners))
            rough = space.stress.elastic_rate(L - smooth, material.lame, material.shear, material.young)
            elastic = real(0.5) * dt * rough
            flowed, _ = law.relax(space.phi.stress(half) - elastic, mean, material, real(0.5) * dt)
            half = space.phi.with_stress(half, flowed + elastic)
        change = half - phi
        pressed = space.phi.stress(change) + space.stress.spherical(q)
        auxiliary.point[a].phi = space.phi.with_stress(change, pressed)
        means.store.write(a, cell, cells)

    return to_auxiliary


@cache
def _to_nodes_kernel(
    space: Space,
    law: Law,
    means: CellMeans,
    sums: NeighbourSums,
    metric_of: wp.Function,
    to_half_step: wp.Function,
    conditions: ConditionTypes,
):
    types, real, phi = space.types, space.real, space.phi
    rate, damped = wave_rate(space, law.Parameters), taken_off(space)
    packed_nodes, packed_auxiliary = packed(types.MaterialNodes), packed(types.AuxiliaryNodes)

    @forward_kernel
    def to_nodes(
        first: int,
        material: law.Parameters,
        table: conditions.Table,
        time_step: wp.array(dtype=real),
        corner_share: wp.array(dtype=real),
        pairs: PairList,
        auxiliary: types.AuxiliaryNodes,
        node_cells: NodeCells,
        cells: wp.array2d(dtype=real),
        nodes: types.MaterialNodes,
    ):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        dt, point = time_step[0], nodes.point[i]
        increment, grad_s, checkerboard, frame = means.gather(
            i, node_cells, cells, auxiliary.point, corner_share[0]
        )
        phi_half = conditions.apply(i, point.phi + increment, HALF, table)  # 7
        metric = metric_of(frame, nodes.smoothing_length[i])
        around = sums.collect(i, point.x, metric, increment, pairs, auxiliary.point, auxiliary.volume)
        grad, volume_ratio = to_half_step(grad_s + sums.gradient(around, phi_half - point.phi), dt)
        minus_div_f = rate(grad, volume_ratio / nodes.density[i], material)  # 8-9

        phi_adv = point.phi + dt * minus_div_f  # 10
        v_adv = phi.velocity(phi_adv) - real(VELOCITY_SHARE) * phi.velocity(checkerboard)
        lost = damped(phi.stress(checkerboard), nodes.velocity_gradient[i], material.shear, dt)
        nodes.point[i].phi = phi.with_stress(phi.with_velocity(phi_adv, v_adv), phi.stress(phi_adv) - lost)
        nodes.half_velocity[i] = phi.velocity(phi_half)
        nodes.velocity_gradient[i] = phi.velocity_gradient(grad)

    return to_nodes


# On an endless lattice it is stable up to 1. Where sums lack neighbours on one side it is up to 0.96, in a free
# square of 3 × 3 cells with ν = 0.499 up to 0.94; small boxes grow by up to 1.4 % a step at 1.
EDGE_LIMIT = 0.9
# From the third ring of auxiliary nodes on (√6.5 Δx) gradients at nodes and cells are no longer each other's
# transpose at an edge, and waves there grow; not in a bar.
LARGEST_SUPPORT = {1: 6.0, 2: 2.55, 3: 2.55}

COMPATIBLE = Scheme(
    name="compatible",
    meaning="means over cells and summation by parts: no numerical viscosity",
    fluxes=CompatibleFluxes,
    motion=CellMotion,
    unloads=True,
    follows_cells=True,
    courant_limit=lambda dim, moment: min(wave_limit(dim, moment), 1.0 if dim == 1 else EDGE_LIMIT),
    largest_support=LARGEST_SUPPORT.__getitem__,
)
