"""Memory does not grow with the number of steps; a sample of the history takes its numbers and no more."""

import os
import subprocess
import sys

import numpy as np
import pytest

from warpsph.simulation.history import read_history
from warpsph.state.energy import COLUMNS

# Its probe is the resident memory of the process [MB].
SCENE = '''"""Plate that swings for {steps} steps."""
from warpsph import *

NUMERICS = {{"time_step": 1e-4, "velocity_scheme": "{scheme}"}}

def memory(s):
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6

def scene(p):
    return Scene(
        shape=Box((1.0, 0.5), 0.25),
        material=Elastic(young_modulus=1e5, poisson_ratio=0.3, density=1000.0),
        conditions=[Fixed(edge("left"))],
        velocity=lambda x, y: (1e-3 * x, 0.0 * x),
        free_surface=FreeSurface() if p.numerics.scheme.sums else None,
        duration={steps} * 1e-4,
        numerics=p.numerics,
        output=Output(interval={interval}, probes=(Probe("memory", "MB", memory),)),
    )
'''


def memory_of(folder, steps, interval, scheme="cells"):
    """Memory of a run that keeps frames and writes checkpoints [MB], at each sample."""
    (folder / "plate.py").write_text(SCENE.format(steps=steps, interval=interval, scheme=scheme))
    options = ("--checkpoint-every", str(steps // 20), "--device", "cpu", "--quiet", "--out", folder / "out")
    command = [sys.executable, "-m", "warpsph", "run", folder / "plate.py", *options]
    subprocess.run(command, check=True, timeout=3000, env=os.environ | {"MALLOC_ARENA_MAX": "2"})
    columns, _ = read_history(folder / "out" / "history.csv")
    assert columns["step"][-1] >= steps  # more where the time step follows what is stretched
    return columns["memory"]


@pytest.mark.skipif(sys.platform != "linux", reason="it reads /proc")
@pytest.mark.parametrize(
    ("steps", "scheme"),
    [
        (10_000, "cells"),
        (10_000, "taylor"),
        *(pytest.param(10**6, s, marks=pytest.mark.long) for s in ("cells", "taylor")),
    ],
)
def test_memory_does_not_grow_with_the_number_of_steps(steps, scheme, tmp_path):
    """From a tenth of the run on: 1 MB is what allocators play with, one byte a step in 10⁶."""
    found = memory_of(tmp_path, steps, interval=steps * 1e-4 / 100, scheme=scheme)
    assert len(found) == 101 and found[10:].max() - found[10] < 1.0, found


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="it reads /proc")
def test_a_sample_takes_its_numbers_and_no_more(tmp_path):
    """Eight bytes a number, and as much again while their list grows or a checkpoint is written."""
    found = memory_of(tmp_path, 100_000, interval=0.0)
    per_row = 1e6 * np.diff(found[10_000:]).sum() / 90_000
    numbers = len(("step", "time", "memory", *COLUMNS))
    assert len(found) == 100_001 and per_row < 2 * 8 * numbers, per_row
