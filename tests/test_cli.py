"""The command line: what it prints, writes and returns."""

import csv
import json
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import warp as wp

import warpsph
from warpsph.cli.catalogue import load, shipped
from warpsph.cli.main import main
from warpsph.cli.runner import table
from warpsph.scene.check import Check

pytestmark = pytest.mark.usefixtures("undrawn")

# A bar of ten cells, Δt = 0.5 ms, pulled at its end; {extra} goes into the Scene, {more} to the end.
USER_SCENE = '''"""Bar of a user."""
from __future__ import annotations
from dataclasses import dataclass
from warpsph import *

NUMERICS = {{"velocity_scheme": "taylor", "courant": 1}}
PARAMETERS = (
    Parameter("duration", 0.005, "s", "simulated time"),
    Parameter("cells", 10, "-", "number of cells"),
    Parameter("pulled", True, "-", "whether the end moves"),
    Parameter("mode", "long", "-", "kind of bar", choices=("long", "short")),
)

@dataclass
class Bar:
    length: float = 1.0

def scene(p):
    return Scene(
        shape=Box((Bar().length,), 1.0 / p.cells),
        material=Elastic(young_modulus=8e7, density=2000.0),
        conditions=[Fixed(edge("left")), PrescribedVelocity(edge("right"), (end_velocity,))],
        duration=p.duration,
        numerics=p.numerics,
        {extra}
    )

def end_velocity(t):
    return {end_velocity}
{more}
'''
END_PROBE = 'output=Output(interval=0.0, probes=(Probe("u", "m", NodeValue("displacement", (1.0,))),)),'


@pytest.fixture(autouse=True)
def _in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def user_file(tmp_path):
    """Writes a user's scene file."""

    def write(extra=END_PROBE, more="", end_velocity="1.0", text=None):
        path = tmp_path / "mine.py"
        path.write_text(text or USER_SCENE.format(extra=extra, more=more, end_velocity=end_velocity))
        return str(path)

    return write


def run(*arguments):
    return main(["run", *arguments, "--device", "cpu"])


def one_line(captured):
    """What stands on standard error: one line without a traceback."""
    text = captured.err
    assert text.startswith("warpsph: ") and text.endswith("\n") and text.count("\n") == 1, text
    return text.strip()


def rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def test_list_names_every_shipped_scene_with_its_description(capsys):
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[0] for line in lines] == list(shipped())
    assert {"elastic_bar", "perzyna_bar", "strip_footing"} <= set(shipped())
    for line, name in zip(lines, shipped(), strict=True):
        assert line.endswith(load(name).description) and load(name).description


@pytest.mark.parametrize("name", shipped())
def test_list_scene_shows_every_parameter_with_value_unit_and_meaning(name, capsys):
    assert main(["list", name]) == 0
    shown = [re.split(r"\s{2,}", line, maxsplit=3) for line in capsys.readouterr().out.splitlines()[2:]]
    parameters = load(name).parameters
    assert [row[0] for row in shown] == [p.name for p in parameters]
    assert [row[1] for row in shown] == ["auto" if p.default is None else str(p.default) for p in parameters]
    assert all(unit and meaning for _, _, unit, meaning in shown)


def test_run_until_skips_the_checks(tmp_path, capsys):
    assert run("elastic_bar", "--until", "0.001", "--out", str(tmp_path / "out")) == 0
    assert "checks skipped" in capsys.readouterr().out
    summary = summary_of(tmp_path / "out")
    assert summary["checks"] == []
    assert summary["simulated_time"] == pytest.approx(0.001, rel=1e-12)


def test_results_go_to_runs_scene_unless_told(tmp_path):
    assert run("elastic_bar", "--until", "1e-4", "--quiet") == 0
    assert sorted(p.name for p in (tmp_path / "runs" / "elastic_bar").iterdir()) == [
        ".warpsph",
        "field.png",
        "frames",
        "history.csv",
        "history.png",
        "scene.toml",
        "scene_file.py",
        "summary.json",
    ]


def test_whole_run_writes_summary_history_and_pictures(tmp_path, capsys):
    folder = tmp_path / "a" / "b"
    assert run("perzyna_bar", "--set", "velocity=0.9", "--out", str(folder)) == 0
    summary = summary_of(folder)
    speed, cell, steps = (8e7 / 2000.0) ** 0.5, 0.01, 80  # Courant number 1 for 4 ms
    expected = {
        "scene": "perzyna_bar",
        "warpsph_version": warpsph.__version__,
        "warp_version": wp.config.version,
        "device": "cpu",
        "precision": "float64",
        "nodes": 101,
        "auxiliary_nodes": 100,
        "steps": steps,
        "error": None,
    }
    assert {key: summary[key] for key in expected} == expected
    assert summary["parameters"]["velocity"] == 0.9 and summary["parameters"]["courant"] == 1.0
    assert set(summary["parameters"]) == {p.name for p in load("perzyna_bar").parameters}
    assert summary["time_step"] == {bound: pytest.approx(cell / speed, rel=1e-9) for bound in ("min", "max")}
    assert summary["simulated_time"] == pytest.approx(4e-3, rel=1e-12)
    assert summary["wall_time"] > 0.0 and summary["node_steps_per_second"] >= 101 * steps / summary["wall_time"]

    (check,) = summary["checks"]
    assert list(check) == ["name", "value", "reference", "unit", "error", "bound", "passed"]
    assert check["error"] == abs(check["value"] - check["reference"]) <= check["bound"] and check["passed"] is True
    assert re.search(rf"^{check['name']} .* passed$", capsys.readouterr().out, re.MULTILINE)

    header, *samples = rows(folder / "history.csv")
    assert header == ["step [-]", "time [s]", "end_stress [Pa]"]
    assert [int(row[0]) for row in samples] == list(range(steps + 1))
    assert np.allclose([float(row[1]) for row in samples], np.arange(steps + 1) * cell / speed, rtol=1e-9)
    assert (folder / "history.png").is_file() and (folder / "field.png").is_file()


def test_failed_check_exits_with_1(user_file, tmp_path, capsys):
    right, wrong = 'Check("right", 1.0, 1.0, "-", 0.1)', 'Check("wrong", 2.0, 1.0, "-", 0.5)'
    path = user_file(more=f"def checks(run):\n    return [{right}, {wrong}]")
    assert run(path, "--quiet", "--out", str(tmp_path)) == 1
    out = capsys.readouterr().out
    assert re.search(r"^right .* passed$", out, re.MULTILINE) and re.search(
        r"^wrong .* FAILED$", out, re.MULTILINE
    )
    assert [check["passed"] for check in summary_of(tmp_path)["checks"]] == [True, False]


def test_check_that_is_not_finite_fails():
    assert not Check("c", float("nan"), 1.0, "-", 10.0).passed
    assert not Check("c", float("inf"), 0.0, "-", 1e300, relative=False).passed


def test_table_shows_relative_errors_in_percent():
    text = table([Check("a", 1.02, 1.0, "m", 0.05), Check("b", 0.5, 0.0, "Pa", 0.1, relative=False)])
    assert [line.split() for line in text.splitlines()[1:]] == [
        ["a", "1.02", "1", "m", "2", "%", "5", "%", "passed"],
        ["b", "0.5", "0", "Pa", "0.5", "0.1", "FAILED"],
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["elastic_bat"], r"scene = 'elastic_bat' .*did you mean elastic_bar\?"),
        (["no/such/file.py"], "scene = 'no/such/file.py' .* or the path of a scene file"),
        (["elastic_bar", "--set", "spacin=0.1"], r"--set = 'spacin' .*did you mean spacing\?"),
        (["elastic_bar", "--set", "spacing"], "--set = 'spacing' .* name=value"),
        (["elastic_bar", "--set", "spacing=abc"], "spacing = 'abc' .* a number"),
        (["elastic_bar", "--set", "spacing="], "spacing = '' .* a number"),
        (["elastic_bar", "--set", "spacing=0.3"], "spacing = 0.3 .* whole number of spacings"),
        (["elastic_bar", "--set", "spacing=nan"], "spacing = nan .* finite number above 0"),
        (["elastic_bar", "--set", "young_modulus=-1"], "young_modulus = -1.0 .* above 0"),
        (["elastic_bar", "--set", "kernel=gausian"], r"kernel = 'gausian' .*did you mean gaussian\?"),
        (
            ["elastic_bar", "--set", "velocity_scheme=tailor"],
            r"velocity_scheme = 'tailor' .*did you mean taylor\?",
        ),
        (["elastic_bar", "--set", "courant=7"], "courant = 7.0 .* stable up to"),
        (["elastic_bar", "--set", "time_step=1"], "time_step = 1.0 .* at most"),
        (["elastic_bar", "--set", "time_step=soon"], "time_step = 'soon' .* a number or auto"),
        (["elastic_bar", "--set", "smoothing_ratio=0.01"], "smoothing_ratio = 0.01 .* must be above"),
        (["elastic_bar", "--until", "soon"], r"--until = 'soon' .* a number above 0 \[s\]"),
        (["elastic_bar", "--until", "-1"], "--until = '-1' .* above 0"),
        (["elastic_bar", "--until", "0"], "--until = '0' .* above 0"),
        (["elastic_bar", "--until", "inf"], "--until = 'inf' .* above 0"),
        (["elastic_bar", "--precision", "float16"], "precision = 'float16' .* one of float32, float64"),
    ],
)
def test_bad_input_exits_with_2_and_one_line(arguments, message, capsys):
    assert run(*arguments) == 2
    captured = capsys.readouterr()
    assert re.search(f"^warpsph: {message}", one_line(captured))
    assert captured.out == ""


def test_bad_device_exits_with_2_and_one_line(capsys):
    assert main(["run", "elastic_bar", "--device", "cuda:99"]) == 2
    assert re.search("device = 'cuda:99' .* one of .*cpu", one_line(capsys.readouterr()))


def test_unwritable_folder_exits_with_2_and_one_line(tmp_path, capsys):
    (tmp_path / "file").touch()
    assert run("elastic_bar", "--out", str(tmp_path / "file" / "out")) == 2
    assert re.search("--out = .* a folder that can be written", one_line(capsys.readouterr()))


def test_list_of_an_unknown_scene_exits_with_2_and_one_line(capsys):
    assert main(["list", "perzyna"]) == 2
    assert "did you mean perzyna_bar?" in one_line(capsys.readouterr())


@pytest.mark.parametrize("arguments", [[], ["walk"], ["run"], ["run", "elastic_bar", "--fast"]])
def test_unknown_commands_and_options_exit_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out.strip() == f"warpsph {warpsph.__version__}"


@pytest.mark.parametrize("name", ["mine.py", "./mine.py"])
def test_user_s_file_runs_by_path(name, user_file, tmp_path):
    """At the end u = ∫ v dt = 1 m/s · 5 ms; NUMERICS may hold a whole number, the file a dataclass."""
    user_file()
    assert run(name, "--quiet") == 0
    header, *samples = rows(tmp_path / "runs" / "mine" / "history.csv")
    assert header[2] == "u [m]" and len(samples) == 11
    assert float(samples[-1][2]) == pytest.approx(5e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("setting", "name", "value"),
    [
        ("cells=20", "cells", 20),
        ("pulled=false", "pulled", False),
        ("mode=short", "mode", "short"),
        ("duration=1e-3", "duration", 1e-3),
        ("courant=0.5", "courant", 0.5),
        ("smoothing_ratio=auto", "smoothing_ratio", None),
        (" duration = 0.001 ", "duration", 1e-3),
    ],
)
def test_settings_have_the_type_of_their_default(setting, name, value, user_file):
    _, values = load(user_file()).build([setting])
    assert values[name] == value and type(values[name]) is type(value)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("cells=2.5", "cells = '2.5' .* a whole number"),
        ("pulled=perhaps", "pulled = 'perhaps' .* true or false"),
        ("mode=log", r"mode = 'log' .* one of long, short \(did you mean long\?\)"),
        ("cells=0", "raised ZeroDivisionError, line 20"),
    ],
)
def test_wrong_setting_of_a_user_s_parameter_is_refused(setting, message, user_file, capsys):
    assert run(user_file(), "--set", setting) == 2
    assert re.search(message, one_line(capsys.readouterr()))


@pytest.mark.parametrize(
    ("setting", "ratio"), [("courant=1", 0.5), ("smoothing_ratio=auto", 0.6), ("kernel=cubic_spline", 0.9)]
)
def test_auto_undoes_a_scene_s_own_smoothing_ratio_and_so_does_another_kernel(setting, ratio):
    scene, _ = load("perzyna_bar").build([setting])
    assert scene.numerics.smoothing_ratio == ratio


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\ny = x / 0\n", r"mine\.py' .* ZeroDivisionError, line 2: division by zero"),
        ("x = 1\n\ny = (\n", r"mine\.py' .* SyntaxError, line 3"),
        ("import nowhere_to_be_found\n", r"mine\.py' .* ModuleNotFoundError, line 1"),
        ("def scene(p):\n    return f(p)\ndef f(p):\n    return p.gone\n", "AttributeError, line 4: .*gone"),
        ("raise ValueError('a\\nb')\n", "ValueError, line 1: a b"),
        ("x = 1\n", r"must define a function scene\(p\)"),
        ("def scene(p):\n    return 3\n", r"mine\.scene\(p\) = 3 .* a Scene"),
        ("PARAMETERS = [('a', 1)]\ndef scene(p): return 3\n", r"PARAMETERS = \('a', 1\) .* sequence of Parameter"),
        ("PARAMETERS = 3\ndef scene(p): return 3\n", "PARAMETERS = 3 .* sequence of Parameter"),
        ("NUMERICS = [1]\ndef scene(p): return 3\n", r"NUMERICS = \[1\] .* a dictionary"),
        ("NUMERICS = {'curant': 1.0}\ndef scene(p): return 3\n", r"NUMERICS = 'curant' .* mean courant\?"),
        ("NUMERICS = {'courant': 'x'}\ndef scene(p): return 3\n", "NUMERICS.* = 'x' .* finite number"),
        (
            "import warpsph\nPARAMETERS = [warpsph.Parameter('courant', 1.0, '-', '')]\ndef scene(p): return 3\n",
            "PARAMETERS = 'courant' .* taken",
        ),
    ],
)
def test_user_s_file_that_raises_exits_with_2_and_names_the_line(text, message, user_file, capsys):
    user_file(text=text)
    assert run("mine.py") == 2
    assert re.search(message, one_line(capsys.readouterr()))


def test_file_that_is_no_python_file_is_refused(tmp_path, capsys):
    (tmp_path / "scene.txt").write_text("x = 1")
    assert run("scene.txt") == 2
    assert "must end in .py" in one_line(capsys.readouterr())


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("def checks(run):\n    return [1 / 0]", "ZeroDivisionError, line 31"),
        ("def checks(run):\n    return None", r"mine\.checks\(run\) = None .* a sequence of Check"),
        ("def checks(run):\n    return [3]", r"mine\.checks\(run\) = 3 .* a sequence of Check"),
    ],
)
def test_run_keeps_its_summary_when_the_checks_raise(more, message, user_file, tmp_path, capsys):
    assert run(user_file(more=more), "--quiet", "--out", str(tmp_path)) == 2
    assert re.search(message, one_line(capsys.readouterr()))
    assert summary_of(tmp_path)["steps"] == 10 and len(rows(tmp_path / "history.csv")) == 12


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ('output=Output(field="stres"),', r"field = 'stres' .*did you mean stress\?"),
        ("output=Output(component=1),", "Output.component = 1 .* below 1"),
        ('output=Output(probes=(Probe("p", "-", lambda s: s.gone),)),', "AttributeError, line 25: .*gone"),
    ],
)
def test_wrong_output_is_refused_before_the_run(extra, message, user_file, tmp_path, capsys):
    assert run(user_file(extra), "--out", str(tmp_path)) == 2
    assert re.search(message, one_line(capsys.readouterr()))
    assert not (tmp_path / "summary.json").exists()


def test_probe_that_raises_during_the_run_keeps_the_history(user_file, tmp_path, capsys):
    probe = 'output=Output(interval=0.0, probes=(Probe("p", "-", lambda s: 1 / (3 - s.steps)),)),'
    assert run(user_file(probe), "--quiet", "--out", str(tmp_path)) == 2
    assert "ZeroDivisionError, line 25" in one_line(capsys.readouterr())
    assert [row[0] for row in rows(tmp_path / "history.csv")[1:]] == ["0", "1", "2"]


def test_quiet_success_prints_nothing(user_file, capfd):
    path = user_file(more='def checks(run):\n    return [Check("right", 1.0, 1.0, "-", 0.1)]')
    assert run(path, "--quiet") == 0
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


def test_no_progress_bar_where_output_is_no_terminal(user_file, tmp_path):
    """The installed module in a process of its own: plain lines, nothing on standard error."""
    command = [sys.executable, "-m", "warpsph", "run", user_file(), "--device", "cpu", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, cwd=tmp_path, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"\r" not in done.stdout and b"%" not in done.stdout
    lines = done.stdout.decode().splitlines()
    assert lines[0].startswith("mine: 11 nodes, 10 cells, float64 on cpu, time step 0.0005 s")
    assert lines[1].startswith("10 steps to t = 0.005 s")


def test_nan_ends_the_run_with_1_and_keeps_what_was_recorded(user_file, tmp_path, capsys):
    """The end's stress is infinite from 1.2 ms on: the third step, from 1 to 1.5 ms, sees it first, at the end."""
    path = user_file(end_velocity="1.0 if t < 1.2e-3 else 1e308")
    assert run(path, "--quiet", "--out", str(tmp_path)) == 1
    message = one_line(capsys.readouterr())
    assert re.search(r"non-finite in step 3 \(t = 0\.0015 s\) at node 10, initially at \(1\) m", message)
    assert [row[0] for row in rows(tmp_path / "history.csv")[1:]] == ["0", "1", "2"]
    summary = summary_of(tmp_path)
    assert message == f"warpsph: {summary['error']}"
    assert summary["steps"] == 3 and summary["checks"] == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_in_one_line_with_history_and_checkpoint(number, tmp_path):
    out = tmp_path / "run"
    command = [sys.executable, "-m", "warpsph", "run", "gravity_slope", "--device", "cpu", "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    history, limit = out / "history.csv", time.monotonic() + 60.0
    while time.monotonic() < limit and not (history.is_file() and len(history.read_text().splitlines()) > 3):
        time.sleep(0.05)
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 128 + number
    line = r"warpsph: stopped after step \d+, t = [\d.e-]+ s; go on with: warpsph run --resume (\S+)\n"
    assert re.fullmatch(line, errors)[1] == str(out)
    assert len(history.read_text().splitlines()) > 3 and (out / "checkpoint.npz").is_file()
