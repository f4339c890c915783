"""Checks a USD stage of a run: `python tools/check_usd.py FILE [--run DIR]`.

UsdValidation, then what it does not see: lengths of all arrays, finite numbers, extents, time codes; with `--run`
also points, velocities and times against the frames of the run's folder. Says what is wrong, a line each.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

TIGHT = 1e-5  # of the extent's size


def faults(path: Path, run: Path | None = None) -> list[str]:
    """What is wrong with a stage; against the frames of a run's folder as well when that is given."""
    try:
        stage = Usd.Stage.Open(str(path))
    except Exception as error:  # USD raises its own class
        return [f"it can not be opened: {' '.join(str(error).split())}"]
    found = [*_validated(stage), *_metadata(stage)]
    codes = sorted({code for prim in _shapes(stage) for code in _codes(prim)})
    if not codes:
        return [*found, "it has no time samples"]
    if (stage.GetStartTimeCode(), stage.GetEndTimeCode()) != (codes[0], codes[-1]):
        found.append(f"time samples from {codes[0]:g} to {codes[-1]:g}, but the stage says otherwise")
    for prim in _shapes(stage):
        own = _codes(prim)
        if own not in ([], codes):
            found.append(f"{prim.GetPath()}: {len(own)} time codes, others have {len(codes)}")
        for code in own or [Usd.TimeCode.Default()]:
            found += [f"{prim.GetPath()} at {code}: {fault}" for fault in _shape(prim, code)]
    return [*found, *(_against(stage, codes, run) if run and stage.GetDefaultPrim() else ())]


def _validated(stage: Usd.Stage) -> Iterator[str]:
    try:
        from pxr import UsdValidation
    except ImportError:
        print("this usd-core has no UsdValidation; the other checks are made", file=sys.stderr)
        return
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    for error in context.Validate(stage):
        yield f"UsdValidation: {error.GetErrorAsString()}"


def _metadata(stage: Usd.Stage) -> Iterator[str]:
    if not stage.GetDefaultPrim():
        yield "it has no defaultPrim"
    for name in ("upAxis", "metersPerUnit", "timeCodesPerSecond", "startTimeCode", "endTimeCode"):
        if not stage.HasAuthoredMetadata(name):
            yield f"it has no {name}"


def _shapes(stage: Usd.Stage) -> list[Usd.Prim]:
    return [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.PointBased)]


def _codes(prim: Usd.Prim) -> list[float]:
    return UsdGeom.PointBased(prim).GetPointsAttr().GetTimeSamples()


def _shape(prim: Usd.Prim, code) -> Iterator[str]:
    points = UsdGeom.PointBased(prim).GetPointsAttr().Get(code)
    if points is None or not len(points):
        yield "no points"
        return
    count = len(points)
    lengths = {"points": count}
    for attribute in prim.GetAuthoredAttributes():
        value = attribute.Get(code)
        if value is None:
            yield f"{attribute.GetName()} has no value"
        elif attribute.GetTypeName().isArray:
            array = np.array(value)
            lengths[attribute.GetName()] = len(array)
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                yield f"{attribute.GetName()} is not finite"
    per_point = ["velocities", "ids"] if prim.IsA(UsdGeom.Points) else ["velocities"]
    for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvars():
        if primvar.GetInterpolation() == UsdGeom.Tokens.vertex:
            per_point.append(primvar.GetAttr().GetName())
    for name in per_point:
        if lengths.get(name, count) != count:
            yield f"{name} has {lengths[name]} values for {count} points"
    if prim.IsA(UsdGeom.Mesh):
        counts = np.array(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(code))
        corners = np.array(UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr().Get(code))
        if counts.sum() != len(corners) or corners.min() < 0 or corners.max() >= count:
            yield "its faces do not fit its points"
    yield from _extent(prim, code)


def _extent(prim: Usd.Prim, code) -> Iterator[str]:
    extent = UsdGeom.Boundable(prim).GetExtentAttr().Get(code)
    if extent is None or len(extent) != 2:
        yield "no extent"
        return
    points, widths = np.array(UsdGeom.PointBased(prim).GetPointsAttr().Get(code)), [0.0]
    if prim.IsA(UsdGeom.Points):
        widths = UsdGeom.Points(prim).GetWidthsAttr().Get(code) or [0.0]
    radius = 0.5 * max(widths)
    exact = np.array([points.min(axis=0) - radius, points.max(axis=0) + radius])
    if np.abs(np.array(extent) - exact).max() > TIGHT * np.ptp(exact, axis=0).max():
        yield f"extent {np.array(extent).tolist()} is not that of its points, {exact.tolist()}"


def _against(stage: Usd.Stage, codes: list[float], run: Path) -> Iterator[str]:
    from warpsph.frames import Frames

    frames = Frames(run)
    root = stage.GetDefaultPrim()
    nodes = UsdGeom.Points(root.GetChild("MaterialNodes"))
    if codes != frames.codes:
        yield f"{len(codes)} time codes {codes[0]:g}…{codes[-1]:g}, the run has {len(frames)} frames"
    for number in frames.numbers:
        frame, code = frames.read(number), frames.code(number)
        if code not in codes:
            continue
        if root.GetAttribute("warpsph:time").Get(code) != frame.time:
            yield f"the time at {code:g} is not {frame.time} s"
        for name, attribute in (("position", nodes.GetPointsAttr()), ("velocity", nodes.GetVelocitiesAttr())):
            expected = frame.field(name).astype(np.float32)
            value = attribute.Get(code)
            given = np.array(value if value is not None else [])
            if given.shape != (len(expected), 3) or (given[:, : expected.shape[1]] != expected).any():
                yield f"{name} at {code:g} is not the run's"


def main() -> int:
    """Check the file the command line names; 0 when it is whole, else 1."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--run", type=Path, help="folder of the run it was made from")
    options = parser.parse_args()
    found = faults(options.file, options.run)
    for fault in found:
        print(f"{options.file}: {fault}")
    if not found:
        stage = Usd.Stage.Open(str(options.file))
        print(f"{options.file}: whole, time codes {stage.GetStartTimeCode():g} to {stage.GetEndTimeCode():g}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
