"""Steps 3-10 as published: Shepard values and corrected gradients from one set of nodes to the other.

Two velocity steps: `blanc-pastor`, which has no checkerboard but filters every wave, and `taylor`, which keeps
waves and leaves the checkerboard alone.
"""

from collections.abc import Callable
from functools import cache, wraps

import warp as wp

from ..device.compiling import forward_kernel
from ..materials.law import Law
from ..mesh.kinds import GRID_KINDS
from ..operators.conditions import Conditions, ConditionTypes
from ..operators.motion import half_step_gradient, initial_gradient
from ..operators.neighbour_sums import NeighbourSums, batch_on, neighbour_sums
from ..physics.space import Space
from ..physics.waves import wave_rate
from ..scene.scheme import Scheme, Sums
from ..state.clock import HALF
from ..state.nodes import SumsBody
from ..state.pairs import PairList
from .sums import SumsStepper


@cache
def blanc_pastor(space: Space) -> wp.Function:
    """v_adv = 2 v^{n+1/2} − v_s: the published step 10b.

    No checkerboard, but it filters every wave with diffusivity about (2 m₂ − C²/2) Δx²/Δt (METHOD section 4).
    v_s, not vⁿ, stands on the right: with vⁿ step 12 would apply 1.5 times the body force.
    """
    vector, real = space.types.vector, space.real

    @wp.func
    def advance(v_s: vector, v_half: vector, acceleration: vector, dt: real):
        return real(2.0) * v_half - v_s

    return advance


@cache
def taylor(space: Space) -> wp.Function:
    """v_adv = v_s − Δt div f(φ^{n+1/2}): the complete two-step Taylor scheme; leaves the checkerboard alone."""
    vector = space.types.vector

    @wp.func
    def advance(v_s: vector, v_half: vector, acceleration: vector, dt: space.real):
        return v_s + dt * acceleration

    return advance


class PublishedFluxes:
    """The two passes of a published scheme.

    Args:
        advance_velocity: makes the function of step 10b.
        body: the body.
        conditions: its boundary conditions.
        around_auxiliary, around_nodes: the pair lists.

    Attributes:
        kernels: the kernels of the two passes.
    """

    def __init__(
        self,
        advance_velocity: Callable[[Space], wp.Function],
        body: SumsBody,
        *,
        conditions: Conditions,
        around_auxiliary: PairList,
        around_nodes: PairList,
    ):
        self._body, self._conditions = body, conditions
        self._around_auxiliary, self._around_nodes = around_auxiliary, around_nodes
        space, law = body.space, body.law
        sums = neighbour_sums(space, body.scene.numerics.smoothing, batch_on(body.launcher.device))
        to_half_step = (half_step_gradient if body.scene.large_displacements else initial_gradient)(space)
        self._to_auxiliary = _to_auxiliary_kernel(space, law, sums)
        self._to_nodes = _to_nodes_kernel(
            space, law, sums, advance_velocity(space), to_half_step, conditions.types
        )
        self.kernels = (self._to_auxiliary, self._to_nodes)

    def to_auxiliary(self, dt: wp.array) -> None:
        """Steps 3-6: φ_aux = value of φ_s, then φ_aux^{n+1/2} = φ_aux − (Δt/2) div f(φ_s)."""
        body = self._body
        inputs = [body.parameters, dt, self._around_auxiliary, body.nodes, body.auxiliary]
        body.launcher.launch(self._to_auxiliary, body.auxiliary.point, inputs)

    def to_nodes(self, dt: wp.array) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""
        body = self._body
        inputs = [
            body.parameters,
            self._conditions.table,
            dt,
            self._around_nodes,
            body.auxiliary,
            body.nodes,
        ]
        body.launcher.launch(self._to_nodes, body.nodes.point, inputs)


@cache
def _to_auxiliary_kernel(space: Space, law: Law, sums: NeighbourSums):
    real, rate = space.real, wave_rate(space, law.Parameters)

    @forward_kernel
    def to_auxiliary(
        first: int,
        material: law.Parameters,
        time_step: wp.array(dtype=real),
        pairs: PairList,
        nodes: space.types.MaterialNodes,
        auxiliary: space.types.AuxiliaryNodes,
    ):
        a = first + wp.tid()
        point = auxiliary.point[a]
        h = auxiliary.smoothing_length[a]
        around = sums.collect(a, point.x, h, point.phi, pairs, nodes.point, nodes.volume)
        phi = sums.value(around)  # 3
        minus_div_f = rate(sums.gradient(around, phi), real(1.0) / auxiliary.density[a], material)  # 4-5
        auxiliary.point[a].phi = phi + real(0.5) * time_step[0] * minus_div_f  # 6

    return to_auxiliary


@cache
def _to_nodes_kernel(
    space: Space,
    law: Law,
    sums: NeighbourSums,
    advance_velocity: wp.Function,
    to_half_step: wp.Function,
    conditions: ConditionTypes,
):
    phi, rate = space.phi, wave_rate(space, law.Parameters)

    @forward_kernel
    def to_nodes(
        first: int,
        material: law.Parameters,
        table: conditions.Table,
        time_step: wp.array(dtype=space.real),
        pairs: PairList,
        auxiliary: space.types.AuxiliaryNodes,
        nodes: space.types.MaterialNodes,
    ):
        i = first + wp.tid()
        dt, point = time_step[0], nodes.point[i]
        h = nodes.smoothing_length[i]
        around = sums.collect(i, point.x, h, point.phi, pairs, auxiliary.point, auxiliary.volume)
        phi_half = conditions.apply(i, sums.value(around), HALF, table)  # 7
        grad, volume_ratio = to_half_step(sums.gradient(around, phi_half), dt)
        minus_div_f = rate(grad, volume_ratio / nodes.density[i], material)  # 8-9

        v_half = phi.velocity(phi_half)
        sigma_adv = phi.stress(point.phi) + dt * phi.stress(minus_div_f)  # 10a
        v_adv = advance_velocity(phi.velocity(point.phi), v_half, phi.velocity(minus_div_f), dt)  # 10b
        nodes.point[i].phi = phi.with_stress(phi.with_velocity(point.phi, v_adv), sigma_adv)
        nodes.half_velocity[i] = v_half
        nodes.velocity_gradient[i] = phi.velocity_gradient(grad)

    return to_nodes


def published_scheme(name: str, *, meaning: str, advance_velocity: Callable[[Space], wp.Function]) -> Scheme:
    """A scheme with the published sums and a velocity step of its own.

    Args:
        name: what `Numerics.velocity_scheme` calls it.
        meaning: one line.
        advance_velocity: space → Warp function (v_s, v^{n+1/2}, −div f, Δt) → v_adv of step 10b; cached.
    """

    @wraps(advance_velocity, updated=())  # a registered scheme belongs to the place that makes its step
    def fluxes(body: SumsBody, **more) -> PublishedFluxes:
        return PublishedFluxes(advance_velocity, body, **more)

    return Scheme(
        name=name,
        meaning=meaning,
        stepper=SumsStepper,
        kinds=tuple(GRID_KINDS.values()),
        sums=Sums(fluxes=fluxes),
    )


BLANC_PASTOR = published_scheme(
    "blanc-pastor", meaning="the published step, 2 v^{n+1/2} − v: filters waves", advance_velocity=blanc_pastor
)
TAYLOR = published_scheme(
    "taylor", meaning="the paper's complete scheme: leaves the checkerboard alone", advance_velocity=taylor
)
