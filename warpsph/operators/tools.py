"""Tools (`warpsph.scene.tool`): a body's outer nodes do not pass them, by impulses that need no stiffness.

A step pushes a node twice, half of it before it moves and half after. Each time what the tools do comes last, as
an impulse on the node alone. Before it moves (`stop`): the normal velocity, seen from the tool, is raised to what
brings the node to the surface by the end of the step, −gap/Δt. After (`settle`): that of a node that was stopped,
to zero. So nothing is penetrated but by rounding, nodes at rest are at rest, and their reactions are those of held
nodes. Along the surface the node's velocity is brought to the tool's, by no more than the interface carries:
friction times the normal impulse, and strength times ½Δt and what of the surface is the node's. What a tool at
rest does to a node takes energy or none; where nodes land it is that of the approach of one layer of nodes, less
and less on finer lattices.

A condition on velocities comes first: impulses push a node only in directions in which it is free.
"""

import numpy as np
import warp as wp

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..scene.scene import Scene
from ..scene.tool import TOUCHING
from ..state.cell_body import CellBody
from ..state.clock import Clock
from .contact import NEVER, contact_kernel, contact_types
from .face_shares import FaceShares
from .outline_shares import OutlineShares
from .tool_forms import exact_vector, move_kernel, tool_table

SWEEPS = 16  # over several tools, at most: of a corner of 37° they leave a thousandth of what one leaves


class Tools:
    """The tools of a scene; without any it does nothing.

    Args:
        body: the body.
        clock: drives them.
        offset: where their functions of time begin among the clock's.
        held: the table of the conditions.
        outline: `OutlineArrays` where it changes, or None.

    Attributes:
        work: done by the tools on the body [J], a number a node that may meet them.
        travel: how far each has come [m], float64.
        kernels: what it launches.

    Raises:
        SceneError: a rough tool, and the material's law does not say how strong it is.
    """

    def __init__(self, body: CellBody, clock: Clock, offset: int, held, outline=None):
        scene, space, device = body.scene, body.space, body.launcher.device
        self._body, self._clock, self._held = body, clock, held
        nodes = np.zeros(0, dtype=np.int64)
        if scene.tools:
            nodes = _outer(scene.mesh) if outline is None else np.arange(len(scene.mesh.nodes))
        rows, count, vector = len(nodes), len(scene.tools), space.types.vector
        self._any, self._table = count > 0, tool_table(scene, space, device, offset)
        self._contacts = contacts = contact_types(space)()
        contacts.node = wp.array(nodes, dtype=wp.int32, device=device)
        for name, dtype in (("impulse", vector), ("moment", space.vec(3)), ("total", exact_vector(space))):
            setattr(contacts, name, wp.zeros((rows, count), dtype=dtype, device=device))
        contacts.pressed = wp.full((rows, count), NEVER, dtype=space.real, device=device)
        contacts.last, contacts.settled = (wp.zeros(rows, dtype=vector, device=device) for _ in range(2))
        self.work = contacts.work = wp.zeros(rows, dtype=wp.float64, device=device)
        self.travel = wp.zeros(count, dtype=exact_vector(space), device=device)
        self._touched = wp.array(_glued(scene)[nodes], dtype=wp.int32, shape=(rows, count), device=device)
        self._meeting = wp.full(rows, 1, dtype=wp.int32, device=device)
        self._internals, spare = body.internals, wp.zeros(1, dtype=vector, device=device)
        if self._internals is None:
            self._internals = wp.zeros(1, dtype=space.vec(1), device=device)
        self._shares = None
        if _strong(body):
            self._shares = FaceShares(body) if outline is None else OutlineShares(body, outline)
        self._areas = spare if self._shares is None else self._shares.vectors
        self.kernels = ()
        if self._any:
            kernel = {"strong": self._shares is not None, "sweeps": SWEEPS if count > 1 else 1}
            self._stop = contact_kernel(space, body.law, ends=False, **kernel)
            self._settle = contact_kernel(space, body.law, ends=True, **kernel)
            self._move = move_kernel(space)
            self.kernels = (self._stop, self._move, self._settle)
            self.kernels += () if self._shares is None else self._shares.kernels

    def _inputs(self) -> list:
        body, clock = self._body, self._clock
        inputs = [self._table, self.travel, clock.drive, clock.time_step, self._held, body.scene.damping]
        inputs += [
            body.parameters,
            self._internals,
            self._areas,
            body.nodes,
            self._contacts,
            self._touched,
            self._meeting,
        ]
        return inputs

    def stop(self) -> None:
        """After the first push: let no node pass a tool in this step; the tools move on."""
        if self._any:
            launch, clock = self._body.launcher.launch, self._clock
            if self._shares:
                self._shares.measure()
            launch(self._stop, self.work, self._inputs())
            launch(self._move, self.travel, [self._table, clock.drive, clock.time_step, self.travel])

    def settle(self) -> None:
        """After the second push: let nodes that were stopped move as their tools do."""
        if self._any:
            self._body.launcher.launch(self._settle, self.work, self._inputs())

    def force(self, tool: int) -> np.ndarray:
        """Mean force of the body on a tool in the last step [N], shape (d,)."""
        return self._mean(self._contacts.impulse, tool)

    def torque(self, tool: int) -> np.ndarray:
        """Mean torque of the body on a tool about its middle in the last step [N m], shape (3,)."""
        return self._mean(self._contacts.moment, tool)

    def impulse(self, tool: int) -> np.ndarray:
        """What the body has given a tool since the start [N s], shape (d,)."""
        return 0.0 - self._contacts.total.numpy()[:, tool].sum(axis=0)

    def _mean(self, given: wp.array, tool: int) -> np.ndarray:
        dt = float(self._clock.time_step.numpy()[0])
        total = 0.0 - given.numpy()[:, tool].astype(float).sum(axis=0)
        return total / dt if dt > 0.0 else total


def _outer(mesh: Mesh) -> np.ndarray:
    """Nodes of the cells at the boundary: no others come near a tool, and to look at all nodes takes time."""
    boundary = np.zeros(len(mesh.nodes), dtype=bool)
    boundary[mesh.faces] = True
    return np.unique(mesh.cells[boundary[mesh.cells].any(axis=1)])


def _glued(scene: Scene) -> np.ndarray:
    """Which nodes touch which tools that are glued to them at the start, 1 or 0, shape (n, k)."""
    touched = np.zeros((len(scene.mesh.nodes), len(scene.tools)), dtype=np.int32)
    for t, tool in enumerate(scene.tools):
        if tool.interface.carried.glued:
            gaps = tool.form(scene.mesh.dim).distance(scene.mesh.nodes)
            touched[:, t] = gaps <= TOUCHING * scene.mesh.spacing
    return touched


def _strong(body: CellBody) -> bool:
    """Whether an interface carries shear without pressure."""
    law, strengths = body.law, [tool.interface.carried.strength for tool in body.scene.tools]
    if None in strengths and law.flows and law.shear_strength is None:
        tool, name = body.scene.tools[strengths.index(None)], type(body.scene.material).__name__
        raise SceneError("tools", tool, f"the law of {name} does not say its shear strength; take Adhesive")
    return any(strength != 0.0 for strength in strengths)
