"""A node field between the nodes of a plane body."""

from __future__ import annotations

import numpy as np

from ..mesh.mesh import Mesh


class Sampler:
    """Values of a node field anywhere in a plane body, linear on the triangles of `split_cells`.

    Args:
        mesh: the body; `mesh.with_nodes(position)` is where it is now.
        values: at the nodes, shape (n,).

    >>> from warpsph import Box
    >>> mesh = Box((1.0, 1.0), 0.5).mesh()
    >>> x, y = mesh.nodes.T
    >>> Sampler(mesh, x + 2.0 * y)(np.array([[0.25, 0.5], [9.0, 9.0]]))
    array([1.25,  nan])
    """

    def __init__(self, mesh: Mesh, values: np.ndarray):
        # Nothing is drawn: matplotlib finds the triangle that a point is in. Slow to import, and only needed here.
        from matplotlib.tri import LinearTriInterpolator, Triangulation

        corners, triangles, heights = split_cells(mesh, values)
        self._interpolate = LinearTriInterpolator(Triangulation(*corners.T, triangles), heights)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values at points (…, 2); NaN outside the body, where there are none."""
        return self._interpolate(points[..., 0], points[..., 1]).filled(np.nan)


def split_cells(mesh: Mesh, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut each cell of a plane body into one triangle an edge, about its middle, where the value is the mean.

    That is where the auxiliary node stands; cutting along one diagonal would draw a checkerboard as stripes.

    Returns: the triangles' corners (n + m, 2), which three each has (t, 3), values at the corners (n + m,).
    """
    points, cells = mesh.nodes, mesh.cells
    middle = len(points) + np.arange(len(cells))
    ring = cells.T[list(mesh.kind.drawn)]
    sides = zip(ring, np.roll(ring, -1, axis=0), strict=True)
    triangles = np.concatenate([np.stack([middle, first, second], axis=1) for first, second in sides])
    corners = np.concatenate([points, points[cells].mean(axis=1)])
    return corners, triangles, np.concatenate([values, values[cells].mean(axis=1)])
