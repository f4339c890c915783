"""USD stages, opened with usd-core: what is in them, against the run they were made from."""

import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from pxr import Sdf, Tf, Usd, UsdGeom, Vt

from warpsph.cli.main import main
from warpsph.errors import DamagedError
from warpsph.export.usd import usd_errors
from warpsph.export.usd_live import LiveStage
from warpsph.frames import Frames

pytestmark = pytest.mark.usefixtures("undrawn")

TOOL = Path(__file__).parent.parent / "tools" / "check_usd.py"
SPACING, FRAMES = 0.1, 8
SCENE = '''"""A body pressed by a plate at 1 m/s, under gravity."""
from warpsph import *
PARAMETERS = (Parameter("duration", 0.02, "s", "simulated time"),)

def scene(p):
    return Scene(
        shape=Box({size}, 0.1),
        material=PerzynaVonMises(
            young_modulus=8e6, poisson_ratio=0.3, density=2000.0, fluidity=10.0, yield_size=5e4
        ),
        conditions=[
            Fixed(edge("{low}")), PrescribedVelocity(edge("{high}"), {velocity}), Roller(edge("left"))
        ][:{n}],
        body_force=BodyForce({gravity}),
        duration=p.duration,
        numerics=p.numerics,
        output=Output(field="displacement", component=0),
    )
'''
SCENES = {
    1: {
        "size": (1.0,),
        "low": "left",
        "high": "right",
        "velocity": (-1.0,),
        "gravity": (0.0,),
        "n": 2,
    },
    2: {
        "size": (1.0, 0.5),
        "low": "bottom",
        "high": "top",
        "velocity": (None, -1.0),
        "gravity": (0.0, -9.81),
        "n": 3,
    },
    3: {
        "size": (0.4, 0.4, 0.5),
        "low": "bottom",
        "high": "top",
        "velocity": (None, None, -1.0),
        "gravity": (0.0, 0.0, -9.81),
        "n": 3,
    },
}


def load_tool():
    spec = importlib.util.spec_from_file_location("check_usd", TOOL)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


faults = load_tool().faults


@pytest.fixture(scope="module", params=[1, 2, 3], ids=["bar", "plane", "solid"])
def made(request, tmp_path_factory):
    """Folder of a run in that many dimensions with its stage `live.usdc`, and the dimension."""
    folder = tmp_path_factory.mktemp("usd")
    (folder / "body.py").write_text(SCENE.format(**SCENES[request.param]))
    arguments = ["run", str(folder / "body.py"), "--quiet", "--device", "cpu", "--out", str(folder)]
    assert main([*arguments, "--frames", str(FRAMES), "--usd", str(folder / "live.usdc")]) == 0
    return folder, request.param


@pytest.fixture(scope="module")
def plane(tmp_path_factory):
    """The folder of the plane run."""
    folder = tmp_path_factory.mktemp("usd")
    (folder / "body.py").write_text(SCENE.format(**SCENES[2]))
    arguments = ["run", str(folder / "body.py"), "--quiet", "--device", "cpu", "--out", str(folder)]
    assert main([*arguments, "--frames", str(FRAMES)]) == 0
    return folder


def material(stage):
    return UsdGeom.Points(stage.GetPrimAtPath("/Run/MaterialNodes"))


def in_space(vectors):
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1]))).astype(np.float32)


def test_stage_passes_usd_s_validation(made):
    folder, _ = made
    UsdValidation = pytest.importorskip("pxr.UsdValidation", reason="this usd-core has no UsdValidation")
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    stage = Usd.Stage.Open(str(folder / "live.usdc"))
    assert [error.GetErrorAsString() for error in context.Validate(stage)] == []
    assert faults(folder / "live.usdc", folder) == []
    assert [p.name for p in folder.iterdir() if "part" in p.name or p.name.endswith(".frames")] == []


def test_one_second_of_the_stage_is_one_second_of_the_run(made):
    folder, dim = made
    stage, frames = Usd.Stage.Open(str(folder / "live.usdc")), Frames(folder)
    assert stage.GetDefaultPrim().GetPath() == "/Run" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == ("Z" if dim == 3 else "Y")
    assert stage.GetTimeCodesPerSecond() == pytest.approx(FRAMES / 0.02)
    codes = material(stage).GetPointsAttr().GetTimeSamples()
    assert (
        codes == [stage.GetStartTimeCode() + k for k in range(FRAMES + 1)] and codes[-1] == stage.GetEndTimeCode()
    )
    longest = max(frame.time / max(frame.step, 1) for frame in frames)
    for code, frame in zip(codes, frames, strict=True):
        assert 0.0 <= frame.time - code / stage.GetTimeCodesPerSecond() + 1e-12 <= longest
        assert stage.GetPrimAtPath("/Run").GetAttribute("warpsph:time").Get(code) == frame.time


def test_points_carry_the_fields_of_the_run(made):
    folder, _ = made
    stage, frames = Usd.Stage.Open(str(folder / "live.usdc")), Frames(folder)
    points, count = material(stage), len(frames.mesh.nodes)
    ids = points.GetIdsAttr()
    assert ids.GetTypeName() == Sdf.ValueTypeNames.Int64Array and list(ids.Get()) == list(range(count))
    assert points.GetWidthsInterpolation() == "constant"
    assert (
        list(points.GetWidthsAttr().Get()) == [pytest.approx(SPACING)]
        and not points.GetWidthsAttr().GetTimeSamples()
    )
    primvars = UsdGeom.PrimvarsAPI(points.GetPrim())
    for frame in frames:
        position = frame.field("position")
        np.testing.assert_array_equal(points.GetPointsAttr().Get(frame.number), in_space(position))
        np.testing.assert_array_equal(
            points.GetVelocitiesAttr().Get(frame.number), in_space(frame.field("velocity"))
        )
        radius = np.full(3, 0.5 * SPACING)
        low, high = in_space(np.array([position.min(axis=0), position.max(axis=0)]))
        extent = np.array(points.GetExtentAttr().Get(frame.number))
        np.testing.assert_allclose(extent, [low - radius, high + radius], atol=1e-6)
        for k, name in enumerate(frames.mesh.continuum.stress_components):
            primvar = primvars.GetPrimvar(f"stress_{name}")
            assert (primvar.GetTypeName(), primvar.GetInterpolation()) == (Sdf.ValueTypeNames.FloatArray, "vertex")
            np.testing.assert_array_equal(primvar.Get(frame.number), frame.stored["stress"][:, k])
            assert len(primvars.GetPrimvar(f"strain_e{name[1:]}").Get(frame.number)) == count
        strain = primvars.GetPrimvar("equivalent_plastic_strain").Get(frame.number)
        np.testing.assert_array_equal(strain, frame.stored["equivalent_plastic_strain"])


def test_gravity_looks_down_and_the_plate_moves_down_with_its_nodes(made):
    folder, dim = made
    stage, frames = Usd.Stage.Open(str(folder / "live.usdc")), Frames(folder)
    walls = {prim.GetName(): UsdGeom.Mesh(prim) for prim in stage.GetPrimAtPath("/Run/Walls").GetChildren()}
    low, high = SCENES[dim]["low"], SCENES[dim]["high"]
    assert list(walls)[:2] == [f"fixed_{low}", f"moving_{high}"]
    still, plate = walls[f"fixed_{low}"].GetPointsAttr(), walls[f"moving_{high}"].GetPointsAttr()
    assert still.GetNumTimeSamples() == 0 and len(still.Get())
    axis = 0 if dim == 1 else "XYZ".index(UsdGeom.GetStageUpAxis(stage))
    moved = np.array(plate.Get(FRAMES)) - np.array(plate.Get(0))
    assert moved[:, axis] == pytest.approx(-frames[-1].time * 1.0, rel=0.02)
    assert np.array(plate.Get(0))[:, axis].min() == pytest.approx(SCENES[dim]["size"][-1] + 0.5 * SPACING)


def test_auxiliary_nodes_stand_in_their_cells_and_are_hidden(made):
    folder, _ = made
    stage, frames = Usd.Stage.Open(str(folder / "live.usdc")), Frames(folder)
    points = UsdGeom.Points(stage.GetPrimAtPath("/Run/AuxiliaryNodes"))
    assert points.ComputeVisibility() == "invisible"
    middle = frames[-1].field("position")[frames.mesh.cells].mean(axis=1)
    np.testing.assert_allclose(points.GetPointsAttr().Get(FRAMES), in_space(middle), atol=1e-6)


@pytest.mark.parametrize("suffix", ["usdc", "usda"])
def test_export_colours_by_any_field_over_a_fixed_range(plane, suffix):
    path = plane / f"sub/made.{suffix}"
    options = ["--field", "velocity:y", "--colour-map", "magma", "--range=-1,0"]
    assert main(["export", str(plane), str(path), *options]) == 0
    assert faults(path, plane) == []
    stage, frames = Usd.Stage.Open(str(path)), Frames(plane)
    points = material(stage)
    for frame in frames:
        velocity = np.clip(frame.field("velocity")[:, 1], -1.0, 0.0)
        srgb = matplotlib.colormaps["magma"](velocity + 1.0)[:, :3]
        linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(points.GetDisplayColorAttr().Get(frame.number), linear, atol=0.03)
    moved = frames.mesh.nodes[:, 1] > 0.45
    top = np.array(points.GetDisplayColorAttr().Get(FRAMES))[moved]
    assert top == pytest.approx(np.tile(top[0], (len(top), 1)))


def test_export_is_what_the_run_wrote(made):
    folder, _ = made
    assert main(["export", str(folder), str(folder / "again.usda")]) == 0
    assert main(["export", str(folder), str(folder / "again.usdc")]) == 0
    live = Sdf.Layer.FindOrOpen(str(folder / "live.usdc")).ExportToString()
    assert live == Sdf.Layer.FindOrOpen(str(folder / "again.usdc")).ExportToString()
    assert live == Sdf.Layer.FindOrOpen(str(folder / "again.usda")).ExportToString()


def test_a_killed_run_leaves_a_stage_that_opens_with_all_its_frames(tmp_path):
    """kill -9 in the middle of a run of 20,000 frames: the frame under way may be missing, nothing else."""
    (tmp_path / "body.py").write_text(SCENE.format(**SCENES[2]))
    path, out = tmp_path / "live.usdc", tmp_path / "out"
    command = [sys.executable, "-m", "warpsph", "run", str(tmp_path / "body.py"), "--device", "cpu", "--quiet"]
    command += ["--set", "duration=50", "--frames", "20000", "--out", str(out), "--usd", str(path)]
    process = subprocess.Popen(command)
    limit = time.monotonic() + 60.0
    while time.monotonic() < limit and not (out / "frames" / "000012.npz").exists():
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait(timeout=30) == -signal.SIGKILL
    frames, stage = Frames(out), Usd.Stage.Open(str(path))
    codes = material(stage).GetPointsAttr().GetTimeSamples()
    assert len(codes) >= 12 and codes in (frames.codes, frames.codes[:-1])
    assert [fault for fault in faults(path, out) if "the run has" not in fault] == []
    assert main(["export", str(out), str(tmp_path / "flat.usdc")]) == 0
    assert faults(tmp_path / "flat.usdc", out) == []


@pytest.mark.parametrize(
    "error", [OSError(28, "No space left on device"), DamagedError("frame", "000004.npz", "it can not be read")]
)
def test_a_stage_that_can_not_be_written_costs_neither_frames_nor_run(error, tmp_path, monkeypatch, capsys):
    refer = LiveStage._refer

    def full(stage):
        if len(stage._seen) > 3:
            raise error
        refer(stage)

    monkeypatch.setattr(LiveStage, "_refer", full)
    path = tmp_path / "live.usdc"
    arguments = ["run", "perzyna_bar", "--quiet", "--device", "cpu", "--out", str(tmp_path), "--usd", str(path)]
    assert main(arguments) == 0
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "live.usdc is not written further, the run goes on" in error
    assert Frames(tmp_path).numbers == list(range(51))
    stage = Usd.Stage.Open(str(path))
    assert material(stage).GetPointsAttr().GetTimeSamples() == [0.0, 1.0, 2.0]


def test_frames_that_somebody_has_removed_are_said_and_the_stage_stays_as_it_is(tmp_path, monkeypatch, capsys):
    close, path = LiveStage.close, tmp_path / "live.usdc"

    def close_without(stage):
        shutil.rmtree(tmp_path / "frames")
        before = path.read_bytes()
        try:
            close(stage)
        finally:
            assert path.read_bytes() == before

    monkeypatch.setattr(LiveStage, "close", close_without)
    arguments = ["run", "perzyna_bar", "--quiet", "--device", "cpu", "--out", str(tmp_path), "--usd", str(path)]
    assert main(arguments) == 0
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "its frames are gone" in error


def test_usd_writes_no_warnings_of_its_own(tmp_path, capfd):
    """As the one of a disk that is taken away while it writes."""
    with usd_errors(tmp_path / "a.usdc"):
        Tf.Warn("said by USD")
    assert capfd.readouterr().err == ""
    Tf.Warn("said by USD")
    assert "said by USD" in capfd.readouterr().err


def _shift_time(stage):
    stage.GetPrimAtPath("/Run").GetAttribute("warpsph:time").Set(1.0, 3)


def _shorten(stage):
    attribute = material(stage).GetVelocitiesAttr()
    attribute.Set(Vt.Vec3fArray(attribute.Get(2)[:-1]), 2)


def _spoil(stage):
    attribute = UsdGeom.PrimvarsAPI(material(stage).GetPrim()).GetPrimvar("stress_s11").GetAttr()
    values = np.array(attribute.Get(4))
    values[7] = np.nan
    attribute.Set(Vt.FloatArray.FromNumpy(values), 4)


def _shrink(stage):
    attribute = material(stage).GetExtentAttr()
    attribute.Set(Vt.Vec3fArray([0.9 * corner for corner in attribute.Get(5)]), 5)


def _drop_frame(stage):
    material(stage).GetPointsAttr().ClearAtTime(FRAMES)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (_shift_time, "the time at 3 is not"),
        (_shorten, r"MaterialNodes at 2.0: velocities has \d+ values for"),
        (_spoil, "stress_s11 is not finite"),
        (_shrink, r"MaterialNodes at 5.0: extent .* is not that of its points"),
        (_drop_frame, "8 time codes, others have 9"),
        (lambda stage: stage.ClearMetadata("upAxis"), "upAxis"),
        (lambda stage: stage.ClearDefaultPrim(), "defaultPrim"),
    ],
)
def test_the_tool_finds_what_is_wrong(edit, message, plane, tmp_path):
    path = tmp_path / "wrong.usda"
    assert main(["export", str(plane), str(path)]) == 0
    stage = Usd.Stage.Open(str(path))
    edit(stage)
    stage.Save()
    found = faults(path, plane)
    assert any(re.search(message, fault) for fault in found), found


def test_the_tool_exits_with_1_for_a_file_that_is_no_stage(plane, tmp_path):
    path = tmp_path / "torn.usdc"
    assert main(["export", str(plane), str(path)]) == 0
    assert subprocess.run([sys.executable, str(TOOL), str(path)], timeout=60, check=False).returncode == 0
    path.write_bytes(path.read_bytes()[:3000])
    assert subprocess.run([sys.executable, str(TOOL), str(path)], timeout=60, check=False).returncode == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["export", "RUN", "a.stl"], "FILE = .*a.stl' .* NAME.usdc, NAME.usda, NAME.pvd"),
        (["export", "nowhere", "a.usdc"], "DIR = 'nowhere' .* kept frames"),
        (["export", "RUN", "a.usdc", "--colour-map", "magna"], "--colour-map = 'magna' .*did you mean magma"),
        (["export", "RUN", "a.usdc", "--range", "1,0"], "--range = '1,0' .* the second larger"),
        (["export", "RUN", "a.usdc", "--range", "1"], "--range = '1' .* two numbers"),
        (["export", "RUN", "a.usdc", "--field", "speed"], "--field = 'speed' .* one of position"),
        (["export", "RUN", "RUN/frames/body.npz/a.usdc"], "FILE = .* a file that can be written"),
        (["export", "RUN", "a.pvd", "--field", "stress:s11"], "--field = 'stress:s11' .* it is for USD"),
        (["run", "elastic_bar", "--usd", "a.usd"], "--usd = 'a.usd' .* NAME.usdc"),
        (["run", "elastic_bar", "--usd", "a.usdc", "--frames", "0"], "--frames = 0 .* with --usd .* at least 1"),
        (["run", "elastic_bar", "--frames", "-1"], "--frames = '-1' .* whole number, at least 0"),
        (["run", "elastic_bar", "--frames", "many"], "--frames = 'many' .* whole number"),
    ],
)
def test_bad_input_exits_with_2_and_one_line(arguments, message, plane, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([part.replace("RUN", str(plane)) for part in arguments]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and re.search(f"^warpsph: {message}", error), error
    assert os.listdir(tmp_path) == []
