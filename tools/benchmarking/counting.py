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

# phase: (times a step, arrays read, arrays written), as attributes of the stepper, for the default numerics;
# "pairs" are list entries.
TRAFFIC = {
    "sources": (2, ("nodes.point", "nodes.velocity_gradient", "history"), ("nodes.point", "history")),
    "to_auxiliary": (
        1,
        (
            "_around_auxiliary.pairs",
            "nodes.point",
            "nodes.volume",
            "nodes.velocity_gradient",
            "history",
            "auxiliary.point",
            "auxiliary.smoothing_length",
            "auxiliary.density",
            "auxiliary.cell",
        ),
        ("auxiliary.point", "_fluxes._cells.numbers"),
    ),
    "to_nodes": (
        1,
        (
            "_around_nodes.pairs",
            "auxiliary.point",
            "auxiliary.volume",
            "_fluxes._cells.numbers",
            "_fluxes._cells.of_node",
            "nodes.point",
            "nodes.smoothing_length",
            "nodes.density",
            "nodes.velocity_gradient",
            "conditions.table.row",
        ),
        ("nodes.point", "nodes.half_velocity", "nodes.velocity_gradient"),
    ),
    "conditions": (1, ("nodes.point", "nodes.displacement", "conditions.table.row"), ("nodes.point",)),
    "motion": (
        1,
        (
            # the nodes move
            "nodes.point",
            "nodes.displacement",
            "nodes.half_velocity",
            "nodes.reference",
            # the cells are measured
            "nodes.point",
            "auxiliary.cell",
            "auxiliary.point",
            "_motion._initial_volume",
            "_motion._cell_h",
            # the nodes get their share
            "auxiliary.volume",
            "auxiliary.smoothing_length",
            "_motion._of_node",
            "nodes.weight",
            "nodes.displacement",
            "_motion._listed",
            "_motion._listed_h",
        ),
        (
            "nodes.point",
            "nodes.displacement",
            "auxiliary.point",
            "auxiliary.volume",
            "auxiliary.density",
            "auxiliary.smoothing_length",
            "nodes.volume",
            "nodes.density",
            "nodes.smoothing_length",
        ),
    ),
}


def pairs(neighbours) -> int:
    """Entries of a pair list."""
    return int(neighbours.pairs.start[-1:].numpy()[0])


def bytes_per_node_step(simulation: Simulation, phases) -> dict[str, float]:
    """Bytes moved a material node and step, by phase, for those phases that the scene has."""
    stepper, n = simulation.stepper, len(simulation.mesh.nodes)
    return {
        phase: times * sum(_size(stepper, name) for name in (*read, *written)) / n
        for phase, (times, read, written) in TRAFFIC.items()
        if phase in phases
    }


def _size(stepper, name: str) -> int:
    if name.endswith(".pairs"):
        neighbours = operator.attrgetter(name.removesuffix(".pairs"))(stepper)
        return 4 * (pairs(neighbours) + neighbours.pairs.start.shape[0])
    array = operator.attrgetter(name)(stepper)
    return 0 if array is None else _bytes(array)


def _bytes(array: wp.array) -> int:
    return array.size * wp.types.type_size_in_bytes(array.dtype)


def flops_per_node_step(simulation: Simulation) -> float:
    """Floating-point operations of the two sweeps a material node and step; exp and division count as one.

    With p unknowns in d dimensions a pair costs 5d + 4 + 3p + 2pd + 2d² (`warpsph.operators.neighbour_sums`), a
    target's value and gradient 4p + 2pd + 2pd² beside the small inverse. Sources and motion are not counted.
    """
    stepper, continuum = simulation.stepper, simulation.mesh.continuum
    d, p = continuum.dim, continuum.dim + continuum.stress_size
    entries = pairs(stepper._around_auxiliary) + pairs(stepper._around_nodes)
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
