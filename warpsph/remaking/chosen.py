"""Nodes that were chosen, side by side in the order of their indices, by a scan."""

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher


class Chosen:
    """A choice among nodes.

    Args:
        n: number of nodes.
        launcher: launches the kernel.

    Attributes:
        flags: 1 for a node that is chosen, else 0, shape (n,).
        kernels: all that it launches.
    """

    def __init__(self, n: int, launcher: Launcher):
        self._launcher, self.kernels = launcher, (_gather,)
        self.flags, self._last, self._nodes = (
            wp.zeros(n, dtype=wp.int32, device=launcher.device) for _ in range(3)
        )

    def nodes(self) -> wp.array | None:
        """Indices of those that are chosen; None if there are none."""
        wp.utils.array_scan(self.flags, self._last, inclusive=True)
        count = int(self._last[-1:].numpy()[0])
        if not count:
            return None
        self._launcher.launch(_gather, self.flags, [self.flags, self._last, self._nodes])
        return self._nodes[:count]


@forward_kernel
def _gather(
    first: int,
    flags: wp.array(dtype=wp.int32),
    last: wp.array(dtype=wp.int32),
    nodes: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    if flags[i] != 0:
        nodes[last[i] - 1] = i
