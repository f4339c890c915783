"""Fills up, or takes away, the disk that commands write to: DISK COUNT SEED.

`tests/test_disks.py` starts this with mounts of its own: a small disk is mounted on DISK, which nobody else sees.
"""

import contextlib
import ctypes
import io
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import traceback
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tests.damaging import SCENE
from tests.killing_commands import layer
from tests.undrawn import DOT
from warpsph.cli.main import main
from warpsph.storage.files import PART
from warpsph.storage.owner import MARK

LARGE, PAGE = 64_000, 4  # [kB], of a disk, and what it gives at once
MNT_DETACH = 2  # of Linux
OPTIONS = ("--device", "cpu", "--quiet")
PICTURE = bytes(40_000) + DOT  # of a size that matters, in no time
ENDS = {".png": PICTURE[-8:], ".vtp": b"</VTKFile>\n", ".pvd": b"</VTKFile>", ".csv": b"\n", ".json": b"}\n"}


class Disks:
    """Commands on a disk that fills up at some byte, is taken away, or loses its folders, at some moment."""

    def __init__(self, disk, seed):
        self.disk, self.chance, self.count = disk, random.Random(seed), {}
        self._mount()
        self._prepare()
        self.copy = disk.with_name(f"{disk.name}-copy")
        shutil.copytree(disk, self.copy)

    def _prepare(self):
        (self.disk / "plate.py").write_text(SCENE)
        self.whole = self.disk / "whole"
        begin = time.perf_counter()
        done = self.forked(*self._run(self.whole))
        assert done == (0, ""), done
        self.longest = time.perf_counter() - begin
        self.need = {"run": self._used()}  # [kB]
        self.made = {name: ("export", self.whole, self.disk / name) for name in ("e.usdc", "e.usda", "e.pvd")}
        self.made["plot"] = ("plot", self.whole)
        for kind, command in self.made.items():
            before = self._used()
            assert self.forked(*command) == (0, "")
            self.need[kind] = self._used() - before
        self.stage = layer(self.whole / "run.usdc")
        (self.disk / "notes.txt").write_text("mine")

    def _run(self, out):
        again = ("--frames", "6", "--checkpoint-every", "5", "--usd", out / "run.usdc", "--overwrite")
        return ("run", self.disk / "plate.py", *again, *OPTIONS, "--out", out)

    def _mount(self):
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={LARGE}k", "tmpfs", self.disk], check=True)

    def _resize(self, size):
        subprocess.run(["mount", "-o", f"remount,size={size}k", self.disk], check=True)

    def forked(self, *arguments, meanwhile=lambda child: None):
        """Exit status of a command in a process of its own, and what it said on standard error."""
        here, there = os.pipe()
        child = os.fork()
        if child == 0:
            status = 99
            try:
                os.dup2(there, 2)
                with contextlib.redirect_stdout(io.StringIO()):
                    status = main([str(part) for part in arguments])
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stderr.flush()
                os._exit(status)
        os.close(there)
        meanwhile(child)
        with os.fdopen(here, errors="replace") as said:
            errors = said.read()
        _, status = os.waitpid(child, 0)
        return os.waitstatus_to_exitcode(status), errors

    def _ends_well(self, kind, outcome, *arguments):
        status, errors = outcome
        what = f"{kind}, {arguments}: {status}\n{errors}"
        assert status in (0, 1, 2), what
        assert all(line.startswith("warpsph: ") for line in errors.splitlines()), what
        assert errors or status == 0, what
        self.count[kind] = self.count.get(kind, 0) + (errors != "")

    def _used(self):
        state = os.statvfs(self.disk)
        return (state.f_blocks - state.f_bfree) * state.f_frsize // 1000

    def full(self, kind, need, *arguments):
        """A command on a disk with less room than it may need [kB]."""
        self._resize(self._used() + self.chance.randrange(0, max(int(need), PAGE), PAGE))
        outcome = self.forked(*arguments)
        self._resize(LARGE)
        self._ends_well(kind, outcome, *arguments)
        assert not [path for path in self.disk.rglob("*") if PART.fullmatch(path.name)], "half a file is left"
        assert (self.disk / "notes.txt").read_text() == "mine"

    def run(self):
        """A run on a full disk: what is there is whole; with room again it goes on, or begins anew."""
        out = self.disk / "out"
        shutil.rmtree(out, ignore_errors=True)
        self.full("run", 1.2 * self.need["run"], *self._run(out))
        self._is_whole(out)
        if (out / "checkpoint.npz").exists():
            self.full("resume", 0.8 * self.need["run"], "run", "--resume", out, *OPTIONS)
            self._is_whole(out)
            assert self.forked("run", "--resume", out, *OPTIONS)[0] == 0
            assert (out / "history.csv").read_bytes() == (self.whole / "history.csv").read_bytes()
        assert self.forked(*self._run(out)) == (0, "")
        self._is_the_same(out)

    def export(self):
        """USD, ParaView and a picture: a former one stays, or the new one is whole."""
        for kind, command in self.made.items():
            self.full(kind, self.need[kind], *command)
        for stage in self.disk.glob("e.usd*"):
            assert _body(layer(stage)) == _body(self.stage), stage
        if (self.disk / "e.pvd").exists():
            named = re.findall('file="(.*?)"', (self.disk / "e.pvd").read_text())
            assert len(named) == 7 and all((self.disk / name).is_file() for name in named), named
        self._is_whole(self.disk)
        self._is_the_same(self.whole)

    def taken(self):
        """The disk goes in the midst of a run, which does not call that a success."""
        self._without("taken", lambda: ctypes.CDLL(None).umount2(os.fsencode(self.disk), MNT_DETACH))
        shutil.rmtree(self.disk / "out", ignore_errors=True)
        self._mount()
        shutil.copytree(self.copy, self.disk, dirs_exist_ok=True)

    def removed(self):
        """Somebody removes the folder of a run in its midst, which does not call that a success either."""
        self._without("removed", lambda: shutil.rmtree(self.disk / "out", ignore_errors=True))

    def _without(self, kind, take):
        """A run whose folder is taken from it, while it stands still for that."""
        owner, at_work = self.disk / "out" / MARK, []

        def meanwhile(child):
            time.sleep(self.chance.uniform(0.0, self.longest))
            os.kill(child, signal.SIGSTOP)
            at_work.append(owner.exists() and owner.stat().st_size > 0)
            assert not take()
            os.kill(child, signal.SIGCONT)

        shutil.rmtree(self.disk / "out", ignore_errors=True)
        command = self._run(self.disk / "out")
        outcome = self.forked(*command, meanwhile=meanwhile)
        self._ends_well(kind, outcome, *command)
        assert outcome[0] == 1 or not at_work[0], outcome

    def sweep(self):
        """Its members may fail; the sweep says so and ends."""
        shutil.rmtree(self.disk / "sweep", ignore_errors=True)
        members = ("--set", "courant=0.5,0.6", "--out", self.disk / "sweep")
        command = ("sweep", self.disk / "plate.py", *members, *OPTIONS)
        self.full("sweep", 2 * self.need["run"], *command)
        assert self.forked(*command)[0] == 0

    def _is_whole(self, folder):
        """Every file under its own name is whole."""
        for path in folder.rglob("*"):
            if not path.is_file() or path.name[0] == ".":
                continue
            content = path.read_bytes()
            assert content.endswith(ENDS.get(path.suffix, b"")), (path, content[-100:])
            if path.suffix == ".npz":
                with np.load(path) as arrays:
                    assert all(arrays[name] is not None for name in arrays.files)
            elif path.suffix in (".usdc", ".usda"):
                layer(path)
            elif path.suffix == ".json":
                json.loads(content)

    def _is_the_same(self, folder):
        for path in (self.whole / "frames").iterdir():
            assert (folder / "frames" / path.name).read_bytes() == path.read_bytes(), path
        assert self.stage == layer(folder / "run.usdc")


def _body(text):
    """A stage as text without its first line, which says whether the file was text itself."""
    return text.partition("\n")[2]


if __name__ == "__main__":
    os.environ["NO_SIGNAL"] = "yes"
    Figure.savefig = lambda self, file, **how: file.write(PICTURE)
    disks, most, turn = Disks(Path(sys.argv[1]), int(sys.argv[3])), int(sys.argv[2]), 0
    kinds = [disks.run, disks.export, disks.taken, disks.removed]
    if most >= 50:
        kinds += [disks.run, disks.export, disks.sweep]
    try:
        while sum(disks.count.values()) < most:
            kinds[turn % len(kinds)]()
            turn += 1
    finally:
        print(disks.count, flush=True)
