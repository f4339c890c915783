"""A number a node to be drawn: a scalar field, a component, or the length of a vector field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SceneError, one_of
from ..simulation.fields import component_names
from .frames import Frame, Frames


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

    def __call__(self, frame: Frame) -> np.ndarray:
        """Its values at a frame, shape (n,)."""
        values = frame.field(self.field).reshape(len(frame.mesh.nodes), -1)
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
    continuum, about = frames.mesh.continuum, frames.about
    if text is None:
        parts = component_names(about["field"], continuum)
        if about["component"] >= max(1, len(parts)):
            raise SceneError(
                "frames", str(frames.run), f"about.json names a component that {about['field']} lacks"
            )
        part = parts[about["component"]] if parts else ""
        return Quantity(about["field"], frames.unit(about["field"]), about["component"], part)
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
