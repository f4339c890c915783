"""The progress bar of a run on a terminal: simulated time, step rate, remaining time."""

from __future__ import annotations

import math
import threading

from tqdm import tqdm

from ..simulation.simulation import Simulation

# In place of tqdm's, a semaphore that other processes know as well: one that is told to end would leave it behind.
tqdm.set_lock(threading.RLock())


def bar(show: bool, **options) -> tqdm:
    """A bar, to be closed; with `show` false it shows nothing."""
    return tqdm(disable=not show, leave=False, **options)


class Progress:
    """An observer that shows a bar on a terminal, and nothing elsewhere.

    Args:
        simulation: the simulation.
        end: simulated time at which the run ends [s].
        show: whether to show the bar at all.
    """

    def __init__(self, simulation: Simulation, end: float, show: bool):
        self._bar = bar(
            show,
            total=end,
            initial=simulation.time,
            mininterval=0.2,
            bar_format="{percentage:3.0f}%|{bar}| t = {n:.4g}/{total:.4g} s, {elapsed}<{remaining}{postfix}",
        )
        self._first_step = simulation.steps
        self.next_time = math.inf  # any time will do

    def observe(self, simulation: Simulation) -> None:
        """Move the bar."""
        if self._bar.disable:
            return
        elapsed = self._bar.format_dict["elapsed"]
        if elapsed > 0.0:
            rate = (simulation.steps - self._first_step) / elapsed
            self._bar.set_postfix_str(f"{rate:.0f} steps/s", refresh=False)
        self._bar.update(min(simulation.time, self._bar.total) - self._bar.n)

    def close(self) -> None:
        """Remove the bar."""
        self._bar.close()
