"""Threads and recordings: they change the speed and nothing else."""

import os
import signal
import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

from warpsph import (
    BodyForce,
    Box,
    Fixed,
    FreeSurface,
    Numerics,
    PerzynaVonMises,
    PrescribedVelocity,
    Pressure,
    Scene,
    SceneError,
    Simulation,
    edge,
)
from warpsph.device import launching
from warpsph.device.launching import Launcher
from warpsph.simulation import simulation as simulation_module
from warpsph.simulation.device import all_cores, choose_threads, start_warp

CLAY = PerzynaVonMises(young_modulus=1e6, poisson_ratio=0.3, density=1000.0, fluidity=10.0, yield_size=2e3)


def pressed(dim=2, **options):
    """A block that is pressed ever faster at its top, yields and bulges; lists and free surface are renewed."""
    numerics = options.pop("numerics", Numerics())
    return Scene(
        shape=Box((1.0,) * dim, 0.05 if dim == 2 else 0.2),
        material=CLAY,
        conditions=[
            Fixed(edge("bottom")),
            PrescribedVelocity(edge("top"), (None,) * (dim - 1) + (lambda t: -3.0 * np.sin(20.0 * t),)),
        ],
        body_force=BodyForce((0.0,) * (dim - 1) + (-9.81,), lambda t: 1.0 + t),
        duration=0.1,
        numerics=numerics,
        **options,
    )


def unloaded():
    """The same, and a pressure on its right that drops to nothing at once."""
    scene = pressed()
    drop = Pressure(edge("right"), 1e3, lambda t: float(t < 0.05))
    return replace(scene, conditions=[*scene.conditions, drop])


SCENES = {
    "default": pressed,
    "drop of load": unloaded,
    "solid": lambda: pressed(3),
    "published, free surface": lambda: pressed(
        numerics=Numerics(velocity_scheme="blanc-pastor"), free_surface=FreeSurface()
    ),
    "RK4, small displacements": lambda: pressed(
        large_displacements=False, numerics=Numerics(velocity_scheme="taylor", source_scheme="rk4")
    ),
}
STATE = ("position", "velocity", "stress", "equivalent_plastic_strain", "density")


def state_after(simulation, observers=()):
    """All fields at the end, the number of steps and of list builds."""
    simulation.run(observers=observers)
    fields = np.hstack([simulation.field(name).reshape(len(simulation.mesh.nodes), -1) for name in STATE])
    return fields.tobytes(), simulation.steps, simulation.list_builds


class Everywhere:
    """An observer that looks after every step."""

    def __init__(self):
        self.steps = []

    def observe(self, simulation):
        self.steps.append(simulation.steps)


class Late:
    """An observer that waits for a time."""

    next_time = 0.0471

    def __init__(self):
        self.times, self.steps = [], []

    def observe(self, simulation):
        self.times.append(simulation.time)
        self.steps.append(simulation.steps)


@pytest.mark.parametrize("name", SCENES)
def test_threads_do_not_change_a_bit(name, precision):
    one = state_after(Simulation(SCENES[name](), device="cpu", precision=precision, threads=1))
    if "free surface" in name:
        assert one[2] > 1, "lists are to be rebuilt on the way"
    for threads in (2, 3):
        simulation = Simulation(SCENES[name](), device="cpu", precision=precision, threads=threads)
        assert simulation.threads == threads
        assert state_after(simulation) == one


@pytest.mark.parametrize("name", SCENES)
def test_steps_made_without_the_host_are_those_made_one_by_one(name):
    together = Simulation(SCENES[name](), device="cpu", threads=1)
    single, watch = Simulation(SCENES[name](), device="cpu", threads=1), Everywhere()
    assert state_after(together) == state_after(single, [watch])
    assert watch.steps == list(range(1, single.steps + 1))


def test_a_driver_without_loops_makes_the_same_steps(monkeypatch):
    expected = state_after(Simulation(pressed(), device="cpu", threads=1))
    monkeypatch.setattr(launching, "_loops_itself", lambda device: False)
    assert state_after(Simulation(pressed(), device="cpu", threads=1)) == expected


@pytest.mark.parametrize("name", ["drop of load", "published, free surface"])
def test_one_recording_serves_every_time_step(name, device):
    """Δt is on the device: steps of other lengths are replayed, as are those after lists were built in place."""
    replayed, made_one_by_one = (Simulation(SCENES[name](), device, threads=1) for _ in range(2))
    made_one_by_one.stepper._record = lambda: SimpleNamespace(run=made_one_by_one.stepper.step)
    recordings = []
    for simulation in (replayed, made_one_by_one):
        for share in (1.0, 1.0, 0.3, 0.7):
            simulation.step(share * simulation.time_step_limit)
            recordings.append(replayed.stepper._recording)
        if lists := getattr(simulation.stepper, "lists", None):
            lists.refresh()
        while simulation.time < 0.06:
            simulation.step()
        recordings.append(replayed.stepper._recording)
    assert all(recording is recordings[0] for recording in recordings)
    for field in STATE:
        assert np.array_equal(replayed.field(field), made_one_by_one.field(field)), field


def test_an_observer_is_told_after_the_first_step_at_its_time():
    watch = Late()
    simulation = Simulation(pressed(), device="cpu")
    simulation.run(observers=[watch])
    before = sum(time < watch.next_time for time in watch.times)
    assert watch.steps[before:] == list(range(watch.steps[before], simulation.steps + 1))
    assert watch.times[before] < watch.next_time + simulation.longest_step
    assert before < 0.5 * watch.steps[before], "before, steps are made many at a time"


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupt_waits_for_the_steps_that_run(threads):
    """Ctrl-C in a program of one's own, at many moments: nothing is lost, and the run can go on."""
    expected = state_after(Simulation(pressed(), device="cpu", threads=1))
    simulation, interrupts, stop = Simulation(pressed(), device="cpu", threads=threads), 0, threading.Event()

    def annoy():
        while not stop.wait(0.002):
            os.kill(os.getpid(), signal.SIGINT)

    finished, annoyance = None, threading.Thread(target=annoy)
    annoyance.start()
    try:
        while finished is None:
            try:
                simulation.run()
                stop.set()
                annoyance.join()
                finished = state_after(simulation)
            except KeyboardInterrupt:
                interrupts += 1
    finally:
        stop.set()
    assert finished == expected and interrupts > 0


def test_large_bodies_look_up_often(monkeypatch):
    """A signal waits for no more than `AHEAD_ON_CPU` node-steps."""
    simulation, made = Simulation(pressed(), device="cpu"), []
    monkeypatch.setattr(simulation_module, "AHEAD_ON_CPU", 5 * len(simulation.mesh.nodes))
    advance = simulation.stepper.advance
    monkeypatch.setattr(simulation.stepper, "advance", lambda *given: made.append(advance(*given)) or made[-1])
    simulation.run()
    assert max(made)[0] == 5 and sum(outcome.made for outcome in made) == simulation.steps


def test_a_thread_that_fails_ends_the_others_and_is_heard():
    """The one at the barrier must not wait for ever."""
    start_warp()
    launcher = Launcher(wp.get_device("cpu"), 2)
    going = wp.ones(1, dtype=wp.int32, device="cpu")
    recording = launching._Lockstep(launcher, [[]], going)
    recording._graphs = [[None], [object()]]  # no graph at all
    done = []
    for _ in range(2):
        worker = threading.Thread(target=lambda: done.append(raised(recording.run)))
        worker.start()
        worker.join(timeout=30.0)
    assert len(done) == 2 and all(isinstance(error, AttributeError) for error in done)


def raised(function):
    try:
        function()
    except Exception as error:
        return error
    return None


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2"])
def test_number_of_threads_is_checked(threads):
    with pytest.raises(SceneError, match=r"threads = .*whole number, at least 1"):
        Simulation(pressed(), device="cpu", threads=threads)


def test_threads_follow_the_size_and_the_environment(monkeypatch):
    monkeypatch.delenv("WARPSPH_THREADS", raising=False)
    assert choose_threads(None, 100) == 1
    assert choose_threads(None, 10_000_000) == all_cores()
    monkeypatch.setenv("WARPSPH_THREADS", "7")
    assert (choose_threads(None, 10_000_000), choose_threads(None, 6000)) == (7, 6)
    assert choose_threads(2, 10_000_000) == 2
    for wrong in ("0", "many", "-1", ""):
        monkeypatch.setenv("WARPSPH_THREADS", wrong)
        with pytest.raises(SceneError, match=r"WARPSPH_THREADS = .*at least 1"):
            choose_threads(None, 100)
