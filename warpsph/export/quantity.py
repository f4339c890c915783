"""A number a node, to be drawn: a scalar field, one component of a field, or the length of a vector field.

Pictures, USD colours and the command line (`--field velocity:y`) name what they show in this one way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..errors import SceneError, one_of
from ..mesh.mesh import Mesh
from ..scene.scene import Scene
from ..simulation.fields import component_names, fields_of
from .frames import Frames


class Snapshot(Protocol):
    """What can be drawn: a frame, or a simulation as it is now."""

    mesh: Mesh
    present_mesh: Mesh
    time: float

    def field(self, name: str) -> np.ndarray:
        """A node field."""


@dataclass(frozen=True)
class Quantity:
    """What is drawn.

    Args:
        field: name of the field.
        unit: its unit.
        component: index of its component; the length of the vector when None.
        part: name of the component, empty for none.
    """

    field: str
    unit: str
    component: int | None = None
    part: str = ""

    def __call__(self, frame: Snapshot) -> np.ndarray:
        """Its values at a frame, shape (n,)."""
        values = frame.field(self.field).astype(float).reshape(len(frame.mesh.nodes), -1)
        return np.linalg.norm(values, axis=1) if self.component is None else values[:, self.component]

    @property
    def name(self) -> str:
        """A name for files: `stress_s12`, `velocity`."""
        return f"{self.field}_{self.part}" if self.part else self.field

    @property
    def label(self) -> str:
        """Name and unit, for axes."""
        return f"{self.name.replace('_', ' ')} [{self.unit}]"


def quantity(text: str | None, frames: Frames) -> Quantity:
    """The quantity a command line names, `FIELD` or `FIELD:COMPONENT`; the scene's own for None.

    Raises:
        SceneError: there is no such field or component.
    """
    continuum = frames.mesh.continuum
    if text is None:
        field, component = frames.about["field"], frames.about["component"]
        parts = component_names(field, continuum)
        if component >= max(1, len(parts)):
            raise SceneError("frames", str(frames.run), f"about.json names a component that {field} lacks")
        return _component(field, frames.unit(field), component, parts)
    field, colon, part = text.partition(":")
    if field not in frames.fields:
        raise SceneError("--field", text, one_of(frames.fields, field))
    parts, unit = component_names(field, continuum), frames.unit(field)
    if part in parts:
        return Quantity(field, unit, parts.index(part), part)
    if not colon and not parts:
        return Quantity(field, unit, 0)
    if not colon and parts == continuum.axes:
        return Quantity(field, unit)
    if not parts:
        raise SceneError("--field", text, f"{field} has no components")
    raise SceneError("--field", text, one_of([f"{field}:{name}" for name in parts], text))


def own_quantity(scene: Scene) -> Quantity:
    """The quantity that a scene asks to be drawn."""
    field, component = scene.output.field, scene.output.component
    return _component(field, fields_of(scene)[field].unit, component, component_names(field, scene.mesh.continuum))


def _component(field: str, unit: str, component: int, parts: tuple[str, ...]) -> Quantity:
    return Quantity(field, unit, component, parts[component] if parts else "")
