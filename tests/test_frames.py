"""The frame store: what it keeps, when, and what is left of it after a run dies or goes on."""

import io
import json
import shutil
import warnings
import zipfile

import numpy as np
import pytest

from tests.damaging import nan, out_of_range
from warpsph import (
    Box,
    Elastic,
    Fixed,
    Free,
    NodeValue,
    Numerics,
    Output,
    PrescribedVelocity,
    Probe,
    Pulse,
    Roller,
    Scene,
    SceneError,
    Simulation,
    edge,
    where,
)
from warpsph.analysis import green_strain
from warpsph.cli.main import main
from warpsph.errors import DamagedError
from warpsph.export import frames as frames_module
from warpsph.export.quantity import quantity
from warpsph.export.walls import WallMesh, walls_of
from warpsph.frames import Frames, FrameWriter, evenly
from warpsph.simulation.history import read_history
from warpsph.storage.reading import read_arrays

pytestmark = pytest.mark.usefixtures("undrawn")


def block(**changes):
    """A block 0.4 m by 0.2 m, pressed from above; Δt = 0.23 ms."""
    arguments = {
        "shape": Box((0.4, 0.2), 0.05),
        "material": Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0),
        "conditions": [
            Fixed(edge("bottom")),
            Roller(edge("left")),
            PrescribedVelocity(edge("top") & where(lambda x, y: x < 0.21), (None, Pulse(-1.0, 1e-3))),
            Free(edge("right")),
        ],
        "duration": 4e-3,
        "output": Output(probes=(Probe("u", "m", NodeValue("displacement", (0.0, 0.2), 1)),)),
    }
    return Scene(**(arguments | changes))


class Taken:
    """An observer that remembers fields of every step."""

    def __init__(self, simulation, names):
        self.names, self.steps = names, []
        self.observe(simulation)

    def observe(self, simulation):
        self.steps.append((simulation.time, {name: simulation.field(name) for name in self.names}))


def test_frames_are_the_first_steps_at_or_after_their_times(tmp_path, precision):
    simulation = Simulation(block(), device="cpu", precision=precision)
    times = (0.0, 1e-3, 2.2e-3, 4e-3)
    names = (
        "position",
        "displacement",
        "velocity",
        "stress",
        "strain",
        "von_mises_stress",
        "mean_stress",
        "density",
    )
    writer, taken = FrameWriter(simulation, times, tmp_path), Taken(simulation, names)
    simulation.run(observers=[taken, writer])
    frames = Frames(tmp_path)
    assert len(frames) == 4 and frames.times == times
    for asked, frame in zip(times, frames, strict=True):
        step, (time, fields) = next((k, s) for k, s in enumerate(taken.steps) if s[0] >= asked * (1 - 1e-9))
        assert (frame.time, frame.step) == (time, step)
        for name in names:
            scale = np.abs(fields[name]).max() or 1.0
            np.testing.assert_allclose(frame.field(name), fields[name], atol=4e-7 * scale, err_msg=name)
    for name in ("nodes", "cells", "faces", "face_cell", "face_side", "spacing"):
        np.testing.assert_array_equal(getattr(frames.mesh, name), getattr(simulation.mesh, name))
    assert frames.nearest(2.4e-3).number == 2
    with pytest.raises(SceneError, match=r"time = 1.0 is not allowed: the frames are from 0 to 0.004 s"):
        frames.nearest(1.0)
    with pytest.raises(SceneError, match=r"field = 'densty' .*did you mean density"):
        frame.field("densty")


@pytest.mark.parametrize("size", [(1.0,), (1.0, 0.5), (1.0, 0.5, 0.5)])
def test_strain_of_a_uniform_deformation_is_exact(size):
    """u = A X: E = (A + Aᵀ + AᵀA)/2 at every node, large as it is; a rotation strains nothing."""
    mesh = Box(size, 0.25).mesh()
    dim, rng = mesh.dim, np.random.default_rng(1)
    for A in (0.3 * rng.standard_normal((dim, dim)), _turn(dim) - np.eye(dim)):
        E = 0.5 * (A + A.T + A.T @ A)
        expected = [E[i, j] if max(i, j) < dim else 0.0 for i, j in mesh.continuum.pairs]
        strain = green_strain(mesh, mesh.nodes @ A.T)
        np.testing.assert_allclose(strain, np.tile(expected, (len(mesh.nodes), 1)), atol=1e-14)


def _turn(dim):
    turn = np.eye(dim)
    if dim > 1:
        turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    return turn


def test_a_new_run_removes_the_frames_of_the_former(tmp_path):
    for count in (8, 2, 0):
        arguments = ["run", "elastic_bar", "--until", "1e-3", "--quiet", "--device", "cpu", "--overwrite"]
        assert main([*arguments, "--frames", str(count), "--out", str(tmp_path)]) == 0
        assert len(list((tmp_path / "frames").glob("0*.npz"))) == (count + 1 if count else 0)
    with pytest.raises(SceneError, match="kept frames"):
        Frames(tmp_path)


def test_a_run_that_goes_on_keeps_its_earlier_frames(tmp_path):
    """Two halves give what one run gives; a frame from beyond the restart is taken anew."""
    whole = Simulation(block(), device="cpu")
    whole.run(observers=[FrameWriter(whole, evenly(4e-3, 8), tmp_path / "whole")])
    simulation = Simulation(block(), device="cpu")
    simulation.run(until=2e-3, observers=[FrameWriter(simulation, evenly(4e-3, 8), tmp_path / "parts")])
    beyond = tmp_path / "parts" / "frames" / "000005.npz"
    with np.load(tmp_path / "parts" / "frames" / "000004.npz") as frame:
        np.savez(beyond, **dict(frame) | {"time": 2.4e-3})
    (tmp_path / "parts" / "frames" / ".000006.999999999-0.part.npz").write_bytes(b"torn")
    writer = FrameWriter(simulation, evenly(4e-3, 8), tmp_path / "parts")
    assert not beyond.exists()
    simulation.run(observers=[writer])
    one, other = Frames(tmp_path / "whole"), Frames(tmp_path / "parts")
    assert one.numbers == other.numbers == list(range(9)) and one.codes == other.codes
    assert list((tmp_path / "parts" / "frames").glob(".*")) == []
    for a, b in zip(one, other, strict=True):
        assert a.time == pytest.approx(b.time, abs=whole.time_step_limit)


def test_a_torn_frame_is_refused_in_one_line(tmp_path):
    simulation = Simulation(block(), device="cpu")
    FrameWriter(simulation, (0.0,), tmp_path)
    path = tmp_path / "frames" / "000000.npz"
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(SceneError, match=r"frame = .*000000.npz' .* can not be read"):
        Frames(tmp_path)[0]


def test_a_full_disk_costs_the_frames_and_not_the_run(tmp_path, monkeypatch, capsys):
    written, savez = [], np.savez

    def full(file, **arrays):
        written.append(file)
        if len(written) > 3:
            raise OSError(28, "No space left on device")
        savez(file, **arrays)

    monkeypatch.setattr(frames_module.np, "savez", full)
    assert main(["run", "perzyna_bar", "--quiet", "--device", "cpu", "--out", str(tmp_path)]) == 0
    error = capsys.readouterr().err
    assert (
        error.count("\n") == 1
        and "no further frames are kept, the run goes on" in error
        and "No space left" in error
    )
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["checks"][0]["passed"]
    assert Frames(tmp_path).numbers == [0, 1]


def test_walls_are_the_faces_that_conditions_hold_or_move(tmp_path):
    scene = block()
    mesh, walls = scene.mesh, {wall.name: wall for wall in walls_of(scene)}
    assert list(walls) == ["fixed_bottom", "roller_left", "moving_top"]
    assert [wall.still for wall in walls.values()] == [True, False, False]
    assert [len(wall.faces) for wall in walls.values()] == [8, 4, 4]
    top = mesh.nodes[np.unique(mesh.faces[walls["moving_top"].faces])]
    assert (top[:, 1] == 0.2).all() and top[:, 0].max() == pytest.approx(0.2)


@pytest.mark.parametrize("size", [(0.4,), (0.4, 0.2), (0.4, 0.2, 0.2)])
def test_a_wall_stands_a_radius_outside_its_nodes_and_follows_them(size):
    scene = block(
        shape=Box(size, 0.05),
        conditions=[Fixed(edge("right"))],
        output=Output(field="displacement"),
        duration=1e-3,
    )
    mesh, (wall,) = scene.mesh, walls_of(scene)
    built = WallMesh.of(mesh, wall)
    points = built.points(mesh.nodes)
    assert points[:, 0].min() == pytest.approx(0.4 + 0.025)
    assert built.polygons.shape[1] == 4 and set(built.polygons.ravel()) == set(range(len(points)))
    moved = built.points(mesh.nodes + 0.1)
    shift = np.zeros(3)
    shift[: len(size)] = 0.1
    np.testing.assert_allclose(moved, points + shift, atol=1e-12)
    across = points[built.polygons]
    areas = 0.5 * np.linalg.norm(np.cross(across[:, 2] - across[:, 0], across[:, 3] - across[:, 1]), axis=1)
    # A plate of (4 Δx)²; the four sides, 2 Δx and Δx wide, of a box as long as the edge; the face itself.
    expected = {1: 0.2**2, 2: 0.2 * 2 * (0.1 + 0.05), 3: 0.2 * 0.2}[len(size)]
    assert areas.sum() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("velocty", "--field = 'velocty' .*did you mean velocity"),
        ("stress", "one of stress:s11, stress:s22, stress:s12, stress:s33"),
        ("stress:s13", "one of stress:s11"),
        ("velocity:z", "one of velocity:x, velocity:y"),
        ("density:x", "density has no components"),
    ],
)
def test_unknown_quantities_are_refused(text, message, tmp_path):
    simulation = Simulation(block(), device="cpu")
    FrameWriter(simulation, (0.0,), tmp_path)
    with pytest.raises(SceneError, match=message):
        quantity(text, Frames(tmp_path))


def test_quantities_are_components_or_lengths(tmp_path):
    scene = block(
        velocity=lambda x, y: (3.0 + 0.0 * x, 4.0),
        conditions=[],
        stress=lambda x, y: (1.0, 2.0, 3.0, 4.0),
        numerics=Numerics(velocity_scheme="taylor"),  # an edge without a condition keeps its tractions
    )
    FrameWriter(Simulation(scene, device="cpu"), (0.0,), tmp_path)
    frames = Frames(tmp_path)
    for text, value, label in (
        (None, 3.0, "velocity x [m/s]"),  # the scene's field and component
        ("velocity", 5.0, "velocity [m/s]"),
        ("velocity:y", 4.0, "velocity y [m/s]"),
        ("stress:s12", 3.0, "stress s12 [Pa]"),
        ("density", 2000.0, "density [kg/m³]"),
    ):
        shown = quantity(text, frames)
        assert shown.label == label
        np.testing.assert_allclose(shown(frames[0]), value, rtol=1e-6)


def test_history_is_read_up_to_its_last_whole_line(tmp_path):
    (tmp_path / "history.csv").write_text("step [-],time [s],load at top [N]\n0,0.0,1.5\n1,0.1,2.5\n2,0.")
    columns, units = read_history(tmp_path / "history.csv")
    assert units == {"step": "-", "time": "s", "load at top": "N"}
    np.testing.assert_array_equal(columns["load at top"], [1.5, 2.5])


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("step [-],load [N]", "does not begin with step and time"),
        ("step [-],time [s],load", "have no name"),
        ("step [-],time [s],load [N],load [N]", "one name"),
        ("step [-],time [s],energy.kinetic [J],energy.elastic [J]", "not those of a balance"),
        ("step [-],time [s],load [N],force [N]", "not of one length"),
    ],
)
def test_history_with_other_columns_than_are_written_is_refused(header, message, tmp_path):
    (tmp_path / "history.csv").write_text(f"{header}\n0,0.0,1.5\n")
    with pytest.raises(DamagedError, match=message):
        read_history(tmp_path / "history.csv")


def test_what_is_quoted_of_a_damaged_file_is_one_line_of_some_length(tmp_path):
    (tmp_path / "history.csv").write_text(f"step [-],time [s]\n0,{'x' * 5000}\n")
    with pytest.raises(DamagedError, match="could not convert string to float") as caught:
        read_history(tmp_path / "history.csv")
    assert len(str(caught.value)) < 600


def test_python_warns_of_nothing_in_a_damaged_file(tmp_path):
    """NumPy reads an array's form as Python does, which would warn of it on standard error."""
    array = io.BytesIO()
    np.save(array, np.zeros(1))
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("values.npy", array.getvalue().replace(b"(1,)", b"1or 1"))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with pytest.raises(DamagedError):
            read_arrays("frame", tmp_path / "a.npz")
    assert not said


@pytest.fixture(scope="module")
def framed(tmp_path_factory):
    """The folder of a run with frames."""
    folder = tmp_path_factory.mktemp("framed")
    simulation = Simulation(block(), device="cpu")
    simulation.run(observers=[FrameWriter(simulation, evenly(4e-3, 2), folder)])
    return folder


@pytest.mark.parametrize(
    ("file", "name", "change", "message"),
    [
        ("000001.npz", "velocity", lambda v: v[:-1], r"velocity has shape \(\d+, 2\)"),
        ("000001.npz", "density", lambda v: v.astype(np.int32), "density is of type int32"),
        ("000001.npz", "stress", nan, "stress is not finite everywhere"),
        ("000001.npz", "time", lambda v: v - 1.0, "its time is below 0"),
        ("body.npz", "nodes", nan, "nodes is not finite everywhere"),
        ("body.npz", "nodes", lambda v: 0.0 * v, "a cell has no volume"),
        ("body.npz", "cells", out_of_range, "cells leads out of its table"),
        ("body.npz", "cells", lambda v: v[:, :2].copy(), r"\(2, 2\)"),
        ("body.npz", "faces", out_of_range, "faces leads out of its table"),
        ("body.npz", "face_cell", lambda v: v[:-1], r"face_cell has shape \(\d+,\)"),
        ("body.npz", "wall_0", out_of_range, "wall_0 leads out of its table"),
    ],
)
def test_forged_frame_is_refused(file, name, change, message, framed, tmp_path):
    """Its checksums fit; only a reader of the meaning sees that it is no frame of this body."""
    shutil.copytree(framed / "frames", tmp_path / "frames")
    path = tmp_path / "frames" / file
    with np.load(path) as archive:
        content = dict(archive)
    content[name] = change(content[name])
    np.savez(path, **content)
    with pytest.raises(DamagedError, match=message):
        list(Frames(tmp_path))
