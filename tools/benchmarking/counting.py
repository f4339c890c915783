"""Counts what a step moves and computes, from the arrays a simulation really has.

Bytes: the least a step can move to and from memory, each array of a kernel once, elements whole (a kernel that
changes one field of a packed struct moves all of it). Gathered neighbours count once a sweep: nodes are stored row
by row, so that caches hold those of neighbouring targets. List builds are left out; they come once in a while.
"""

import operator
import resource
import sys

import warp as wp

from warpsph import Simulation
from warpsph.state.pairs import PairList

# phase: (times a step, arrays read, arrays written), as attributes of the stepper, for the default numerics;
# pair lists count their entries.
TRAFFIC = {
    "sources": (
        2,
        ("body.nodes.point", "body.nodes.velocity_gradient", "body.internals"),
        ("body.nodes.point", "body.internals"),
    ),
    "to_auxiliary": (
        1,
        (
            "lists.around_auxiliary",
            "body.nodes.point",
            "body.nodes.volume",
            "body.nodes.velocity_gradient",
            "body.internals",
            "body.auxiliary.point",
            "body.auxiliary.smoothing_length",
            "body.auxiliary.density",
            "body.auxiliary.cell",
        ),
        ("body.auxiliary.point", "fluxes._cells"),
    ),
    "to_nodes": (
        1,
        (
            "lists.around_nodes",
            "body.auxiliary.point",
            "body.auxiliary.volume",
            "fluxes._cells",
            "body.node_cells.place",
            "body.nodes.point",
            "body.nodes.smoothing_length",
            "body.nodes.density",
            "body.nodes.velocity_gradient",
            "conditions.table.held.row",
        ),
        ("body.nodes.point", "body.nodes.half_velocity", "body.nodes.velocity_gradient"),
    ),
    "conditions": (
        1,
        (
            "body.nodes.point",
            "body.nodes.displacement",
            "body.nodes.velocity_gradient",
            "conditions.table.held.row",
        ),
        ("body.nodes.point",),
    ),
    "motion": (
        1,
        (
            # the nodes move
            "body.nodes.point",
            "body.nodes.displacement",
            "body.nodes.half_velocity",
            "body.nodes.reference",
            # the cells are measured
            "body.nodes.point",
            "body.auxiliary.cell",
            "body.auxiliary.point",
            "lists.motion._initial_volume",
            "lists.motion._mass",
            "lists.motion._cell_h",
            # the nodes get their share
            "body.auxiliary.volume",
            "body.auxiliary.smoothing_length",
            "body.node_cells.place",
            "body.nodes.weight",
            "body.nodes.displacement",
            "lists.motion._listed",
            "lists.motion._listed_h",
        ),
        (
            "body.nodes.point",
            "body.nodes.displacement",
            "body.auxiliary.point",
            "body.auxiliary.volume",
            "body.auxiliary.density",
            "body.auxiliary.smoothing_length",
            "body.nodes.volume",
            "body.nodes.density",
            "body.nodes.smoothing_length",
        ),
    ),
}


def pairs(pair_list: PairList) -> int:
    """Entries of a pair list."""
    return int(pair_list.start[-1:].numpy()[0])


def bytes_per_node_step(simulation: Simulation, phases) -> dict[str, float]:
    """Bytes moved a material node and step, by phase, for those phases that the scene has."""
    stepper, n = simulation.stepper, len(simulation.mesh.nodes)
    return {
        phase: times * sum(_size(stepper, name) for name in (*read, *written)) / n
        for phase, (times, read, written) in TRAFFIC.items()
        if phase in phases
    }


def _size(stepper, name: str) -> int:
    found = operator.attrgetter(name)(stepper)
    if name.startswith("lists.around"):
        return 4 * (pairs(found) + found.start.shape[0])
    return 0 if found is None else _bytes(found)


def _bytes(array: wp.array) -> int:
    return array.size * wp.types.type_size_in_bytes(array.dtype)


def flops_per_node_step(simulation: Simulation) -> float:
    """Floating-point operations of the two sweeps a material node and step; exp and division count as one.

    With p unknowns in d dimensions a pair costs 5d + 4 + 3p + 2pd + 2d² (`warpsph.operators.neighbour_sums`), a
    target's value and gradient 4p + 2pd + 2pd² beside the small inverse. Sources and motion are not counted.
    """
    stepper, continuum = simulation.stepper, simulation.mesh.continuum
    d, p = continuum.dim, continuum.dim + continuum.stress_size
    entries = pairs(stepper.lists.around_auxiliary) + pairs(stepper.lists.around_nodes)
    n, m = len(simulation.mesh.nodes), len(simulation.mesh.cells)
    a_pair = 5 * d + 4 + 3 * p + 2 * p * d + 2 * d * d
    a_target = 4 * p + 2 * p * d + 2 * p * d * d
    return (entries * a_pair + (n + m) * a_target) / n


def memory_per_node(simulation: Simulation) -> float:
    """Bytes of all Warp arrays of the simulation a material node; what a hash grid holds inside is not seen."""
    found: dict[int, int] = {}
    _collect_arrays(simulation.stepper, found, set())
    return sum(found.values()) / len(simulation.mesh.nodes)


def _collect_arrays(thing, found: dict[int, int], seen: set[int]) -> None:
    """Address → bytes of the arrays held by objects of warpsph and Warp's structs, however deep."""
    if isinstance(thing, wp.array):
        found[thing.ptr] = max(thing.capacity, _bytes(thing))  # a view has no capacity
    elif id(thing) not in seen:
        seen.add(id(thing))
        if isinstance(thing, (tuple, list)):
            children = thing
        elif hasattr(thing, "_ctype") or type(thing).__module__.startswith("warpsph."):
            children = vars(thing).values() if hasattr(thing, "__dict__") else ()
        else:
            children = ()
        for child in children:
            _collect_arrays(child, found, seen)


def peak_host_memory() -> int:
    """Largest resident memory of this process so far [bytes]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
