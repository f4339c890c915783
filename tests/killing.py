"""Kills a run again and again; `tests/test_restart.py` starts this in a process of its own: it forks."""

import os
import random
import signal
import sys
import time
from pathlib import Path

import numpy as np

from tests.test_restart import finish, resumed, slope, started
from warpsph.simulation.checkpoint import CHECKPOINT, Checkpoint, Checkpoints, Interval
from warpsph.storage.files import write_whole

FOREVER = None


def run_to_the_end(folder):
    """Go on from the checkpoint if there is one, with a new one every three steps; leave the final state."""
    begin = resumed if (folder / CHECKPOINT).exists() else started
    simulation, history = begin(slope(), "float64", folder)
    checkpoints = Checkpoints(simulation, history, folder / CHECKPOINT, Interval(steps=3))
    simulation.run(observers=[history, checkpoints])
    finish(simulation, history)
    write_whole(folder / "final.npz", lambda file: np.savez(file, **simulation.state()[0]))


def killed(folder, life):
    """Whether a process that runs the scene was still running when it was killed after its life [s]."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            run_to_the_end(folder)
            status = 0
        finally:
            os._exit(status)
    if life is not FOREVER:
        time.sleep(life)
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, "the run failed"
    return os.WIFSIGNALED(status)


def main(folder, most):
    """Kill it so often. Returns the number of checkpoints that were gone on from."""
    whole, broken = folder / "whole", folder / "broken"
    whole.mkdir(), broken.mkdir()
    run_to_the_end(whole)
    expected = (whole / "history.csv").read_bytes()
    begin = time.perf_counter()
    killed(broken, FOREVER)
    longest_life = 0.5 * (time.perf_counter() - begin)  # half a run, on this machine as busy as it is now
    chance, kills, steps = random.Random(1), 0, set()
    while kills < most:
        kills += killed(broken, chance.uniform(0.0, longest_life))
        if (broken / "final.npz").exists():  # it was faster: from the start again
            check_final(whole, broken)
            for path in broken.iterdir():
                path.unlink()
        if (broken / CHECKPOINT).exists():
            steps.add(Checkpoint.read(broken / CHECKPOINT).header["values"]["steps"])
        if (broken / "history.csv").exists():
            written = (broken / "history.csv").read_bytes()
            assert expected.startswith(written) and (not written or written.endswith(b"\n"))
    run_to_the_end(broken)
    assert (broken / "history.csv").read_bytes() == expected
    check_final(whole, broken)
    return len(steps)


def check_final(whole, broken):
    with np.load(whole / "final.npz") as one, np.load(broken / "final.npz") as other:
        for name in ("body.nodes.point", "body.nodes.acceleration", "body.internals", "body.nodes.displacement"):
            assert one[name].tobytes() == other[name].tobytes(), name


if __name__ == "__main__":
    print(main(Path(sys.argv[1]), int(sys.argv[2])))
