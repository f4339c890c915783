"""Kills commands again and again at random moments; `tests/test_kills.py` starts this in a process of its own."""

import csv
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import uuid
from pathlib import Path

from tests.damaging import SCENE
from warpsph.cli.main import main

NUMBER = "WARPSPH_TEST_NUMBER"
OPTIONS = ("--device", "cpu", "--quiet")


def forked(*arguments):
    """A process that runs a command; it has imported everything already."""
    child = os.fork()
    if child == 0:
        status = 99
        try:
            with open(os.devnull, "w") as nowhere:
                os.dup2(nowhere.fileno(), 1)
            status = main([str(part) for part in arguments])
        finally:
            os._exit(status)
    return child


def killed(life, *arguments):
    """Whether a command still ran when it was killed after its life [s]; it must not fail by itself."""
    child = forked(*arguments)
    time.sleep(life)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, f"{arguments} failed"
    return os.WIFSIGNALED(status)


def ended(*arguments):
    """Run a command to its end."""
    _, status = os.waitpid(forked(*arguments), 0)
    assert os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0, f"{arguments} failed"


def results(folder):
    """What must not depend on how often a run was killed: history, frames, and the stage as text."""
    kept = sorted(path for path in (folder / "frames").iterdir() if path.name[0] != ".")
    found = {path.name: path.read_bytes() for path in [folder / "history.csv", *kept]}
    return found | {"stage": layer(folder / "run.usdc")}


def layer(path):
    """A USD stage as text; read by a child, as USD's threads do not survive the forks of this process."""
    here, there = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            from pxr import Sdf

            with os.fdopen(there, "w") as file:
                file.write(Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString())
            status = 0
        finally:
            os._exit(status)
    os.close(there)
    with os.fdopen(here) as file:
        text = file.read()
    assert os.waitpid(child, 0)[1] == 0, path
    return text


class Kills:
    """Kills of each command, with what must be true after each."""

    def __init__(self, folder, seed):
        self.folder, self.chance, self.count = folder, random.Random(seed), {}
        folder.mkdir(exist_ok=True)
        (folder / "plate.py").write_text(SCENE)
        self.whole = folder / "whole"
        self.options = ("--frames", "6", "--checkpoint-every", "5", *OPTIONS)
        whole = ("run", folder / "plate.py", *self.options, "--usd", self.whole / "run.usdc", "--out", self.whole)
        self.longest = self._duration(*whole)
        self.expected = results(self.whole)

    def _duration(self, *arguments):
        """How long a command takes [s]."""
        begin = time.perf_counter()
        ended(*arguments)
        return time.perf_counter() - begin

    def _strike(self, longest, *arguments):
        """Whether a command still ran at the moment it was killed."""
        return killed(self.chance.uniform(0.0, longest), *arguments)

    def _kill(self, kind, *arguments):
        done = self._strike(self.longest, *arguments)
        self.count[kind] = self.count.get(kind, 0) + done
        return done

    def run(self):
        """A run, killed until it is through, ends as one that never was."""
        folder = self.folder / "killed"
        shutil.rmtree(folder, ignore_errors=True)
        begin = ("run", self.folder / "plate.py", *self.options, "--usd", folder / "run.usdc", "--out", folder)
        going = self._kill("run", *begin)
        for _ in range(4):
            if not going:
                break
            going = self._kill("resume", *self._again(folder, begin))
            if (folder / "run.usdc").exists():
                layer(folder / "run.usdc")
        if going:
            ended(*self._again(folder, begin))
        assert results(folder) == self.expected

    @staticmethod
    def _again(folder, begin):
        if (folder / "checkpoint.npz").exists():
            return ("run", "--resume", folder, *OPTIONS)
        return (*begin, "--overwrite")

    def export(self):
        """A stage or a series is there with all its frames, or is not there; the next one is whole."""
        stage, series = self.folder / "e.usdc", self.folder / "e.pvd"
        for path in (stage, series):
            self._kill("export", "export", self.whole, path)
        if stage.exists():
            assert layer(stage) == self.expected["stage"]
        if series.exists():
            named = re.findall('file="(.*?)"', series.read_text())
            ends = [(self.folder / name).read_bytes()[-11:] for name in named]
            assert ends == [b"</VTKFile>\n"] * 7

    def plot(self):
        """A picture is whole or not there."""
        self._kill("plot", "plot", self.whole)
        picture = self.whole / "overview.png"
        assert not picture.exists() or picture.read_bytes().endswith(b"IEND\xaeB`\x82")
        assert results(self.whole) == self.expected

    def rare(self):
        """What the long form does as well."""
        return self.sweep, self.report

    def sweep(self):
        """No run of a killed sweep goes on without it; the same command goes on to the same table."""
        members = ("--set", "courant=0.5,0.6,0.7", "--out", self.folder / "sweep")
        command = ("sweep", self.folder / "plate.py", *members)
        self._kill_group("sweep", 8.0, *command, "--device", "cpu")
        subprocess.run([sys.executable, "-m", "warpsph", *command, *OPTIONS], check=True, timeout=300)
        with (self.folder / "sweep" / "sweep.csv").open(newline="") as file:
            assert [row["status"] for row in csv.DictReader(file)] == ["passed"] * 3
        shutil.rmtree(self.folder / "sweep")

    def report(self):
        """No worker of a killed report stays."""
        self._kill_group("report", 15.0, "report", "--quick", "--device", "cpu", "--out", self.folder / "report")

    def _kill_group(self, kind, longest, *arguments):
        os.environ[NUMBER] = number = str(uuid.uuid4())
        self._strike_group(longest, *arguments)
        del os.environ[NUMBER]
        self.count[kind] = self.count.get(kind, 0) + 1
        limit = time.monotonic() + 30.0
        while (left := having(number)) and time.monotonic() < limit:
            time.sleep(0.2)
        assert not left, f"{kind} left {left}"

    def _strike_group(self, longest, *arguments):
        """Kill the parent alone: those that it has started must notice."""
        command = [sys.executable, "-m", "warpsph", *map(str, arguments)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        time.sleep(self.chance.uniform(1.0, longest))
        process.kill()
        process.wait()


def having(number):
    """Processes with that number in their environment."""
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            content = path.read_bytes()
        except OSError:
            continue
        if f"{NUMBER}={number}".encode() in content:
            found.append(path.parent.name)
    return found


def main_of(kind):
    """Of a module that strikes: FOLDER COUNT SEED."""
    os.environ["NO_SIGNAL"] = "yes"
    kills, most = kind(Path(sys.argv[1]), int(sys.argv[3])), int(sys.argv[2])
    kinds = [kills.run, kills.export, kills.plot, kills.run, kills.export]
    if most >= 50:
        kinds += [kills.run, kills.plot, *kills.rare()]
    turn = 0
    try:
        while sum(kills.count.values()) < most:
            kinds[turn % len(kinds)]()
            turn += 1
    finally:
        print(kills.count, flush=True)


if __name__ == "__main__":
    main_of(Kills)
