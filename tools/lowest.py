"""Prints the lowest versions that pyproject.toml declares, one `name==version` a line, for pip.

A bound that nobody installs is a guess: `make test-lowest` installs these and runs tests on them.
"""

import re
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PROJECT = Path(__file__).resolve().parent.parent / "pyproject.toml"
REQUIREMENT = re.compile(r"([\w.-]+)>=([\w.]+)")


def lowest(*extras: str) -> list[str]:
    """The dependencies, and those of some extras, at their lower bounds."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    found, waiting = [], list(project["dependencies"])
    waiting += [part for extra in extras for part in project["optional-dependencies"][extra]]
    for declared in waiting:
        requirement, semicolon, marker = declared.partition(";")
        own = re.fullmatch(rf"{project['name']}\[([\w,]+)\]", requirement)
        if own:
            waiting += [part for extra in own[1].split(",") for part in project["optional-dependencies"][extra]]
        else:
            name, version = REQUIREMENT.fullmatch(requirement.strip()).groups()
            found.append(f"{name}=={version}{semicolon}{marker}")
    return found


if __name__ == "__main__":
    print("\n".join(lowest(*sys.argv[1:])))
