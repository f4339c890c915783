"""Notices what can not be true: it ends a run at once, where later steps would only hide where it began."""

from functools import cache

import warp as wp

from ..physics.space import Space
from ..state.clock import TOO_FAST

# In one step the surroundings of a node deform by no more than this share of their size. Waves cross less than a
# cell in a step: neighbours would part faster than waves travel. A body that moves as a whole may be of any speed.
MOST_A_STEP = 1.0


@cache
def watch_rate(space: Space) -> wp.Function:
    """(L, Δt, faults) → nothing; notes a rate at which no body can deform, NaN included."""
    most2 = space.real(MOST_A_STEP**2)

    @wp.func
    def watch(L: space.types.tensor, dt: space.real, faults: wp.array(dtype=wp.int32)):
        if not dt * dt * wp.ddot(L, L) < most2:
            faults[TOO_FAST] = 1

    return watch
