"""Steps 3-10 as published: Shepard values and corrected gradients from one set of nodes to the other."""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..materials.law import Law
from ..operators.conditions import ConditionTypes
from ..operators.motion import half_step_gradient, initial_gradient
from ..operators.neighbour_sums import Sweep, batch_on, sweep
from ..physics.space import Space
from ..physics.waves import wave_rate
from ..scene.scene import Scene
from ..state.clock import HALF
from ..state.pairs import PairList
from .velocity_schemes import VELOCITY_SCHEMES


class PublishedFluxes:
    """The two sweeps of the published schemes.

    Args:
        scene: the scene.
        law: its material law.
        conditions: types of its boundary conditions.

    Attributes:
        kernels: the kernels of the two sweeps.
    """

    def __init__(self, scene: Scene, law: Law, conditions: ConditionTypes, space: Space, launcher: Launcher):
        self._launcher = launcher
        numerics = scene.numerics
        parts = sweep(space, numerics.kernel, batch_on(launcher.device))
        self._to_auxiliary = _to_auxiliary_kernel(space, parts, law.Parameters)
        self._to_nodes = _to_nodes_kernel(
            space,
            parts,
            law.Parameters,
            numerics.velocity_scheme,
            scene.large_displacements,
            conditions,
        )
        self.kernels = (self._to_auxiliary, self._to_nodes)

    def set_courant(self, courant: float) -> None:
        """Nothing: the published schemes know the time step only."""

    def to_auxiliary(self, material, dt: wp.array, pairs: PairList, nodes, internals, auxiliary) -> None:
        """Steps 3-6: φ_aux = value of φ_s, then φ_aux^{n+1/2} = φ_aux − (Δt/2) div f(φ_s)."""
        inputs = [material, dt, pairs, nodes, auxiliary]
        self._launcher.launch(self._to_auxiliary, auxiliary.point, inputs)

    def to_nodes(self, material, conditions, dt: wp.array, pairs: PairList, auxiliary, nodes) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""
        inputs = [material, conditions, dt, pairs, auxiliary, nodes]
        self._launcher.launch(self._to_nodes, nodes.point, inputs)


@cache
def _to_auxiliary_kernel(space: Space, parts: Sweep, Parameters: type):
    types = space.types
    real, MaterialNodes, AuxiliaryNodes = space.real, types.MaterialNodes, types.AuxiliaryNodes
    rate = wave_rate(space, Parameters)
    collect, value, gradient = parts.collect, parts.value, parts.gradient
    round_metric = parts.round_metric

    @forward_kernel
    def to_auxiliary(
        first: int,
        material: Parameters,
        time_step: wp.array(dtype=real),
        pairs: PairList,
        nodes: MaterialNodes,
        auxiliary: AuxiliaryNodes,
    ):
        a = first + wp.tid()
        point = auxiliary.point[a]
        metric = round_metric(auxiliary.smoothing_length[a])
        sums = collect(a, point.x, metric, point.phi, pairs, nodes.point, nodes.volume)
        phi = value(sums)  # 3
        minus_div_f = rate(gradient(sums, phi), real(1.0) / auxiliary.density[a], material)  # 4-5
        auxiliary.point[a].phi = phi + real(0.5) * time_step[0] * minus_div_f  # 6

    return to_auxiliary


@cache
def _to_nodes_kernel(
    space: Space,
    parts: Sweep,
    Parameters: type,
    scheme: str,
    moves: bool,
    conditions: ConditionTypes,
):
    types = space.types
    real, MaterialNodes, AuxiliaryNodes = space.real, types.MaterialNodes, types.AuxiliaryNodes
    phi = space.phi
    velocity, stress, join, velocity_gradient = phi.velocity, phi.stress, phi.join, phi.velocity_gradient
    Table, apply = conditions.Table, conditions.apply
    rate = wave_rate(space, Parameters)
    collect, value, gradient = parts.collect, parts.value, parts.gradient
    round_metric = parts.round_metric
    advance_velocity = VELOCITY_SCHEMES[scheme](space)
    to_half_step = half_step_gradient(space) if moves else initial_gradient(space)

    @forward_kernel
    def to_nodes(
        first: int,
        material: Parameters,
        conditions: Table,
        time_step: wp.array(dtype=real),
        pairs: PairList,
        auxiliary: AuxiliaryNodes,
        nodes: MaterialNodes,
    ):
        i = first + wp.tid()
        dt, point = time_step[0], nodes.point[i]
        metric = round_metric(nodes.smoothing_length[i])
        sums = collect(i, point.x, metric, point.phi, pairs, auxiliary.point, auxiliary.volume)
        phi_half = apply(i, value(sums), HALF, conditions)  # 7
        grad, volume_ratio = to_half_step(gradient(sums, phi_half), dt)
        minus_div_f = rate(grad, volume_ratio / nodes.density[i], material)  # 8-9

        v_half = velocity(phi_half)
        sigma_adv = stress(point.phi) + dt * stress(minus_div_f)  # 10a
        v_adv = advance_velocity(velocity(point.phi), v_half, velocity(minus_div_f), dt)  # 10b
        nodes.point[i].phi = join(v_adv, sigma_adv)
        nodes.half_velocity[i] = v_half
        nodes.velocity_gradient[i] = velocity_gradient(grad)

    return to_nodes
