"""The command `warpsph run`."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import SceneError
from ..simulation.checkpoint import CHECKPOINT, Checkpoint
from ..storage.names import name
from .interval import parse_interval
from .keeping import recorders
from .restart import Restart, settings_of
from .run_folder import SCENE
from .runner import run
from .settings import add_settings, chosen
from .stored import open_scene


def add_run(commands) -> None:
    """Add the command to the others."""
    running = commands.add_parser("run", help="run a scene and judge it")
    running.add_argument("scene", nargs="?", help="a shipped scene, or the path of a scene file or a scene.toml")
    running.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="set a parameter; may be repeated"
    )
    running.add_argument("--out", metavar="DIR", help="folder for the results (default: runs/SCENE)")
    running.add_argument(
        "--overwrite", action="store_true", help="replace the run that the folder holds, once this one can begin"
    )
    running.add_argument("--quiet", action="store_true", help="print nothing unless something fails")
    running.add_argument(
        "--resume", metavar="DIR", help="go on from the checkpoint in DIR, a run's folder, with its options"
    )
    add_settings(running)
    running.set_defaults(command=_run, usage_error=running.error)


def _run(options: argparse.Namespace) -> int:
    if options.scene is None and options.resume is None:
        options.usage_error("the following arguments are required: SCENE, or --resume DIR")
    checkpoint = None if options.resume is None else _checkpoint(Path(options.resume), options)
    file = open_scene(str(Path(options.resume) / SCENE) if options.scene is None else options.scene)
    folder = Path(options.out or options.resume or Path("runs") / name("name", file.name))
    if checkpoint is None:
        before = file.run_settings(folder, options.usd)
    else:
        before = settings_of(checkpoint, folder, options.usd)
    settings = chosen(options, before)
    scene, values = file.build(options.set)
    end = scene.duration if settings.until is None else settings.until
    passed = run(
        file,
        scene,
        values,
        settings,
        folder,
        quiet=options.quiet,
        overwrite=options.overwrite,
        watching=recorders(settings, folder, end),
        restart=Restart(parse_interval(settings.checkpoint_every), checkpoint),
    )
    return 0 if passed else 1


def _checkpoint(folder: Path, options: argparse.Namespace) -> Checkpoint:
    if options.overwrite:
        raise SceneError("--overwrite", str(folder), "a run that goes on keeps what it has; leave it out")
    if options.out is not None and Path(options.out).resolve() != folder.resolve():
        allowed = f"a run goes on in its own folder, {folder}; to branch off, copy that"
        raise SceneError("--out", options.out, allowed)
    if (folder / SCENE).is_file() and not (folder / CHECKPOINT).exists():
        again = f"warpsph run {folder / SCENE} --out {folder} --overwrite"
        raise SceneError("--resume", str(folder), f"it has no checkpoint yet; start again with: {again}")
    return Checkpoint.read(folder / CHECKPOINT)
