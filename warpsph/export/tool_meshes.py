"""Rigid tools as meshes, to be drawn: they keep their shape, and move as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.mesh import Mesh
from ..scene.scene import Scene
from ..scene.tool import ENDLESS, Form
from ..simulation.simulation import Simulation

AROUND = 48  # corners of what is round, a multiple of four
REACH = 3.0  # sizes of the body: how far what has no end is drawn
DEPTH = 0.05  # sizes of the body: how thick a plane is drawn


@dataclass(frozen=True)
class ToolMesh:
    """A tool at one time.

    Attributes:
        name: that of the tool.
        points: [m], shape (p, 3). In the plane the outline is there twice, in front and behind.
        polygons: indices of points, anticlockwise from outside, shape (q, 4).
    """

    name: str
    points: np.ndarray
    polygons: np.ndarray

    @property
    def outline(self) -> np.ndarray:
        """Of a tool of the plane, the points around it [m], shape (p/2, 2)."""
        return self.points[: len(self.points) // 2, :2]

    def moved(self, travel: np.ndarray) -> ToolMesh:
        """The same a way (d,) further on [m]."""
        points = self.points.copy()
        points[:, : len(travel)] += travel
        return ToolMesh(self.name, points, self.polygons)


def tool_meshes(scene: Scene) -> tuple[ToolMesh, ...]:
    """The tools of a scene at the start."""
    mesh = scene.mesh
    return tuple(ToolMesh(tool.name, *_mesh(tool.form(mesh.dim), mesh)) for tool in scene.tools)


def tools_now(simulation: Simulation) -> tuple[ToolMesh, ...]:
    """The tools of a simulation where they are."""
    meshes = tool_meshes(simulation.scene)
    travel = simulation.stepper.tools.travel.numpy() if meshes else ()
    return tuple(mesh.moved(way) for mesh, way in zip(meshes, travel, strict=True))


def _mesh(form: Form, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    size = float(np.ptp(mesh.nodes, axis=0).max())
    if mesh.dim < 3:
        ring = _bar(form, size) if mesh.dim == 1 else _outline(form, mesh, size)
        return _prism(ring, mesh.spacing if mesh.dim == 2 else DEPTH * size)
    centre, half = _where(form, mesh, size)
    if form.plane:
        local, polygons = _brick(np.array([0.5 * DEPTH * size, REACH * size, REACH * size]))
        local[:, 0] -= 0.5 * DEPTH * size
    elif form.revolved or half[0] > 0.0 == half[1]:
        local, polygons = _cylinder(half[0], half[1] + form.rounding)
    elif half.any():
        local, polygons = _brick(half + form.rounding)
    else:
        local, polygons = _sphere(form.rounding)
    return centre + local @ form.axes, polygons


def _where(form: Form, mesh: Mesh, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Its middle, of what has no end near the body, and half its edges, as they are drawn [m]."""
    way = mesh.middle - form.centre
    endless = form.half >= ENDLESS
    along = form.axes[endless]
    return form.centre + (along @ way) @ along, np.where(endless, REACH * size, form.half)


def _bar(form: Form, size: float) -> np.ndarray:
    """The outline of a tool that a bar meets, as wide as high, shape (r, 2)."""
    thick = DEPTH * size
    low, high = (-thick, 0.0) if form.plane else (-form.half[0] - form.rounding, form.half[0] + form.rounding)
    ends = form.centre[0] + form.axes[0, 0] * np.array([low, high])
    return np.array([(ends.min(), -thick), (ends.max(), -thick), (ends.max(), thick), (ends.min(), thick)])


def _outline(form: Form, mesh: Mesh, size: float) -> np.ndarray:
    """The outline of a tool of the plane, anticlockwise, shape (r, 2)."""
    centre, half = _where(form, mesh, size)
    if form.plane:
        local = np.array([(-DEPTH * size, -half[1]), (0.0, -half[1]), (0.0, half[1]), (-DEPTH * size, half[1])])
    else:
        angles = (
            2.0 * np.pi * (np.arange(AROUND) + 0.5) / AROUND
            if form.rounding
            else np.pi * (0.25 + 0.5 * np.arange(4))
        )
        local = np.sign(np.column_stack([np.cos(angles), np.sin(angles)])) * half
        local = local + form.rounding * np.column_stack([np.cos(angles), np.sin(angles)])
    return centre + local @ form.axes


def _prism(ring: np.ndarray, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """Sides between an outline before and behind the plane; the ends are quads from corner to corner."""
    count = len(ring)
    points = np.concatenate([np.column_stack([ring, np.full(count, z)]) for z in (-depth, depth)])
    k = np.arange(count)
    following = (k + 1) % count
    sides = np.column_stack([k, following, following + count, k + count])
    strips = [(i, i + 1, count - 2 - i, count - 1 - i) for i in range(count // 2 - 1)]
    ends = np.array(strips).reshape(-1, 4)
    return points, np.concatenate([sides, ends[:, ::-1], ends + count])


def _brick(half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * half
    polygons = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array(polygons)


def _cylinder(half: float, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """About the first axis."""
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    points, polygons = _prism(radius * np.column_stack([np.cos(angles), np.sin(angles)]), half)
    return points[:, [2, 0, 1]], polygons


def _sphere(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Rings around the third axis, with a pole at either end."""
    rings, k = AROUND // 2, np.arange(AROUND)
    tilt, turn = np.pi * np.arange(1, rings) / rings, 2.0 * np.pi * k / AROUND
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    points = [np.column_stack([np.sin(t) * ring, np.full(AROUND, np.cos(t))]) for t in tilt]
    points = radius * np.concatenate([*points, [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]])
    above, following = AROUND * np.arange(rings - 2)[:, None] + k, (k + 1) % AROUND
    beside = AROUND * np.arange(rings - 2)[:, None] + following
    sides = np.stack([above, above + AROUND, beside + AROUND, beside], axis=-1).reshape(-1, 4)
    last, pole, half = AROUND * (rings - 2), AROUND * (rings - 1), k[::2]
    top = np.column_stack([np.full(AROUND // 2, pole), half, half + 1, (half + 2) % AROUND])
    bottom = np.column_stack(
        [np.full(AROUND // 2, pole + 1), last + (half + 2) % AROUND, last + half + 1, last + half]
    )
    return points, np.concatenate([sides, top, bottom])
