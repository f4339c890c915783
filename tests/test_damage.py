"""What a run has left, damaged anyhow: one line or the right result, and no file is lost."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from tests.damaging import nan, out_of_range
from tests.test_restart import SCENES, resumed, started
from warpsph import SceneError
from warpsph.errors import DamagedError
from warpsph.simulation.checkpoint import Checkpoint, seal, write_checkpoint
from warpsph.storage import reading

TRIALS = [(25, 1), *(pytest.param(250, seed, marks=pytest.mark.long) for seed in range(2, 6))]


@pytest.mark.parametrize(("count", "seed"), TRIALS)
def test_damaged_files_are_refused_in_one_line_and_nothing_is_lost(count, seed, tmp_path):
    """Flips, cuts, swaps over every kind of file, each read by plot, export, resume, a repetition or a new run."""
    command = [sys.executable, "-m", "tests.damaging", str(tmp_path), str(count), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A folder with a checkpoint of each scene, by the scene's name."""
    folders = {}
    for name in ("slope", "published slope"):
        folder = folders[name] = tmp_path_factory.mktemp("saved")
        simulation, history = started(SCENES[name](), "float64", folder)
        simulation.run(until=0.1)
        write_checkpoint(simulation, folder / "checkpoint.npz", history)
    return folders


def forged(saved, folder, name, change):
    """A checkpoint with one array changed and its digest made to fit: what no checksum can tell."""
    with np.load(saved / "checkpoint.npz") as file:
        content = dict(file)
    header = json.loads(content.pop("header").tobytes())
    content[name] = change(content[name])
    header["content"] = seal(header, content)
    text = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    np.savez(folder / "checkpoint.npz", header=text, **content)


@pytest.mark.parametrize(
    ("scene", "ending", "change", "message"),
    [
        ("slope", "nodes.mass", lambda v: v[:-1], r"nodes.mass has shape \(\d+,\)"),
        ("slope", "nodes.mass", lambda v: v.astype(np.float32), "nodes.mass is of type float32"),
        ("slope", "nodes.mass", nan, "nodes.mass is not finite everywhere"),
        ("slope", "body.corners", out_of_range, "corners leads out of its table"),
        ("slope", "node_cells.place", out_of_range, "place leads out of its table"),
        ("slope", "conditions.row", out_of_range, "row leads out of its table"),
        ("published slope", "auxiliary.cell", out_of_range, "auxiliary.cell leads out of its table"),
        ("published slope", "pairs.index", out_of_range, "pairs leads out of its table"),
        ("published slope", "pairs.start", out_of_range, "pairs leads out of its list"),
        ("published slope", "pairs.index", lambda v: v[:3], "pairs leads out of its list"),
        ("published slope", "around_nodes.index", out_of_range, "leads out of its table"),
        ("published slope", "around_auxiliary.index", out_of_range, "leads out of its table"),
        ("published slope", "table.row", out_of_range, "row leads out of its table"),
    ],
)
def test_forged_checkpoint_is_refused_before_a_kernel_follows_it(scene, ending, change, message, saved, tmp_path):
    with np.load(saved[scene] / "checkpoint.npz") as file:
        names = [name for name in file.files if name.endswith(ending)]
    assert names
    for name in names:
        forged(saved[scene], tmp_path, name, change)
        with pytest.raises(SceneError, match=message):
            resumed(SCENES[scene](), "float64", tmp_path)


def test_checkpoint_whose_arrays_are_another_s_is_refused(saved, tmp_path):
    """Every checksum of the archive fits; only the digest over all of it tells."""
    with np.load(saved["slope"] / "checkpoint.npz") as file:
        content = dict(file)
    name = next(name for name in content if name.endswith("nodes.mass"))
    content[name] = content[name] * 1.001
    np.savez(tmp_path / "checkpoint.npz", **content)
    with pytest.raises(DamagedError, match="it is not what was written"):
        Checkpoint.read(tmp_path / "checkpoint.npz")


@pytest.mark.parametrize("kind", ["folder", "pipe", "compressed", "objects"])
def test_archive_of_another_kind_is_refused(kind, tmp_path):
    path = tmp_path / "frame.npz"
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "compressed":
        np.savez_compressed(path, a=np.zeros(10**7))  # a few bytes that would fill the memory
    else:
        np.savez(path, a=np.array([{}], dtype=object))
    with pytest.raises(DamagedError, match=r"frame = .*frame\.npz' .* can not be read"):
        reading.read_arrays("frame", path)
