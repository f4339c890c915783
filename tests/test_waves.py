"""Waves against their exact solutions, with the order of convergence bounded on both sides."""

import numpy as np
import pytest

from warpsph import (
    Box,
    Elastic,
    Fixed,
    Numerics,
    PrescribedVelocity,
    Roller,
    Scene,
    Simulation,
    edge,
)

MATERIAL = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)


def standing_mode_error(kind, cells, scheme, courant=0.5):
    """Relative L2 error of the velocity after one period of a standing mode between roller walls, k = π.

    P: v = (sin kx cos ky, cos kx sin ky), ω = √2 k c_p. S: v = (sin kx cos ky, −cos kx sin ky), ω = √2 k c_s.
    """
    sign = 1.0 if kind == "P" else -1.0
    speed = MATERIAL.wave_speed(2) if kind == "P" else MATERIAL.shear_wave_speed()
    k = np.pi
    scene = Scene(
        shape=Box((1.0, 1.0), 1.0 / cells),
        material=MATERIAL,
        conditions=[Roller(edge(name)) for name in ("left", "right", "bottom", "top")],
        velocity=lambda x, y: (np.sin(k * x) * np.cos(k * y), sign * np.cos(k * x) * np.sin(k * y)),
        duration=2.0 * np.pi / (np.sqrt(2.0) * k * speed),
        large_displacements=False,
        numerics=Numerics(velocity_scheme=scheme, courant=courant),
    )
    simulation = Simulation(scene, device="cpu")
    exact = simulation.field("velocity")
    simulation.run()
    return np.linalg.norm(simulation.field("velocity") - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize("kind", ["P", "S"])
def test_taylor_standing_mode_converges_with_order_between_two_and_four(kind):
    """Second order in Δx and Δt; the dispersion and the damping errors of higher order still show at 10 cells."""
    errors = [standing_mode_error(kind, cells, "taylor") for cells in (10, 20, 40)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert ((orders > 2.0) & (orders < 4.0)).all(), (errors, orders)


def test_blanc_pastor_standing_mode_loses_what_its_numerical_viscosity_takes():
    """2 v^{n+1/2} − v filters with diffusivity D = (2 m₂ − C²/2) Δx²/Δt (METHOD section 4).

    A damped oscillator with the viscosity D k² on its velocity keeps exp(−D k² t) of the amplitude: k² = 2π², two
    equal terms of the mode, each filtered. The estimate is good to second order in k Δx, here to 15 %.
    """
    cells, courant = 40, 0.5
    error = standing_mode_error("P", cells, "blanc-pastor", courant)
    speed, m2 = MATERIAL.wave_speed(2), 0.2577
    dt = courant / cells / speed
    diffusivity = (2.0 * m2 - courant**2 / 2.0) / cells**2 / dt
    period = np.sqrt(2.0) / speed
    kept = np.exp(-0.5 * diffusivity * 2.0 * np.pi**2 * period)
    assert 1.0 - error == pytest.approx(kept, rel=0.15)


def plane_wave_errors(spacing, axis, precision):
    """Largest errors of velocity and stresses of a sin² pulse half a metre long, sent along an axis of a rod.

    Exact: v(x − c t) along the axis, σ = −ρ c v along it and λ/(λ + 2G) of that across (uniaxial strain between
    rollers), no velocity across. Relative to the pulse's height.
    """
    size = [4 * spacing] * 3
    size[axis] = 1.0
    speed = MATERIAL.wave_speed(3)
    duration = 0.5 / speed
    ends = (("left", "right"), ("front", "back"), ("bottom", "top"))
    sides = [name for pair in ends for name in pair if name not in ends[axis]]

    def pulse(t):
        return float(np.sin(np.pi * t / duration) ** 2) if 0.0 <= t <= duration else 0.0

    drive = [None, None, None]
    drive[axis] = pulse
    scene = Scene(
        shape=Box(tuple(size), spacing),
        material=MATERIAL,
        conditions=[
            *(Roller(edge(name)) for name in sides),
            PrescribedVelocity(edge(ends[axis][0]), tuple(drive)),
            Fixed(edge(ends[axis][1])),
        ],
        duration=1.6 * duration,
        large_displacements=False,
        numerics=Numerics(velocity_scheme="taylor", courant=0.9),
    )
    simulation = Simulation(scene, device="cpu", precision=precision)
    simulation.run()
    exact = np.array([pulse(simulation.time - x / speed) for x in scene.mesh.nodes[:, axis]])
    velocity, stress = simulation.field("velocity"), simulation.field("stress")
    across = [k for k in range(3) if k != axis]
    impedance = MATERIAL.density * speed
    ratio = MATERIAL.lame_modulus / (MATERIAL.lame_modulus + 2 * MATERIAL.shear_modulus)
    return (
        np.abs(velocity[:, axis] - exact).max(),
        np.abs(stress[:, axis] / impedance + exact).max(),
        np.abs(stress[:, across] / impedance + ratio * exact[:, None]).max(),
        np.abs(velocity[:, across]).max(),
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_plane_wave_in_a_solid_converges_to_the_exact_one(precision, axis):
    """3D. Ten and twenty spacings a pulse: second order, with room for the kink at the pulse's feet below and for
    the dispersion's next order above. Velocities across are not quite zero: the support's round edge lets points
    next to a side weigh their neighbours along the rod a little differently."""
    coarse = plane_wave_errors(0.05, axis, precision)
    fine = plane_wave_errors(0.025, axis, precision)
    orders = np.log2(np.divide(coarse[:3], fine[:3]))
    assert ((orders > 1.4) & (orders < 3.0)).all(), (coarse, fine, orders)
    assert max(fine[:3]) <= 0.04
    assert fine[3] <= 1e-3
