"""Signals, parents and streams: what a command does when the world around it goes."""

import os
import re
import signal
import subprocess
import sys
import time
from multiprocessing.synchronize import SemLock
from pathlib import Path

import pytest

from tests.damaging import SCENE, command
from tests.killing_commands import NUMBER, having
from tests.test_owner import SLOW
from warpsph.cli.queue import processes
from warpsph.cli.stopping import TERMINAL
from warpsph.cli.streams import Steady
from warpsph.state.energy import COLUMNS

COMMAND = [sys.executable, "-m", "warpsph"]


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_SIGNAL", "yes")
    Path("plate.py").write_text(SCENE)
    Path("slow.py").write_text(SLOW)


def begun(*arguments, **options):
    """A command whose run has taken its first steps."""
    start = [*COMMAND, *arguments, "--device", "cpu"]
    process = subprocess.Popen(start, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, **options)
    limit = time.monotonic() + 90.0
    while time.monotonic() < limit and process.poll() is None:
        if recorded() > 3:
            break
        time.sleep(0.05)
    return process


def recorded():
    """Rows of the longest history that is there."""
    return max((path.read_bytes().count(b"\n") for path in Path().rglob("history.csv")), default=0)


def test_terminal_that_closes_ends_a_run_with_a_checkpoint():
    """As SIGTERM and Ctrl-C, which tests/test_cli.py sends."""
    process = begun("run", "slow.py", "--out", "out")
    process.send_signal(signal.SIGHUP)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGHUP
    assert re.fullmatch(r"warpsph: stopped after step \d+, .*go on with: warpsph run --resume out\n", errors)
    assert Path("out/checkpoint.npz").is_file() and Path("out/summary.json").is_file()


def test_run_under_nohup_ignores_the_terminal():
    process = begun(
        "run", "slow.py", "--out", "out", preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)
    )
    process.send_signal(signal.SIGHUP)
    before, limit = recorded(), time.monotonic() + 60.0
    while recorded() < before + 20 and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.05)
    goes_on = process.poll() is None and recorded() >= before + 20
    process.kill()
    process.communicate()
    assert goes_on


@pytest.mark.skipif(sys.platform != "linux", reason="it looks for processes in /proc")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGHUP])
def test_runs_of_a_sweep_end_with_it_and_keep_a_checkpoint(number):
    """Ctrl-C and SIGTERM: tests/test_parameter_sweep.py."""
    mark = f"sweep-{os.getpid()}-{number}"
    process = begun(
        "sweep", "slow.py", "--set", "courant=0.5,0.6", "--out", "out", env=os.environ | {NUMBER: mark}
    )
    assert len(having(mark)) == 3
    process.send_signal(number)
    process.communicate(timeout=60)
    limit = time.monotonic() + 30.0
    while having(mark) and time.monotonic() < limit:
        time.sleep(0.1)
    assert having(mark) == []
    assert len(list(Path("out").rglob("checkpoint.npz"))) >= 1


def deaf_to():
    """Signals that do not reach this process."""
    return signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no masks of signals on this system")
def test_processes_of_a_sweep_leave_the_terminal_to_it_from_their_start():
    """Ctrl-C while they import would end each of them in a traceback."""
    with processes(1) as executor:
        assert executor.submit(deaf_to).result(timeout=60) >= set(TERMINAL)
    assert not deaf_to() & set(TERMINAL), "the sweep itself hears it"


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no masks of signals on this system")
def test_signal_waits_until_processes_know_what_they_have_to_clean_up(monkeypatch):
    """It came between a semaphore and the note of it: Python's own tracker wrote a warning of a leak."""
    make, made = SemLock._make_name, []

    def interrupted():
        if not made:
            os.kill(os.getpid(), signal.SIGINT)
        made.append(make())
        return made[-1]

    monkeypatch.setattr(SemLock, "_make_name", staticmethod(interrupted))
    with pytest.raises(KeyboardInterrupt):
        processes(1)
    assert len(made) > 1, "all of them were made"


def test_processes_that_are_stopped_leave_nothing_to_wait_for():
    """Those at work end, those that wait do not begin; no thread dies of it."""
    with processes(2) as executor:
        futures = [executor.submit(time.sleep, 60.0) for _ in range(20)]
        begin = time.monotonic()
        executor.stop()
        assert all(future.done() for future in futures) and time.monotonic() - begin < 30.0
    assert sum(future.cancelled() for future in futures) < 20, "some had been handed out"


def test_progress_bar_makes_no_semaphore_of_the_system():
    """A process of a report that is told to end would leave it behind, and Python's tracker would write so."""
    code = (
        "from multiprocessing.synchronize import SemLock\nSemLock.__init__ = None\n"
        "from warpsph.cli.progress import bar\nbar(False, total=1).close()\nbar(True, total=1).close()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


STREAMS = {
    "no error stream": "2>&-",
    "no output": ">&-",
    "none at all": "<&- >&- 2>&-",
    "full output": ">/dev/full",
    "both full": ">/dev/full 2>/dev/full",
    "a reader that has gone": "| true",
}


def test_streams_that_are_closed_or_full_do_not_end_a_run():
    """Each kind of stream in a run of its own, all of them side by side."""
    runs = {}
    for number, (name, redirection) in enumerate(STREAMS.items()):
        line = f"{sys.executable} -m warpsph run plate.py --device cpu --out {number} {redirection}"
        runs[name] = subprocess.Popen(["bash", "-c", f"set -o pipefail; {line}"], stdout=subprocess.DEVNULL)
    for number, (name, process) in enumerate(runs.items()):
        assert process.wait(timeout=120) == 0, name
        history = Path(f"{number}/history.csv").read_bytes()
        header, *rows = history.splitlines()
        assert header.startswith(b"step [-],time [s],width [m],energy.kinetic [J/m],"), name
        assert Path(f"{number}/summary.json").is_file(), name
        commas = 2 + len(COLUMNS)
        assert all(row.count(b",") == commas for row in (header, *rows)), f"{name}: written into it"


def test_no_file_takes_the_place_of_a_stream_that_is_closed():
    """Or what a library writes to standard error would go into a file of the run's."""
    opens = "open('a', 'w').fileno()"
    code = f"from warpsph.cli.streams import steady_streams\nwith steady_streams():\n    assert {opens} > 2"
    done = subprocess.run(["bash", "-c", '"$0" -c "$1" <&- >&- 2>&-', sys.executable, code], check=False)
    assert done.returncode == 0


@pytest.mark.parametrize(
    "changed",
    [
        {"LANG": "C", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"PYTHONIOENCODING": "ascii", "HOME": "/nowhere", "TMPDIR": "/nowhere", "MPLCONFIGDIR": "/nowhere"},
    ],
    ids=["locale", "encoding and folders"],
)
def test_environment_that_lacks_something_does_not_end_a_run(changed):
    done = subprocess.run(
        [*COMMAND, "run", "plate.py", "--device", "cpu", "--out", "out"],
        env=os.environ | changed,
        capture_output=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0 and b"Traceback" not in done.stderr, done.stderr


def test_letters_that_a_stream_can_not_show_are_written_otherwise(tmp_path):
    with (tmp_path / "out").open("w", encoding="ascii") as file:
        Steady(file).write("Δt = 3 µs…")
    assert (tmp_path / "out").read_text() == r"\u0394t = 3 \xb5s\u2026"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_stream_that_is_full_already_when_a_command_begins_is_no_error():
    """In a program of one's own, which has written to it before."""
    with open("/dev/full", "w") as file:
        file.write("waits")
        stream = Steady(file)
        stream.write("is dropped")
        stream.flush()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run", ""), "scene = ''"),
        (("run", "plate.py", "--threads", "1" + "0" * 20), "--threads = .*at most 1024"),
        (("run", "plate.py", "--frames", "1" + "0" * 20), "--frames = .*at most 999999"),
        (("run", "plate.py", "--out", "a\nb"), "argument = 'a\\\\nb' .*without control characters"),
        (("run", "plate.py", "--out", os.fsdecode(b"\xff")), r"argument = '\\udcff' .*UTF-8"),
        (("run", "deep.toml"), "nested too deep"),
        (("sweep", "plate.py", "--jobs", "1" + "0" * 20), "--jobs = .*below 1025"),
    ],
)
def test_arguments_that_nobody_means_are_refused_in_one_line(arguments, message):
    Path("deep.toml").write_text("a = " + "[" * 3000 + "]" * 3000)
    status, errors = command(*arguments)
    assert status == 2 and errors.count("\n") == 1 and re.search(message, errors), errors


@pytest.mark.parametrize("until", ["1e-300", "5e-324", "1e-9"])
def test_any_time_above_zero_is_an_end_or_refused(until, undrawn):
    status, errors = command("run", "plate.py", "--until", until, "--device", "cpu", "--out", "out")
    assert (status, errors.count("\n")) == ((0, 0) if until == "1e-9" else (2, 1)), errors
