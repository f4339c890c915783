"""Restart, stored scenes and `warpsph new` from the command line."""

import csv
import json
import re
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest

from warpsph.cli.catalogue import load, shipped
from warpsph.cli.interval import parse_interval
from warpsph.cli.main import main
from warpsph.cli.stored import open_scene
from warpsph.scene.fingerprint import fingerprint
from warpsph.storage.reading import read_toml

pytestmark = pytest.mark.usefixtures("undrawn")

# {stop} runs after each step: it may send the process a signal.
SCENE = '''"""Block under gravity."""
import os, signal
import numpy as np
from warpsph import *

PARAMETERS = (
    Parameter("spacing", 0.1, "m", "distance between nodes"),
    Parameter("stop_at", 0, "-", "step after which a signal comes"),
    Parameter("wave", 1e-3, "m", "of the top"),
)

def swing(t):
    return 0.01 * np.sin(9.0 * t)

def scene(p):
    def toe(s):
        if s.steps == p.stop_at > 0 and not os.environ.get("NO_SIGNAL"):
            {stop}
        return s.field("displacement")[s.nearest_node((1.0, 0.0)), 0]

    return Scene(
        shape=Box((1.0, 0.5), p.spacing).mapped(lambda x, y: (x, y + p.wave * np.sin(x))),
        material=PerzynaVonMises(
            young_modulus=1e5, poisson_ratio=0.3, density=2000.0, fluidity=5.0, yield_size=200.0
        ),
        conditions=[
            Fixed(edge("bottom")),
            PrescribedVelocity(edge("left") & where(lambda x, y: y > 0.2), (swing, None)),
        ],
        velocity=lambda x, y: (0.01 * y, 0.0),
        stress=lambda x, y: (-100.0, -200.0, 0.0, -100.0),
        body_force=BodyForce((0.0, -9.81), Ramp(0.5)),
        duration=0.5,
        numerics=p.numerics,
        output=Output(
            interval=0.0,
            probes=(Probe("toe", "m", toe), Probe("p", "Pa", NodeValue("stress", (0.0, 0.0)))),
        ),
    )

def checks(run):
    return [Check("toe", run.history["toe"][-1], run.parameters.wave, "m", 1e9)]
'''


@pytest.fixture(autouse=True)
def _in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def block(tmp_path):
    """Writes the scene file; what it does at `stop_at` is given."""

    def write(stop="os.kill(os.getpid(), signal.SIGTERM)"):
        (tmp_path / "block.py").write_text(SCENE.format(stop=stop))
        return "block.py"

    return write


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """A folder with the scene file, the run `out` that was stopped, and `early`, which has no checkpoint."""
    folder = tmp_path_factory.mktemp("stopped")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        Path("block.py").write_text(SCENE.format(stop="os.kill(os.getpid(), signal.SIGTERM)"))
        assert run("block.py", "--set", "stop_at=9", "--out", "out") == 128 + signal.SIGTERM
        shutil.copytree("out", "early", ignore=shutil.ignore_patterns("checkpoint.npz"))
    return folder


def run(*arguments):
    return main(["run", *map(str, arguments), "--device", "cpu", "--quiet"])


def one_line(capsys):
    text = capsys.readouterr().err
    assert text.startswith("warpsph: ") and text.endswith("\n") and text.count("\n") == 1, text
    return text.strip()


def results(folder):
    """What a run leaves: its history to the byte, and its summary without what depends on the clock."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    kept = {name: value for name, value in summary.items() if name not in ("wall_time", "node_steps_per_second")}
    return (folder / "history.csv").read_bytes(), kept


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_run_stopped_by_a_signal_and_resumed_leaves_the_same_results(
    block, precision, tmp_path, capsys, monkeypatch
):
    """The first resume is told everything again, the second nothing but the folder."""
    path = block()
    same = ("--set", "stop_at=20", "--precision", precision)
    assert run(path, *same, "--out", "stopped") == 128 + signal.SIGTERM
    assert re.search(r"after step 20, .*go on with: warpsph run --resume stopped$", one_line(capsys))
    shutil.copytree("stopped", "again")
    monkeypatch.setenv("NO_SIGNAL", "yes")
    assert run(path, *same, "--out", "whole") == 0
    assert run(path, *same, "--resume", "stopped") == 0
    assert run("--resume", "again") == 0
    expected = results(tmp_path / "whole")
    assert expected[1]["checks"][0]["passed"] and expected[1]["precision"] == precision
    assert results(tmp_path / "stopped") == expected and results(tmp_path / "again") == expected


def test_resumed_run_goes_to_the_end_it_was_meant_for(block, tmp_path):
    path = block()
    assert run(path, "--set", "stop_at=5", "--until", "0.2", "--out", "out") == 128 + signal.SIGTERM
    assert run("--resume", "out") == 0
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["simulated_time"] == 0.2
    assert run("--resume", "out", "--until", "0.3") == 0
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["simulated_time"] == 0.3


def test_checkpoints_are_written_as_asked_and_a_new_run_begins_anew(block, tmp_path):
    path = block("pass")
    assert run(path, "--checkpoint-every", "10", "--until", "0.1", "--out", "out") == 0
    assert (tmp_path / "out" / "checkpoint.npz").is_file()
    assert run(path, "--until", "0.1", "--out", "out") == 2, "it asks first"
    assert (tmp_path / "out" / "checkpoint.npz").is_file()
    assert run(path, "--until", "0.1", "--out", "out", "--overwrite") == 0
    assert not (tmp_path / "out" / "checkpoint.npz").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--resume", "out", "--out", "other"], r"--out = 'other' .*goes on in its own folder, out;"),
        (["--resume", "nowhere"], r"checkpoint = 'nowhere/checkpoint\.npz' .*there is no checkpoint"),
        (
            ["--resume", "early"],
            r"no checkpoint yet; start again with: warpsph run early/scene\.toml --out early --overwrite",
        ),
        (["block.py", "--resume", "out", "--set", "wave=0.002"], "of another scene, or of other parameters"),
        (["elastic_bar", "--resume", "out"], "of another scene, or of other parameters, than elastic_bar"),
        (["--resume", "out", "--precision", "float32"], "in float64, the run in float32"),
        (["--resume", "out", "--until", "0.01"], r"until = 0\.01 .*at least 0\.0"),
        (["block.py", "--checkpoint-every=often"], "--checkpoint-every = 'often' .*a number of steps"),
        (["block.py", "--checkpoint-every=0"], "--checkpoint-every = '0' .*above 0"),
        (["block.py", "--checkpoint-every=0.5"], "--checkpoint-every = '0.5' "),
        (["block.py", "--checkpoint-every=-3s"], "--checkpoint-every = '-3s' "),
    ],
)
def test_wrong_restart_is_refused_in_one_line(arguments, message, stopped, monkeypatch, capsys):
    monkeypatch.chdir(stopped)
    assert run(*arguments) == 2
    assert re.search(message, one_line(capsys))


@pytest.mark.parametrize(
    ("text", "found"),
    [("1", (1, "steps")), ("2.5s", (2.5, "time")), ("3MIN", (180.0, "seconds")), ("1e-3s", (1e-3, "time"))],
)
def test_interval_in_steps_simulated_or_wall_time(text, found):
    assert (getattr(parse_interval(text), found[1]), found[1]) == found


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_stored_scene_repeats_its_run_to_the_last_bit(block, precision, tmp_path):
    """Also when the scene file has meanwhile been changed, and from another folder."""
    assert run(block("pass"), "--set", "spacing=0.125", "--precision", precision, "--out", "first") == 0
    block("raise ValueError")
    (tmp_path / "first").rename(tmp_path / "moved")
    assert run("moved/scene.toml", "--out", "second") == 0
    assert results(tmp_path / "moved") == results(tmp_path / "second")
    with np.load("moved/scene.npz") as arrays:
        assert {name: values.shape[0] for name, values in arrays.items()} == {
            "shape.nodes": 45,
            "velocity": 45,
            "conditions.1.on.second.numbers": 27,
        }
    stored = read_toml("scene", tmp_path / "moved" / "scene.toml")
    assert stored["stress"] == [-100.0, -200.0, 0.0, -100.0], "a uniform field is a list"
    assert stored["code"]["parameters"]["spacing"] == 0.125


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scene_survives_being_stored(name, tmp_path):
    """The same nodes, conditions, fields, functions of time, numerics and columns."""
    assert run(name, "--until", "1e-9", "--out", "out") == 0
    scene, _ = load(name).build([])
    stored, _ = open_scene("out/scene.toml").build([])
    assert fingerprint(stored) == fingerprint(scene) and stored.name == name


BY_HAND = """
duration = 0.01
[shape]
type = "Box"
size = [1.0, 0.5]
spacing = 0.125
[material]
type = "Elastic"
young_modulus = 8e7
density = 2000
[[conditions]]
type = "Fixed"
on = "left"
[[conditions]]
type = "PrescribedVelocity"
on = "right"
velocity = ["free", { type = "Linear", rate = -3.0 }]
[numerics]
courant = 0.5
[[output.probes]]
name = "u"
unit = "m"
function = { type = "NodeValue", field = "displacement", near = [1.0, 0.5], component = 1 }
"""


def test_scene_written_by_hand_runs(tmp_path):
    """u = −3 t²/2 at the end that is moved, by the midpoint rule exactly."""
    (tmp_path / "hand.toml").write_text(BY_HAND)
    assert run("hand.toml") == 0
    with (tmp_path / "runs" / "hand" / "history.csv").open() as file:
        *_, last = csv.reader(file)
    assert float(last[2]) == pytest.approx(-1.5 * 0.01**2, rel=1e-9)
    assert run("runs/hand/scene.toml", "--out", "again") == 0
    assert results(tmp_path / "runs" / "hand") == results(tmp_path / "again")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("duration = 0.01", "duration = -1", "duration = -1 .* above 0"),
        ("duration = 0.01", "durations = 1", r"scene\.durations = 1 .*mean duration\?"),
        ("duration = 0.01", "", "scene = .*missing 1 required.*'duration'"),
        ("duration = 0.01", "duration = ", "hand.toml' .*readable TOML file .*line 2"),
        ('type = "Box"', 'type = "Bax"', r"shape\.type = 'Bax' .*mean Box\?"),
        ('type = "Box"', "", r"shape\.type = None .*one of"),
        ("[1.0, 0.5]\nspacing", '"wide"\nspacing', "size = 'wide' .*finite numbers"),
        ('on = "left"', 'on = "lfet"', r"edge = 'lfet' .*mean left\?"),
        ("courant = 0.5", "courant = 7", "courant = 7.0 .*stable up to"),
        ("courant = 0.5", "curant = 7", r"numerics\.curant = 7 .*mean courant\?"),
        ('"free"', '"loose"', "PrescribedVelocity.velocity = 'loose' .*function of time"),
        ("function = {", 'function = { code = "output.probes.0.function" } #', "names no scene file"),
        ("[shape]", "velocity = { values = 'v' }\n[shape]", "velocity.values = 'v' .*one of"),
        ("[shape]", "velocity = [1.0]\n[shape]", "velocity = .*must return 2 finite"),
        ("[shape]", "velocity = 3\n[shape]", "velocity = 3 .*list of numbers"),
        ("[numerics]", "[run]\nprecision = 3\n[numerics]", "run.precision = 3 .*a text"),
        ("[numerics]", "[run]\nfast = 3\n[numerics]", "run.fast = 3 .*one of device"),
        ("[numerics]", "[code]\nfile = 'gone.py'\n[numerics]", "code.file = 'gone.py' .*beside"),
    ],
)
def test_wrong_scene_by_hand_is_refused_in_one_line(old, new, message, tmp_path, capsys):
    assert old in BY_HAND
    (tmp_path / "hand.toml").write_text(BY_HAND.replace(old, new))
    assert run("hand.toml") == 2
    assert re.search(message, one_line(capsys))


def test_code_that_was_changed_is_refused(block, tmp_path, capsys):
    assert run(block("pass"), "--until", "0.01", "--out", "out") == 0
    with (tmp_path / "out" / "scene_file.py").open("a") as file:
        file.write("# changed")
    assert run("out/scene.toml") == 2
    assert re.search("code.file = .*has changed since the run", one_line(capsys))


def test_stored_scene_takes_no_settings(block, capsys):
    assert run(block("pass"), "--until", "0.01", "--out", "out") == 0
    assert run("out/scene.toml", "--set", "spacing=0.1") == 2
    assert re.search("--set = 'spacing=0.1' .*no parameters", one_line(capsys))


def test_new_writes_a_scene_that_runs_and_passes(tmp_path, capsys):
    assert main(["new", "mine"]) == 0
    assert capsys.readouterr().out == "mine.py written; run it with: warpsph run mine.py\n"
    assert "warpsph run mine.py" in (tmp_path / "mine.py").read_text(encoding="utf-8")
    assert run("mine.py") == 0
    assert json.loads((tmp_path / "runs" / "mine" / "summary.json").read_text())["checks"][0]["passed"]
    before = (tmp_path / "mine.py").read_bytes()
    assert main(["new", "mine.py"]) == 2
    assert "there already" in one_line(capsys) and (tmp_path / "mine.py").read_bytes() == before


@pytest.mark.parametrize("name", ["a b", "nowhere/mine", "", "-x.py"])
def test_new_refuses_a_wrong_name(name, capsys):
    assert main(["new", "--", name]) == 2
    assert "name = " in one_line(capsys)


def test_second_signal_does_not_wait(block, capsys):
    """The step never ends: the probe waits in it for the second signal."""
    waits = "os.kill(os.getpid(), signal.SIGINT); os.kill(os.getpid(), signal.SIGINT)"
    assert run(block(waits), "--set", "stop_at=5", "--out", "out") == 130
    assert "interrupted" in one_line(capsys)
