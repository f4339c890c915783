"""Faults that a run survives, or ends from in one line: full disks, folders nobody may write, broken scenes."""

import ctypes
import errno
import os
import re
import resource
import signal
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from tests.test_restart import slope
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
    Scene,
    Simulation,
    edge,
)
from warpsph.cli.main import main
from warpsph.simulation.checkpoint import Checkpoint, Checkpoints, Interval, write_checkpoint
from warpsph.storage.files import remove_parts, write_whole

PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1  # of Linux
NO_RIGHT = 77
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def bar(**changed):
    parts = {
        "shape": Box((1.0,), 0.1),
        "material": Elastic(young_modulus=8e7, density=2000.0),
        "conditions": [Fixed(edge("left")), PrescribedVelocity(edge("right"), (1.0,))],
        "duration": 0.02,
        "output": Output(interval=0.0, probes=(Probe("u", "m", NodeValue("displacement", (1.0,))),)),
    }
    return Scene(**(parts | changed))


def command(*arguments, **options):
    """The command in a process of its own; (exit status, standard error)."""
    done = subprocess.run(
        [sys.executable, "-m", "warpsph", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        **options,
    )
    return done.returncode, done.stderr


def without_override():
    """Takes away a superuser's right to write everywhere; runs in the child, before the command."""
    if os.geteuid() == 0 and ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0):
        os._exit(NO_RIGHT)


@pytest.fixture
def forbidden(tmp_path):
    """A folder in which not even its owner may write."""
    if sys.platform != "linux" and os.geteuid() == 0:
        pytest.skip("a superuser may write everywhere")
    probe = subprocess.run([sys.executable, "-c", ""], preexec_fn=without_override, check=False)
    if probe.returncode == NO_RIGHT:
        pytest.skip("a superuser's rights can not be taken away here")
    folder = tmp_path / "forbidden"
    folder.mkdir()
    folder.chmod(stat.S_IRUSR | stat.S_IXUSR)
    yield folder
    folder.chmod(stat.S_IRWXU)


def test_file_is_whole_or_not_there(tmp_path):
    """A write that fails halfway leaves the former file, and nothing under any other name."""
    path = tmp_path / "file"
    write_whole(path, lambda file: file.write(b"first"))

    def fails(file):
        file.write(b"sec")
        raise FULL

    with pytest.raises(OSError, match="No space left"):
        write_whole(path, fails)
    assert path.read_bytes() == b"first" and [p.name for p in tmp_path.iterdir()] == ["file"]


def test_half_files_go_when_their_writer_does_not_live(tmp_path):
    """Of one name, or of all; a user's file of nearly such a name stays."""
    dead = subprocess.Popen(["true"])
    dead.wait()
    names = [f".{stem}.{process}-0.part.npz" for stem in ("a", "b") for process in (dead.pid, os.getpid())]
    for name in (*names, ".notes.part.npz", "a.npz"):
        (tmp_path / name).touch()

    def gone():
        return [name for name in names if not (tmp_path / name).exists()]

    remove_parts(tmp_path, "a")
    assert gone() == names[:1]
    remove_parts(tmp_path)
    assert gone() == names[::2] and (tmp_path / ".notes.part.npz").exists() and (tmp_path / "a.npz").exists()


def test_file_is_on_the_disk_before_it_takes_its_name_and_then_the_name_is(tmp_path, monkeypatch):
    """Or a machine that loses its power may leave the name with nothing in it."""
    done, sync, replace = [], os.fsync, os.replace

    def noted_sync(handle):
        done.append("folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else "content")
        sync(handle)

    def noted_replace(source, target):
        done.append("name")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", noted_sync)
    monkeypatch.setattr(os, "replace", noted_replace)
    write_whole(tmp_path / "file", lambda file: file.write(b"first"))
    assert done == ["content", "name", "folder"]


def test_checkpoint_that_finds_the_disk_full_leaves_the_last_one_and_the_run(tmp_path, monkeypatch, capsys):
    simulation = Simulation(bar(), device="cpu")
    record = History(simulation)
    path = tmp_path / "checkpoint.npz"
    write_checkpoint(simulation, path, record)
    whole = path.read_bytes()

    def full(file, write=os.fsync):
        raise FULL

    monkeypatch.setattr(os, "fsync", full)
    simulation.run(observers=[record, Checkpoints(simulation, record, path, Interval(steps=30))])
    assert simulation.time == 0.02 and path.read_bytes() == whole
    lines = capsys.readouterr().err.splitlines()
    assert lines and set(lines) == {f"warpsph: {path} can not be written now (No space left on device)"}
    assert [p.name for p in tmp_path.iterdir()] == ["checkpoint.npz"]


def test_history_waits_for_a_disk_that_is_full(tmp_path, monkeypatch, capsys):
    """Steps 11-20 find it full, once in the middle of a row; afterwards every row is there."""

    class Disk:
        """A file that takes ten bytes and then no more, while the disk is full."""

        def __init__(self, file):
            self._file = file

        def write(self, data):
            if not 10 < simulation.steps <= 20:
                return self._file.write(data)
            if self._file.tell() % 1000 >= 990:
                raise FULL
            self._file.write(data[:10])
            raise FULL

        def __getattr__(self, name):
            return getattr(self._file, name)

    whole = Simulation(bar(), device="cpu")
    whole.run(observers=[History(whole, tmp_path / "whole.csv")])
    simulation, path = Simulation(bar(), device="cpu"), tmp_path / "history.csv"
    record = History(simulation, path)
    record._file._file = Disk(record._file._file)
    expected = (tmp_path / "whole.csv").read_bytes()

    class Reader:
        def observe(self, simulation):
            found = path.read_bytes()
            assert expected.startswith(found) and found.endswith(b"\n"), "whole rows at all times"

    simulation.run(observers=[record, Reader()])
    record.close()
    assert path.read_bytes() == expected
    assert capsys.readouterr().err == f"warpsph: {path} can not be written now (No space left on device)\n"


def test_history_that_can_not_begin_leaves_the_former_one(tmp_path):
    """A run that goes on writes it anew; a disk that is full then must not leave an empty one."""
    path = tmp_path / "history.csv"
    record = History(Simulation(bar(), device="cpu"), path)
    record.close()
    before, more = path.read_bytes(), {"rows": np.zeros((1000, len(record.names))), "next": np.array(0.0)}
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limit[1]))
    try:
        with pytest.raises(OSError):
            History(Simulation(bar(), device="cpu"), path, more)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, ignored)
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["history.csv"]


def test_history_that_lost_its_last_rows_says_so(tmp_path, capsys):
    simulation = Simulation(bar(), device="cpu")
    record = History(simulation, tmp_path / "history.csv")
    with open("/dev/full", "wb", buffering=0) as full:
        os.dup2(full.fileno(), record._file._file.fileno())
    simulation.run(until=0.001, observers=[record])
    record.close()
    assert "lacks its last rows" in capsys.readouterr().err and len(record["u"]) > 2


SCENE = '''"""Bar."""
from tests.test_faults import bar
def scene(p):
    return bar()
'''


def test_disk_that_fills_up_ends_a_run_in_one_line_and_what_is_there_is_whole(tmp_path):
    """No file may grow beyond 1600 bytes: scene.toml fits; the history, checkpoints and pictures do not."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1600, 1600))

    (tmp_path / "bar.py").write_text(SCENE)
    arguments = ("run", tmp_path / "bar.py", "--device", "cpu", "--quiet", "--checkpoint-every", "20")
    assert command(*arguments, "--out", tmp_path / "whole") == (0, "")
    status, errors = command(*arguments, "--out", tmp_path / "full", preexec_fn=limit)
    assert status == 1
    *before, last = errors.splitlines()
    assert last == f"warpsph: [Errno 27] File too large: '{tmp_path}/full/history.png'"
    assert f"warpsph: {tmp_path}/full/checkpoint.npz can not be written now (File too large)" in before
    assert f"warpsph: {tmp_path}/full/history.csv lacks its last rows: the disk did not take them" in before
    assert all(line.startswith("warpsph: ") for line in before)
    names = {path.name for path in (tmp_path / "full").rglob("*")}
    assert {"history.csv", "scene.toml", "scene_file.py", "summary.json"} <= names
    assert not any(name.endswith((".png", ".part")) or name == "checkpoint.npz" for name in names)
    whole, written = ((tmp_path / name / "history.csv").read_bytes() for name in ("whole", "full"))
    assert whole.startswith(written) and written.endswith(b"\n") and 1200 < len(written) <= 1600


@pytest.mark.parametrize("arguments", [("run", "elastic_bar"), ("sweep", "elastic_bar"), ("report",)])
def test_read_only_output_folder_is_refused_in_one_line(arguments, forbidden):
    options = ("--out", forbidden / "out", "--device", "cpu")
    status, errors = command(*arguments, *options, preexec_fn=without_override)
    assert status == 2 and errors.count("\n") == 1, errors
    assert errors.startswith("warpsph: --out = ") and "Permission denied" in errors


CACHE_LINE = (
    r"warpsph: Warp's kernel cache can not be written \(.*\); using (\S+) for this run\. .*WARP_CACHE_PATH.*\n"
)


def test_kernel_cache_that_can_not_be_made_is_replaced_and_said_in_one_line(tmp_path):
    environment = os.environ | {"WARP_CACHE_PATH": "/dev/null/none", "TMPDIR": str(tmp_path)}
    start = [sys.executable, "-c", "from warpsph.simulation.device import choose_device; choose_device('cpu')"]
    done = subprocess.run(start, capture_output=True, text=True, timeout=60, check=False, env=environment)
    assert done.returncode == 0
    assert Path(re.fullmatch(CACHE_LINE, done.stderr)[1]).parent == tmp_path


def test_kernel_cache_that_nobody_may_write_is_replaced_and_said_in_one_line(forbidden, tmp_path):
    """Warp starts with it and fails at the first kernel; the run compiles into a temporary folder."""
    inner = forbidden / wp.config.version
    forbidden.chmod(stat.S_IRWXU)
    inner.mkdir(mode=stat.S_IRUSR | stat.S_IXUSR)
    environment = os.environ | {"WARP_CACHE_PATH": str(forbidden), "TMPDIR": str(tmp_path)}
    status, errors = command(
        *("run", "elastic_bar", "--device", "cpu", "--quiet", "--out", tmp_path / "out"),
        env=environment,
        preexec_fn=without_override,
    )
    assert status == 0, errors
    assert list(Path(re.fullmatch(CACHE_LINE, errors)[1]).rglob("*.o")), "compiled there"


@pytest.mark.long
def test_two_runs_that_compile_at_once_both_end_right(tmp_path):
    """Into one empty kernel cache."""
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path / "cache")}
    start = [sys.executable, "-m", "warpsph", "run", "elastic_bar", "--device", "cpu", "--quiet"]
    both = [
        subprocess.Popen(
            [*start, "--out", str(tmp_path / name)], env=environment, stderr=subprocess.PIPE, text=True
        )
        for name in "ab"
    ]
    for process in both:
        _, errors = process.communicate(timeout=300)
        assert (process.returncode, errors) == (0, "")
    one, other = ((tmp_path / name / "history.csv").read_bytes() for name in "ab")
    assert one == other


FIELDS = {
    "velocity and stress": lambda s: (s.nodes.point, "phi"),
    "displacement": lambda s: (s.nodes.displacement, ...),
    "plastic strain": lambda s: (s.internals, ...),
}
OF_CELLS = {"mass": lambda s: (s.nodes.mass, ...), "acceleration": lambda s: (s.nodes.acceleration, ...)}
OF_SUMS = {
    "density": lambda s: (s.nodes.density, ...),
    "velocity gradient": lambda s: (s.nodes.velocity_gradient, ...),
    "auxiliary density": lambda s: (s.stepper.body.auxiliary.density, ...),
}
NUMERICS = {
    "cells": Numerics(),
    "taylor, rk4": Numerics(velocity_scheme="taylor", source_scheme="rk4"),
    "taylor, analytic": Numerics(velocity_scheme="taylor"),
}


@pytest.mark.parametrize(
    ("numerics", "name"),
    [(kind, name) for kind in NUMERICS for name in FIELDS | (OF_CELLS if kind == "cells" else OF_SUMS)],
)
def test_nan_in_a_field_ends_the_run_and_the_checkpoint_before_it_stays_good(numerics, name, tmp_path):
    """Put into one node after step 10, behind the checkpoint; seen two steps later at most."""
    scene = slope(numerics=NUMERICS[numerics])
    simulation = Simulation(scene, device="cpu")
    record = History(simulation)
    watch = Checkpoints(simulation, record, tmp_path / "checkpoint.npz", Interval(steps=10))

    class Poison:
        def observe(self, simulation):
            if simulation.steps == 10:
                array, part = (FIELDS | OF_CELLS | OF_SUMS)[name](simulation)
                values = array.numpy().copy()
                values[part][30] = np.nan
                array.assign(values)

    with pytest.raises(NonFiniteError) as caught:
        simulation.run(observers=[record, watch, Poison()])
    assert 11 <= caught.value.step <= 12
    again = Simulation(scene, device="cpu")
    Checkpoint.read(tmp_path / "checkpoint.npz").restore(again)
    again.run(until=0.2)
    assert all(np.isfinite(again.field(name)).all() for name in again.fields())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("raise RuntimeError('no')", "RuntimeError, line 1: no"),
        ("import sys\nsys.exit(7)", "SystemExit, line 2: 7"),
        ("def scene(p):\n    raise KeyError('gone')", "KeyError, line 2: 'gone'"),
        ("def scene(p):\n    return scene(p)", "RecursionError, line 2"),
        ("def scene(p):\n    import sys; sys.exit(7)", "SystemExit, line 2: 7"),
        ("\0", "bytes"),
    ],
)
def test_scene_file_that_raises_is_refused_in_one_line(text, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(text)
    assert main(["run", "mine.py", "--device", "cpu"]) == 2
    errors = capsys.readouterr().err
    assert errors.startswith("warpsph: scene = ") and errors.count("\n") == 1 and message in errors
    assert not Path("runs").exists()
