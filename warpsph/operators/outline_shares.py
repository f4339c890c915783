"""How much of a surface is a node's where the outline of a body in the plane changes: half of both its edges."""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..physics.space import Space
from ..remaking.outline import INSIDE, OutlineArrays
from ..state.cell_body import CellBody, cell_node_types


class OutlineShares:
    """What `FaceShares` is of a body whose faces stay.

    Args:
        body: the body.
        outline: its outline.

    Attributes:
        vectors: area vectors of all nodes, outwards [m].
        kernels: what it launches.
    """

    def __init__(self, body: CellBody, outline: OutlineArrays):
        self._body, self._outline, self._share = body, outline, _share_kernel(body.space)
        self.vectors = wp.zeros_like(body.nodes.reference)
        self.kernels = (self._share,)

    def measure(self) -> None:
        """Measure them where the nodes are."""
        body = self._body
        body.launcher.launch(self._share, self.vectors, [self._outline, body.nodes, self.vectors])


@cache
def _share_kernel(space: Space):
    real, vector, CellNodes = space.real, space.types.vector, cell_node_types(space)[1]

    @forward_kernel
    def share(first: int, outline: OutlineArrays, nodes: CellNodes, vectors: wp.array(dtype=vector)):
        i = first + wp.tid()
        result = vector()
        after = outline.after[i]
        before = outline.before[i]
        if after != INSIDE:
            along = real(0.5) * (nodes.point[after].x - nodes.point[before].x)
            result = vector(along[1], -along[0])
        vectors[i] = result

    return share
