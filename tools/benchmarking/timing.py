"""Times steps as a user makes them, and, apart from that, each phase of the step."""

import contextlib
import math
import operator
import time
from collections import defaultdict

import warp as wp

from warpsph import Simulation

# The parts of `Stepper.step` by phase: (attribute of the stepper, method).
PHASES = {
    "sources": ("_sources", "half_step"),
    "to_auxiliary": ("fluxes", "to_auxiliary"),
    "to_nodes": ("fluxes", "to_nodes"),
    "conditions": ("conditions", "apply"),
    "motion": ("lists.motion", "move"),
    "lists": ("lists", "refresh"),
}
REST = "rest"  # all else: the clock, reading flags, evaluating functions of time, Python
LONGEST_INTERVAL = 400  # steps; the scenes rebuild their lists every 40 or so


class _Builds:
    """An observer that ends a run when the pair lists have just been rebuilt."""

    next_time = math.inf

    def __init__(self, simulation: Simulation):
        self._builds = simulation.list_builds

    def observe(self, simulation: Simulation) -> None:
        if simulation.list_builds > self._builds:
            raise StopIteration


def advance_to_list_build(simulation: Simulation) -> int:
    """Run as a user does until the pair lists have just been rebuilt; the number of steps."""
    steps, limit = simulation.steps, simulation.time_step_limit
    with contextlib.suppress(StopIteration):
        simulation.run(until=simulation.time + LONGEST_INTERVAL * limit, observers=[_Builds(simulation)])
    return simulation.steps - steps


def time_steps(simulation: Simulation, seconds: float) -> dict:
    """Seconds a step, over whole intervals from one list build to the next.

    Args:
        simulation: fresh; its first interval is the warm-up.
        seconds: time to fill; at least one interval is timed.

    Returns:
        `steps` timed, `steps_per_list_build`, `seconds_per_step` (median over the intervals, so that a disturbance
        does not count) and `spread` ((slowest − fastest)/median; None for a single interval).
    """
    advance_to_list_build(simulation)
    wp.synchronize_device(simulation.device)
    per_step, steps, end = [], 0, time.perf_counter() + seconds
    while not per_step or time.perf_counter() < end:
        begin = time.perf_counter()
        made = advance_to_list_build(simulation)
        wp.synchronize_device(simulation.device)
        per_step.append((time.perf_counter() - begin) / made)
        steps += made
    per_step.sort()
    median = per_step[len(per_step) // 2]
    return {
        "steps": steps,
        "steps_per_list_build": steps / len(per_step),
        "seconds_per_step": median,
        "spread": (per_step[-1] - per_step[0]) / median if len(per_step) > 1 else None,
    }


def time_phases(simulation: Simulation) -> dict[str, float]:
    """Share of each phase in the time of the steps from one list build to the next [-].

    The step is not recorded here, and the device is waited for after every phase, so the sum is more than the same
    steps take otherwise.
    """
    stepper, spent = simulation.stepper, defaultdict(float)
    wrapped = []
    for phase, (part, method) in PHASES.items():
        owner = operator.attrgetter(part)(stepper)
        if not owner.kernels:
            continue  # an object that does nothing
        object.__setattr__(owner, method, _timed(getattr(owner, method), phase, spent, simulation.device))
        wrapped.append((owner, method))
    stepper._record = lambda: _Plain(stepper)
    wrapped.append((stepper, "_record"))
    begin = time.perf_counter()
    advance_to_list_build(simulation)
    wp.synchronize_device(simulation.device)
    total = time.perf_counter() - begin
    for owner, method in wrapped:
        object.__delattr__(owner, method)
    spent[REST] = total - sum(spent.values())
    return {phase: seconds / total for phase, seconds in spent.items()}


class _Plain:
    """Steps made launch by launch."""

    def __init__(self, stepper):
        self.stepper = stepper

    def run(self) -> None:
        while self.stepper.clock.going.numpy()[0]:
            self.stepper.step()


def _timed(function, phase: str, spent: dict[str, float], device: wp.Device):
    def timed(*arguments, **options):
        wp.synchronize_device(device)
        begin = time.perf_counter()
        result = function(*arguments, **options)
        wp.synchronize_device(device)
        spent[phase] += time.perf_counter() - begin
        return result

    return timed
