"""Signs of an unstable run: points that clump, amplitudes that grow."""

from __future__ import annotations

import numpy as np


def smallest_distance(points: np.ndarray) -> float:
    """Distance of the two nearest of n points [m], shape (n, d): what tensile clumping drives to zero.

    >>> smallest_distance(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 6.0]]))
    2.0
    """
    ordered = points[np.argsort(points[:, 0])]
    smallest = np.inf
    for k in range(1, len(points)):  # k-th neighbours in x: their gaps in x grow with k
        gaps = ordered[k:] - ordered[:-k]
        if gaps[:, 0].min() >= smallest:
            break
        smallest = min(smallest, np.linalg.norm(gaps, axis=1).min())
    return float(smallest)


def growth_rate(time: np.ndarray, amplitude: np.ndarray, *, low: float, high: float) -> float:
    """Rate s [1/s] of A ∝ exp(s t), fitted (least squares of ln A) from where A last left `low` to `high`.

    An amplitude that never reaches `high` is fitted over its second half, where the start's transient is over.

    Args:
        time: [s], shape (k,), rising.
        amplitude: A > 0, shape (k,).
        low, high: between which amplitudes.

    >>> t = np.linspace(0.0, 1.0, 11)
    >>> round(growth_rate(t, 1e-3 * np.exp(5.0 * t), low=2e-3, high=0.1), 9)
    5.0
    """
    time, amplitude = np.asarray(time), np.asarray(amplitude)
    above = np.flatnonzero(amplitude >= high)
    if len(above):
        below = np.flatnonzero(amplitude[: above[0]] <= low)
        window = slice(below[-1] if len(below) else 0, above[0] + 1)
    else:
        window = slice(len(time) // 2, None)
    return float(np.polyfit(time[window], np.log(amplitude[window]), 1)[0])
