"""A run for ParaView: VTK point data, one `.vtp` a frame, and a `.pvd` that gives their times.

Nodes are points; between them the cells of a plane body, the surface of a solid or the line of a bar. Written by
VTK itself, an optional extra.
"""

from __future__ import annotations

import contextlib
import errno
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh
from ..storage.files import whole
from ..storage.owner import empty, holds_only, mark
from .frames import Frame, Frames
from .vectors import in_space

try:
    from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkIOXML
    from vtkmodules.util import numpy_support
except ImportError:
    raise SceneError("FILE", ".pvd", "ParaView files need VTK: pip install vtk") from None

# Stored components in VTK's order of a symmetric tensor.
TENSOR = {(0, 0): 0, (1, 1): 1, (2, 2): 2, (0, 1): 3, (1, 2): 4, (0, 2): 5}
FRAME = re.compile(r"\d{6}\.vtp")
COMPONENTS = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")


def write_series(frames: Frames, path: Path) -> None:
    """Write `NAME.pvd` and, in `NAME_frames/`, a `.vtp` a frame.

    The frames are made beside those of a former export, then take their place; a `.pvd` that stands at any moment
    stands with all its frames.

    Raises:
        SceneError: a folder `NAME_frames` is there that holds what no export has written.
    """
    folder = path.with_name(f"{path.stem}_frames")
    if not holds_only(folder, FRAME):
        raise SceneError("FILE", str(path), f"{folder} holds what no export has written; choose another name")
    fresh = path.with_name(f".{folder.name}.new")
    empty(fresh, FRAME)
    try:
        _write_series(frames, path, folder, fresh)
    finally:
        empty(fresh, FRAME)  # where it has not taken its place


def _write_series(frames: Frames, path: Path, folder: Path, fresh: Path) -> None:
    mark(fresh)
    root = ElementTree.Element("VTKFile", type="Collection", version="1.0", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    for frame in frames:
        file = fresh / f"{frame.number:06d}.vtp"
        _write(_body(frame, frames.fields), file)
        part = {"timestep": repr(frame.time), "part": "0", "file": f"{folder.name}/{file.name}"}
        ElementTree.SubElement(collection, "DataSet", part)
    ElementTree.indent(root)
    with whole(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
        path.unlink(missing_ok=True)
        empty(folder, FRAME)
        fresh.rename(folder)


def _body(frame: Frame, fields: tuple[str, ...]):
    body, points = vtkCommonDataModel.vtkPolyData(), vtkCommonCore.vtkPoints()
    points.SetData(numpy_support.numpy_to_vtk(in_space(frame.field("position")), deep=True))
    body.SetPoints(points)
    body.SetVerts(_cells(np.arange(len(frame.mesh.nodes))[:, None]))
    if frame.mesh.dim == 1:
        body.SetLines(_cells(frame.present_mesh.cells))
    else:
        body.SetPolys(_cells(_polygons(frame.present_mesh)))
    for name in fields:
        if name != "position":
            body.GetPointData().AddArray(_array(name, frame.field(name), frame.mesh))
    return body


def _polygons(mesh: Mesh) -> np.ndarray:
    """Corners in turn of what can be seen: the cells of a plane body, the faces of a solid."""
    return mesh.cells[:, mesh.kind.drawn] if mesh.dim == 2 else mesh.faces[:, mesh.kind.face_kind.drawn]


def _cells(corners: np.ndarray):
    """VTK cells of equal size from the indices of their corners (k, corners)."""
    cells, (count, size) = vtkCommonDataModel.vtkCellArray(), corners.shape
    offsets = np.arange(count + 1, dtype=np.int64) * size
    connectivity = np.ascontiguousarray(corners, dtype=np.int64).ravel()
    cells.SetData(
        numpy_support.numpy_to_vtkIdTypeArray(offsets, deep=True),
        numpy_support.numpy_to_vtkIdTypeArray(connectivity, deep=True),
    )
    return cells


def _array(name: str, values: np.ndarray, mesh: Mesh):
    """A field (n, …) as a VTK array: vectors with three components, tensors symmetric with six."""
    tensor, shown, names = mesh.continuum.pairs, np.asarray(values, dtype=np.float32), ()
    if name in ("stress", "strain"):
        shown, names = np.zeros((len(values), 6), dtype=np.float32), COMPONENTS
        shown[:, [TENSOR[pair] for pair in tensor]] = values
    elif values.ndim == 2:
        shown = in_space(values).astype(np.float32)
    elif values.ndim == 3:
        shown = shown.reshape(len(values), -1)
    array = numpy_support.numpy_to_vtk(np.ascontiguousarray(shown), deep=True)
    array.SetName(name)
    for k, part in enumerate(names):
        array.SetComponentName(k, part)
    return array


@contextlib.contextmanager
def _silent(part) -> Iterator[None]:
    """VTK says nothing of its own meanwhile, in several lines as it does: what fails is an error of ours."""
    shown = part.GetGlobalWarningDisplay()
    part.SetGlobalWarningDisplay(False)
    try:
        yield
    finally:
        part.SetGlobalWarningDisplay(shown)


def _write(body, path: Path) -> None:
    writer = vtkIOXML.vtkXMLPolyDataWriter()
    with whole(path) as temporary:
        writer.SetFileName(str(temporary))
        writer.SetInputData(body)
        with _silent(writer):
            written = writer.Write() and not writer.GetErrorCode()
        if not written:
            raise OSError(errno.EIO, "VTK can not write it", str(path))
