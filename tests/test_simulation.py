"""Running: times, steps, precision, repetition, and stopping on a non-finite value."""

import numpy as np
import pytest
import warp as wp

from warpsph import (
    Box,
    Elastic,
    Fixed,
    History,
    NodeValue,
    NonFiniteError,
    Numerics,
    Output,
    PrescribedVelocity,
    Probe,
    Pulse,
    Scene,
    SceneError,
    Simulation,
    edge,
)
from warpsph.simulation.time_step import divide


def bar(**changes):
    arguments = {
        "shape": Box((1.0,), 0.05),
        "material": Elastic(young_modulus=8e7, density=2000.0),
        "conditions": [Fixed(edge("left")), PrescribedVelocity(edge("right"), (Pulse(1.0, 1e-3),))],
        "duration": 4e-3,
        "output": Output(interval=0.0, probes=(Probe("v", "m/s", NodeValue("velocity", (0.5,))),)),
    }
    return Scene(**(arguments | changes))


def test_run_ends_exactly_at_its_time_in_equal_steps(device):
    simulation = Simulation(bar(), device=device)
    simulation.run(until=1.1e-3)
    simulation.run()
    assert simulation.time == 4e-3
    assert simulation.longest_step <= simulation.time_step_limit * (1 + 1e-9)
    steps, dt = divide(1.0, 0.3)
    assert (steps, dt) == (4, 0.25)


def test_time_step_is_courant_times_spacing_over_wave_speed():
    simulation = Simulation(bar(numerics=Numerics(courant=0.7)), device="cpu")
    assert simulation.time_step_limit == pytest.approx(0.7 * 0.05 / 200.0, rel=1e-12)


def test_a_given_time_step_beyond_the_limit_is_refused():
    simulation = Simulation(bar(), device="cpu")
    with pytest.raises(SceneError, match=r"time_step = .* at most"):
        simulation.step(2 * simulation.time_step_limit)


def test_a_run_repeats_bit_for_bit(precision):
    fields = []
    for _ in range(2):
        simulation = Simulation(bar(), device="cpu", precision=precision)
        simulation.run()
        fields.append(simulation.field("stress"))
    np.testing.assert_array_equal(*fields)


def test_history_has_every_step_and_survives_in_its_file(tmp_path):
    simulation = Simulation(bar(), device="cpu")
    history = History(simulation, tmp_path / "history.csv")
    simulation.run(observers=[history])
    # not closed: a run that is killed leaves the rows it had
    lines = (tmp_path / "history.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("step [-],time [s],v [m/s],energy.kinetic [J/m²],")
    assert len(lines) == simulation.steps + 2
    assert [float(line.split(",")[2]) for line in lines[1:]] == history["v"].tolist()


def test_history_samples_at_its_interval():
    simulation = Simulation(bar(output=Output(interval=1e-3)), device="cpu")
    history = History(simulation)
    simulation.run(observers=[history])
    np.testing.assert_allclose(history["time"], np.arange(5) * 1e-3, atol=simulation.time_step_limit)


def test_a_non_finite_velocity_stops_the_run_with_step_time_and_node(device):
    def broken(t):
        return 1e308 if t > 2e-3 else 0.0  # its stress is infinite

    scene = bar(conditions=[PrescribedVelocity(edge("right"), (broken,))])
    simulation = Simulation(scene, device=device)
    history = History(simulation)
    with pytest.raises(NonFiniteError) as caught:
        simulation.run(observers=[history])
    error = caught.value
    assert error.step == simulation.steps == len(history["time"])
    assert error.time == pytest.approx(2e-3, abs=2 * simulation.time_step_limit)
    assert error.node >= 18, "the last nodes feel the broken end first"
    assert f"step {error.step}" in str(error) and f"node {error.node}" in str(error)


def test_every_field_is_documented_and_has_its_shape():
    simulation = Simulation(bar(), device="cpu")
    for name, text in simulation.fields().items():
        shape = text[: text.index("[")].strip()
        sizes = {"n": 21, "d": 1, "s": 1}
        expected = tuple(sizes[part.strip()] for part in shape.strip("()").split(",") if part.strip())
        assert simulation.field(name).shape == expected, name
    assert simulation.field("mass").sum() == pytest.approx(2000.0)


def test_small_displacements_keep_the_configuration():
    """Displacements add up, 1 m/s in 1 ms at the driven end; cells and neighbours stay those of the start."""
    for scheme in ("cells", "taylor"):
        numerics = Numerics(velocity_scheme=scheme)
        simulation = Simulation(bar(large_displacements=False, numerics=numerics), device="cpu")
        simulation.run()
        assert simulation.field("displacement")[-1, 0] == pytest.approx(1e-3, rel=1e-9)
        assert simulation.list_builds == (1 if scheme == "taylor" else 0)
        body = simulation.stepper.body
        if scheme == "cells":
            found = body.nodes.volume.numpy(), simulation.mesh.node_volumes()
        else:
            found = body.auxiliary.volume.numpy(), simulation.mesh.cell_volumes()
        assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_grids_of_both_pair_lists_span_the_body(monkeypatch):
    """A grid of too few cells finds the same pairs, in a time that grows with the square of the nodes."""
    sizes = []

    class Grid(wp.HashGrid):
        def __init__(self, *size, **options):
            sizes.append(size)
            super().__init__(*size, **options)

    monkeypatch.setattr(wp, "HashGrid", Grid)
    Simulation(bar(numerics=Numerics(velocity_scheme="taylor")), device="cpu")
    assert sizes == [(10, 1, 1), (10, 1, 1)]  # a metre, and 19 spacings, of 0.05 m at about two a cell
