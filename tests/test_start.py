"""The start of the command: it answers Ctrl-C before it imports anything heavy, and `import warpsph` is light."""

import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import warpsph
from tests.damaging import SCENE

# As the installed script begins: it says so, then runs the command.
BEGIN = "import os, sys; from warpsph.__main__ import main; os.write(1, b'.'); sys.exit(main())"
COMMAND = ("run", "plate.py", "--device", "cpu", "--quiet", "--out", "out", "--overwrite")


def begun():
    """A command in its first instruction."""
    process = subprocess.Popen(
        [sys.executable, "-c", BEGIN, *COMMAND],
        env=os.environ | {"NO_SIGNAL": "yes"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout.read(1) == b"."
    return process


def time_to_run():
    """How long it takes to the run's first row [s]."""
    process, begin = begun(), time.perf_counter()
    while not Path("out/history.csv").exists() and process.poll() is None:
        time.sleep(0.005)
    process.kill()
    process.communicate()
    return time.perf_counter() - begin


@pytest.mark.parametrize("count", [8, pytest.param(300, marks=pytest.mark.long)])
def test_interrupt_at_any_moment_of_the_start_ends_in_one_line(count, tmp_path, monkeypatch):
    """While it imports, reads the scene, starts Warp, loads kernels, makes its folder."""
    monkeypatch.chdir(tmp_path)
    Path("plate.py").write_text(SCENE)
    longest, chance = time_to_run(), random.Random(1)
    for k in range(count):
        moment = longest * (k + chance.random()) / count
        process = begun()
        time.sleep(moment)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        if process.returncode == -signal.SIGINT:  # Python was closing down and had given signals back
            assert errors == b"", errors
            continue
        assert process.returncode == 128 + signal.SIGINT, (moment, errors)
        assert re.fullmatch(rb"warpsph: (interrupted|stopped after step)[^\n]*\n", errors), (moment, errors)


def test_second_interrupt_and_one_at_the_very_end_leave_no_traceback(tmp_path, monkeypatch):
    """Sent by the scene's file as it is read, twice, and by what Python calls last."""
    monkeypatch.chdir(tmp_path)
    kill = "os.kill(os.getpid(), signal.SIGINT)"
    at_the_end = f"import atexit, os, signal\natexit.register(lambda: {kill})\n{SCENE}"
    twice = f"import os, signal\ntry:\n    {kill}\nfinally:\n    {kill}\n"
    for text, said in ((at_the_end, rb"warpsph: interrupted\n"), (twice, rb"warpsph: interrupted[^\n]*\n")):
        Path("plate.py").write_text(text)
        process = begun()
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 130 and re.fullmatch(said, errors), errors
        assert Path("out/summary.json").exists()


def test_importing_the_package_imports_nothing_heavy():
    """Else there is a time at the start of every command in which nobody answers."""
    code = "import sys, warpsph.__main__; print({'warp', 'numpy', 'argparse', 'typing'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_public_names_are_there_for_whoever_asks():
    code = (
        "import warpsph\n"
        "assert {*warpsph.__all__} < {*dir(warpsph)}, 'before any was asked for'\n"
        "from warpsph import *\n"
        "assert Scene is warpsph.Scene and analysis.fit_band and frames.Frames\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert all(getattr(warpsph, name) is not None for name in warpsph.__all__)


def test_name_that_is_not_public_is_no_attribute():
    with pytest.raises(AttributeError, match="module 'warpsph' has no attribute 'Sceme'"):
        _ = warpsph.Sceme
    with pytest.raises(ImportError, match="cannot import name 'Sceme'"):
        exec("from warpsph import Sceme")
