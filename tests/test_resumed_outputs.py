"""What a run keeps for later is the same whether it was interrupted or not, and readable in between."""

import json
import re
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warpsph.cli.main import main
from warpsph.frames import Frames
from warpsph.simulation.checkpoint import Checkpoint
from warpsph.storage.reading import read_toml

pytestmark = pytest.mark.usefixtures("undrawn")

SCENE = '''"""Block that is pressed; a signal comes after the step `stop_at`."""
import os, signal
from warpsph import *

PARAMETERS = (Parameter("stop_at", 0, "-", "step"),)

def scene(p):
    def settlement(s):
        if s.steps == p.stop_at > 0 and not os.environ.get("NO_SIGNAL"):
            os.kill(os.getpid(), signal.SIGTERM)
        return s.field("displacement")[-1, 1]

    return Scene(
        shape=Box((0.4, 0.2), 0.05),
        material=PerzynaVonMises(
            young_modulus=8e7, poisson_ratio=0.3, density=2000.0, fluidity=5.0, yield_size=2e4
        ),
        conditions=[Fixed(edge("bottom")), PrescribedVelocity(edge("top"), (None, -1.0))],
        duration=0.01,
        numerics=p.numerics,
        output=Output(
            interval=0.0,
            probes=(Probe("settlement", "m", settlement),),
            field="equivalent_plastic_strain",
        ),
    )
'''
OPTIONS = ("--frames", "12", "--checkpoint-every", "10", "--precision", "float32")
STOP = 25


@pytest.fixture(autouse=True)
def _in_folder_with_scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("block.py").write_text(SCENE)


def run(*arguments):
    return main(["run", *arguments, "--device", "cpu", "--quiet"])


def exported(folder):
    """Everything that `warpsph export` makes of a run: name → content of each file."""
    target = Path("exports") / folder
    assert main(["export", folder, f"{target}/run.usda"]) == 0
    assert main(["export", folder, f"{target}/run.pvd"]) == 0
    return {str(path.relative_to(target)): path.read_bytes() for path in target.rglob("*") if path.is_file()}


def points(path):
    """Time codes of a stage and the nodes' positions at each."""
    stage = Usd.Stage.Open(str(path))
    attribute = UsdGeom.Points.Get(stage, "/Run/MaterialNodes").GetPointsAttr()
    codes = attribute.GetTimeSamples()
    return codes, np.array([attribute.Get(code) for code in codes])


def uninterrupted(monkeypatch):
    """The run as it is without the signal."""
    with monkeypatch.context() as patch:
        patch.setenv("NO_SIGNAL", "yes")
        assert run("block.py", "--set", f"stop_at={STOP}", *OPTIONS, "--usd", "whole.usdc", "--out", "whole") == 0


@pytest.mark.parametrize("lost", [False, True], ids=["stopped", "killed"])
def test_run_that_goes_on_keeps_its_frames_and_stage_as_if_it_had_never_stopped(lost, monkeypatch):
    """Told nothing but the folder, and from another one; after a kill, what came behind the checkpoint is anew."""
    uninterrupted(monkeypatch)
    status = run("block.py", "--set", f"stop_at={STOP}", *OPTIONS, "--usd", "parts.usdc", "--out", "parts")
    assert status == 128 + signal.SIGTERM and 3 < len(Frames("parts")) < 13
    if lost:  # a kill leaves frames that no checkpoint knows
        beyond = Path("parts/frames/000011.npz")
        with np.load("parts/frames/000002.npz") as frame:
            np.savez(beyond, **dict(frame) | {"time": 0.0099})
        beyond.with_name(".000012.999999999-0.part.npz").write_bytes(b"torn")
    monkeypatch.setenv("NO_SIGNAL", "yes")
    Path("elsewhere").mkdir()
    monkeypatch.chdir("elsewhere")
    assert run("--resume", "../parts") == 2, "its stage stands outside of its folder"
    assert run("--resume", "../parts", "--usd", "../parts.usdc") == 0
    monkeypatch.chdir("..")
    one, other = Frames("whole"), Frames("parts")
    assert one.about == other.about and one.numbers == other.numbers == list(range(13))
    for a, b in zip(one, other, strict=True):
        assert (a.time, a.step, list(a.stored)) == (b.time, b.step, list(b.stored))
        assert all(a.stored[name].tobytes() == b.stored[name].tobytes() for name in a.stored)
    assert exported("whole") == exported("parts")
    (codes, whole), (codes_again, parts) = points("whole.usdc"), points("parts.usdc")
    assert codes == codes_again and len(codes) == 13 and np.array_equal(whole, parts)
    assert not Path("parts.usdc.frames").exists() and not list(Path("parts/frames").glob(".*"))


def test_stopped_run_leaves_what_a_reader_needs(capsys):
    """Nothing of a former run in its folder; everything up to where it stopped, whole."""
    folder = Path("out")
    folder.mkdir()
    for name in ("summary.json", "surface.png", ".warpsph"):
        (folder / name).write_text("of a former run")
    status = run(
        "block.py", "--set", f"stop_at={STOP}", *OPTIONS, "--usd", "run.usda", "--out", "out", "--overwrite"
    )
    assert status == 128 + signal.SIGTERM
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "go on with: warpsph run --resume out --usd run.usda\n" in said
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["stopped"] and summary["error"] is None and summary["steps"] == STOP
    assert {path.name for path in folder.iterdir()} == {
        *("summary.json", "history.csv", "history.png", "energy.png", "field.png", "frames"),
        *("scene.toml", "scene_file.py", "checkpoint.npz", ".warpsph"),
    }
    kept = len(Frames("out"))
    assert points("run.usda")[1].shape == (kept, 45, 3)
    assert main(["plot", "out"]) == 0 and (folder / "overview.png").is_file()
    assert len(exported("out")) == 3 + kept, "and the mark of the folder of frames"


def test_options_given_with_resume_win_and_are_remembered_in_turn(monkeypatch):
    assert run("block.py", "--set", "stop_at=10", "--frames", "4", "--out", "out") == 128 + signal.SIGTERM
    assert Checkpoint.read("out/checkpoint.npz").header["run"] == {
        **{"device": "cpu", "precision": "float64", "frames": 4, "checkpoint_every": "10min"}
    }
    monkeypatch.setenv("NO_SIGNAL", "yes")
    assert run("--resume", "out", "--until", "0.005", "--frames", "8", "--checkpoint-every", "1") == 0
    assert run("--resume", "out") == 0
    assert Frames("out").times[-1] == 0.005, "the end it was given last"
    assert len([time for time in Frames("out").times if time > 0.003]) == 4, "of 8 in 0.005 s"


def test_repeated_run_keeps_as_many_frames_and_leaves_the_first_one_s_stage_alone(monkeypatch):
    monkeypatch.setenv("NO_SIGNAL", "yes")
    assert run("block.py", *OPTIONS, "--usd", "first.usdc", "--out", "first") == 0
    Path("first.usdc").unlink()
    assert run("first/scene.toml", "--out", "second") == 0
    assert not Path("first.usdc").exists()
    shutil.copytree("first/frames", "second/expected")
    for path in Path("second/expected").iterdir():
        assert path.read_bytes() == (Path("second/frames") / path.name).read_bytes()
    first, second = (read_toml("scene", Path(name) / "scene.toml")["run"] for name in ("first", "second"))
    assert first == second


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("frames = 12", "frames = -1", r"run\.frames = -1 .*at least 0"),
        ("frames = 12", "frames = '12'", r"run\.frames = '12' .*whole number"),
        ("frames = 12", "frame = 12", r"run\.frame = 12 .*did you mean frames"),
        ('checkpoint_every = "10"', "checkpoint_every = 10", r"run\.checkpoint_every = 10 .*text"),
    ],
)
def test_wrong_entry_of_the_run_table_is_refused_in_one_line(old, new, message, monkeypatch, capsys):
    assert run("block.py", *OPTIONS, "--until", "1e-3", "--out", "out") == 0
    text = Path("out/scene.toml").read_text(encoding="utf-8")
    assert old in text
    Path("out/scene.toml").write_text(text.replace(old, new), encoding="utf-8")
    assert run("out/scene.toml") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and re.search(message, said)
