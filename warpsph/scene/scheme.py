"""What a scheme must be: everything that depends on how velocities and stresses are advanced, in one record.

A scheme is one file in `warpsph.step` and one row in `warpsph.step.scheme`, which registers it. A scene names it,
and nothing else in the package asks for a name. Its parts that need Warp are classes here, made with a
simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..errors import SceneError, one_of
from ..mesh.kinds import GRID_KINDS, CellKind
from ..mesh.mesh import Mesh


class Fluxes(Protocol):
    """Steps 3-10 of a body, the waves: built as `fluxes(body, conditions=…, around_auxiliary=…, around_nodes=…)`.

    Attributes:
        kernels: all that it launches.
    """

    kernels: Sequence

    def set_courant(self, courant: float) -> None:
        """The Courant number c_p Δt/Δx of the steps to come."""

    def to_auxiliary(self, dt) -> None:
        """Steps 3-6: from φ_s at the nodes to the half step at the auxiliary nodes."""

    def to_nodes(self, dt) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """A scheme.

    Attributes:
        name: what `Numerics.velocity_scheme` calls it.
        meaning: one line.
        fluxes: makes its `Fluxes`; None where `stepper` has passes of its own.
        motion: makes what moves the nodes (`warpsph.operators.motion`); None where `stepper` moves them.
        unloads: whether free edges lose their tractions by elastic unloading, and an edge without a condition is
            free; if not, they are cut off, and such an edge keeps what traction it has.
        follows_cells: whether kernels are stretched and turned with the cells, and so reach a stretched cell's
            corners; the time step then follows the cells too.
        courant_limit: (number of dimensions, m₂ [-]) → largest stable c_p Δt/Δx.
        largest_support: of a body of so many dimensions, radius over spacing [-].
        nodal_forces: whether loads are forces on nodes, and what a condition takes up is one; if not, loads are
            tractions that the stresses of edge nodes are given, see `Condition.tractions`.
        kinds: kinds of cell it can take.
        stepper: makes what advances a scene, a `warpsph.step.step.Stepper`; None for sums over neighbours.
        spacing: mesh → Δx of the Courant number [m].
    """

    name: str
    meaning: str
    fluxes: Callable[..., Fluxes] | None
    motion: Callable | None
    unloads: bool
    follows_cells: bool
    courant_limit: Callable[[int, float], float]
    largest_support: Callable[[int], float]
    nodal_forces: bool = False
    kinds: tuple[CellKind, ...] = tuple(GRID_KINDS.values())
    stepper: Callable | None = None
    spacing: Callable[[Mesh], float] = Mesh.smallest_distance

    def check_cells(self, mesh: Mesh) -> None:
        """Refuse cells of a kind that the scheme's sums do not know.

        Raises:
            SceneError: the mesh has such cells.
        """
        if mesh.kind not in self.kinds:
            allowed = f"velocity_scheme {self.name} takes a {mesh.dim}D body's cells as "
            known = ", ".join(kind.name for kind in self.kinds if kind.dim == mesh.dim)
            raise SceneError("cells", mesh.kind.name, f"{allowed}{known or 'nothing'} only")


SCHEMES: dict[str, Scheme] = {}


def scheme_of(name: str) -> Scheme:
    """The scheme of that name.

    Raises:
        SceneError: there is none.
    """
    if not isinstance(name, str) or name not in SCHEMES:
        raise SceneError("velocity_scheme", name, one_of(SCHEMES, name))
    return SCHEMES[name]


def wave_limit(dim: int, moment: float) -> float:
    """2 √m₂, the largest stable c_p Δt/Δx of the published sums (METHOD section 4)."""
    return 2.0 * math.sqrt(moment)
