"""What can not be true ends a run at once, and says where and why; what is at rest stays at rest."""

import json

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    BreakdownError,
    Elastic,
    Fixed,
    Numerics,
    PerzynaVonMises,
    PrescribedVelocity,
    Roller,
    Scene,
    Simulation,
    edge,
)
from warpsph.cli.main import main
from warpsph.simulation import breakdown

pytestmark = pytest.mark.usefixtures("undrawn")

SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
GRAVITY = 9.81


def column(gravity_over_strength=6.5):
    """Clay twice as high as wide on a rough base, far too weak to stand: it flows until cells fold."""
    strength = 1e3 * GRAVITY * 2.0 / gravity_over_strength
    clay = {"young_modulus": 2e6, "poisson_ratio": 0.45, "density": 1e3, "fluidity": 1e3}
    return Scene(
        shape=Box((1.0, 2.0), 0.1),
        material=PerzynaVonMises(**clay, yield_size=np.sqrt(3.0) * strength),
        conditions=[Fixed(edge("bottom"))],
        body_force=BodyForce((0.0, -GRAVITY)),
        duration=5.0,
    )


def test_a_column_that_tears_ends_where_it_tears():
    """It used to go on to 1e47 m/s and 1e131 m and to call itself finished."""
    scene = column()
    simulation = Simulation(scene, device="cpu")
    with pytest.raises(BreakdownError, match=r"folded|faster than waves|so flat|from nowhere") as caught:
        simulation.run()
    assert caught.value.step == simulation.steps and 0.0 < caught.value.time < scene.duration
    assert np.abs(simulation.field("displacement")).max() < 4.0, "no further than twice the body's height"
    assert np.abs(simulation.field("velocity")).max() < scene.material.wave_speed(2)


def test_a_folded_cell_is_noted_and_named_with_its_nodes():
    """A corner pushed far through its cell in one motion."""
    simulation = Simulation(Scene(shape=Box((1.0, 1.0), 0.25), material=SOFT, duration=1.0), device="cpu")
    velocity, stepper = np.zeros((25, 2)), simulation.stepper
    velocity[0] = (1.2, 1.2)
    point = simulation.nodes.point.numpy()
    point["phi"][:, :2] = velocity
    simulation.nodes.point.assign(point)
    stepper.clock.begin([0.0], 1.0)
    stepper.step()
    assert stepper.clock.outcome().fault == "folded"
    message = str(breakdown.breakdown(simulation, "folded", 1.0))
    assert message.startswith(
        "cell 0 folded, nodes 0, 1, 5, 6, in step 0 (t = 0 s) at node 0, initially at (0, 0) m"
    )


def test_a_run_ends_in_the_step_in_which_a_cell_folds():
    """All nodes fly through the left side, fast enough to pass each other in one step."""
    scene = Scene(
        shape=Box((1.0, 1.0), 0.25), material=SOFT, duration=1.0, velocity=lambda x, y: (-1e4 * x, 0.0 * y)
    )
    simulation = Simulation(scene, device="cpu")
    with pytest.raises(BreakdownError, match=r"^cell \d+ folded, nodes .* in step 1 "):
        simulation.run()


@pytest.mark.filterwarnings("error")
def test_positions_beyond_all_numbers_are_named_without_a_warning():
    """Lengths and volumes of the cells overflow."""
    simulation = Simulation(Scene(shape=Box((1.0, 1.0), 0.25), material=SOFT, duration=1.0), device="cpu")
    moved = simulation.nodes.displacement.numpy()
    moved[0] = 1e300
    simulation.nodes.displacement.assign(moved)
    point = simulation.nodes.point.numpy()
    point["x"][0] = 1e300
    simulation.nodes.point.assign(point)
    assert "cell 0 folded" in str(breakdown.breakdown(simulation, "folded", 1.0))


@pytest.mark.parametrize("scheme", ["cells", "blanc-pastor"])
def test_neighbours_part_no_faster_than_waves_but_a_body_may(scheme):
    """The same speed, ten times that of waves: of the whole body, or of every second node."""
    speed = 10.0 * SOFT.wave_speed(2)
    common = {"shape": Box((1.0, 1.0), 0.25), "material": SOFT, "duration": 1.0}
    numerics = Numerics(velocity_scheme=scheme)
    flying = Simulation(Scene(**common, velocity=lambda x, y: (speed, 0.0), numerics=numerics), device="cpu")
    for _ in range(5):
        flying.step()
    torn = Scene(**common, velocity=lambda x, y: (speed * np.sign(x - 0.4), 0.0), numerics=numerics)
    with pytest.raises(BreakdownError, match="neighbours part faster than waves, velocity gradient"):
        Simulation(torn, device="cpu").step()


def test_cells_pressed_flat_end_a_run_where_steps_lead_nowhere(monkeypatch):
    """A plate drives a wall of soft cells flat; the step follows them down to a share of the first.

    With a cell's mass kept, a step goes with the root of its height: 0.55 at 0.3 of the height.
    """
    monkeypatch.setattr(breakdown, "LEAST_STEP_SHARE", 0.55)
    monkeypatch.setattr("warpsph.simulation.simulation.LEAST_STEP_SHARE", 0.55)
    scene = Scene(
        shape=Box((1.0, 1.0), 0.25),
        material=SOFT,
        conditions=[Fixed(edge("bottom")), PrescribedVelocity(edge("top"), (None, -1.0))],
        duration=2.0,
    )
    simulation = Simulation(scene, device="cpu")
    start = simulation.time_step_limit
    with pytest.raises(BreakdownError, match=r"cell \d+ is so flat that the time step is .* s, in step"):
        simulation.run()
    assert 0.5 * start < simulation.time_step_limit < 0.55 * start


def test_a_run_that_breaks_down_exits_with_one_and_keeps_what_it_has(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clay.py").write_text(
        "from tests.test_breakdown import column\n\n\ndef scene(p):\n    return column()\n", encoding="utf-8"
    )
    keep = ["--frames", "50", "--checkpoint-every", "0.1s", "--out", "out"]
    assert main(["run", "clay.py", "--device", "cpu", *keep]) == 1
    assert "the run ends here" in capsys.readouterr().err
    summary = json.loads((tmp_path / "out/summary.json").read_text(encoding="utf-8"))
    assert "in step" in summary["error"] and summary["checks"] == []
    assert (tmp_path / "out/checkpoint.npz").is_file()
    times = json.loads((tmp_path / "out/frames/about.json").read_text(encoding="utf-8"))["times"]
    kept = sorted((tmp_path / "out/frames").glob("0*.npz"))
    assert 1 < len(kept) < len(times), "those before, none of what can not be true"
    with np.load(kept[-1]) as frame:
        assert np.abs(frame["velocity"]).max() < column().material.wave_speed(2)


@pytest.mark.parametrize("damping", [0.0, 20.0, 200.0])
def test_a_column_in_equilibrium_stays_at_rest_damped_or_not(damping):
    """K0 stress is linear, and means over cells are exact for it: nothing moves, to rounding, in 2000 steps.

    Damped and pushed in one flow at both ends of a step it would settle for ever, at g c Δt²/8.
    """
    nu, rho = SOFT.poisson_ratio, SOFT.density
    k0 = nu / (1.0 - nu)

    def stress(x, y):
        vertical = -rho * GRAVITY * (1.0 - y)
        return k0 * vertical, vertical, 0.0, k0 * vertical

    scene = Scene(
        shape=Box((0.5, 1.0), 0.125),
        material=SOFT,
        conditions=[Fixed(edge("bottom")), Roller(edge("left")), Roller(edge("right"))],
        body_force=BodyForce((0.0, -GRAVITY)),
        damping=damping,
        stress=stress,
        duration=1e9,
    )
    simulation = Simulation(scene, device="cpu")
    simulation.run(until=2000 * simulation.time_step_limit)
    assert np.abs(simulation.field("velocity")).max() <= 1e-12 * GRAVITY * simulation.time
    base = np.isclose(simulation.mesh.nodes[:, 1], 0.0)
    assert simulation.field("stress")[base, 1] == pytest.approx(-rho * GRAVITY, rel=1e-10)


@pytest.mark.parametrize("lean", [0.75, 3.0])
def test_a_lattice_that_leans_from_the_start_gets_a_step_that_its_cells_can_take(lean):
    """x + k y: the least distance across a cell is the least singular value of its edges."""
    rng = np.random.default_rng(1)
    shape = Box((1.0, 1.0), 0.125).mapped(lambda x, y: (x + lean * y, y))
    gradient = np.array([[1.0, lean], [0.0, 1.0]])
    least = 0.125 * np.linalg.svd(gradient, compute_uv=False).min()
    assert shape.mesh().smallest_distance() == pytest.approx(least, rel=1e-12)
    scene = Scene(
        shape=shape,
        material=SOFT,
        conditions=[Fixed(edge("bottom"))],
        velocity=lambda x, y: (1e-4 * rng.standard_normal(len(x)), 1e-4 * rng.standard_normal(len(x))),
        duration=1.0,
    )
    simulation = Simulation(scene, device="cpu")
    start = np.abs(scene.initial_velocity).max()
    simulation.run(until=400 * simulation.time_step_limit)
    assert np.abs(simulation.field("velocity")).max() < start


def test_waves_in_flat_cells_do_not_grow():
    """Six times as wide as high, ν = 0.45: κ = 0.9 as in square cells would make noise grow by 0.6 % a step."""
    rng = np.random.default_rng(0)
    scene = Scene(
        shape=Box((1.0, 1.0), 1.0 / 12).mapped(lambda x, y: (6.0 * x, y)),
        material=Elastic(young_modulus=1e6, poisson_ratio=0.45, density=1000.0),
        conditions=[Roller(edge(name)) for name in ("left", "right", "bottom")],
        velocity=lambda x, y: (1e-6 * rng.standard_normal(len(x)), 1e-6 * rng.standard_normal(len(x))),
        duration=1e9,
    )
    simulation = Simulation(scene, device="cpu")
    left = []
    for _ in range(3):
        simulation.run(until=simulation.time + 300 * simulation.time_step_limit)
        left.append(np.sqrt((simulation.field("velocity") ** 2).mean()))
    assert left[2] < 2.0 * left[0] and left[2] < 0.5e-6


def test_small_displacements_add_up(precision):
    """u = ∫ v dt, of a body that falls freely; sums keep the initial configuration."""
    scene = Scene(
        shape=Box((1.0, 1.0), 0.25),
        material=SOFT,
        body_force=BodyForce((0.0, -GRAVITY)),
        large_displacements=False,
        duration=0.1,
    )
    simulation = Simulation(scene, device="cpu", precision=precision)
    simulation.run()
    tolerance = {"float64": 1e-12, "float32": 1e-4}[precision]
    assert simulation.field("displacement")[:, 1] == pytest.approx(-0.5 * GRAVITY * 0.1**2, rel=tolerance)
    assert simulation.field("position") == pytest.approx(simulation.mesh.nodes + simulation.field("displacement"))


@pytest.mark.parametrize("origin", [(0.0, 0.0), (1e4, 2e4), (4.5e5, 5.4e6)])
def test_float32_is_as_good_far_from_the_origin_as_near_it(origin):
    """10 km away, and in map coordinates: positions on the device are from the middle of the body."""
    near, far = (
        Simulation(
            Scene(
                shape=Box((1.0, 1.0), 0.0625, at),
                material=SOFT,
                conditions=[Fixed(edge("bottom"))],
                velocity=lambda x, y, at=at: (1e-3 * np.sin(np.pi * (x - at[0])), 0.0 * x),
                duration=0.02,
            ),
            device="cpu",
            precision="float32",
        )
        for at in ((0.0, 0.0), origin)
    )
    near.run()
    far.run()
    scale = np.abs(near.field("velocity")).max()
    assert np.abs(far.field("velocity") - near.field("velocity")).max() <= 1e-4 * scale
    assert far.field("position").dtype == np.float64
