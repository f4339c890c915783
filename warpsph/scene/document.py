"""Scenes as data: tables, lists, texts and numbers that can stand in a TOML file, and back to the same scene.

A part is a table with the `type` of its class and the fields of its constructor. What code has made, a mapped
lattice, a `where`, an initial field, is stored as the values it gave: `{values = NAME}` refers to an array beside
the document. What stays code, a probe or a function of time of the user's own, is `{code = PATH}`, its place in
the scene that the scene file builds. Written by hand, `on = "left"` is short for `edge("left")`, an initial field
may be a list of numbers, and `"free"` stands for a velocity component that nobody prescribes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache

import numpy as np

from ..errors import SceneError, one_of
from ..validate import FunctionOfTime, choice
from .condition import Condition, EdgeCondition
from .free_surface import FreeSurface
from .functions import Linear, Pulse, Ramp, Table
from .interface import Interface
from .load import Load
from .numerics import Numerics
from .output import EdgeForce, NodeValue, Output, Probe, Reaction, ToolForce, ToolImpulse, ToolTorque
from .registry import MATERIALS
from .remade import Remade
from .scene import BodyForce, Scene
from .selection import Selection, chosen, edge, where
from .shape import Mapped, Placed, Shape
from .tool import Tool

FREE = "free"
SELECTIONS = ("on", "first", "second", "inner")  # fields in which a text is the name of an edge
TABLES = ("tags",)  # fields that hold a table of values by names of the user's
# Fields that hold one class only need no `type`.
PLAIN = {
    "body_force": BodyForce,
    "cells": Remade,
    "free_surface": FreeSurface,
    "numerics": Numerics,
    "output": Output,
    "probes": Probe,
}
INITIAL_FIELDS = ("velocity", "stress")


@dataclass(frozen=True, eq=False)
class InitialField:
    """An initial field by its values: one part a component, each a number or an array of one value a node."""

    parts: tuple

    def __call__(self, *position: np.ndarray) -> tuple:
        return self.parts


def encode(scene: Scene) -> tuple[dict, dict[str, np.ndarray]]:
    """The scene as a document, and the arrays it refers to, by name."""
    arrays: dict[str, np.ndarray] = {}
    document = {}
    for entry in fields(scene):
        value = getattr(scene, entry.name)
        if entry.name in INITIAL_FIELDS and value is not None:
            document[entry.name] = _encode_field(getattr(scene, f"initial_{entry.name}"), entry.name, arrays)
        elif value is not None:
            document[entry.name] = _encode(value, entry.name, scene, arrays)
    return document, arrays


def _encode_field(values: np.ndarray, name: str, arrays: dict) -> object:
    if (values == values[0]).all():
        return values[0].tolist()
    arrays[name] = values
    return {"values": name}


def _encode(value: object, path: str, scene: Scene, arrays: dict) -> object:
    if value is None:
        return FREE
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, tuple | list):
        return [_encode(part, f"{path}.{k}", scene, arrays) for k, part in enumerate(value)]
    if isinstance(value, Mapping) and path.rpartition(".")[2] in TABLES:
        return {name: _encode(part, f"{path}.{k}", scene, arrays) for k, (name, part) in enumerate(value.items())}
    if isinstance(value, FunctionOfTime):
        value = value.function
    if isinstance(value, Mapped):
        value = Placed(value.shape, value.mesh().nodes)
    if isinstance(value, where):
        value = chosen(np.flatnonzero(value.nodes(scene.mesh)))
    if isinstance(value, edge):
        return value.name
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return {"values": path}
    if not _is_known(type(value)):
        return {"code": path}
    plain = type(value) in PLAIN.values()
    table = {} if plain else {"type": type(value).__name__}
    for entry in fields(value):
        part = getattr(value, entry.name)
        if part is not None:
            table[entry.name] = _encode(part, f"{path}.{entry.name}", scene, arrays)
    return table


def decode(
    document: Mapping, arrays: Mapping[str, np.ndarray] | None = None, code: Callable[[str], Scene] | None = None
) -> Scene:
    """The scene of a document.

    Args:
        document: as `encode` makes it, or as someone has written it.
        arrays: those it refers to, by name.
        code: (place) → the scene that the scene file builds, for what is code at that place.

    Raises:
        SceneError: something in it is not allowed; the message names the place or the field.
    """
    _check_names(Scene, document, "scene")
    reader = _Reader({} if arrays is None else arrays, code)
    given = {name: reader.field(name, value) for name, value in document.items()}
    return _construct(Scene, given, "scene")


class _Reader:
    def __init__(self, arrays, code):
        self._arrays, self._code = arrays, code

    def field(self, name: str, value: object) -> object:
        """A field of the scene itself."""
        if name not in INITIAL_FIELDS:
            return self.value(value, name)
        values = self.value(value, name)
        if not isinstance(values, np.ndarray | tuple):
            raise SceneError(name, value, "it must be a list of numbers, one a component, or {values = NAME}")
        return InitialField(tuple(values.T if isinstance(values, np.ndarray) else values))

    def value(self, value: object, path: str) -> object:
        """A value at a place."""
        last = path.rpartition(".")[2]
        if isinstance(value, Mapping) and last in TABLES:
            return {name: self.value(part, f"{path}.{k}") for k, (name, part) in enumerate(value.items())}
        if isinstance(value, Mapping):
            return self._table(value, path)
        if isinstance(value, list | tuple):
            return tuple(self.value(part, f"{path}.{k}") for k, part in enumerate(value))
        if last in SELECTIONS and isinstance(value, str):
            return edge(value)
        return None if value == FREE and last.isdecimal() else value

    def _table(self, table: Mapping, path: str) -> object:
        names = path.split(".")
        if "values" in table and "type" not in table:
            return self._arrays[choice(f"{path}.values", table["values"], self._arrays)]
        if "code" in table:
            if self._code is None:
                raise SceneError(path, table["code"], "it is code of a scene file, which this scene does not name")
            return _follow(self._code(path), str(table["code"]))
        plain = PLAIN.get(next(name for name in reversed(names) if not name.isdecimal()))
        kind = plain or types()[choice(f"{path}.type", table.get("type"), types())]
        given = {
            name: self.value(part, f"{path}.{name}") for name, part in table.items() if plain or name != "type"
        }
        return _construct(kind, given, path)


def _check_names(kind: type, given: Mapping, path: str) -> None:
    """Refuse a table with an entry that is no field of its class."""
    names = [entry.name for entry in fields(kind)]
    for name, value in given.items():
        if name not in names:
            raise SceneError(f"{path}.{name}", value, one_of(names, name))


def _construct(kind: type, given: Mapping, path: str) -> object:
    _check_names(kind, given, path)
    try:
        return kind(**given)
    except TypeError as error:  # a field without a default is missing
        raise SceneError(path, dict(given), f"{kind.__name__}: {error}") from None


def _follow(scene: object, path: str) -> object:
    value = scene
    for name in path.split("."):
        try:
            value = value[int(name)] if name.isdecimal() else getattr(value, name)
        except (AttributeError, IndexError, TypeError):
            raise SceneError("code", path, "the scene file's scene has no such part") from None
    return value


def types() -> dict[str, type]:
    """The classes a document may name: the package's own parts, and the materials that are registered."""
    return MATERIALS | _parts()


def _is_known(kind: type) -> bool:
    """Whether a document may name a class; also one that the same code has replaced since, read again."""
    known = types().get(kind.__name__)
    return known is not None and (known.__module__, known.__qualname__) == (kind.__module__, kind.__qualname__)


@cache
def _parts() -> dict[str, type]:
    found = [Linear, Ramp, Pulse, Table, NodeValue, EdgeForce, Reaction]
    found += [ToolForce, ToolImpulse, ToolTorque, *PLAIN.values()]
    waiting = [Shape, Condition, Selection, Tool, Interface]
    while waiting:
        kind = waiting.pop()
        waiting += kind.__subclasses__()
        own = kind.__module__.partition(".")[0] == __package__.partition(".")[0]
        if (
            own
            and is_dataclass(kind)
            and kind not in (Condition, EdgeCondition, Load, Mapped, where, Tool, Interface)
        ):
            found.append(kind)
    return {kind.__name__: kind for kind in found}
