"""Colours of a quantity: a named colour map over a range that stays the same over all frames."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import matplotlib
import numpy as np

from ..errors import SceneError, one_of
from .frames import Frame
from .plots import COLOUR_MAP, percentiles, span_of
from .quantity import Quantity

SHADES = 1024


@dataclass(frozen=True)
class Colouring:
    """How nodes are coloured.

    Args:
        quantity: by what.
        span: its values at the ends of the map.
        map: name of a matplotlib colour map.
    """

    quantity: Quantity
    span: tuple[float, float]
    map: str = COLOUR_MAP

    def linear(self, values: np.ndarray) -> np.ndarray:
        """Colours (n, 3), float32, of values (n,), in linear light as renderers take them."""
        srgb = matplotlib.colormaps[self.map](np.linspace(0.0, 1.0, SHADES))[:, :3]
        shades = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4).astype(np.float32)
        low, high = self.span
        place = (np.nan_to_num(values) - low) / (high - low) * (SHADES - 1)
        return shades[np.clip(np.rint(place), 0, SHADES - 1).astype(int)]


def named_map(name: str | None) -> str:
    """The name of a colour map, checked; the one of all pictures for None."""
    if name is None:
        return COLOUR_MAP
    if name not in matplotlib.colormaps:
        near = one_of([known for known in matplotlib.colormaps if not known.endswith("_r")], name)
        raise SceneError("--colour-map", name, near)
    return name


def whole_span(quantity: Quantity, frames: Iterable[Frame]) -> tuple[float, float]:
    """The span of a quantity over all frames, single outliers left out."""
    return span_of([percentiles(quantity(frame)) for frame in frames])
