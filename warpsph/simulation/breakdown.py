"""What ended a run: where it was seen, and what may have led there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import BreakdownError, NonFiniteError
from ..state.energy import UNITS

FLATTENED, UNACCOUNTED = "flattened", "unaccounted"
# Steps shorter than this share of the first are no way to the end of a run.
LEAST_STEP_SHARE = 0.01
# Of the largest energy in the balance. Motions that a lattice resolves stay near 1 %; white noise of all nodes, of
# which viscosity takes all within a few steps, comes to 6 % in the plane, in space it came to 22 % at Courant 1
# (docs/method.md, section 8). What is unstable grows through any bound.
MOST_UNACCOUNTED = 1.0 / 3.0


def breakdown(simulation, fault: str, dt: float) -> BreakdownError:
    """The error of a fault, one of `warpsph.state.clock.FAULTS`, `FLATTENED` or `UNACCOUNTED`.

    Args:
        simulation: where it was seen, after the step.
        fault: what it is.
        dt: the step's length [s].
    """
    kind, seen = _SEEN[fault]
    with np.errstate(all="ignore"):  # positions may be anything by now
        what, node, advice = seen(simulation, dt)
    place = simulation.mesh.nodes[node]
    return kind(what, step=simulation.steps, time=simulation.time, node=node, position=place, advice=advice)


def _non_finite(simulation, dt: float) -> tuple[str, int, str]:
    values = [simulation.nodes.point.numpy()["phi"], simulation.nodes.displacement.numpy()]
    node = int(np.argmin(np.isfinite(np.hstack(values)).all(axis=1)))
    return "velocity, stress or displacement became non-finite", node, "since the state can not be advanced"


def _folded(simulation, dt: float) -> tuple[str, int, str]:
    mesh = simulation.mesh
    jacobians = mesh.with_nodes(simulation.field("position")).cell_jacobians()
    boxes = np.linalg.norm(jacobians, axis=1).prod(axis=1)
    cell = int(np.argmin(np.linalg.det(jacobians) / boxes))
    advice = "since a folded cell has no inside; material that is sheared by several cells needs larger ones"
    return f"cell {cell} folded, nodes {_nodes(mesh, cell)},", int(mesh.cells[cell, 0]), advice


def _too_fast(simulation, dt: float) -> tuple[str, int, str]:
    rates = np.sqrt((simulation.field("velocity_gradient") ** 2).sum(axis=(1, 2)))
    node = int(np.argmax(np.nan_to_num(rates, nan=np.inf)))
    what = f"neighbours part faster than waves, velocity gradient {rates[node]:.3g} 1/s,"
    return (
        what,
        node,
        "since it is unstable, or driven faster than its waves travel",
    )


def _flattened(simulation, dt: float) -> tuple[str, int, str]:
    jacobians = simulation.mesh.with_nodes(simulation.field("position")).cell_jacobians()
    cell = int(np.argmin(np.linalg.svd(jacobians, compute_uv=False).min(axis=1)))
    what = f"cell {cell} is so flat that the time step is {simulation.time_step_limit:.3g} s,"
    advice = f"since less than {LEAST_STEP_SHARE:g} of the first time step leads nowhere; larger cells fold later"
    return what, int(simulation.mesh.cells[cell, 0]), advice


def _unaccounted(simulation, dt: float) -> tuple[str, int, str]:
    balance, unit = simulation.energy(), UNITS[simulation.mesh.dim]
    largest = max(simulation.largest_energy, balance.largest)
    did = "came from nowhere" if balance.amiss > 0.0 else "vanished"
    what = f"{abs(balance.amiss):.3g} {unit} of energy {did}, {100.0 * abs(balance.amiss) / largest:.3g} %"
    what = f"{what} of the largest in the balance,"
    mesh = simulation.mesh.with_nodes(simulation.field("position"))
    smallest = mesh.corner_volumes().min(axis=1)
    if smallest.min() <= 0.0:
        cell = int(np.argmin(smallest / mesh.cell_volumes()))
        advice = f"since corners folded, above all of cell {cell}, nodes {_nodes(mesh, cell)}"
        return what, int(mesh.cells[cell, 0]), advice
    speeds = (simulation.field("velocity") ** 2).sum(axis=1)
    return what, int(np.argmax(speeds)), "since it is unstable (at the fastest node), or its time step is too long"


def _nodes(mesh, cell: int) -> str:
    return ", ".join(map(str, mesh.cells[cell]))


_SEEN: dict[str, tuple[type[BreakdownError], Callable]] = {
    "non_finite": (NonFiniteError, _non_finite),
    "folded": (BreakdownError, _folded),
    "too_fast": (BreakdownError, _too_fast),
    FLATTENED: (BreakdownError, _flattened),
    UNACCOUNTED: (BreakdownError, _unaccounted),
}
