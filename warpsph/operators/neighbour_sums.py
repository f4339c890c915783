"""Corrected values and gradients (METHOD section 2) from one pass over the neighbours.

    value      φ_I  = Σ V_J φ_J W_IJ / Σ V_J W_IJ                                  (Shepard)
    gradient   ∇φ_I = A_I⁻¹ Σ V_J (φ_J − φ_I) ∇W_IJ,   A_I = Σ V_J ∇W_IJ ⊗ (x_J − x_I)

Both are linear in the neighbours' values, so one pass collects sums and either follows from them, the gradient
for any value φ_I of the point itself. The sums are taken of differences from a base value near the neighbours'
(the one the target had last): in float32 the sums of the values themselves would cancel. Position and values of a
neighbour stand side by side and are added up as one row.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import warp as wp

from ..device.arrays import natural, packed
from ..device.rows import add_outer
from ..physics.smoothing import SMOOTHING_FUNCTIONS
from ..physics.space import Space
from ..scene.numerics import KERNELS
from ..state.pairs import PairList


@dataclass(frozen=True)
class Sweep:
    """The functions of one pass.

    Attributes:
        collect: (target index, its x and metric M, base value, pair list, source points, their volumes) → Sums.
            ξ² = |M r|²: M = 1/h for a round kernel; the corrected gradient is the same for any M, since A⁻¹ takes
            MᵀM out of ∇W again.
        value: Sums → Shepard value; the base value where no neighbour is left.
        round_metric: h → 1/h.
        cell_metric: h/Δx → (∇ξ of the cells, h) → M of a kernel that is stretched and turned with them (as in
            adaptive SPH, Owen et al. 1998); 1/h where they have folded.
        gradient: (Sums, φ_I) → ∇φ_I, zero along directions without neighbours.
    """

    collect: wp.Function
    value: wp.Function
    gradient: wp.Function
    round_metric: wp.Function
    cell_metric: Callable[[float], wp.Function]


# A neighbour on the very edge of the support is outside, whatever its last bits say: at h = 0.5 Δx the Gaussian's
# support ends on the lattice points at 1.5 Δx, and taking some of them in by rounding smears a front.
EDGE = 1.0 - 1e-4

# Neighbours whose weights are found side by side, for SIMD: the least power of two that holds the 12 of a point on
# a lattice in the plane. A GPU has its threads side by side instead.
CPU_BATCH = 16
GPU_BATCH = 1


def batch_on(device: wp.Device) -> int:
    """How many neighbours' weights are found at a time."""
    return CPU_BATCH if device.is_cpu else GPU_BATCH


@cache
def sweep(space: Space, kernel: str, batch: int = CPU_BATCH) -> Sweep:
    """The pass for one smoothing function, with so many neighbours' weights found at a time.

    Loops are written with `while` and without branches, since that is what compilers turn into SIMD.
    """
    types = space.types
    real, vector, tensor, phi = space.real, types.vector, types.tensor, types.phi
    Point, dim, length = types.Point, space.dim, space.dim + types.size
    row, rows, with_outer = (
        space.vec(length),
        space.mat(dim, length),
        add_outer(dim, length, space.precision),
    )
    real_batch = space.vec(batch)
    weights = SMOOTHING_FUNCTIONS[kernel](space.precision)
    inverse = space.algebra.symmetric_inverse
    support_squared = EDGE * KERNELS[kernel].support ** 2
    packed_points, packed_volumes, packed_list = (
        packed(arrays) for arrays in (wp.array(dtype=Point), wp.array(dtype=real), PairList)
    )

    @wp.struct
    class Sums:
        base: phi
        w: real  # Σ V W
        w_d: row  # Σ V W d, d = (x_J − x_I, φ_J − base)
        g: vector  # Σ V ∇W
        g_d: rows  # Σ V ∇W ⊗ d

    @wp.func
    def neighbour(place: int, pairs: PairList):
        natural(place)
        j = pairs.index[place]
        natural(j)
        return j

    @wp.func
    def weigh(x: vector, metric: tensor, first: int, count: int, pairs: PairList, sources: wp.array(dtype=Point)):
        """W and −W′/ξ of so many neighbours from `first` on, zero outside the support."""
        packed_points(sources)
        packed_list(pairs)
        xi2, w, g = real_batch(), real_batch(), real_batch()
        n = wp.int32(0)
        while n < count:
            xi = metric * (sources[neighbour(first + n, pairs)].x - x)
            xi2[n] = wp.dot(xi, xi)
            n += 1
        n = wp.int32(0)
        while n < wp.static(batch):
            w_n, g_n = weights(xi2[n])
            w[n] = wp.where(xi2[n] < real(support_squared), w_n, real(0.0))
            g[n] = wp.where(xi2[n] < real(support_squared), g_n, real(0.0))
            n += 1
        return w, g

    @wp.func
    def collect(
        target: int,
        x: vector,
        metric: tensor,
        base: phi,
        pairs: PairList,
        sources: wp.array(dtype=Point),
        volume: wp.array(dtype=real),
    ):
        packed_points(sources)
        packed_volumes(volume)
        packed_list(pairs)
        sums = Sums()
        sums.base = base
        first, end = int(pairs.start[target]), pairs.start[target + 1]
        while first < end:
            count = wp.min(end - first, wp.static(batch))
            w, g = weigh(x, metric, first, count, pairs, sources)
            n = wp.int32(0)
            while n < count:
                j = neighbour(first + n, pairs)
                point = sources[j]
                r = point.x - x
                d = row()
                d[: wp.static(dim)] = r
                d[wp.static(dim) :] = point.phi - base
                w_n, g_n = w[n] * volume[j], g[n] * volume[j]
                grad_w = g_n * r
                sums.w += w_n
                sums.w_d += w_n * d
                sums.g += grad_w
                sums.g_d = with_outer(sums.g_d, grad_w, d)
                n += 1
            first += count
        return sums

    @wp.func
    def value(sums: Sums):
        result = sums.base
        if sums.w > real(0.0):
            result += sums.w_d[wp.static(dim) :] / sums.w
        return result

    @wp.func
    def gradient(sums: Sums, own: phi):
        a, b = sums.g_d[:, : wp.static(dim)], sums.g_d[:, wp.static(dim) :]
        return wp.transpose(inverse(a) * (b - wp.outer(sums.g, own - sums.base)))

    @wp.func
    def round_metric(h: real):
        metric = tensor()
        for k in range(wp.static(dim)):
            metric[k, k] = real(1.0) / h
        return metric

    def cell_metric(ratio: float):
        @wp.func
        def metric_of(frame: tensor, h: real):
            if wp.ddot(frame, frame) <= real(0.0):
                return round_metric(h)
            return real(wp.static(1.0 / ratio)) * frame

        return metric_of

    return Sweep(collect, value, gradient, round_metric, cell_metric)
