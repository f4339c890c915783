"""Cells in energy-conjugate form (METHOD section 8): a kick, then nodes and cells by turns, all of it gathers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from ..device.compiling import load_kernels
from ..device.launching import Launcher
from ..errors import SceneError
from ..mesh.kinds import KINDS
from ..mesh.mesh import Mesh
from ..operators.cell_energy import CellEnergy
from ..operators.cell_limit import CellLimit
from ..operators.cell_passes import (
    LEAST_VOLUME,
    force_kernel,
    kick_kernel,
    numbers_of,
    push_kernel,
    strain_kernel,
    stress_kernel,
)
from ..operators.cell_shape import cell_shape
from ..operators.held import held_table
from ..physics.space import Space
from ..scene.scene import Scene
from ..scene.scheme import Scheme
from ..state.cell_body import CellBody
from ..state.clock import Clock, Outcome
from ..state.energy import Energy
from .step import Stepper


class CellStepper(Stepper):
    """The state of a scene on a device, and the step of the scheme `cells`.

    Args:
        scene: the scene.
        space: the continuum and the precision.
        launcher: launches the kernels.

    Attributes:
        body: nodes, cells and material.
        conditions: the table of the conditions.
        reactions: what the conditions take up at each constrained node, R [N] with m dv/dt = f + R, shape (b,).
        rough_loss: energy lost to the rough viscosity [J], a number a cell.

    Raises:
        SceneError: the scene asks for what this scheme has not.
    """

    def __init__(self, scene: Scene, space: Space, launcher: Launcher):
        if scene.boundary.loaded:
            raise SceneError("conditions", scene.conditions, "velocity_scheme cells takes no tractions")
        if scene.numerics.source_scheme != "analytic":
            allowed = "velocity_scheme cells takes analytic only"
            raise SceneError("source_scheme", scene.numerics.source_scheme, allowed)
        clock = Clock(scene.body_force, scene.boundary.functions, space, launcher)
        self.body = body = CellBody.of(scene, space, launcher)
        device, real, cells = launcher.device, space.real, len(scene.mesh.cells)
        n, moves = len(scene.mesh.nodes), scene.large_displacements
        self.conditions = held_table(scene.boundary, n, space=space, device=device, clock=clock)
        self._numbers = wp.zeros(
            (cells, numbers_of(space, cell_shape(space, body.kind))), dtype=real, device=device
        )
        self._forces = wp.zeros((cells, body.kind.corners), dtype=space.types.vector, device=device)
        self.reactions = wp.zeros(max(1, len(scene.boundary.nodes)), dtype=space.types.vector, device=device)
        self.rough_loss = wp.zeros(cells, dtype=wp.float64, device=device)
        self._limit, self._energy = CellLimit(body, clock), CellEnergy(body, self.rough_loss)
        self._kick = kick_kernel(space, moves)
        self._strain, self._force = strain_kernel(space, body.kind), force_kernel(space, body.kind, body.law)
        self._stress = stress_kernel(space, body.kind, body.law, body.slots, moves)
        self._push = push_kernel(space, body.kind, body.slots)
        kernels = (self._kick, self._strain, self._stress, self._force, self._push)
        super().__init__(launcher, clock, parts=(self._limit,))
        load_kernels([*kernels, *clock.kernels, *self._limit.kernels, *self._energy.kernels], device)
        self._limit.refresh()
        self.clock.begin([0.0], 0.0)
        self.step()  # of no length: what the initial state asks for, and the accelerations it begins with
        self._energy.open()

    @property
    def shrinkage(self) -> float:
        """Least time of a wave across a cell over the initial one, at most 1."""
        return self._limit.shrinkage

    def energy(self) -> Energy:
        """The energy balance since t = 0."""
        return self._energy.now()

    def advance(self, times: Sequence[float], dt: float, courant: float) -> Outcome:
        """Make a step from each of the times to Δt later, the first step of all alone; see `Stepper.advance`."""
        if self._energy.begun:
            return super().advance(times, dt, courant)
        outcome = super().advance(times[:1], dt, courant)
        self._energy.begin()
        return outcome

    def step(self) -> None:
        """Advance the nodes by the clock's Δt."""
        body, clock, launch = self.body, self.clock, self.body.launcher.launch
        nodes, points, dt, faults = body.nodes, body.nodes.point, clock.time_step, clock.faults
        damping, wave_speed = body.scene.damping, body.scene.material.wave_speed(body.space.dim)
        launch(self._kick, points, [self.conditions, damping, dt, nodes], gathers=False)
        launch(self._strain, body.corners, [body.corners, nodes, self._numbers, faults])
        inputs = [body.parameters, LEAST_VOLUME / body.scene.material.density, dt, body.node_cells]
        launch(self._stress, points, [*inputs, self._numbers, nodes, body.internals, self._limit.outdated, faults])
        inputs = [body.parameters, wave_speed, dt, body.corners, nodes, self._numbers]
        launch(self._force, body.corners, [*inputs, self._forces, self.rough_loss])
        inputs = [self.conditions, clock.forces, damping, dt, body.node_cells, self._forces]
        launch(self._push, points, [*inputs, nodes, self.reactions, faults])
        clock.tick()


def spacing(mesh: Mesh) -> float:
    """Least 2 c_p/ω_T of the cells [m], see `warpsph.operators.cell_limit`: of a lattice its spacing."""
    gradients = np.array(mesh.kind.gradients) @ np.linalg.inv(mesh.cell_jacobians())
    largest = np.linalg.norm(gradients, 2, axis=(1, 2)).max()
    return float(2.0 / (np.sqrt(mesh.kind.corners) * largest))


CELLS = Scheme(
    name="cells",
    meaning="cells in energy-conjugate form: any cell, any configuration, free edges for nothing",
    fluxes=None,
    motion=None,
    unloads=True,
    follows_cells=True,
    courant_limit=lambda dim, moment: 1.0,
    largest_support=lambda dim: float("inf"),
    kinds=tuple(KINDS.values()),
    stepper=CellStepper,
    spacing=spacing,
)
