"""Checkpoints: a run that goes on from one ends bit for bit where one ends that never stopped."""

import numpy as np
import pytest
import warp as wp

from warpsph import (
    BodyForce,
    Box,
    EdgeForce,
    Elastic,
    Fixed,
    Free,
    FreeSurface,
    History,
    Linear,
    NodeValue,
    Numerics,
    Output,
    PerzynaVonMises,
    PrescribedVelocity,
    Probe,
    Ramp,
    Roller,
    Rotating,
    Scene,
    Simulation,
    edge,
)
from warpsph.simulation.checkpoint import Checkpoint, Checkpoints, Interval

SOIL = PerzynaVonMises(
    young_modulus=1e5, poisson_ratio=0.3, density=2000.0, fluidity=5.0, yield_size=200.0, hardening=-500.0
)


def slope(**changed):
    """A soft slope that flows: free surface, gravity, damping, flow, large displacements."""
    parts = {
        "shape": Box((1.2, 0.6), 0.1),
        "material": SOIL,
        "conditions": [Roller(edge("left")), Roller(edge("bottom"))],
        "free_surface": FreeSurface(),
        "body_force": BodyForce((0.0, -9.81), Ramp(0.5)),
        "damping": 2.0,
        "duration": 1.0,
        "output": Output(interval=0.013, probes=(Probe("toe", "m", NodeValue("displacement", (1.2, 0.0))),)),
    }
    return Scene(**(parts | changed))


def footing():
    """Prescribed velocity that grows, analytic sources, fixed normals of free edges."""
    top = edge("top")
    return Scene(
        shape=Box((0.8, 0.4), 0.1),
        material=SOIL,
        conditions=[Fixed(edge("bottom")), PrescribedVelocity(top, (None, Linear(-0.4))), Free(edge("right"))],
        duration=0.6,
        numerics=Numerics(source_scheme="analytic", velocity_scheme="taylor", courant=0.5),
        output=Output(interval=0.0, probes=(Probe("load", "N", EdgeForce(top, axis=1)),)),
    )


def wheel():
    """A turning block in 3D, elastic."""
    return Scene(
        shape=Box((0.4, 0.4, 0.2), 0.1),
        material=Elastic(young_modulus=1e6, poisson_ratio=0.3, density=2000.0),
        conditions=[Rotating(edge("boundary"), 20.0, (0.2, 0.2))],
        velocity=lambda x, y, z: (-20.0 * (y - 0.2), 20.0 * (x - 0.2), 0.0),
        duration=0.1,
        output=Output(probes=(Probe("s", "Pa", NodeValue("stress", (0.2, 0.2, 0.1))),)),
    )


SCENES = {"slope": slope, "footing": footing, "wheel": wheel}


class StopError(Exception):
    pass


class Stopping:
    """Ends a run after some steps, as a signal would."""

    def __init__(self, steps):
        self.steps = steps

    def observe(self, simulation):
        if simulation.steps == self.steps:
            raise StopError


def started(scene, precision, folder):
    simulation = Simulation(scene, device="cpu", precision=precision)
    return simulation, History(simulation, folder / "history.csv")


def resumed(scene, precision, folder):
    checkpoint = Checkpoint.read(folder / "checkpoint.npz")
    simulation = Simulation(scene, device="cpu", precision=precision)
    checkpoint.restore(simulation)
    return simulation, History(simulation, folder / "history.csv", checkpoint.history)


def finish(simulation, history):
    simulation.run(observers=[history])
    history.sample(simulation)
    history.close()


def holdings(part, path, seen, found):
    """An independent look at all an object holds: arrays and numbers by path, following every attribute."""
    if isinstance(part, wp.array):
        found[path] = part.numpy().copy()
    elif isinstance(part, np.ndarray | bool | int | float | str):
        found[path] = part
    elif isinstance(part, list | tuple):
        for k, inner in enumerate(part):
            holdings(inner, f"{path}[{k}]", seen, found)
    elif isinstance(part, dict):
        for key, inner in part.items():
            holdings(inner, f"{path}[{key}]", seen, found)
    elif id(part) not in seen and not isinstance(part, type) and hasattr(part, "__dict__"):
        seen.add(id(part))
        names = getattr(part, "_cls", part)
        own = names.vars if names is not part else vars(part)
        if names is part and not type(part).__module__.startswith("warpsph"):
            return
        for name in own:
            holdings(getattr(part, name), f"{path}.{name}", seen, found)


def assert_same(one, other):
    """Everything the two steppers hold is equal to the last bit, but unused space at the end of a pair list."""
    found = []
    for simulation in (one, other):
        held = {}
        holdings(simulation._stepper, "", set(), held)
        found.append(held)
    first, second = found
    assert first.keys() == second.keys() and len(first) > 30
    for path, value in first.items():
        if path.endswith("pairs.index"):
            used = first[path.replace("index", "start")][-1]
            value, second[path] = value[:used], second[path][:used]
        if isinstance(value, np.ndarray):
            assert value.tobytes() == second[path].tobytes(), path
        else:
            assert value == second[path], path
    for name in ("time", "steps", "shortest_step", "longest_step", "list_builds"):
        assert getattr(one, name) == getattr(other, name), name


@pytest.mark.parametrize("name", SCENES)
def test_resumed_run_is_the_uninterrupted_one_bit_for_bit(name, precision, tmp_path):
    """Stopped and resumed twice, at steps that are no sampling times and between two builds of the pair lists."""
    scene = SCENES[name]()
    (tmp_path / "a").mkdir(), (tmp_path / "b").mkdir()
    whole, history = started(scene, precision, tmp_path / "a")
    finish(whole, history)
    assert whole.list_builds > 2, "the scene must rebuild its lists on the way"

    simulation, history = started(scene, precision, tmp_path / "b")
    for stop in (whole.steps // 3, whole.steps // 2 + 1):
        checkpoints = Checkpoints(simulation, history, tmp_path / "b" / "checkpoint.npz", Interval(steps=7))
        with pytest.raises(StopError):
            simulation.run(observers=[history, checkpoints, Stopping(stop)])
        simulation, history = resumed(_again(name), precision, tmp_path / "b")
        assert stop - 7 < simulation.steps <= stop
    finish(simulation, history)
    assert_same(whole, simulation)
    texts = [(tmp_path / folder / "history.csv").read_bytes() for folder in "ab"]
    assert texts[0] == texts[1] and texts[0].count(b"\n") > 30


def _again(name):
    """The scene built anew, as another process would."""
    return SCENES[name]()
