"""Imports point one way: every room of the package only knows the rooms below it."""

import ast
import re
from pathlib import Path

import pytest

import warpsph

PACKAGE = Path(warpsph.__file__).parent
ROOMS = (
    *("errors", "validate", "mesh", "analysis", "scene", "device", "physics", "materials", "state", "remaking"),
    *("operators", "step", "storage", "simulation", "export", "cli", "report"),
)
FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.parent != PACKAGE]


def imported_rooms(path):
    """Rooms of this package that a file imports, from its relative imports."""
    depth = len(path.relative_to(PACKAGE).parts)  # dots that reach the package itself
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level == depth:
            names = [node.module] if node.module else [alias.name for alias in node.names]
            yield from (name.split(".")[0] for name in names)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_down(path):
    own = ROOMS.index(path.relative_to(PACKAGE).parts[0])
    for room in imported_rooms(path):
        if room != "__version__":
            assert ROOMS.index(room) <= own, f"{path.name} imports {room}"


def imported_packages(path):
    """Packages outside this one that a file imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split(".")[0]


@pytest.mark.parametrize("room", ["mesh", "analysis", "scene"])
def test_what_describes_and_measures_knows_no_warp(room):
    for path in (PACKAGE / room).rglob("*.py"):
        assert "warp" not in imported_packages(path), path


def test_nothing_below_the_exports_draws():
    """`matplotlib.tri` in analysis/sampling.py draws nothing: it finds the triangle that a point is in."""
    below = [path for path in FILES if ROOMS.index(path.relative_to(PACKAGE).parts[0]) < ROOMS.index("export")]
    drawing = [path.relative_to(PACKAGE).as_posix() for path in below if "matplotlib" in imported_packages(path)]
    assert drawing == ["analysis/sampling.py"]


def test_files_are_small_enough_for_one_purpose():
    assert all(len(path.read_text(encoding="utf-8").splitlines()) <= 400 for path in FILES)


def test_contributing_lists_the_rooms_in_their_order():
    text = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`warpsph/[^|]*) \|", text, re.MULTILINE)
    rooms = [room for row in rows for room in re.findall(r"`warpsph/(\w+)[./]", row)]
    assert rooms == [*ROOMS, "frames", "public", "__main__"]


def statics_of_loops(path):
    """Lines where `wp.static` names the variable of a loop around it."""
    for loop in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(loop, ast.For) and isinstance(loop.target, ast.Name):
            for call in (node for node in ast.walk(loop) if isinstance(node, ast.Call)):
                named = {node.id for part in call.args for node in ast.walk(part) if isinstance(node, ast.Name)}
                if ast.unparse(call.func) == "wp.static" and loop.target.id in named:
                    yield call.lineno


def test_no_kernel_has_to_be_built_to_be_found_in_the_cache():
    """Warp knows what `wp.static` of a loop's variable is only when it has built the kernel, at every start."""
    assert not [(path, line) for path in FILES for line in statics_of_loops(path)]
