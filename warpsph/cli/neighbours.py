"""What a scene file imports from its own folder, kept apart from what other scene files import.

Python keeps one module a name in `sys.modules`, so that a second scene file's `import helper` would get the first
one's helper. Here every scene file has its modules to itself: they stand in `sys.modules` while its code runs, and
are taken out again afterwards.
"""

from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

# One scene file's code runs at a time, as `sys.modules` and `sys.path` belong to the whole process.
_lock = threading.RLock()
INSTALLED = {"site-packages", "dist-packages"}


class Neighbours:
    """The modules of one scene file: itself and what it imports from a folder.

    Args:
        folder: of the modules it may import.
    """

    def __init__(self, folder: Path):
        self._folder = folder.absolute()
        self._modules: dict[str, ModuleType] = {}
        self._open = False

    def add(self, name: str, module: ModuleType) -> None:
        """Count a module among them, under a name."""
        self._modules[name] = module

    @contextlib.contextmanager
    def importable(self) -> Iterator[None]:
        """Lets code import the modules of the folder, as a script in it may; nobody else sees them afterwards."""
        with _lock:
            if self._open:
                yield
                return
            others = self._take(self._hidden_names())
            before = {_top(name) for name in sys.modules}
            sys.modules.update(self._modules)
            sys.path.insert(0, str(self._folder))
            self._open = True
            try:
                yield
            finally:
                self._open = False
                with contextlib.suppress(ValueError):  # the file's code may have taken it out
                    sys.path.remove(str(self._folder))
                own = {_top(name) for name in sys.modules} - before
                found = {name for name in own if name in self._modules or _folder(name) == self._folder}
                self._modules |= self._take(found)
                sys.modules.update(others)

    def _hidden_names(self) -> set[str]:
        """Loaded modules that one of this folder goes before; never what is installed, nor this package."""
        there = self._folder.iterdir() if self._folder.is_dir() else ()
        offered = {_top(path.name) for path in there} | {*self._modules}
        kept = sys.stdlib_module_names | {_top(__name__), "__main__"}
        return {name for name in offered - kept if name in sys.modules and not _installed(name)}

    @staticmethod
    def _take(tops: set[str]) -> dict[str, ModuleType]:
        """Modules of these names, and those inside them, taken out of `sys.modules`."""
        return {name: sys.modules.pop(name) for name in list(sys.modules) if _top(name) in tops}


def _top(name: str) -> str:
    return name.partition(".")[0]


def _folder(name: str) -> Path | None:
    """The folder in which a module, or a package, was found."""
    spec = getattr(sys.modules[name], "__spec__", None)
    places = [] if spec is None else [*(spec.submodule_search_locations or ()), spec.origin]
    return Path(places[0]).parent if places and places[0] else None


def _installed(name: str) -> bool:
    folder = _folder(name)
    return folder is None or not INSTALLED.isdisjoint(folder.parts)
