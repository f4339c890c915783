"""The initial lattice of a body: nodes, cells, and the faces that bound it. NumPy only."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import SceneError
from .dimension import CONTINUA, Continuum


@dataclass(frozen=True)
class Lattice:
    """Nodes at the corners of the cells of a regular grid, possibly mapped.

    An auxiliary node will stand in the middle of each cell. Corner order within a cell: the last axis varies
    fastest, so corner k of a cell has offsets given by the bits of k.

    Attributes:
        spacing: Δx of the grid before any mapping [m].
        nodes: positions [m], shape (n, d).
        cells: node indices of each cell, shape (m, 2ᵈ).
        faces: node indices of each boundary face, shape (f, 2ᵈ⁻¹).
        face_cell: the cell each face belongs to, shape (f,).
        face_side: 2·axis for the low side of an axis of the grid, 2·axis + 1 for the high side, shape (f,).
    """

    spacing: float
    nodes: np.ndarray
    cells: np.ndarray
    faces: np.ndarray
    face_cell: np.ndarray
    face_side: np.ndarray

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return self.nodes.shape[1]

    @property
    def continuum(self) -> Continuum:
        """The continuum of this dimension."""
        return CONTINUA[self.dim]

    def with_nodes(self, nodes: np.ndarray) -> Lattice:
        """The same lattice with its nodes elsewhere."""
        return replace(self, nodes=nodes)

    def cell_volumes(self) -> np.ndarray:
        """Volume of each cell [mᵈ], shape (m,): the Jacobian at its centre (exact for a quadrilateral)."""
        return np.linalg.det(self.cell_jacobians())

    def cell_jacobians(self) -> np.ndarray:
        """Mean edge vectors of each cell along the axes of the grid [m], as columns, shape (m, d, d)."""
        corners = [self.nodes[corner] for corner in self.cells.T]
        sides = 2.0 * np.array(list(itertools.product((0, 1), repeat=self.dim))) - 1.0
        columns = [sum(s * x for s, x in zip(side, corners, strict=True)) for side in sides.T]
        return np.stack(columns, axis=2) / 2.0 ** (self.dim - 1)

    @cached_property
    def _inverse_jacobians(self) -> np.ndarray:
        return np.linalg.inv(self.cell_jacobians())

    def cell_gradients(self, values: np.ndarray) -> np.ndarray:
        """∂f_i/∂x_j at the centre of each cell, shape (m, d, d), of a vector field (n, d) at the nodes."""
        return self.with_nodes(values).cell_jacobians() @ self._inverse_jacobians

    def at_centres(self, values: np.ndarray) -> np.ndarray:
        """Mean of node values (n, …) over the corners of each cell, shape (m, …)."""
        return sum(values[corner] for corner in self.cells.T) / self.cells.shape[1]

    def at_nodes(self, values: np.ndarray) -> np.ndarray:
        """Mean of cell values (m, k) over the cells around each node, shape (n, k)."""
        owner, corners, n = self.cells.ravel(), self.cells.shape[1], len(self.nodes)
        sums = [np.bincount(owner, np.repeat(column, corners), n) for column in values.T]
        return np.stack(sums, axis=1) / np.bincount(owner, minlength=n)[:, None]

    def largest_edge(self) -> float:
        """Length of the longest cell edge [m]."""
        corners = self.nodes[self.cells]
        size = 2**self.dim
        edges = [(k, k | bit) for k in range(size) for bit in (1 << b for b in range(self.dim)) if not k & bit]
        return float(max(np.linalg.norm(corners[:, b] - corners[:, a], axis=1).max() for a, b in edges))

    def smallest_edge(self) -> float:
        """Shortest distance across a cell between the middles of opposite faces [m]."""
        return float(np.linalg.norm(self.cell_jacobians(), axis=1).min())

    def node_volumes(self) -> tuple[np.ndarray, np.ndarray]:
        """Volumes of the nodes [mᵈ], shape (n,) each: the one that carries mass, and the interpolation weight.

        Mass: an equal share of each adjacent cell, so that masses add up to the body's. Weight: the mean
        volume of the adjacent cells, so that edge and corner nodes weigh as much as interior ones; half and
        quarter weights make free vibrations blow up (METHOD section 2).
        """
        volume = np.repeat(self.cell_volumes()[:, None], self.cells.shape[1], axis=1).ravel()
        owner = self.cells.ravel()
        total = np.bincount(owner, weights=volume, minlength=len(self.nodes))
        count = np.bincount(owner, minlength=len(self.nodes))
        return total / self.cells.shape[1], total / count

    def face_normals(self) -> np.ndarray:
        """Outward unit normal of each boundary face, shape (f, d)."""
        points = self.nodes[self.faces]
        outward = points.mean(axis=1) - self.nodes[self.cells[self.face_cell]].mean(axis=1)
        if self.dim == 1:
            normals = outward
        elif self.dim == 2:
            tangent = points[:, 1] - points[:, 0]
            normals = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
        else:
            normals = np.cross(points[:, 3] - points[:, 0], points[:, 2] - points[:, 1])
        normals = normals * np.sign(np.sum(normals * outward, axis=1, keepdims=True))
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def grid_lattice(kept: np.ndarray, spacing: float, origin: np.ndarray, size: np.ndarray) -> Lattice:
    """The lattice made of the cells of a regular grid that are kept.

    Args:
        kept: which cells belong to the body, boolean, one axis a dimension.
        spacing: Δx [m].
        origin: low corner of the grid [m], shape (d,).
        size: extent of the grid along each axis [m], shape (d,); gives coordinates without round-off drift.
    """
    dim = kept.ndim
    if not kept.any():
        raise SceneError("shape", "no cell", "at least one whole cell of the lattice must lie inside the shape")
    index = np.argwhere(kept)
    offsets = np.array(list(itertools.product((0, 1), repeat=dim)))
    points = np.array(kept.shape) + 1
    corner = np.ravel_multi_index(tuple(np.moveaxis(index[:, None, :] + offsets[None], 2, 0)), tuple(points))
    used, cells = np.unique(corner, return_inverse=True)
    cells = cells.reshape(corner.shape)
    coordinates = np.stack(np.unravel_index(used, tuple(points)), axis=1)
    nodes = origin + size * (coordinates / np.array(kept.shape))

    padded = np.pad(kept, 1)
    faces, face_cell, face_side = [], [], []
    for axis in range(dim):
        for high in (0, 1):
            neighbour = index + 1
            neighbour[:, axis] += 1 if high else -1
            bare = np.flatnonzero(~padded[tuple(neighbour.T)])
            faces.append(cells[bare][:, offsets[:, axis] == high])
            face_cell.append(bare)
            face_side.append(np.full(len(bare), 2 * axis + high))
    return Lattice(
        spacing=spacing,
        nodes=nodes,
        cells=cells,
        faces=np.concatenate(faces),
        face_cell=np.concatenate(face_cell),
        face_side=np.concatenate(face_side),
    )
