"""The scene of a run as `scene.toml` beside its results, and a scene file like any other when read back.

The TOML holds the whole scene as data (see `warpsph.scene.document`), with two tables more: `[run]`, how it was
run, and `[code]`, where the scene came from. Beside it stand `scene.npz`, its arrays if it has any, and
`scene_file.py`, a copy of the scene file for what is code: checks, and probes of the user's own.
"""

from __future__ import annotations

import contextlib
import hashlib
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import tomli_w

from .. import __version__
from ..errors import SceneError, one_of
from ..scene.check import Check
from ..scene.document import decode, encode
from ..scene.parameter import assign
from ..scene.scene import Scene
from ..storage.files import write_whole
from ..validate import instance
from .catalogue import SceneFile, load, load_file
from .settings import Settings

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SCENE, COPY = "scene.toml", "scene_file.py"
CODE = ("file", "folder", "parameters", "sha256")
NOTE = "# Repeat this run with: warpsph run {path}\n\n"


@dataclass(frozen=True)
class StoredScene:
    """A scene that stands as data in a TOML file; to the command line what a `SceneFile` is.

    Attributes:
        path: the TOML file.
        document: its content.
    """

    path: Path
    document: Mapping

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.document.get("name", self.path.stem)

    @property
    def settings(self) -> Settings:
        """How it was run."""
        table = instance("run", self.document.get("run", {}), Mapping, "a table")
        return Settings.read({name: value for name, value in table.items() if name != "warpsph"})

    @property
    def _code(self) -> Mapping:
        table = instance("code", self.document.get("code", {}), Mapping, "a table")
        for key, value in table.items():
            if key not in CODE:
                raise SceneError(f"code.{key}", value, one_of(CODE, key))
        return table

    @cached_property
    def source(self) -> SceneFile | None:
        """The scene file it came from; None when the data is all there is.

        Raises:
            SceneError: the file is gone or is no longer the one that was run.
        """
        code = self._code
        if not code:
            return None
        path = self.path.parent / str(code.get("file"))
        if not path.is_file():
            raise SceneError("code.file", code.get("file"), f"it must be a scene file beside {self.path}")
        if "sha256" in code and _sha256(path) != code["sha256"]:
            raise SceneError("code.file", str(path), "it has changed since the run; its checks and probes count")
        folder = Path(instance("code.folder", code.get("folder", "."), str, "a folder"))
        return load_file(path, name=self.name, neighbours=self.path.parent / folder)

    @cached_property
    def _values(self) -> dict[str, object]:
        given = self._code.get("parameters", {})
        given = instance("code.parameters", given, Mapping, "a table")
        return assign(self.source.parameters, [f"{k}={v}" for k, v in given.items()]) if self.source else {}

    def build(self, settings: Sequence[str]) -> tuple[Scene, dict[str, object]]:
        """The scene, and the values of the parameters it was made with."""
        if settings:
            raise SceneError(
                "--set", settings[0], "a stored scene has no parameters: edit it, or run the scene file"
            )
        document = {name: value for name, value in self.document.items() if name not in ("run", "code")}
        built: list[Scene] = []

        def code(place: str) -> Scene:
            if self.source is None:
                raise SceneError(place, "code", "the file names no scene file in [code]")
            if not built:
                built.append(self.source.build_from(self._values))
            return built[0]

        document, arrays = document | {"name": self.name}, self._arrays()
        try:
            return decode(document, arrays, code), self._values
        except SceneError:
            if self.source is None:
                raise
        return decode(document, arrays, code), self._values  # the scene file, read now, may register what it names

    def _arrays(self) -> dict[str, np.ndarray]:
        path = self.path.with_suffix(".npz")
        if not path.is_file():
            return {}
        try:
            with np.load(path, allow_pickle=False) as file:
                return {name: file[name] for name in file.files}
        except Exception as error:  # reading damaged bytes may raise anything
            raise SceneError("scene", str(path), f"it is damaged ({error})") from None

    def checks(self, run: SimpleNamespace) -> list[Check]:
        """The checks of a finished run, if there is a scene file."""
        return self.source.checks(run) if self.source else []

    def errors_located(self) -> contextlib.AbstractContextManager:
        """Turns what the scene file's functions raise into a `SceneError`."""
        return self.source.errors_located() if self.source else contextlib.nullcontext()


def open_scene(name: str) -> SceneFile | StoredScene:
    """A shipped scene by name, a scene file or a stored scene by path.

    Raises:
        SceneError: there is no such scene, or it can not be read.
    """
    path = Path(name)
    if path.suffix != ".toml":
        return load(name)
    try:
        return StoredScene(path, read_toml(path))
    except (OSError, ValueError) as error:
        raise SceneError("scene", name, f"it must be a readable TOML file ({error})") from None


def read_toml(path: Path) -> dict:
    """A TOML file as a dictionary; `OSError` or `ValueError` when it can not be read."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def store(
    folder: Path, file: SceneFile | StoredScene, scene: Scene, values: Mapping[str, object], settings: Settings
) -> None:
    """Write `scene.toml` and what belongs to it into a folder.

    Args:
        folder: the run's.
        file: where the scene came from.
        scene: the scene.
        values: of its parameters.
        settings: how it is run; the USD file is left out, which a repetition would overwrite.
    """
    if isinstance(file, StoredScene) and file.path.resolve() == (folder / SCENE).resolve():
        return  # it may be written by hand
    document, arrays = encode(scene)
    document["run"] = replace(settings, usd=None).table() | {"warpsph": __version__}
    source = file.source if isinstance(file, StoredScene) else file
    if source is not None:
        path = Path(source.module.__file__)
        if isinstance(file, StoredScene):
            neighbours = (file.path.parent / file.document["code"].get("folder", ".")).resolve()
        else:
            neighbours = path.parent
        content = path.read_bytes()
        write_whole(folder / COPY, lambda out: out.write(content))
        document["code"] = {
            "file": COPY,
            "folder": str(neighbours),
            "sha256": hashlib.sha256(content).hexdigest(),
            "parameters": {name: "auto" if value is None else value for name, value in values.items()},
        }
    if arrays:
        write_whole(folder / "scene.npz", lambda out: np.savez(out, **arrays))
    else:
        (folder / "scene.npz").unlink(missing_ok=True)
    text = NOTE.format(path=folder / SCENE) + tomli_w.dumps(document)
    write_whole(folder / SCENE, lambda out: out.write(text.encode("utf-8")))


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
