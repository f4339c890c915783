"""What a run records: probes sampled in time, the curve and the field to draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..validate import choice, index, instance, listed, number, vector
from .place import node_at
from .selection import Selection

if TYPE_CHECKING:
    from .scene import Scene
ENERGY_COLUMN = "energy."  # how names of a history's energies begin


@dataclass(frozen=True)
class Probe:
    """A number sampled during a run.

    Args:
        name: column name in the history.
        unit: its unit.
        function: called with the simulation, returns the number.
    """

    name: str
    unit: str
    function: Callable[[object], float]

    def __post_init__(self):
        instance("Probe.name", self.name, str, "a name")
        instance("Probe.unit", self.unit, str, "a unit, for example 'Pa'")
        instance("Probe.function", self.function, Callable, "a function of the simulation")

    def sample(self, simulation) -> float:
        """The number as it is now; NaN where it is not defined.

        Raises:
            SceneError: what the function returns is no real number.
        """
        value = self.function(simulation)
        if not isinstance(value, Real | np.bool_):
            allowed = (
                f"its function must return a real number; at t = {simulation.time:.6g} s it gave {value!r:.60}"
            )
            raise SceneError("Output.probes", self.name, allowed)
        return float(value)

    def check(self, scene: Scene) -> None:
        """Raise `SceneError` when a function of ours asks for something that the scene does not have."""
        if isinstance(self.function, NodeValue | EdgeForce | Reaction | ToolForce | ToolTorque):
            self.function.check(scene)


@dataclass(frozen=True)
class NodeValue:
    """Value of one component of a field at the node that is initially nearest to a point.

    Args:
        field: name of a node field, e.g. `velocity`.
        near: the point [m].
        component: index of the component (0 for a scalar field).
    """

    field: str
    near: tuple[float, ...]
    component: int = 0

    def __post_init__(self):
        instance("NodeValue.field", self.field, str, "the name of a field")
        object.__setattr__(self, "near", vector("NodeValue.near", self.near))
        index("NodeValue.component", self.component)

    def check(self, scene: Scene) -> None:
        """Raise `SceneError` when the point is not in the body, to within a cell."""
        node_at("NodeValue.near", self.near, scene.mesh)

    def __call__(self, simulation) -> float:
        values = component("NodeValue", simulation.field(self.field), self.component)
        return float(values[simulation.nearest_node(self.near)])


def component(owner: str, values: np.ndarray, which: int) -> np.ndarray:
    """One component (n,) of the values (n, …) of a field; a tensor's are counted row by row."""
    parts = values.reshape(len(values), -1)
    return parts[:, index(f"{owner}.component", which, below=parts.shape[1])]


@dataclass(frozen=True)
class EdgeForce:
    """Force that the body exerts on its surroundings through boundary faces: −∫ σ n dA along an axis.

    The trapezoidal rule over what the selected nodes span of each face, in the current configuration: a whole
    face, or the triangle of three corners of a face that has four; [N] in 3D, [N/m] in plane strain. A compressed
    top edge gives a positive force along +y. It is made of the nodes' stresses, and so knows no more than they do
    of what is between the last selected node and the next one; what balances the loads exactly is `Reaction`.

    Args:
        on: the nodes.
        axis: component, counted from 0.
    """

    on: Selection
    axis: int

    def __post_init__(self):
        instance("EdgeForce.on", self.on, Selection, "a selection such as edge('top')")
        index("EdgeForce.axis", self.axis)

    def check(self, scene: Scene) -> None:
        """Raise `SceneError` when the mesh has no such axis, or the selection none of its boundary faces."""
        index("EdgeForce.axis", self.axis, below=scene.mesh.dim)
        if not any(len(parts) for _, parts in self._parts(scene.mesh)):
            raise SceneError("EdgeForce.on", self.on, "it must hold all nodes of at least one boundary face")

    def _parts(self, mesh: Mesh) -> list[tuple[np.ndarray, np.ndarray]]:
        """Faces, shape (k,), and the nodes of what is selected of them, shape (k, c), for each number c."""
        inside, allowed = self.on.nodes(mesh)[mesh.faces], self.on.faces(mesh)
        count, size = inside.sum(axis=1), mesh.faces.shape[1]
        whole = np.flatnonzero(allowed & (count == size))
        parts = [(whole, mesh.faces[whole])]
        if size > mesh.dim:
            cut = np.flatnonzero(allowed & (count == size - 1))
            parts.append((cut, mesh.faces[cut][inside[cut]].reshape(-1, size - 1)))
        return parts

    def __call__(self, simulation) -> float:
        self.check(simulation.scene)
        mesh, continuum = simulation.mesh, simulation.mesh.continuum
        current, stress = mesh.with_nodes(simulation.field("position")), simulation.field("stress")
        areas, normals, force = current.face_areas(), current.face_normals(), 0.0
        for faces, nodes in self._parts(mesh):
            part = stress[nodes].mean(axis=1)
            area = areas[faces] if nodes.shape[1] == mesh.faces.shape[1] else _triangles(current.nodes[nodes])
            traction = np.zeros(len(faces))
            for k, (i, j) in enumerate(continuum.pairs):
                if max(i, j) < continuum.dim:
                    if i == self.axis:
                        traction += part[:, k] * normals[faces, j]
                    if j == self.axis and i != j:
                        traction += part[:, k] * normals[faces, i]
            force -= (traction * area).sum()
        return float(force)


def _triangles(points: np.ndarray) -> np.ndarray:
    """Areas of triangles with corners (k, 3, 3), shape (k,)."""
    return 0.5 * np.linalg.norm(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1)


@dataclass(frozen=True)
class Reaction:
    """Force that the body exerts on the conditions that hold or move its nodes, along an axis: what they take up.

    It is exact: at rest the reactions of all conditions, the loads and the weight add up to nothing. As that of
    `EdgeForce` it is positive along +y on a top that is pressed; a base that carries a body gives minus its
    weight. [N] in 3D, [N/m] in plane strain. Beside the last node of a rigid footing a part of
    first order is too much: it moves what is beside it as well.

    Args:
        on: the nodes; those that no condition moves add nothing.
        axis: component, counted from 0.
    """

    on: Selection
    axis: int

    def __post_init__(self):
        instance("Reaction.on", self.on, Selection, "a selection such as edge('bottom')")
        index("Reaction.axis", self.axis)

    def check(self, scene: Scene) -> None:
        """Raise `SceneError` without such an axis, a node that a condition moves, or forces on nodes at all."""
        index("Reaction.axis", self.axis, below=scene.mesh.dim)
        scheme = scene.numerics.scheme
        if not scheme.nodal_forces:
            allowed = f"velocity_scheme {scheme.name} has no forces on nodes; take EdgeForce"
            raise SceneError("Reaction", self, allowed)
        if not self._rows(scene).any():
            raise SceneError("Reaction.on", self.on, "it must hold a node that a condition holds or moves")

    def _rows(self, scene: Scene) -> np.ndarray:
        boundary = scene.boundary
        return boundary.moved & self.on.nodes(scene.mesh)[boundary.nodes]

    def __call__(self, simulation) -> float:
        self.check(simulation.scene)
        reactions = simulation.stepper.reactions.numpy()
        return float(
            -reactions[: len(simulation.scene.boundary.nodes)][self._rows(simulation.scene), self.axis].sum()
        )


@dataclass(frozen=True)
class ToolForce:
    """Force of the body on a tool along an axis, the mean of the last step: [N] in 3D, [N/m] in plane strain.

    What tools get, the body's momentum lacks, to rounding. Ground that carries a body gets its weight, downwards.

    Args:
        tool: its name.
        axis: component, counted from 0.
    """

    tool: str
    axis: int

    def __post_init__(self):
        _check_tool_probe(self)

    def check(self, scene: Scene) -> None:
        """Raise `SceneError` when there is no such tool or axis."""
        _tool_number(self, scene)
        index(f"{type(self).__name__}.axis", self.axis, below=scene.mesh.dim)

    def __call__(self, simulation) -> float:
        return float(simulation.stepper.tools.force(_tool_number(self, simulation.scene))[self.axis])


@dataclass(frozen=True)
class ToolImpulse(ToolForce):
    """What the body has given a tool along an axis since the start [N s], in plane strain [N s/m].

    Its differences are mean forces between samples, where `ToolForce` sees the last step alone.
    """

    def __call__(self, simulation) -> float:
        return float(simulation.stepper.tools.impulse(_tool_number(self, simulation.scene))[self.axis])


@dataclass(frozen=True)
class ToolTorque:
    """Torque of the body on a tool, the mean of the last step: [N m] in 3D, [N] in plane strain.

    Args:
        tool: its name.
        axis: about x (0), y (1) or z (2), in plane strain z alone, through the tool's middle; of a `Plane` through
            its point that is nearest to the middle of the body at the start.
    """

    tool: str
    axis: int = 2

    def __post_init__(self):
        _check_tool_probe(self)

    def check(self, scene: Scene) -> None:
        """Raise `SceneError` when there is no such tool or axis."""
        _tool_number(self, scene)
        if scene.mesh.dim < 3 and not (scene.mesh.dim == 2 and self.axis == 2):
            raise SceneError("ToolTorque.axis", self.axis, "in the plane it must be 2, and a bar has no torques")
        index("ToolTorque.axis", self.axis, below=3)

    def __call__(self, simulation) -> float:
        return float(simulation.stepper.tools.torque(_tool_number(self, simulation.scene))[self.axis])


def _check_tool_probe(probe: ToolForce | ToolTorque) -> None:
    own = type(probe).__name__
    instance(f"{own}.tool", probe.tool, str, "the name of a tool")
    index(f"{own}.axis", probe.axis)


def _tool_number(probe: ToolForce | ToolTorque, scene: Scene) -> int:
    names = [tool.name for tool in scene.tools]
    return names.index(choice(f"{type(probe).__name__}.tool", probe.tool, names))


@dataclass(frozen=True, kw_only=True)
class Output:
    """What a run records and draws.

    Args:
        probes: the columns of the history, besides step and time.
        interval: simulated time between samples [s]; every step when 0; duration/400 unless given.
        curve: names of the probes on the x and y axis of the history plot (`time` is one too); the first probe
            against time unless given.
        curve_reference: a label and a value to draw as a line across that plot.
        field: node field to draw at the end.
        component: component of that field.
    """

    probes: tuple[Probe, ...] = ()
    interval: float | None = None
    curve: tuple[str, str] | None = None
    curve_reference: tuple[str, float] | None = None
    field: str = "velocity"
    component: int = 0

    def __post_init__(self):
        names = ["step", "time"]
        object.__setattr__(self, "probes", listed("Output.probes", self.probes, Probe, "a sequence of Probe"))
        for probe in self.probes:
            if probe.name in names or probe.name.startswith(ENERGY_COLUMN):
                allowed = f"names must differ, and from {names[:2]} and those of energies, {ENERGY_COLUMN}…"
                raise SceneError("Output.probes", probe.name, allowed)
            names.append(probe.name)
        if self.interval is not None:
            number("Output.interval", self.interval, at_least=0.0)
        if self.curve is not None:
            for name in _pair("Output.curve", self.curve, "the names of two probes"):
                choice("Output.curve", name, names)
        if self.curve_reference is not None:
            label, value = _pair("Output.curve_reference", self.curve_reference, "a label and a value")
            instance("Output.curve_reference", label, str, "a label and a value")
            number("Output.curve_reference", value)
        instance("Output.field", self.field, str, "the name of a field")
        index("Output.component", self.component)

    def check(self, scene: Scene) -> None:
        """Raise `SceneError` when it does not fit the scene."""
        if self.interval is not None:
            number("Output.interval", self.interval, at_most=scene.duration)
        for probe in self.probes:
            probe.check(scene)


def _pair(field: str, value: object, allowed: str) -> tuple[object, object]:
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise SceneError(field, value, f"it must be {allowed}")
    return value[0], value[1]
