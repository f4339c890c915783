"""Colours of a quantity: a colour map, and the span of values it stands for.

Single nodes at a singularity, a footing's edge above all, have values far beyond all others. The span leaves them
out, and the colour bar says that there is something beyond.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np

from ..errors import SceneError, one_of
from .frames import Frame
from .quantity import Quantity

COLOUR_MAP = "cividis"  # readable with every common colour-vision deficiency, and in grey
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


def colour_span(values: np.ndarray) -> tuple[float, float]:
    """The middle 99 % of the values: a single node at a footing's edge would hide all others.

    From zero on where all values are positive and come near it.
    """
    return span_of([percentiles(values)])


def percentiles(values: np.ndarray) -> np.ndarray:
    """The smallest value and the ends of the middle 99 %, shape (3,)."""
    return np.percentile(values, [0.0, 0.5, 99.5])


def span_of(several: Sequence[np.ndarray]) -> tuple[float, float]:
    """The span of colours that shows several pictures, each given by its `percentiles`."""
    smallest, low, high = np.min(several, axis=0)[0], np.min(several, axis=0)[1], np.max(several, axis=0)[2]
    low = 0.0 if smallest >= 0.0 and low < 0.2 * high else low
    return float(low), float(high if high > low else low + 1.0)


def beyond(values: np.ndarray, span: tuple[float, float]) -> str:
    """On which sides values lie beyond a span of colours, as `Figure.colorbar` wants it."""
    below, above = bool(values.min() < span[0]), bool(values.max() > span[1])
    return {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[
        below, above
    ]
