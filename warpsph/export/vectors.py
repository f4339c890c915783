"""Vectors as file formats want them: with three components, whatever the body has."""

from __future__ import annotations

import numpy as np


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, d) with three components (n, 3): zero along the axes they do not have."""
    space = np.zeros((len(vectors), 3), dtype=vectors.dtype)
    space[:, : vectors.shape[1]] = vectors
    return space
