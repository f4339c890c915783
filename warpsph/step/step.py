"""The time step of the Runge-Kutta Taylor SPH method (METHOD section 3, Table I of Blanc and Pastor 2012)."""

from collections.abc import Sequence

import warp as wp

from ..device.compiling import load_kernels
from ..device.launching import Launcher, Recording
from ..materials import law as material_law
from ..operators.cell_motion import CellMotion
from ..operators.conditions import Conditions
from ..operators.motion import Motion, NoMotion, centre_kernel
from ..operators.sources import sources
from ..operators.surface.release import FreeSurfaceConditions
from ..physics.space import Space
from ..scene.numerics import KERNELS
from ..scene.scene import Scene
from ..state.clock import Clock, Outcome
from ..state.nodes import (
    auxiliary_nodes,
    material_internals,
    material_nodes,
)
from ..state.pairs import SKIN, Neighbours
from .fluxes import FLUXES


class Stepper:
    """The state of a scene on a device, and the functions that advance it.

    Args:
        scene: the scene.
        space: the continuum and the precision.
        launcher: launches the kernels.

    Attributes:
        nodes: material nodes (struct of arrays, see `warpsph.state.nodes`).
        auxiliary: auxiliary nodes.
        internals: internal variables of the material, or None.
        conditions: boundary conditions, `Conditions` or `FreeSurfaceConditions`.
        clock: what differs from step to step.
        shrinkage: least time of a wave from node to node over the initial one, at most 1, as of the last list.
        list_builds: how often the pair lists were built.
    """

    def __init__(self, scene: Scene, space: Space, launcher: Launcher):
        mesh, numerics, device = scene.mesh, scene.numerics, launcher.device
        n = len(mesh.nodes)
        law = material_law(scene.material, space)
        self._parameters = law.fill(scene.material)
        self.nodes = material_nodes(scene, space, device)
        self.auxiliary = auxiliary_nodes(scene, space, device)
        self.internals = material_internals(n, law, space, device)
        functions = scene.boundary.functions
        self.clock = Clock(scene.body_force, functions, space, launcher)
        self._launcher, self._recording, self._recorded = launcher, None, None

        support, skin = KERNELS[numerics.kernel].support, 0.0
        self._motion = NoMotion()
        if scene.large_displacements:
            skin = SKIN * mesh.spacing
            moving = CellMotion if numerics.follows_cells else Motion
            self._motion = moving(scene, skin, space, launcher, self.clock.lists_outdated)
        search = (support, mesh.spacing, skin)
        # Before the lists, whose grids are sized by where the nodes are.
        centre = centre_kernel(space)
        load_kernels([centre], device)
        launcher.launch(centre, self.auxiliary.point, [self.nodes, self.auxiliary])
        self._around_auxiliary = Neighbours(space, launcher, self.auxiliary, self.nodes, *search)
        self._around_nodes = Neighbours(space, launcher, self.nodes, self.auxiliary, *search)
        self._sources = sources(scene, law, self._parameters, space, launcher)
        if scene.free_surface is None:
            turns = numerics.unloads and scene.large_displacements and mesh.dim > 1
            self.conditions = Conditions(scene.boundary, n, space, launcher, self.clock, turns)
        else:
            self.conditions = FreeSurfaceConditions(scene, self.nodes, space, launcher, self.clock)
        self._fluxes = FLUXES[numerics.velocity_scheme](scene, law, self.conditions.types, space, launcher)
        parts = (self.clock, self._around_nodes, self._sources, self._fluxes, self.conditions, self._motion)
        load_kernels([kernel for part in parts for kernel in part.kernels], device)

        self.list_builds, self.shrinkage = 0, 1.0
        self._per_spacing = scene.material.wave_speed(mesh.dim) / mesh.smallest_edge()
        self._build_lists()
        self._begin([0.0], 0.0)
        self.conditions.apply(self.nodes)
        self._initial_spin(scene)

    def advance(self, times: Sequence[float], dt: float) -> Outcome:
        """Make a step from each of the times to Δt later; fewer when the host is needed before.

        Args:
            times: where the steps begin [s], at most `LONGEST_RUN` of them.
            dt: time step [s].

        Returns:
            How many were made, at least one. When a value is not finite, the last step is the first with it.
        """
        self._begin(times, dt)
        self._record().run()
        outcome = self.clock.outcome()
        if outcome.lists_outdated and not outcome.non_finite:
            self._build_lists()
        elif outcome.surface_outdated:
            self.conditions.locate(self.nodes)
        return outcome

    def step(self) -> None:
        """Advance the nodes by the clock's Δt; the numbers are those of METHOD section 3."""
        dt = self.clock.time_step
        self._sources.half_step(self.nodes, self.internals, self.clock.first_half, dt)  # 1-2
        self.conditions.turn(self.nodes, dt)
        self.to_auxiliary()  # 3-6
        self.to_nodes()  # 7-10
        self._sources.half_step(self.nodes, self.internals, self.clock.second_half, dt)  # 11-12
        self.conditions.turn(self.nodes, dt)
        self.conditions.apply(self.nodes)  # 13
        self._motion.move(self.nodes, self.auxiliary, dt)  # 14
        self.clock.tick()

    def to_auxiliary(self) -> None:
        """Steps 3-6: φ_aux = value of φ_s, then φ_aux^{n+1/2} = φ_aux − (Δt/2) div f(φ_s)."""
        dt, pairs = self.clock.time_step, self._around_auxiliary.pairs
        self._fluxes.to_auxiliary(self._parameters, dt, pairs, self.nodes, self.internals, self.auxiliary)

    def to_nodes(self) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""
        dt, table, pairs = self.clock.time_step, self.conditions.table, self._around_nodes.pairs
        self._fluxes.to_nodes(self._parameters, table, dt, pairs, self.auxiliary, self.nodes)

    def _begin(self, times: Sequence[float], dt: float) -> None:
        """Get ready for the steps from each of the times [s] to Δt later, with C of the least present spacing."""
        self.clock.begin(times, dt)
        self._fluxes.set_courant(dt * self._per_spacing / self.shrinkage)

    def _record(self) -> Recording:
        """The step, recorded anew where lists have got new arrays."""
        lists = self._around_auxiliary.pairs, self._around_nodes.pairs
        content = tuple(pairs.index.ptr for pairs in lists)
        if self._recorded != content:
            self._recording = self._launcher.record(self.step, self.clock.going)
            self._recorded = content
        return self._recording

    def _build_lists(self) -> None:
        self._around_auxiliary.build()
        self._around_nodes.build()
        self._motion.mark(self.nodes, self.auxiliary)
        self.conditions.locate(self.nodes)
        self.shrinkage = self._motion.shrinkage(self.nodes, self.auxiliary)
        self.list_builds += 1

    def _initial_spin(self, scene: Scene) -> None:
        """Velocity gradient of the initial state, for the spin of the very first source step."""
        if not scene.initial_velocity.any():
            return
        start = wp.clone(self.nodes.point)
        self.to_auxiliary()
        self.to_nodes()
        wp.copy(self.nodes.point, start)
