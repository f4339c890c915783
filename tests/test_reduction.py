"""The largest magnitude of an array: what NumPy finds, for any length and any number of threads."""

import numpy as np
import pytest
import warp as wp

from warpsph.device.launching import Launcher
from warpsph.device.precision import precision as precision_of
from warpsph.device.reduction import SHARE, LargestMagnitude


@pytest.mark.parametrize("n", [1, SHARE - 1, SHARE, SHARE + 1, 100 * SHARE + 7])
def test_largest_magnitude_wherever_it_stands(device, precision, n):
    values = np.random.default_rng(n).uniform(-1.0, 1.0, n).astype(precision)
    launcher = Launcher(wp.get_device(device), threads=2)
    for place in {0, n // 2, n - 1}:
        values[place] = -(2.0 + place)
        array = wp.array(values, device=device)
        assert LargestMagnitude(n, precision_of(precision), launcher).of(array) == np.abs(values).max()


def test_largest_component_of_vectors(device):
    points = np.arange(-9.0, 6.0, dtype=np.float32).reshape(5, 3)
    launcher = Launcher(wp.get_device(device))
    largest = LargestMagnitude(points.size, precision_of("float32"), launcher)
    assert largest.of(wp.array(points, dtype=wp.vec3, device=device)) == 9.0
