"""Everything a stepper holds that its steps may change.

It is found by looking through the stepper and its parts, so that there is no list of names in which a new array
could be forgotten.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import is_dataclass
from typing import NamedTuple

import numpy as np
import warp as wp

from ..device.launching import Launcher
from ..remaking.triangulation import Triangulation
from ..storage.reading import check_indices, require

PACKAGE = __package__.partition(".")[0]
COUNTS = ("builds", "made", "refused")  # whole numbers that a run changes


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

    Nothing is put back unless all of it fits: kernels do not look whether an index leads out of its array.

    Raises:
        ValueError: the names differ, or a value is of another type, shape or range than it can have.
    """
    seats, own = _seats(root), numbers(root)
    require(seats.keys() == saved.keys(), f"other arrays: {_some(seats.keys() ^ saved.keys())}")
    require(own.keys() == values.keys(), f"other numbers: {_some(own.keys() ^ values.keys())}")
    for path, number in own.items():
        _check_number(path, number, values[path])
    for path, holding in seats.items():
        _check(path, holding, saved[path])
    _check_lists(root, saved, seats)
    for path, holding in seats.items():
        array, new = holding[0].value, saved[path]
        if new.shape[: array.ndim] == array.shape:  # NumPy's has the components of vectors as well
            array.assign(new)
        else:
            replacement = wp.array(new, dtype=array.dtype, device=array.device)
            for slot in holding:
                slot.put(replacement)
    for slot in slots(root):
        if slot.path in values:
            slot.put(values[slot.path])


def _some(names: Iterable[str]) -> str:
    return ", ".join(sorted(names)[:5])


def _check_number(path: str, now: float | int | bool, new: object) -> None:
    """Refuse a number that can not take the place of the one that is there: lengths of arrays stay as they are."""
    right = type(new) is type(now) and math.isfinite(new)
    if type(now) is int and path.rpartition(".")[2] not in COUNTS:
        right = right and new == now
    require(right, f"{path} is {new!r}")


def _check(path: str, holding: list[Slot], new: np.ndarray) -> None:
    """Refuse an array that can not take the place of the one that is there."""
    now = holding[0].value.numpy()
    grows = any(_is_list(slot.holder) for slot in holding) and new.ndim == 1  # it takes more neighbours
    counts = any(hasattr(slot.holder, "_sources") for slot in holding)  # made anew with every list
    require(new.dtype == now.dtype, f"{path} is of type {new.dtype}")
    require(grows or new.shape == now.shape, f"{path} has shape {new.shape}")
    for part in [new] if new.dtype.names is None else [new[name] for name in new.dtype.names]:
        require(part.dtype.kind != "f" or bool(np.isfinite(part).all()), f"{path} is not finite everywhere")
    # What kernels find their way by is in the scene's tables, or from the start more than a flag.
    if (
        new.dtype.kind in "iu"
        and not grows
        and not counts
        and new.size
        and (np.ptp(now) > 1 or _in_table(holding))
    ):
        low, high = min(now.min(), 0), max(now.max(), 1)
        require(low <= new.min() and new.max() <= high, f"{path} leads out of its table")


def _is_list(holder: object) -> bool:
    return {"start", "index"} <= vars(holder).keys()


def _in_table(holding: list[Slot]) -> bool:
    kinds = {kind.__name__ for slot in holding for kind in type(slot.holder).__mro__}
    return "StructInstance" in kinds  # of Warp: what kernels are given


def _check_lists(root: object, saved: Mapping[str, np.ndarray], seats: Mapping[str, list[Slot]]) -> None:
    """Refuse pair lists that lead beyond their ends, or to points that are not there."""
    path_of = {id(slot.value): path for path, holding in seats.items() for slot in holding}
    for slot in slots(root):
        sources = getattr(slot.holder, "_sources", None)
        if sources is None or not hasattr(slot.value, "__dict__") or not _is_list(slot.value):
            continue
        start, index = (saved[path_of[id(array)]] for array in (slot.value.start, slot.value.index))
        right = start.shape == slot.value.start.shape and not start[0] and (np.diff(start) >= 0).all()
        require(bool(right and start[-1] <= len(index)), f"{slot.path} leads out of its list")
        check_indices(slot.path, index[: start[-1]], sources.point.shape[0])


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
    """Whether it is an object of this package with attributes, structs of arrays included.

    No types and no scene; nor what launches kernels, which belongs to the process and not to the state, nor a
    triangulation, which is taken from the cells there are.
    """
    if isinstance(value, type | Launcher | Triangulation) or not hasattr(value, "__dict__"):
        return False
    modules = [kind.__module__ for kind in type(value).__mro__]
    return any(m.partition(".")[0] == PACKAGE and not m.startswith(f"{PACKAGE}.scene") for m in modules)


def _frozen(value: object) -> bool:
    return is_dataclass(value) and type(value).__dataclass_params__.frozen
