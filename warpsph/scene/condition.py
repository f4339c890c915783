"""Boundary conditions on selections of nodes.

Every condition prescribes, direction by direction, either the velocity (`rows`) or the traction (`tractions`, zero
unless it says so). A `Free` edge prescribes all tractions; `Fixed` all velocities (zero); a `Roller` the normal
velocity and the tangential tractions (both zero); `PrescribedVelocity` the velocity components it is given, and
zero traction along the others. What happens where conditions meet is in `warpsph.scene.resolve`, how to add one in
docs/conditions.md. Loads are in `warpsph.scene.load`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..mesh.reentrant import reentrant_nodes
from ..validate import TimeFunction, instance, number, time_function, vector
from .selection import Selection

# One prescribed direction at every selected node: the unit vectors (k, d), and the target velocity along them
# as a sum of terms, each a coefficient a node (k,) times a function of time.
Row = tuple[np.ndarray, list[tuple[np.ndarray, TimeFunction]]]
# A part of the traction on a face: a vector a node (k, d) times a function of time.
Term = tuple[np.ndarray, TimeFunction]


@dataclass(frozen=True)
class Condition:
    """A condition on the nodes of a selection."""

    on: Selection

    def __post_init__(self):
        instance(f"{type(self).__name__}.on", self.on, Selection, "a selection such as edge('top')")

    @property
    def takes_normal(self) -> bool:
        """Whether the condition has no meaning without an outward normal."""
        return False

    @property
    def unmoved(self) -> bool:
        """Whether it prescribes tractions only, and leaves where nodes go to others."""
        return False

    @property
    def rigid(self) -> bool:
        """Whether its nodes move as one rigid body does."""
        return False

    def nodes(self, mesh: Mesh) -> np.ndarray:
        """Which nodes the condition holds at, boolean, shape (n,)."""
        return self.on.nodes(mesh)

    def faces(self, mesh: Mesh) -> np.ndarray:
        """Which boundary faces it covers, boolean, shape (f,): those selected with all of their nodes."""
        return self.on.faces(mesh) & self.on.nodes(mesh)[mesh.faces].all(axis=1)

    def rows(self, points: np.ndarray, normal: np.ndarray | None) -> list[Row]:
        """Prescribed velocity directions at nodes that share one outward normal.

        Args:
            points: initial positions of the nodes [m], shape (k, d).
            normal: one of the nodes' outward normals, shape (d,), or None when they have none.
        """
        raise NotImplementedError

    def tractions(self, points: np.ndarray, normal: np.ndarray) -> list[Term]:
        """Prescribed traction σ n [Pa] at nodes that share one outward normal, a sum of terms; zero without any.

        It is a force on the present area, whose direction in space stays when the face turns. It is prescribed
        along the directions in which no condition prescribes the velocity.

        Args:
            points: initial positions of the nodes [m], shape (k, d).
            normal: their outward normal n, shape (d,).
        """
        return []

    def check(self, dim: int) -> None:
        """Raise `SceneError` when the condition does not fit `dim` space dimensions."""


@dataclass(frozen=True)
class Fixed(Condition):
    """No motion: v = 0."""

    @property
    def rigid(self):
        return True

    def rows(self, points, normal):
        return [(_axis(points, axis), []) for axis in range(points.shape[1])]


@dataclass(frozen=True)
class EdgeCondition(Condition):
    """A condition that needs an outward normal: that of the boundary faces unless given."""

    normal: tuple[float, ...] | None = None

    def __post_init__(self):
        super().__post_init__()
        _store_unit(self, "normal")

    @property
    def takes_normal(self) -> bool:
        return True

    def check(self, dim):
        _check_unit(self, "normal", dim)


@dataclass(frozen=True)
class Roller(EdgeCondition):
    """A frictionless wall at rest: no normal velocity, no tangential traction.

    Args:
        on: the nodes.
        normal: the wall's normal; that of the boundary faces unless given.
    """

    def rows(self, points, normal):
        return [(np.broadcast_to(normal, points.shape), [])]


@dataclass(frozen=True)
class PrescribedVelocity(Condition):
    """Given velocity components; along the components left out (None) the traction is zero.

    Args:
        on: the nodes.
        velocity: one entry an axis [m/s]: a number, a function of time f(t), or None. For example
            `(None, Linear(-3e-3))` presses a smooth rigid footing downwards. With `along` one number or function.
        normal: the face's normal, for the tractions; that of the boundary faces unless given.
        along: the only direction in which the velocity is given, any vector but zero: a smooth footing that
            leans, `PrescribedVelocity(on, Linear(-3e-3), along=(1.0, 2.0))`.
    """

    velocity: tuple[TimeFunction | None, ...] | TimeFunction = ()
    normal: tuple[float, ...] | None = None
    along: tuple[float, ...] | None = None

    def __post_init__(self):
        super().__post_init__()
        _store_unit(self, "normal")
        _store_unit(self, "along")
        if self.along is not None:
            speed = time_function("PrescribedVelocity.velocity", self.velocity)
            object.__setattr__(self, "velocity", speed)
            return
        allowed = (
            "it must be a sequence of numbers, functions of time or None, one an axis, not all None; "
            "a single one needs along"
        )
        try:
            velocity = tuple(self.velocity)
        except TypeError:
            raise SceneError("PrescribedVelocity.velocity", self.velocity, allowed) from None
        if all(value is None for value in velocity):
            raise SceneError("PrescribedVelocity.velocity", velocity, allowed)
        object.__setattr__(
            self,
            "velocity",
            tuple(
                None if value is None else time_function("PrescribedVelocity.velocity", value)
                for value in velocity
            ),
        )

    @property
    def rigid(self):
        return self.along is None and None not in self.velocity

    def rows(self, points, normal):
        one = np.ones(len(points))
        if self.along is not None:
            return [(np.broadcast_to(self.along, points.shape), [(one, self.velocity)])]
        return [
            (_axis(points, axis), [(one, value)]) for axis, value in enumerate(self.velocity) if value is not None
        ]

    def check(self, dim):
        if self.along is None and len(self.velocity) != dim:
            raise SceneError("PrescribedVelocity.velocity", self.velocity, f"it needs {dim} components")
        _check_unit(self, "along", dim)
        _check_unit(self, "normal", dim)


@dataclass(frozen=True)
class Rotating(Condition):
    """Rigid rotation at a constant rate about an axis along z: the node moves on its own circle.

    Args:
        on: the nodes.
        angular_velocity: Ω [rad/s], anticlockwise.
        centre: centre of the circle (x, y) [m].
    """

    angular_velocity: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)

    @property
    def rigid(self):
        return True

    def __post_init__(self):
        super().__post_init__()
        rate = number("Rotating.angular_velocity", self.angular_velocity)
        object.__setattr__(self, "angular_velocity", rate)
        object.__setattr__(self, "centre", vector("Rotating.centre", self.centre, 2))

    def rows(self, points, normal):
        rate = self.angular_velocity
        x, y = (points[:, :2] - np.array(self.centre)).T
        cos, sin = Cosine(rate), Sine(rate)
        rows = [
            (_axis(points, 0), [(-rate * y, cos), (-rate * x, sin)]),
            (_axis(points, 1), [(rate * x, cos), (-rate * y, sin)]),
        ]
        return rows + [(_axis(points, axis), []) for axis in range(2, points.shape[1])]

    def check(self, dim):
        if dim == 1:
            raise SceneError("conditions", self, "Rotating needs a plane or a solid")


@dataclass(frozen=True)
class Free(EdgeCondition):
    """A traction-free edge: σ n = 0. Nobody moves it; a subclass may load it by its `tractions`.

    Where the edge turns inwards, as in the corner of a notch or of a step, the node has more than half a space of
    material around it and keeps its stress: both of its normals would take all of that away.

    Args:
        on: the nodes.
        normal: the edge's normal; that of the boundary faces unless given.
    """

    @property
    def unmoved(self):
        return True

    def nodes(self, mesh):
        nodes = self.on.nodes(mesh)
        return nodes & ~reentrant_nodes(mesh) if self.normal is None else nodes

    def rows(self, points, normal):
        return []


@dataclass(frozen=True)
class Cosine:
    """f(t) = cos(rate · t)."""

    rate: float

    def __call__(self, t: float) -> float:
        return math.cos(self.rate * t)


@dataclass(frozen=True)
class Sine:
    """f(t) = sin(rate · t)."""

    rate: float

    def __call__(self, t: float) -> float:
        return math.sin(self.rate * t)


def _axis(points: np.ndarray, axis: int) -> np.ndarray:
    return np.broadcast_to(np.eye(points.shape[1])[axis], points.shape)


def _store_unit(condition: EdgeCondition | PrescribedVelocity, field: str) -> None:
    """Make the vector in a field, unless that is None, one of length 1."""
    given, name = getattr(condition, field), f"{type(condition).__name__}.{field}"
    if given is None:
        return
    parts = vector(name, given)
    length = math.hypot(*parts)
    if length == 0.0:
        raise SceneError(name, parts, "it must not be the zero vector")
    object.__setattr__(condition, field, tuple(part / length for part in parts))


def _check_unit(condition: EdgeCondition | PrescribedVelocity, field: str, dim: int) -> None:
    given = getattr(condition, field)
    if given is not None and len(given) != dim:
        raise SceneError(f"{type(condition).__name__}.{field}", given, f"it needs {dim} components")
