"""Files that stand under their name whole or not at all, whatever happens while they are written."""

from __future__ import annotations

import contextlib
import glob
import itertools
import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

# While a file is written it is called .STEM.PROCESS-NUMBER.part.SUFFIX.
PART = re.compile(r"\..*\.(\d+)-\d+\.part(\.\w+)?")
_numbers = itertools.count()


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A hidden path beside `path` to write to: on the disk and in its place when all went well, else gone.

    No two writers share it, so the last one to end wins, with a whole file.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}-{next(_numbers)}.part{path.suffix}")
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
        sync_folder(path.parent)
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        with contextlib.suppress(OSError):  # the first error counts
            temporary.unlink(missing_ok=True)


def write_whole(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file as `whole` does.

    Args:
        path: its final name; what stood there stays until the new one is whole and on the disk.
        write: writes the content into an open binary file.
    """
    with whole(path) as temporary, temporary.open("wb") as file:
        write(file)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as `whole` does."""
    write_whole(path, lambda file: file.write(text.encode("utf-8")))


def write_json(path: Path, content: Mapping) -> None:
    """Write a JSON file as `whole` does; non-finite numbers become null."""
    write_text(path, json.dumps(_finite(content), indent=2, ensure_ascii=False) + "\n")


def _finite(value):
    if isinstance(value, Mapping):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def sync_folder(folder: Path) -> None:
    """Bring new names to the disk as well; some systems can not do this with folders."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def remove_parts(folder: Path, stem: str | None = None) -> None:
    """Remove what writers have left that were killed, of all files or of one stem; those that live keep theirs."""
    for path in folder.glob(f".{'*' if stem is None else glob.escape(stem)}.*.part*"):
        found = PART.fullmatch(path.name)
        if found and not _lives(int(found[1])) and path.is_file():
            path.unlink(missing_ok=True)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's, or no number of a process
        pass
    return True
