"""Finds the free surface in the current configuration, and its normals (METHOD section 6).

Scan (Marrone et al. 2010). With a smoothing length h_s of its own, a candidate's normal is
n = −A⁻¹ Σ V ∇W, normalised, and it is exposed when no node lies in the scan region about T = x + h_s n:

    |x_J − x| ≥ √2 h_s and |x_J − T| < h_s,   or
    |x_J − x| < √2 h_s and |n·(x_J − T)| + |(1 − nn)(x_J − T)| < h_s     (a double cone in three dimensions).

Inside a body Σ V ∇W is nearly zero and n is noise. That does no harm: the region covers a ball of radius h_s/√2,
0.94 Δx at h_s = 4/3 Δx, more than half the diagonal of a cell (0.71 Δx, 0.87 Δx in 3D), so it holds a node
wherever n points, also in a lattice stretched by 1.8 (1.5 in 3D).

Improved normals. In the plane the paper takes the mean of the perpendiculars to p = x_J − x, J on the surface.
Here m is the unit vector most nearly perpendicular to all of them, outward by Marrone's n, in two and three
dimensions: it minimises Σ w (m·p̂ + c|p|)² over m and c. With c = 0, w = 1 and one neighbour a side, m is the
paper's mean; c is half the curvature, and makes m exact on a circle and a sphere however the nodes stand there,
where the mean errs by the curvature times a quarter of the difference between the two distances.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ...device.compiling import forward_kernel
from ...device.launching import Launcher
from ...physics.smoothing import wendland_c2
from ...physics.space import Space
from ...scene.resolve import SMOOTH_EDGE_ANGLE
from ...scene.scene import Scene
from ...state.pairs import Neighbours, PairList, Search

# The scan reaches 2 h_s, just as far as the support of this W, which is steep enough to tell a surface's normal
# apart from that of the next face: on a box it errs by 3° beside an edge, the Gaussian by 7°.
SCAN_SUPPORT = 2.0
SUPPORT_SQUARED = SCAN_SUPPORT**2
# A node on the very edge of the scan region is inside, whatever its last bits say.
SCAN_EDGE = 1.0 + 1e-4
# Two surface nodes lie on one face when the line between them rises by less than this, as a sine, from the plane
# of one of them; the other may be on the face's edge. Across a right-angled edge it rises by 27° or more from
# both. Normals more than a right angle apart belong to the two sides of a thin body.
FACE_RISE = math.sin(math.radians(15.0))
# Shift of the inverse iteration for the least eigenvalue, over the sum of the eigenvalues.
SHIFT = 1e-4


@dataclass(frozen=True)
class SurfaceTypes:
    """Warp types of the candidates for the free surface.

    Attributes:
        Candidates: struct of arrays, one entry a candidate: `node`, its index; `point`, a copy of the node's;
            `smoothing_length` h_s [m]; `scan_normal`, Marrone's n; `exposed`, 1 where the scan finds nothing;
            `normal`, outward, m or n by the scene's choice; `sharp`, 1 where faces meet at an angle.
        on_face: (candidate, place in its pair list, pairs, row, candidates) → the candidate that stands there, if
            it is exposed and on a face through the first one; else −1.
    """

    Candidates: type
    on_face: wp.Function


@cache
def surface_types(space: Space) -> SurfaceTypes:
    """The types of one continuum in one precision."""
    types, real = space.types, space.real

    @wp.struct
    class Candidates:
        node: wp.array(dtype=wp.int32)
        point: wp.array(dtype=types.Point)
        smoothing_length: wp.array(dtype=real)
        scan_normal: wp.array(dtype=types.vector)
        exposed: wp.array(dtype=wp.int32)
        normal: wp.array(dtype=types.vector)
        sharp: wp.array(dtype=wp.int32)

    @wp.func
    def on_face(c: int, k: int, pairs: PairList, row: wp.array(dtype=wp.int32), candidates: Candidates):
        o = row[pairs.index[k]]
        if o < 0 or o == c or candidates.exposed[wp.max(o, 0)] == 0:
            return -1
        p = candidates.point[o].x - candidates.point[c].x
        own, other = candidates.scan_normal[c], candidates.scan_normal[o]
        rise = wp.min(wp.abs(wp.dot(p, own)), wp.abs(wp.dot(p, other)))
        if wp.dot(own, other) < real(0.0) or rise > real(FACE_RISE) * wp.length(p):
            return -1
        return o

    return SurfaceTypes(Candidates, on_face)


class SurfaceScan:
    """The free surface among some candidate nodes.

    Args:
        scene: a scene with a `free_surface`.
        candidates: indices of the nodes to look at, shape (b,).
        nodes: material nodes.

    Attributes:
        candidates: the candidates, as a `Candidates` struct, filled by `refresh`.
        row: which candidate each node is, −1 for none, shape (n,).
        pairs: all nodes around each candidate, as far as the scan reaches.
        kernels: the kernels that find the surface.
    """

    def __init__(self, scene: Scene, candidates: np.ndarray, *, nodes, space: Space, launcher: Launcher):
        n, b = len(scene.mesh.nodes), len(candidates)
        device, self._nodes = launcher.device, nodes
        row = np.full(n, -1, dtype=np.int32)
        row[candidates] = np.arange(b, dtype=np.int32)
        self.row = wp.array(row, dtype=wp.int32, device=device)
        self.candidates = _candidates(candidates, space, device)
        self._ratio = scene.free_surface.scan_ratio
        spacing = scene.mesh.spacing
        search = Search(support=SCAN_SUPPORT, spacing=spacing, skin=0.0)
        self._around = Neighbours(space, launcher, targets=self.candidates, sources=nodes, search=search)
        self.pairs = self._around.pairs
        self._gather = _gather_kernel(space)
        self._scan = _scan_kernel(space)
        self._fit = _fit_kernel(space)
        self.kernels = (self._gather, self._scan, self._fit, *self._around.kernels)
        self._improves = scene.free_surface.normals == "improved"
        if not self._improves:
            self.candidates.normal = self.candidates.scan_normal

    def refresh(self) -> None:
        """Scan the present configuration: which candidates are exposed, and with which normals."""
        b, device, nodes = self.candidates.node.shape[0], self.row.device, self._nodes
        wp.launch(self._gather, b, [self._ratio, nodes, self.candidates], device=device)
        self._around.build()
        wp.launch(self._scan, b, [self.pairs, nodes, self.candidates], device=device)
        if self._improves:
            wp.launch(self._fit, b, [self.pairs, self.row, self.candidates], device=device)


def _candidates(indices, space: Space, device: wp.Device):
    candidates = surface_types(space).Candidates()
    candidates.node = wp.array(indices, dtype=wp.int32, device=device)
    for name, dtype in (
        ("point", space.types.Point),
        ("smoothing_length", space.real),
        ("scan_normal", space.types.vector),
        ("exposed", wp.int32),
        ("normal", space.types.vector),
        ("sharp", wp.int32),
    ):
        setattr(candidates, name, wp.zeros(len(indices), dtype=dtype, device=device))
    return candidates


@cache
def _gather_kernel(space: Space):
    real = space.real

    @forward_kernel
    def gather(ratio: real, nodes: space.types.MaterialNodes, candidates: surface_types(space).Candidates):
        c = wp.tid()
        i = candidates.node[c]
        candidates.point[c] = nodes.point[i]
        spacing = wp.pow(nodes.volume[i], real(wp.static(1.0 / space.dim)))
        candidates.smoothing_length[c] = ratio * spacing

    return gather


@cache
def _scan_kernel(space: Space):
    types, real, weights = space.types, space.real, wendland_c2(space.precision)

    @wp.func
    def scan_normal(x: types.vector, h: real, start: int, end: int, pairs: PairList, nodes: types.MaterialNodes):
        a = types.tensor()
        sum_grad_w = types.vector()
        for k in range(start, end):
            j = pairs.index[k]
            r = nodes.point[j].x - x
            s = wp.dot(r, r) / (h * h)
            if s < real(SUPPORT_SQUARED):
                _, g = weights(s)
                grad_w = (g * nodes.volume[j]) * r
                a += wp.outer(grad_w, r)
                sum_grad_w += grad_w
        return wp.normalize(-(space.algebra.symmetric_inverse(a) * sum_grad_w))

    @wp.func
    def in_scan_region(r: types.vector, n: types.vector, h: real):
        reach = real(SCAN_EDGE) * h
        height = wp.dot(n, r)
        side = wp.length(r - height * n)
        above = height - h
        if wp.dot(r, r) < real(2.0) * h * h:
            return wp.abs(above) + side < reach
        return above * above + side * side < reach * reach

    @forward_kernel
    def scan(pairs: PairList, nodes: types.MaterialNodes, candidates: surface_types(space).Candidates):
        c = wp.tid()
        x, h = candidates.point[c].x, candidates.smoothing_length[c]
        start, end = pairs.start[c], pairs.start[c + 1]
        n = scan_normal(x, h, start, end, pairs, nodes)
        exposed = wp.int32(1)
        for k in range(start, end):
            j = pairs.index[k]
            if j != candidates.node[c] and in_scan_region(nodes.point[j].x - x, n, h):
                exposed = 0
        candidates.scan_normal[c] = n
        candidates.exposed[c] = exposed

    return scan


@cache
def _fit_kernel(space: Space):
    """The kernel that fits normals to the neighbours on the surface."""
    types, real, surface, weights = space.types, space.real, surface_types(space), wendland_c2(space.precision)
    # Where two faces meet, all directions rise (or all fall) by half the angle between the faces; in a solid those
    # across the edge do, 2/π as much in the mean over all directions.
    sharp_rise = math.sin(0.5 * SMOOTH_EDGE_ANGLE) * (1.0 if space.dim == 2 else 2.0 / math.pi)
    identity = types.tensor(np.eye(space.dim))

    @forward_kernel
    def fit(pairs: PairList, row: wp.array(dtype=wp.int32), candidates: surface.Candidates):
        c = wp.tid()
        x, h, n = candidates.point[c].x, candidates.smoothing_length[c], candidates.scan_normal[c]
        directions = types.tensor()  # Σ w p̂ p̂
        offset = types.vector()  # Σ w p
        spread, distance = real(0.0), real(0.0)  # Σ w |p|², Σ w |p|
        for k in range(pairs.start[c], pairs.start[c + 1]):
            o = surface.on_face(c, k, pairs, row, candidates)
            if o >= 0:
                p = (candidates.point[o].x - x) / h
                s = wp.dot(p, p)
                w, _ = weights(s)
                directions += (w / s) * wp.outer(p, p)
                offset += w * p
                spread += w * s
                distance += w * wp.sqrt(s)
        candidates.normal[c] = n
        sharp = wp.abs(wp.dot(n, offset)) > real(sharp_rise) * distance
        if spread > real(0.0) and not sharp:
            # The minimum over c leaves directions − offset²/spread, whose least eigenvalue belongs to m.
            flatness = directions - wp.outer(offset, offset) / spread
            towards = wp.inverse(flatness + real(SHIFT) * wp.trace(directions) * identity)
            candidates.normal[c] = wp.normalize(towards * wp.normalize(towards * n))
        candidates.sharp[c] = wp.where(sharp, 1, 0)

    return fit
