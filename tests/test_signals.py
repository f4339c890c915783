"""Signals at any moment of any command: one line, the status that says so, and what is there is whole."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.damaging import SCENE
from tests.signalling import begun, struck
from warpsph.cli.stopping import interruptible, interrupting

RUN = ("run", "plate.py", "--device", "cpu", "--quiet", "--out", "out", "--overwrite")


@pytest.mark.skipif(sys.platform != "linux", reason="it looks for processes in /proc")
@pytest.mark.parametrize("count", [4, pytest.param(150, marks=pytest.mark.long)])
def test_signals_at_any_moment_of_any_command(count, tmp_path):
    """Starting, running, writing, ending; runs, resumed runs, exports, pictures; in the long form sweeps, reports,
    and kernels being built. What goes on afterwards ends as if there had been no signal."""
    command = [sys.executable, "-m", "tests.signalling", str(tmp_path), str(count), "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]


@pytest.mark.parametrize("last", ["as it is read, twice", "as Python ends"])
def test_interrupt_where_nobody_expects_one_leaves_no_traceback(last, tmp_path, monkeypatch):
    """Sent by the scene's file itself."""
    monkeypatch.chdir(tmp_path)
    kill = "os.kill(os.getpid(), signal.SIGINT)"
    if last == "as Python ends":
        text = f"import atexit, os, signal\natexit.register(lambda: {kill})\n{SCENE}"
    else:
        text = f"import os, signal\ntry:\n    {kill}\nfinally:\n    {kill}\n"
    Path("plate.py").write_text(text)
    process = begun(*RUN)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and errors.startswith("warpsph: interrupted") and errors.count("\n") == 1
    assert Path("out/summary.json").exists() == (last == "as Python ends")


# Sends Ctrl-C when a module of that name is looked for, then begins as the installed script.
LOOKING = """import os, signal, sys
class Finder:
    def find_spec(name, path, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder)
from warpsph.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize("module", ["pxr.Vt", "pxr.UsdShade"])
def test_interrupt_while_a_library_is_imported_is_one_line(module, tmp_path, monkeypatch):
    """USD said so in many lines of its own, or dropped it and went on."""
    monkeypatch.chdir(tmp_path)
    Path("plate.py").write_text(SCENE)
    assert begun(*RUN, "--frames", "2").wait(timeout=60) == 0
    command = [sys.executable, "-c", LOOKING.format(module=module), "export", "out", "e.usdc"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 130 and done.stderr.startswith("warpsph: interrupted"), done.stderr
    assert done.stderr.count("\n") == 1 and not Path("e.usdc").exists()


@pytest.mark.parametrize("stoppable", [interruptible, interrupting])
def test_error_that_a_library_makes_of_an_interrupt_is_an_interrupt(stoppable):
    def imported():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("no module named numpy") from None

    with pytest.raises(KeyboardInterrupt), stoppable():
        imported()
    with pytest.raises(ImportError), stoppable():
        raise ImportError("no module named numpy")


@pytest.mark.parametrize("count", [8, pytest.param(300, marks=pytest.mark.long)])
def test_interrupt_at_any_moment_of_the_start_ends_in_one_line(count, tmp_path, monkeypatch):
    """While it imports: evenly over the first second, in which no run has begun."""
    monkeypatch.chdir(tmp_path)
    Path("plate.py").write_text(SCENE)
    for k in range(count):
        status, errors = struck(begun(*RUN), k / count, signal.SIGINT)
        if status != -signal.SIGINT or errors:  # that is how Python ends, when it has given signals back
            assert status in (0, 130) and errors.count("\n") == (status == 130) and "Traceback" not in errors, (
                errors
            )
