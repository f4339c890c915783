"""The three kinds of continuum, by dimension, and how each lays out its stresses."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Continuum:
    """A continuum of `dim` space dimensions.

    Attributes:
        name: `bar` (uniaxial stress), `plane_strain` or `solid`.
        dim: number of space dimensions d.
        pairs: tensor indices (i, j), counted from 0, of each stored stress component.
        edges: name of the edge on the low and on the high side of each axis.
    """

    name: str
    dim: int
    pairs: tuple[tuple[int, int], ...]
    edges: tuple[str, ...]

    @property
    def stress_size(self) -> int:
        """Number of stored stress components."""
        return len(self.pairs)

    @property
    def stress_components(self) -> tuple[str, ...]:
        """Names of the stored stress components: s11, s22, …"""
        return tuple(f"s{i + 1}{j + 1}" for i, j in self.pairs)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return ("x", "y", "z")[: self.dim]

    @property
    def smallest_support(self) -> float:
        """Support radius in lattice spacings below which a corner node can not form a gradient.

        A corner node must see, besides the auxiliary node of its own cell, the ones of the cells next to it:
        r² = (3/2)² + (d − 1)/4 (METHOD section 2: 1.58 in two dimensions). In one dimension one neighbour is
        enough (0.5); the rest is room for stretching.
        """
        return 1.0 if self.dim == 1 else (2.0 + self.dim / 4.0) ** 0.5


BAR = Continuum("bar", 1, ((0, 0),), ("left", "right"))
PLANE_STRAIN = Continuum("plane_strain", 2, ((0, 0), (1, 1), (0, 1), (2, 2)), ("left", "right", "bottom", "top"))
SOLID = Continuum(
    "solid",
    3,
    ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)),
    ("left", "right", "front", "back", "bottom", "top"),
)
CONTINUA = {1: BAR, 2: PLANE_STRAIN, 3: SOLID}
