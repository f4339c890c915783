"""Motion: the configuration of the half step, and step 14, in which nodes move and the rest follows them.

Sweeps see the configuration of tⁿ throughout a step. Fluxes at t^{n+1/2} belong in that of t^{n+1/2},
x^{n+1/2} = xⁿ + (Δt/2) v^{n+1/2}, and the chain rule takes gradients there: ∇φ ← ∇φ (1 + (Δt/2) L)⁻¹. Without it a
rigid rotation Ω strains a body by −Ω² Δt/2 in every direction, an error of first order in Δt that adds up to
−π Ω Δt a turn; with it L is skew, and errors are of second order (Hughes and Winget 1980).
"""

from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.nodes import SumsBody


class SmallMotion:
    """Small displacements: they add up, but the initial configuration is kept for all sums.

    Args:
        body: the body.
    """

    def __init__(self, body: SumsBody):
        self._body, self._displace = body, _displace_kernel(body.space)
        self.kernels = (self._displace,)

    def move(self, dt: wp.array) -> None:
        """u ← u + Δt v^{n+1/2}."""
        nodes = self._body.nodes
        self._body.launcher.launch(self._displace, nodes.point, [dt, nodes], gathers=False)

    def mark(self) -> None:
        """Nothing."""


class Motion:
    """Moves the nodes with v^{n+1/2}, and tells when the pair lists have used up their skin.

    Args:
        body: the body, whose auxiliary nodes have been centred.
        skin: skin of the pair lists [m].
        outdated: one integer, set once some node has used up its half of the skin since `mark`.
    """

    def __init__(self, body: SumsBody, *, skin: float, outdated: wp.array):
        space, nodes = body.space, body.nodes
        self._body, self._skin, self._outdated = body, skin, outdated
        self._support = body.scene.numerics.smoothing.support
        self._reference_density = body.scene.material.density
        self._initial_smoothing_length = wp.clone(nodes.smoothing_length)
        self._listed = wp.zeros_like(nodes.displacement)
        self._listed_h = wp.zeros_like(nodes.smoothing_length)
        self._move, self._centre = _move_kernel(space), centre_kernel(space, body.kind)
        self.kernels = (self._move, self._centre)

    def mark(self) -> None:
        """Remember where the nodes are now: the pair lists were just built for this."""
        wp.copy(self._listed, self._body.nodes.displacement)
        wp.copy(self._listed_h, self._body.nodes.smoothing_length)

    def move(self, dt: wp.array) -> None:
        """x ← x + Δt v^{n+1/2}, ρ ← ρ/(change of volume), h ← h₀ (ρ₀/ρ)^{1/d}, auxiliary nodes re-centred."""
        nodes, auxiliary, launch = self._body.nodes, self._body.auxiliary, self._body.launcher.launch
        inputs = [self._reference_density, self._initial_smoothing_length, self._support, 0.5 * self._skin, dt]
        inputs += [self._listed, self._listed_h, nodes, self._outdated]
        launch(self._move, nodes.point, inputs, gathers=False)
        launch(self._centre, auxiliary.point, [nodes, auxiliary])


@cache
def _displace_kernel(space: Space):
    @forward_kernel
    def displace(first: int, dt: wp.array(dtype=space.real), nodes: space.types.MaterialNodes):
        i = first + wp.tid()
        nodes.displacement[i] = nodes.displacement[i] + dt[0] * nodes.half_velocity[i]

    return displace


@cache
def half_step_gradient(space: Space) -> wp.Function:
    """(∇φ in the configuration of tⁿ, Δt) → (∇φ in that of t^{n+1/2}, its volume over that of tⁿ)."""
    identity = space.types.tensor(np.eye(space.dim))

    @wp.func
    def to_half_step(gradient: space.phi.gradient, dt: space.real):
        stretch = identity + (space.real(0.5) * dt) * space.phi.velocity_gradient(gradient)
        if wp.static(space.dim == 1):
            return gradient / stretch[0, 0], stretch[0, 0]
        else:
            return gradient * wp.inverse(stretch), space.algebra.determinant(stretch)

    return to_half_step


@cache
def initial_gradient(space: Space) -> wp.Function:
    """The same for small displacements: the initial configuration is the only one."""

    @wp.func
    def unchanged(gradient: space.phi.gradient, dt: space.real):
        return gradient, space.real(1.0)

    return unchanged


@cache
def _move_kernel(space: Space):
    real, identity = space.real, space.types.tensor(np.eye(space.dim))

    @forward_kernel
    def move(
        first: int,
        reference_density: real,
        initial_smoothing_length: wp.array(dtype=real),
        support: real,
        half_skin: real,
        dt: wp.array(dtype=real),
        listed: wp.array(dtype=space.types.vector),
        listed_h: wp.array(dtype=real),
        nodes: space.types.MaterialNodes,
        outdated: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        u = nodes.displacement[i] + dt[0] * nodes.half_velocity[i]
        # The exact change of volume of the map xⁿ → xⁿ + Δt v, whose gradient is (1 + ½ΔtL)(1 − ½ΔtL)⁻¹ when L
        # refers to the half step; to first order 1 + Δt tr(d).
        half_stretch = real(0.5) * dt[0] * nodes.velocity_gradient[i]
        grown, shrunk = identity + half_stretch, identity - half_stretch
        volume_ratio = space.algebra.determinant(grown) / space.algebra.determinant(shrunk)
        density = nodes.density[i] / volume_ratio
        h = initial_smoothing_length[i] * wp.pow(reference_density / density, real(wp.static(1.0 / space.dim)))
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
def centre_kernel(space: Space, kind: CellKind):
    """Places auxiliary nodes in the middle of their cells, with mean volume, density and smoothing length."""
    real = space.real

    @forward_kernel
    def centre(first: int, nodes: space.types.MaterialNodes, auxiliary: space.types.AuxiliaryNodes):
        a = first + wp.tid()
        x = space.types.vector()
        volume, density, h = real(0.0), real(0.0), real(0.0)
        for k in range(wp.static(kind.corners)):
            i = auxiliary.cell[a, k]
            x += nodes.point[i].x
            volume += nodes.volume[i]
            density += nodes.density[i]
            h += nodes.smoothing_length[i]
        share = real(wp.static(1.0 / kind.corners))
        auxiliary.point[a].x = share * x
        auxiliary.volume[a] = share * volume
        auxiliary.density[a] = share * density
        auxiliary.smoothing_length[a] = share * h

    return centre
