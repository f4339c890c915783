"""ParaView files, read back by VTK."""

import sys
from xml.etree import ElementTree

import numpy as np
import pytest

from warpsph import Box, Elastic, PrescribedVelocity, Scene, Simulation, edge
from warpsph.cli.main import main
from warpsph.frames import Frames, FrameWriter, evenly

pytestmark = pytest.mark.usefixtures("undrawn")

# Stress components in VTK's order XX, YY, ZZ, XY, YZ, XZ; one number each that can not be mistaken.
STRESS = {1: (1.0,), 2: (1.0, 2.0, 12.0, 3.0), 3: (1.0, 2.0, 3.0, 12.0, 13.0, 23.0)}
IN_VTK = {1: (1, 0, 0, 0, 0, 0), 2: (1, 2, 3, 12, 0, 0), 3: (1, 2, 3, 12, 23, 13)}


@pytest.fixture(params=[1, 2, 3])
def run(request, tmp_path):
    """Folder of a run of a stressed body, whose first frame has that stress."""
    dim = request.param
    scene = Scene(
        shape=Box((0.4, 0.3, 0.2)[:dim], 0.1),
        material=Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0),
        conditions=[PrescribedVelocity(edge("left"), (-1.0, None, None)[:dim])],
        stress=lambda x, *rest: STRESS[dim],
        duration=2e-3,
    )
    simulation = Simulation(scene, device="cpu")
    simulation.run(observers=[FrameWriter(simulation, evenly(2e-3, 4), tmp_path)])
    return tmp_path


def read(path):
    vtk = pytest.importorskip("vtkmodules.vtkIOXML", reason="VTK is not installed (extra vtk)")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    body = reader.GetOutput()
    data = body.GetPointData()
    arrays = {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
    return body, vtk_to_numpy(body.GetPoints().GetData()), arrays


def test_series_holds_the_frames_at_their_times(run):
    pytest.importorskip("vtkmodules", reason="VTK is not installed (extra vtk)")
    assert main(["export", str(run), str(run / "body.pvd")]) == 0
    sets = ElementTree.parse(run / "body.pvd").getroot().findall("Collection/DataSet")
    frames = Frames(run)
    assert [float(part.get("timestep")) for part in sets] == [frame.time for frame in frames]
    mesh = frames.mesh
    for part, frame in zip(sets, frames, strict=True):
        body, points, arrays = read(run / part.get("file"))
        count = len(mesh.nodes)
        np.testing.assert_allclose(points[:, : mesh.dim], frame.field("position"), atol=1e-12)
        assert not points[:, mesh.dim :].any() and body.GetNumberOfVerts() == count
        assert set(arrays) == set(frames.fields) - {"position"}
        for name, array in arrays.items():
            expected = np.asarray(frame.field(name), dtype=np.float32)
            if name in ("stress", "strain"):
                assert array.shape == (count, 6)
            elif expected.ndim == 2:
                np.testing.assert_array_equal(array, np.pad(expected, ((0, 0), (0, 3 - mesh.dim))))
            else:
                np.testing.assert_array_equal(array, expected)
        assert body.GetNumberOfLines() == (len(mesh.cells) if mesh.dim == 1 else 0)
        assert body.GetNumberOfPolys() == {1: 0, 2: len(mesh.cells), 3: len(mesh.faces)}[mesh.dim]
        assert _area(body, points) == pytest.approx(_expected_area(frame))


def _area(body, points):
    """Area of the polygons, wound the right way round; a bow tie would have none."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    corners = vtk_to_numpy(body.GetPolys().GetConnectivityArray()).reshape(-1, 4)
    diagonals = np.cross(
        points[corners[:, 2]] - points[corners[:, 0]], points[corners[:, 3]] - points[corners[:, 1]]
    )
    return 0.5 * np.linalg.norm(diagonals, axis=1).sum()


def _expected_area(frame):
    position, mesh = frame.field("position"), frame.mesh
    if mesh.dim == 1:
        return 0.0
    if mesh.dim == 2:
        return mesh.with_nodes(position).cell_volumes().sum()
    faces = position[mesh.faces]
    return 0.5 * np.linalg.norm(np.cross(faces[:, 3] - faces[:, 0], faces[:, 2] - faces[:, 1]), axis=1).sum()


def test_tensors_are_in_vtk_s_order(run):
    pytest.importorskip("vtkmodules", reason="VTK is not installed (extra vtk)")
    assert main(["export", str(run), str(run / "body.pvd")]) == 0
    body, points, arrays = read(run / "body_frames" / "000000.vtp")
    dim = Frames(run).mesh.dim
    inside = np.all((points[:, :dim] > 0.05) & (points[:, :dim] < np.array([0.35, 0.25, 0.15])[:dim]), axis=1)
    np.testing.assert_array_equal(arrays["stress"][inside], np.tile(IN_VTK[dim], (inside.sum(), 1)))
    array = body.GetPointData().GetArray("stress")
    assert [array.GetComponentName(k) for k in range(6)] == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]


@pytest.mark.parametrize("run", [1], indirect=True)
def test_missing_vtk_is_said_in_one_line(run, monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "warpsph.export.paraview", raising=False)
    monkeypatch.setitem(sys.modules, "vtkmodules", None)
    assert main(["export", str(run), str(run / "body.pvd")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (run / "body.pvd").exists()
