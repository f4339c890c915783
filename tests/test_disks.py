"""Disks that fill up or go away: one line, and what is there is whole."""

import subprocess
import sys

import pytest

OWN_MOUNTS = ["unshare", "--user", "--map-root-user", "--mount"]


def _mounts():
    """Whether a process may have mounts of its own here."""
    try:
        return subprocess.run([*OWN_MOUNTS, "true"], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not _mounts(), reason="no mounts of one's own on this system")
@pytest.mark.parametrize("count", [6, pytest.param(200, marks=pytest.mark.long)])
def test_full_and_vanishing_disks_leave_whole_files_and_one_line(count, tmp_path):
    """Runs, resumed runs, exports to USD and VTK; in the long form sweeps as well. Then all goes on as ever."""
    disk = tmp_path / "disk"
    disk.mkdir()
    command = [*OWN_MOUNTS, sys.executable, "-m", "tests.filling", str(disk), str(count), "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
