"""What a scheme must be: everything that depends on how velocities and stresses are advanced, in one record.

A scheme is one file in `warpsph.step` and one row in `warpsph.step.scheme`, which registers it. A scene names it,
and nothing else in the package asks for a name. Its parts that need Warp are made with a simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..errors import SceneError, one_of
from ..mesh.kinds import CellKind
from ..mesh.mesh import Mesh


class Fluxes(Protocol):
    """Steps 3-10 of a body, the waves: built as `fluxes(body, conditions=…, around_auxiliary=…, around_nodes=…)`.

    Attributes:
        kernels: all that it launches.
    """

    kernels: Sequence

    def to_auxiliary(self, dt) -> None:
        """Steps 3-6: from φ_s at the nodes to the half step at the auxiliary nodes."""

    def to_nodes(self, dt) -> None:
        """Steps 7-10: φ_node^{n+1/2} with the conditions at t + Δt/2, then φ_adv."""


@dataclass(frozen=True, kw_only=True)
class Sums:
    """What only a scheme of sums over neighbours has, which a smoothing kernel weighs.

    Attributes:
        fluxes: makes its `Fluxes`.
        largest_support: radius of the kernel's support over spacing [-].
    """

    fluxes: Callable[..., Fluxes]
    largest_support: float = 6.0


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """A scheme.

    Attributes:
        name: what `Numerics.velocity_scheme` calls it.
        meaning: one line.
        stepper: makes what advances a scene, a `warpsph.step.step.Stepper`, as `stepper(scene, space, launcher)`.
        kinds: kinds of cell it can take.
        spacing: Δx of a mesh in the Courant number c_p Δt/Δx [m].
        courant_limit: up to which Courant number waves are stable; of sums it is 2 √m₂.
        sums: what it has besides where it takes sums over neighbours. It then takes a smoothing kernel, an edge
            without a condition keeps what traction it has, and a `FreeSurface` frees it; without sums such an edge
            is free.
    """

    name: str
    meaning: str
    stepper: Callable
    kinds: tuple[CellKind, ...]
    spacing: Callable[[Mesh], float] = Mesh.smallest_distance
    courant_limit: float | None = None
    sums: Sums | None = None

    @property
    def nodal_forces(self) -> bool:
        """Whether loads are forces on nodes, and what a condition takes up is one.

        Sums over neighbours have none: stresses of edge nodes are given tractions (`Condition.tractions`).
        """
        return self.sums is None

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
