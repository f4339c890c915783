"""A material law at one point, without a body: a path of strains in, stresses and internal variables out."""

from functools import cache

import numpy as np
import warp as wp

from warpsph.device.precision import PRECISIONS
from warpsph.mesh.continuum import CONTINUA
from warpsph.operators.sources import internals_type
from warpsph.physics.space import Space


class LawTester:
    """The functions of a material's law, called with NumPy arrays.

    Args:
        material: the material.
        dim: number of dimensions of its continuum.
        precision: float64 or float32.
    """

    def __init__(self, material, dim, *, precision="float64"):
        self.material, self.continuum = material, CONTINUA[dim]
        self.space = Space(self.continuum, PRECISIONS[precision])
        self.law = material.law(self.space)
        self._parameters, self._own = self.law.fill(material), internals_type(self.law, self.space)

    def at_rest(self):
        """Internal variables at the start, at the origin, shape (m,)."""
        return self.material.initial_internals(np.zeros((1, self.continuum.dim)))[0]

    def relax(self, stress, internals, dt):
        """Stress (s,) and internal variables (m,) after `relax` has acted for Δt."""
        return self._call(stress, internals, dt, relaxes=True)

    def flow(self, stress, internals):
        """Their rates by `flow`."""
        return self._call(stress, internals, 0.0, relaxes=False)

    def flow_for(self, stress, internals, time, *, steps):
        """Stress and internal variables after `flow` has acted for a time, by the classical Runge-Kutta scheme."""
        y, dt, s = np.concatenate([stress, internals]), time / steps, len(stress)

        def rate(y):
            return np.concatenate(self.flow(y[:s], y[s:]))

        for _ in range(steps):
            k1 = rate(y)
            k2 = rate(y + 0.5 * dt * k1)
            k3 = rate(y + 0.5 * dt * k2)
            k4 = rate(y + dt * k3)
            y = y + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return y[:s], y[s:]

    def follow(self, strains, dt, stress=None):
        """Stresses (k, s) and internal variables (k, m) along a path of strains.

        Args:
            strains: increments, shape (k, s), engineering shear; each acts elastically, then `relax` for Δt.
            dt: Δt [s].
            stress: at the start [Pa], shape (s,); zero unless given.
        """
        stiffness = self.material.stiffness(self.continuum)
        stress = np.zeros(len(stiffness)) if stress is None else np.asarray(stress, float)
        internals, path = self.at_rest(), []
        for strain in strains:
            stress, internals = self.relax(stress + stiffness @ strain, internals, dt)
            path.append((stress, internals))
        return tuple(np.array(part) for part in zip(*path, strict=True))

    def _call(self, stress, internals, dt, *, relaxes):
        kernel, types = _kernel(self.space, self.law, relaxes=relaxes), (self.space.types.stress, self._own)
        inputs = [
            self._parameters,
            *(kind(*part) for kind, part in zip(types, (stress, internals), strict=True)),
            dt,
        ]
        outputs = [wp.full(1, kind(np.nan), dtype=kind, device="cpu") for kind in types]
        wp.launch(kernel, 1, inputs=inputs, outputs=outputs, device="cpu")
        stress, internals = (output.numpy()[0] for output in outputs)
        return stress, internals[: len(self.law.internals)]


@cache
def _kernel(space, law, *, relaxes):
    own = internals_type(law, space)

    @wp.kernel(module="unique", enable_backward=False)
    def at_a_point(
        parameters: law.Parameters,
        sigma: space.types.stress,
        internals: own,
        dt: space.real,
        stresses: wp.array(dtype=space.types.stress),
        remembered: wp.array(dtype=own),
    ):
        if wp.static(relaxes):
            stress, remember = law.relax(sigma, internals, parameters, dt)
        else:
            stress, remember = law.flow(sigma, internals, parameters)
        stresses[0] = stress
        remembered[0] = remember

    return at_a_point
