"""Cells by the modes of their corners: gradients, forces and hourglass modes of every kind by one formula.

With constant weights T a cell's corner values f_k become modes f_m = Σ_k T_km f_k. Of a simplex they are the
differences to corner 0. Of a grid's cell, with ξ_a = ±1 at the corners, they are the coefficients of
f = f_0 + Σ_a f_a ξ_a + Σ_ab f_ab ξ_a ξ_b + …, those of two axes and more its hourglass modes. Then

    A_T G_T v = Σ_m v_m ⊗ B_m,        B_m = ∂A_T/∂x_m,        f_k = −Σ_m T_km F_m,

the gradient's mean over the cell, exact on any cell, and its adjoint: the power of a stress S that is constant in
a cell is A S : G v, and F_m = S B_m. Constant stresses are in equilibrium, since Σ_T A_T is the body's volume
(Flanagan and Belytschko 1981). An hourglass mode without its linear part, q_m = v_m − (G v) x_m, adds to the
gradient at a corner κ Σ_a q_m ⊗ ∇ξ_a Π_{b in m, b ≠ a} ξ_b: what alternates along a alone is of mode m without a.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..mesh.kinds import CellKind
from ..physics.space import Space


@dataclass(frozen=True)
class CellShape:
    """The functions of one kind of cell.

    Attributes:
        modes: how many there are; the first d are linear, the others hourglass modes.
        partial: how many of them, the first ones, are parts of another one: those that stresses have to know.
        joined: the hourglass mode that mode p and axis a make, −1 where they make none, shape (partial, d). A
            table, since with `wp.static` of a loop's variable Warp builds a kernel anew to find it in its cache.
        weights: T, shape (c, modes).
        signs: ±1 of each corner in each mode of a grid's cell, shape (c, modes).
        Modes: Warp matrix of the modes of a vector, a row each.
        measure: Modes of x → (B_m in row m, A_T, ∇ξ_a in row a).
        spread: B → A_T² Σ_j ∇N_j ⊗ ∇N_j, of the linear modes.
        bend: (Modes of x, ∇ξ_a) → b² = Σ (∇ξ_a · x_m)² over hourglass modes and their axes: of a
            parallelogram 0, as a corner folds between ½ and 1.
    """

    modes: int
    partial: int
    joined: object
    weights: object
    signs: object
    Modes: type
    measure: wp.Function
    spread: wp.Function
    bend: wp.Function


@cache
def cell_shape(space: Space, kind: CellKind) -> CellShape:
    """The functions of a kind of cell in a space."""
    d = space.dim
    axes = (*((a,) for a in range(d)), *kind.modes)
    if kind.grid:
        weights = np.array([[side[list(m)].prod() for m in axes] for side in kind.sides]) / kind.corners
    else:
        weights = np.array(kind.gradients)
    modes, partial = len(axes), len(axes) - 1 if kind.modes else 0
    number = {frozenset(mode): m for m, mode in enumerate(axes)}
    joined = [number.get(frozenset({a, *p}), -1) if a not in p else -1 for p in axes[:partial] for a in range(d)]
    matrix = space.mat(kind.corners, modes)
    joined = wp.types.matrix((max(1, partial), d), wp.int32)(*(joined or [-1] * d))
    return CellShape(
        modes=modes,
        partial=partial,
        joined=joined,
        weights=matrix(*weights.ravel().tolist()),
        signs=matrix(*np.sign(weights).ravel().tolist()),
        Modes=space.mat(modes, d),
        measure=_measure(space, kind, axes),
        spread=_spread(space, weights),
        bend=_bend(space, modes, joined),
    )


@cache
def _cofactor(space: Space) -> wp.Function:
    """Vectors e_a in the rows of a matrix → ∂ det/∂e_a in row a."""
    matrix, real, dim = space.types.tensor, space.real, space.dim

    @wp.func
    def cofactor(e: matrix):
        if wp.static(dim == 1):
            return matrix(real(1.0))
        elif wp.static(dim == 2):
            return matrix(e[1, 1], -e[1, 0], -e[0, 1], e[0, 0])
        else:
            a, b, c = wp.cross(e[1], e[2]), wp.cross(e[2], e[0]), wp.cross(e[0], e[1])
            return matrix(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2])

    return cofactor


@cache
def _measure(space: Space, kind: CellKind, axes: tuple[tuple[int, ...], ...]) -> wp.Function:
    real, Modes, tensor, d = space.real, space.mat(len(axes), space.dim), space.types.tensor, space.dim
    cofactor, size = _cofactor(space), 2.0**space.dim if kind.grid else kind.volume
    third, warped = 1.0 / 3.0, kind.grid and d == 3
    twists = [axes.index(pair) for pair in ((0, 1), (0, 2), (1, 2))] if warped else []

    @wp.func
    def measure(x: Modes):
        e = tensor()
        for a in range(wp.static(d)):
            for k in range(wp.static(d)):
                e[a, k] = x[a, k]
        linear = cofactor(e)
        det = real(0.0)
        for k in range(wp.static(d)):
            det += e[0, k] * linear[0, k]
        frame = linear / det  # rows ∇ξ_a, of the cell's linear part
        gradient = Modes()
        if wp.static(warped):  # faces of four corners need not be plane: B of the mean over the cell
            h01 = x[wp.static(twists[0])]
            h02 = x[wp.static(twists[1])]
            h12 = x[wp.static(twists[2])]
            m0 = linear[0] + real(third) * wp.cross(h01, h02)
            m1 = linear[1] + real(third) * wp.cross(h12, h01)
            m2 = linear[2] + real(third) * wp.cross(h02, h12)
            r01 = real(third) * (wp.cross(e[1], h12) + wp.cross(h02, e[0]))
            r02 = real(third) * (wp.cross(h12, e[2]) + wp.cross(e[0], h01))
            r12 = real(third) * (wp.cross(e[2], h02) + wp.cross(h01, e[1]))
            for k in range(3):
                gradient[0, k] = m0[k]
                gradient[1, k] = m1[k]
                gradient[2, k] = m2[k]
                gradient[wp.static(twists[0]), k] = r01[k]
                gradient[wp.static(twists[1]), k] = r02[k]
                gradient[wp.static(twists[2]), k] = r12[k]
        else:
            for a in range(wp.static(d)):
                for k in range(wp.static(d)):
                    gradient[a, k] = linear[a, k]
        gradient = real(size) * gradient
        return gradient, wp.ddot(x, gradient) / real(d), frame

    return measure


def _spread(space: Space, weights: np.ndarray) -> wp.Function:
    """B → Σ_k (Σ_a T_ka B_a) ⊗ (Σ_b T_kb B_b) = Bᵀ (TᵀT) B, a and b the linear modes."""
    tensor, d = space.types.tensor, space.dim
    shared = tensor(*(weights[:, :d].T @ weights[:, :d]).ravel().tolist())

    @wp.func
    def spread(B: space.mat(weights.shape[1], d)):
        linear = tensor()
        for a in range(wp.static(d)):
            linear[a] = B[a]
        return wp.transpose(linear) * shared * linear

    return spread


def _bend(space: Space, modes: int, joined: object) -> wp.Function:
    real, tensor, d, parts = space.real, space.types.tensor, space.dim, joined._shape_[0]

    @wp.func
    def bend(x: space.mat(modes, space.dim), frame: tensor):
        result = real(0.0)
        for p in range(wp.static(parts)):
            for a in range(wp.static(d)):
                m = joined[p, a]
                if m >= 0:
                    share = wp.dot(x[m], frame[a])
                    result += share * share
        return result

    return bend
