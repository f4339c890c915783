"""Which parts of a graph hang together."""

from __future__ import annotations

import numpy as np


def components(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The least number that hangs together with each of `count` numbers, shape (count,).

    Args:
        first, second: the two ends of each link, shape (l,).
    """
    root = np.arange(count)
    while True:
        a, b = root[first], root[second]
        low, high = np.minimum(a, b), np.maximum(a, b)
        apart = low != high
        if not apart.any():
            return root
        np.minimum.at(root, high[apart], low[apart])
        while not np.array_equal(root, root[root]):
            root = root[root]
