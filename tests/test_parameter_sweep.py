"""`warpsph sweep`: combinations, what is done, members that fail, one table; here and on a Dask cluster."""

import csv
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from warpsph.cli.main import main
from warpsph.cli.member import Member, last_line
from warpsph.cli.queue import make_missing
from warpsph.cli.sweep import folder_name, members
from warpsph.errors import SceneError

# A bar of ten cells whose end moves; `fault` is what goes wrong, and when.
SCENE = '''"""Bar of a sweep."""
import os, signal, time
from warpsph import *
PARAMETERS = (
    Parameter("velocity", 1.0, "m/s", "of the end"),
    Parameter("fault", "none", "-", "what", choices=("none", "scene", "killed", "nan", "check", "raise", "slow")),
)

def scene(p):
    def end(s):
        if p.fault == "killed" and s.steps == 5:
            os.kill(os.getpid(), signal.SIGKILL)
        if p.fault == "slow":
            time.sleep(0.05)
        return s.field("displacement")[-1, 0]

    return Scene(
        shape=Box((1.0,), 0.1 if p.fault != "scene" else 0.3),
        material=Elastic(young_modulus=8e7, density=2000.0),
        conditions=[Fixed(edge("left")), PrescribedVelocity(edge("right"), (moved(p),))],
        duration=0.01 if p.fault != "slow" else 1.0,
        numerics=p.numerics,
        output=Output(interval=0.0, probes=(Probe("u", "m", end),)),
    )

def moved(p):
    return lambda t: 1e308 if p.fault == "nan" and t > 0.005 else p.velocity

def checks(run):
    assert run.parameters.fault != "raise", "no judge"
    bound = 0.01 if run.parameters.fault != "check" else 0.0
    return [Check("end", run.history["u"][-1], 0.010001 * run.parameters.velocity, "m", bound)]
'''


@pytest.fixture
def bar(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bar.py").write_text(SCENE)
    return "bar.py"


def sweep(*arguments):
    return main(["sweep", "bar.py", "--device", "cpu", *arguments])


def table(folder):
    with (folder / "sweep.csv").open(newline="", encoding="utf-8") as file:
        return {row["run"]: row for row in csv.DictReader(file)}


def test_members_are_all_combinations(bar):
    found = members(bar, ["velocity=1, 2,1", "courant=0.5,0.9"], "float32")
    assert [member.name for member in found] == [
        "velocity=1,courant=0.5",
        "velocity=1,courant=0.9",
        "velocity=2,courant=0.5",
        "velocity=2,courant=0.9",
    ]
    assert found[2].settings == ("velocity=2", "courant=0.5") and found[0].precision == "float32"
    assert [member.name for member in members(bar, [], "float64")] == ["bar"]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["velocty=1,2"], r"--set = 'velocty' .*mean velocity\?"),
        (["velocity=1,fast"], "velocity = 'fast' .* a number"),
        (["velocity"], "--set = 'velocity' .* name=value,value"),
        (["velocity=1", "velocity=2"], "--set = 'velocity=2' .* all values of velocity at once"),
    ],
)
def test_wrong_settings_are_refused_before_any_run(settings, message, bar, capsys):
    assert sweep(*(part for setting in settings for part in ("--set", setting))) == 2
    assert re.match(f"warpsph: {message}", capsys.readouterr().err)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--jobs", "0"], "--jobs = 0"),
        (["--precision", "half"], "precision = 'half'"),
        (["--device", "gpu"], "device = 'gpu'"),
    ],
)
def test_wrong_options_are_refused(option, message, bar, capsys):
    assert sweep(*option) == 2
    assert message in capsys.readouterr().err


def test_sweep_survives_its_members_and_tells_all_of_them_in_one_table(bar, tmp_path, capsys):
    """Scene refused, process killed, NaN, failed check, checks that raise; beside one that passes."""
    assert sweep("--set", "fault=none,scene,killed,nan,check,raise", "--set", "velocity=2", "--out", "out") == 1
    rows = table(tmp_path / "out")
    found = {name.split(",")[0].removeprefix("fault="): row for name, row in rows.items()}
    assert {fault: row["status"] for fault, row in found.items()} == {
        "none": "passed",
        "scene": "failed to run",
        "killed": "failed to run",
        "nan": "broke down",
        "check": "failed",
        "raise": "failed to run",
    }
    assert "AssertionError" in found["raise"]["message"] and "no judge" in found["raise"]["message"]
    assert "spacing = 0.3" in found["scene"]["message"] and "non-finite in step" in found["nan"]["message"]
    said = capsys.readouterr()
    assert "ended by signal 9" in said.out
    assert re.fullmatch(r"warpsph: \d of \d runs failed to run; fault=.*: .*\n", said.err), said.err
    assert all(row["velocity"] == "2" for row in rows.values())
    good = found["none"]
    assert float(good["end [m]"]) == pytest.approx(0.02, rel=1e-3) and good["end passed"] == "True"
    assert good["last u [m]"] == good["end [m]"] and good["nodes"] == "11"
    assert float(good["end error"]) == pytest.approx(1e-4, rel=1e-2) and found["scene"]["end [m]"] == ""


def test_only_what_is_missing_is_made(bar, tmp_path, capsys):
    """Another value, frames, a changed scene file, another precision: those are; what is done is not."""
    assert sweep("--set", "velocity=1", "--out", "out") == 0
    member = Member("velocity=1", str(tmp_path / "bar.py"), ("velocity=1",))
    folder = tmp_path / "out" / "runs" / "velocity=1"
    assert member.done(folder) and not (folder / "frames").exists()
    assert not Member(member.name, member.scene, member.settings, "float32").done(folder)
    assert not Member(member.name, member.scene, ("velocity=1", "courant=0.5")).done(folder)
    assert sweep("--set", "velocity=1,2", "--out", "out") == 0
    out = capsys.readouterr().out
    assert "2 runs, 1 of them done already" in out and "[1/1] velocity=2" in out
    assert sweep("--set", "velocity=1", "--out", "out", "--frames", "2") == 0
    assert len(list((folder / "frames").glob("0*.npz"))) == 3
    assert sweep("--out", "out", "--frames", "few") == 2
    (tmp_path / "bar.py").write_text(SCENE + "# changed\n")
    assert not member.done(folder)


def test_interrupted_sweep_goes_on_from_its_members_checkpoints(bar, tmp_path):
    """SIGINT reaches the sweep alone: it tells its runs, which stop with a checkpoint; the next call resumes."""
    command = [sys.executable, "-m", "warpsph", "sweep", bar, "--set", "fault=slow", "--device", "cpu"]
    process = subprocess.Popen(
        [*command, "--out", "out"], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    folder = tmp_path / "out" / "runs" / "fault=slow"
    limit = time.monotonic() + 60.0
    while time.monotonic() < limit and not _rows(folder) > 5:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and errors == "warpsph: interrupted; the same command goes on from here\n"
    assert "stopped after step" in (folder / "log.txt").read_text() and (folder / "checkpoint.npz").is_file()
    before = _rows(folder)
    process = subprocess.Popen(
        [*command, "--out", "out"], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    while time.monotonic() < limit and not _rows(folder) > before + 3:
        time.sleep(0.05)
    steps = [int(line.split(",")[0]) for line in (folder / "history.csv").read_text().splitlines()[1:]]
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert steps == list(range(len(steps))) and len(steps) > before


def _rows(folder):
    path = folder / "history.csv"
    return path.read_bytes().count(b"\n") if path.is_file() else 0


def test_sweep_on_a_dask_cluster(bar, tmp_path, capsys):
    distributed = pytest.importorskip("distributed", reason="Dask is not installed (extra dask)")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=True, dashboard_address=None
    ) as cluster:
        arguments = ("--set", "fault=none,killed", "--set", "velocity=1,2", "--out", "out")
        assert sweep(*arguments, "--dask", cluster.scheduler_address) == 1
        statuses = {name: row["status"] for name, row in table(tmp_path / "out").items()}
        assert statuses == {
            "fault=none,velocity=1": "passed",
            "fault=none,velocity=2": "passed",
            "fault=killed,velocity=1": "failed to run",
            "fault=killed,velocity=2": "failed to run",
        }
        assert "4 runs, 0 of them done already" in capsys.readouterr().out
        assert sweep(*arguments, "--dask", cluster.scheduler_address) == 1
        assert "4 runs, 2 of them done already" in capsys.readouterr().out


def test_address_without_a_cluster_is_refused(bar, capsys):
    pytest.importorskip("distributed", reason="Dask is not installed (extra dask)")
    assert sweep("--dask", "nonsense://nowhere") == 2
    assert "--dask = 'nonsense://nowhere'" in capsys.readouterr().err


def test_dask_that_is_not_installed_is_said(bar, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert sweep("--dask", "tcp://127.0.0.1:1") == 2
    assert "pip install distributed" in capsys.readouterr().err


class FirstOnly(ThreadPoolExecutor):
    """Is told of runs, and ends the sweep at the first one."""

    def submit(self, task, *arguments):
        raise KeyboardInterrupt


def test_sweep_of_a_hundred_thousand_members_begins_at_once(bar, tmp_path, capsys):
    """Each is known by its own name, and the first is handed out within seconds, with a line before."""
    begin = time.perf_counter()
    values = ",".join(str(k) for k in range(400)), ",".join(repr(k / 256) for k in range(1, 251))
    found = members(bar, [f"velocity={values[0]}", f"courant={values[1]}"], "float64")
    assert len({member.name for member in found}) == len(found) == 100_000
    with pytest.raises(KeyboardInterrupt):
        make_missing(found, tmp_path / "runs", "cpu", FirstOnly(1), quiet=False)
    assert time.perf_counter() - begin < 10.0
    assert capsys.readouterr().out.startswith(
        "100000 runs; looking for what is done already\n100000 runs, 0 of them"
    )


def test_values_that_print_alike_or_are_paths_have_folders_of_their_own(bar, tmp_path):
    """Each once, by names that are none but their own, none of which leads elsewhere."""
    texts = ["a/b", "a_b", "a b", "../a", "..", "é", "e\u0301", "x" * 300, "x" * 301]
    names = [folder_name((f"mode={text}",)) for text in texts]
    assert len(set(names)) == len(texts) and all(len(name) <= 120 and "/" not in name for name in names)
    assert folder_name(("velocity=1", "courant=0.5")) == "velocity=1,courant=0.5"
    assert [member.name for member in members(bar, ["velocity=1,1.0,1,1e0"], "float64")] == [
        "velocity=1",
        "velocity=1.0",
        "velocity=1e0",
    ]


def test_history_that_is_not_its_summary_s_is_made_again(bar, tmp_path):
    """One that lacks its last rows would give the figures of another time."""
    asked = ("--set", "velocity=1", "--out", "out", "--quiet")
    assert sweep(*asked) == 0
    path = tmp_path / "out" / "runs" / "velocity=1" / "history.csv"
    whole = path.read_bytes()
    path.write_bytes(b"".join(whole.splitlines(keepends=True)[:-3]))
    assert sweep(*asked) == 0 and path.read_bytes() == whole
    path.with_name("summary.json").write_text("{")
    assert sweep(*asked) == 1
    row = table(tmp_path / "out")["velocity=1"]
    assert (
        row["status"] == "failed to run" and "summary.json' is not allowed: it can not be read" in row["message"]
    )
    assert path.read_bytes() == whole, "what can not be read is not made again"


def test_member_without_a_log_says_so(tmp_path):
    assert last_line(tmp_path) == "it left no log"
    with pytest.raises(SceneError):
        members("no_such_scene", [], "float64")
