"""Cells in energy-conjugate form (METHOD section 8): a kick, then nodes and cells by turns, all of it gathers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from ..device.compiling import load_kernels
from ..device.launching import Launcher
from ..mesh.kinds import KINDS
from ..mesh.mesh import Mesh
from ..operators.cell_energy import CellEnergy
from ..operators.cell_limit import CellLimit
from ..operators.cell_numbers import numbers_of
from ..operators.cell_passes import BENT, BENT_SHARE, corner_share, force_kernel, strain_kernel
from ..operators.cell_shape import cell_shape
from ..operators.face_loads import LoadedFaces
from ..operators.held import held_table
from ..operators.node_limit import NodeLimit
from ..operators.node_passes import kick_kernel, push_kernel, rate_kernel, stress_kernel
from ..operators.remaking import Remaking
from ..operators.sharpening import Sharpening
from ..operators.tools import Tools
from ..physics.space import Space
from ..scene.scene import Scene
from ..scene.scheme import Scheme
from ..state.cell_body import LEAST_VOLUME, CellBody
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
        loads: forces on boundary faces, and their work.
        remaking: makes cells anew.
        tools: the tools, what they do to the body, and their work.
        rough_loss: energy lost to the rough viscosity [J], a number a cell.
    """

    def __init__(self, scene: Scene, space: Space, launcher: Launcher):
        driven = scene.boundary.functions
        clock = Clock(
            scene.body_force, (*driven, *scene.loads.functions, *scene.tool_functions[0]), space, launcher
        )
        c = scene.sharpening
        self.body = body = CellBody.of(scene, space, launcher, sharp=c > 0.0)
        device, real, cells = launcher.device, space.real, body.corners.shape[0]
        n, moves = len(scene.mesh.nodes), scene.large_displacements
        self.conditions = held_table(scene.boundary, n, space=space, device=device, clock=clock)
        self._numbers = wp.zeros(
            (cells, numbers_of(space, cell_shape(space, body.kind))), dtype=real, device=device
        )
        self._forces = wp.zeros((cells, body.kind.corners), dtype=space.types.vector, device=device)
        self.reactions = wp.zeros(max(1, len(scene.boundary.nodes)), dtype=space.types.vector, device=device)
        self.rough_loss = wp.zeros(cells, dtype=wp.float64, device=device)
        self.loads = LoadedFaces(body, clock, len(driven))
        offset = len(driven) + len(scene.loads.functions)
        self._limit = (CellLimit if scene.cells is None else NodeLimit)(body, clock)
        self.remaking = remaking = Remaking(body, clock, self._limit)
        self.tools = Tools(body, clock, offset, self.conditions, remaking.outline)
        self._energy = CellEnergy(body, rough_loss=self.rough_loss, loads=self.loads.work, tools=self.tools.work)
        kind, slots, self._kappa = body.kind, body.slots, corner_share(c)
        self._sharpening = sharpening = Sharpening(body, c, self._numbers)
        self._kick = kick_kernel(space, moves)
        self._strain = strain_kernel(space, kind, body.law.flows)
        self._rate = rate_kernel(space, kind, slots)
        self._stress = stress_kernel(space, kind, body.law, slots=slots, moves=moves, sharp=sharpening.on)
        self._force = force_kernel(space, kind, body.law, sharpening.on)
        self._push = push_kernel(space, kind, slots)
        kernels = [self._kick, self._strain, self._rate, self._stress, self._force, self._push]
        super().__init__(launcher, clock, parts=(self._limit, remaking) if remaking.on else (self._limit,))
        for part in (clock, sharpening, self.loads, self.tools, remaking, self._limit, self._energy):
            kernels += part.kernels
        load_kernels(kernels, device)
        self._limit.refresh()
        self.clock.begin([0.0], 0.0)
        if scene.initial_stress.any():
            self._rates()
            sharpening.undo(scene.initial_stress)
        self.step()  # of no length: what the initial state asks for, and the accelerations it begins with
        self._energy.open()

    @property
    def shrinkage(self) -> float:
        """Least time of a wave across a cell over the initial one, at most 1."""
        return self._limit.shrinkage

    def energy(self) -> Energy:
        """The energy balance since t = 0."""
        return self._energy.now()

    def advance(self, times: Sequence[float], dt: float) -> Outcome:
        """Make a step from each of the times to Δt later, the first step of all alone; see `Stepper.advance`."""
        if self._energy.begun:
            return super().advance(times, dt)
        outcome = super().advance(times[:1], dt)
        self._energy.begin()
        return outcome

    def step(self) -> None:
        """Advance the nodes by the clock's Δt."""
        body, clock, launch = self.body, self.clock, self.body.launcher.launch
        nodes, points, dt, faults = body.nodes, body.nodes.point, clock.time_step, clock.faults
        self._rates()
        inputs = [body.parameters, dt, body.straining, self._sharpening.means, nodes, body.internals]
        inputs += [self._limit.outdated, faults]
        launch(self._stress, points, inputs, gathers=self._sharpening.on)
        self._sharpening.stresses()
        damping, material = body.scene.damping, body.scene.material
        modulus = material.density * material.wave_speed(body.space.dim) ** 2
        inputs = [body.parameters, modulus, dt, body.corners, body.cell_mass, nodes, self._numbers]
        launch(self._force, body.corners, [*inputs, self._forces, self.rough_loss])
        self.loads.add(self._forces)
        inputs = [self.conditions, clock.forces, damping, dt, body.node_cells, self._forces]
        launch(self._push, points, [*inputs, nodes, self.reactions, faults])
        self.tools.settle()
        self.remaking.count()
        clock.tick()

    def _rates(self) -> None:
        """Half a step on, V and L of each node, and the means that sharpen L."""
        body, clock, launch = self.body, self.clock, self.body.launcher.launch
        nodes, points, corners = body.nodes, body.nodes.point, body.corners
        inputs = [self.conditions, body.scene.damping, clock.time_step, nodes]
        launch(self._kick, points, inputs, gathers=False)
        self.tools.stop()
        launch(self._strain, corners, [self._kappa, corners, nodes, self._numbers, clock.faults])
        least_volume = LEAST_VOLUME / body.scene.material.density
        launch(self._rate, points, [least_volume, body.straining, self._numbers, nodes])
        self._sharpening.weigh()


def spacing(mesh: Mesh) -> float:
    """Least 2 c_p/ω_T of the cells [m], see `warpsph.operators.cell_limit`: of a lattice its spacing.

    In space 0.975 of it. ω_T is that of a wave along one direction; a free body two cells thick that is nearly
    incompressible swells along three at once: waves of 3 × 2 × 2 cubes grow from a Courant number of 0.785 on.
    Σ_j ∇N_j ⊗ ∇N_j of a regular cell is alike in every direction: what counts is the least of a cell's stretches.
    """
    kind = mesh.kind
    regular = np.linalg.norm(np.array(kind.gradients) @ np.linalg.inv(kind.regular), 2)
    distance = mesh.smallest_distance()
    if kind.modes:
        bent, bends, gradients = mesh.bent_cells()
        if len(bent):
            share = BENT_SHARE * np.minimum(bends / BENT**2, 1.0)
            more = share**2 * (1.0 + bends) * (gradients**2).sum(axis=(1, 2))
            stretches = mesh.least_stretches()[bent]
            distance = min(distance, (stretches / np.sqrt(1.0 + more * (stretches / regular) ** 2)).min())
    return float((0.975 if mesh.dim == 3 else 1.0) * 2.0 * distance / (np.sqrt(kind.corners) * regular))


COURANT_LIMIT = 0.8  # tests/test_stability.py

CELLS = Scheme(
    name="cells",
    meaning="cells in energy-conjugate form: any cell, any configuration, free edges for nothing",
    stepper=CellStepper,
    kinds=tuple(KINDS.values()),
    spacing=spacing,
    courant_limit=COURANT_LIMIT,
)
