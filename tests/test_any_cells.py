"""Scenes of all five kinds of cell: conditions, scene files, frames, pictures, USD and ParaView files."""

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom

from tests.test_given_mesh import BOXES, as_given
from warpsph import (
    Box,
    Disc,
    Elastic,
    Fixed,
    Free,
    GivenMesh,
    Numerics,
    PrescribedVelocity,
    Roller,
    Scene,
    SceneError,
    edge,
    tag,
)
from warpsph.analysis import checkerboard, green_strain
from warpsph.cli.main import main
from warpsph.export.frame_files import ARRAYS
from warpsph.export.walls import WallMesh
from warpsph.frames import Frames
from warpsph.mesh.mesh import NO_SIDE
from warpsph.scene.document import decode, encode
from warpsph.scene.fingerprint import fingerprint
from warpsph.scene.resolve import resolve

sys.path.insert(0, str(Path(__file__).parent.parent / "tools"))
from check_usd import faults

SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
CELLS = Numerics(velocity_scheme="cells")
every_kind = pytest.mark.parametrize("kind", BOXES)


def given(kind, tags=None):
    """The box of a kind with its inner nodes moved, as a mesh of one's own."""
    mesh = BOXES[kind].mesh()
    inner = np.ones(len(mesh.nodes), dtype=bool)
    inner[mesh.faces] = False
    shift = np.random.default_rng(0).uniform(-0.05, 0.05, mesh.nodes.shape)
    return GivenMesh(points=mesh.nodes + inner[:, None] * shift, cells=as_given(mesh), tags=tags or {})


def held(kind):
    """Nodes and faces of the left end."""
    mesh = BOXES[kind].mesh()
    return {"held": mesh.faces[mesh.face_side == 0], "other end": np.unique(mesh.faces[mesh.face_side == 1])}


def scene(kind, **changes):
    parts = {
        "shape": given(kind, held(kind)),
        "material": SOFT,
        "conditions": [Fixed(tag("held")), Roller(tag("other end"))],
        "duration": 0.05,
        "numerics": CELLS,
        "velocity": lambda x, *rest: (x, *(0.0 * x for _ in rest)),
    }
    return Scene(**(parts | changes))


# ---------------------------------------------------------------------------------------------------------
# Conditions
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("size", "cells"), [((1.0, 0.75), "triangles"), ((1.0, 0.5, 0.75), "tetrahedra")])
@pytest.mark.parametrize("diagonals", ["rising", "falling", "alternating"])
def test_conditions_do_not_depend_on_how_cells_are_cut(size, cells, diagonals):
    """Nodes and sides are the same, so is what holds at each node: at edges and corners as well."""
    conditions = [
        Fixed(edge("bottom")),
        Roller(edge("left")),
        PrescribedVelocity(edge("top"), (None,) * (len(size) - 1) + (-1.0,)),
        Free(edge("right")),
    ]
    whole = resolve(Box(size, 0.25).mesh(), conditions)
    cut = resolve(Box(size, 0.25, cells=cells, diagonals=diagonals).mesh(), conditions)
    for name in ("nodes", "velocity_projector", "stress_projector", "amplitude", "function", "moved"):
        np.testing.assert_allclose(getattr(cut, name), getattr(whole, name), atol=1e-12, err_msg=name)


@pytest.mark.parametrize("diagonals", ["rising", "falling", "alternating"])
def test_normals_of_a_round_wall_do_not_depend_on_how_it_is_cut(diagonals):
    """On a quarter of a tube the mean of the facets' normals, weighed by their angles, is along the radius."""

    def tube(x, y, z):
        return (1.0 + x) * np.cos(y), (1.0 + x) * np.sin(y), z

    box = Box((1.0, 1.5, 0.75), 0.25, cells="tetrahedra", diagonals=diagonals).mapped(tube)
    mesh = box.mesh()
    table = resolve(mesh, [Roller(edge("right"))])
    y = np.arctan2(mesh.nodes[table.nodes, 1], mesh.nodes[table.nodes, 0])
    inner = (y > 0.1) & (y < 1.4)
    normals = np.stack([np.cos(y), np.sin(y), 0.0 * y], axis=1)
    expected = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    assert inner.sum() > 10
    np.testing.assert_allclose(table.velocity_projector[inner], expected[inner], atol=1e-9)


@every_kind
def test_tags_hold_what_they_name(kind):
    table, mesh = scene(kind).boundary, scene(kind).mesh
    x = mesh.nodes[table.nodes, 0]
    fixed = table.nodes[~table.velocity_projector.any(axis=(1, 2))]
    assert set(fixed) >= set(np.flatnonzero(mesh.nodes[:, 0] == 0.0))
    right = table.velocity_projector[x == 1.0]
    assert len(right) and not right[:, 0].any() and np.allclose(right[:, 1:, 1:], np.eye(mesh.dim - 1))


def test_a_condition_on_a_tag_that_there_is_not_is_refused():
    with pytest.raises(
        SceneError, match=r"tag = 'hold' is not allowed: it must be one of held, other end \(did you"
    ):
        scene("triangle", conditions=[Fixed(tag("hold"))])


# ---------------------------------------------------------------------------------------------------------
# Measures
# ---------------------------------------------------------------------------------------------------------


@every_kind
def test_strain_of_a_uniform_deformation_is_exact(kind):
    mesh = given(kind).mesh()
    H = 0.2 * np.random.default_rng(3).standard_normal((mesh.dim, mesh.dim))
    expected = 0.5 * (H + H.T + H.T @ H)
    strain = green_strain(mesh, mesh.nodes @ H.T)
    for k, (i, j) in enumerate(mesh.continuum.pairs):
        assert np.allclose(strain[:, k], expected[i, j] if max(i, j) < mesh.dim else 0.0, atol=1e-12)


def test_simplices_have_no_checkerboard():
    mesh = given("triangle").mesh()
    with pytest.raises(SceneError, match="cells = 'triangle' is not allowed: segments, quads and hexahedra alone"):
        checkerboard(mesh, np.zeros(len(mesh.nodes)))


# ---------------------------------------------------------------------------------------------------------
# Scenes as data
# ---------------------------------------------------------------------------------------------------------


@every_kind
def test_a_stored_scene_is_the_same_scene(kind):
    first = scene(kind)
    document, arrays = encode(first)
    again = decode(document, arrays)
    assert fingerprint(again) == fingerprint(first)
    assert again.mesh.tags.keys() == first.mesh.tags.keys()
    for name, found in again.mesh.tags.items():
        assert np.array_equal(found.faces, first.mesh.tags[name].faces)


def test_mapped_and_cut_shapes_are_stored():
    for shape in (
        given("triangle", held("triangle")).rotated(0.2),
        Box((1.0, 0.5), 0.25, cells="triangles", diagonals="falling"),
        Disc(1.0, 0.25, cells="triangles"),
    ):
        first = scene("triangle", shape=shape, conditions=[Fixed(edge("bottom"))])
        assert fingerprint(decode(*encode(first))) == fingerprint(first)


def test_scenes_of_other_cells_have_other_fingerprints():
    cuts = [
        scene("triangle", conditions=[], shape=Box((1.0, 0.5), 0.25, cells=cells, diagonals=diagonals))
        for cells, diagonals in [("lattice", None), ("triangles", "rising"), ("triangles", "falling")]
    ]
    assert len({fingerprint(cut) for cut in cuts}) == 3


def test_a_mesh_may_be_written_by_hand():
    shape = {
        "type": "GivenMesh",
        "points": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        "cells": [[0, 1, 2, 3]],
        "tags": {"base": [[0, 1]], "values": [2], "type": [3]},
    }
    material = {"type": "Elastic", "young_modulus": 1e6, "density": 1e3}
    conditions = [{"type": "Fixed", "on": {"type": "tag", "name": "base"}}]
    found = decode({"shape": shape, "material": material, "conditions": conditions, "duration": 1.0})
    assert found.boundary.nodes.tolist()[:2] == [0, 1] and set(found.mesh.tags) == {"base", "values", "type"}
    with pytest.raises(SceneError, match=r"cells\[0\] = \(0, 1, 2, 4\) is not allowed"):
        decode({"shape": shape | {"cells": [[0, 1, 2, 4]]}, "material": material, "duration": 1.0})
    with pytest.raises(SceneError, match="tags = 3 is not allowed"):
        decode({"shape": shape | {"tags": 3}, "material": material, "duration": 1.0})


# ---------------------------------------------------------------------------------------------------------
# What a run leaves
# ---------------------------------------------------------------------------------------------------------

FILE = """
import numpy as np
from tests.test_any_cells import scene as made
from warpsph import NodeValue, Output, Probe

def scene(p):
    output = Output(probes=(Probe("u", "m", NodeValue("displacement", {near}, 0)),), field="velocity")
    return made("{kind}", output=output, numerics=p.numerics)

NUMERICS = {{"velocity_scheme": "cells"}}
"""


@pytest.fixture(scope="module", params=BOXES)
def run(request, tmp_path_factory):
    """The folder of a run of each kind of cell."""
    folder = tmp_path_factory.mktemp(request.param)
    near = tuple(BOXES[request.param].mesh().nodes.max(axis=0).tolist())
    (folder / "body.py").write_text(FILE.format(kind=request.param, near=near), encoding="utf-8")
    arguments = ["run", str(folder / "body.py"), "--quiet", "--device", "cpu", "--out", str(folder / "run")]
    assert main([*arguments, "--frames", "3", "--usd", str(folder / "run" / "live.usdc")]) == 0
    return folder / "run"


def coloured(path):
    """Share of a picture's pixels that are neither white, black nor grey."""
    return float((np.ptp(np.asarray(Image.open(path).convert("RGB")).astype(int), axis=2) > 20).mean())


def test_frames_hold_the_mesh(run):
    frames, mesh = Frames(run), scene(run.parent.name.rstrip("0123456789")).mesh
    assert len(frames) == 4
    for name in ARRAYS:
        assert np.array_equal(getattr(frames.mesh, name), getattr(mesh, name)), name
    assert {wall.name for wall in frames.walls} == {"fixed_left", "roller_right"}


def test_pictures_show_the_body(run):
    assert main(["plot", str(run)]) == 0
    assert coloured(run / "overview.png") > 0.002 and coloured(run / "field.png") > 0.002


def test_usd_stages_are_sound_and_walls_have_the_faces_under_them(run):
    assert main(["export", str(run), str(run / "body.usdc")]) == 0
    frames = Frames(run)
    for path in (run / "live.usdc", run / "body.usdc"):
        assert faults(path, run) == []
    stage, mesh = Usd.Stage.Open(str(run / "body.usdc")), frames.mesh
    wall = UsdGeom.Mesh(stage.GetPrimAtPath("/Run/Walls/fixed_left"))
    counts = np.array(wall.GetFaceVertexCountsAttr().Get())
    indices = np.array(wall.GetFaceVertexIndicesAttr().Get())
    assert counts.sum() == len(indices)
    corners = {1: 4, 2: 4, 3: mesh.faces.shape[1]}[mesh.dim]
    assert (counts == corners).all()
    faces = int((mesh.face_side == 0).sum())
    assert len(counts) == faces * {1: 1, 2: 4, 3: 1}[mesh.dim]
    if mesh.dim == 3:
        points = np.array(wall.GetPointsAttr().Get())[indices.reshape(-1, corners)]
        middle = points.mean(axis=1, keepdims=True)
        around = np.cross(points - middle, np.roll(points, -1, axis=1) - middle)
        assert np.linalg.norm(around.sum(axis=1), axis=1).sum() / 2.0 == pytest.approx(0.5 * 0.75, rel=1e-5)


def test_a_wall_is_drawn_outside_of_its_faces(run):
    frames = Frames(run)
    wall = next(wall for wall in frames.walls if wall.name == "fixed_left")
    points = WallMesh.of(frames.mesh, wall).points(frames.mesh.nodes)
    assert points[:, 0].max() == pytest.approx(-0.5 * frames.mesh.spacing)


def test_paraview_files_have_the_cells(run):
    vtk = pytest.importorskip("vtkmodules.vtkIOXML", reason="VTK is not installed (extra vtk)")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    assert main(["export", str(run), str(run / "body.pvd")]) == 0
    reader, frames = vtk.vtkXMLPolyDataReader(), Frames(run)
    reader.SetFileName(str(run / "body_frames" / "000003.vtp"))
    reader.Update()
    body, mesh = reader.GetOutput(), frames.mesh
    if mesh.dim == 1:
        assert body.GetNumberOfLines() == len(mesh.cells)
        return
    shown = mesh.cells if mesh.dim == 2 else mesh.faces
    corners = vtk_to_numpy(body.GetPolys().GetConnectivityArray()).reshape(-1, shown.shape[1])
    assert np.array_equal(np.sort(corners, axis=1), np.sort(shown, axis=1))
    points = vtk_to_numpy(body.GetPoints().GetData()).astype(float)[corners]
    middle = points.mean(axis=1, keepdims=True)
    areas = (
        np.linalg.norm(np.cross(points - middle, np.roll(points, -1, axis=1) - middle).sum(axis=1), axis=1) / 2.0
    )
    position = frames[3].field("position")
    moved = mesh.with_nodes(position)
    expected = moved.cell_volumes() if mesh.dim == 2 else moved.face_areas()
    np.testing.assert_allclose(areas, expected, rtol=1e-4)


def test_a_run_is_repeated_from_what_it_left(run):
    again = run.parent / "again"
    assert main(["run", str(run / "scene.toml"), "--quiet", "--device", "cpu", "--out", str(again)]) == 0
    assert (again / "history.csv").read_bytes() == (run / "history.csv").read_bytes()


@pytest.mark.parametrize("cells", ["lattice", "triangles"])
def test_frames_of_a_body_with_steps_are_read(cells, tmp_path):
    """Their faces are on no side of the lattice."""
    (tmp_path / "disc.py").write_text(
        "from tests.test_any_cells import SOFT\nfrom warpsph import *\n"
        "def scene(p):\n"
        f"    return Scene(shape=Disc(1.0, 0.25, cells={cells!r}), material=SOFT,\n"
        "        duration=1e-3, numerics=p.numerics)\n"
        "NUMERICS = {'velocity_scheme': 'cells'}\n"
    )
    arguments = ["run", str(tmp_path / "disc.py"), "--quiet", "--device", "cpu", "--out", str(tmp_path / "run")]
    assert main([*arguments, "--frames", "2"]) == 0
    assert (Frames(tmp_path / "run").mesh.face_side == NO_SIDE).any()
