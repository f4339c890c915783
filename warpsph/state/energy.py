"""The energy of a body, and where it came from: what the balance of a run is made of."""

from __future__ import annotations

from dataclasses import dataclass, fields

UNITS = {1: "J/m²", 2: "J/m", 3: "J"}  # of a bar for its section, of plane strain for its thickness

TAKEN = ("kinetic", "elastic", "flow", "viscous", "damping", "remade")  # where it is, or went
LOSSES = TAKEN[2:5]
GIVEN = ("gravity", "loads", "walls", "tools")  # where it came from
COLUMNS = (*TAKEN, *GIVEN, "unaccounted")


@dataclass(frozen=True, kw_only=True)
class Energy:
    """An energy balance since the start of a run [J, J/m in plane strain, J/m² in a bar] (METHOD section 8).

    Attributes:
        kinetic: of the motion now.
        elastic: taken by elastic strain, with what the initial stress had.
        flow: taken by the material's flow.
        viscous: taken by the viscosity of the scheme.
        damping: taken by the scene's damping.
        remade: taken by cells that were made anew.
        gravity: work of the body force on the body.
        loads: work of tractions on the body.
        walls: work of the conditions on velocities on the body.
        tools: work of the tools on the body: their friction takes it, where nodes land as well.
        initial: kinetic and elastic at the start.
    """

    kinetic: float
    elastic: float
    flow: float
    viscous: float
    damping: float
    remade: float
    gravity: float
    loads: float
    walls: float
    tools: float
    initial: float

    @property
    def unaccounted(self) -> float:
        """What is there, or was taken, and never came in; negative where energy has vanished."""
        taken, given = (sum(getattr(self, name) for name in names) for names in (TAKEN, GIVEN))
        return taken - (self.initial + given)

    @property
    def amiss(self) -> float:
        """What can not be true: `unaccounted`, or what a loss has given, where that is more."""
        given = -min(getattr(self, name) for name in LOSSES)
        return self.unaccounted if abs(self.unaccounted) >= given else given

    @property
    def largest(self) -> float:
        """The largest magnitude in the balance."""
        return max(abs(getattr(self, field.name)) for field in fields(self))

    def columns(self) -> dict[str, float]:
        """What changes in the course of a run, by name."""
        return {name: getattr(self, name) for name in COLUMNS}
