"""Numbers that can not be, in the midst of a run or in a checkpoint: an error, whatever is found by them."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest

from tests.test_restart import slope
from warpsph import SceneError, Simulation
from warpsph.scene.registry import SCHEMES
from warpsph.simulation.checkpoint import Checkpoint, seal, write_checkpoint
from warpsph.simulation.state import COUNTS

FAR_TOO_FAST = """
from warpsph import *
from warpsph.scene.registry import SCHEMES

common = dict(material=Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0), duration=1.0)
for shape in (Box((1.0, 0.5), 0.25), Box((0.5, 0.5, 0.5), 0.25)):
    for scheme in SCHEMES:
        numerics, speed = Numerics(velocity_scheme=scheme), lambda x, *rest: (1e30 * x, *(0.0 * x for _ in rest))
        surface = FreeSurface() if SCHEMES[scheme].sums else None
        scene = Scene(shape=shape, velocity=speed, free_surface=surface, numerics=numerics, **common)
        try:
            Simulation(scene, device="cpu", precision="float32").run()
        except BreakdownError:
            print(scheme)
"""


def test_a_moving_surface_bears_numbers_that_are_none():
    """In a process of its own, which a segmentation fault would end: NaN was an index where stress is released."""
    done = subprocess.run([sys.executable, "-c", FAR_TOO_FAST], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stdout.splitlines() if line in SCHEMES] == [*SCHEMES, *SCHEMES]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The header of a checkpoint, its arrays, and the simulation that goes on from it."""
    path = tmp_path_factory.mktemp("written") / "checkpoint.npz"
    simulation = Simulation(slope(), device="cpu")
    simulation.run(until=0.02)
    write_checkpoint(simulation, path)
    with np.load(path) as archive:
        arrays = dict(archive)
    return json.loads(arrays.pop("header").tobytes()), arrays, simulation


def forged(path, header, arrays, sealed):
    """Write a checkpoint; sealed anew as only somebody does who means it, or damaged."""
    content = seal(header, arrays) if sealed else header["content"]
    text = json.dumps(header | {"content": content}).encode()
    np.savez(path, header=np.frombuffer(text, dtype=np.uint8), **arrays)
    return Checkpoint.read(path)


@pytest.mark.parametrize("wrong", [1, "1", None, True, float("nan"), float("inf"), -(10**20), 10**20, 0.5])
def test_forged_numbers_of_a_checkpoint_are_refused(wrong, written, tmp_path):
    """Lengths of arrays are as they are, all others finite and of their type; then nothing is restored."""
    header, arrays, simulation = written
    for name, right in header["values"]["stepper"].items():
        fits = type(wrong) is type(right) and math.isfinite(wrong)
        if fits and (isinstance(right, float | bool) or name.endswith(COUNTS) or wrong == right):
            continue
        values = header["values"] | {"stepper": header["values"]["stepper"] | {name: wrong}}
        checkpoint = forged(tmp_path / "c.npz", header | {"values": values}, arrays, sealed=True)
        with pytest.raises(SceneError, match=f"it holds another state .{name} is"):
            checkpoint.restore(simulation)


@pytest.mark.parametrize("name", ["time", "steps", "wall_time", "shortest_step"])
def test_damaged_header_of_a_checkpoint_is_seen(name, written, tmp_path):
    """As its arrays are: one digest is over both."""
    header, arrays, _ = written
    values = header["values"] | {name: header["values"][name] + 1}
    with pytest.raises(SceneError, match="it is not what was written"):
        forged(tmp_path / "c.npz", header | {"values": values}, arrays, sealed=False)
