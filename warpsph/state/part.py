"""What the stepper drives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import warp as wp


class Part(Protocol):
    """A part of the state that the host has to renew now and then: pair lists, a free surface, cells.

    Attributes:
        kernels: all that it launches in a step, to be compiled before the first.
    """

    kernels: Sequence[wp.Kernel]

    def refresh(self) -> None:
        """Renew it for the present configuration: when its flag is up, or that of a part it depends on."""
