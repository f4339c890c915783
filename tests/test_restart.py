"""Checkpoints: a run that goes on from one ends bit for bit where one ends that never stopped."""

import subprocess
import sys

import numpy as np
import pytest
import warp as wp

import warpsph
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
    SceneError,
    Simulation,
    edge,
)
from warpsph.simulation import checkpoint as checkpoint_module
from warpsph.simulation import simulation as simulation_module
from warpsph.simulation.checkpoint import Checkpoint, Checkpoints, Interval, write_checkpoint

SOIL = PerzynaVonMises(
    young_modulus=1e5, poisson_ratio=0.3, density=2000.0, fluidity=5.0, yield_size=200.0, hardening=-500.0
)


def slope(**changed):
    """A soft slope that flows: gravity, damping, flow, large displacements."""
    parts = {
        "shape": Box((1.2, 0.6), 0.1),
        "material": SOIL,
        "conditions": [Roller(edge("left")), Roller(edge("bottom"))],
        "body_force": BodyForce((0.0, -9.81), Ramp(0.5)),
        "damping": 2.0,
        "duration": 1.0,
        "output": Output(interval=0.013, probes=(Probe("toe", "m", NodeValue("displacement", (1.2, 0.0))),)),
    }
    return Scene(**(parts | changed))


def published_slope():
    """The same by sums over neighbours, with RK4 sources and a moving free surface."""
    numerics = Numerics(velocity_scheme="blanc-pastor", source_scheme="rk4")
    return slope(free_surface=FreeSurface(), numerics=numerics)


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


SCENES = {"slope": slope, "published slope": published_slope, "footing": footing, "wheel": wheel}


class StopError(Exception):
    pass


class StoppingAt:
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


# Set anew before each run of steps on the device.
OF_ONE_RUN = {"clock", "_clock", "drive", "_recording", "_recorded"}


def holdings(part, path, seen, found, as_arrays=False):
    """An independent look at all an object holds: arrays and numbers by path, following every attribute."""
    if isinstance(part, wp.array):
        found[path] = part if as_arrays else part.numpy().copy()
    elif isinstance(part, np.ndarray | bool | int | float | str):
        if not as_arrays:
            found[path] = part
    elif isinstance(part, list | tuple):
        for k, inner in enumerate(part):
            holdings(inner, f"{path}[{k}]", seen, found, as_arrays)
    elif isinstance(part, dict):
        for key, inner in part.items():
            holdings(inner, f"{path}[{key}]", seen, found, as_arrays)
    elif id(part) not in seen and not isinstance(part, type) and hasattr(part, "__dict__"):
        seen.add(id(part))
        names = getattr(part, "_cls", part)
        own = names.vars if names is not part else vars(part)
        if names is part and not type(part).__module__.startswith("warpsph"):
            return
        for name in [name for name in own if name not in OF_ONE_RUN]:
            holdings(getattr(part, name), f"{path}.{name}", seen, found, as_arrays)


def assert_same(one, other):
    """Everything the two steppers hold is equal to the last bit, but unused space at the end of a pair list."""
    found = []
    for simulation in (one, other):
        held = {}
        holdings(simulation.stepper, "", set(), held)
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
    if scene.numerics.scheme.sums is not None:
        assert whole.list_builds > 2, "the scene must rebuild its lists on the way"

    simulation, history = started(scene, precision, tmp_path / "b")
    for stop in (whole.steps // 3, whole.steps // 2 + 1):
        checkpoints = Checkpoints(simulation, history, tmp_path / "b" / "checkpoint.npz", Interval(steps=7))
        with pytest.raises(StopError):
            simulation.run(observers=[history, checkpoints, StoppingAt(stop)])
        simulation, history = resumed(_again(name), precision, tmp_path / "b")
        assert stop - 7 < simulation.steps <= stop
    finish(simulation, history)
    assert_same(whole, simulation)
    texts = [(tmp_path / folder / "history.csv").read_bytes() for folder in "ab"]
    assert texts[0] == texts[1] and texts[0].count(b"\n") > 30


def _again(name):
    """The scene built anew, as another process would."""
    return SCENES[name]()


def poison(stepper):
    """Overwrite every array that the independent look finds; tables of indices keep the range they have."""
    found = {}
    holdings(stepper, "", set(), found, as_arrays=True)
    for array in found.values():
        values = array.numpy()
        if values.dtype.kind in "iu" and values.size and values.min() < values.max():
            array.assign(values.min() + values.max() - values)
        else:
            array.assign(np.full(values.nbytes, 0x5A, np.uint8).view(values.dtype).reshape(values.shape))
    return found


@pytest.mark.parametrize("name", SCENES)
def test_no_array_of_the_stepper_is_left_out(name, tmp_path):
    """Every array it holds, wherever, is overwritten, and comes back from the checkpoint."""
    simulation, history = started(SCENES[name](), "float64", tmp_path)
    with pytest.raises(StopError):
        simulation.run(observers=[StoppingAt(20)])
    write_checkpoint(simulation, tmp_path / "checkpoint.npz", history)
    other = Simulation(SCENES[name](), device="cpu")
    assert len(poison(other.stepper)) > 20
    Checkpoint.read(tmp_path / "checkpoint.npz").restore(other)
    assert_same(simulation, other)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A folder with a checkpoint of the slope."""
    folder = tmp_path_factory.mktemp("saved")
    simulation, history = started(slope(), "float64", folder)
    simulation.run(until=0.1)
    write_checkpoint(simulation, folder / "checkpoint.npz", history)
    return folder


def refusal(folder, scene=None, precision="float64"):
    """The one line with which a checkpoint is refused."""
    with pytest.raises(SceneError) as caught:
        resumed(slope() if scene is None else scene, precision, folder)
    message = str(caught.value)
    assert message.startswith(f"checkpoint = '{folder / 'checkpoint.npz'}") and "\n" not in message
    return message


@pytest.mark.parametrize(
    "changed",
    [
        {"shape": Box((1.2, 0.6), 0.15)},
        {"shape": Box((1.2, 0.6), 0.1).mapped(lambda x, y: (1.001 * x, y))},
        {"material": PerzynaVonMises(**{**vars(SOIL), "hardening": -500.1})},
        {"conditions": [Roller(edge("left")), Fixed(edge("bottom"))]},
        {"body_force": BodyForce((0.0, -9.81), Ramp(0.51))},
        {"body_force": BodyForce((0.0, -9.81), lambda t: min(t, 0.5))},
        {"velocity": lambda x, y: (1e-9, 0.0)},
        {"stress": lambda x, y: (0.0, 0.0, 0.0, 1e-9)},
        {"damping": 2.1},
        {"duration": 1.1},
        {"free_surface": FreeSurface(), "numerics": Numerics(velocity_scheme="taylor")},
        {"numerics": Numerics(velocity_scheme="taylor", kernel="wendland_c2")},
        {"numerics": Numerics(time_step=1e-4)},
        {"output": Output(interval=0.013)},
        {"output": Output(interval=0.014, probes=slope().output.probes)},
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_checkpoint_of_another_scene_is_refused(saved, changed):
    assert "it is of another scene" in refusal(saved, slope(**changed))


def test_scene_written_otherwise_is_the_same(saved):
    """Names, the pictures' field and the form of a function of time do not count."""
    force = BodyForce((0.0, -9.81), lambda t: min(max(t / 0.5, 0.0), 1.0))
    assert resumed(slope(name="other", body_force=force), "float64", saved)[0].time == 0.1


def test_checkpoint_of_another_precision_or_version_is_refused(saved, monkeypatch):
    assert "it is in float64, the run in float32" in refusal(saved, precision="float32")
    monkeypatch.setattr(checkpoint_module, "__version__", "9.9.9")
    assert f"it is of warpsph {warpsph.__version__}, this is 9.9.9" in refusal(saved)


def test_missing_checkpoint_is_refused(tmp_path):
    assert "there is no checkpoint (No such file" in refusal(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.9, 0.9999])
def test_truncated_checkpoint_is_refused(saved, share, tmp_path):
    whole = (saved / "checkpoint.npz").read_bytes()
    (tmp_path / "checkpoint.npz").write_bytes(whole[: int(share * len(whole))])
    assert "it is damaged or no checkpoint" in refusal(tmp_path)


def test_damaged_checkpoint_is_refused_or_gives_the_same(saved, tmp_path):
    """One byte changed anywhere: in the data its checksum tells; elsewhere it may not matter."""
    whole, chance, told = (saved / "checkpoint.npz").read_bytes(), np.random.default_rng(1), 0
    right = Checkpoint.read(saved / "checkpoint.npz")
    for place in chance.integers(len(whole), size=200):
        damaged = bytearray(whole)
        damaged[place] ^= 0x55
        (tmp_path / "checkpoint.npz").write_bytes(damaged)
        try:
            found = Checkpoint.read(tmp_path / "checkpoint.npz")
        except SceneError as error:
            told += "it is damaged" in str(error) or "it is of" in str(error)
            continue
        assert found.header == right.header and found.arrays.keys() == right.arrays.keys()
        assert all(found.arrays[name].tobytes() == right.arrays[name].tobytes() for name in right.arrays)
    assert told > 100


def test_run_that_an_exception_ended_goes_on_in_its_steps():
    """Without any checkpoint: the same simulation, run again."""
    whole, simulation = Simulation(footing(), device="cpu"), Simulation(footing(), device="cpu")
    whole.run()
    with pytest.raises(StopError):
        simulation.run(observers=[StoppingAt(10)])
    simulation.run()
    assert_same(whole, simulation)


@pytest.mark.parametrize(
    ("interval", "steps"),
    [
        (Interval(steps=30), [30, 60, 90]),
        (Interval(time=0.03), [30, 60, 90]),
        (Interval(seconds=0.0), range(1, 101)),
    ],
    ids=["steps", "time", "wall time"],
)
def test_checkpoints_come_at_their_interval(interval, steps, tmp_path, monkeypatch):
    """100 steps of 1 ms; the wall time is looked at whenever the device has made a run of steps, here of one."""
    monkeypatch.setattr(simulation_module, "AHEAD_ON_CPU", 0)
    scene = slope(duration=0.1, numerics=Numerics(time_step=1e-3))
    simulation, history = started(scene, "float64", tmp_path)
    found = []
    monkeypatch.setattr(checkpoint_module, "write_checkpoint", lambda s, *rest: found.append(s.steps))
    simulation.run(observers=[Checkpoints(simulation, history, tmp_path / "c.npz", interval)])
    assert found == list(steps)


@pytest.mark.parametrize("kills", [8, pytest.param(50, marks=pytest.mark.long)])
def test_run_that_is_killed_again_and_again_still_ends_where_it_should(kills, tmp_path):
    """By SIGKILL at random moments: a whole checkpoint or none, whole rows, the same end to the last bit."""
    command = [sys.executable, "-m", "tests.killing", str(tmp_path), str(kills)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) >= kills // 5, "it went on from that many different checkpoints"
