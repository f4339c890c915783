"""Counts what a step moves, from the arrays a simulation really has.

Bytes: the least a step can move to and from memory, each array of a kernel once, elements whole (a kernel that
changes one field of a packed struct moves all of it). Neighbours that are gathered count once: nodes and cells are
stored row by row, so that caches hold those of neighbouring targets.
"""

import operator
import resource
import sys

import warp as wp

from warpsph import Simulation

NODES, MEANS = "body.nodes.", "_sharpening.means."
# kernel: (arrays read, arrays written), as attributes of the stepper, for the default numerics.
TRAFFIC = {
    "kick": (
        (NODES + "point", NODES + "acceleration", NODES + "half", "conditions.row"),
        (NODES + "half",),
    ),
    "strain": (("body.corners", NODES + "half", NODES + "flowed"), ("_numbers",)),
    "rate": (
        ("body.node_cells.place", "_numbers", NODES + "mass"),
        (NODES + "volume", NODES + "velocity_gradient"),
    ),
    "rate_mean": (
        ("body.corners", "_numbers", NODES + "velocity_gradient"),
        (MEANS + "weight", MEANS + "rate"),
    ),
    "stress": (
        (
            "body.node_cells.place",
            MEANS + "weight",
            MEANS + "rate",
            NODES + "volume",
            NODES + "velocity_gradient",
            NODES + "half",
            NODES + "point",
            NODES + "reference",
            NODES + "displacement",
            NODES + "strained",
            NODES + "books",
            NODES + "flowed",
            "body.internals",
        ),
        (
            NODES + "velocity_gradient",
            NODES + "elastic_rate",
            NODES + "point",
            NODES + "displacement",
            NODES + "strained",
            NODES + "books",
            NODES + "flowed",
            "body.internals",
        ),
    ),
    "stress_mean": (("body.corners", NODES + "point", MEANS + "weight"), (MEANS + "stress",)),
    "sharpen": (
        ("body.node_cells.place", MEANS + "weight", MEANS + "stress", NODES + "point", NODES + "volume"),
        (NODES + "sharpened",),
    ),
    "force": (
        (
            "body.corners",
            "body.cell_mass",
            NODES + "point",
            NODES + "sharpened",
            NODES + "elastic_rate",
            "_numbers",
            "rough_loss",
        ),
        ("_forces", "rough_loss"),
    ),
    "push": (
        (
            "body.node_cells.place",
            "_forces",
            NODES + "mass",
            NODES + "half",
            NODES + "point",
            NODES + "displacement",
            "conditions.row",
        ),
        (NODES + "acceleration", NODES + "point"),
    ),
}


def bytes_per_node_step(simulation: Simulation) -> dict[str, float]:
    """Bytes moved a node and step, by kernel."""
    stepper, n = simulation.stepper, len(simulation.mesh.nodes)
    return {
        kernel: sum(_size(stepper, name) for name in (*read, *written)) / n
        for kernel, (read, written) in TRAFFIC.items()
    }


def _size(stepper, name: str) -> int:
    found = operator.attrgetter(name)(stepper)
    if found is None:
        return 0
    return _bytes(found) // (found.shape[0] if name.endswith("books") else 1)  # one row of them


def _bytes(array: wp.array) -> int:
    return array.size * wp.types.type_size_in_bytes(array.dtype)


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
