"""What a function is, as far as its results depend on it: equal for equal code with equal values around it.

A run that goes on must record what it recorded before, and a probe may be any code. So its instructions count,
and the values that it takes from where it was made, those of the helpers it calls as well; what a function of
another package does counts by its name.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType, SimpleNamespace

import numpy as np


def identity(value: object) -> str:
    """SHA-256 of a function with all it is made of, as hexadecimal digits."""
    found = _Digest()
    found.add(value)
    return found.hexdigest()


class _Digest:
    def __init__(self):
        self._digest, self._seen = hashlib.sha256(), {}

    def hexdigest(self) -> str:
        return self._digest.hexdigest()

    def _put(self, *texts: object) -> None:
        for text in texts:
            data = text if isinstance(text, bytes) else str(text).encode("utf-8", "surrogatepass")
            self._digest.update(f"{len(data)}:".encode() + data)

    def add(self, value: object) -> None:
        """Take in a value and what it is made of, each object once."""
        if value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic):
            self._put(type(value).__name__, repr(value))
        elif id(value) in self._seen:
            self._put("again", self._seen[id(value)][0])
        else:
            self._seen[id(value)] = len(self._seen), value  # held, so that no other one gets its number
            self._part(value)

    def _part(self, value: object) -> None:
        if isinstance(value, np.ndarray):
            self._put("array", value.dtype.str, value.shape, np.ascontiguousarray(value).tobytes())
        elif isinstance(value, tuple | list):
            self._all("sequence", value)
        elif isinstance(value, set | frozenset):
            self._all("set", sorted(value, key=repr))
        elif isinstance(value, Mapping):
            self._all("mapping", [part for pair in value.items() for part in pair])
        elif isinstance(value, CodeType):
            constants = [part for part in value.co_consts if part is not None]
            self._put("code", value.co_code, value.co_names, value.co_varnames)
            self._all("constants", constants)
        elif isinstance(value, FunctionType):
            self._function(value)
        elif isinstance(value, MethodType):
            self._all("method", [value.__func__, value.__self__])
        elif isinstance(value, functools.partial):
            self._all("partial", [value.func, value.args, value.keywords])
        elif isinstance(value, type | ModuleType | BuiltinFunctionType):
            self._put("named", getattr(value, "__module__", ""), value.__name__)
        else:
            self._object(value)

    def _all(self, kind: str, parts) -> None:
        self._put(kind, len(parts))
        for part in parts:
            self.add(part)

    def _function(self, function: FunctionType) -> None:
        if function.__module__.partition(".")[0] == __package__.partition(".")[0]:
            self._put("ours", function.__module__, function.__qualname__)  # the version counts
            return
        cells = [cell.cell_contents for cell in function.__closure__ or () if _filled(cell)]
        around = [function.__globals__[name] for name in _names(function.__code__) if name in function.__globals__]
        same_file = [
            part
            for part in around
            if not isinstance(part, FunctionType | type) or part.__module__ == function.__module__
        ]
        self._all(
            "function", [function.__code__, function.__defaults__, function.__kwdefaults__, cells, same_file]
        )

    def _object(self, value: object) -> None:
        self._put("object", type(value).__module__, type(value).__qualname__)
        if is_dataclass(value):
            self._all("fields", [getattr(value, entry.name) for entry in fields(value)])
        elif isinstance(value, SimpleNamespace) or callable(value):
            self.add(getattr(value, "__dict__", {}))
        call = getattr(type(value), "__call__", None)  # noqa: B004
        if isinstance(call, FunctionType):
            self.add(call)


def _names(code: CodeType) -> list[str]:
    """Global names that code uses, functions inside of it included."""
    inner = [part for part in code.co_consts if isinstance(part, CodeType)]
    return [*code.co_names, *(name for part in inner for name in _names(part))]


def _filled(cell) -> bool:
    try:
        _ = cell.cell_contents
    except ValueError:  # of a name that has not been given a value yet
        return False
    return True
