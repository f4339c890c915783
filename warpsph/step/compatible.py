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
from ..device.launching import Launcher
from ..materials.law import Law
from ..operators.cell_means import apart_on, cell_types
from ..operators.checkerboard import taken_off
from ..operators.conditions import ConditionTypes
from ..operators.front import STRENGTH, front_pressure
from ..operators.motion import half_step_gradient, initial_gradient
from ..operators.neighbour_sums import Sweep, batch_on, sweep
from ..physics.space import Space
from ..physics.waves import wave_rate
from ..scene.scene import Scene
from ..state.clock import HALF, put
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
    if courant <= 0.0:
        return 1.0
    theta = MARGIN * 0.5 * VELOCITY_SHARE
    undamped = (2.0 if dim == 2 else 1.5) * (1.0 - courant**2)
    return min(1.0, max(0.0, undamped + theta / (4.0 * courant**2)))


class CompatibleFluxes:
    """The two sweeps of the compatible scheme.

    Args:
        scene: the scene.
        law: its material law.
        conditions: types of its boundary conditions.

    Attributes:
        kernels: the kernels of the two sweeps.
    """

    def __init__(self, scene: Scene, law: Law, conditions: ConditionTypes, space: Space, launcher: Launcher):
        mesh, kernel = scene.mesh, scene.numerics.kernel
        moves = scene.large_displacements
        ratio = scene.numerics.smoothing_ratio
        device = launcher.device
        apart = apart_on(device)
        self._launcher = launcher
        self._dim, self._reach = mesh.dim, scene.numerics.support
        self._front, self._share = (wp.zeros(1, dtype=space.real, device=device) for _ in range(2))
        self._cells = cell_types(space, apart).new(mesh, device)
        parts = sweep(space, kernel, batch_on(device))
        self._to_auxiliary = _to_auxiliary_kernel(space, parts, ratio, law, apart)
        self._to_nodes = _to_nodes_kernel(space, parts, ratio, law.Parameters, moves, conditions, apart)
        self.kernels = (self._to_auxiliary, self._to_nodes)

    def set_courant(self, courant: float) -> None:
        """The Courant number C = c_p Δt/Δx of the steps to come."""
        front, share = STRENGTH * max(1.0 - courant**2, 0.0), corner_share(courant, self._dim, self._reach)
        put(self._front, (front,))
        put(self._share, (share,))

    def to_auxiliary(self, material, dt: wp.array, pairs: PairList, nodes, internals, auxiliary) -> None:
        """Steps 3-6: φ_aux = mean of φ_s, then φ_aux^{n+1/2} = φ_aux − (Δt/2) div f(φ_s)."""
        inputs = [material, dt, self._front, pairs, nodes, internals, auxiliary, self._cells]
        self._launcher.launch(self._to_auxiliary, auxiliary.point, inputs)

    def to_nodes(self, material, conditions, dt: wp.array, pairs: PairList, auxiliary, nodes) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""
        inputs = [material, conditions, dt, self._share, pairs, auxiliary, self._cells, nodes]
        self._launcher.launch(self._to_nodes, nodes.point, inputs)


@cache
def _to_auxiliary_kernel(space: Space, parts: Sweep, ratio: float, law: Law, apart: bool):
    Parameters, relax, internal = law.Parameters, law.relax, space.vec(max(1, len(law.internals)))
    corners = 2**space.dim
    types, cells_types = space.types, cell_types(space, apart)
    real, MaterialNodes, AuxiliaryNodes = space.real, types.MaterialNodes, types.AuxiliaryNodes
    Cells, describe, write = cells_types.Cells, cells_types.describe, cells_types.write
    phi_of, spherical = space.phi, space.stress.spherical
    join, velocity_gradient, vector = phi_of.join, phi_of.velocity_gradient, types.vector
    velocity, stress, tensor = phi_of.velocity, phi_of.stress, types.tensor
    elastic_rate = space.stress.elastic_rate
    rate = wave_rate(space, Parameters)
    metric_of = parts.cell_metric(ratio)
    collect, gradient, front_pressure_at = parts.collect, parts.gradient, front_pressure(space)

    packed_nodes, packed_auxiliary = packed(MaterialNodes), packed(AuxiliaryNodes)

    @forward_kernel
    def to_auxiliary(
        first: int,
        material: Parameters,
        time_step: wp.array(dtype=real),
        front: wp.array(dtype=real),
        pairs: PairList,
        nodes: MaterialNodes,
        internals: wp.array(dtype=internal),
        auxiliary: AuxiliaryNodes,
        cells: Cells,
    ):
        a = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        dt, point = time_step[0], auxiliary.point[a]
        phi, cell = describe(a, auxiliary, nodes.point)  # 3
        metric = metric_of(cell.frame, auxiliary.smoothing_length[a])
        sums = collect(a, point.x, metric, phi, pairs, nodes.point, nodes.volume)
        cell.gradient = gradient(sums, phi)
        minus_div_f = rate(cell.gradient, real(1.0) / auxiliary.density[a], material)  # 4-5
        volumetric = wp.trace(velocity_gradient(cell.gradient))
        q = front_pressure_at(a, volumetric, cell.frame, auxiliary, nodes, front[0], dt)
        half = phi + real(0.5) * dt * minus_div_f  # 6
        if wp.static(relax is not None):
            mean, smooth = internal(), tensor()
            for k in range(wp.static(corners)):
                mean += internals[auxiliary.cell[a, k]] / real(corners)
                smooth += nodes.velocity_gradient[auxiliary.cell[a, k]] / real(corners)
            rough = velocity_gradient(cell.gradient) - smooth
            elastic = real(0.5) * dt * elastic_rate(rough, material.lame, material.shear, material.young)
            flowed, _ = relax(stress(half) - elastic, mean, material, real(0.5) * dt)
            half = join(velocity(half), flowed + elastic)
        auxiliary.point[a].phi = half - phi + join(vector(), spherical(q))
        write(a, cell, cells)

    return to_auxiliary


@cache
def _to_nodes_kernel(
    space: Space,
    parts: Sweep,
    ratio: float,
    Parameters: type,
    moves: bool,
    conditions: ConditionTypes,
    apart: bool,
):
    types, cells_types = space.types, cell_types(space, apart)
    real, MaterialNodes, AuxiliaryNodes = space.real, types.MaterialNodes, types.AuxiliaryNodes
    phi = space.phi
    velocity, stress, join, velocity_gradient = phi.velocity, phi.stress, phi.join, phi.velocity_gradient
    Table, apply, Cells, gather = conditions.Table, conditions.apply, cells_types.Cells, cells_types.gather
    rate, taken_off_stress = wave_rate(space, Parameters), taken_off(space)
    collect, gradient, metric_of = parts.collect, parts.gradient, parts.cell_metric(ratio)
    to_half_step = half_step_gradient(space) if moves else initial_gradient(space)

    packed_nodes, packed_auxiliary = packed(MaterialNodes), packed(AuxiliaryNodes)

    @forward_kernel
    def to_nodes(
        first: int,
        material: Parameters,
        conditions: Table,
        time_step: wp.array(dtype=real),
        share: wp.array(dtype=real),
        pairs: PairList,
        auxiliary: AuxiliaryNodes,
        cells: Cells,
        nodes: MaterialNodes,
    ):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_auxiliary(auxiliary)
        dt, point = time_step[0], nodes.point[i]
        increment, grad_s, checkerboard, frame = gather(i, cells, auxiliary.point, share[0])
        phi_half = apply(i, point.phi + increment, HALF, conditions)  # 7
        metric = metric_of(frame, nodes.smoothing_length[i])
        sums = collect(i, point.x, metric, increment, pairs, auxiliary.point, auxiliary.volume)
        grad, volume_ratio = to_half_step(grad_s + gradient(sums, phi_half - point.phi), dt)
        minus_div_f = rate(grad, volume_ratio / nodes.density[i], material)  # 8-9

        phi_adv = point.phi + dt * minus_div_f  # 10
        v_adv = velocity(phi_adv) - real(VELOCITY_SHARE) * velocity(checkerboard)
        lost = taken_off_stress(stress(checkerboard), nodes.velocity_gradient[i], material.shear, dt)
        nodes.point[i].phi = join(v_adv, stress(phi_adv) - lost)
        nodes.half_velocity[i] = velocity(phi_half)
        nodes.velocity_gradient[i] = velocity_gradient(grad)

    return to_nodes
