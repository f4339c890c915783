"""The folder of a run: what is in it, and that nothing of a former run is touched unless that was asked for."""

from __future__ import annotations

import shlex
from pathlib import Path, PurePosixPath

from ..errors import SceneError
from ..export import frame_files
from ..simulation.checkpoint import CHECKPOINT
from ..storage.files import remove_parts
from ..storage.owner import marked

SUMMARY, HISTORY, OVERVIEW = "summary.json", "history.csv", "overview.png"
PICTURES = ("history.png", "energy.png", "field.png", "surface.png")
HISTORY_PICTURE, ENERGY_PICTURE, FIELD_PICTURE, SURFACE_PICTURE = PICTURES
SCENE, ARRAYS, COPY = STORED = ("scene.toml", "scene.npz", "scene_file.py")
RESULTS = (SUMMARY, *PICTURES, OVERVIEW)  # of a run that has ended


def check_free(folder: Path, overwrite: bool, scene: Path | None = None) -> None:
    """Refuse a folder that holds a former run, or files of the user's by the names of a run's.

    Args:
        folder: the folder; it need not be there.
        overwrite: whether the former run may go.
        scene: a stored scene that is run, which may lie in this folder itself.

    Raises:
        SceneError: it does.
    """
    there = _names(folder, scene)
    if there and not marked(folder):
        allowed = f"it holds {there[0]}, which no run has written there; choose another name"
        raise SceneError("--out", str(folder), allowed)
    if there and not overwrite:
        allowed = (
            f"it holds a run: go on with it by --resume {shlex.quote(str(folder))}, write over it by --overwrite, "
            "or choose another name"
        )
        raise SceneError("--out", str(folder), allowed)


def remove_run(folder: Path, scene: Path | None = None) -> None:
    """Remove a former run, file by file, by their names; for `scene` see `check_free`."""
    for name in _names(folder, scene):
        if name != frame_files.FOLDER:
            (folder / name).unlink(missing_ok=True)
    frame_files.clear(folder)
    remove_parts(folder)


def remove_results(folder: Path) -> None:
    """Remove what says how a run has ended, before it goes on."""
    for name in RESULTS:
        (folder / name).unlink(missing_ok=True)
    remove_parts(folder)


def _names(folder: Path, scene: Path | None) -> list[str]:
    stored = () if scene is not None and scene.resolve() == (folder / SCENE).resolve() else STORED
    names = (*RESULTS, HISTORY, CHECKPOINT, *stored)
    there = [name for name in names if (folder / name).is_file()]
    return there + ([frame_files.FOLDER] if (folder / frame_files.FOLDER / frame_files.ABOUT).exists() else [])


def stage_inside(folder: Path, text: str) -> str:
    """The path of a stage that the data of a run name: a place in the run's own folder.

    Raises:
        SceneError: it leads out of it; only a user may say so.
    """
    path = PurePosixPath(text)
    if path.is_absolute() or ".." in path.parts or not path.name:
        allowed = "the stage stands outside of the run's folder: name it again with --usd FILE"
        raise SceneError("--usd", text, allowed)
    return str(folder / path)


def stage_in_data(folder: Path, text: str) -> str:
    """The same path as it goes into the data of a run: relative to its folder where it is inside."""
    path, inside = Path(text).resolve(), folder.resolve()
    return path.relative_to(inside).as_posix() if path.is_relative_to(inside) else str(path)


def resume_command(folder: Path, usd: str | None) -> str:
    """The command that goes on with a run."""
    outside = usd is not None and not Path(usd).resolve().is_relative_to(folder.resolve())
    stage = f" --usd {shlex.quote(usd)}" if outside else ""
    return f"warpsph run --resume {shlex.quote(str(folder))}{stage}"
