"""Reading back what a run has left: what is not as it should be is one line, whatever bytes are there."""

from __future__ import annotations

import contextlib
import hashlib
import json
import stat
import sys
import warnings
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from ..errors import DamagedError, SceneError, WarpSPHError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

LONGEST = 300  # letters, of what an error may say


@contextlib.contextmanager
def reading(kind: str, path: Path, damaged: str = "it can not be read ({error})") -> Iterator[None]:
    """Turn all that damaged bytes may raise into one line that names the file; libraries warn of nothing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except WarpSPHError:
        raise
    except FileNotFoundError:
        raise SceneError(kind, str(path), "there is no such file") from None
    except MemoryError:
        raise DamagedError(kind, str(path), damaged.format(error="it is too large for the memory")) from None
    except Exception as error:  # reading damaged bytes may raise anything
        what = str(error) or type(error).__name__  # it may quote what was read, of any length
        what = what if len(what) <= LONGEST else f"{what[:LONGEST]}…"
        raise DamagedError(kind, str(path), damaged.format(error=what)) from None


def require(true: bool, what: str) -> None:
    """Refuse, inside of `reading`, what is not so; `what` says what is wrong."""
    if not true:
        raise ValueError(what)


def read_json(kind: str, path: Path) -> dict:
    """A JSON file that holds one object.

    Raises:
        SceneError: it is not there, or damaged.
    """
    with reading(kind, path):
        content = json.loads(_bytes(path), parse_constant=_no_number)
        require(isinstance(content, dict), "it must hold a JSON object")
        return content


def read_toml(kind: str, path: Path) -> dict:
    """A TOML file.

    Raises:
        SceneError: it is not there, or damaged.
    """
    with reading(kind, path, "it must be a readable TOML file ({error})"):
        try:
            return tomllib.loads(_bytes(path).decode("utf-8"))
        except RecursionError:
            raise ValueError("it is nested too deep") from None


def read_arrays(kind: str, path: Path, damaged: str = "it can not be read ({error})") -> dict[str, np.ndarray]:
    """The arrays of a NumPy archive as we write them: plain numbers, not compressed, every byte checked.

    So it can not take more memory than the file has bytes.

    Raises:
        SceneError: it is not there, or damaged.
    """
    with reading(kind, path, damaged):
        require(stat.S_ISREG(path.stat().st_mode), "it is no file")
        size = path.stat().st_size
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            require(len({member.filename for member in members}) == len(members), "a name comes twice")
            for member in members:
                plain = member.compress_type == zipfile.ZIP_STORED and not member.flag_bits & 0x1
                require(plain and member.file_size <= size, f"{member.filename} is not as it was written")
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    for name, values in arrays.items():
        with reading(kind, path, damaged):
            require(isinstance(values, np.ndarray) and _plain(values.dtype), f"{name} holds no numbers")
    return arrays


def _plain(dtype: np.dtype) -> bool:
    kinds = [dtype] if dtype.fields is None else [part[0].base for part in dtype.fields.values()]
    return all(kind.kind in "biuf" and kind.itemsize <= 8 for kind in kinds)


def check_array(
    name: str,
    values: np.ndarray,
    *,
    kind: str = "f",
    shape: tuple[int | None, ...] | None = None,
    finite: bool = True,
) -> np.ndarray:
    """Refuse, inside of `reading`, an array of another kind or shape, or one that is not finite; returns it.

    Args:
        name: for the message.
        values: the array.
        kind: letters of NumPy's kinds of types that are allowed.
        shape: its shape, None where any length will do.
        finite: whether all values must be.
    """
    require(values.dtype.kind in kind, f"{name} is of type {values.dtype}")
    if shape is not None:
        right = len(shape) == values.ndim and all(b in (None, a) for a, b in zip(values.shape, shape, strict=True))
        require(right, f"{name} has shape {values.shape}")
    require(not finite or bool(np.isfinite(values).all()), f"{name} is not finite everywhere")
    return values


def check_indices(name: str, values: np.ndarray, below: int) -> np.ndarray:
    """Refuse, inside of `reading`, what does not count from 0 to below a number; returns it."""
    require(values.dtype.kind in "iu", f"{name} is of type {values.dtype}")
    require(not values.size or (values.min() >= 0 and values.max() < below), f"{name} leads out of its table")
    return values


def digest(arrays: Mapping[str, np.ndarray]) -> str:
    """SHA-256 of arrays with their names, types and shapes, as hexadecimal digits."""
    found = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        found.update(f"{name} {values.dtype.descr} {arrays[name].shape};".encode())
        found.update(values.reshape(-1).view(np.uint8).data if values.size else b"")
    return found.hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file as hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def checked(kind: str, path: Path, content: Mapping, rules: Mapping[str, Callable[[object], bool]]) -> Mapping:
    """Content of a file, when it has the entries that the rules name and each rule is true of its own.

    Raises:
        SceneError: an entry is missing or of another form.
    """
    for key, rule in rules.items():
        with reading(kind, path, "its entry " + key.replace("{", "{{") + " is not as it was written ({error})"):
            require(key in content, "it is missing")
            require(rule(content[key]), f"it is {str(content[key])[:60]!r}")
    return content


def _bytes(path: Path) -> bytes:
    require(stat.S_ISREG(path.stat().st_mode), "it is no file")
    return path.read_bytes()


def _no_number(text: str) -> None:
    raise ValueError(f"{text} is no number")
