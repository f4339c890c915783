"""A sweep: every combination of some parameters' values, made side by side and told in one table."""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import re
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

from ..errors import SceneError
from ..scene.output import ENERGY_COLUMN
from ..scene.parameter import assign
from ..simulation.history import read_history
from ..simulation.summary import read_summary
from ..storage.files import write_text
from ..storage.names import LONGEST
from .catalogue import load, shipped
from .children import CHILDREN
from .member import Member, last_line
from .queue import make_missing
from .run_folder import HISTORY, SUMMARY
from .stopping import interrupting

FAILED = "failed to run"  # the status of a member that has no summary of its own
METRICS = ("nodes", "steps", "simulated_time", "wall_time", "node_steps_per_second")


def sweep(
    members: Sequence[Member], folder: Path, device: str | None, workers: Executor, quiet: bool
) -> list[dict[str, object]]:
    """Make what is missing and write `sweep.csv`; returns its rows, one a member."""
    CHILDREN.begin()
    with interrupting(CHILDREN.stop):
        failed = make_missing(members, folder / "runs", device, workers, quiet)
    rows = [row(member, folder / "runs" / member.name, failed.get(member)) for member in members]
    names = list(dict.fromkeys(name for found in rows for name in found))
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, names)
    table.writeheader()
    table.writerows(rows)
    write_text(folder / "sweep.csv", text.getvalue())
    return rows


def row(member: Member, folder: Path, error: BaseException | None = None) -> dict[str, object]:
    """What a member gave: its settings, how it ended, its checks, its metrics, and the end of its history."""
    found: dict[str, object] = {"run": member.name, **dict(s.split("=", 1) for s in member.settings)}
    try:
        if error is None and member.done(folder):
            return found | _outcome(folder)
        return found | {"status": FAILED, "message": str(error) if error else last_line(folder)}
    except SceneError as unreadable:
        return found | {"status": FAILED, "message": str(unreadable)}


def _outcome(folder: Path) -> dict[str, object]:
    """What a member that is done gave."""
    summary = read_summary(folder / SUMMARY)
    columns, units = read_history(folder / HISTORY)
    checks = summary["checks"]
    status = "passed" if all(check["passed"] for check in checks) else "failed"
    found = {"status": "broke down" if summary["error"] else status if checks else "no checks"}
    found["message"] = summary["error"] or ", ".join(c["name"] for c in checks if not c["passed"])
    for check in checks:
        name = check["name"]
        found |= {f"{name} [{check['unit']}]": check["value"]}
        found |= {f"{name} {part}": check.get(part) for part in ("reference", "error", "passed")}
    found |= {name: summary[name] for name in METRICS}
    probes = [n for n in [*columns][2:] if len(columns[n]) and not n.startswith(ENERGY_COLUMN)]
    return found | {f"last {n} [{units[n]}]": float(columns[n][-1]) for n in probes}


def members(scene: str, settings: Sequence[str], precision: str, frames: int = 0) -> list[Member]:
    """Every combination of the values in settings of the form `name=value,value,…`, each once.

    Raises:
        SceneError: there is no such scene or parameter, or a value is not of its kind.
    """
    file = load(scene)
    where = scene if scene in shipped() else str(Path(scene).absolute())
    parameters = file.parameters
    choices: dict[str, list[str]] = {}
    for setting in settings:
        name, separator, values = (part.strip() for part in setting.partition("="))
        if not separator:
            raise SceneError("--set", setting, "it must have the form name=value,value,…")
        if name in choices:
            raise SceneError("--set", setting, f"give all values of {name} at once: {name}=value,value,…")
        choices[name] = list(dict.fromkeys(f"{name}={value.strip()}" for value in values.split(",")))
        for text in choices[name]:
            assign(parameters, [text])
    return [
        Member(folder_name(combination) or file.name, where, combination, precision, frames)
        for combination in itertools.product(*choices.values())
    ]


def folder_name(settings: Sequence[str]) -> str:
    """A name for the folder of a member: its settings, and where they are no name, one that only they have."""
    text = ",".join(settings)
    plain = re.sub(r"[^A-Za-z0-9_=.,+-]", "_", text)
    if plain == text and len(text) <= LONGEST:
        return text
    return f"{plain[: LONGEST - 13]}~{hashlib.sha256(text.encode()).hexdigest()[:12]}"


def table(rows: Sequence[Mapping[str, object]]) -> str:
    """How each member ended, as aligned text."""
    width = max(len(str(found["run"])) for found in rows)
    return "\n".join(f"{found['run']:<{width}}  {found['status']}  {found['message']}".rstrip() for found in rows)
