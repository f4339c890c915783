"""The files of the frame store: written whole, checked as they are read, removed only where they are known.

frames/about.json     the scene's name, the times asked for, the walls, what is drawn
frames/body.npz       the initial lattice, the walls, the tools at the start
frames/000012.npz     time, step and the fields (float32) at the first step at or after the 12th time, tools
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ..mesh.continuum import CONTINUA
from ..mesh.kinds import KINDS
from ..mesh.mesh import ARRAYS, NO_SIDE, Mesh
from ..simulation.fields import FIELDS
from ..storage.files import remove_parts, whole
from ..storage.owner import marked
from ..storage.reading import check_array, check_indices, checked, read_arrays, read_json, reading, require

FOLDER, ABOUT, BODY = "frames", "about.json", "body.npz"
FRAME = re.compile(r"\d{6}\.npz")
ROUNDING = 1e-9


def read_about(run: Path) -> dict | None:
    """What `about.json` says; None where no frames were kept.

    Raises:
        SceneError: it can not be read, or there are frames and it is gone.
    """
    path = run / FOLDER / ABOUT
    if not path.exists():
        with reading("frames", path, "it is gone, and frames are there ({error})"):
            require(not frame_paths(run), "without it they can not be read")
        return None
    about = checked("frames", path, read_json("frames", path), RULES)
    with reading("frames", path):
        known = about["field"] in about["fields"] or about["field"] in FIELDS
        require(known, f"there is no field {about['field']!r}")
    return about


def _text(value: object) -> bool:
    return isinstance(value, str) and len(value) < 1000


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _name(value: object) -> bool:
    return isinstance(value, str) and re.fullmatch(r"[^\W\d]\w{0,99}", value) is not None


def _times(value: object) -> bool:
    return isinstance(value, list) and all(map(_number, value)) and bool((np.diff([0.0, *value]) >= 0.0).all())


def _pair(value: object, second: Callable[[object], bool]) -> bool:
    return value is None or (isinstance(value, list) and len(value) == 2 and _text(value[0]) and second(value[1]))


def _wall(value: object) -> bool:
    return isinstance(value, dict) and _name(value.get("name")) and isinstance(value.get("still"), bool)


RULES = {
    "scene": _text,
    "times": _times,
    "rate": lambda value: _number(value) and value > 0.0,
    "fields": lambda value: isinstance(value, dict) and all(_name(k) and _text(v) for k, v in value.items()),
    "field": _name,
    "component": lambda value: isinstance(value, int) and 0 <= value < 9,
    "curve": lambda value: _pair(value, _text),
    "curve_reference": lambda value: _pair(value, _number),
    "walls": lambda value: isinstance(value, list) and all(map(_wall, value)),
    "tools": lambda value: isinstance(value, list) and all(map(_name, value)),
    "remade": lambda value: isinstance(value, bool),
}


def read_body(run: Path, walls: int, tools: int) -> tuple[Mesh, list[np.ndarray], list[tuple]]:
    """The initial lattice, the faces of so many walls, and the points and polygons of so many tools.

    Raises:
        SceneError: it can not be read.
    """
    path = run / FOLDER / BODY
    arrays = read_arrays("frames", path)
    with reading("frames", path):
        parts = {name: arrays[name] for name in ARRAYS}
        spacing = float(check_array("spacing", parts["spacing"], shape=()))
        require(spacing > 0.0, "its spacing is not above 0")
        nodes, cells, faces = (parts[name] for name in ("nodes", "cells", "faces"))
        check_array("nodes", nodes, shape=(None, None))
        kind = KINDS[nodes.shape[1], check_array("cells", cells, kind="iu", shape=(None, None)).shape[1]]
        check_indices("cells", cells, len(nodes))
        corners = 1 if kind.dim == 1 else kind.face_kind.corners
        check_array("faces", faces, kind="iu", shape=(None, corners))
        check_indices("faces", faces, len(nodes))
        behind = check_array("face_cell", parts["face_cell"], kind="iu", shape=(len(faces),))
        check_indices("face_cell", behind, len(cells))
        sides = check_array("face_side", parts["face_side"], kind="i", shape=(len(faces),))
        check_indices("face_side", sides - NO_SIDE, 2 * kind.dim - NO_SIDE)
        require(len(cells) > 0, "it has no cells")
        held = [check_indices(f"wall_{k}", arrays[f"wall_{k}"], len(faces)) for k in range(walls)]
        require(all(wall.ndim == 1 and wall.size for wall in held), "a wall has no faces")
        mesh = Mesh(**parts | {"spacing": spacing})
        require(bool((mesh.middle_volumes() > 0.0).all()), "a cell has no volume")
        shapes = [(arrays[f"tool_{k}_points"], arrays[f"tool_{k}_polygons"]) for k in range(tools)]
        for k, (points, polygons) in enumerate(shapes):
            check_array(f"tool_{k}_points", points, shape=(None, 3))
            check_array(f"tool_{k}_polygons", polygons, kind="iu", shape=(None, 4))
            check_indices(f"tool_{k}_polygons", polygons, len(points))
    return mesh, held, shapes


def frame_paths(run: Path) -> list[Path]:
    """The frames' files in the order of time, also while a run goes on."""
    folder = run / FOLDER
    return sorted(path for path in folder.iterdir() if FRAME.fullmatch(path.name)) if folder.is_dir() else []


def frame_path(run: Path, number: int) -> Path:
    """The file of a frame."""
    return run / FOLDER / f"{number:06d}.npz"


def read_frame(path: Path, about: Mapping, mesh: Mesh) -> dict[str, np.ndarray]:
    """A frame's time, step and fields; `tools`, how far they have come, and `cells`, where they are made anew.

    Args:
        path: its file.
        about: what about.json says.
        mesh: what the fields belong to, to check their shapes.

    Raises:
        SceneError: it can not be read.
    """
    arrays = read_arrays("frame", path, "it can not be read ({error}); to do without it, remove it")
    with reading("frame", path, "it can not be read ({error}); to do without it, remove it"):
        tools = {"tools"} if about["tools"] else set()
        names = {"time", "step", *about["fields"]} | tools | ({"cells"} if about["remade"] else set())
        require(arrays.keys() == names, "it has other fields than about.json says")
        require(check_array("time", arrays["time"], shape=()) >= 0.0, "its time is below 0")
        require(check_array("step", arrays["step"], kind="iu", shape=()) >= 0, "its step is below 0")
        for name in about["fields"]:
            check_array(name, arrays[name], shape=_shape(name, mesh))
        if about["remade"]:
            cells = check_array("cells", arrays["cells"], kind="iu", shape=(None, mesh.kind.corners))
            check_indices("cells", cells, len(mesh.nodes))
            require(len(cells) > 0, "it has no cells")
        for name in tools:
            check_array(name, arrays[name], shape=(len(about["tools"]), mesh.dim))
    return arrays


def _shape(name: str, mesh: Mesh) -> tuple[int, ...]:
    """Shape of a field of the nodes."""
    sizes = {"n": len(mesh.nodes), "d": mesh.dim, "s": CONTINUA[mesh.dim].stress_size}
    letters = re.findall(r"[nds]", FIELDS[name].shape) if name in FIELDS else ["n"]
    return tuple(sizes[letter] for letter in letters)


def clear(run: Path) -> None:
    """Remove all frames of a run folder: by their names, in a folder that is ours by its mark or its about.json.

    Raises:
        SceneError: neither can be read; then nothing is removed.
    """
    folder, about = run / FOLDER, None if marked(run) else read_about(run)
    if not folder.is_dir() or (about is None and not marked(run)):
        return
    for path in (*frame_paths(run), folder / BODY, folder / ABOUT):  # the last one says that there are others
        path.unlink(missing_ok=True)
    remove_parts(folder)


def clear_after(run: Path, time: float) -> dict | None:
    """Remove the frames that are later than a time [s]; returns what about.json says, None without frames.

    Raises:
        SceneError: about.json or a frame can not be read; then nothing is removed.
    """
    about = read_about(run)
    if about is not None:
        for path, own in times_of_frames(run, about).items():
            if own > time * (1.0 + ROUNDING):
                path.unlink()
        remove_parts(run / FOLDER)
    return about


def times_of_frames(run: Path, about: Mapping) -> dict[Path, float]:
    """The time of every frame [s], by its file; all of each is read and checked.

    Raises:
        SceneError: one can not be read.
    """
    mesh, *_ = read_body(run, len(about["walls"]), len(about["tools"]))
    return {path: float(read_frame(path, about, mesh)["time"]) for path in frame_paths(run)}


def save_arrays(path: Path, arrays: Mapping[str, object]) -> None:
    """Write a NumPy archive, whole or not at all."""
    with whole(path) as temporary:
        np.savez(temporary, **arrays)
