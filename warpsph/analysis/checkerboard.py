"""How much of a field alternates from node to node: the mode that gradients at cells' middles do not see."""

from __future__ import annotations

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh


def checkerboard(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    """The checkerboard part of a scalar field (n,) at every interior node, shape (interior nodes,).

    Of f = A (−1)^{i+j} + b(x, y), b bilinear, it is A (−1)^{i+j}: at the corners of each cell f has the
    hourglass component Σ s_k f_k/2ᵈ (s_k = ±1 alternating), and the part at a node is the mean of s h over
    its 2ᵈ cells, which in the plane is the stencil [1 −2 1] ⊗ [1 −2 1]/16. A plain projection onto (−1)^{i+j}
    would see a smooth field as well, by its edges. (Bars and plane strain alike; d = 1, 2 or 3.)

    Raises:
        SceneError: the mesh is of triangles or tetrahedra, which have no such mode.
    """
    if not mesh.kind.grid:
        raise SceneError("cells", mesh.kind.name, "segments, quads and hexahedra alone have a checkerboard")
    corners, sign = mesh.kind.corners, mesh.kind.sides.prod(axis=1)
    hourglass = values[mesh.cells] @ sign / corners
    part, cells = np.zeros(len(values)), np.zeros(len(values), dtype=int)
    np.add.at(part, mesh.cells, sign * hourglass[:, None] / corners)
    np.add.at(cells, mesh.cells, 1)
    return part[cells == corners]


def checkerboard_amplitude(mesh: Mesh, values: np.ndarray) -> float:
    """RMS of `checkerboard` over the interior nodes: A for a checkerboard ±A, 0 for a bilinear field.

    >>> from warpsph import Box
    >>> mesh = Box((3.0, 3.0), 1.0).mesh()
    >>> x, y = mesh.nodes.T
    >>> round(checkerboard_amplitude(mesh, 0.5 * (-1.0) ** (x + y) + 7.0 * x * y), 12)
    0.5
    """
    return float(np.sqrt(np.mean(checkerboard(mesh, values) ** 2)))
