"""Whose a folder is: one process writes into it at a time, and only what was written as ours is ever removed.

A folder with results holds a hidden file, `.warpsph`. That it is there says that warpsph fills the folder; while a
process does, the file is locked and says which. The system gives the lock back however the process ends. Where
file systems do not lock, or only on their own machine, what the file says counts: a process that no longer lives
has lost the folder, as has one from before the machine was started again; of another machine's nobody can know.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path

from ..errors import SceneError
from .files import PART, remove_parts

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None

MARK = ".warpsph"


@contextlib.contextmanager
def owned(folder: Path, option: str = "--out") -> Iterator[None]:
    """Be the one who writes into a folder, which is made if need be.

    Args:
        folder: the folder.
        option: how the user named it, for the message.

    Raises:
        SceneError: another process, or another part of this one, is at work there, or it can not be written.
        OSError: at the end it is not there any more, or is another one: a disk or somebody has taken it away.
    """
    with _writable(option, folder):
        folder.mkdir(parents=True, exist_ok=True)
    with _held(folder / MARK, option, folder) as handle:
        yield
        if not _is(folder / MARK, handle):
            raise OSError(errno.ENOENT, "it was taken away meanwhile, with what had been written", str(folder))


@contextlib.contextmanager
def owned_file(path: Path, option: str) -> Iterator[None]:
    """Be the one who writes a file, and what belongs to it, in a folder that is made if need be.

    Raises:
        SceneError: as `owned`.
    """
    mark = path.with_name(f".{path.name}{MARK}")
    with _writable(option, path, "file"):
        path.parent.mkdir(parents=True, exist_ok=True)
    with _held(mark, option, path, "file"):
        try:
            remove_parts(path.parent, path.stem)
            yield
        finally:
            with contextlib.suppress(OSError):
                mark.unlink()  # while it is locked: who has opened it meanwhile finds that it is another one


def marked(folder: Path) -> bool:
    """Whether warpsph fills this folder."""
    return (folder / MARK).is_file()


def mark(folder: Path) -> None:
    """Say so of a folder that belongs to a file of ours."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MARK).touch()


def holds_only(folder: Path, ours: re.Pattern) -> bool:
    """Whether there is no such folder, or an empty one, or a marked one with files of our names alone."""
    if not os.path.lexists(folder):
        return True
    if folder.is_symlink() or not folder.is_dir():
        return False
    names = [path.name for path in folder.iterdir()]
    known = (ours.fullmatch(name) or PART.fullmatch(name) or name == MARK for name in names)
    return not names or (marked(folder) and all(known))


def empty(folder: Path, ours: re.Pattern) -> None:
    """Remove a marked folder with the files of our names; what else is in it stays, and it with that."""
    if not marked(folder):
        with contextlib.suppress(OSError):
            folder.rmdir()
        return
    for path in folder.iterdir():
        if ours.fullmatch(path.name) or PART.fullmatch(path.name):
            path.unlink(missing_ok=True)
    if [path.name for path in folder.iterdir()] == [MARK]:
        (folder / MARK).unlink()
        folder.rmdir()


@contextlib.contextmanager
def _writable(option: str, path: Path, kind: str = "folder") -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:  # the latter: a null character in the name
        raise SceneError(option, str(path), f"it must be a {kind} that can be written ({error})") from None


@contextlib.contextmanager
def _held(mark: Path, option: str, target: Path, kind: str = "folder") -> Iterator[int]:
    with _writable(option, target, kind):
        file = _locked(mark)
    if file is None:
        raise SceneError(option, str(target), f"{_who(_read(mark))} is writing it; wait, or choose another name")
    handle, locks = file
    try:
        former = _read(mark)
        if former.get("host", socket.gethostname()) != socket.gethostname():
            raise SceneError(
                option, str(target), f"{_who(former)} may still be writing it; if it does not, delete {mark}"
            )
        if not locks and _lives(former):
            raise SceneError(option, str(target), f"{_who(former)} is writing it; wait, or choose another name")
        with _writable(option, target, kind):
            _write(handle, _this_process())
        try:
            yield handle
        finally:
            with contextlib.suppress(OSError):
                _write(handle, {})
    finally:
        os.close(handle)


def _locked(mark: Path) -> tuple[int, bool] | None:
    """An open file and whether it is locked, or the file system can not do that; None when another holds it."""
    while True:
        handle = os.open(mark, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            locks = fcntl is not None
            if locks:
                try:
                    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    os.close(handle)
                    return None
                except OSError:  # this file system has no locks
                    locks = False
            if _is(mark, handle):  # its owner may have removed it meanwhile
                return handle, locks
        except OSError:
            os.close(handle)
            raise
        os.close(handle)


def _is(mark: Path, handle: int) -> bool:
    """Whether the file of that name is the open one."""
    try:
        return os.path.samestat(os.fstat(handle), os.stat(mark))
    except FileNotFoundError:
        return False


def _this_process() -> dict[str, object]:
    process = os.getpid()
    return {"process": process, "started": _started(process), "boot": _boot(), "host": socket.gethostname()}


def _lives(owner: Mapping) -> bool:
    """Whether the process still runs that wrote this; only where nothing was locked."""
    process = owner.get("process")
    if not isinstance(process, int) or owner.get("boot") != _boot():
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        pass
    return _started(process) == owner.get("started")


def _started(process: int) -> str | None:
    """When a process began, as the system counts: numbers of processes come again."""
    with contextlib.suppress(OSError, IndexError):
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[19]
    return None


def _boot() -> str | None:
    with contextlib.suppress(OSError):
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return None


def _who(owner: Mapping) -> str:
    return f"process {owner.get('process', '?')} on {owner.get('host', 'this machine')}"


def _read(mark: Path) -> dict:
    try:
        found = json.loads(mark.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}  # nobody was at work, or it is torn: then its process has not lived
    return found if isinstance(found, dict) else {}


def _write(handle: int, content: Mapping) -> None:
    text = json.dumps(content).encode("utf-8") if content else b""
    os.ftruncate(handle, 0)
    os.pwrite(handle, text, 0)
    os.fsync(handle)
