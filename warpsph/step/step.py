"""What every scheme's stepper has in common: many steps recorded once, and made without a word from the host."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from ..device.launching import Launcher, Recording
from ..state.clock import Clock, Outcome
from ..state.energy import Energy
from ..state.part import Part


class Stepper(ABC):
    """The state of a scene on a device, and the functions that advance it.

    Args:
        launcher: launches the kernels.
        clock: what differs from step to step.
        parts: what the host renews now and then, each after those that it depends on.

    Attributes:
        body: nodes, cells and material.
        conditions: boundary conditions.
        clock, parts: those given.
        builds: how often lists of neighbours were built.
    """

    builds = 0

    def __init__(self, launcher: Launcher, clock: Clock, *, parts: Sequence[Part]):
        self.clock, self.parts, self._launcher = clock, tuple(parts), launcher
        self._recording: Recording | None = None
        self._recorded: tuple[int, ...] | None = None

    @property
    @abstractmethod
    def shrinkage(self) -> float:
        """Least time of a wave from node to node over the initial one, at most 1."""

    @abstractmethod
    def step(self) -> None:
        """Advance the nodes by the clock's Δt; it ends with the clock's tick."""

    def energy(self) -> Energy | None:
        """The energy balance since t = 0; None where the scheme keeps no books."""
        return None

    def arrays_recorded(self) -> tuple[int, ...]:
        """Addresses of arrays that may be replaced: the step is then recorded anew."""
        return ()

    def advance(self, times: Sequence[float], dt: float) -> Outcome:
        """Make a step from each of the times to Δt later; fewer when the host is needed before.

        Args:
            times: where the steps begin [s], at most `LONGEST_RUN` of them.
            dt: time step [s].

        Returns:
            How many were made, at least one. When something can not be true, the last step is the first with it.
        """
        self.clock.begin(times, dt)
        self._record().run()
        outcome = self.clock.outcome()
        if outcome.outdated is not None and outcome.fault is None:
            for part in self.parts[outcome.outdated :]:
                part.refresh()
        return outcome

    def _record(self) -> Recording:
        """The step, recorded anew where it has got new arrays."""
        content = self.arrays_recorded()
        if self._recorded != content:
            self._recording = self._launcher.record(self.step, self.clock.going)
            self._recorded = content
        return self._recording
