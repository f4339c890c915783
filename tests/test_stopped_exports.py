"""Exports that the disk takes a part of, or that are stopped: what stood there stays, and nothing else."""

import itertools
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from pxr import Sdf, Usd

from tests.damaging import SCENE, command, files
from tests.undrawn import as_a_dot
from warpsph.cli.stopping import Interrupt
from warpsph.export import paraview, usd

RUN = ("run", "plate.py", "--frames", "6", "--device", "cpu")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a run of 7 frames, `out`."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch:
        as_a_dot(patch)
        patch.chdir(folder)
        patch.setenv("NO_SIGNAL", "yes")
        Path("plate.py").write_text(SCENE)
        assert command(*RUN, "--out", "out") == (0, "")
    return folder


@pytest.fixture(autouse=True)
def _there(made, undrawn, monkeypatch):
    monkeypatch.chdir(made)
    monkeypatch.setenv("NO_SIGNAL", "yes")


def everything():
    """All that is there, hidden or not: files with their content, folders without."""
    return {path: path.read_bytes() if path.is_file() else None for path in Path().rglob("*")}


def half(path):
    """The disk takes one half of a file, and nobody says so."""
    os.truncate(path, os.path.getsize(path) // 2)


def half_saved(monkeypatch, first=1):
    """Stages lose a half as they are saved, from that one on."""
    save, export, count = Usd.Stage.Save, Sdf.Layer.Export, [0]

    def lose(path):
        count[0] += 1
        if count[0] >= first:
            half(path)

    def saved(stage):
        save(stage)
        lose(stage.GetRootLayer().realPath)

    def exported(layer, path):
        done = export(layer, path)
        lose(path)
        return done

    monkeypatch.setattr(Usd.Stage, "Save", saved)
    monkeypatch.setattr(Sdf.Layer, "Export", exported)


@pytest.mark.parametrize("suffix", ["usdc", "usda"])
def test_stage_that_the_disk_took_half_of_does_not_replace_the_former_one(suffix, monkeypatch):
    assert command("export", "out", f"e.{suffix}")[0] == 0
    before = everything()
    half_saved(monkeypatch)
    status, errors = command("export", "out", f"e.{suffix}")
    assert status == 2 and errors.count("\n") == 1 and f"e.{suffix}" in errors, errors
    assert everything() == before


@pytest.mark.parametrize("first", [1, 2, 3, 6, 15])
def test_live_stage_opens_whatever_the_disk_took_half_of(first, monkeypatch, tmp_path):
    """Clips and the stage that refers to them, from the first to the last; the run itself goes on."""
    half_saved(monkeypatch, first)
    out = tmp_path / "out"
    status, errors = command(*RUN, "--out", out, "--usd", out / "live.usdc")
    assert status == 0 and errors.count("\n") == 1 and "the run goes on" in errors, errors
    stages = list(out.rglob("*.usdc"))
    assert (out / "live.usdc").exists() == (first > 2)
    assert all(Sdf.Layer.OpenAsAnonymous(str(path)) for path in stages)
    assert (
        files(out).items()
        >= {out / "frames" / p.name: p.read_bytes() for p in Path("out/frames").iterdir()}.items()
    )


def ended(end, patch):
    """Exports end by `end()` in the midst of their frames."""
    for place, name in ((usd.Drawing, "add"), (paraview, "_body")):
        patch.setattr(place, name, _ending(end, getattr(place, name)))


def _ending(end, write):
    count = itertools.count()
    return lambda *given: end() if next(count) == 4 else write(*given)


def stop():
    raise Interrupt(signal.SIGTERM)


def fill():
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("file", ["f.usdc", "f.usda", "f.pvd"])
@pytest.mark.parametrize(("end", "status"), [(stop, 143), (fill, 2)])
def test_export_that_is_stopped_leaves_what_was_there_and_no_more(end, status, file, monkeypatch):
    """With and without a former one."""
    for _ in range(2):
        before = everything()
        with monkeypatch.context() as patch:
            ended(end, patch)
            assert command("export", "out", file)[0] == status
        assert everything() == before
        assert command("export", "out", file)[0] == 0


KILLED = """
import os, signal, sys, pytest
from tests.test_stopped_exports import ended
from warpsph.cli.main import main
ended(lambda: os.kill(os.getpid(), signal.SIGKILL), pytest.MonkeyPatch())
main(sys.argv[1:])
"""


@pytest.mark.parametrize("file", ["g.usdc", "g.pvd"])
def test_next_export_removes_what_a_killed_one_left(file):
    command("export", "out", file)
    whole, environment = everything(), os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", KILLED, "export", "out", file], env=environment, check=False)
    assert done.returncode == -signal.SIGKILL and len(everything()) > len(whole)
    assert everything().items() >= whole.items(), "the former one stays"
    assert command("export", "out", file)[0] == 0
    assert everything() == whole
