"""Corrected values and gradients (METHOD section 2) from one pass over the neighbours.

    value      φ_I  = Σ V_J φ_J W_IJ / Σ V_J W_IJ                                  (Shepard)
    gradient   ∇φ_I = A_I⁻¹ Σ V_J (φ_J − φ_I) ∇W_IJ,   A_I = Σ V_J ∇W_IJ ⊗ (x_J − x_I)

Both are linear in the neighbours' values, so one pass collects sums and either follows from them, the gradient
for any value φ_I of the point itself. The sums are taken of differences from a base value near the neighbours'
(the one the target had last): in float32 the sums of the values themselves would cancel. Position and values of a
neighbour stand side by side and are added up as one row.
"""

from dataclasses import dataclass
from functools import cache

import warp as wp

from ..device.arrays import natural, packed
from ..device.rows import add_outer
from ..physics.space import Space
from ..scene.smoothing import SmoothingKernel
from ..state.pairs import PairList


@dataclass(frozen=True)
class NeighbourSums:
    """The functions of one pass over the neighbours.

    Attributes:
        collect: (target index, its x and h, base value, pair list, source points, their volumes) → Sums.
        value: Sums → Shepard value; the base value where no neighbour is left.
        gradient: (Sums, φ_I) → ∇φ_I, zero along directions without neighbours.
    """

    collect: wp.Function
    value: wp.Function
    gradient: wp.Function


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
def neighbour_sums(space: Space, kernel: SmoothingKernel, batch: int = CPU_BATCH) -> NeighbourSums:
    """The pass for one smoothing kernel, with so many neighbours' weights found at a time."""
    types, real = space.types, space.real
    length = space.dim + types.size
    row, with_outer = space.vec(length), add_outer(space.dim, length, space.precision)
    weigh, neighbour = _weigh(space, kernel, batch)
    packed_points, packed_volumes = packed(wp.array(dtype=types.Point)), packed(wp.array(dtype=real))
    packed_list = packed(PairList)

    @wp.struct
    class Sums:
        base: types.phi
        w: real  # Σ V W
        w_d: row  # Σ V W d, d = (x_J − x_I, φ_J − base)
        g: types.vector  # Σ V ∇W
        g_d: space.mat(space.dim, length)  # Σ V ∇W ⊗ d

    @wp.func
    def collect(
        target: int,
        x: types.vector,
        h: real,
        base: types.phi,
        pairs: PairList,
        sources: wp.array(dtype=types.Point),
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
            w, g = weigh(x, real(1.0) / h, first, count, pairs, sources)
            n = wp.int32(0)
            while n < count:
                j = neighbour(first + n, pairs)
                point = sources[j]
                r = point.x - x
                d = row()
                d[: wp.static(space.dim)] = r
                d[wp.static(space.dim) :] = point.phi - base
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
            result += sums.w_d[wp.static(space.dim) :] / sums.w
        return result

    @wp.func
    def gradient(sums: Sums, own: types.phi):
        a, b = sums.g_d[:, : wp.static(space.dim)], sums.g_d[:, wp.static(space.dim) :]
        return wp.transpose(space.algebra.symmetric_inverse(a) * (b - wp.outer(sums.g, own - sums.base)))

    return NeighbourSums(collect, value, gradient)


@cache
def _weigh(space: Space, kernel: SmoothingKernel, batch: int) -> tuple[wp.Function, wp.Function]:
    """W and −W′/ξ of so many neighbours at a time, and the index of one.

    Loops are written with `while` and without branches, since that is what compilers turn into SIMD.
    """
    real, numbers, weights = space.real, space.vec(batch), kernel.weights(space.precision)
    support_squared = EDGE * kernel.support**2
    packed_points, packed_list = packed(wp.array(dtype=space.types.Point)), packed(PairList)

    @wp.func
    def neighbour(place: int, pairs: PairList):
        natural(place)
        j = pairs.index[place]
        natural(j)
        return j

    @wp.func
    def weigh(
        x: space.types.vector,
        per_h: real,
        first: int,
        count: int,
        pairs: PairList,
        sources: wp.array(dtype=space.types.Point),
    ):
        """W and −W′/ξ of so many neighbours from `first` on, zero outside the support."""
        packed_points(sources)
        packed_list(pairs)
        xi2, w, g = numbers(), numbers(), numbers()
        n = wp.int32(0)
        while n < count:
            xi = per_h * (sources[neighbour(first + n, pairs)].x - x)
            xi2[n] = wp.dot(xi, xi)
            n += 1
        n = wp.int32(0)
        while n < wp.static(batch):
            w_n, g_n = weights(xi2[n])
            w[n] = wp.where(xi2[n] < real(support_squared), w_n, real(0.0))
            g[n] = wp.where(xi2[n] < real(support_squared), g_n, real(0.0))
            n += 1
        return w, g

    return weigh, neighbour
