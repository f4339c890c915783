"""What differs from step to step, on the device, so that many steps need no word from the host.

Functions of time are evaluated ahead, a row a step; after each step `tick` puts the next row in place. It ends the
run of steps when all are made, or when a flag says that the host is needed: to build lists, to find the free
surface, or because a value is not finite.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..physics.space import Space

LONGEST_RUN = 256  # steps
HALF, END = 0, 1  # rows of `Clock.drive`
# What ends a run because it can not be true, in the order in which it is told.
FAULTS = ("non_finite", "folded", "too_fast")
NON_FINITE, FOLDED, TOO_FAST = 0, 1, 2
FIRST_FAULT, MOST_FLAGS = 2, 2  # where faults stand in the status; how many flags follow them, at most
FIRST_FLAG = FIRST_FAULT + len(FAULTS)
STAGES = 5  # t, t + Δt/4, …, t + Δt: the classical scheme needs both ends and the middle of each half step


class Outcome(NamedTuple):
    """What the steps came to.

    Attributes:
        made: how many were made.
        fault: what can not be true, one of `FAULTS`, or None.
        outdated: the number of the first flag that a kernel has raised, in the order of `Clock.new_flag`, or None.
    """

    made: int
    fault: str | None
    outdated: int | None


class Clock:
    """Loads and drives of the step that is next, and flags.

    Args:
        body_force: f(t) → b [m/s²], or None.
        functions: the prescribed motions' functions of time, or constants.

    Attributes:
        time_step: Δt [s].
        forces: b at t, t + Δt/4, …, t + Δt.
        first_half, second_half: of these, at the start, the middle and the end of each half step.
        drive: values of the functions, those at t + Δt/2 in row `HALF`, those at t + Δt in row `END`.
        faults: an integer each of `FAULTS`, set by kernels.
        going: 1 while steps are to be made.
        kernels: the kernel of `tick`.
    """

    def __init__(
        self,
        body_force: Callable[[float], np.ndarray] | None,
        functions: Sequence,
        space: Space,
        launcher: Launcher,
    ):
        vector, real, device = space.vec(space.dim), space.real, launcher.device
        self._launcher, self._body_force, self._functions = launcher, body_force, functions
        columns = max(1, len(functions))
        self._forces = wp.zeros((LONGEST_RUN, STAGES), dtype=vector, device=device)
        self._drives = wp.zeros((LONGEST_RUN, 2 * columns), dtype=real, device=device)
        self.forces = wp.zeros(STAGES, dtype=vector, device=device)
        self._drive = wp.zeros(2 * columns, dtype=real, device=device)
        self.drive = self._drive.reshape((2, columns))
        self.time_step = wp.zeros(1, dtype=real, device=device)
        # Steps made, steps to make, faults, flags.
        self._status = wp.zeros(FIRST_FLAG + MOST_FLAGS, dtype=wp.int32, device=device)
        self._flags = 0
        self.going = wp.zeros(1, dtype=wp.int32, device=device)
        self.first_half, self.second_half = self.forces[:3], self.forces[2:]
        self.faults = self._status[FIRST_FAULT:FIRST_FLAG]
        self._tick = _tick_kernel(space)
        self.kernels = (self._tick,)

    def new_flag(self) -> wp.array:
        """One integer that a kernel sets where the host must do something before the next step."""
        self._flags += 1
        return self._status[FIRST_FLAG + self._flags - 1 : FIRST_FLAG + self._flags]

    def begin(self, times: Sequence[float], dt: float) -> None:
        """Get ready for the steps from each of the times [s], at most `LONGEST_RUN`, to Δt later."""
        half = 0.5 * dt
        write_values(self.time_step, (dt,))
        if self._body_force is not None:
            stages = [(t, t + 0.5 * half, t + half, t + half + 0.5 * half, t + half + half) for t in times]
            forces = np.array([[self._body_force(t) for t in row] for row in stages], dtype=float)
            write_values(self._forces[: len(times)], forces)
            write_values(self.forces, forces[0])
        if self._functions:
            ends = [(t + half, t + dt) for t in times]
            drives = np.array([[_value(f, t) for t in row for f in self._functions] for row in ends])
            write_values(self._drives[: len(times)], drives)
            write_values(self._drive, drives[0])
        write_values(self._status[:2], (0, len(times)))
        write_values(self.going, (1,))

    def tick(self) -> None:
        """Close a step: go on to the next, or end."""
        inputs = [self._forces, self._drives, self.forces, self._drive, self._status, self.going]
        self._launcher.launch(self._tick, self.going, inputs)

    def outcome(self) -> Outcome:
        """What the steps since `begin` came to."""
        status = self._status.numpy().tolist()
        fault = next((name for name, raised in zip(FAULTS, status[FIRST_FAULT:], strict=False) if raised), None)
        flag = next((k for k, raised in enumerate(status[FIRST_FLAG:]) if raised), None)
        return Outcome(status[0], fault, flag)


def _value(function, t: float) -> float:
    return function(t) if callable(function) else function


def write_values(array: wp.array, values) -> None:
    """Write values into an array; on the CPU without the cost of a transfer."""
    if array.device.is_cpu:
        array.numpy()[...] = values
    else:
        array.assign(np.array(values))


@cache
def _tick_kernel(space: Space):
    vector, real = space.vec(space.dim), space.real

    @forward_kernel
    def tick(
        first: int,
        forces: wp.array2d(dtype=vector),
        drives: wp.array2d(dtype=real),
        force: wp.array(dtype=vector),
        drive: wp.array(dtype=real),
        status: wp.array(dtype=wp.int32),
        going: wp.array(dtype=wp.int32),
    ):
        made = status[0] + 1
        status[0] = made
        raised = wp.int32(0)
        for k in range(FIRST_FAULT, status.shape[0]):
            raised += status[k]
        if made >= status[1] or raised > 0:
            going[0] = 0
            return
        for k in range(force.shape[0]):
            force[k] = forces[made, k]
        for k in range(drive.shape[0]):
            drive[k] = drives[made, k]

    return tick
