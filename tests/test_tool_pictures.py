"""Tools in frames, USD and pictures: closed meshes on their surfaces, that move as the tools do."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from tests.test_tools import FORMS, GROUND, SOFT, down, pressed_by
from warpsph import Block, Box, Cylinder, Plane, Scene, SceneError, Simulation, Sphere
from warpsph.cli.main import main
from warpsph.export.frames import Frames, FrameWriter
from warpsph.export.tool_meshes import tool_meshes, tools_now
from warpsph.export.usd import write_stage

FALLS = '''"""Falls."""
from warpsph import BodyForce, Box, Elastic, Plane, Scene

PARAMETERS = ()


def scene(p):
    return Scene(
        shape=Box((0.4,) * {dim}, 0.1),
        material=Elastic(young_modulus=1e6, density=1000.0),
        body_force=BodyForce(({zeros}-9.81,)),
        tools=[Plane(({zeros}-0.01,), ({zeros}1.0,), name="ground")],
        duration=0.05,
    )
'''


def of(tool, dim):
    origin = (-5.0 if tool is FORMS["line"][1] else 5.0,) * dim
    shape = Box((0.2,) * dim, 0.1, origin=origin)
    (mesh,) = tool_meshes(Scene(shape=shape, material=SOFT, duration=1.0, tools=(tool,)))
    return mesh


def volume(mesh):
    """By the divergence theorem, of quads cut in two: positive when they face outwards."""
    corners = mesh.points[mesh.polygons]
    halves = [np.linalg.det(corners[:, list(three)]).sum() / 6.0 for three in ((0, 1, 2), (0, 2, 3))]
    return float(sum(halves))


@pytest.mark.parametrize("name", FORMS)
def test_meshes_are_closed_face_outwards_and_lie_on_the_surface(name):
    dim, tool = FORMS[name]
    mesh = of(tool, dim)
    edges = [(a, b) for ring in mesh.polygons.tolist() for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    assert sorted(edges) == sorted((b, a) for a, b in edges) and len(set(edges)) == len(edges)
    assert volume(mesh) > 0.0
    if name not in ("line", "segment", "brick"):
        gaps = tool.form(dim).distance(mesh.points[:, :dim])
        assert gaps.max() == pytest.approx(0.0, abs=1e-9)
        assert isinstance(tool, Plane) or gaps.min() == pytest.approx(0.0, abs=1e-9)


def test_volumes_are_those_of_the_bodies():
    assert volume(of(Sphere((0.0, 1.0, 0.0), 2.0), 3)) == pytest.approx(4.0 / 3.0 * math.pi * 8.0, rel=0.01)
    pile = Cylinder((0.0, 1.0, 0.0), 2.0, axis=(1.0, 1.0, 0.0), length=3.0)
    assert volume(of(pile, 3)) == pytest.approx(12.0 * math.pi, rel=0.01)
    assert volume(of(Block((0.0, 1.0, 0.0), (1.0, 2.0, 3.0), angle=0.3), 3)) == pytest.approx(6.0)


def test_tools_move_in_frames_and_on_the_stage(tmp_path):
    tool = Cylinder((0.45, 0.8), 0.2, velocity=down(2), name="pipe")
    scene = pressed_by(tool)
    simulation = Simulation(scene, device="cpu", threads=1)
    writer = FrameWriter(simulation, np.linspace(0.0, scene.duration, 3), tmp_path)
    simulation.run(observers=[writer])
    writer.close()
    frames = Frames(tmp_path)
    (start,) = frames.tools
    ways = [frame.tools[0].points[0] - start.points[0] for frame in frames]
    assert ways == [pytest.approx((0.0, -1.5 * frame.time, 0.0), abs=1e-12) for frame in frames]
    assert tools_now(simulation)[0].points == pytest.approx(frames[-1].tools[0].points)
    write_stage(frames, tmp_path / "run.usda")
    stage = Usd.Stage.Open(str(tmp_path / "run.usda"))
    prim = UsdGeom.Mesh(stage.GetPrimAtPath("/Run/Tools/pipe"))
    for code, frame in zip(frames.codes, frames, strict=True):
        assert np.array(prim.GetPointsAttr().Get(code)) == pytest.approx(frame.tools[0].points, abs=1e-6)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_runs_with_tools_are_drawn(dim, tmp_path):
    file, zeros = tmp_path / "scene.py", "0.0, " * (dim - 1)
    file.write_text(FALLS.format(dim=dim, zeros=zeros), encoding="utf-8")
    out = tmp_path / "run"
    assert main(["run", str(file), "--out", str(out), "--frames", "2", "--quiet", "--device", "cpu"]) == 0
    assert main(["plot", str(out)]) == 0
    live = ["--frames", "2", "--usd", str(tmp_path / "live.usdc"), "--out", str(tmp_path / "live")]
    assert main(["run", str(file), "--quiet", "--device", "cpu", *live]) == 0
    stage = Usd.Stage.Open(str(tmp_path / "live.usdc"))
    assert stage.GetPrimAtPath("/Run/Tools/ground").IsA(UsdGeom.Mesh)
    assert main(["export", str(out), str(tmp_path / "run.usdc")]) == 0
    assert (out / "field.png").stat().st_size > 1000


@pytest.mark.parametrize("name", ["", "a b", "../x", "1st", 3])
def test_names_of_tools_can_be_names_of_prims(name):

    with pytest.raises(SceneError, match=r"Plane\.name"):
        replace(GROUND, name=name)
