"""A sweep: every combination of some parameters' values, made side by side and told in one table."""

from __future__ import annotations

import csv
import io
import itertools
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

from ..errors import SceneError
from ..scene.parameter import assign
from ..storage.files import write_whole
from .catalogue import load, shipped
from .children import CHILDREN
from .member import Member, last_line
from .queue import make_missing
from .stopping import handled

METRICS = ("nodes", "steps", "simulated_time", "wall_time", "node_steps_per_second")


def sweep(
    members: Sequence[Member], folder: Path, device: str | None, workers: Executor, quiet: bool
) -> list[dict[str, object]]:
    """Make what is missing and write `sweep.csv`; returns its rows, one a member."""
    with _stopped_by_signals():
        make_missing(members, folder / "runs", device, workers, quiet)
    rows = [row(member, folder / "runs" / member.name) for member in members]
    names = list(dict.fromkeys(name for found in rows for name in found))
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, names)
    table.writeheader()
    table.writerows(rows)
    write_whole(folder / "sweep.csv", lambda file: file.write(text.getvalue().encode("utf-8")))
    return rows


@contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Signals end the sweep: its runs are told, write a checkpoint each, and end as well."""

    def stop(number: int, frame: object) -> None:
        CHILDREN.stop()
        raise KeyboardInterrupt

    CHILDREN.begin()
    with handled(stop):
        yield


def row(member: Member, folder: Path) -> dict[str, object]:
    """What a member gave: its settings, how it ended, its checks, its metrics, and the end of its history."""
    found: dict[str, object] = {"run": member.name, **dict(s.split("=", 1) for s in member.settings)}
    if not member.done(folder):
        return found | {"status": "failed to run", "message": last_line(folder)}
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    checks = summary["checks"]
    status = "passed" if all(check["passed"] for check in checks) else "failed"
    found["status"] = "broke down" if summary["error"] else status if checks else "no checks"
    found["message"] = summary["error"] or ", ".join(c["name"] for c in checks if not c["passed"])
    for check in checks:
        name = check["name"]
        found |= {f"{name} [{check['unit']}]": check["value"]}
        found |= {f"{name} {part}": check[part] for part in ("reference", "error", "passed")}
    found |= {name: summary[name] for name in METRICS}
    with (folder / "history.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return found | ({f"last {name}": value for name, value in zip(header[2:], rows[-1][2:], strict=True)})


def members(scene: str, settings: Sequence[str], precision: str, frames: int = 0) -> list[Member]:
    """Every combination of the values in settings of the form `name=value,value,…`.

    Raises:
        SceneError: there is no such scene or parameter, or a value is not of its kind.
    """
    file = load(scene)
    where = scene if scene in shipped() else str(Path(scene).absolute())
    choices: dict[str, list[str]] = {}
    for setting in settings:
        name, separator, values = (part.strip() for part in setting.partition("="))
        if not separator:
            raise SceneError("--set", setting, "it must have the form name=value,value,…")
        if name in choices:
            raise SceneError("--set", setting, f"give all values of {name} at once: {name}=value,value,…")
        choices[name] = [f"{name}={value.strip()}" for value in values.split(",")]
    found = {}
    for combination in itertools.product(*choices.values()):
        assign(file.parameters, combination)
        name = re.sub(r"[^\w=.,+-]", "_", ",".join(combination)) or file.name
        found[name] = Member(name, where, combination, precision, frames)
    return list(found.values())


def table(rows: Sequence[Mapping[str, object]]) -> str:
    """How each member ended, as aligned text."""
    width = max(len(str(found["run"])) for found in rows)
    return "\n".join(f"{found['run']:<{width}}  {found['status']}  {found['message']}".rstrip() for found in rows)
