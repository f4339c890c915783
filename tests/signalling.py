"""Sends signals to commands at random moments; `tests/test_signals.py` starts this in a process of its own."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time

from tests.killing_commands import Kills, main_of

# As the installed script begins: it says so, then runs the command.
BEGIN = "import os, sys; from warpsph.__main__ import main; os.write(1, b'.'); sys.exit(main())"
NUMBERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
TERMINALS = (signal.SIGINT, signal.SIGHUP)  # they reach all processes that belong to a terminal


def begun(*arguments, **changed):
    """A command in its first instruction, in a session of its own, with that environment beside ours."""
    process = subprocess.Popen(
        [sys.executable, "-c", BEGIN, *map(str, arguments)],
        env=os.environ | {"NO_SIGNAL": "yes"} | changed,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        text=True,
    )
    assert process.stdout.read(1) == "."
    return process


def struck(process, moment, number):
    """Exit status and standard error of a command that gets a signal at that moment [s]."""
    time.sleep(moment)
    with contextlib.suppress(ProcessLookupError):  # it was faster
        (os.killpg if number in TERMINALS else os.kill)(process.pid, number)
    errors = process.communicate(timeout=120)[1]
    return process.returncode, errors


class Signals(Kills):
    """As `Kills`, with signals that a command may answer: by one line, 128 + the number, and what it keeps."""

    def _duration(self, *arguments):
        begin, process = time.perf_counter(), begun(*arguments)
        assert process.communicate()[1] == "" and process.returncode == 0
        return 1.05 * (time.perf_counter() - begin)

    def _strike(self, longest, *arguments, **changed):
        number, moment = self.chance.choice(NUMBERS), self.chance.uniform(0.0, longest)
        status, errors = struck(begun(*arguments, **changed), moment, number)
        what = f"{number!r} to {arguments} after {moment:.3f} s: {status}\n{errors}"
        assert status in (0, 128 + number, -number), what
        assert all(line.startswith("warpsph: ") for line in errors.splitlines()), what
        assert not errors or status != 0, what
        return status != 0

    def _strike_group(self, longest, *arguments):
        self._strike(longest, *arguments)

    def rare(self):
        return self.building, self.sweep, self.report

    def building(self):
        """While kernels are built, into an empty cache; who builds them next finds none that is half there."""
        cache, out = self.folder / "cache", self.folder / "built"
        shutil.rmtree(cache, ignore_errors=True)
        command = ("run", self.folder / "plate.py", *self.options, "--out", out, "--overwrite")
        for _ in range(3):
            self.count["building"] = self.count.get("building", 0) + 1
            self._strike(8.0, *command, WARP_CACHE_PATH=str(cache))
        process = begun(*command, WARP_CACHE_PATH=str(cache))
        assert process.communicate()[1] == "" and process.returncode == 0
        assert (out / "history.csv").read_bytes() == self.expected["history.csv"]


if __name__ == "__main__":
    main_of(Signals)
