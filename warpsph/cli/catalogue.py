"""Finds and loads scene files: the shipped examples and the user's own.

A scene file defines

    PARAMETERS = (Parameter("spacing", 0.1, "m", "distance between nodes"), …)
    NUMERICS = {"courant": 1.0}          # optional: its defaults of the numerical parameters
    def scene(p): return Scene(…, numerics=p.numerics)
    def checks(run): return [Check(…), …]   # optional; run has .simulation, .history, .scene, .parameters

and the first line of its docstring describes it.
"""

from __future__ import annotations

import importlib.util
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType, SimpleNamespace

from ..errors import SceneError, one_of
from ..scene.check import Check
from ..scene.parameter import Parameter, assign, namespace, numerical_parameters
from ..scene.scene import Scene

PACKAGE = Path(__file__).resolve().parent.parent


def examples_folder() -> Path:
    """The shipped scenes: inside an installed package, beside the package in a checkout."""
    installed = PACKAGE / "examples"
    return installed if installed.is_dir() else PACKAGE.parent / "examples"


def shipped() -> dict[str, Path]:
    """Name → file of the shipped scenes."""
    return {path.stem: path for path in sorted(examples_folder().glob("*.py")) if path.stem[0] != "_"}


@dataclass(frozen=True)
class SceneFile:
    """A loaded scene file."""

    name: str
    module: ModuleType

    @property
    def description(self) -> str:
        """The first line of its docstring."""
        return (self.module.__doc__ or "").strip().split("\n")[0]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its own parameters, then the numerical ones every scene takes."""
        own = tuple(getattr(self.module, "PARAMETERS", ()))
        return own + numerical_parameters(getattr(self.module, "NUMERICS", {}))

    def build(self, settings: Sequence[str]) -> tuple[Scene, dict[str, object]]:
        """The scene with `name=value` settings applied, and the values of its parameters."""
        values = assign(self.parameters, settings)
        scene = _call(self, "scene", namespace(values))
        if not isinstance(scene, Scene):
            raise SceneError(f"{self.name}.scene(p)", scene, "it must return a Scene")
        object.__setattr__(scene, "name", self.name)
        return scene, values

    def checks(self, run: SimpleNamespace) -> list[Check]:
        """The checks of a finished run."""
        return list(_call(self, "checks", run)) if hasattr(self.module, "checks") else []


def load(name: str) -> SceneFile:
    """A shipped scene by name, or a user's file by path.

    Raises:
        SceneError: there is no such scene, or the file can not be loaded.
    """
    scenes = shipped()
    path = scenes.get(name, Path(name))
    if not path.is_file():
        raise SceneError("scene", name, f"{one_of(scenes, name)}, or the path of a scene file")
    spec = importlib.util.spec_from_file_location(f"warpsph_scene_{path.stem}", path)
    if spec is None:
        raise SceneError("scene", name, "the file's name must end in .py")
    module = importlib.util.module_from_spec(spec)
    file = SceneFile(path.stem, module)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # a user's file may raise anything
        raise _located(path, error) from error
    if not callable(getattr(module, "scene", None)):
        raise SceneError("scene", str(path), "the file must define a function scene(p)")
    return file


def _call(file: SceneFile, function: str, argument):
    try:
        return getattr(file.module, function)(argument)
    except SceneError:
        raise
    except Exception as error:  # a user's file may raise anything
        raise _located(Path(file.module.__file__), error) from error


def _located(path: Path, error: Exception) -> SceneError:
    """The error with the last line of the scene file it passed through."""
    if isinstance(error, SceneError):
        return error
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == path]
    if isinstance(error, SyntaxError):
        lines = [error.lineno]
    where = f", line {lines[-1]}" if lines else ""
    return SceneError("scene", str(path), f"the file raised {type(error).__name__}{where}: {error}")
