"""The source part L(Δt/2) of steps 1-2 and 11-12: viscoplastic flow, spin, body force and damping at the nodes.

The velocity's sources (b − c v) and the stress's (flow, spin) do not touch each other: each is integrated apart.
A step damps and pushes, makes its waves, pushes and damps. What the pushes add, the waves of a body at rest take
away again: v = 0 stays v = 0 and the ground carries the weight, damped or not. Damped and pushed in one flow at
both ends, as published, a body at rest settles for ever. Damping is e^{−cΔt/2}, a push ∫ b dt by Simpson's rule:
a fall is exact without damping, of second order with it. The stress is integrated by the scheme of choice:

- `rk4`: the classical fourth-order Runge-Kutta scheme, sub-stepped node by node so that λ Δt stays below
  `STIFFNESS_LIMIT`, λ being the rate at which flow relaxes the stress there;
- `analytic`: the rotation exp(ω Δt) and the law's own solution. Flow is isotropic, so the two commute, and there
  is no limit to the step: γ → ∞ gives rate-independent plasticity.
"""

from dataclasses import dataclass
from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..materials.law import Law
from ..physics.space import Space
from ..scene.scene import Scene

# RK4 is stable up to 2.785 (METHOD section 3), where it no longer damps at all; half of that follows the
# exponential to 10 %, and no sub-step overshoots the yield surface.
STIFFNESS_LIMIT = 1.39
MOST_SUBSTEPS = 256


@dataclass(frozen=True)
class NoSources:
    """An elastic scene without spin and body force: nothing to do."""

    kernels: tuple[wp.Kernel, ...] = ()

    def half_step(self, nodes, internals, body_force: wp.array, dt: wp.array, *, ends: bool) -> None:
        """Nothing."""


class Sources:
    """The sources of a scene.

    Args:
        scene: the scene.
        law: its material law, with the filled `parameters`.
    """

    def __init__(self, scene: Scene, law: Law, parameters, space: Space, launcher: Launcher):
        self._parameters, self._launcher, self._damping = parameters, launcher, scene.damping
        integrator = STRESS_INTEGRATORS[scene.numerics.source_scheme]
        self._kernel = source_kernel(
            space,
            law,
            advance_stress=integrator(space, law, spins(scene)) if law.flows or spins(scene) else None,
            accelerates=scene.body_force is not None or scene.damping > 0.0,
        )
        self.kernels = (self._kernel,)

    def half_step(self, nodes, internals, body_force: wp.array, dt: wp.array, *, ends: bool) -> None:
        """Advance the nodes by their sources alone.

        Args:
            nodes: material nodes; φ and the internals are updated in place.
            body_force: b [m/s²] at the start, in the middle and at the end, on the device.
            dt: the time step [s], on the device.
            ends: whether it is the half that ends the step.
        """
        inputs = [self._parameters, body_force, self._damping, int(ends), dt, nodes, internals]
        self._launcher.launch(self._kernel, nodes.point, inputs, gathers=False)


def spins(scene: Scene) -> bool:
    """Whether stresses turn with the nodes: not in a bar, not at small displacements."""
    return scene.large_displacements and scene.mesh.dim > 1


def sources(scene: Scene, law: Law, parameters, space: Space, launcher: Launcher) -> Sources | NoSources:
    """The sources of a scene by the scheme it names; an object that does nothing when it has none."""
    if not law.flows and not spins(scene) and scene.body_force is None and scene.damping == 0.0:
        return NoSources()
    return Sources(scene, law, parameters, space, launcher)


def internals_type(law: Law, space: Space) -> type:
    """Vector of a law's internal variables; Warp has no empty vectors, so one spare zero where there are none."""
    return space.vec(max(len(law.internals), 1))


@cache
def analytic(space: Space, law: Law, spins: bool) -> wp.Function:
    """(σ, internals, L, material, Δt) → the same after exact rotation and, with flow, the law's relaxation."""
    types, real, internal = space.types, space.real, internals_type(law, space)

    @wp.func
    def advance(sigma: types.stress, start: internal, L: types.tensor, material: law.Parameters, dt: real):
        result = sigma
        internals = start
        if wp.static(spins):
            result = space.stress.transform(result, space.algebra.rotation(L, dt))
        if wp.static(law.flows):
            result, internals = law.relax(result, internals, material, dt)
        return result, internals

    return advance


@cache
def rk4(space: Space, law: Law, spins: bool) -> wp.Function:
    """(σ, internals, L, material, Δt) → (σ, internals) by RK4, sub-stepped as the stiffness of the flow asks."""
    types, real, internal = space.types, space.real, internals_type(law, space)

    @wp.func
    def stress_rate(sigma: types.stress, internals: internal, L: types.tensor, material: law.Parameters):
        rate = types.stress()
        internals_rate = internal()
        if wp.static(law.flows):
            rate, internals_rate = law.flow(sigma, internals, material)
        if wp.static(spins):
            rate += space.stress.spin(sigma, L)
        return rate, internals_rate

    @wp.func
    def rk4_stress(sigma: types.stress, internals: internal, L: types.tensor, material: law.Parameters, dt: real):
        half, sixth = real(0.5) * dt, dt / real(6.0)
        s1, h1 = stress_rate(sigma, internals, L, material)
        s2, h2 = stress_rate(sigma + half * s1, internals + half * h1, L, material)
        s3, h3 = stress_rate(sigma + half * s2, internals + half * h2, L, material)
        s4, h4 = stress_rate(sigma + dt * s3, internals + dt * h3, L, material)
        two = real(2.0)
        sigma_new = sigma + sixth * (s1 + two * s2 + two * s3 + s4)
        internals_new = internals + sixth * (h1 + two * h2 + two * h3 + h4)
        return sigma_new, internals_new

    @wp.func
    def substep(sigma: types.stress, internals: internal, material: law.Parameters, left: real):
        """The largest equal part of the time left that the stiffness here allows."""
        if wp.static(law.flows):
            parts = wp.ceil(law.flow_stiffness(sigma, internals, material) * left / real(STIFFNESS_LIMIT))
            return left / wp.clamp(parts, real(1.0), real(MOST_SUBSTEPS))
        else:
            return left

    @wp.func
    def advance(sigma: types.stress, start: internal, L: types.tensor, material: law.Parameters, dt: real):
        result = sigma
        internals = start
        left = dt
        while left > real(0.0):
            part = substep(result, internals, material, left)
            result, internals = rk4_stress(result, internals, L, material, part)
            left = left - part
        return result, internals

    return advance


STRESS_INTEGRATORS = {"rk4": rk4, "analytic": analytic}


@cache
def source_kernel(space: Space, law: Law, *, advance_stress: wp.Function | None, accelerates: bool):
    """The kernel that applies the sources a scene has, and no others."""
    types, real, internal = space.types, space.real, internals_type(law, space)
    remembers = len(law.internals) > 0

    @wp.func
    def damped_and_pushed(v: types.vector, body_force: wp.array(dtype=types.vector), c: real, dt: real, ends: int):
        push = (dt / real(6.0)) * (body_force[0] + real(4.0) * body_force[1] + body_force[2])
        if ends == 1:
            return wp.exp(-c * dt) * (v + push)
        return wp.exp(-c * dt) * v + push

    @forward_kernel
    def source_half_step(
        first: int,
        material: law.Parameters,
        body_force: wp.array(dtype=types.vector),
        damping: real,
        ends: int,
        dt: wp.array(dtype=real),
        nodes: types.MaterialNodes,
        internals: wp.array(dtype=internal),
    ):
        i = first + wp.tid()
        half = real(0.5) * dt[0]
        point = nodes.point[i]
        v = space.phi.velocity(point.phi)
        sigma = space.phi.stress(point.phi)
        if wp.static(accelerates):
            v = damped_and_pushed(v, body_force, damping, half, ends)
        if wp.static(advance_stress is not None):
            own = internal()
            if wp.static(remembers):
                own = internals[i]
            sigma, own = advance_stress(sigma, own, nodes.velocity_gradient[i], material, half)
            if wp.static(remembers):
                internals[i] = own
        nodes.point[i].phi = space.phi.with_stress(space.phi.with_velocity(point.phi, v), sigma)

    return source_half_step
