"""`warpsph new`: a commented scene to start from."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from ..errors import SceneError
from ..storage.files import write_whole

TEMPLATE = Path(__file__).with_name("starting_scene.py")


def add_parser(commands) -> None:
    """Add the command to the others."""
    parser = commands.add_parser("new", help="write a commented scene file to start from")
    parser.add_argument("name", help="of the scene; NAME.py is written")
    parser.set_defaults(command=_new)


def _new(options: argparse.Namespace) -> int:
    path = write_starting_scene(options.name)
    print(f"{path} written; run it with: warpsph run {path}")
    return 0


def write_starting_scene(name: str) -> Path:
    """Write NAME.py; returns its path.

    Raises:
        SceneError: a file of that name is there already, or can not be written.
    """
    path = Path(name if name.endswith(".py") else f"{name}.py")
    if not re.fullmatch(r"\w[\w-]*", path.stem):
        raise SceneError("name", name, "it must be made of letters, digits, _ and -")
    if path.exists():
        raise SceneError("name", name, f"{path} is there already; choose another name")
    text = TEMPLATE.read_text(encoding="utf-8").replace("{name}", str(path.with_suffix("")))
    try:
        write_whole(path, lambda file: file.write(text.encode("utf-8")))
    except OSError as error:
        raise SceneError("name", name, f"{path} can not be written ({error.strerror})") from None
    return path
