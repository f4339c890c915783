"""Everything a stepper holds that its steps may change.

It is found by looking through the stepper and its parts, so that there is no list of names in which a new array
could be forgotten.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass
from typing import NamedTuple

import numpy as np
import warp as wp

PACKAGE = __package__.partition(".")[0]


class Slot(NamedTuple):
    """An attribute, called `name`, of `holder`; `path` leads there."""

    path: str
    holder: object
    name: str

    @property
    def value(self) -> object:
        """What it holds."""
        return getattr(self.holder, self.name)

    def put(self, value: object) -> None:
        """Make it hold something else."""
        setattr(self.holder, self.name, value)


def arrays(root: object) -> dict[str, np.ndarray]:
    """Copies of all Warp arrays in an object and its parts, by the path that leads there; shared ones once."""
    return {path: seats[0].value.numpy().copy() for path, seats in _seats(root).items()}


def numbers(root: object) -> dict[str, float | int | bool]:
    """All numbers in an object and its parts, by path; those of frozen dataclasses never change."""
    return {
        slot.path: slot.value
        for slot in slots(root)
        if isinstance(slot.value, bool | int | float) and not _frozen(slot.holder)
    }


def restore(root: object, saved: Mapping[str, np.ndarray], values: Mapping[str, float]) -> None:
    """Put back what `arrays` and `numbers` of an equal object gave.

    Values go into the arrays that are there, since kernels may hold them. A list that had grown gets a new array.

    Raises:
        KeyError: the names differ.
    """
    seats, own = _seats(root), numbers(root)
    if seats.keys() != saved.keys() or own.keys() != values.keys():
        raise KeyError(*sorted((seats.keys() ^ saved.keys()) | (own.keys() ^ values.keys())))
    for path, holding in seats.items():
        array, new = holding[0].value, saved[path]
        if new.shape[: array.ndim] == array.shape:
            array.assign(new)
        else:
            replacement = wp.array(new, dtype=array.dtype, device=array.device)
            for slot in holding:
                slot.put(replacement)
    for slot in slots(root):
        if slot.path in values:
            slot.put(values[slot.path])


def _seats(root: object) -> dict[str, list[Slot]]:
    """The attributes that hold each array, by the path of the first."""
    shared: dict[int, list[Slot]] = {}
    for slot in slots(root):
        if isinstance(slot.value, wp.array):
            shared.setdefault(id(slot.value), []).append(slot)
    return {seats[0].path: seats for seats in shared.values()}


def slots(root: object) -> Iterator[Slot]:
    """Every attribute of an object and, recursively, of those of its attributes that are parts of this package."""
    seen: set[int] = set()
    waiting = deque([("", root)])  # breadth first: the shortest path names an array
    while waiting:
        path, holder = waiting.popleft()
        if id(holder) in seen:
            continue
        seen.add(id(holder))
        for name, value in vars(holder).items():
            own = f"{path}.{name}".lstrip(".")
            yield Slot(own, holder, name)
            inner = value if isinstance(value, list | tuple) else [value]
            if isinstance(value, dict):
                inner = list(value.values())
            for k, part in enumerate(inner):
                if isinstance(part, wp.array) and part is not value:
                    raise TypeError(f"{own}: keep arrays in attributes, where a checkpoint finds them")
                if _is_part(part):
                    waiting.append((own if part is value else f"{own}.{k}", part))


def _is_part(value: object) -> bool:
    """Whether it is an object of this package with attributes, structs of arrays included; no types, no scene."""
    if isinstance(value, type) or not hasattr(value, "__dict__"):
        return False
    modules = [kind.__module__ for kind in type(value).__mro__]
    return any(m.partition(".")[0] == PACKAGE and not m.startswith(f"{PACKAGE}.scene") for m in modules)


def _frozen(value: object) -> bool:
    return is_dataclass(value) and type(value).__dataclass_params__.frozen
