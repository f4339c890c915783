"""How a scene is discretised: the choices of the method, by name, with their defaults."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..validate import choice, number
from .registry import KERNELS
from .scheme import Scheme, scheme_of
from .smoothing import SmoothingKernel

SOURCE_SCHEMES = ("analytic", "rk4")
# What Blanc and Pastor computed their cases with: the published step filters least at the largest step.
PUBLISHED = {"velocity_scheme": "blanc-pastor", "source_scheme": "rk4", "courant": 1.0}
MOST_SHARPENING = 0.7  # more turns dispersion round, and shortens the stable step


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """Choices of the discretisation.

    Args:
        velocity_scheme: the name of a scheme: `cells` (energy-conjugate, any kind of cell; docs/method.md,
            section 8), `blanc-pastor` (the published 2 v^{n+1/2} − v) or `taylor` (the paper's complete scheme).
        courant: c_p Δt/Δx [-], c_p the fastest wave's speed.
        source_scheme: `analytic` (no limit to the step) or `rk4` (as published, sub-stepped where stiff; of sums
            over neighbours only).
        kernel: smoothing kernel of sums over neighbours: gaussian (the paper's, and what they take unless another
            is given), cubic_spline, wendland_c2 or one that was registered. None with `cells`.
        smoothing_ratio: smoothing length over spacing h/Δx [-] of sums over neighbours; the kernel's own default
            unless given. None with `cells`.
        time_step: Δt [s]; from `courant` and the stiffness of the sources unless given.
        sharpening: c of `cells` [-], 0 to 0.7: how far what a mean over a cell's corners takes off short waves is
            put back (docs/method.md, section 8). Fronts, bending and waves gain, a step takes longer. Unless given
            ⅔ (1 − C²/4), C = c_p Δt over the mean size of the cells: waves along a lattice are then not dispersed.
            None with sums over neighbours.
    """

    velocity_scheme: str = "cells"
    courant: float = 0.8
    source_scheme: str = "analytic"
    kernel: str | None = None
    smoothing_ratio: float | None = None
    time_step: float | None = None
    sharpening: float | None = None

    def __post_init__(self):
        scheme = scheme_of(self.velocity_scheme)
        choice("source_scheme", self.source_scheme, SOURCE_SCHEMES)
        if scheme.sums is None:
            self._refuse_what_sums_take()
            if self.sharpening is not None:
                sharpening = number("sharpening", self.sharpening, at_least=0.0, at_most=MOST_SHARPENING)
                object.__setattr__(self, "sharpening", sharpening)
        else:
            if self.sharpening is not None:
                allowed = f"velocity_scheme {self.velocity_scheme} knows none; leave it out"
                raise SceneError("sharpening", self.sharpening, allowed)
            kernel = "gaussian" if self.kernel is None else self.kernel
            object.__setattr__(self, "kernel", choice("kernel", kernel, KERNELS))
            ratio = self.smoothing.smoothing_ratio if self.smoothing_ratio is None else self.smoothing_ratio
            object.__setattr__(self, "smoothing_ratio", number("smoothing_ratio", ratio, above=0.0))
        object.__setattr__(self, "courant", number("courant", self.courant, above=0.0))
        if self.time_step is not None:
            object.__setattr__(self, "time_step", number("time_step", self.time_step, above=0.0))

    def _refuse_what_sums_take(self) -> None:
        for name in ("kernel", "smoothing_ratio"):
            if getattr(self, name) is not None:
                allowed = f"velocity_scheme {self.velocity_scheme} takes no sums over neighbours; leave it out"
                raise SceneError(name, getattr(self, name), allowed)
        if self.source_scheme != "analytic":
            allowed = f"velocity_scheme {self.velocity_scheme} takes analytic only"
            raise SceneError("source_scheme", self.source_scheme, allowed)

    @property
    def smoothing(self) -> SmoothingKernel:
        """The smoothing kernel that `kernel` names, of a scheme with sums over neighbours."""
        return KERNELS[self.kernel]

    @property
    def scheme(self) -> Scheme:
        """The scheme that `velocity_scheme` names."""
        return scheme_of(self.velocity_scheme)

    def sharpening_of(self, mesh: Mesh, wave_speed: float, *, spacing: float) -> float:
        """c of `cells` for waves of that speed [m/s], with Δx of the Courant number as it is in the body [m]."""
        if self.sharpening is not None:
            return self.sharpening
        advance = self.courant * spacing  # c_p Δt
        if self.time_step is not None:
            advance = wave_speed * self.time_step
        size = (np.mean(mesh.cell_volumes()) / mesh.kind.volume) ** (1.0 / mesh.dim)  # of a lattice Δx, as mapped
        return 2.0 / 3.0 * (1.0 - 0.25 * float(advance / size) ** 2)

    @property
    def support(self) -> float:
        """Radius of the support over spacing [-], of a scheme with sums over neighbours."""
        return self.smoothing.support * self.smoothing_ratio

    def check_support(self, mesh: Mesh) -> None:
        """Refuse a support that is too small for the longest cell edge, or far too large; cells have none."""
        if self.scheme.sums is None:
            return
        support, continuum = self.smoothing.support, mesh.continuum
        reach = continuum.smallest_support * mesh.largest_edge() / mesh.spacing
        least, most = reach / support, self.scheme.sums.largest_support / support
        if not least < self.smoothing_ratio <= most:
            raise SceneError(
                "smoothing_ratio",
                self.smoothing_ratio,
                f"with kernel {self.kernel} and scheme {self.velocity_scheme} in {continuum.dim}D it must be "
                f"above {least:.4g} (the support must reach {reach:.3g} spacings) and at most {most:.4g}",
            )
