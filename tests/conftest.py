"""Shared by all tests: the devices to run on, and the material that the docs add."""

import sys

import pytest
import warp as wp

from tests.documents import LAW, ROOT, blocks, run_as_module
from warpsph.materials import LAWS
from warpsph.scene.document import types
from warpsph.simulation.device import start_warp

MAXWELL = "warpsph.materials.maxwell"

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


@pytest.fixture(scope="session")
def _maxwell_file(tmp_path_factory):
    block = next(block for block in blocks(ROOT / "docs/materials.md", "python") if block.startswith(LAW))
    return run_as_module(MAXWELL, block, tmp_path_factory.mktemp("materials"))


@pytest.fixture
def maxwell(_maxwell_file, monkeypatch):
    """The material that docs/materials.md adds, as if its file and its row were there."""
    monkeypatch.setitem(sys.modules, MAXWELL, _maxwell_file)
    monkeypatch.setitem(LAWS, _maxwell_file.Maxwell, _maxwell_file.maxwell)
    types.cache_clear()
    yield _maxwell_file
    types.cache_clear()
