"""The time step of the Runge-Kutta Taylor SPH method (METHOD section 3, Table I of Blanc and Pastor 2012)."""

import warp as wp

from ..device.compiling import load_kernels
from ..device.launching import Launcher
from ..operators.conditions import Conditions
from ..operators.sources import sources
from ..operators.surface.release import FreeSurfaceConditions
from ..physics.space import Space
from ..scene.scene import Scene
from ..state.clock import Clock
from ..state.nodes import SumsBody
from .lists import PairLists
from .step import Stepper


class SumsStepper(Stepper):
    """The state of a scene on a device, and its step by sums over neighbours.

    Args:
        scene: the scene.
        space: the continuum and the precision.
        launcher: launches the kernels.

    Attributes:
        body: nodes, cells and material.
        conditions: boundary conditions, `Conditions` or `FreeSurfaceConditions`.
        clock: what differs from step to step.
        lists: the pair lists and what moves the nodes.
        fluxes: the waves, steps 3-10, of the scene's scheme.
        parts: what the host renews now and then, each after those that it depends on.
    """

    def __init__(self, scene: Scene, space: Space, launcher: Launcher):
        self.body = SumsBody.of(scene, space, launcher)
        clock = Clock(scene.body_force, scene.boundary.functions, space, launcher)
        self.lists = PairLists(self.body, clock)
        self._sources = sources(scene, self.body.law, self.body.parameters, space, launcher)
        if scene.free_surface is None:
            self.conditions = Conditions(
                scene.boundary,
                len(scene.mesh.nodes),
                space=space,
                launcher=launcher,
                clock=clock,
                moves=scene.large_displacements,
            )
        else:
            self.conditions = FreeSurfaceConditions(
                scene, self.body.nodes, space=space, launcher=launcher, clock=clock
            )
        self.fluxes = scene.numerics.scheme.sums.fluxes(
            self.body,
            conditions=self.conditions,
            around_auxiliary=self.lists.around_auxiliary,
            around_nodes=self.lists.around_nodes,
        )
        super().__init__(launcher, clock, parts=(self.lists, self.conditions))
        pieces = (self.clock, self._sources, self.fluxes, *self.parts)
        load_kernels([kernel for piece in pieces for kernel in piece.kernels], launcher.device)
        for part in self.parts:
            part.refresh()
        self.clock.begin([0.0], 0.0)
        self.conditions.apply(self.body.nodes)
        self._initial_spin(scene)

    @property
    def shrinkage(self) -> float:
        """1: published schemes keep their step, since their viscosity depends on it."""
        return 1.0

    @property
    def builds(self) -> int:
        """How often the pair lists were built."""
        return self.lists.builds

    def arrays_recorded(self) -> tuple[int, ...]:
        """Addresses of the lists."""
        return tuple(pairs.index.ptr for pairs in (self.lists.around_auxiliary, self.lists.around_nodes))

    def step(self) -> None:
        """Advance the nodes by the clock's Δt; the numbers are those of METHOD section 3."""
        nodes, internals, dt = self.body.nodes, self.body.internals, self.clock.time_step
        self._sources.half_step(nodes, internals, self.clock.first_half, dt, ends=False)  # 1-2
        self.conditions.turn(nodes, dt)
        self.fluxes.to_auxiliary(dt)  # 3-6
        self.fluxes.to_nodes(dt)  # 7-10
        self._sources.half_step(nodes, internals, self.clock.second_half, dt, ends=True)  # 11-12
        self.conditions.turn(nodes, dt)
        self.conditions.apply(nodes)  # 13
        self.lists.motion.move(dt)  # 14
        self.clock.tick()

    def _initial_spin(self, scene: Scene) -> None:
        """Velocity gradient of the initial state, for the spin of the very first source step."""
        if not scene.initial_velocity.any():
            return
        start = wp.clone(self.body.nodes.point)
        self.fluxes.to_auxiliary(self.clock.time_step)
        self.fluxes.to_nodes(self.clock.time_step)
        wp.copy(self.body.nodes.point, start)
