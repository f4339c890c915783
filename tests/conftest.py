"""Shared by all tests: the devices to run on, and the material that the docs add."""

import sys

import pytest
import warp as wp

from tests.documents import LAW, ROOT, blocks, run_as_module
from tests.undrawn import as_a_dot
from warpsph.scene.registry import KERNELS, MATERIALS, SCHEMES, register
from warpsph.simulation.device import start_warp

start_warp()


def _cuda():
    absent = pytest.mark.skipif(not wp.is_cuda_available(), reason="no CUDA device on this machine")
    return pytest.param("cuda:0", marks=[pytest.mark.cuda, absent])


@pytest.fixture(params=["cpu", _cuda()])
def device(request):
    """Each device the test runs on: the CPU, and a GPU where there is one."""
    return request.param


@pytest.fixture(params=["float64", "float32"])
def precision(request):
    """Both precisions."""
    return request.param


@pytest.fixture
def undrawn(monkeypatch):
    """Pictures are files of one dot: for tests about other things."""
    as_a_dot(monkeypatch)


@pytest.fixture
def registered():
    """What a test registers is known to itself only."""
    kept = [(table, dict(table)) for table in (MATERIALS, KERNELS, SCHEMES)]
    yield
    for table, rows in kept:
        table.clear()
        table.update(rows)


@pytest.fixture(scope="session")
def _maxwell_file(tmp_path_factory):
    block = next(block for block in blocks(ROOT / "docs/materials.md", "python") if block.startswith(LAW))
    module = run_as_module("maxwell", block, tmp_path_factory.mktemp("materials"))
    del MATERIALS["Maxwell"], sys.modules["maxwell"]
    return module


@pytest.fixture
def maxwell(_maxwell_file, registered, monkeypatch):
    """The file of one's own that docs/materials.md adds a material by, imported."""
    monkeypatch.setitem(sys.modules, "maxwell", _maxwell_file)
    register(_maxwell_file.Maxwell)
    return _maxwell_file
