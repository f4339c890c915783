"""What a run records: probes sampled in time, the curve and the field to draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..validate import choice, index, instance, listed, number, vector
from .place import node_at
from .selection import Selection

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

    def check(self, mesh: Mesh) -> None:
        """Raise `SceneError` when a function of ours asks for something that the mesh does not have."""
        if isinstance(self.function, NodeValue | EdgeForce):
            self.function.check(mesh)


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

    def check(self, mesh: Mesh) -> None:
        """Raise `SceneError` when the point is not in the body, to within a cell."""
        node_at("NodeValue.near", self.near, mesh)

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

    The trapezoidal rule over the faces whose nodes are all selected, in the current configuration; [N] in 3D,
    [N/m] in plane strain. A compressed top edge gives a positive force along +y.

    Args:
        on: the nodes.
        axis: component, counted from 0.
    """

    on: Selection
    axis: int

    def __post_init__(self):
        instance("EdgeForce.on", self.on, Selection, "a selection such as edge('top')")
        index("EdgeForce.axis", self.axis)

    def check(self, mesh: Mesh) -> None:
        """Raise `SceneError` when the mesh has no such axis, or the selection none of its boundary faces."""
        index("EdgeForce.axis", self.axis, below=mesh.dim)
        if not self._faces(mesh).any():
            raise SceneError("EdgeForce.on", self.on, "it must hold all nodes of at least one boundary face")

    def _faces(self, mesh: Mesh) -> np.ndarray:
        return self.on.nodes(mesh)[mesh.faces].all(axis=1) & self.on.faces(mesh)

    def __call__(self, simulation) -> float:
        mesh, continuum = simulation.mesh, simulation.mesh.continuum
        self.check(mesh)
        chosen = self._faces(mesh)
        current = mesh.with_nodes(simulation.field("position"))
        normals = current.face_normals()[chosen]
        area = current.face_areas()[chosen]
        stress = simulation.field("stress")[mesh.faces[chosen]].mean(axis=1)
        traction = np.zeros(len(normals))
        for k, (i, j) in enumerate(continuum.pairs):
            if max(i, j) < continuum.dim:
                if i == self.axis:
                    traction += stress[:, k] * normals[:, j]
                if j == self.axis and i != j:
                    traction += stress[:, k] * normals[:, i]
        return float(-(traction * area).sum())


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

    def check(self, mesh: Mesh, duration: float) -> None:
        """Raise `SceneError` when it does not fit the mesh or the duration [s]."""
        if self.interval is not None:
            number("Output.interval", self.interval, at_most=duration)
        for probe in self.probes:
            probe.check(mesh)


def _pair(field: str, value: object, allowed: str) -> tuple[object, object]:
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise SceneError(field, value, f"it must be {allowed}")
    return value[0], value[1]
