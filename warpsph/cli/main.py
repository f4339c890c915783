"""The command `warpsph`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from .. import __version__
from ..errors import SceneError, StoppedError
from ..simulation.checkpoint import CHECKPOINT, Checkpoint
from . import new, sweep
from .catalogue import load, shipped
from .exporting import add_export, recorders
from .plotting import add_plot
from .restart import Restart, parse_interval, settings_of
from .runner import run
from .settings import add_settings, chosen
from .stored import SCENE, open_scene

# Rooms above this one add their commands by these modules: a name, since imports point down.
FURTHER = ("warpsph.report.command",)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the exit status is 0 for success, 1 for a failed check or run, 2 for bad input."""
    options = _parser().parse_args(arguments)
    try:
        return options.command(options)
    except SceneError as error:
        print(f"warpsph: {error}", file=sys.stderr)
        return 2
    except StoppedError as stop:
        print(f"warpsph: {stop}", file=sys.stderr)
        return stop.status
    except KeyboardInterrupt:
        print("warpsph: interrupted; what was recorded so far is kept", file=sys.stderr)
        return 130
    except BrokenPipeError:  # the reader of our output has gone, e.g. `warpsph list | head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:  # a disk that is full, above all
        print(f"warpsph: {error}", file=sys.stderr)
        return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="warpsph", description="Solid and soil dynamics at large deformations by Runge-Kutta Taylor SPH."
    )
    parser.add_argument("--version", action="version", version=f"warpsph {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    listing = commands.add_parser("list", help="list the shipped scenes, or the parameters of one")
    listing.add_argument("scene", nargs="?", help="a shipped scene or the path of a scene file")
    listing.set_defaults(command=_list)

    running = commands.add_parser("run", help="run a scene and judge it")
    running.add_argument("scene", nargs="?", help="a shipped scene, or the path of a scene file or a scene.toml")
    running.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="set a parameter; may be repeated"
    )
    running.add_argument("--out", metavar="DIR", help="folder for the results (default: runs/SCENE)")
    running.add_argument("--quiet", action="store_true", help="print nothing unless something fails")
    running.add_argument(
        "--resume", metavar="DIR", help="go on from the checkpoint in DIR, a run's folder, with its options"
    )
    add_settings(running)
    running.set_defaults(command=_run, usage_error=running.error)
    sweep.add_parser(commands)
    new.add_parser(commands)

    add_plot(commands)
    add_export(commands)
    for module in FURTHER:
        import_module(module).add_parser(commands)
    return parser


def _list(options: argparse.Namespace) -> int:
    if options.scene is None:
        files = {name: load(name) for name in shipped()}
        width = max(map(len, files), default=0)
        for name, file in files.items():
            print(f"{name.ljust(width)}  {file.description}")
        return 0
    file = load(options.scene)
    print(f"{file.name}: {file.description}\n")
    rows = [(p.name, "auto" if p.default is None else str(p.default), p.unit, p.meaning) for p in file.parameters]
    widths = [max(len(row[k]) for row in rows) for k in range(3)]
    for row in rows:
        print("  ".join(cell.ljust(w) for cell, w in zip(row, [*widths, 0], strict=True)).rstrip())
    return 0


def _run(options: argparse.Namespace) -> int:
    if options.scene is None and options.resume is None:
        options.usage_error("the following arguments are required: SCENE, or --resume DIR")
    checkpoint = None if options.resume is None else _checkpoint(Path(options.resume), options.out)
    file = open_scene(options.scene or str(Path(options.resume) / SCENE))
    settings = chosen(options, file.settings if checkpoint is None else settings_of(checkpoint))
    scene, values = file.build(options.set)
    folder = Path(options.out or options.resume or Path("runs") / file.name)
    end = scene.duration if settings.until is None else settings.until
    passed = run(
        file,
        scene,
        values,
        settings,
        folder,
        quiet=options.quiet,
        watching=recorders(settings, folder, end),
        restart=Restart(parse_interval(settings.checkpoint_every), checkpoint),
    )
    return 0 if passed else 1


def _checkpoint(folder: Path, out: str | None) -> Checkpoint:
    if out is not None and Path(out).resolve() != folder.resolve():
        raise SceneError("--out", out, f"a run goes on in its own folder, {folder}; to branch off, copy that")
    if (folder / SCENE).is_file() and not (folder / CHECKPOINT).exists():
        again = f"warpsph run {folder / SCENE} --out {folder}"
        raise SceneError("--resume", str(folder), f"it has no checkpoint yet; start again with: {again}")
    return Checkpoint.read(folder / CHECKPOINT)


if __name__ == "__main__":
    sys.exit(main())
