"""Shared by all tests: the devices to run on."""

import pytest
import warp as wp

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
