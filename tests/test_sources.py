"""Sources at a point: relaxation, softening, sub-stepping, spin, damping, against exact solutions or tensors."""

import numpy as np
import pytest
import warp as wp

from tests.law_tester import LawTester
from warpsph import BodyForce, Box, Elastic, Fixed, Numerics, PerzynaVonMises, Scene, Simulation, everywhere
from warpsph.device.linear_algebra import rotation_of
from warpsph.device.precision import PRECISIONS
from warpsph.physics.space import Space
from warpsph.scene import BAR, PLANE_STRAIN, SOLID

STRESS = {1: (3e5,), 2: (3e5, -1e5, 5e4, 2e4), 3: (3e5, -1e5, 2e4, 5e4, -4e4, 6e4)}


def tensor(stress, continuum):
    full = np.zeros((3, 3))
    for value, (i, j) in zip(stress, continuum.pairs, strict=True):
        full[i, j] = full[j, i] = value
    return full


def stored(full, continuum):
    return np.array([full[i, j] for i, j in continuum.pairs])


def q_of(full):
    deviator = full - np.trace(full) / 3.0 * np.eye(3)
    return np.sqrt(1.5 * (deviator**2).sum())


def relaxing(dim, device="cpu", precision="float64", source_scheme="rk4", **material):
    """A body at uniform stress, all of it held, so that no edge is free: nothing but the sources acts."""
    scene = Scene(
        shape=Box((1.0,) * dim, 0.25),
        material=PerzynaVonMises(young_modulus=8e7, poisson_ratio=0.3, density=2000.0, **material),
        conditions=[Fixed(everywhere())],
        stress=lambda *x: STRESS[dim],
        duration=1.0,
        numerics=Numerics(velocity_scheme="taylor", time_step=2e-4, source_scheme=source_scheme),
    )
    return Simulation(scene, device=device, precision=precision)


@pytest.mark.parametrize("source_scheme", ["rk4", "analytic"])
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_relaxation_follows_its_exponential(device, precision, dim, source_scheme):
    """q = Y + (q₀ − Y) e^{−M γ t/Y}, M = 3G (E in a bar), for N = 1, H = 0; the mean stress stays.

    RK4's error per half step is z⁵/120 of the overstress, z = M γ Δt/(2Y), and adds up to at most the number of
    half steps times that.
    """
    simulation = relaxing(dim, device, precision, source_scheme, fluidity=0.5, yield_size=1e5)
    material = simulation.scene.material
    start, continuum = simulation.field("von_mises_stress"), simulation.mesh.continuum
    for _ in range(20):
        simulation.step()
    rate = material.relaxation_modulus(dim) * material.fluidity / material.yield_size
    exact = 1e5 + (start - 1e5) * np.exp(-rate * simulation.time)
    z = 0.5 * rate * 2e-4
    tolerance = 1e-12 if precision == "float64" else 1e-5
    if source_scheme == "rk4":
        tolerance += 40 * z**5 / 120
    np.testing.assert_allclose(simulation.field("von_mises_stress"), exact, rtol=tolerance)
    eps = (start - exact) / material.relaxation_modulus(dim)
    np.testing.assert_allclose(simulation.field("equivalent_plastic_strain"), eps, rtol=100 * tolerance)
    if dim > 1:
        mean = np.trace(tensor(STRESS[dim], continuum)) / 3.0
        np.testing.assert_allclose(simulation.field("mean_stress"), mean, rtol=1e-5)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_stiff_relaxation_is_substepped_and_stable(dim):
    """M γ Δt/(2Y) = 27 to 36: ten times what one RK4 step bears. The stress lands on the yield surface."""
    simulation = relaxing(dim, fluidity=450.0 if dim == 1 else 390.0, yield_size=1e5)
    for _ in range(3):
        simulation.step()
    np.testing.assert_allclose(simulation.field("von_mises_stress"), 1e5, rtol=1e-9)


@pytest.mark.parametrize("source_scheme", ["rk4", "analytic"])
def test_softening_relaxation_ends_where_stress_and_yield_size_meet(source_scheme):
    """q falls by 3G and Y by −H for every ε̄, so they meet after ε̄ = (q₀ − Y0)/(3G + H), however they get there."""
    simulation = relaxing(2, source_scheme=source_scheme, fluidity=20.0, yield_size=2e5, hardening=-2e7)
    start, shear = simulation.field("von_mises_stress"), simulation.scene.material.shear_modulus
    for _ in range(200):
        simulation.step()
    eps = (start - 2e5) / (3 * shear - 2e7)
    np.testing.assert_allclose(simulation.field("equivalent_plastic_strain"), eps, rtol=1e-9)
    np.testing.assert_allclose(simulation.field("yield_size"), 2e5 - 2e7 * eps, rtol=1e-9)
    np.testing.assert_allclose(simulation.field("von_mises_stress"), 2e5 - 2e7 * eps, rtol=1e-9)


@pytest.mark.parametrize("source_scheme", ["rk4", "analytic"])
def test_softening_stops_at_the_residual_yield_size(source_scheme):
    softening = {"yield_size": 2e5, "hardening": -2e7, "residual_ratio": 0.9}
    simulation = relaxing(2, source_scheme=source_scheme, fluidity=20.0, **softening)
    for _ in range(200):
        simulation.step()
    np.testing.assert_allclose(simulation.field("yield_size"), 0.9 * 2e5, rtol=1e-12)
    np.testing.assert_allclose(simulation.field("von_mises_stress"), 0.9 * 2e5, rtol=1e-9)


@pytest.mark.parametrize("hardening", [-2e7, 0.0, 3e7])
@pytest.mark.parametrize("exponent", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_analytic_flow_is_of_second_order_in_the_step(dim, exponent, hardening):
    """One half step against a fine explicit integration of dq/dt and dY/dt; exact for H = 0, any N.

    The mean of Y over the step leaves an error of (relative change of Y)²/12 of the strain.
    """
    fluidity = 0.5 if exponent < 3.0 else 0.02
    simulation = relaxing(
        dim, source_scheme="analytic", fluidity=fluidity, yield_size=1e5, exponent=exponent, hardening=hardening
    )
    material = simulation.scene.material
    modulus, q, eps, parts = material.relaxation_modulus(dim), simulation.field("von_mises_stress")[0], 0.0, 20000
    simulation.step()
    for _ in range(parts):  # midpoint rule
        trial = eps
        for fraction in (0.5, 1.0):
            size = max(1e5 + hardening * trial, 1e4)
            over = max(q - modulus * (trial - eps) - size, 0.0) / size
            trial = eps + fraction * simulation.time / parts * fluidity * over**exponent
        q, eps = q - modulus * (trial - eps), trial
    change = hardening * eps / 1e5
    np.testing.assert_allclose(
        simulation.field("equivalent_plastic_strain"), eps, rtol=exponent**2 * change**2 / 12 + 1e-6
    )


@pytest.mark.parametrize("exponent", [1.0, 3.0, 20.0])
@pytest.mark.parametrize("fluidity", [1e-6, 1.0, 1e9])
@pytest.mark.parametrize("hardening", [-2e7, 0.0, 2e7])
def test_analytic_flow_bears_any_fluidity_and_exponent(precision, fluidity, exponent, hardening):
    """Never below the yield surface, never more stress than before; γ → ∞ is rate-independent for N = 1."""
    simulation = relaxing(
        2,
        precision=precision,
        source_scheme="analytic",
        fluidity=fluidity,
        yield_size=1e5,
        exponent=exponent,
        hardening=hardening,
    )
    before = simulation.field("von_mises_stress")
    simulation.step()
    q, size = simulation.field("von_mises_stress"), simulation.field("yield_size")
    slack = 1e-9 if precision == "float64" else 1e-3
    assert np.isfinite(q).all()
    assert (q <= before * (1 + slack)).all()
    assert (q >= size * (1 - slack)).all()
    if fluidity == 1e9 and exponent == 1.0:
        np.testing.assert_allclose(q, size, rtol=slack)


@pytest.mark.parametrize("hardening", [-2e7, 0.0, 3e7])
def test_a_path_of_strains_at_high_fluidity_is_rate_independent_plasticity(hardening):
    """Shear γ up and back: q = √3 G γ up to Y0, then Y0 + H ε̄, ε̄ = (√3 G γ − Y0)/(3G + H); elastic back."""
    material = PerzynaVonMises(
        young_modulus=8e7, poisson_ratio=0.3, density=2000.0, fluidity=1e12, yield_size=1e5, hardening=hardening
    )
    steps, shear = 40, material.shear_modulus
    increments = np.zeros((steps + 10, 4))
    increments[:steps, 2], increments[steps:, 2] = 1e-4, -1e-4
    stress, internals = LawTester(material, 2).follow(increments, 1e-3)
    trial = np.sqrt(3.0) * shear * 1e-4 * np.arange(1, steps + 1)
    eps = np.maximum(trial - 1e5, 0.0) / (3.0 * shear + hardening)
    q = np.minimum(trial, 1e5 + hardening * eps)
    back = q[-1] - np.sqrt(3.0) * shear * 1e-4 * np.arange(1, 11)
    np.testing.assert_allclose(np.sqrt(3.0) * stress[:, 2], [*q, *back], rtol=1e-9)
    np.testing.assert_allclose(internals[:, 0], [*eps, *[eps[-1]] * 10], rtol=1e-9)


def test_analytic_sources_do_not_limit_the_time_step():
    """γ = 1e9: RK4 would need 10¹² sub-steps."""
    limits = []
    for fluidity in (1e-6, 1e9):
        material = PerzynaVonMises(
            young_modulus=8e7, poisson_ratio=0.3, density=2000.0, fluidity=fluidity, yield_size=1e5
        )
        scene = Scene(
            shape=Box((1.0, 1.0), 0.25),
            material=material,
            duration=1.0,
            numerics=Numerics(source_scheme="analytic", courant=0.8),
        )
        limits.append(Simulation(scene, device="cpu").time_step_limit)
    assert limits[0] == limits[1] == pytest.approx(0.8 * 0.25 / material.wave_speed(2))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("angle", [1e-4, 0.02, 3.0])
def test_rotation_is_the_exponential_of_the_spin(dim, angle):
    """R Rᵀ = 1 and R = exp(ω Δt), from the eigenvectors of ω; the strain rate in L does not matter."""
    rng = np.random.default_rng(11)
    real = PRECISIONS["float64"]
    matrix, rotation = real.mat(dim, dim), rotation_of(dim, real)
    skew, symmetric = rng.normal(size=(2, dim, dim))
    omega = skew - skew.T
    omega *= angle / np.sqrt(0.5 * (omega**2).sum())

    @wp.kernel(module="unique", enable_backward=False)
    def probe(L: matrix, dt: wp.float64, out: wp.array(dtype=matrix)):
        out[0] = rotation(L, dt)

    out = wp.full(1, matrix(np.nan), dtype=matrix, device="cpu")
    wp.launch(probe, 1, inputs=[matrix(2.0 * (omega + symmetric + symmetric.T)), 0.5], outputs=[out], device="cpu")
    values, vectors = np.linalg.eig(omega)
    exact = (vectors @ np.diag(np.exp(values)) @ np.linalg.inv(vectors)).real
    np.testing.assert_allclose(out.numpy()[0], exact, atol=1e-13)


def test_an_exponent_slows_flow_near_yield():
    """N = 2: dq/dt = −3G γ ((q − Y)/Y)² gives (q − Y)/Y = f₀/(1 + f₀ 3G γ t/Y)."""
    simulation = relaxing(2, fluidity=0.5, yield_size=1e5, exponent=2.0)
    start = simulation.field("von_mises_stress")[0] / 1e5 - 1.0
    for _ in range(50):
        simulation.step()
    rate = 3 * simulation.scene.material.shear_modulus * 0.5 / 1e5
    exact = start / (1.0 + start * rate * simulation.time)
    np.testing.assert_allclose(simulation.field("von_mises_stress") / 1e5 - 1.0, exact, rtol=1e-5)


def test_damping_and_a_ramped_body_force_follow_their_ode():
    """dv/dt = g t/T − c v: v = g/(c T) (t − (1 − e^{−ct})/c), by damping and pushing in turns: to second order."""
    c, end, errors = 50.0, 0.04, []
    exact = -10.0 / (c * 0.1) * (end - (1.0 - np.exp(-c * end)) / c)
    for steps in (100, 200, 400):
        scene = Scene(
            shape=Box((1.0, 1.0), 0.25),
            material=Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0),
            body_force=BodyForce((0.0, -10.0), lambda t: t / 0.1),
            damping=c,
            duration=end,
            numerics=Numerics(time_step=end / steps),
        )
        simulation = Simulation(scene, device="cpu")
        simulation.run()
        assert simulation.steps == steps and np.ptp(simulation.field("velocity")[:, 1]) <= 1e-12 * abs(exact)
        assert np.abs(simulation.field("velocity")[:, 0]).max() <= 1e-15 * abs(exact)
        errors.append(abs(simulation.field("velocity")[0, 1] / exact - 1.0))
    assert errors[0] <= (0.5 * c * end / 100) ** 2
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(2.0, abs=0.05)


def evaluate(continuum, precision, L, sigma, gradient, q, moduli):
    """All functions of a continuum's stresses at one point, from a kernel; outputs poisoned."""
    space = Space(continuum, PRECISIONS[precision])
    types, scalar = space.types, space.real

    @wp.kernel(module="unique", enable_backward=False)
    def probe(
        L: types.tensor,
        sigma: types.stress,
        gradient: types.stress_gradient,
        q: scalar,
        lame: scalar,
        shear: scalar,
        young: scalar,
        stresses: wp.array(dtype=types.stress),
        divergences: wp.array(dtype=types.vector),
        invariants: wp.array(dtype=scalar),
    ):
        stresses[0] = space.stress.elastic_rate(L, lame, shear, young)
        stresses[1] = space.stress.spin(sigma, L)
        stresses[2] = space.stress.relaxation(sigma, q, shear, young)
        stresses[3] = space.stress.deviator(sigma)
        divergences[0] = space.stress.divergence(gradient)
        invariants[0] = space.stress.von_mises(sigma)
        invariants[1] = space.stress.mean(sigma)
        invariants[2] = space.stress.relaxation_modulus(shear, young)

    outputs = [
        wp.full(4, types.stress(np.nan), dtype=types.stress, device="cpu"),
        wp.full(1, types.vector(np.nan), dtype=types.vector, device="cpu"),
        wp.full(3, np.nan, dtype=scalar, device="cpu"),
    ]
    inputs = [types.tensor(L), types.stress(sigma), types.stress_gradient(gradient), q, *moduli]
    wp.launch(probe, 1, inputs=inputs, outputs=outputs, device="cpu")
    return [output.numpy() for output in outputs]


@pytest.mark.parametrize("continuum", [BAR, PLANE_STRAIN, SOLID], ids=lambda c: c.name)
def test_functions_of_stresses_agree_with_three_by_three_tensors(continuum, precision):
    """Rate, spin, deviator, invariants, relaxation and divergence, from random L, σ and ∇σ."""
    rng = np.random.default_rng(7)
    d, s = continuum.dim, continuum.stress_size
    L, sigma, gradient = rng.normal(size=(d, d)), rng.normal(size=s), rng.normal(size=(s, d))
    young, lame, shear = 3.0, 1.2, 0.8
    full, L3 = tensor(sigma, continuum), np.zeros((3, 3))
    L3[:d, :d] = L
    strain_rate, spin = 0.5 * (L3 + L3.T), 0.5 * (L3 - L3.T)
    elastic = young * L3 if d == 1 else lame * np.trace(L3) * np.eye(3) + 2 * shear * strain_rate
    q, mean = q_of(full), np.trace(full) / 3.0
    deviator = full - mean * np.eye(3)
    relaxation = (full * young if d == 1 else 3 * shear * deviator) / q
    modulus = 1.5 * (relaxation * deviator).sum() / q  # ∂q/∂σ = 3/2 s/q on what relaxes
    divergence = [sum(gradient[_index(continuum, i, j), j] for j in range(d)) for i in range(d)]

    stresses, divergences, invariants = evaluate(continuum, precision, L, sigma, gradient, q, (lame, shear, young))
    tolerance = {"rtol": 1e-12, "atol": 1e-12} if precision == "float64" else {"rtol": 2e-5, "atol": 2e-6}
    for actual, expected in zip(stresses, (elastic, spin @ full - full @ spin, relaxation, deviator), strict=True):
        np.testing.assert_allclose(actual, stored(expected, continuum), **tolerance)
    np.testing.assert_allclose(divergences[0], divergence, **tolerance)
    np.testing.assert_allclose(invariants, (q, mean, modulus), **tolerance)


def _index(continuum, i, j):
    return next(k for k, pair in enumerate(continuum.pairs) if set(pair) == {i, j})
