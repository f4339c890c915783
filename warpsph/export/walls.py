"""What surrounds a body, to be drawn: the boundary faces that conditions hold or move, as boxes or quads.

A condition acts on nodes and has no shape; a viewer shows why the body does not fall by the faces it acts on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.mesh import NO_SIDE, Mesh
from ..scene.condition import Condition, Fixed, PrescribedVelocity, Roller, Rotating
from ..scene.scene import Scene

KINDS = {Fixed: "fixed", Roller: "roller", PrescribedVelocity: "moving", Rotating: "rotating"}


@dataclass(frozen=True)
class Wall:
    """The faces under one condition.

    Attributes:
        name: kind of the condition and the edges it is on, e.g. `roller_left`.
        faces: indices of the boundary faces of the mesh, shape (k,).
        still: whether it never moves.
    """

    name: str
    faces: np.ndarray
    still: bool


def walls_of(scene: Scene) -> tuple[Wall, ...]:
    """One wall for every condition that holds or moves at least one whole boundary face."""
    mesh, walls = scene.mesh, []
    for condition in scene.conditions:
        faces = np.flatnonzero(condition.faces(mesh))
        if len(faces) and not condition.unmoved:
            name = _unused(_name(condition, mesh, faces), [wall.name for wall in walls])
            walls.append(Wall(name, faces, isinstance(condition, Fixed)))
    return tuple(walls)


def _name(condition: Condition, mesh: Mesh, faces: np.ndarray) -> str:
    sides = np.unique(mesh.face_side[faces]).tolist()
    named = NO_SIDE not in sides and len(sides) < len(KINDS)
    names = [mesh.continuum.edges[side] for side in sides] if named else ["edge"]
    return "_".join([KINDS.get(type(condition), "held"), *names])


def _unused(name: str, taken: Sequence[str]) -> str:
    names = (name, *(f"{name}_{k}" for k in range(2, len(taken) + 2)))
    return next(candidate for candidate in names if candidate not in taken)


@dataclass(frozen=True)
class WallMesh:
    """A wall as a mesh whose topology stays and whose points follow the wall's nodes.

    It stands one node's radius outside the nodes, so that nodes drawn as spheres touch it: the face itself in 3D,
    a box a face in plane strain, as deep as it is thick, and a square plate at the end of a bar.

    Attributes:
        polygons: indices into the points, shape (polygons, 3 or 4).
    """

    mesh: Mesh
    wall: Wall
    polygons: np.ndarray
    _nodes: np.ndarray
    _corner: np.ndarray

    @classmethod
    def of(cls, mesh: Mesh, wall: Wall) -> WallMesh:
        """The mesh of a wall."""
        nodes, corner = np.unique(mesh.faces[wall.faces], return_inverse=True)
        corner = corner.reshape(mesh.faces[wall.faces].shape)
        rings = corner[:, mesh.kind.face_kind.drawn] if mesh.dim == 3 else (_plate, _boxes)[mesh.dim - 1](corner)
        return cls(mesh, wall, rings, nodes, corner)

    def points(self, position: np.ndarray) -> np.ndarray:
        """Its points [m], shape (p, 3), for positions (n, d) of the body's nodes."""
        dim, spacing, own = self.mesh.dim, self.mesh.spacing, position[self._nodes]
        normals = self.mesh.with_nodes(position).face_normals()[self.wall.faces]
        outward = np.zeros_like(own)
        np.add.at(outward, self._corner, normals[:, None, :])
        length = np.linalg.norm(outward, axis=1, keepdims=True)
        outward = np.divide(outward, length, out=np.zeros_like(outward), where=length > 0.0)
        surface = own + 0.5 * spacing * outward
        if dim == 3:
            return surface
        if dim == 2:
            ring = [(surface, -1.0), (surface, 1.0), (surface + spacing * outward, 1.0)]
            ring.append((surface + spacing * outward, -1.0))
            return np.concatenate([np.column_stack([at, np.full(len(at), side * spacing)]) for at, side in ring])
        square = 2.0 * spacing * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        return np.concatenate([np.column_stack([np.repeat(at[None], 4, axis=0), square]) for at in surface])


def _plate(corner: np.ndarray) -> np.ndarray:
    return 4 * corner[:, :1] + np.arange(4)


def _boxes(corner: np.ndarray) -> np.ndarray:
    """Four sides between the four points of the face's one node and those of the other; the ends are open."""
    count = corner.max() + 1
    a, b = corner.T
    sides = [(k, (k + 1) % 4) for k in range(4)]
    return np.concatenate(
        [np.stack([a + i * count, a + j * count, b + j * count, b + i * count], 1) for i, j in sides]
    )
