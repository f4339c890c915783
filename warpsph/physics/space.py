"""What the kernels of one continuum in one precision are written in: its types, and the functions on them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..device.linear_algebra import LinearAlgebra, linear_algebra
from ..device.precision import Precision
from ..mesh.continuum import Continuum
from .stress import StressFunctions, stress_functions
from .types import NodeTypes, node_types
from .unknowns import Unknowns, unknowns


@dataclass(frozen=True)
class Space:
    """The one argument of kernel factories; kernels call its functions through it: `space.phi.velocity(x)`.

    Attributes:
        continuum: bar, plane strain or solid.
        precision: float32 or float64.
    """

    continuum: Continuum
    precision: Precision

    @property
    def dim(self) -> int:
        """Number of dimensions d."""
        return self.continuum.dim

    @property
    def real(self) -> type:
        """The scalar."""
        return self.precision.real

    def vec(self, length: int) -> type:
        """Vector type of that length."""
        return self.precision.vec(length)

    def mat(self, rows: int, columns: int) -> type:
        """Matrix type of that shape."""
        return self.precision.mat(rows, columns)

    @cached_property
    def types(self) -> NodeTypes:
        """Types of vectors, tensors and node sets."""
        return node_types(self.continuum, self.precision)

    @cached_property
    def algebra(self) -> LinearAlgebra:
        """Determinants, inverses and rotations of d × d matrices."""
        return linear_algebra(self.dim, self.precision)

    @cached_property
    def phi(self) -> Unknowns:
        """φ = (v, σ) and how to take it apart."""
        return unknowns(self.continuum, self.precision)

    @cached_property
    def stress(self) -> StressFunctions:
        """Functions of stresses and velocity gradients."""
        return stress_functions(self.continuum, self.precision)
