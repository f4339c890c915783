"""Motions whose exact solution is known in closed form."""

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    Elastic,
    Numerics,
    PrescribedVelocity,
    Rotating,
    Scene,
    Simulation,
    edge,
    region,
)

SCHEMES = ("blanc-pastor", "taylor")
EPS = {"float64": 2.2e-16, "float32": 1.2e-7}
SOFT = Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_free_fall_is_exact(device, precision, dim, scheme):
    """v = g t and u = g t²/2: the scheme integrates both exactly, so only the rounding of n steps is left.

    Literally applied, step 10b with vⁿ in place of v_s would give 1.5 g (METHOD section 3).
    """
    g = np.array([0.3, -1.0, -9.81])[-dim:]
    scene = Scene(
        shape=Box((1.0,) * dim, 1.0 / 6),
        material=SOFT,
        body_force=BodyForce(tuple(g)),
        duration=1.0,
        numerics=Numerics(velocity_scheme=scheme),
    )
    simulation = Simulation(scene, device=device, precision=precision)
    steps = 50
    for _ in range(steps):
        simulation.step()
    t, n, tolerance = simulation.time, len(scene.mesh.nodes), 4 * steps * EPS[precision]
    np.testing.assert_allclose(simulation.field("velocity"), np.tile(g * t, (n, 1)), rtol=tolerance)
    np.testing.assert_allclose(simulation.field("displacement"), np.tile(g * t**2 / 2, (n, 1)), rtol=tolerance)
    # Each step may add the modulus times Δt times the rounding of ∇v, a few eps |v|/Δx.
    modulus = SOFT.density * SOFT.wave_speed(3) ** 2
    gradient_rounding = 10 * EPS[precision] * np.abs(g * t).max() * 6
    assert np.abs(simulation.field("stress")).max() <= modulus * t * gradient_rounding


@pytest.mark.parametrize("scheme", SCHEMES)
def test_uniform_translation_is_exact(device, precision, scheme):
    """A moving body keeps its velocity, its shape and its uniform stress; tolerance: rounding of 100 steps."""
    velocity, prestress = (3.0, -2.0), (1e5, -2e5, 5e4, 3e4)
    scene = Scene(
        shape=Box((1.0, 1.0), 1.0 / 9).rotated(0.3),
        material=SOFT,
        velocity=lambda x, y: velocity,
        stress=lambda x, y: prestress,
        duration=1.0,
        numerics=Numerics(velocity_scheme=scheme),
    )
    simulation = Simulation(scene, device=device, precision=precision)
    for _ in range(100):
        simulation.step()
    tolerance = 1e3 * EPS[precision]
    moved = simulation.time * np.array(velocity)
    modulus = SOFT.density * SOFT.wave_speed(2) ** 2
    np.testing.assert_allclose(simulation.field("velocity"), np.tile(velocity, (100, 1)), rtol=tolerance)
    np.testing.assert_allclose(simulation.field("displacement"), np.tile(moved, (100, 1)), rtol=tolerance)
    # The velocity's rounding, strained over Δx = 1/9 for the time that has passed.
    rounding = modulus * simulation.time * 3.0 * 9 * 10 * EPS[precision]
    np.testing.assert_allclose(simulation.field("stress"), np.tile(prestress, (100, 1)), atol=rounding)


def edge_bias(smoothing_ratio):
    """Relative error of a gradient next to an edge: a Shepard value there lacks its neighbour at −3/2 Δx.

    Its value is off by w(3/2)·3/2 Δx per unit gradient, w normalised; the gradient across one spacing sees that,
    and the same again from the point's own value.
    """
    near, far = np.exp(-((0.5 / smoothing_ratio) ** 2)), np.exp(-((1.5 / smoothing_ratio) ** 2))
    return 2.0 * 1.5 * far / (2.0 * near + far)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_uniform_stretch_has_its_closed_form(device, dim):
    """Boundary nodes at constant velocity a X stretch the body by F = 1 + a t: ρ = ρ₀/F^d, h = h₀ F, σ = K ln F.

    The midpoint rule in time leaves (a Δt)²/12 of ln F, nothing here; what remains is the Shepard bias at the
    edges, which the modulus multiplies. K: uniaxial stress, plane strain, all-round.
    """
    rate, end, cells = 20.0, 0.005, 8
    shape = Box((1.0,) * dim, 1.0 / cells)
    mesh = shape.mesh()
    boundary = mesh.nodes[edge("boundary").nodes(mesh)]
    scene = Scene(
        shape=shape,
        material=SOFT,
        conditions=[PrescribedVelocity(region(node, node), tuple(rate * node)) for node in boundary],
        velocity=lambda *x: [rate * part for part in x],
        duration=end,
        numerics=Numerics(velocity_scheme="taylor"),
    )
    simulation = Simulation(scene, device=device)
    simulation.run()
    stretch, bias = 1.0 + rate * end, edge_bias(0.6)
    modulus = SOFT.young_modulus if dim == 1 else dim * SOFT.lame_modulus + 2 * SOFT.shear_modulus
    stress = simulation.field("stress")[:, 0]
    np.testing.assert_allclose(stress, modulus * np.log(stretch), rtol=2 * dim * bias)
    np.testing.assert_allclose(simulation.field("density"), 2000.0 / stretch**dim, rtol=0.1 * 2 * dim * bias)
    np.testing.assert_allclose(simulation.field("smoothing_length"), 0.6 / cells * stretch, rtol=0.2 * bias)


def spinning_square(cells, courant, angular_velocity=5.0):
    """A pre-stressed square in steady rotation about its centre, its edge nodes driven on their circles.

    In the body's frame σ = S − ½ ρ Ω² diag(x², y²) balances the centripetal acceleration, for any constant S.
    """
    material = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
    pull = 0.5 * material.density * angular_velocity**2
    return Scene(
        shape=Box((1.0, 1.0), 1.0 / cells, origin=(-0.5, -0.5)),
        material=material,
        conditions=[Rotating(edge("boundary"), angular_velocity)],
        velocity=lambda x, y: (-angular_velocity * y, angular_velocity * x),
        stress=lambda x, y: (1e5 - pull * x**2, -2e5 - pull * y**2, 5e4, 3e4),
        duration=2.0 * np.pi / angular_velocity,
        numerics=Numerics(velocity_scheme="taylor", courant=courant),
    )


@pytest.mark.parametrize("courant", [0.5, 0.9])
def test_spinning_square_keeps_its_von_mises_stress_over_one_turn(device, courant):
    """To 10⁻³ of itself; the stress turns with the body and comes back after one turn."""
    simulation = Simulation(spinning_square(20, courant), device=device)
    von_mises, stress = simulation.field("von_mises_stress"), simulation.field("stress")
    simulation.run()
    assert np.abs(simulation.field("von_mises_stress") / von_mises - 1.0).max() <= 1e-3
    assert np.abs(simulation.field("stress") - stress).max() <= 2e-3 * np.abs(stress).max()


def test_rotation_error_does_not_depend_on_the_time_step(device):
    """A turn's strain error of −π Ω Δt, as fluxes in the configuration of tⁿ would give, is not there.

    It would be 2 (λ + G) π Ω Δt = 6e4 Pa at Courant 0.9, against the 5e2 Pa asserted.
    """
    simulation = Simulation(spinning_square(10, 0.9), device=device)
    start = simulation.field("stress")
    simulation.run()
    centre = simulation.nearest_node((0.0, 0.0))
    assert np.abs(simulation.field("stress")[centre] - start[centre]).max() <= 500.0
