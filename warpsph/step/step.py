"""One time step of the Runge-Kutta Taylor SPH method (METHOD section 3, Table I of Blanc and Pastor 2012)."""

from functools import cache

import warp as wp

from ..ground.compiling import load_kernels
from ..ground.materials import law as material_law
from ..ground.precision import Precision
from ..ground.unknowns import unknowns
from ..nodes.neighbours import SKIN, Neighbours, PairList
from ..nodes.node_sets import (
    auxiliary_nodes,
    material_history,
    material_nodes,
    node_types,
)
from ..operators.conditions import Conditions, ConditionTypes
from ..operators.free_surface import FreeSurfaceConditions
from ..operators.motion import Motion, NoMotion, centre_kernel, half_step_gradient, initial_gradient
from ..operators.sources import sources
from ..operators.sweep import sweep
from ..operators.waves import wave_rate
from ..scene.dimension import Continuum
from ..scene.numerics import KERNELS
from ..scene.scene import Scene
from .velocity_schemes import VELOCITY_SCHEMES


class Stepper:
    """The state of a scene on a device, and the one function that advances it.

    Args:
        scene: the scene.
        precision: float32 or float64.
        device: the Warp device.

    Attributes:
        nodes: material nodes (struct of arrays, see `warpsph.nodes.node_sets`).
        auxiliary: auxiliary nodes.
        history: internal variables of the material, or None.
        conditions: boundary conditions, `Conditions` or `FreeSurfaceConditions`.
        list_builds: how often the pair lists were built.
    """

    def __init__(self, scene: Scene, precision: Precision, device: wp.Device):
        lattice, numerics = scene.lattice, scene.numerics
        continuum, n = lattice.continuum, len(lattice.nodes)
        types = node_types(continuum, precision)
        law = material_law(scene.material, continuum, precision)
        self._parameters = law.fill(scene.material)
        self.nodes = material_nodes(scene, types, precision, device)
        self.auxiliary = auxiliary_nodes(scene, types, precision, device)
        self.history = material_history(n, law, precision, device)
        self._device, self._n, self._m = device, n, len(lattice.cells)

        support, skin = KERNELS[numerics.kernel].support, 0.0
        self._motion = NoMotion()
        if scene.large_displacements:
            skin = SKIN * lattice.spacing
            self._motion = Motion(n, support, skin, scene.material.density, continuum, precision, device)
        search = (support, lattice.spacing, skin)
        self._around_auxiliary = Neighbours(continuum, precision, self.auxiliary, self.nodes, *search)
        self._around_nodes = Neighbours(continuum, precision, self.nodes, self.auxiliary, *search)
        self._sources = sources(scene, law, self._parameters, precision)
        if scene.free_surface is None:
            self.conditions = Conditions(scene.boundary, n, continuum, precision, device)
        else:
            self.conditions = FreeSurfaceConditions(scene, self.nodes, precision, device)
        self._to_auxiliary = _to_auxiliary_kernel(continuum, precision, numerics.kernel, law.Parameters)
        self._to_nodes = _to_nodes_kernel(
            continuum,
            precision,
            numerics.kernel,
            law.Parameters,
            numerics.velocity_scheme,
            scene.large_displacements,
            self.conditions.types,
        )
        self._health = wp.full(2, -1, dtype=wp.int32, device=device)
        parts = (self._around_nodes, self._sources, self.conditions, self._motion)
        own = (centre_kernel(continuum, precision), self._to_auxiliary, self._to_nodes)
        load_kernels([*own, *(kernel for part in parts for kernel in part.kernels)], device)

        wp.launch(centre_kernel(continuum, precision), self._m, [self.nodes, self.auxiliary], device=device)
        self.list_builds = 0
        self._build_lists()
        self.conditions.apply(self.nodes, 0.0, 0, self._health)
        self._initial_spin(scene)

    def step(self, number: int, t: float, dt: float) -> None:
        """Advance the nodes from t to t + dt; the numbers are those of METHOD section 3.

        Args:
            number: number of this step, for the report of non-finite values.
            t: time [s].
            dt: time step [s].
        """
        self._sources.half_step(self.nodes, self.history, t, 0.5 * dt)  # 1-2
        self.to_auxiliary(dt)  # 3-6
        self.to_nodes(t + 0.5 * dt, dt)  # 7-10
        self._sources.half_step(self.nodes, self.history, t + 0.5 * dt, 0.5 * dt)  # 11-12
        self.conditions.apply(self.nodes, t + dt, number, self._health)  # 13
        self._motion.move(self.nodes, self.auxiliary, dt)  # 14
        if self._motion.lists_outdated():
            self._build_lists()
        self.conditions.follow(self.nodes, dt)

    def to_auxiliary(self, dt: float) -> None:
        """Steps 3-6: φ_aux = value of φ_s, then φ_aux^{n+1/2} = φ_aux − (Δt/2) div f(φ_s)."""
        wp.launch(
            self._to_auxiliary,
            self._m,
            inputs=[self._parameters, dt, self._around_auxiliary.pairs, self.nodes, self.auxiliary],
            device=self._device,
        )

    def to_nodes(self, t_half: float, dt: float) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""
        self.conditions.set_time(t_half)
        wp.launch(
            self._to_nodes,
            self._n,
            inputs=[
                self._parameters,
                self.conditions.table,
                dt,
                self._around_nodes.pairs,
                self.auxiliary,
                self.nodes,
            ],
            device=self._device,
        )

    def first_non_finite(self) -> tuple[int, int] | None:
        """(node, step) where velocity, stress or displacement first stopped being finite, or None."""
        node, step = self._health.numpy().tolist()
        return None if node < 0 else (node, step)

    def _build_lists(self) -> None:
        self._around_auxiliary.build()
        self._around_nodes.build()
        self._motion.mark(self.nodes)
        self.conditions.locate(self.nodes)
        self.list_builds += 1

    def _initial_spin(self, scene: Scene) -> None:
        """Velocity gradient of the initial state, for the spin of the very first source step."""
        if not scene.initial_velocity.any():
            return
        start = wp.clone(self.nodes.point)
        self.to_auxiliary(0.0)
        self.to_nodes(0.0, 0.0)
        wp.copy(self.nodes.point, start)


@cache
def _to_auxiliary_kernel(continuum: Continuum, precision: Precision, kernel: str, Parameters: type):
    types = node_types(continuum, precision)
    real, MaterialNodes, AuxiliaryNodes = precision.real, types.MaterialNodes, types.AuxiliaryNodes
    rate, parts = wave_rate(continuum, precision, Parameters), sweep(continuum, precision, kernel)
    collect, value, gradient = parts.collect, parts.value, parts.gradient

    @wp.kernel(module="unique", enable_backward=False)
    def to_auxiliary(
        material: Parameters, dt: real, pairs: PairList, nodes: MaterialNodes, auxiliary: AuxiliaryNodes
    ):
        a = wp.tid()
        point = auxiliary.point[a]
        sums = collect(a, point.x, auxiliary.smoothing_length[a], point.phi, pairs, nodes.point)
        phi = value(sums)  # 3
        minus_div_f = rate(gradient(sums, phi), real(1.0) / auxiliary.density[a], material)  # 4-5
        auxiliary.point[a].phi = phi + real(0.5) * dt * minus_div_f  # 6

    return to_auxiliary


@cache
def _to_nodes_kernel(
    continuum: Continuum,
    precision: Precision,
    kernel: str,
    Parameters: type,
    scheme: str,
    moves: bool,
    conditions: ConditionTypes,
):
    types = node_types(continuum, precision)
    real, MaterialNodes, AuxiliaryNodes = precision.real, types.MaterialNodes, types.AuxiliaryNodes
    phi = unknowns(continuum, precision)
    velocity, stress, join, velocity_gradient = phi.velocity, phi.stress, phi.join, phi.velocity_gradient
    Table, apply = conditions.Table, conditions.apply
    rate, parts = wave_rate(continuum, precision, Parameters), sweep(continuum, precision, kernel)
    collect, value, gradient = parts.collect, parts.value, parts.gradient
    advance_velocity = VELOCITY_SCHEMES[scheme](continuum.dim, precision)
    to_half_step = half_step_gradient(continuum, precision) if moves else initial_gradient(continuum, precision)

    @wp.kernel(module="unique", enable_backward=False)
    def to_nodes(
        material: Parameters,
        conditions: Table,
        dt: real,
        pairs: PairList,
        auxiliary: AuxiliaryNodes,
        nodes: MaterialNodes,
    ):
        i = wp.tid()
        point = nodes.point[i]
        sums = collect(i, point.x, nodes.smoothing_length[i], point.phi, pairs, auxiliary.point)
        phi_half = apply(i, value(sums), conditions)  # 7
        grad, volume_ratio = to_half_step(gradient(sums, phi_half), dt)
        minus_div_f = rate(grad, volume_ratio / nodes.density[i], material)  # 8-9

        v_half = velocity(phi_half)
        sigma_adv = stress(point.phi) + dt * stress(minus_div_f)  # 10a
        v_adv = advance_velocity(velocity(point.phi), v_half, velocity(minus_div_f), dt)  # 10b
        nodes.point[i].phi = join(v_adv, sigma_adv)
        nodes.half_velocity[i] = v_half
        nodes.velocity_gradient[i] = velocity_gradient(grad)

    return to_nodes
