"""The energy balance of the scheme `cells`: exact where it can be, else closed to second order, and watched."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    BreakdownError,
    Elastic,
    Fixed,
    Linear,
    Numerics,
    Output,
    PerzynaVonMises,
    PrescribedVelocity,
    Probe,
    Pulse,
    Ramp,
    Roller,
    Scene,
    Simulation,
    edge,
)
from warpsph.cli.main import main
from warpsph.errors import SceneError
from warpsph.simulation.breakdown import MOST_UNACCOUNTED, UNACCOUNTED, breakdown
from warpsph.simulation.history import History, read_history
from warpsph.simulation.simulation import WATCH
from warpsph.state.cell_body import ELASTIC
from warpsph.state.energy import GIVEN, TAKEN

CELLS = Numerics(velocity_scheme="cells")
SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
SOIL = PerzynaVonMises(young_modulus=2.5e7, poisson_ratio=0.4, density=2000.0, fluidity=2.0, yield_size=15e3)
TURN = SOFT.shear_wave_speed()  # of a unit square whose rim moves at half the speed of shear waves [rad/s]


def scene(courant=0.8, **more):
    given = {"shape": Box((1.0, 1.0), 0.125), "material": SOFT, "duration": 1.0}
    return Scene(**given | more, numerics=replace(CELLS, courant=courant))


def run(scene, **more):
    simulation = Simulation(scene, device="cpu", **more)
    simulation.run()
    return simulation


def spinning(courant):
    """A free square that flies apart elastically and comes back, two turns."""
    turn = {"velocity": lambda x, y: (-TURN * (y - 0.5), TURN * (x - 0.5)), "duration": 4.0 * np.pi / TURN}
    return TURN, scene(courant, **turn)


def pressed(courant):
    """A block pressed faster and faster, until it flows."""
    drive = [Fixed(edge("bottom")), PrescribedVelocity(edge("top"), (None, Linear(-0.5)))]
    return SOIL.wave_speed(2), scene(courant, material=SOIL, conditions=drive, duration=0.4)


def hung(courant):
    """A column under growing weight, damped; the loads last longer than a wave's way."""
    held = {"conditions": [Fixed(edge("top"))], "body_force": BodyForce((0.0, -9.81), Ramp(0.1)), "damping": 20.0}
    return SOFT.wave_speed(2), scene(courant, **held)


def pulled(courant):
    """A block pulled to 1.5 times its length and held there: its driven nodes start and stop with a jump."""
    drive = [Fixed(edge("bottom")), PrescribedVelocity(edge("top"), (None, Pulse(5.0, 0.1)))]
    return SOFT.wave_speed(2), scene(courant, conditions=drive, duration=0.4)


@pytest.mark.parametrize("case", [spinning, pressed, hung, pulled])
def test_the_balance_closes_to_second_order(case):
    """Within (ωΔt)² of its largest entry, ω of the lowest motion of a unit body, and by half at half the step.

    Second order is a quarter; the step follows the strain, and what rough motions leave comes and goes.
    """
    missing = []
    for courant in (0.8, 0.4):
        omega, made = case(courant)
        simulation = run(made)
        energy = simulation.energy()
        missing.append(abs(energy.unaccounted) / max(energy.largest, simulation.largest_energy))
        assert missing[-1] < (omega * simulation.longest_step) ** 2
    assert missing[1] < missing[0] / 2.0


def test_a_wave_keeps_its_energy_from_step_to_step():
    """Small displacements of a standing mode: ½ Σ m v² alone would swing by (½ωΔt)² of it; a tenth is allowed."""
    k = np.pi
    standing = scene(
        velocity=lambda x, y: (1e-6 * np.sin(k * x) * np.cos(k * y), 1e-6 * np.cos(k * x) * np.sin(k * y)),
        conditions=[Roller(edge(side)) for side in ("left", "right", "bottom", "top")],
    )
    simulation = Simulation(replace(standing, large_displacements=False), device="cpu")
    half, missing = 0.5 * np.sqrt(2.0) * k * SOFT.wave_speed(2) * simulation.time_step_limit, []
    for _ in range(40):
        simulation.step()
        missing.append(abs(simulation.energy().unaccounted))
    assert simulation.energy().initial > 0.0 and max(missing) < 0.1 * half**2 * simulation.energy().initial


def test_where_the_energy_of_flowing_soil_goes():
    """The elastic part is ½ Σ V σ : Dₑ⁻¹ : σ of the end to the size of elastic strains; flow takes most."""
    simulation = run(pressed(0.8)[1])
    energy, nodes = simulation.energy(), simulation.nodes
    s, E, nu = simulation.field("stress"), SOIL.young_modulus, SOIL.poisson_ratio
    trace, squares = s[:, 0] + s[:, 1] + s[:, 3], (s**2).sum(axis=1) + s[:, 2] ** 2
    elastic = (nodes.volume.numpy() * ((1.0 + nu) * squares - nu * trace**2)).sum() / (2.0 * E)
    assert energy.elastic == pytest.approx(elastic, rel=4.0 * np.abs(s).max() / E)
    kinetic = 0.5 * (nodes.mass.numpy()[:, None] * simulation.field("velocity") ** 2).sum()
    assert energy.kinetic == pytest.approx(kinetic, rel=1e-3)
    assert energy.gravity == energy.damping == energy.loads == 0.0
    assert energy.flow > 0.5 * energy.walls and 0.0 < energy.viscous < 0.05 * energy.walls


@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_what_falls_and_is_braked_is_exact(damping):
    """A rigid motion: v' = −g − c v. Gravity gives m g s; all is exact undamped, else to (cΔt)²."""
    fall = scene(body_force=BodyForce((0.0, -9.81)), damping=damping, velocity=lambda x, y: (2.0, 3.0))
    simulation = run(fall)
    energy = simulation.energy()
    s = -simulation.field("displacement")[0, 1]
    assert energy.gravity == pytest.approx(1000.0 * 9.81 * s, rel=1e-12)
    assert energy.initial == pytest.approx(0.5 * 1000.0 * 13.0, rel=1e-4)
    bound = max((damping * simulation.longest_step) ** 2, 1e-12)
    assert abs(energy.unaccounted) < bound * energy.largest
    assert (energy.damping > 0.1 * energy.largest) == (damping > 0.0)
    assert energy.elastic == pytest.approx(0.0, abs=1e-12 * energy.largest) and energy.walls == 0.0


def test_walls_give_what_a_body_gains_that_they_carry_along():
    """Both ends moved at 2 m/s between smooth walls, then stopped: the walls gave 0, and ½ m v² in between."""
    ends = [PrescribedVelocity(edge(side), (Pulse(2.0, 0.5), None)) for side in ("left", "right")]
    moved = scene(conditions=[*ends], velocity=lambda x, y: (2.0, 0.0))
    simulation = Simulation(moved, device="cpu")
    simulation.run(until=0.4)
    energy = simulation.energy()
    assert energy.initial == pytest.approx(0.5 * 1000.0 * 4.0) and energy.walls == pytest.approx(0.0, abs=1e-9)
    driven = simulation.nodes.mass.numpy()[edge("left").nodes(simulation.mesh)].sum() * 2.0
    simulation.run(until=0.51)
    assert simulation.energy().walls == pytest.approx(-0.5 * driven * 4.0, rel=1e-6)


def test_the_energy_of_an_initial_stress_is_there_from_the_start():
    p = -3e4
    simulation = Simulation(scene(stress=lambda x, y: (p, p, 0.0 * x, p)), device="cpu")
    bulk = SOFT.young_modulus / (3.0 * (1.0 - 2.0 * SOFT.poisson_ratio))
    assert simulation.energy().elastic == pytest.approx(0.5 * p**2 / bulk, rel=1e-12)
    assert simulation.energy().initial == simulation.energy().elastic


def test_the_balance_does_not_depend_on_threads():
    one, two = (run(hung(0.8)[1], threads=threads) for threads in (1, 2))
    assert one.energy() == two.energy()


def test_histories_have_energies_where_the_scheme_keeps_books(tmp_path):
    output = Output(interval=0.0, probes=(Probe("steps", "-", lambda s: float(s.steps)),))
    falling = scene(duration=0.01, body_force=BodyForce((0.0, -9.81)), output=output)
    simulation = Simulation(falling, device="cpu")
    history = History(simulation, tmp_path / "history.csv")
    simulation.run(observers=[history])
    history.close()
    columns, units = read_history(tmp_path / "history.csv")
    names = [f"energy.{name}" for name in (*TAKEN, *GIVEN, "unaccounted")]
    assert list(columns) == ["step", "time", "steps", *names] and {units[name] for name in names} == {"J/m"}
    assert columns["energy.gravity"][-1] == simulation.energy().gravity > 0.0
    without = Simulation(replace(falling, numerics=Numerics(velocity_scheme="blanc-pastor")), device="cpu")
    assert History(without).names == ["step", "time", "steps"] and without.energy() is None


def test_a_probe_may_not_be_called_as_an_energy_is():
    with pytest.raises(SceneError, match=r"energy\.kinetic.* names must differ"):
        Output(probes=(Probe("energy.kinetic", "J", len),))


FALLING = '''"""A block that falls; the step is `longer` times too long."""
from warpsph import *
from warpsph.simulation import time_step

PARAMETERS = (Parameter("longer", 1.0, "-", "step"),)

def scene(p):
    time_step.time_step_limit = lambda scene, limit=time_step.time_step_limit: p.longer * limit(scene)
    return Scene(
        shape=Box((1.0, 1.0), 0.125),
        material=Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0),
        conditions=[Fixed(edge("left"))],
        velocity=lambda x, y: (1e-3 * x, 0.0 * y),
        duration=2.0,
        numerics=Numerics(velocity_scheme="cells"),
    )
'''


@pytest.fixture
def falling(tmp_path, monkeypatch):
    from warpsph.simulation import time_step

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(time_step, "time_step_limit", time_step.time_step_limit)
    (tmp_path / "falling.py").write_text(FALLING, encoding="utf-8")
    return ["run", "falling.py", "--device", "cpu", "--out", "out", "--frames", "100"]


@pytest.mark.usefixtures("undrawn")
def test_a_run_that_makes_energy_ends_as_one_with_a_folded_cell(falling, capsys):
    """At 1.4 times the longest step the scheme is unstable."""
    assert main([*falling, "--set", "longer=1.4"]) == 1
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert "of energy came from nowhere" in last and "the run ends here, since it is unstable" in last
    with open("out/summary.json", encoding="utf-8") as file:
        summary = json.load(file)
    assert summary["error"] in last and summary["steps"] % WATCH == 0 and summary["steps"] <= 2 * WATCH
    assert summary["energy"]["unaccounted_share"] > 0.25
    with open("out/history.csv", newline="", encoding="utf-8") as file:
        *_, row = csv.reader(file)
    assert all(np.isfinite(float(value)) for value in row)


@pytest.mark.usefixtures("undrawn")
def test_a_run_says_where_its_energy_went(falling, capsys):
    """The same scene within the limit: all is accounted for."""
    assert main(falling) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("energy [J/m]: initial "))
    assert " came in; kinetic " in line and line.endswith(" % unaccounted for")
    with open("out/summary.json", encoding="utf-8") as file:
        energy = json.load(file)["energy"]
    assert energy["unit"] == "J/m" and abs(energy["unaccounted_share"]) < 0.02
    taken, given = (sum(energy[name] for name in names) for names in (TAKEN, ("initial", *GIVEN)))
    assert taken - given == pytest.approx(energy["unaccounted"], abs=1e-12 * energy["initial"])


def test_a_loss_that_gives_energy_is_no_balance():
    """Viscosity of the wrong sign is in the books; it can not be true all the same."""
    energy = Simulation(scene(), device="cpu").energy()
    wrong = replace(energy, viscous=-3.0, kinetic=3.0)
    assert wrong.unaccounted == 0.0 and wrong.amiss == 3.0
    assert replace(energy, kinetic=-2.0).amiss == -2.0


def test_noise_of_every_node_is_no_alarm():
    """White noise at the longest step, of which viscosity takes nearly all: the worst that a stable run can do."""
    rng = np.random.default_rng(1)
    noise = scene(
        shape=Box((1.0,) * 3, 0.25),
        velocity=lambda *x: tuple(1e-3 * rng.normal(size=(3, len(x[0])))),
        conditions=[Roller(edge("bottom"))],
        duration=2.0,
    )
    energy = run(noise).energy()
    assert energy.viscous > 0.9 * energy.initial
    assert abs(energy.unaccounted) < 0.25 * energy.largest < MOST_UNACCOUNTED * energy.largest


@pytest.mark.parametrize("steps", [0.75 * WATCH, 1.5 * WATCH])
def test_a_breakdown_names_the_fastest_node(steps):
    """Where the run ends, or before that at a step that is watched."""
    simulation = Simulation(scene(velocity=lambda x, y: (1e-3 * x, 0.0 * y)), device="cpu")
    simulation.run(until=simulation.time_step_limit * WATCH / 2)
    books = simulation.nodes.books.numpy().copy()
    books[ELASTIC] -= 1.0
    simulation.nodes.books.assign(books)
    with pytest.raises(BreakdownError, match=r"J/m of energy vanished, .* % of the largest in the balance"):
        simulation.run(until=simulation.time_step_limit * steps)
    assert simulation.steps == min(steps, WATCH)


def test_a_breakdown_names_a_cell_whose_corner_has_folded():
    """It has a volume, and goes on for a while."""
    simulation = Simulation(scene(), device="cpu")
    mesh = simulation.mesh
    cell = len(mesh.cells) // 2
    first, opposite = (mesh.nodes[mesh.cells[cell, k]] for k in (0, -1))
    moved = np.zeros_like(mesh.nodes)
    moved[mesh.cells[cell, 0]] = 0.6 * (opposite - first)
    simulation.nodes.displacement.assign(moved)
    simulation.nodes.books.assign(np.ones_like(simulation.nodes.books.numpy()))
    error = breakdown(simulation, UNACCOUNTED, 1.0)
    assert f"corners folded, above all of cell {cell}, nodes {mesh.cells[cell, 0]}, " in str(error)
    assert mesh.with_nodes(mesh.nodes + moved).cell_volumes().min() > 0.0
