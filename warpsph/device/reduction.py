"""The largest magnitude in an array, and the sum of one, found on the device.

To copy an array from a GPU and look at it on the host takes as long as many steps; here one value comes for every
`SHARE` of them.
"""

from functools import cache

import warp as wp

from .compiling import forward_kernel
from .launching import Launcher
from .precision import Precision

SHARE = 64


class LargestMagnitude:
    """The largest |value| of arrays of one length.

    Args:
        n: their number of values, vectors' components counted.
        precision: of their values.
        launcher: launches the kernel.
    """

    def __init__(self, n: int, precision: Precision, launcher: Launcher):
        self._n, self._real, self._launcher = n, precision.real, launcher
        self._kernel = _largest_kernel(precision)
        self._largest = wp.zeros(-(-n // SHARE), dtype=precision.real, device=launcher.device)
        self.kernels = (self._kernel,)

    def of(self, array: wp.array) -> float:
        """max |value| of a contiguous array of scalars or vectors."""
        values = wp.array(ptr=array.ptr, shape=self._n, dtype=self._real, device=array.device)
        self._launcher.launch(self._kernel, self._largest, [values, self._largest])
        return float(self._largest.numpy().max())


class Sum:
    """The sum of float64 arrays of one length, in an order that does not depend on who adds up.

    Args:
        n: their length.
        launcher: launches the kernel.
    """

    def __init__(self, n: int, launcher: Launcher):
        self._launcher = launcher
        self._partial = wp.zeros(-(-n // SHARE), dtype=wp.float64, device=launcher.device)
        self.kernels = (_partial_sums,)

    def of(self, array: wp.array) -> float:
        """Σ of the values."""
        self._launcher.launch(_partial_sums, self._partial, [array, self._partial])
        return float(self._partial.numpy().sum())


@forward_kernel
def _partial_sums(first: int, values: wp.array(dtype=wp.float64), result: wp.array(dtype=wp.float64)):
    k = first + wp.tid()
    total = wp.float64(0.0)
    for n in range(SHARE * k, wp.min(SHARE * (k + 1), values.shape[0])):
        total += values[n]
    result[k] = total


@cache
def _largest_kernel(precision: Precision):
    real = precision.real

    @forward_kernel
    def largest(first: int, values: wp.array(dtype=real), result: wp.array(dtype=real)):
        k = first + wp.tid()
        most = real(0.0)
        for n in range(SHARE * k, wp.min(SHARE * (k + 1), values.shape[0])):
            most = wp.max(most, wp.abs(values[n]))
        result[k] = most

    return largest
