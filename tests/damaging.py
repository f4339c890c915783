"""Damages what a run has left, file by file, and reads it back; `tests/test_damage.py` starts this in a process of
its own, which a segmentation fault would end."""

import contextlib
import io
import os
import random
import shutil
import signal
import sys
import traceback
from pathlib import Path

import numpy as np
import pytest

from tests.undrawn import as_a_dot
from warpsph.cli.main import main

SCENE = '''"""Plate that is pulled; a signal comes after 20 steps."""
import os, signal
from warpsph import *

def width(s):
    if s.steps == 20 and not os.environ.get("NO_SIGNAL"):
        os.kill(os.getpid(), signal.SIGTERM)
    return s.field("displacement")[-1, 0]

def scene(p):
    return Scene(
        shape=Box((0.4, 0.2), 0.1).mapped(lambda x, y: (x, y + 0.01 * x)),
        material=PerzynaVonMises(
            young_modulus=8e7, poisson_ratio=0.3, density=2000.0, fluidity=5.0, yield_size=2e4
        ),
        conditions=[Fixed(edge("left")), PrescribedVelocity(edge("right"), (1.0, None))],
        duration=0.01,
        numerics=p.numerics,
        output=Output(interval=0.0, probes=(Probe("width", "m", width),)),
    )

def checks(run):
    return [Check("width", run.history["width"][-1], 0.01, "m", 0.5)]
'''
OWN = ("notes.txt", "frames/notes.txt", "run.usdc.frames/notes.txt", "run_frames/notes.txt")  # the user's files
COMMANDS = {
    "plot": ["plot", "RUN"],
    "export USD": ["export", "RUN", "RUN/again.usdc"],
    "export VTK": ["export", "RUN", "RUN/run.pvd"],
    "resume": ["run", "--resume", "RUN", "--device", "cpu"],
    "repeat": ["run", "RUN/scene.toml", "--out", "RUN-2", "--device", "cpu"],
    "run": ["run", "RUN/scene_file.py", "--out", "RUN", "--device", "cpu"],
}


def command(*arguments):
    """Exit status and standard error of a command; a traceback in place of the status where one came."""
    errors = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
        try:
            status = main([str(part) for part in arguments])
        except BaseException:
            status = traceback.format_exc()
    return status, errors.getvalue()


def stopped_run(folder):
    """A run that was stopped on its way, with every kind of file that a run and its exports leave."""
    folder.mkdir()
    (folder / "plate.py").write_text(SCENE)
    options = ("--frames", "4", "--usd", folder / "run.usdc", "--checkpoint-every", "5", "--device", "cpu")
    assert command("run", folder / "plate.py", *options, "--out", folder)[0] == 128 + signal.SIGTERM
    os.environ["NO_SIGNAL"] = "yes"
    assert command("export", folder, folder / "run.pvd")[0] == 0
    assert command("plot", folder)[0] == 0


def damage(path, others, chance):
    """Flip, cut, swap, empty or overwrite a file; what was done."""
    content = bytearray(path.read_bytes())
    kind = chance.choice(("flip", "flip", "flips", "cut", "swap", "empty", "noise", "text"))
    if kind in ("flip", "flips"):
        for _ in range(1 if kind == "flip" else 20):
            if content:
                content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    elif kind == "cut":
        del content[chance.randrange(len(content) + 1) :]
    elif kind == "swap":
        content = chance.choice(others).read_bytes()
    elif kind == "empty":
        content = b""
    elif kind == "noise":
        content = chance.randbytes(200)
    else:  # another number, a letter: what only a reader of the meaning can see
        digits = [k for k, byte in enumerate(content) if chr(byte).isdigit()]
        if digits:
            content[chance.choice(digits)] = ord(chance.choice("0123456789-e."))
    path.write_bytes(content)
    return kind


def files(folder):
    """Content of all files, by path; not the hidden ones that say who is at work."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.name[0] != "."}


def trial(run, folder, chance):
    """Damage a copy of the run and try a command on it; what was wrong with how it ended, or None."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.rmtree(f"{folder}-2", ignore_errors=True)
    shutil.copytree(run, folder)
    for name in OWN[: chance.choice((2, 2, 4))]:  # beside clips or a series of frames they are in the way
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("mine")
    there = sorted(path for path in files(folder) if path.name != "notes.txt")
    path = chance.choice(there)
    kind, name = damage(path, there, chance), chance.choice(list(COMMANDS))
    before = files(folder)
    status, errors = command(*(part.replace("RUN", str(folder)) for part in COMMANDS[name]))
    what = f"{kind} of {path.relative_to(folder)}, then {name}: {status}\n{errors}"
    lines = errors.splitlines()
    if status not in (0, 1, 2) or not all(line.startswith("warpsph: ") for line in lines):
        return what
    if status == 2 and (len(lines) != 1 or any(files(folder).get(p) != before[p] for p in before)):
        return f"{what}\nrefused, and yet something was changed or more was said than one line"
    if any((folder / own).read_text() != "mine" for own in OWN if folder / own in before):
        return f"{what}\na file of the user's is gone"
    return None


def damaged(folder, count, seed):
    """Make so many trials; returns how many were refused."""
    stopped_run(folder / "run")
    chance, found = random.Random(seed), []
    for _ in range(count):
        found += [wrong] if (wrong := trial(folder / "run", folder / "try", chance)) else []
    return found


def out_of_range(values):
    """The array with an index that leads out of any table."""
    changed = values.copy()
    changed.flat[1] = 10**6
    return changed


def nan(values):
    """The array with a value that is no number."""
    changed = values.copy()
    changed.flat[0] = np.nan
    return changed


if __name__ == "__main__":
    as_a_dot(pytest.MonkeyPatch())
    wrong = damaged(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
    print("\n".join(wrong), file=sys.stderr)
    sys.exit(len(wrong) > 0)
