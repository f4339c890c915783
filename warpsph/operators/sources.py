"""The source part L(Δt/2) of steps 1-2 and 11-12: viscoplastic flow, spin, body force and damping at the nodes.

The velocity's sources (b − c v) and the stress's (flow, spin) do not touch each other, so each is integrated on
its own by the classical fourth-order Runge-Kutta scheme. The stress's is sub-stepped, node by node, so that
λ Δt stays below `STIFFNESS_LIMIT`, λ being the rate at which flow relaxes the stress there.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from ..ground.kinematics import kinematics
from ..ground.materials.law import Law
from ..ground.precision import Precision
from ..ground.unknowns import unknowns
from ..nodes.node_sets import node_types
from ..scene.dimension import Continuum
from ..scene.scene import Scene

# RK4 is stable up to 2.785 (METHOD section 3), where it no longer damps at all; half of that follows the
# exponential to 10 %, and no sub-step overshoots the yield surface.
STIFFNESS_LIMIT = 1.39
MOST_SUBSTEPS = 256


@dataclass(frozen=True)
class NoSources:
    """An elastic scene without spin and body force: nothing to do."""

    kernels: tuple[wp.Kernel, ...] = ()

    def half_step(self, nodes, history, t: float, dt: float) -> None:
        """Nothing."""


class Sources:
    """RK4 sources of a scene.

    Args:
        scene: the scene.
        law: its material law, with the filled `parameters`.
    """

    def __init__(self, scene: Scene, law: Law, parameters, precision: Precision):
        continuum = scene.lattice.continuum
        self._parameters = parameters
        self._body_force = scene.body_force or (lambda t: np.zeros(continuum.dim))
        self._damping = scene.damping
        self._vector = precision.vec(continuum.dim)
        self._kernel = rk4_kernel(
            continuum,
            precision,
            law,
            spins=spins(scene),
            accelerates=scene.body_force is not None or scene.damping > 0.0,
        )
        self.kernels = (self._kernel,)

    def half_step(self, nodes, history, t: float, dt: float) -> None:
        """Advance the nodes by their sources alone from t to t + dt.

        Args:
            nodes: material nodes; φ and the history are updated in place.
            t: start [s].
            dt: length, half a time step [s].
        """
        force = [self._vector(*self._body_force(t + part * dt).tolist()) for part in (0.0, 0.5, 1.0)]
        wp.launch(
            self._kernel,
            nodes.point.shape[0],
            inputs=[self._parameters, *force, self._damping, dt, nodes, history],
            device=nodes.point.device,
        )


def spins(scene: Scene) -> bool:
    """Whether stresses turn with the nodes: not in a bar, not at small displacements."""
    return scene.large_displacements and scene.lattice.dim > 1


def rk4_sources(scene: Scene, law: Law, parameters, precision: Precision) -> Sources | NoSources:
    """The sources of a scene by RK4; an object that does nothing when it has none."""
    if law.flow is None and not spins(scene) and scene.body_force is None and scene.damping == 0.0:
        return NoSources()
    return Sources(scene, law, parameters, precision)


SOURCE_SCHEMES = {"rk4": rk4_sources}


@cache
def rk4_kernel(continuum: Continuum, precision: Precision, law: Law, spins: bool, accelerates: bool):
    """The kernel that applies the sources the flags ask for, and no others."""
    m = len(law.history)
    types, kin = node_types(continuum, precision), kinematics(continuum, precision)
    phi = unknowns(continuum, precision)
    velocity_of, stress_of, join = phi.velocity, phi.stress, phi.join
    real, vector, stress, tensor = precision.real, types.vector, types.stress, types.tensor
    Parameters, MaterialNodes = law.Parameters, types.MaterialNodes
    size = max(m, 1)  # Warp has no empty vectors: a law without history gets a spare one that stays zero
    internal = precision.vec(size)
    spin, flow, flow_stiffness = kin.spin, law.flow, law.flow_stiffness
    flows = flow is not None

    @wp.func
    def stress_rate(sigma: stress, history: internal, L: tensor, material: Parameters):
        rate = stress()
        history_rate = internal()
        if wp.static(flows):
            rate, history_rate = flow(sigma, history, material)
        if wp.static(spins):
            rate += spin(sigma, L)
        return rate, history_rate

    @wp.func
    def rk4_stress(sigma: stress, history: internal, L: tensor, material: Parameters, dt: real):
        half, sixth = real(0.5) * dt, dt / real(6.0)
        s1, h1 = stress_rate(sigma, history, L, material)
        s2, h2 = stress_rate(sigma + half * s1, history + half * h1, L, material)
        s3, h3 = stress_rate(sigma + half * s2, history + half * h2, L, material)
        s4, h4 = stress_rate(sigma + dt * s3, history + dt * h3, L, material)
        two = real(2.0)
        sigma_new = sigma + sixth * (s1 + two * s2 + two * s3 + s4)
        history_new = history + sixth * (h1 + two * h2 + two * h3 + h4)
        return sigma_new, history_new

    @wp.func
    def substep(sigma: stress, history: internal, material: Parameters, left: real):
        """The largest equal part of the time left that the stiffness here allows."""
        if wp.static(flows):
            parts = wp.ceil(flow_stiffness(sigma, history, material) * left / real(STIFFNESS_LIMIT))
            return left / wp.clamp(parts, real(1.0), real(MOST_SUBSTEPS))
        else:
            return left

    @wp.func
    def rk4_velocity(v: vector, b0: vector, b1: vector, b2: vector, c: real, dt: real):
        half = real(0.5) * dt
        v1 = b0 - c * v
        v2 = b1 - c * (v + half * v1)
        v3 = b1 - c * (v + half * v2)
        v4 = b2 - c * (v + dt * v3)
        return v + (dt / real(6.0)) * (v1 + real(2.0) * v2 + real(2.0) * v3 + v4)

    @wp.kernel(module="unique", enable_backward=False)
    def source_half_step(
        material: Parameters,
        body_force_start: vector,
        body_force_middle: vector,
        body_force_end: vector,
        damping: real,
        dt: real,
        nodes: MaterialNodes,
        history: wp.array(dtype=internal),
    ):
        i = wp.tid()
        point = nodes.point[i]
        v = velocity_of(point.phi)
        sigma = stress_of(point.phi)
        if wp.static(accelerates):
            v = rk4_velocity(v, body_force_start, body_force_middle, body_force_end, damping, dt)
        if wp.static(flows or spins):
            internals = internal()
            if wp.static(m > 0):
                internals = history[i]
            L = nodes.velocity_gradient[i]
            left = dt
            while left > real(0.0):
                part = substep(sigma, internals, material, left)
                sigma, internals = rk4_stress(sigma, internals, L, material, part)
                left = left - part
            if wp.static(m > 0):
                history[i] = internals
        nodes.point[i].phi = join(v, sigma)

    return source_half_step
