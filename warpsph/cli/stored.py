"""The scene of a run as `scene.toml` beside its results, and a scene file like any other when read back.

The TOML holds the whole scene as data (see `warpsph.scene.document`), with two tables more: `[run]`, how it was
run, and `[code]`, where the scene came from. Beside it stand `scene.npz`, its arrays if it has any, and
`scene_file.py`, a copy of the scene file for what is code: checks, and probes of the user's own.
"""

from __future__ import annotations

import contextlib
import hashlib
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
from ..scene.registry import needs_code
from ..scene.scene import Scene
from ..storage.files import write_text, write_whole
from ..storage.names import name
from ..storage.reading import check_array, file_digest, read_arrays, read_toml, reading
from ..validate import flag, instance
from .catalogue import SceneFile, load, load_file
from .run_folder import ARRAYS, COPY, SCENE
from .settings import Settings

CODE = ("file", "folder", "parameters", "sha256", "checks", "registers")
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
        return name("name", self.document.get("name", self.path.stem))

    def run_settings(self, folder: Path, usd: str | None = None) -> Settings:
        """How it was run; see `Settings.read`."""
        table = instance("run", self.document.get("run", {}), Mapping, "a table")
        return Settings.read({key: value for key, value in table.items() if key != "warpsph"}, folder, usd)

    @property
    def _code(self) -> Mapping:
        table = instance("code", self.document.get("code", {}), Mapping, "a table")
        for key, value in table.items():
            if key not in CODE:
                raise SceneError(f"code.{key}", value, one_of(CODE, key))
        return table

    @cached_property
    def _file(self) -> Path | None:
        """The scene file it came from, which lies beside the data and is the one that was run; None without."""
        code = self._code
        if not code:
            return None
        file = instance("code.file", code.get("file"), str, "the name of a scene file beside the data")
        path = self.path.parent / file
        if Path(file).name != file or path.resolve().parent != self.path.parent.resolve() or not path.is_file():
            raise SceneError("code.file", file, f"it must be the name of a scene file beside {self.path}")
        if "sha256" not in code:
            raise SceneError("code.file", file, "its sha256 must be given as well, of the file as it is to be run")
        if file_digest(path) != code["sha256"]:
            raise SceneError("code.file", str(path), "it has changed since the run; its checks and probes count")
        return path

    @property
    def _neighbours(self) -> Path:
        return self.path.parent / instance("code.folder", self._code.get("folder", "."), str, "a folder")

    @property
    def origin(self) -> tuple[Path, Path, bool] | None:
        """The scene file, the folder of the modules it may import, and whether it has checks; None without one."""
        checks = bool(self._code.get("checks"))
        return (self._file, self._neighbours.resolve(), checks) if self._file else None

    @cached_property
    def source(self) -> SceneFile | None:
        """The scene file it came from, which is executed now; None when the data is all there is."""
        return load_file(self._file, name=self.name, neighbours=self._neighbours) if self._file else None

    @property
    def _given(self) -> Mapping[str, object]:
        return instance("code.parameters", self._code.get("parameters", {}), Mapping, "a table")

    def build(self, settings: Sequence[str]) -> tuple[Scene, dict[str, object]]:
        """The scene, and the values of its parameters; code runs only where the scene refers to it.

        Raises:
            SceneError: something in it is not allowed.
        """
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
                values = assign(self.source.parameters, [f"{k}={v}" for k, v in self._given.items()])
                built.append(self.source.build_from(values))
            return built[0]

        flag("code.checks", self._code.get("checks", False))
        if flag("code.registers", self._code.get("registers", False)):
            _ = self.source  # a material, a kernel or a scheme of its own, by name
        _ = self._file  # refused although it may not be needed
        try:
            scene = decode(document | {"name": self.name}, self._arrays(), code)
        except RecursionError:
            raise SceneError("scene", str(self.path), "it is nested too deep") from None
        return scene, {name: None if value == "auto" else value for name, value in self._given.items()}

    def _arrays(self) -> dict[str, np.ndarray]:
        path = self.path.with_suffix(".npz")
        if not path.exists():
            return {}
        arrays = read_arrays("scene", path, "it is damaged ({error})")
        with reading("scene", path, "it is damaged ({error})"):
            return {name: check_array(name, values, kind="biuf") for name, values in arrays.items()}

    def checks(self, run: SimpleNamespace) -> list[Check]:
        """The checks of a finished run, where the data say that its scene file has some."""
        return self.source.checks(run) if self._code.get("checks") and self.source else []

    def errors_located(self) -> contextlib.AbstractContextManager:
        """Turns what the scene file's functions raise into a `SceneError`."""
        return self.source.errors_located() if "source" in vars(self) and self.source else contextlib.nullcontext()


def open_scene(name: str) -> SceneFile | StoredScene:
    """A shipped scene by name, a scene file or a stored scene by path.

    Raises:
        SceneError: there is no such scene, or it can not be read.
    """
    path = Path(name)
    return StoredScene(path, read_toml("scene", path)) if path.suffix == ".toml" else load(name)


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
    document["run"] = replace(settings, usd=None).table(folder) | {"warpsph": __version__}
    if file.origin is not None:
        path, neighbours, checks = file.origin
        content = path.read_bytes()
        write_whole(folder / COPY, lambda out: out.write(content))
        document["code"] = {
            "file": COPY,
            "folder": str(neighbours),
            "sha256": hashlib.sha256(content).hexdigest(),
            "checks": checks,
            "registers": needs_code(scene),
            "parameters": {name: "auto" if value is None else value for name, value in values.items()},
        }
    if arrays:
        write_whole(folder / ARRAYS, lambda out: np.savez(out, **arrays))
    else:
        (folder / ARRAYS).unlink(missing_ok=True)
    write_text(folder / SCENE, NOTE.format(path=folder / SCENE) + tomli_w.dumps(document))
