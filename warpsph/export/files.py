"""What every writer of files needs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A hidden path beside `path` to write to: it takes the place of `path` when all went well, and else goes.

    So that what dies while it writes leaves the former file, or none, but never half a file.
    """
    temporary = path.with_name(f".{path.stem}.part{path.suffix}")
    temporary.unlink(missing_ok=True)
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, d) with three components (n, 3): zero along the axes they do not have."""
    space = np.zeros((len(vectors), 3), dtype=vectors.dtype)
    space[:, : vectors.shape[1]] = vectors
    return space
