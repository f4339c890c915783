"""Finds and loads scene files: the shipped examples and the user's own.

A scene file defines

    PARAMETERS = (Parameter("spacing", 0.1, "m", "distance between nodes"), …)
    NUMERICS = {"courant": 1.0}          # optional: its defaults of the numerical parameters
    SHORT = ("duration=5",)              # optional: settings of a short form, for what takes minutes
    def scene(p): return Scene(…, numerics=p.numerics)
    def checks(run): return [Check(…), …]   # optional; run has .simulation, .history, .scene, .parameters

and the first line of its docstring describes it.
"""

from __future__ import annotations

import contextlib
import importlib.util
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

from ..errors import SceneError, WarpSPHError, one_of
from ..scene.check import Check
from ..scene.numerics import PUBLISHED
from ..scene.parameter import Parameter, assign, namespace, numerical_parameters
from ..scene.scene import Scene
from ..validate import choice, instance, listed
from .neighbours import Neighbours
from .settings import Settings

# What `numerics=NAME` stands for: numerical defaults instead of the scene's own.
NUMERICS: Mapping[str, Mapping[str, object]] = {"default": {}, "published": PUBLISHED}
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
    neighbours: Neighbours

    @property
    def origin(self) -> tuple[Path, Path, bool]:
        """The file, the folder of the modules it may import, and whether it has checks."""
        path = Path(self.module.__file__)
        return path, path.parent, hasattr(self.module, "checks")

    def run_settings(self, folder: Path, usd: str | None = None) -> Settings:
        """How it is run unless asked otherwise."""
        return Settings()

    @property
    def description(self) -> str:
        """The first line of its docstring."""
        return (self.module.__doc__ or "").strip().split("\n")[0]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its own parameters, then the numerical ones every scene takes."""
        return self._parameters(getattr(self.module, "NUMERICS", {}))

    def _parameters(self, numerics: Mapping[str, object]) -> tuple[Parameter, ...]:
        own = listed("PARAMETERS", getattr(self.module, "PARAMETERS", ()), Parameter, "a sequence of Parameter")
        parameters = own + numerical_parameters(numerics)
        names = ["numerics", *(parameter.name for parameter in parameters)]
        for name in names:
            if names.count(name) > 1:
                raise SceneError("PARAMETERS", name, "this name is taken")
        return parameters

    @property
    def short(self) -> tuple[str, ...]:
        """Settings `name=value` of its short form; none when the whole run is short."""
        return tuple(listed("SHORT", getattr(self.module, "SHORT", ()), str, "a sequence of name=value texts"))

    def build(self, settings: Sequence[str]) -> tuple[Scene, dict[str, object]]:
        """The scene with `name=value` settings applied, and the values of its parameters.

        `numerics=default` stands for the package's numerical defaults instead of the scene's own,
        `numerics=published` for those that Blanc and Pastor computed their cases with.
        """
        named = [text for text in settings if text.partition("=")[0].strip() == "numerics"]
        parameters = self.parameters
        for text in named:
            name = text.partition("=")[2].strip()
            parameters = self._parameters(NUMERICS[choice("numerics", name, NUMERICS)])
        values = assign(parameters, [text for text in settings if text not in named])
        return self.build_from(values), values

    def build_from(self, values: Mapping[str, object]) -> Scene:
        """The scene with these values of all parameters."""
        with self.errors_located():
            scene = self.module.scene(namespace(values))
            return replace(instance(f"{self.name}.scene(p)", scene, Scene, "a Scene"), name=self.name)

    def checks(self, run: SimpleNamespace) -> list[Check]:
        """The checks of a finished run."""
        if not hasattr(self.module, "checks"):
            return []
        with self.errors_located():
            checks = self.module.checks(run)
        return list(listed(f"{self.name}.checks(run)", checks, Check, "a sequence of Check"))

    @contextlib.contextmanager
    def errors_located(self) -> Iterator[None]:
        """For what calls functions of the file: they import as they did while it was loaded, and what they raise
        becomes a `SceneError` that names the line."""
        try:
            with self.neighbours.importable():
                yield
        except WarpSPHError:
            raise
        except (Exception, SystemExit) as error:  # a user's function may raise anything
            path = Path(self.module.__file__)
            if not _lines(path, error):
                raise
            raise _located(path, error) from error


def load(name: str) -> SceneFile:
    """A shipped scene by name, or a user's file by path.

    Raises:
        SceneError: there is no such scene, or the file can not be loaded.
    """
    scenes = shipped()
    path = scenes.get(name, Path(name).absolute())
    if not path.is_file():
        raise SceneError("scene", name, f"{one_of(scenes, name)}, or the path of a scene file")
    return load_file(path, name=path.stem, neighbours=path.parent)


def load_file(path: Path, *, name: str, neighbours: Path) -> SceneFile:
    """A scene file by path.

    Args:
        path: the file.
        name: of the scene.
        neighbours: folder of the modules it may import.

    Raises:
        SceneError: the file can not be loaded.
    """
    spec = importlib.util.spec_from_file_location(f"warpsph_scene_{name}", path)
    if spec is None:
        raise SceneError("scene", str(path), "the file's name must end in .py")
    module, own = importlib.util.module_from_spec(spec), Neighbours(neighbours)
    own.add(spec.name, module)  # dataclasses look their module up
    try:
        with own.importable():
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a user's file may raise anything
        raise _located(path, error) from error
    if not callable(getattr(module, "scene", None)):
        raise SceneError("scene", str(path), "the file must define a function scene(p)")
    return SceneFile(name, module, own)


def _located(path: Path, error: BaseException) -> SceneError:
    """The error with the last line of the scene file it passed through."""
    if isinstance(error, SceneError):
        return error
    lines = [error.lineno] if isinstance(error, SyntaxError) else _lines(path, error)
    where = f", line {lines[-1]}" if lines else ""
    return SceneError("scene", str(path), f"the file raised {type(error).__name__}{where}: {error}")


def _lines(path: Path, error: BaseException) -> list[int]:
    """The lines of the file that the error passed through."""
    return [f.lineno for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == path]
