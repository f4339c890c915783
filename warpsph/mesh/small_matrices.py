"""Many matrices of one to three rows at once, in closed form: NumPy goes through them one by one."""

from __future__ import annotations

import numpy as np


def determinants(matrices: np.ndarray) -> np.ndarray:
    """Determinants of matrices (m, d, d), shape (m,)."""
    rows = matrices.transpose(1, 2, 0)
    if len(rows) == 1:
        return rows[0, 0].copy()
    if len(rows) == 2:
        (a, b), (c, d) = rows
        return a * d - b * c
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def least_singular_values(matrices: np.ndarray) -> np.ndarray:
    """Least singular values of matrices (m, d, d), shape (m,), to rounding however flat they are.

    It is |det J| over the product of the others: over the largest singular value of J in the plane, over that of
    the cofactors of J in space.
    """
    rows = np.ascontiguousarray(matrices.transpose(1, 2, 0))
    size = np.abs(determinants(rows.transpose(2, 0, 1)))
    if len(rows) == 1:
        return size
    if len(rows) == 3:
        rows = np.array([np.cross(rows[k - 2], rows[k - 1], axis=0) for k in range(3)])
    return size / np.sqrt(_largest_eigenvalues(np.einsum("ikm,jkm->ijm", rows, rows)))


def _largest_eigenvalues(a: np.ndarray) -> np.ndarray:
    """Largest eigenvalues of symmetric matrices (d, d, m), d two or three, shape (m,)."""
    mean = np.trace(a) / len(a)
    if len(a) == 2:
        return mean + np.hypot(a[0, 0] - mean, a[0, 1])
    b = a - mean * np.eye(3)[:, :, None]
    spread = np.sqrt(np.sum(b * b, axis=(0, 1)) / 6.0)
    cubed = np.where(spread > 0.0, spread, 1.0) ** 3
    third = np.arccos(np.clip(determinants(b.transpose(2, 0, 1)) / (2.0 * cubed), -1.0, 1.0)) / 3.0
    return mean + 2.0 * spread * np.cos(third)
