"""How a scene is discretised: the choices of the method, by name, with their defaults."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import SceneError
from ..mesh.continuum import Continuum
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
        kernel: smoothing kernel: gaussian (the paper's), cubic_spline, wendland_c2 or one that was registered.
        smoothing_ratio: smoothing length over spacing h/Δx [-]; the kernel's own default unless given. With
            `compatible` keep the support below 2.12 Δx, and it must be at most 2.55 Δx: see
            docs/velocity_steps.md, "What still fails".
        courant: c_p Δt/Δx [-], c_p the fastest wave's speed.
        velocity_scheme: the name of a scheme: `compatible` (no numerical viscosity; docs/velocity_steps.md),
            `cells` (energy-conjugate, any kind of cell; docs/method.md, section 8),
            `blanc-pastor` (the published 2 v^{n+1/2} − v) or `taylor` (the paper's complete scheme).
        source_scheme: `analytic` (no limit to the step) or `rk4` (as published, sub-stepped where stiff).
        time_step: Δt [s]; from `courant` and the stiffness of the sources unless given.
        sharpening: c of `cells` [-], 0 to 0.7: how far what a mean over a cell's corners takes off short waves is
            put back (docs/method.md, section 8). Fronts, bending and waves gain, a step takes longer.
    """

    kernel: str = "gaussian"
    smoothing_ratio: float | None = None
    courant: float = 0.8
    velocity_scheme: str = "compatible"
    source_scheme: str = "analytic"
    time_step: float | None = None
    sharpening: float = 2.0 / 3.0

    def __post_init__(self):
        choice("kernel", self.kernel, KERNELS)
        scheme_of(self.velocity_scheme)
        choice("source_scheme", self.source_scheme, SOURCE_SCHEMES)
        ratio = self.smoothing.smoothing_ratio if self.smoothing_ratio is None else self.smoothing_ratio
        object.__setattr__(self, "smoothing_ratio", number("smoothing_ratio", ratio, above=0.0))
        object.__setattr__(self, "courant", number("courant", self.courant, above=0.0))
        if self.time_step is not None:
            object.__setattr__(self, "time_step", number("time_step", self.time_step, above=0.0))
        sharpening = number("sharpening", self.sharpening, at_least=0.0, at_most=MOST_SHARPENING)
        object.__setattr__(self, "sharpening", sharpening)

    @property
    def smoothing(self) -> SmoothingKernel:
        """The smoothing kernel that `kernel` names."""
        return KERNELS[self.kernel]

    @property
    def scheme(self) -> Scheme:
        """The scheme that `velocity_scheme` names."""
        return scheme_of(self.velocity_scheme)

    @property
    def support(self) -> float:
        """Radius of the support over spacing [-]."""
        return self.smoothing.support * self.smoothing_ratio

    def check_support(self, continuum: Continuum, stretch: float = 1.0) -> None:
        """Refuse a support that is too small (or absurdly large) for the lattice.

        Args:
            continuum: the continuum, for its number of dimensions.
            stretch: longest cell edge over spacing, 1 on a regular lattice.
        """
        if self.scheme.stepper is not None:  # it takes no sums over neighbours
            return
        support = self.smoothing.support
        least = continuum.smallest_support * stretch / support
        most = self.scheme.largest_support(continuum.dim) / support
        if not least < self.smoothing_ratio <= most:
            reach = continuum.smallest_support * stretch
            raise SceneError(
                "smoothing_ratio",
                self.smoothing_ratio,
                f"with kernel {self.kernel} and scheme {self.velocity_scheme} in {continuum.dim}D it must be "
                f"above {least:.4g} (the support must reach {reach:.3g} spacings) and at most {most:.4g}",
            )
