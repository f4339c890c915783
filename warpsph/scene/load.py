"""Loads on boundary faces: tractions and pressures, functions of place times a function of time.

A load acts on the boundary faces whose nodes are all selected, each face on its own nodes. With the scheme `cells`
it is a force on nodes (`warpsph.scene.face_loads`); the published schemes prescribe stresses of the edge's nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..mesh.reentrant import reentrant_nodes
from ..validate import TimeFunction, field_of_position, flag, number, time_function, vector
from .condition import Condition
from .functions import Linear, Pulse, Ramp, Table

PlaceFunction = Callable[..., Sequence | float]


@dataclass(frozen=True)
class Load(Condition):
    """What tractions and pressures have in common: the faces under it are free but for the load."""

    @property
    def takes_normal(self):
        return True

    @property
    def unmoved(self):
        return True

    @property
    def turns(self) -> bool:
        """Whether its direction turns with the faces."""
        return False

    def nodes(self, mesh):
        return self.on.nodes(mesh) & ~reentrant_nodes(mesh)

    def rows(self, points, normal):
        return []

    def values(self, points: np.ndarray) -> np.ndarray:
        """Traction vector and pressure [Pa] at initial positions (k, d), shape (k, d + 1), to be scaled in time.

        Raises:
            SceneError: it does not fit the dimension, or a function gives what is no finite number.
        """
        raise NotImplementedError

    def check_faces(self, field: str, mesh: Mesh) -> None:
        """Raise `SceneError` when it selects nodes inside the body, or of no boundary face all nodes."""
        if not self.faces(mesh).any():
            raise SceneError(field, self, "it must hold all nodes of at least one boundary face")
        inside = self.on.nodes(mesh).copy()
        inside[mesh.faces[self.on.faces(mesh)]] = False
        if inside.any():
            node = int(inside.argmax())
            at = tuple(mesh.nodes[node].tolist())
            raise SceneError(field, self, f"node {node} at {at} lies on no boundary face, which alone are loaded")


@dataclass(frozen=True)
class Traction(Load):
    """A load whose direction in space stays: σ n = traction · factor(t) on the faces.

    Args:
        on: the nodes; faces whose nodes are all selected are loaded.
        traction: force on a unit of area [Pa], one number an axis, or a function of the initial position
            f(x, y, …) → one part an axis.
        factor: a number or a function of time, e.g. `Ramp(1.0)`.
        follows: whether areas are the present ones; if not, the initial ones, and the forces stay as the body
            deforms.

    >>> from warpsph import Ramp, edge
    >>> Traction(edge("top"), (0.0, -1e3), Ramp(0.5)).traction
    (0.0, -1000.0)
    """

    traction: tuple[float, ...] | PlaceFunction
    factor: TimeFunction = 1.0
    follows: bool = True

    def __post_init__(self):
        super().__post_init__()
        if not callable(self.traction):
            object.__setattr__(self, "traction", vector("Traction.traction", self.traction))
        _check_common(self, "traction")

    def check(self, dim):
        if not callable(self.traction) and len(self.traction) != dim:
            raise SceneError("Traction.traction", self.traction, f"it needs {dim} components")

    def values(self, points):
        dim = points.shape[1]
        result = np.zeros((len(points), dim + 1))
        if callable(self.traction):
            result[:, :dim] = field_of_position("Traction.traction", self.traction, points, dim)
        else:
            result[:, :dim] = self.traction
        return result

    def tractions(self, points, normal):
        return [(self.values(points)[:, :-1], self.factor)]


@dataclass(frozen=True)
class Pressure(Load):
    """A pressure: σ n = −pressure · factor(t) · n on the faces, compression positive.

    Args:
        on: the nodes; faces whose nodes are all selected are loaded.
        pressure: [Pa], a number or a function of the initial position f(x, y, …).
        factor: a number or a function of time, e.g. `Ramp(1.0)`.
        follows: whether it acts along the present normals on the present areas; if not, on the initial ones.

    >>> from warpsph import edge
    >>> Pressure(edge("left"), lambda x, y: 9.81e3 * (2.0 - y)).follows
    True
    """

    pressure: float | PlaceFunction
    factor: TimeFunction = 1.0
    follows: bool = True

    def __post_init__(self):
        super().__post_init__()
        if not callable(self.pressure):
            if not isinstance(self.pressure, Real):
                allowed = "it must be a finite number or a function of position f(x, …)"
                raise SceneError("Pressure.pressure", self.pressure, allowed)
            object.__setattr__(self, "pressure", number("Pressure.pressure", self.pressure))
        _check_common(self, "pressure")

    @property
    def turns(self):
        return self.follows

    def values(self, points):
        result = np.zeros((len(points), points.shape[1] + 1))
        if callable(self.pressure):
            result[:, -1:] = field_of_position("Pressure.pressure", self.pressure, points, 1)
        else:
            result[:, -1] = self.pressure
        return result

    def tractions(self, points, normal):
        return [(-self.values(points)[:, -1:] * normal, self.factor)]


def _check_common(load: Traction | Pressure, place: str) -> None:
    name, given = type(load).__name__, getattr(load, place)
    if isinstance(given, Linear | Ramp | Pulse | Table):
        raise SceneError(f"{name}.{place}", given, "it must not be a function of time; that is what factor takes")
    object.__setattr__(load, "factor", time_function(f"{name}.factor", load.factor))
    flag(f"{name}.follows", load.follows)
