"""Commands killed at random moments: what is there is whole, and what goes on ends as if it had never stopped."""

import subprocess
import sys

import pytest


@pytest.mark.skipif(sys.platform != "linux", reason="it looks for processes in /proc")
@pytest.mark.parametrize("count", [6, pytest.param(100, marks=pytest.mark.long)])
def test_killed_commands_lose_nothing(count, tmp_path):
    """Runs, resumed runs, exports and pictures; in the long form sweeps and reports as well."""
    command = [sys.executable, "-m", "tests.killing_commands", str(tmp_path), str(count), "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
