"""Motion: the configuration of the half step, and step 14, in which nodes move and the rest follows them.

Sweeps see the configuration of tⁿ throughout a step. Fluxes at t^{n+1/2} belong in that of t^{n+1/2},
x^{n+1/2} = xⁿ + (Δt/2) v^{n+1/2}, and the chain rule takes gradients there: ∇φ ← ∇φ (1 + (Δt/2) L)⁻¹. Without it a
rigid rotation Ω strains a body by −Ω² Δt/2 in every direction, an error of first order in Δt that adds up to
−π Ω Δt a turn; with it L is skew, and errors are of second order (Hughes and Winget 1980).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..physics.space import Space
from ..scene.numerics import KERNELS
from ..scene.scene import Scene


@dataclass(frozen=True)
class NoMotion:
    """Small displacements: the initial configuration is kept."""

    kernels: tuple[wp.Kernel, ...] = ()

    def move(self, nodes, auxiliary, dt: wp.array) -> None:
        """Nothing."""

    def mark(self, nodes, auxiliary) -> None:
        """Nothing."""

    def shrinkage(self, nodes, auxiliary) -> float:
        """1: the spacing stays."""
        return 1.0


class Motion:
    """Moves the nodes with v^{n+1/2}, and tells when the pair lists have used up their skin.

    Args:
        scene: the scene.
        skin: skin of the pair lists [m].
        outdated: one integer, set once some node has used up its half of the skin since `mark`.
    """

    def __init__(self, scene: Scene, skin: float, space: Space, launcher: Launcher, outdated: wp.array):
        device, n = launcher.device, len(scene.mesh.nodes)
        types = space.types
        self._support, self._skin = KERNELS[scene.numerics.kernel].support, skin
        self._reference_density = scene.material.density
        self._initial_smoothing_length: wp.array | None = None
        self._listed = wp.zeros(n, dtype=types.vector, device=device)
        self._listed_h = wp.zeros(n, dtype=space.real, device=device)
        self._launcher, self._outdated = launcher, outdated
        self._kernel = _move_kernel(space)
        self._centre = centre_kernel(space)
        self.kernels = (self._kernel, self._centre)

    def mark(self, nodes, auxiliary) -> None:
        """Remember where the nodes are now: the pair lists were just built for this."""
        if self._initial_smoothing_length is None:
            self._initial_smoothing_length = wp.clone(nodes.smoothing_length)
        wp.copy(self._listed, nodes.displacement)
        wp.copy(self._listed_h, nodes.smoothing_length)
        self._outdated.zero_()

    def shrinkage(self, nodes, auxiliary) -> float:
        """1: the published schemes keep their step, since their viscosity depends on it."""
        return 1.0

    def move(self, nodes, auxiliary, dt: wp.array) -> None:
        """x ← x + Δt v^{n+1/2}, ρ ← ρ/(change of volume), h ← h₀ (ρ₀/ρ)^{1/d}, auxiliary nodes re-centred."""
        inputs = [self._reference_density, self._initial_smoothing_length, self._support, 0.5 * self._skin, dt]
        inputs += [self._listed, self._listed_h, nodes, self._outdated]
        self._launcher.launch(self._kernel, nodes.point, inputs, gathers=False)
        self._launcher.launch(self._centre, auxiliary.point, [nodes, auxiliary])


@cache
def half_step_gradient(space: Space) -> wp.Function:
    """(∇φ in the configuration of tⁿ, Δt) → (∇φ in that of t^{n+1/2}, its volume over that of tⁿ)."""
    dim, real, phi = space.dim, space.real, space.phi
    velocity_gradient, determinant = phi.velocity_gradient, space.algebra.determinant
    identity = space.mat(dim, dim)(np.eye(dim))

    @wp.func
    def to_half_step(gradient: phi.gradient, dt: real):
        stretch = identity + (real(0.5) * dt) * velocity_gradient(gradient)
        if wp.static(dim == 1):
            return gradient / stretch[0, 0], stretch[0, 0]
        else:
            return gradient * wp.inverse(stretch), determinant(stretch)

    return to_half_step


@cache
def initial_gradient(space: Space) -> wp.Function:
    """The same for small displacements: the initial configuration is the only one."""
    phi, real = space.phi, space.real

    @wp.func
    def unchanged(gradient: phi.gradient, dt: real):
        return gradient, real(1.0)

    return unchanged


@cache
def _move_kernel(space: Space):
    types = space.types
    real, vector, MaterialNodes = space.real, types.vector, types.MaterialNodes
    dim = space.dim
    determinant = space.algebra.determinant
    identity = types.tensor(np.eye(dim))

    @forward_kernel
    def move(
        first: int,
        reference_density: real,
        initial_smoothing_length: wp.array(dtype=real),
        support: real,
        half_skin: real,
        dt: wp.array(dtype=real),
        listed: wp.array(dtype=vector),
        listed_h: wp.array(dtype=real),
        nodes: MaterialNodes,
        outdated: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        u = nodes.displacement[i] + dt[0] * nodes.half_velocity[i]
        # The exact change of volume of the map xⁿ → xⁿ + Δt v, whose gradient is (1 + ½ΔtL)(1 − ½ΔtL)⁻¹ when L
        # refers to the half step; to first order 1 + Δt tr(d).
        half_stretch = real(0.5) * dt[0] * nodes.velocity_gradient[i]
        volume_ratio = determinant(identity + half_stretch) / determinant(identity - half_stretch)
        density = nodes.density[i] / volume_ratio
        h = initial_smoothing_length[i] * wp.pow(reference_density / density, real(wp.static(1.0 / dim)))
        nodes.displacement[i] = u
        nodes.point[i].x = nodes.reference[i] + u
        nodes.volume[i] = nodes.weight[i] / density
        nodes.density[i] = density
        nodes.smoothing_length[i] = h
        # A pair inside the support now was inside support + skin at `mark` while this holds at both its ends.
        if wp.length(u - listed[i]) + support * wp.max(h - listed_h[i], real(0.0)) > half_skin:
            outdated[0] = 1

    return move


@cache
def centre_kernel(space: Space):
    """Places auxiliary nodes in the middle of their cells, with mean volume, density and smoothing length."""
    types = space.types
    real, vector = space.real, types.vector
    MaterialNodes, AuxiliaryNodes = types.MaterialNodes, types.AuxiliaryNodes
    corners = 2**space.dim

    @forward_kernel
    def centre(first: int, nodes: MaterialNodes, auxiliary: AuxiliaryNodes):
        a = first + wp.tid()
        x = vector()
        volume, density, h = real(0.0), real(0.0), real(0.0)
        for k in range(wp.static(corners)):
            i = auxiliary.cell[a, k]
            x += nodes.point[i].x
            volume += nodes.volume[i]
            density += nodes.density[i]
            h += nodes.smoothing_length[i]
        share = real(wp.static(1.0 / corners))
        auxiliary.point[a].x = share * x
        auxiliary.volume[a] = share * volume
        auxiliary.density[a] = share * density
        auxiliary.smoothing_length[a] = share * h

    return centre
