"""The comparator beside the examples: it is standard SPH, and it fails for the reason it should."""

import numpy as np
import pytest

from warpsph import Box, Elastic, Scene
from warpsph.cli.catalogue import load

MODULE = load("tensile_block").module
SPACING, SMOOTHING = 0.1, 0.06
SOFT = Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0)


def lattice_in_tension(stress, displaced=lambda x, y: (0.0 * x, 0.0 * y)):
    def shifted(x, y):
        u, v = displaced(x, y)
        return x + u, y + v

    return MODULE.StandardSPH(
        Scene(
            shape=Box((1.0, 1.0), SPACING).mapped(shifted),
            material=SOFT,
            stress=lambda x, y: (stress, stress, 0.0, 0.0),
            duration=1.0,
        ),
        SMOOTHING / SPACING,
    )


def rates(sph):
    return sph.rates(sph.x, sph.v, sph.stress, sph.density)


def test_linear_and_angular_momentum_are_kept():
    """Pair forces are equal and opposite; isotropic stresses make them central."""
    wavy = lattice_in_tension(1e6, lambda x, y: (0.01 * np.sin(9 * x), 0.02 * np.cos(7 * x * y)))
    force = wavy._mass[:, None] * rates(wavy)[1]
    scale = np.abs(force).max()
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-10 * scale)
    torque = wavy.x[:, 0] * force[:, 1] - wavy.x[:, 1] * force[:, 0]
    assert abs(torque.sum()) < 1e-10 * scale


def test_alternating_modes_grow_at_the_rate_of_linear_theory():
    """Away from the edge a small alternating displacement u is accelerated by s² u; the fastest mode."""
    stress, amplitude, fastest = 1e6, 1e-7, 0.0
    for i, j in ((1, 0), (0, 1), (1, 1)):
        for axis in (0, 1):

            def mode(x, y, i=i, j=j, axis=axis):
                sign = amplitude * (-1.0) ** np.rint(i * x / SPACING + j * y / SPACING)
                return (sign, 0.0 * x) if axis == 0 else (0.0 * x, sign)

            sph = lattice_in_tension(stress, mode)
            middle = np.argmin(np.abs(sph.x - 0.5).sum(axis=1))
            displacement = np.stack(mode(*np.array([[0.5], [0.5]])))[axis, 0]
            fastest = max(fastest, rates(sph)[1][middle, axis] / displacement)
    theory = MODULE.alternating_growth_rate(SPACING, SMOOTHING, stress, SOFT.density)
    assert np.sqrt(fastest) == pytest.approx(theory, rel=1e-4)  # the displacements are 1e-6 of the spacing


def test_alternating_velocity_has_no_gradient():
    """The zero-energy mode: a checkerboard of the velocity leaves the stress alone."""
    sph = lattice_in_tension(0.0)
    sph.v[:, 0] = (-1.0) ** np.rint(sph.x / SPACING).sum(axis=1)
    rate = rates(sph)[2]
    inside = (np.abs(sph.x - 0.5) < 0.25).all(axis=1)
    modulus = SOFT.density * SOFT.wave_speed(2) ** 2
    assert np.abs(rate[inside]).max() < 1e-10 * modulus / SPACING


def test_free_lattice_without_stress_stays_at_rest():
    sph = lattice_in_tension(0.0)
    seen = []
    sph.run(0.002, lambda s: seen.append(s.time))
    assert seen[0] == 0.0 and seen[-1] == pytest.approx(0.002) and not sph.blown
    assert not sph.v.any()
