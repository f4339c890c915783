"""Simulations in several threads and processes: each gives what it gives alone, or is refused in one line."""

import multiprocessing
import os
import threading

import numpy as np
import pytest

from tests.test_restart import slope
from warpsph import Box, Elastic, Fixed, Scene, SceneError, Simulation, edge
from warpsph.device.exclusive import exclusive
from warpsph.simulation.checkpoint import Checkpoint, write_checkpoint


def bar(dim=2):
    return Scene(
        shape=Box((1.0, 0.5, 0.5)[:dim], 0.125),
        material=Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0),
        conditions=[Fixed(edge("left"))],
        velocity=lambda x, *rest: (x, *rest)[:dim] if dim > 1 else x,
        duration=0.05,
    )


def solved(build):
    simulation = Simulation(build(), device="cpu")
    simulation.run()
    return simulation.field("displacement")


def test_threads_take_turns_and_each_gets_what_it_gets_alone():
    """Six at once, three times over, each recorded anew; without turns recordings meet."""
    builds = [bar, slope, lambda: bar(1), lambda: bar(3), slope, bar]
    expected = [solved(build) for build in builds]
    for _ in range(3):
        found = [None] * len(builds)

        def work(k, found=found):
            found[k] = solved(builds[k])

        threads = [threading.Thread(target=work, args=(k,)) for k in range(len(builds))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for one, other in zip(found, expected, strict=True):
            assert one is not None and np.array_equal(one, other)


def in_child(task):
    """What a task returns, or raises, in a forked process; None where it does not end within 20 s."""
    here, there = multiprocessing.Pipe(duplex=False)
    child = os.fork()
    if child == 0:
        try:
            there.send(task())
        except SceneError as error:
            there.send(str(error))
        finally:
            os._exit(0)
    try:
        return here.recv() if here.poll(20.0) else None
    finally:
        os.kill(child, 9)
        os.waitpid(child, 0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_forked_simulation_goes_on_with_one_thread_and_is_refused_with_two():
    one, two = (Simulation(slope(), device="cpu", threads=k) for k in (1, 2))
    for simulation in (one, two):
        simulation.run(until=0.02)

    def further(simulation):
        simulation.run(until=0.1)
        return simulation.field("displacement")

    here = in_child(lambda: further(one))
    assert "a forked process has no threads of its parent's" in in_child(lambda: further(two))
    assert np.array_equal(here, further(one)) and np.array_equal(here, further(two))
    assert np.array_equal(in_child(lambda: solved(bar)), solved(bar)), "a new one there"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_fork_while_another_thread_is_at_work_waits_for_nobody():
    """The thread that had its turn is not in the new process, and would never give it back."""
    begun, end = threading.Event(), threading.Event()

    @exclusive
    def work(begun):
        begun.set()
        end.wait()

    thread = threading.Thread(target=work, args=(begun,))
    thread.start()
    begun.wait()
    try:
        assert in_child(lambda: Simulation(bar(), device="cpu").steps) == 0
    finally:
        end.set()
        thread.join()


def test_run_on_two_threads_goes_on_from_its_checkpoint_in_another_process(tmp_path, monkeypatch):
    """The number of the process is none of the state: with the former one's it would be refused as a fork."""
    path = tmp_path / "checkpoint.npz"
    with monkeypatch.context() as former:
        former.setattr(os, "getpid", lambda: 1)
        simulation = Simulation(slope(), device="cpu", threads=2)
        simulation.run(until=0.02)
        write_checkpoint(simulation, path)
    again = Simulation(slope(), device="cpu", threads=2)
    Checkpoint.read(path).restore(again)
    again.run(until=0.1)
    whole = Simulation(slope(), device="cpu")
    whole.run(until=0.02)
    whole.run(until=0.1)
    assert np.array_equal(again.field("displacement"), whole.field("displacement"))
