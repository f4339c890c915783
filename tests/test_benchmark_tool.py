"""The benchmark tool on tiny sizes: what it writes and prints; no timing is judged."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from warpsph import Simulation

TOOLS = Path(__file__).parent.parent / "tools"
sys.path.insert(0, str(TOOLS))
from benchmarking import counting, timing  # noqa: E402
from benchmarking.scenes import Case, scene  # noqa: E402
from benchmarking.tables import compare  # noqa: E402

ARGUMENTS = ["--dimensions", "2", "--nodes", "60,120", "--precisions", "float32"]
ARGUMENTS += ["--devices", "cpu", "--threads", "1", "--seconds", "0.01"]


def benchmark(*arguments):
    """What the command prints; (status, standard output, standard error)."""
    command = [sys.executable, str(TOOLS / "benchmark.py"), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The JSON file of a small campaign, and what was printed."""
    path = tmp_path_factory.mktemp("benchmark") / "new" / "results.json"
    status, printed, messages = benchmark(*ARGUMENTS, "--only-cases", "--out", path)
    assert status == 0, messages
    return path, printed


def test_a_campaign_writes_every_figure_of_every_case(written):
    report = json.loads(written[0].read_text(encoding="utf-8"))
    assert {"date", "command", "machine", "copies", "starts", "results", "skipped", "others"} == set(report)
    assert not report["skipped"]
    assert [(row["material"], row["nodes"]) for row in report["results"]] == [
        ("elastic", 60),
        ("elastic", 120),
        ("viscoplastic", 60),
        ("viscoplastic", 120),
    ]
    for row in report["results"]:
        assert row["lattice_nodes"] == (64 if row["nodes"] == 60 else 121)
        assert row["node_steps_per_second"] == pytest.approx(row["lattice_nodes"] / row["seconds_per_step"])
        assert sum(row["phases"].values()) == pytest.approx(1.0)
        assert row["bytes_per_node_step"] == pytest.approx(sum(row["bytes_by_phase"].values()))
        assert row["memory_per_node"] > 0.0
        assert (row["growth"] is None) == (row["nodes"] == 60)
    assert f"| {report['results'][0]['node_steps_per_second']:.3g} " in written[1]


def test_two_reports_are_compared_case_by_case(written, tmp_path):
    old = json.loads(written[0].read_text(encoding="utf-8"))
    old["results"] = old["results"][:3]
    for row in old["results"]:
        row["node_steps_per_second"] /= 2.0
    path = tmp_path / "old.json"
    path.write_text(json.dumps(old), encoding="utf-8")
    status, printed, _ = benchmark("--compare", path, written[0])
    assert status == 0
    assert printed.count("| 2.00 ") == 3
    assert "3 in both, 0 in the old one only, 1 in the new one only" in printed
    assert "machines differ" not in printed
    other = {**old, "machine": {**old["machine"], "cores": -1}}
    assert "machines differ" in compare(old, other)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--dimensions", "4"], "--dimensions = 4 is not allowed"),
        (["--nodes", "many"], "--nodes = many is not allowed"),
        (["--other", "abaqus"], "--other = abaqus is not allowed: it must be one of pysph"),
        (["--compare", __file__, __file__], "it must be a JSON file of this tool"),
    ],
)
def test_bad_input_is_one_line(arguments, message, tmp_path):
    status, _, messages = benchmark(*arguments, "--out", tmp_path / "results.json")
    assert status == 2 and message in messages and len(messages.splitlines()) == 1


def test_a_solver_that_is_not_installed_is_skipped(tmp_path):
    script = TOOLS / "benchmarking" / "others" / "pysph_elastic.py"
    done = subprocess.run(
        [sys.executable, "-S", "-c", f"import runpy, sys; sys.argv = ['x', '--nodes', '10'];"
         f"runpy.run_path({str(script)!r}, run_name='__main__')"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert "not installed" in json.loads(done.stdout)["skipped"]


def small(dimension, material="viscoplastic"):
    case = Case(dimension, material, "float64", "cpu", 1, 5**dimension)
    return Simulation(scene(case), case.device, case.precision, case.threads)


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_the_scene_moves_and_flows(dimension):
    simulation = small(dimension)
    timing.advance(simulation)
    assert timing.INTERVAL <= simulation.steps <= timing.INTERVAL + 2
    assert (simulation.field("equivalent_plastic_strain") > 0.0).any()
    assert np.linalg.norm(simulation.field("displacement"), axis=1).min() > 0.0


def test_phases_cover_the_step_and_leave_it_as_it_was():
    """Every kernel of a step is timed and counted; afterwards steps go on as without."""
    timed, plain = small(2), small(2)
    phases = timing.time_phases(timed)
    assert set(phases) == {*timing.PHASES, timing.REST}
    assert set(counting.TRAFFIC) == set(timing.PHASES)
    timing.advance(plain)
    timed.step()
    plain.step()
    assert np.array_equal(timed.field("velocity"), plain.field("velocity"))
    assert "launch" not in vars(timed.stepper.body.launcher) and "_record" not in vars(timed.stepper)


def test_counts_of_a_bar_by_hand():
    """Five nodes, four cells between them; elastic, so that nodes remember nothing."""
    simulation = small(1, "elastic")
    real, index = 8, 4
    moved = counting.bytes_per_node_step(simulation)
    assert moved["kick"] == 3 * real + real + 2 * real + index + 2 * real  # point has x, v, σ; half x, v
    numbers = simulation.stepper._numbers.shape[1]
    strain = 4 * 2 * index + 5 * 2 * real + 4 * numbers * real + real  # one number stands for `flowed`
    assert moved["strain"] == pytest.approx(strain / 5)
    assert counting.memory_per_node(simulation) > 6 * real
    found: dict[int, int] = {}
    counting._collect_arrays(small(2).stepper.body.node_cells, found, set())
    assert sum(found.values()) == (25 + 1 + 25 * 4) * 4, "a slot for each corner of 25 nodes, and where they begin"
