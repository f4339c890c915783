"""What a run records: probes sampled in time, the curve and the field to draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError, one_of
from .selection import Selection
from .validate import instance, number, vector


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
        instance("Probe.function", self.function, Callable, "a function of the simulation")


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
        object.__setattr__(self, "near", vector("NodeValue.near", self.near))

    def __call__(self, simulation) -> float:
        values = simulation.field(self.field)
        node = simulation.nearest_node(self.near)
        return float(values[node] if values.ndim == 1 else values[node, self.component])


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

    def __call__(self, simulation) -> float:
        lattice, continuum = simulation.lattice, simulation.lattice.continuum
        chosen = self.on.nodes(lattice)[lattice.faces].all(axis=1) & self.on.faces(lattice)
        if not chosen.any():
            raise SceneError("EdgeForce.on", self.on, "it must hold all nodes of at least one boundary face")
        current = lattice.with_nodes(simulation.field("position"))
        normals = current.face_normals()[chosen]
        area = face_areas(current.nodes[lattice.faces[chosen]])
        stress = simulation.field("stress")[lattice.faces[chosen]].mean(axis=1)
        traction = np.zeros(len(normals))
        for k, (i, j) in enumerate(continuum.pairs):
            if max(i, j) < continuum.dim:
                if i == self.axis:
                    traction += stress[:, k] * normals[:, j]
                if j == self.axis and i != j:
                    traction += stress[:, k] * normals[:, i]
        return float(-(traction * area).sum())


def face_areas(points: np.ndarray) -> np.ndarray:
    """Area of faces given by their corner positions, shape (f, 1, 2 or 4, d): 1, length, or quadrilateral."""
    if points.shape[1] == 1:
        return np.ones(len(points))
    if points.shape[1] == 2:
        return np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    diagonals = np.cross(points[:, 3] - points[:, 0], points[:, 2] - points[:, 1])
    return 0.5 * np.linalg.norm(diagonals, axis=1)


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
        for probe in self.probes:
            instance("Output.probes", probe, Probe, "a tuple of Probe")
            if probe.name in names:
                raise SceneError("Output.probes", probe.name, f"names must differ, and from {names[:2]}")
            names.append(probe.name)
        if self.interval is not None:
            number("Output.interval", self.interval, at_least=0.0)
        for name in self.curve or ():
            if name not in names:
                raise SceneError("Output.curve", name, one_of(names, name))
