"""What data may do: run no code unless the scene refers to it, read and write nothing outside of their folder."""

import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.damaging import SCENE, command
from tests.test_restart_command import BY_HAND
from warpsph.cli.run_folder import stage_inside
from warpsph.errors import SceneError
from warpsph.frames import Frames

pytestmark = pytest.mark.usefixtures("undrawn")

CODE = 'open("executed", "w").close()\n' + SCENE.split("\n", 1)[1]


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_SIGNAL", "yes")


def scene(folder, **code):
    """A scene by hand with a table `[code]`; returns its path."""
    Path(folder).mkdir(exist_ok=True)
    table = "".join(f"{name} = {json.dumps(value)}\n" for name, value in code.items())
    path = Path(folder) / "scene.toml"
    path.write_text(f"{BY_HAND}\n[code]\n{table}" if table else BY_HAND)
    return path


def run(path, *more):
    return command("run", path, "--device", "cpu", "--quiet", "--out", "out", *more)


def sha256(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


@pytest.mark.parametrize("file", ["/TMP/code.py", "../code.py", "sub/code.py", "link.py", "gone.py", ""])
def test_code_is_only_taken_from_beside_the_scene(file, tmp_path):
    for folder in (tmp_path, tmp_path / "data", tmp_path / "data/sub"):
        folder.mkdir(exist_ok=True)
        (folder / "code.py").write_text(CODE)
    (tmp_path / "data/link.py").symlink_to(tmp_path / "code.py")
    file = file.replace("/TMP", str(tmp_path))
    status, errors = run(scene("data", file=file, sha256=sha256("code.py"), checks=True))
    assert status == 2 and re.search("code.file = .* beside ", errors), errors
    assert not Path("executed").exists() and not Path("out").exists()


def test_code_without_its_hash_or_with_another_is_refused(tmp_path):
    Path("data").mkdir()
    Path("data/code.py").write_text(CODE)
    for code, message in (
        ({}, "its sha256 must be given"),
        ({"sha256": "0" * 64}, "it has changed since the run"),
    ):
        status, errors = run(scene("data", file="code.py", checks=True, **code))
        assert status == 2 and message in errors and not Path("executed").exists()


def test_code_runs_only_where_the_scene_refers_to_it():
    """Not when it is named alone; for its checks, or for what is `{code = PLACE}`, it does."""
    Path("data").mkdir()
    Path("data/code.py").write_text(CODE)
    given = {"file": "code.py", "sha256": sha256("data/code.py")}
    assert run(scene("data", **given)) == (0, "") and not Path("executed").exists()
    assert run("out/scene.toml", "--overwrite") == (0, "") and not Path("executed").exists()
    path = scene("data", **given)
    path.write_text(
        re.sub("function = {.*}", 'function = { code = "output.probes.0.function" }', path.read_text())
    )
    assert run(path, "--overwrite") == (0, "") and Path("executed").exists()
    Path("executed").unlink()
    _, errors = run(scene("data", **given, checks=True), "--overwrite")
    assert Path("executed").exists() and "'width' is not in list" in errors, "its check wants another probe"


@pytest.mark.parametrize("name", ["../x", "a/b", "", ".", "..", "a\\nb", ".hidden", "x" * 200, 7])
def test_name_is_a_name(name):
    path = scene("data")
    text = f'"{name}"' if isinstance(name, str) else name
    path.write_text(f"name = {text}\n{BY_HAND}")
    status, errors = command("run", path, "--device", "cpu", "--quiet")
    assert status == 2 and re.match("warpsph: name = .* it must be a name", errors) and not Path("runs").exists()


@pytest.mark.parametrize("usd", ["/tmp/x.usdc", "../x.usdc", "a/../../x.usdc"])
def test_stage_that_data_name_stays_in_the_run_s_folder(usd):
    path = scene("data")
    path.write_text(f'{BY_HAND}\n[run]\nusd = "{usd}"\n')
    status, errors = run(path)
    assert status == 2 and "outside of the run's folder" in errors and not Path("out").exists()
    with pytest.raises(SceneError):
        stage_inside(Path("out"), usd)


def test_stage_that_data_name_is_written_there():
    path = scene("data")
    path.write_text(f'{BY_HAND}\n[run]\nusd = "x.usdc"\nframes = 2\n')
    assert run(path) == (0, "") and Path("out/x.usdc").is_file()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("field", "../../velocity"),
        ("fields", {"../x": "-"}),
        ("walls", [{"name": "a/b", "still": True}]),
        ("component", 5),
        ("times", [0.0, -1.0]),
        ("rate", 0.0),
        ("curve", ["time", "nothing"]),
        ("curve_reference", ["x", "y"]),
        ("scene", 3),
    ],
)
def test_frames_that_say_something_else_are_refused(key, value):
    assert run(scene("data")) == (0, "")
    path = Path("out/frames/about.json")
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    before = {p: p.read_bytes() for p in Path().rglob("*") if p.is_file()}
    for arguments in (("plot", "out"), ("export", "out", "e.usdc")):
        status, errors = command(*arguments)
        if arguments[0] == "export" and key == "curve":
            continue  # which it does not draw
        assert status == 2 and errors.count("\n") == 1, errors
    Path("e.usdc").unlink(missing_ok=True)
    assert {p: p.read_bytes() for p in Path().rglob("*") if p.is_file()} == before


def test_frames_run_no_code():
    """No pickles: an object in an archive is refused, not built."""
    assert run(scene("data")) == (0, "")
    make = (
        "import numpy as np\nclass Evil:\n    def __reduce__(self): return (open, ('executed', 'w'))\n"
        "np.savez('out/frames/000000.npz', time=np.array([Evil()], dtype=object))"
    )
    subprocess.run([sys.executable, "-c", make], check=True)
    with pytest.raises(SceneError, match="can not be read"):
        Frames("out").read(0)
    assert not Path("executed").exists()
