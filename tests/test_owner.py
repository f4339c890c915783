"""One process writes into a folder at a time, and nothing but what was written as ours is replaced or removed."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.damaging import SCENE, command
from warpsph import SceneError
from warpsph.cli.main import main
from warpsph.storage import owner
from warpsph.storage.owner import MARK, owned, owned_file

pytestmark = pytest.mark.usefixtures("undrawn")

SLOW = SCENE.replace("if s.steps == 20", "import time; time.sleep(0.02)\n    if s.steps == 20").replace(
    "duration=0.01", "duration=10.0"
)


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_SIGNAL", "yes")
    Path("plate.py").write_text(SCENE)
    Path("slow.py").write_text(SLOW)


def run(*arguments):
    return command("run", *arguments, "--device", "cpu", "--quiet")


def content(folder):
    return {path: path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def under_way(*arguments):
    """A process that runs the slow scene into `out`, once it has begun."""
    start = [sys.executable, "-m", "warpsph", *arguments, "--device", "cpu"]
    process = subprocess.Popen(start, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    limit = time.monotonic() + 60.0
    while time.monotonic() < limit and not list(Path("out").rglob("history.csv")):
        time.sleep(0.02)
    return process


def test_second_of_everything_into_a_folder_is_refused_while_a_run_is_under_way():
    process = under_way("run", "slow.py", "--out", "out", "--usd", "live.usdc", "--checkpoint-every", "1")
    try:
        while not Path("out/checkpoint.npz").exists():
            time.sleep(0.02)
        mine = rf"process {process.pid} on \S+ is writing it"
        for arguments in (
            ("plate.py", "--out", "out", "--overwrite"),
            ("--resume", "out", "--usd", "other.usdc"),
            ("plate.py", "--out", "other", "--usd", "live.usdc"),
        ):
            status, errors = run(*arguments)
            assert status == 2 and errors.count("\n") == 1 and re.search(mine, errors), errors
        status, errors = command("export", "out", "live.usdc")
        assert status == 2 and re.search(rf"FILE = 'live.usdc' .*{mine}", errors), errors
        assert command("export", "out", "copy.usdc")[0] == 0 and command("plot", "out")[0] == 0
    finally:
        process.kill()
        process.wait()
    assert run("--resume", "out", "--until", "1e-2", "--usd", "live.usdc")[0] in (0, 2), "its lock went with it"
    assert run("plate.py", "--out", "out", "--overwrite") == (0, "")


def test_folder_that_holds_a_run_is_only_replaced_when_that_is_asked_for():
    assert run("plate.py", "--out", "out") == (0, "")
    before = content("out")
    status, errors = run("plate.py", "--out", "out")
    assert status == 2 and re.search("holds a run: .*--resume out, .*--overwrite, or .*another name", errors)
    Path("typo.py").write_text(SCENE.replace('"displacement"', '"displacment"'))
    status, errors = run("typo.py", "--out", "out", "--overwrite")
    assert status == 2 and "did you mean displacement?" in errors
    for wrong in (("--usd", "out/nowhere/x/../../../plate.py/a.usdc"), ("--device", "gpu"), ("--until", "-1")):
        assert command("run", "plate.py", "--out", "out", "--overwrite", "--device", "cpu", *wrong)[0] == 2
    assert content("out") == before
    assert run("plate.py", "--out", "out", "--overwrite", "--frames", "0") == (0, "")
    assert not list(Path("out/frames").iterdir())


@pytest.mark.parametrize(
    "name", ["summary.json", "history.csv", "scene.toml", "checkpoint.npz", "frames/about.json"]
)
def test_user_s_files_by_our_names_are_never_replaced(name):
    path = Path("mine") / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    for more in ((), ("--overwrite",)):
        status, errors = run("plate.py", "--out", "mine", *more)
        assert status == 2 and "which no run has written there; choose another name" in errors
    assert content("mine") == {path: b"mine"}


@pytest.mark.parametrize(
    ("arguments", "folder"),
    [(("export", "out", "e.pvd"), "e_frames"), (("run", "plate.py", "--usd", "x.usdc"), "x.usdc.frames")],
)
def test_user_s_folder_by_the_name_of_ours_stays(arguments, folder):
    if folder == "e_frames":
        pytest.importorskip("vtkmodules", reason="VTK is not installed (extra vtk)")
        assert run("plate.py", "--out", "out")[0] == 0
    for name in ("notes.txt", "000000.vtp", "1-000000.usdc"):
        Path(folder).mkdir(exist_ok=True)
        (Path(folder) / name).write_text("mine")
        before = content(folder)
        status, errors = command(*arguments, *(("--device", "cpu") if arguments[0] == "run" else ()))
        assert status == 2 and f"{folder} holds what no " in errors and content(folder) == before


def test_only_files_of_our_names_go_with_a_folder_of_ours(tmp_path):
    """What somebody has put there meanwhile stays, and the folder with it."""
    ours = re.compile(r"\d{6}\.vtp")
    owner.mark(tmp_path / "e_frames")
    for name in ("000000.vtp", ".000001.1-0.part.vtp", "notes.txt", "1.vtp"):
        (tmp_path / "e_frames" / name).write_text(name)
    owner.empty(tmp_path / "e_frames", ours)
    assert {path.name for path in (tmp_path / "e_frames").iterdir()} == {"notes.txt", "1.vtp", MARK}
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "000000.vtp").write_text("mine")
    owner.empty(tmp_path / "mine", ours)
    assert content(tmp_path / "mine") == {tmp_path / "mine" / "000000.vtp": b"mine"}, "it has no mark"


def test_series_that_a_former_export_wrote_is_replaced_whole():
    pytest.importorskip("vtkmodules", reason="VTK is not installed (extra vtk)")
    assert run("plate.py", "--out", "out", "--frames", "4")[0] == 0
    assert command("export", "out", "e.pvd")[0] == 0
    assert run("plate.py", "--out", "out", "--frames", "2", "--overwrite")[0] == 0
    assert command("export", "out", "e.pvd")[0] == 0
    assert sorted(path.name for path in Path("e_frames").glob("*.vtp")) == [f"00000{k}.vtp" for k in range(3)]


def test_copy_of_a_run_goes_on_without_the_original_s_stage():
    os.environ.pop("NO_SIGNAL")
    for name, stage in (("inside", "inside/run.usdc"), ("outside", "run.usdc")):
        assert run("plate.py", "--out", name, "--usd", stage, "--checkpoint-every", "5")[0] == 128 + signal.SIGTERM
        shutil.copytree(name, f"{name}-copy")
    os.environ["NO_SIGNAL"] = "yes"
    before = content("inside") | {Path("run.usdc"): Path("run.usdc").read_bytes()}
    assert run("--resume", "inside-copy") == (0, "")
    status, errors = run("--resume", "outside-copy")
    assert status == 2 and "outside of the run's folder: name it again with --usd FILE" in errors
    assert run("--resume", "outside-copy", "--usd", "copy.usdc") == (0, "") and Path("copy.usdc").is_file()
    assert content("inside") | {Path("run.usdc"): Path("run.usdc").read_bytes()} == before


def test_probe_with_another_function_under_its_name_is_refused():
    os.environ.pop("NO_SIGNAL")
    assert run("plate.py", "--out", "out", "--checkpoint-every", "5")[0] == 128 + signal.SIGTERM
    os.environ["NO_SIGNAL"] = "yes"
    before = content("out")
    Path("plate.py").write_text(SCENE.replace("[-1, 0]", "[-1, 1]"))
    status, errors = run("plate.py", "--resume", "out")
    assert status == 2 and "another function of the probe 'width'" in errors and content("out") == before
    Path("plate.py").write_text(SCENE.replace("def width", "# the same, written elsewhere\n\ndef width"))
    assert run("plate.py", "--resume", "out") == (0, "")


@pytest.mark.parametrize("damage", ["{", "[]", "", None])
def test_frames_that_can_not_be_read_are_not_taken_for_none(damage):
    """Their table is torn, of another form, empty or gone: a run that goes on would begin a new one."""
    os.environ.pop("NO_SIGNAL")
    kept = ("--frames", "4", "--checkpoint-every", "5")
    assert run("plate.py", "--out", "out", *kept)[0] == 128 + signal.SIGTERM
    os.environ["NO_SIGNAL"] = "yes"
    about = Path("out/frames/about.json")
    if damage is None:
        about.unlink()
    else:
        about.write_text(damage)
    before = content("out")
    status, errors = run("--resume", "out")
    assert status == 2 and errors.count("\n") == 1 and "about.json" in errors and content("out") == before


OTHER = {"process": 1, "started": "0", "boot": "another", "host": "elsewhere"}


@pytest.mark.parametrize(
    ("record", "refused"),
    [
        ({}, None),
        (OTHER, "process 1 on elsewhere may still be writing it; if it does not, delete"),
        (OTHER | {"host": None}, None),  # of this machine, before it was started again
    ],
)
def test_what_a_dead_owner_has_left_is_told_apart(record, refused, tmp_path):
    this = owner._this_process()
    (tmp_path / MARK).write_text(
        json.dumps({**record, **({"host": this["host"]} if record.get("host") is None else {})})
    )
    if refused is None:
        with owned(tmp_path):
            assert json.loads((tmp_path / MARK).read_text()) == this
        assert (tmp_path / MARK).read_text() == ""
    else:
        with pytest.raises(SceneError, match=refused), owned(tmp_path):
            pass


@pytest.mark.parametrize(("change", "free"), [({}, False), ({"started": "1"}, True), ({"boot": "x"}, True)])
def test_without_locks_the_process_counts_its_start_and_the_machine_s(change, free, tmp_path, monkeypatch):
    """Of a file system that can not lock: this very process holds it, or one that had its number before."""
    monkeypatch.setattr(owner, "fcntl", None)
    (tmp_path / MARK).write_text(json.dumps(owner._this_process() | change))
    if free:
        with owned(tmp_path):
            return
    with pytest.raises(SceneError, match="is writing it"), owned(tmp_path):
        pass


def test_file_has_one_writer_and_leaves_no_mark(tmp_path):
    path = tmp_path / "a.usdc"
    with owned_file(path, "FILE"):
        with pytest.raises(SceneError, match=r"FILE = .* is writing it"), owned_file(path, "FILE"):
            pass
        with owned_file(tmp_path / "b.usdc", "FILE"):
            pass
    with owned_file(path, "FILE"):
        pass
    assert list(tmp_path.glob(".*")) == []


@pytest.mark.parametrize("replaced", [False, True])
def test_folder_that_is_taken_away_meanwhile_is_said(replaced, tmp_path):
    """Also where another one stands in its place, with what has been written since."""
    folder = tmp_path / "out"
    with pytest.raises(OSError, match="taken away meanwhile"), owned(folder):
        folder.rename(tmp_path / "elsewhere")
        if replaced:
            folder.mkdir()
            (folder / MARK).touch()


def test_hand_written_scene_in_its_own_folder_is_kept():
    assert run("plate.py", "--out", "out")[0] == 0
    scene = Path("out/scene.toml").read_bytes()
    assert main(["run", "out/scene.toml", "--out", "out", "--overwrite", "--device", "cpu", "--quiet"]) == 0
    assert Path("out/scene.toml").read_bytes() == scene
