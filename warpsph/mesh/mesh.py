"""A body's initial nodes and cells, and what follows from them. NumPy only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..errors import SceneError, one_of
from .continuum import CONTINUA, Continuum
from .kinds import KINDS, CellKind
from .small_matrices import determinants, least_singular_values

NO_SIDE = -1
ARRAYS = ("spacing", "nodes", "cells", "faces", "face_cell", "face_side")  # attributes of a mesh, but its tags


def kind_of(dim: int, corners: int) -> CellKind:
    """The kind of cells with so many corners in so many dimensions.

    Raises:
        SceneError: there is none.
    """
    if (dim, corners) not in KINDS:
        known = one_of(f"{kind.name} ({kind.dim}D, {kind.corners})" for kind in KINDS.values())
        raise SceneError("cells", f"{corners} corners in {dim}D", known)
    return KINDS[dim, corners]


@dataclass(frozen=True)
class Tag:
    """What a name of a mesh stands for.

    Attributes:
        nodes: their indices, rising, shape (k,).
        faces: indices of boundary faces, rising, shape (l,).
    """

    nodes: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True)
class Mesh:
    """Nodes at the corners of cells.

    Attributes:
        spacing: Δx, of the grid before any mapping [m].
        nodes: positions [m], shape (n, d).
        cells: node indices of each cell in the order of its kind's corners, shape (m, c).
        faces: node indices of each boundary face, in the order of the face's kind, shape (f, …).
        face_cell: the cell each face belongs to, shape (f,).
        face_side: 2·axis where the grid ends at the low side of an axis, 2·axis + 1 at the high side, `NO_SIDE` at
            steps, notches and holes in between, shape (f,).
        tags: parts of it that have names.
    """

    spacing: float
    nodes: np.ndarray
    cells: np.ndarray
    faces: np.ndarray
    face_cell: np.ndarray
    face_side: np.ndarray
    tags: Mapping[str, Tag] = field(default_factory=dict)

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return self.nodes.shape[1]

    @property
    def continuum(self) -> Continuum:
        """The continuum of this dimension."""
        return CONTINUA[self.dim]

    @cached_property
    def kind(self) -> CellKind:
        """The kind of its cells.

        Raises:
            SceneError: no kind has that many dimensions and corners.
        """
        return kind_of(self.dim, self.cells.shape[1])

    @property
    def middle(self) -> np.ndarray:
        """The middle of the box that holds it [m], shape (d,)."""
        return 0.5 * (self.nodes.min(axis=0) + self.nodes.max(axis=0))

    def with_nodes(self, nodes: np.ndarray) -> Mesh:
        """The same mesh with its nodes elsewhere."""
        return replace(self, nodes=nodes)

    def cell_volumes(self) -> np.ndarray:
        """Volume of each cell [mᵈ], shape (m,), exact: of a hexahedron that between its bilinear faces. Read only.

        By the Jacobian in the middle; a hexahedron's has the twists h_ab = ∂²x/∂ξ_a∂ξ_b as well, which add
        [det(J₁, h₁₂, h₁₃) + det(h₁₂, J₂, h₂₃) + det(h₁₃, h₂₃, J₃)]/12.
        """
        return self._volumes[0]

    def middle_volumes(self) -> np.ndarray:
        """Volume of each cell [mᵈ] if its Jacobian were everywhere that of its middle, shape (m,). Read only.

        It follows a uniform deformation exactly. Only hexahedra with warped faces have another volume.
        """
        return self._volumes[1]

    @cached_property
    def _volumes(self) -> tuple[np.ndarray, np.ndarray]:
        """`cell_volumes` and `middle_volumes`."""
        jacobians = self.cell_jacobians()
        volume = middle = self.kind.volume * determinants(jacobians)
        if self.dim == 3 and self.kind.grid:
            twists = self._twists()
            warped = np.flatnonzero((twists != 0.0).any(axis=(0, 2)))
            columns, volume = np.moveaxis(jacobians[warped], 2, 0), middle.copy()
            h = dict(zip(self.kind.modes, twists[:, warped], strict=False))
            for k in range(3):
                three = [columns[a] if a == k else h[min(a, k), max(a, k)] for a in range(3)]
                volume[warped] += determinants(np.stack(three, axis=2)) / 12.0
        volume.flags.writeable = middle.flags.writeable = False
        return volume, middle

    def _twists(self) -> np.ndarray:
        """How the corners of a hexahedron follow its first modes, ∂²x/∂ξ_a∂ξ_b in the middle [m], (3, m, 3)."""
        return self._corner_sums(0.5 * self.kind.signs[:, :3])

    def bent_cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cells of a grid that are no parallelepipeds, how far they are bent, b² = Σ (∇ξ_a · x_m)² over the
        hourglass modes m and their axes a with ξ = ±1 at the corners, and their gradients (k, c, d) [1/m]."""
        twists = self._corner_sums(self.kind.signs / self.kind.corners)
        bent = np.flatnonzero((np.abs(twists) > 1e-6 * self.spacing).any(axis=(0, 2)))
        inverse = np.linalg.inv(self.cell_jacobians()[bent])
        links = [(m, a) for m, axes in enumerate(self.kind.modes) for a in axes]
        bends = sum(
            ((2.0 * inverse[:, a] * twists[m, bent]).sum(axis=1) ** 2 for m, a in links), np.zeros(len(bent))
        )
        return bent, bends, np.array(self.kind.gradients) @ inverse

    def cell_jacobians(self, slopes: np.ndarray | None = None) -> np.ndarray:
        """∂x/∂ξ at one place of each cell [m], the axes as columns, shape (m, d, d).

        Args:
            slopes: ∂N_k/∂ξ_a there, shape (c, d); in the middle unless given.
        """
        slopes = np.array(self.kind.gradients if slopes is None else slopes, dtype=float)  # float64, always
        return np.moveaxis(self._corner_sums(slopes), 0, 2)

    def _corner_sums(self, weights: np.ndarray) -> np.ndarray:
        """Σ_k w_k x_k over the corners of each cell, a sum for each column of weights (c, w), shape (w, m, d)."""
        corners = [self.nodes[corner] for corner in self.cells.T]
        return np.array([sum(w * x for w, x in zip(column, corners, strict=True)) for column in weights.T])

    def corner_volumes(self) -> np.ndarray:
        """det ∂x/∂ξ at the corners of each cell [mᵈ], shape (m, c), of a simplex one for all, (m, 1).

        Where one is not above 0 the cell is flat or folded, although it may have a volume as a whole.
        """
        places = self.kind.points if self.kind.grid else self.kind.points[:1]
        return np.stack([np.linalg.det(self.cell_jacobians(self.kind.slopes(place))) for place in places], axis=1)

    @cached_property
    def _inverse_jacobians(self) -> np.ndarray:
        return np.linalg.inv(self.cell_jacobians())

    def cell_gradients(self, values: np.ndarray) -> np.ndarray:
        """∂f_i/∂x_j in the middle of each cell, shape (m, d, d), of a vector field (n, d) at the nodes."""
        return self.with_nodes(values).cell_jacobians() @ self._inverse_jacobians

    def at_centres(self, values: np.ndarray) -> np.ndarray:
        """Mean of node values (n, …) over the corners of each cell, shape (m, …)."""
        return sum(values[corner] for corner in self.cells.T) / self.kind.corners

    def at_nodes(self, values: np.ndarray) -> np.ndarray:
        """Mean of cell values (m, k) over the cells around each node, shape (n, k)."""
        adjacent = np.bincount(self.cells.ravel(), minlength=len(self.nodes))
        return np.stack([self._over_nodes(column) for column in values.T], axis=1) / adjacent[:, None]

    def cells_of_nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Where each node stands in the table of cells, in compressed rows.

        Returns: the start of each node's row, shape (n + 1,), and the places, shape (m c,): place p is corner
            p mod c of cell p div c. A node's places are in the order of the corners it is, then of the cells.
        """
        corner_then_cell = np.arange(self.cells.size).reshape(self.cells.shape).T.ravel()
        places = corner_then_cell[np.argsort(self.cells.T.ravel(), kind="stable")]
        counts = np.bincount(self.cells.ravel(), minlength=len(self.nodes))
        return np.concatenate([[0], np.cumsum(counts)]), places

    def largest_edge(self) -> float:
        """Length of the longest cell edge [m]."""
        corners = self.nodes.T[:, self.cells.T]
        squares = [np.sum((corners[:, b] - corners[:, a]) ** 2, axis=0).max() for a, b in self.kind.edges]
        return float(np.sqrt(max(squares)))

    def smallest_distance(self) -> float:
        """Least distance across a cell [m], which a wave sees: the least of `least_stretches`.

        In a cell that leans it is less than the distance between the middles of opposite faces.
        """
        return self._smallest_distance

    @cached_property
    def _smallest_distance(self) -> float:
        return float(self.least_stretches().min())

    def least_stretches(self) -> np.ndarray:
        """Least of the lengths of each cell along its principal axes [m], shape (m,).

        They are the singular values of the map from a cell with edges of length 1, all alike: from a square or a
        cube, or from a regular triangle or tetrahedron, and so do not depend on which corner is the first.
        """
        jacobians = self.cell_jacobians()
        return least_singular_values(jacobians if self.kind.grid else jacobians @ np.linalg.inv(self.kind.regular))

    def node_volumes(self) -> np.ndarray:
        """Volume of each node [mᵈ], shape (n,): an equal share of each adjacent cell, so that masses add up."""
        return self._over_nodes(self.cell_volumes()) / self.kind.corners

    def node_weights(self) -> np.ndarray:
        """Interpolation weight of each node [mᵈ], shape (n,): the mean of the adjacent cells' `middle_volumes`.

        Edge and corner nodes weigh as much as interior ones; half and quarter weights make free vibrations blow up
        (METHOD section 2).
        """
        adjacent = np.bincount(self.cells.ravel(), minlength=len(self.nodes))
        return self._over_nodes(self.middle_volumes()) / adjacent

    def _over_nodes(self, values: np.ndarray) -> np.ndarray:
        """Sum of cell values (m,) over the cells around each node, shape (n,)."""
        return np.bincount(self.cells.ravel(), np.repeat(values, self.kind.corners), len(self.nodes))

    def face_normals(self) -> np.ndarray:
        """Outward unit normal of each boundary face, shape (f, d). Read only."""
        return self._normals

    @cached_property
    def _normals(self) -> np.ndarray:
        points = self.nodes[self.faces]
        outward = points.mean(axis=1) - self.nodes[self.cells[self.face_cell]].mean(axis=1)
        if self.dim == 1:
            normals = outward
        elif self.dim == 2:
            tangent = points[:, 1] - points[:, 0]
            normals = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
        else:
            normals = self._twice_face_areas(points)
        normals = normals * np.sign(np.sum(normals * outward, axis=1, keepdims=True))
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        normals.flags.writeable = False
        return normals

    def face_areas(self) -> np.ndarray:
        """Area of each boundary face [mᵈ⁻¹], shape (f,): 1 at the ends of a bar."""
        points = self.nodes[self.faces]
        if self.dim == 1:
            return np.ones(len(points))
        if self.dim == 2:
            return np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
        return 0.5 * np.linalg.norm(self._twice_face_areas(points), axis=1)

    def face_angles(self) -> np.ndarray:
        """Angle of each boundary face at each of its corners [rad], shape (f, …); 1 where faces are no polygons.

        Weights with which the normals of faces make that of a node, however a surface is cut into faces.
        """
        if self.dim < 3:
            return np.ones(self.faces.shape)
        ring = self.kind.face_kind.drawn
        around = self.nodes[self.faces[:, ring]]
        before, after = (np.roll(around, step, axis=1) - around for step in (1, -1))
        sizes = np.linalg.norm(before, axis=2) * np.linalg.norm(after, axis=2)
        angles = np.empty(self.faces.shape)
        angles[:, ring] = np.arccos(np.clip(np.sum(before * after, axis=2) / sizes, -1.0, 1.0))
        return angles

    def _twice_face_areas(self, points: np.ndarray) -> np.ndarray:
        """Vectors along the normals of a solid's faces, twice as long as their areas, shape (f, 3)."""
        (a, b), (c, d) = self.kind.face_kind.spans
        return np.cross(points[:, b] - points[:, a], points[:, d] - points[:, c])
