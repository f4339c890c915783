"""`warpsph sweep`: one scene with many values of its parameters, each run in a process of its own."""

from __future__ import annotations

import argparse
import csv
import hashlib
import io
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from ..device.precision import precision as precision_of
from ..errors import SceneError
from ..scene.parameter import assign
from ..simulation.checkpoint import CHECKPOINT
from ..simulation.device import THREADS, all_cores, choose_device, start_warp
from ..storage.files import write_whole
from .catalogue import load, shipped
from .queue import make_missing
from .restart import SIGNALS
from .runner import writable
from .scene_run import SceneRun
from .settings import count
from .stored import SCENE, read_toml

INTERRUPTED = 128 + signal.SIGINT
METRICS = ("nodes", "steps", "simulated_time", "wall_time", "node_steps_per_second")

_processes: set[subprocess.Popen] = set()
_stopping = threading.Event()


@dataclass(frozen=True)
class Member(SceneRun):
    """A run of a sweep: the command `warpsph run` in a process of its own.

    Args:
        name, scene, settings: see `SceneRun`.
        precision: float32 or float64.
        frames: how many it keeps.
    """

    precision: str = "float64"
    frames: int = 0

    def cost(self) -> float:
        """How much work it is, in node-steps; nothing when its scene is refused."""
        try:
            return super().cost()
        except SceneError:
            return 0.0

    def done(self, folder: Path) -> bool:
        """Whether the folder holds this run, of the scene file as it is now, this precision and frames."""
        try:
            stored = read_toml(folder / SCENE)
            path = Path(load(self.scene).module.__file__)
            same = stored["code"]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
            how = stored["run"]
            same = same and (how["precision"], how["frames"]) == (self.precision, self.frames)
            return same and super().done(folder)
        except (OSError, ValueError, KeyError, SceneError):
            return False

    def make(self, folder: Path, device: str | None) -> None:
        """Make it, from its checkpoint where it has one; what it prints goes into `log.txt`."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "summary.json").unlink(missing_ok=True)
        command = [sys.executable, "-m", "warpsph", "run", self.scene, "--out", str(folder)]
        command += [part for setting in self.settings for part in ("--set", setting)]
        command += ["--precision", self.precision, "--frames", str(self.frames)]
        command += ["--device", device] if device else []
        status = 2
        if (folder / CHECKPOINT).is_file():
            status = _call([*command, "--resume", str(folder)], folder)
        if status == 2:  # there is no checkpoint, or it is refused
            status = _call(command, folder)
        if status not in (0, 1):
            (folder / "summary.json").unlink(missing_ok=True)  # its checks raised: it is not done
            raise RuntimeError(last_line(folder) if status > 0 else f"its process ended by signal {-status}")
        if not (folder / "summary.json").is_file():
            raise RuntimeError(last_line(folder))


def _call(command: Sequence[str], folder: Path) -> int:
    """Exit status of a command that writes into `log.txt`; only the sweep passes signals on to it."""
    if _stopping.is_set():
        return INTERRUPTED
    with (folder / "log.txt").open("w", encoding="utf-8") as log:
        # Runs stand side by side: each on one core, unless told otherwise.
        environment = {THREADS: "1"} | os.environ
        process = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True, env=environment)
    _processes.add(process)
    if _stopping.is_set():  # the signal came just before
        process.terminate()
    try:
        return process.wait()
    finally:
        _processes.discard(process)


def last_line(folder: Path) -> str:
    """The last line of a run's log."""
    with suppress(OSError, IndexError):
        return (folder / "log.txt").read_text(encoding="utf-8").splitlines()[-1].removeprefix("warpsph: ")
    return "it left no log"


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
def _stopped_by_signals():
    """Ctrl-C and SIGTERM end the sweep: its runs are told, write a checkpoint each, and end as well."""

    def stop(number: int, frame: object) -> None:
        _stopping.set()
        for process in list(_processes):
            process.terminate()
        raise KeyboardInterrupt

    previous = {each: signal.signal(each, stop) for each in SIGNALS}
    _stopping.clear()
    try:
        yield
    finally:
        for each, handler in previous.items():
            signal.signal(each, handler)


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


def add_parser(commands) -> None:
    """Add the command to the others."""
    parser = commands.add_parser(
        "sweep",
        help="run a scene with several values of its parameters",
        description="Runs every combination of the values, each into a folder of its own, and collects all checks "
        "and metrics in sweep.csv. What a former call has finished is kept; what it began goes on.",
    )
    parser.add_argument("scene", help="a shipped scene or the path of a scene file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE,…",
        help="values of a parameter; may be repeated",
    )
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time (default: 2)")
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="make the runs on a Dask cluster that sees the same folders, not here"
    )
    parser.add_argument("--device", help="Warp device, e.g. cpu or cuda:0 (default: a GPU if there is one)")
    parser.add_argument("--precision", default="float64", help="float32 or float64 (default: float64)")
    parser.add_argument("--frames", metavar="N", default="0", help="frames each run keeps (default: 0)")
    parser.add_argument("--out", metavar="DIR", help="folder for the results (default: runs/SCENE-sweep)")
    parser.add_argument("--quiet", action="store_true", help="print nothing unless something fails")
    parser.set_defaults(command=_sweep)


def _sweep(options: argparse.Namespace) -> int:
    if options.jobs < 1:
        raise SceneError("--jobs", options.jobs, "it must be at least 1")
    precision_of(options.precision)
    start_warp()
    if options.device and not options.dask:
        choose_device(options.device)
    chosen = members(options.scene, options.set, options.precision, count("--frames", options.frames))
    folder = writable(Path(options.out or Path("runs") / f"{load(options.scene).name}-sweep")).absolute()
    try:
        with _workers(options) as workers:
            rows = sweep(chosen, folder, options.device, workers, options.quiet)
    except KeyboardInterrupt:
        print("warpsph: interrupted; the same command goes on from here", file=sys.stderr)
        return INTERRUPTED
    passed = all(found["status"] in ("passed", "no checks") for found in rows)
    if not (options.quiet and passed):
        print(table(rows))
    if not options.quiet:
        print(f"results in {folder / 'sweep.csv'}")
    return 0 if passed else 1


@contextmanager
def _workers(options: argparse.Namespace):
    if options.dask is None:
        os.environ.setdefault(THREADS, str(max(1, all_cores() // options.jobs)))
        yield ThreadPoolExecutor(options.jobs)  # a thread waits for each process
        return
    try:
        from distributed import Client
    except ImportError:
        raise SceneError("--dask", options.dask, "it needs Dask: pip install distributed") from None
    try:
        client = Client(options.dask, timeout=10)
    except (OSError, ValueError) as error:
        raise SceneError("--dask", options.dask, f"it must be the address of a Dask scheduler ({error})") from None
    with client:
        yield client.get_executor(pure=False)
