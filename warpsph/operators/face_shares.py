"""How much of the surface is a node's: ∫ N_i n dA over the faces around it, as they are now."""

from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..scene.face_loads import area_vectors, surface_rule
from ..state.cell_body import CellBody, cell_node_types


class FaceShares:
    """Area vectors, outwards, of the nodes of a body, zero inside.

    Args:
        body: the body.

    Attributes:
        vectors: [mᵈ⁻¹], one a node.
        kernels: what it launches.
    """

    def __init__(self, body: CellBody):
        mesh, space, device = body.scene.mesh, body.space, body.launcher.device
        self._body = body
        outward = np.sum(area_vectors(mesh.nodes[mesh.faces], mesh.kind) * mesh.face_normals(), axis=1)
        owners = mesh.faces.ravel()
        place = np.argsort(owners, kind="stable")
        first = np.searchsorted(owners[place], np.arange(len(mesh.nodes) + 1))
        self._faces = wp.array(mesh.faces, dtype=wp.int32, device=device)
        self._sign = wp.array(np.sign(outward), dtype=space.real, device=device)
        self._parts = wp.zeros(mesh.faces.shape, dtype=space.types.vector, device=device)
        self._first, self._place = (wp.array(row, dtype=wp.int32, device=device) for row in (first, place))
        self.vectors = wp.zeros(len(mesh.nodes), dtype=space.types.vector, device=device)
        self._part, self._gather = part_kernel(space, body.kind), share_kernel(space, mesh.faces.shape[1])
        self.kernels = (self._part, self._gather)

    def measure(self) -> None:
        """Measure them where the nodes are."""
        launch, nodes = self._body.launcher.launch, self._body.nodes
        launch(self._part, self._sign, [self._faces, self._sign, nodes, self._parts])
        launch(self._gather, self.vectors, [self._first, self._place, self._parts, self.vectors])


@cache
def face_function(space: Space, kind: CellKind):
    """What a kernel needs to integrate over faces: weights (q), N_k (q, k), ∂N_k/∂ξ (q k, a), their matrix type
    ∂x/∂ξ, and ∂x/∂ξ → the area vector."""
    real, types, d = space.real, space.types, space.dim
    rule, size = surface_rule(kind), len(kind.faces[0])
    points, axes = len(rule), max(1, d - 1)  # Warp has no matrix without columns
    weights = space.vec(points)(*[weight for weight, _, _ in rule])
    values = space.mat(points, size)(*np.ravel([value for _, value, _ in rule]).tolist())
    slopes = np.zeros((points, size, axes))
    slopes[:, :, : d - 1] = [slope for _, _, slope in rule]
    Along = space.mat(axes, d)
    slope_at = space.mat(points * size, axes)(*slopes.ravel().tolist())

    @wp.func
    def area_vector(along: Along):
        if wp.static(d == 1):
            return types.vector(real(1.0))
        elif wp.static(d == 2):
            return types.vector(along[0, 1], -along[0, 0])
        else:
            return wp.cross(along[0], along[1])

    return weights, values, slope_at, Along, area_vector


@cache
def part_kernel(space: Space, kind: CellKind):
    """∫ N_k n dA of each corner k of each boundary face, n outwards."""
    real, types, CellNodes = space.real, space.types, cell_node_types(space)[1]
    size, points = len(kind.faces[0]), len(surface_rule(kind))
    weights, values, slope_at, Along, area_vector = face_function(space, kind)

    @forward_kernel
    def part(
        first: int,
        faces: wp.array2d(dtype=wp.int32),
        sign: wp.array(dtype=real),
        nodes: CellNodes,
        parts: wp.array2d(dtype=types.vector),
    ):
        f = first + wp.tid()
        for k in range(wp.static(size)):
            parts[f, k] = types.vector()
        for q in range(wp.static(points)):
            along = Along()
            for k in range(wp.static(size)):
                i = faces[f, k]
                along += wp.outer(slope_at[wp.static(size) * q + k], nodes.point[i].x)
            area = (sign[f] * weights[q]) * area_vector(along)
            for k in range(wp.static(size)):
                parts[f, k] = parts[f, k] + values[q, k] * area

    return part


@cache
def share_kernel(space: Space, size: int):
    """Of each node the parts of the faces around it together; faces have `size` corners."""
    vector = space.types.vector

    @forward_kernel
    def share(
        first: int,
        start: wp.array(dtype=wp.int32),
        place: wp.array(dtype=wp.int32),
        parts: wp.array2d(dtype=vector),
        vectors: wp.array(dtype=vector),
    ):
        row = first + wp.tid()
        total = vector()
        for entry in range(start[row], start[row + 1]):
            face = place[entry] // wp.static(size)
            total += parts[face, place[entry] - wp.static(size) * face]
        vectors[row] = total

    return share
