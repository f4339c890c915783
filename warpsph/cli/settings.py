"""How a run is made: remembered in its folder, so that it goes on, or is repeated, in the same way."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

from ..device.precision import PRECISIONS
from ..errors import SceneError, one_of
from ..validate import index, instance, number
from .run_folder import stage_in_data, stage_inside

MOST_FRAMES = 999_999  # their files have six digits
MOST_THREADS = 1024


@dataclass(frozen=True)
class Settings:
    """How a run is made.

    Args:
        device: Warp device; the first GPU, or else the CPU, when None.
        precision: float64 or float32.
        threads: number of CPU threads; as many as pay off when None.
        until: simulated time at which it ends [s]; the scene's duration when None.
        frames: how many to keep for pictures and exports, besides the one at the start; none at all when 0.
        usd: path of the USD stage it writes; none when None.
        checkpoint_every: how often it writes a checkpoint; see `parse_interval`.
    """

    device: str | None = None
    precision: str = "float64"
    threads: int | None = None
    until: float | None = None
    frames: int = 50
    usd: str | None = None
    checkpoint_every: str = "10min"

    @classmethod
    def read(cls, table: Mapping, folder: Path, usd: str | None = None) -> Settings:
        """From the table `[run]` of a stored scene or of a checkpoint.

        Args:
            table: the table.
            folder: of the run.
            usd: the stage that the user has named, so that the table's does not count.

        Raises:
            SceneError: an entry is not allowed.
        """
        names = [entry.name for entry in fields(cls)]
        for name, value in table.items():
            if name in ("device", "precision", "usd", "checkpoint_every"):
                instance(f"run.{name}", value, str, "a text")
            elif name not in names:
                raise SceneError(f"run.{name}", value, one_of(names, name))
        if "until" in table:
            number("run.until", table["until"], above=0.0)
        if "frames" in table:
            index("run.frames", table["frames"], below=MOST_FRAMES + 1)
        if "threads" in table:
            index("run.threads", table["threads"], at_least=1, below=MOST_THREADS + 1)
        stage = usd or (stage_inside(folder, table["usd"]) if "usd" in table else None)
        return cls(**{**table, "usd": stage})

    def table(self, folder: Path) -> dict[str, object]:
        """What `read` takes, for the data in a run's folder; what is None is left out."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        values["usd"] = self.usd and stage_in_data(folder, self.usd)
        return {name: value for name, value in values.items() if value is not None}


def add_settings(running: argparse.ArgumentParser) -> None:
    """The options of `warpsph run` that say how."""
    default = Settings()
    running.add_argument("--device", help="Warp device, e.g. cpu or cuda:0 (default: a GPU if there is one)")
    running.add_argument("--precision", help=f"{' or '.join(PRECISIONS)} (default: {default.precision})")
    running.add_argument(
        "--threads", metavar="N", help="CPU threads; results do not depend on it (default: as many as pay off)"
    )
    running.add_argument("--until", metavar="T", help="end at this simulated time [s]; checks need the whole run")
    running.add_argument(
        "--frames", metavar="N", help=f"frames to keep for plot and export (default: {default.frames})"
    )
    running.add_argument("--usd", metavar="FILE", help="USD stage to write as the run goes on (.usdc or .usda)")
    running.add_argument(
        "--checkpoint-every",
        metavar="N|T",
        help="write a checkpoint every N steps (500), or every so much simulated time (0.2s) or wall time "
        f"(10min, 1h); default: {default.checkpoint_every}",
    )


def chosen(options: argparse.Namespace, before: Settings) -> Settings:
    """What the options say; where they say nothing, what was before.

    Raises:
        SceneError: an option is not allowed.
    """
    given = {
        "device": options.device,
        "precision": options.precision,
        "threads": None if options.threads is None else count("--threads", options.threads, 1, MOST_THREADS),
        "until": None if options.until is None else _until(options.until),
        "frames": None if options.frames is None else count("--frames", options.frames),
        "usd": options.usd,
        "checkpoint_every": options.checkpoint_every,
    }
    settings = replace(before, **{name: value for name, value in given.items() if value is not None})
    if settings.usd and not settings.frames:
        raise SceneError("--frames", settings.frames, "with --usd it must be at least 1")
    return settings


def _until(text: str) -> float:
    try:
        return number("--until", float(text), above=0.0)
    except ValueError:
        raise SceneError("--until", text, "it must be a number above 0 [s]") from None


def count(option: str, text: str, at_least: int = 0, at_most: int = MOST_FRAMES) -> int:
    """A whole number."""
    try:
        return index(option, int(text), at_least=at_least, below=at_most + 1)
    except ValueError:
        allowed = f"it must be a whole number, at least {at_least} and at most {at_most}"
        raise SceneError(option, text, allowed) from None
