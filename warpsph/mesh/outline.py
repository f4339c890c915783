"""The outline of a plane figure, a closed row of corners: what lies inside it, and where it meets itself."""

from __future__ import annotations

import numpy as np


def inside(points: np.ndarray, corners: np.ndarray, slack: float) -> np.ndarray:
    """Which points lie inside an outline; one that lies on it, to within `slack`, does not.

    So a point is judged alike wherever the figure stands and however it is turned or mirrored, and rounding does
    not decide. Elsewhere the even-odd rule holds: a ray in +x crosses the outline an odd number of times.

    Args:
        points: [m], shape (…, 2).
        corners: in order, either way round [m], shape (k, 2).
        slack: [m].
    """
    x, y = points[..., 0], points[..., 1]
    odd, on = np.zeros(x.shape, dtype=bool), np.zeros(x.shape, dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        dx, dy = x1 - x0, y1 - y0
        along = np.clip(((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
        on |= np.hypot(x - x0 - along * dx, y - y0 - along * dy) <= slack
        if y0 != y1:
            crosses = (y0 > y) != (y1 > y)
            odd ^= crosses & (x < x0 + (y - y0) / dy * dx)
    return odd & ~on


def area(corners: np.ndarray) -> float:
    """Area inside an outline that does not meet itself [m²]."""
    x, y = (corners - corners[0]).T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))


def meeting_sides(corners: np.ndarray) -> tuple[int, int] | None:
    """Two sides of an outline that meet elsewhere than in the corner they share; None where it is simple.

    Side k runs from corner k to the next one.
    """
    ends, count = np.roll(corners, -1, axis=0), len(corners)
    sides, low, high = ends - corners, np.minimum(corners, ends), np.maximum(corners, ends)
    for k, side in enumerate(sides):
        following = (k + 1) % count
        turn = side[0] * sides[following, 1] - side[1] * sides[following, 0]
        if turn == 0.0 and side @ sides[following] <= 0.0:
            return k, following
        others = np.arange(k + 2, count - (k == 0))
        apart = _same_side(corners[k], ends[k], corners[others], ends[others])
        apart |= _same_side(corners[others], ends[others], corners[k], ends[k])
        apart |= (low[others] > high[k]).any(axis=1) | (low[k] > high[others]).any(axis=1)
        if not apart.all():
            return k, int(others[~apart][0])
    return None


def _same_side(a, b, c, d) -> np.ndarray:
    """Whether c and d lie on one side of the line through a and b, neither of them on it."""
    line, left, right = b - a, c - a, d - a
    one = line[..., 0] * left[..., 1] - line[..., 1] * left[..., 0]
    other = line[..., 0] * right[..., 1] - line[..., 1] * right[..., 0]
    return one * other > 0.0
