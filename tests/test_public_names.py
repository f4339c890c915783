"""`import warpsph` is light, and all that is public is there when it is asked for."""

import subprocess
import sys

import pytest

import warpsph


def test_importing_the_package_imports_nothing_heavy():
    """Else there is a time at the start of every command in which nobody answers a signal."""
    code = "import sys, warpsph.__main__; print({'warp', 'numpy', 'argparse', 'typing'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_public_names_are_there_for_whoever_asks():
    code = (
        "import warpsph\n"
        "assert {*warpsph.__all__} < {*dir(warpsph)}, 'before any was asked for'\n"
        "from warpsph import *\n"
        "assert Scene is warpsph.Scene and analysis.fit_band and frames.Frames\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert all(getattr(warpsph, name) is not None for name in warpsph.__all__)


def test_name_that_is_not_public_is_no_attribute():
    with pytest.raises(AttributeError, match="module 'warpsph' has no attribute 'Sceme'"):
        _ = warpsph.Sceme
    with pytest.raises(ImportError, match="cannot import name 'Sceme'"):
        exec("from warpsph import Sceme")


def test_an_import_that_fails_says_why(monkeypatch):
    def fails(name, package):
        raise AttributeError("the cause")

    monkeypatch.setattr(warpsph, "import_module", fails)
    with pytest.raises(ImportError, match="the cause"):
        warpsph.__getattr__("Box")
