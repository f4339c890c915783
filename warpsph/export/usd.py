"""A run as one USD stage, for usdview, Omniverse, Blender and Houdini.

    /Run                    Xform; warpsph:time is the exact simulated time of each frame [s]
    /Run/MaterialNodes      Points, coloured by one field, with stress, strain and flags as primvars
    /Run/AuxiliaryNodes     Points in the middle of the cells, hidden at first
    /Run/Walls/…            a Mesh for what holds or moves the body's edge
    /Run/Tools/…            a Mesh for every rigid tool

Metres and seconds: one second of the time line is one second of the run. Bars and plane strain lie in the xy plane
of a y-up stage, solids stand in a z-up one, so that down is down: no coordinate is changed.
"""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, UsdUtils, Vt

from .. import __version__
from ..simulation.fields import component_names
from ..storage.files import whole
from .colours import Colouring, whole_span
from .frames import Frame, Frames
from .quantity import quantity
from .vectors import in_space
from .walls import WallMesh

ROOT, MATERIAL, AUXILIARY = "/Run", "/Run/MaterialNodes", "/Run/AuxiliaryNodes"
WALLS, TOOLS = "/Run/Walls", "/Run/Tools"
NO_PRIMVARS = ("position", "displacement", "velocity", "density")  # in the points, or in nobody's way
FLAGS = ("free_surface",)
PLAYBACK = 24.0  # [frames/s], of players that show every frame
WALL_COLOUR = Gf.Vec3f(0.18, 0.18, 0.2)
AT_ONCE = 8  # frames kept in memory before they go to the file


def write_stage(frames: Frames, path: Path, colouring: Colouring | None = None) -> None:
    """Write all frames into one stage; the file is whole or, if this dies, still the former one."""
    if colouring is None:
        shown = quantity(None, frames)
        colouring = Colouring(shown, whole_span(shown, frames))
    with usd_errors(path), whole(path) as temporary:
        stage = Usd.Stage.CreateNew(str(temporary))
        drawing = Drawing(stage, frames, colouring)
        drawing.describe()
        for k, frame in enumerate(frames):
            drawing.add(frame)
            if path.suffix == ".usdc" and k % AT_ONCE == AT_ONCE - 1:
                stage.Save()  # appends: what is in the file leaves the memory
        drawing.span_time(frames.codes)
        stage.Save()
        check_written(temporary)


@contextlib.contextmanager
def usd_errors(path: Path) -> Iterator[None]:
    """Turn USD's errors into an `OSError`, of a file that can not be written; it says nothing of its own."""
    listener = UsdUtils.CoalescingDiagnosticDelegate()  # takes the warnings, which would go to standard error
    try:
        yield
    except Tf.ErrorException as error:
        raise OSError(errno.EIO, " ".join(str(error).split())[:300], str(path)) from None
    finally:
        del listener


def check_written(path: Path) -> None:
    """Refuse a file that the disk has not taken as a whole: USD does not always say so."""
    if Sdf.Layer.OpenAsAnonymous(str(path)) is None:
        raise OSError(errno.EIO, "it is not as it was written", str(path))


class Drawing:
    """The prims of a run on a stage.

    Args:
        stage: the stage.
        frames: what is drawn; its lattice and walls are, its frames only when they are added.
        colouring: the colours of the nodes.
    """

    def __init__(self, stage: Usd.Stage, frames: Frames, colouring: Colouring):
        self._stage, self._frames, self._colouring = stage, frames, colouring
        self._root = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
        self._time = self._root.CreateAttribute("warpsph:time", Sdf.ValueTypeNames.Double)
        self._nodes = NodePoints(stage, MATERIAL, frames.mesh.spacing)
        self._cells = NodePoints(stage, AUXILIARY, 0.5 * frames.mesh.spacing)
        self._fields = [name for name in frames.fields if name not in NO_PRIMVARS]
        for name in self._fields:
            self._nodes.declare(name, component_names(name, frames.mesh.continuum))
        UsdGeom.Scope.Define(stage, WALLS)
        self._walls = [
            (
                WallMesh.of(frames.mesh, wall),
                UsdGeom.Mesh.Define(stage, f"{WALLS}/{wall.name}"),
            )
            for wall in frames.walls
        ]
        if frames.tools:
            UsdGeom.Scope.Define(stage, TOOLS)
        self._tools = [UsdGeom.Mesh.Define(stage, f"{TOOLS}/{tool.name}") for tool in frames.tools]

    def describe(self) -> None:
        """Write what does not change: the stage's units and axes, ids, widths, topology."""
        stage, mesh, colouring = self._stage, self._frames.mesh, self._colouring
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z if mesh.dim == 3 else UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetDefaultPrim(self._root)
        stage.SetTimeCodesPerSecond(self._frames.rate)
        stage.SetFramesPerSecond(PLAYBACK)
        stage.GetRootLayer().customLayerData = {
            "warpsph": {
                "version": __version__,
                "scene": self._frames.about["scene"],
                "colour": colouring.quantity.label,
                "colourMap": colouring.map,
                "colourRange": Gf.Vec2d(*colouring.span),
            }
        }
        Usd.ModelAPI(self._root).SetKind(Kind.Tokens.component)
        self._nodes.describe(len(mesh.nodes))
        self._cells.describe(0 if self._frames.about["remade"] else len(mesh.cells))
        UsdGeom.Imageable(self._cells.prim).CreateVisibilityAttr(UsdGeom.Tokens.invisible)
        for built, prim in self._walls:
            _set_topology(prim, built.polygons)
            if built.wall.still:
                self._set_wall(built, prim, mesh.nodes, Usd.TimeCode.Default())
        for tool, prim in zip(self._frames.tools, self._tools, strict=True):
            _set_topology(prim, tool.polygons)

    def add(self, frame: Frame) -> None:
        """Write a frame at its time code."""
        code, mesh = Usd.TimeCode(self._frames.code(frame.number)), frame.present_mesh
        self._time.Set(frame.time, code)
        position, velocity = frame.field("position"), frame.field("velocity")
        values = self._colouring.quantity(frame)
        self._nodes.set(position, velocity, self._colouring.linear(values), code)
        for name in self._fields:
            self._nodes.set_field(name, frame.field(name), code)
        mean = [mesh.at_centres(field) for field in (position, velocity, values)]
        if self._frames.about["remade"]:
            self._cells.number(len(mesh.cells), code)
        self._cells.set(*mean[:2], self._colouring.linear(mean[2]), code)
        for built, prim in self._walls:
            if not built.wall.still:
                self._set_wall(built, prim, position, code)
        for tool, prim in zip(frame.tools, self._tools, strict=True):
            _set_points(prim, tool.points, code)

    def span_time(self, codes: Sequence[float]) -> None:
        """Say from where to where the time line goes."""
        if len(codes):
            self._stage.SetStartTimeCode(codes[0])
            self._stage.SetEndTimeCode(codes[-1])

    def _set_wall(self, built: WallMesh, prim: UsdGeom.Mesh, position: np.ndarray, code: Usd.TimeCode) -> None:
        _set_points(prim, built.points(position), code)


def _set_topology(prim: UsdGeom.Mesh, polygons: np.ndarray) -> None:
    sizes = np.full(len(polygons), polygons.shape[1], dtype=np.int32)
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(sizes))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(polygons.astype(np.int32).ravel()))
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateDoubleSidedAttr(True)
    prim.CreateDisplayColorPrimvar(UsdGeom.Tokens.constant).Set(Vt.Vec3fArray([WALL_COLOUR]))


def _set_points(prim: UsdGeom.Mesh, points: np.ndarray, code: Usd.TimeCode) -> None:
    single = points.astype(np.float32)
    prim.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(single), code)
    prim.CreateExtentAttr().Set(_extent(single, 0.0), code)


class NodePoints:
    """Nodes as `UsdGeom.Points`.

    Args:
        stage: the stage.
        path: of the prim.
        width: diameter of a node [m].
    """

    def __init__(self, stage: Usd.Stage, path: str, width: float):
        self._points, self._width = UsdGeom.Points.Define(stage, path), float(np.float32(width))
        self.prim = self._points.GetPrim()
        self._colour = self._points.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
        self._primvars: dict[str, list[UsdGeom.Primvar]] = {}

    def describe(self, count: int) -> None:
        """Write ids and the width; no ids, 0, where there are more and less."""
        if count:
            self.number(count, Usd.TimeCode.Default())
        self._points.CreateWidthsAttr(Vt.FloatArray([self._width]))
        self._points.SetWidthsInterpolation(UsdGeom.Tokens.constant)

    def number(self, count: int, code: Usd.TimeCode) -> None:
        """Write ids."""
        self._points.CreateIdsAttr().Set(Vt.Int64Array.FromNumpy(np.arange(count, dtype=np.int64)), code)

    def set(self, position: np.ndarray, velocity: np.ndarray, colour: np.ndarray, code: Usd.TimeCode) -> None:
        """Write positions [m], velocities [m/s], both (n, d), and colours (n, 3) of a frame."""
        points = _single(position)
        self._points.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), code)
        self._points.CreateVelocitiesAttr().Set(Vt.Vec3fArray.FromNumpy(_single(velocity)), code)
        self._points.CreateExtentAttr().Set(_extent(points, 0.5 * self._width), code)
        self._colour.Set(Vt.Vec3fArray.FromNumpy(colour), code)

    def declare(self, name: str, components: tuple[str, ...]) -> None:
        """Make the primvars of a field, one a component: whole numbers for flags, float for all others."""
        kind = Sdf.ValueTypeNames.IntArray if name in FLAGS else Sdf.ValueTypeNames.FloatArray
        names = [f"{name}_{part}" for part in components] or [name]
        primvars = UsdGeom.PrimvarsAPI(self.prim)
        self._primvars[name] = [primvars.CreatePrimvar(full, kind, UsdGeom.Tokens.vertex) for full in names]

    def set_field(self, name: str, values: np.ndarray, code: Usd.TimeCode) -> None:
        """Write a declared field (n, …) of a frame."""
        array, number = (Vt.IntArray, np.int32) if name in FLAGS else (Vt.FloatArray, np.float32)
        columns = values.reshape(len(values), -1).astype(number).T
        for primvar, column in zip(self._primvars[name], columns, strict=True):
            primvar.Set(array.FromNumpy(np.ascontiguousarray(column)), code)


def _single(vectors: np.ndarray) -> np.ndarray:
    return in_space(vectors).astype(np.float32)


def _extent(points: np.ndarray, radius: float) -> Vt.Vec3fArray:
    columns = np.ascontiguousarray(points.T)
    return Vt.Vec3fArray.FromNumpy(
        np.stack([columns.min(axis=1) - radius, columns.max(axis=1) + radius]).astype(np.float32)
    )
