"""Rigid ground and tools: bodies of a simple shape that stand still or move on a path of their own.

A body's boundary nodes do not pass their surfaces (`warpsph.operators.tools`). All of them are boxes grown by a
radius, `Form`: a plane is the upper side of one without end, a sphere has edges of no length.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np

from ..errors import SceneError
from ..validate import TimeFunction, instance, number, time_function, vector
from .interface import Interface, Smooth

NAME = re.compile(r"[^\W\d]\w{0,99}")
ENDLESS = 1e30  # half an edge that never ends [m]
TOUCHING = 1e-6  # spacings: to be so deep in a tool at the start is to touch it


@dataclass(frozen=True)
class Form:
    """A box around `centre`, all of what is nearer to it than `rounding` included.

    Attributes:
        centre: its middle, of a plane a point of it [m], shape (d,).
        axes: unit vectors along its edges, of a plane the normal first, shape (d, d).
        half: half its edges [m], shape (d,).
        rounding: [m].
        plane: whether it is all that lies below the first axis.
        revolved: in space, whether it is a cylinder along the first axis, with a radius of half[1].
    """

    centre: np.ndarray
    axes: np.ndarray
    half: np.ndarray
    rounding: float = 0.0
    plane: bool = False
    revolved: bool = False

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Of points (n, d) from the surface [m], negative inside, shape (n,)."""
        local = (points - self.centre) @ self.axes.T
        if self.plane:
            return local[:, 0] - self.rounding
        if self.revolved:
            local = np.stack([local[:, 0], np.linalg.norm(local[:, 1:], axis=1)], axis=1)
        beyond = np.abs(local) - self.half[: local.shape[1]]
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return outside + np.minimum(beyond.max(axis=1), 0.0) - self.rounding


@dataclass(frozen=True)
class Tool:
    """A rigid body; a subclass says of what shape.

    Args:
        interface: what its surface carries.
        velocity: one entry an axis [m/s], a number or a function of time; at rest unless given.
        name: what probes and pictures call it; that of its shape, in small letters, unless given.
    """

    interface: Interface = field(default_factory=Smooth, kw_only=True)
    velocity: tuple[TimeFunction, ...] | None = field(default=None, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self):
        own = type(self).__name__
        object.__setattr__(self, "name", own.lower() if self.name is None else self.name)
        if not isinstance(self.name, str) or not NAME.fullmatch(self.name):
            allowed = "it must be of letters, digits and _, and begin with a letter"
            raise SceneError(f"{own}.name", self.name, allowed)
        allowed = "an interface such as Smooth() or Coulomb(0.5)"
        instance(f"{own}.interface", self.interface, Interface, allowed)
        if self.velocity is None:
            return
        try:
            parts = tuple(self.velocity)
        except TypeError:
            allowed = "it must be a sequence of numbers or functions of time, one an axis, or None"
            raise SceneError(f"{own}.velocity", self.velocity, allowed) from None
        parts = tuple(time_function(f"{own}.velocity", part) for part in parts)
        object.__setattr__(self, "velocity", parts)

    def form(self, dim: int) -> Form:
        """Its form at the start.

        Raises:
            SceneError: there is no such tool in so many dimensions.
        """
        raise NotImplementedError

    def check(self, dim: int) -> None:
        """Raise `SceneError` when it does not fit `dim` space dimensions."""
        self.form(dim)
        if self.velocity is not None and len(self.velocity) != dim:
            raise SceneError(f"{type(self).__name__}.velocity", self.velocity, f"it needs {dim} components")

    def _point(self, name: str, dim: int) -> np.ndarray:
        return np.array(vector(f"{type(self).__name__}.{name}", getattr(self, name), dim))


@dataclass(frozen=True)
class Plane(Tool):
    """All that lies on one side of a plane: ground, a wall.

    Args:
        point: a point of it [m].
        normal: away from it, towards the body; any vector but zero.

    >>> Plane((0.0, 0.0), (0.0, 2.0)).form(2).distance(np.array([(3.0, 0.5)]))
    array([0.5])
    """

    point: tuple[float, ...]
    normal: tuple[float, ...]

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "point", _place("Plane.point", self.point))
        object.__setattr__(self, "normal", _unit("Plane.normal", self.normal))

    def form(self, dim):
        point, normal = self._point("point", dim), self._point("normal", dim)
        return Form(point, _frame(normal), np.array([0.0] + [ENDLESS] * (dim - 1)), plane=True)


@dataclass(frozen=True)
class Sphere(Tool):
    """A sphere.

    Args:
        centre, radius: [m].
    """

    centre: tuple[float, ...]
    radius: float

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "centre", _place("Sphere.centre", self.centre))
        object.__setattr__(self, "radius", number("Sphere.radius", self.radius, above=0.0, at_most=ENDLESS))

    def form(self, dim):
        if dim != 3:
            raise SceneError("tools", self, "a sphere is for bodies in space; in the plane take Cylinder")
        return Form(self._point("centre", dim), np.eye(dim), np.zeros(dim), self.radius)


@dataclass(frozen=True)
class Cylinder(Tool):
    """A round cylinder: of plane strain one along z, so that it shows as a circle.

    Args:
        centre: its middle [m].
        radius: [m].
        axis: in space, its direction.
        length: in space [m]; without end unless given.
    """

    centre: tuple[float, ...]
    radius: float
    axis: tuple[float, ...] | None = None
    length: float | None = None

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "centre", _place("Cylinder.centre", self.centre))
        object.__setattr__(self, "radius", number("Cylinder.radius", self.radius, above=0.0, at_most=ENDLESS))
        if self.axis is not None:
            object.__setattr__(self, "axis", _unit("Cylinder.axis", self.axis))
        if self.length is not None:
            object.__setattr__(self, "length", number("Cylinder.length", self.length, above=0.0, at_most=ENDLESS))

    def form(self, dim):
        if dim == 1:
            raise SceneError("tools", self, "a cylinder is for bodies in the plane or in space; take Plane")
        centre = self._point("centre", dim)
        if dim == 2:
            for name in ("axis", "length"):
                if getattr(self, name) is not None:
                    allowed = "in the plane it lies along z and has no end; leave it out"
                    raise SceneError(f"Cylinder.{name}", getattr(self, name), allowed)
            return Form(centre, np.eye(2), np.zeros(2), self.radius)
        if self.axis is None:
            raise SceneError("Cylinder.axis", None, "in space it needs one")
        axes = _frame(self._point("axis", dim))
        if self.length is None:
            return Form(centre, axes, np.array([ENDLESS, 0.0, 0.0]), self.radius)
        return Form(centre, axes, np.array([0.5 * self.length, self.radius, self.radius]), revolved=True)


@dataclass(frozen=True)
class Block(Tool):
    """A block with edges along the axes, or turned.

    Args:
        centre: its middle [m].
        size: its edges [m], one number an axis.
        angle: by which it is turned in the x-y plane about its middle, anticlockwise [rad].
        rounding: radius of its edges [m], within its size.
    """

    centre: tuple[float, ...]
    size: tuple[float, ...]
    angle: float = 0.0
    rounding: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "centre", _place("Block.centre", self.centre))
        object.__setattr__(self, "size", _place("Block.size", self.size))
        for part in self.size:
            number("Block.size", part, above=0.0)
        object.__setattr__(self, "angle", number("Block.angle", self.angle))
        most = 0.5 * min(self.size)
        object.__setattr__(self, "rounding", number("Block.rounding", self.rounding, at_least=0.0, at_most=most))

    def form(self, dim):
        centre, size = self._point("centre", dim), self._point("size", dim)
        axes = np.eye(dim)
        if dim == 1 and self.angle:
            raise SceneError("Block.angle", self.angle, "a bar has nothing to turn")
        if dim > 1:
            cos, sin = math.cos(self.angle), math.sin(self.angle)
            axes[:2, :2] = [[cos, sin], [-sin, cos]]
        return Form(centre, axes, 0.5 * size - self.rounding, self.rounding)


def _place(name: str, given: object) -> tuple[float, ...]:
    """Lengths [m] whose squares are numbers."""
    return tuple(number(name, part, at_least=-ENDLESS, at_most=ENDLESS) for part in vector(name, given))


def _unit(name: str, given: object) -> tuple[float, ...]:
    parts = vector(name, given)
    length = math.hypot(*parts)
    if length == 0.0:
        raise SceneError(name, parts, "it must not be the zero vector")
    return tuple(part / length for part in parts)


def _frame(first: np.ndarray) -> np.ndarray:
    """Right-handed unit vectors of which the first is given, one a row, shape (d, d)."""
    dim = len(first)
    if dim == 1:
        return first[None]
    if dim == 2:
        return np.array([first, [-first[1], first[0]]])
    second = np.cross(first, np.eye(3)[np.abs(first).argmin()])
    second /= np.linalg.norm(second)
    return np.array([first, second, np.cross(first, second)])
