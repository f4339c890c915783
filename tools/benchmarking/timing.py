"""Times steps as a user makes them, and, apart from that, each phase of the step."""

import time
from collections import defaultdict

import warp as wp

from warpsph import Simulation

# The kernels of a step of the default scheme, in its order.
PHASES = ("kick", "strain", "rate", "rate_mean", "stress", "stress_mean", "sharpen", "force", "push")
REST = "rest"  # all else: the clock, reading flags, evaluating functions of time, Python
INTERVAL = 40  # steps


def advance(simulation: Simulation) -> None:
    """Run as a user does for an interval."""
    end = simulation.steps + INTERVAL
    while simulation.steps < end:
        left = end - simulation.steps
        simulation.run(until=simulation.time + left * (1.0 - 1e-9) * simulation.time_step_limit)


def time_steps(simulation: Simulation, seconds: float) -> dict:
    """Seconds a step, over intervals of so many steps.

    Args:
        simulation: fresh; its first interval is the warm-up.
        seconds: time to fill; at least one interval is timed.

    Returns:
        `steps` timed, `seconds_per_step` (median over the intervals, so that a disturbance
        does not count) and `spread` ((slowest − fastest)/median; None for a single interval).
    """
    advance(simulation)
    wp.synchronize_device(simulation.device)
    per_step, steps, end = [], 0, time.perf_counter() + seconds
    while not per_step or time.perf_counter() < end:
        begin, before = time.perf_counter(), simulation.steps
        advance(simulation)
        wp.synchronize_device(simulation.device)
        made = simulation.steps - before
        per_step.append((time.perf_counter() - begin) / made)
        steps += made
    per_step.sort()
    median = per_step[len(per_step) // 2]
    return {
        "steps": steps,
        "seconds_per_step": median,
        "spread": (per_step[-1] - per_step[0]) / median if len(per_step) > 1 else None,
    }


def time_phases(simulation: Simulation) -> dict[str, float]:
    """Share of each kernel in the time of the steps of an interval [-].

    The step is not recorded here, and the device is waited for after every kernel, so the sum is more than the
    same steps take otherwise.
    """
    stepper, launcher = simulation.stepper, simulation.stepper.body.launcher
    launch, spent, device = launcher.launch, defaultdict(float), simulation.device

    def timed(kernel: wp.Kernel, *arguments, **options):
        wp.synchronize_device(device)
        begin = time.perf_counter()
        launch(kernel, *arguments, **options)
        wp.synchronize_device(device)
        name = kernel.func.__name__
        spent[name if name in PHASES else REST] += time.perf_counter() - begin

    launcher.launch, stepper._record = timed, lambda: _Plain(stepper)
    begin = time.perf_counter()
    advance(simulation)
    wp.synchronize_device(device)
    total = time.perf_counter() - begin
    del launcher.launch, stepper._record
    spent[REST] += total - sum(spent.values())
    return {phase: seconds / total for phase, seconds in spent.items()}


class _Plain:
    """Steps made launch by launch."""

    def __init__(self, stepper):
        self.stepper = stepper

    def run(self) -> None:
        while self.stepper.clock.going.numpy()[0]:
            self.stepper.step()
