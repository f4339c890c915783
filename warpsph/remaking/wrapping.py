"""The star of a node, found by itself: its neighbours one by one, counterclockwise, among the nodes near it.

A star begins with the nearest node, or, on the outline, with the one that follows there, and ends with the one
before. Nodes behind an edge of the outline are not seen, so cells never leave the body, and fill it: this is the
triangulation of Delaunay under the constraint of the outline. Cells whose circles are within reach are certain. So
are all, if each is found by its three corners, whatever their circles: `tables` looks.
"""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from .exact import Seen, met_before, square, turn
from .outline import INSIDE
from .sight import hides, seen_from
from .sites import Site

MOST_NEIGHBOURS = 24  # that a star has
# What became of a star.
CERTAIN, UNCERTAIN, OPEN, CROWDED, COINCIDENT = 0, 1, 2, 3, 4


@wp.struct
class Stars:
    """A star a node.

    Attributes:
        degree: how many neighbours it has; 0 if it was not found.
        row: them, counterclockwise: on the outline from the node after to the one before, elsewhere from the one
            of least index.
        fate: what became of it.
    """

    degree: wp.array(dtype=wp.int32)
    row: wp.array2d(dtype=wp.int32)
    fate: wp.array(dtype=wp.int32)


@wp.func
def neighbour(i: int, k: int, degree: int, stars: Stars) -> int:
    """Neighbour k of node i, the first again after the last."""
    if k < degree:
        return stars.row[i, k]
    return stars.row[i, k - degree]


@wp.func
def nearest(seen: wp.array(dtype=Seen), count: int) -> int:
    """Number of the nearest node, −1 without any: the one whose line of equal power, Λ/2|k| away, is."""
    found, least = wp.int32(-1), wp.float64(wp.inf)
    for k in range(count):
        lift = wp.float64(seen[k].lift)
        distance = lift * wp.abs(lift) / wp.float64(square(seen[k].x, seen[k].y))
        if distance < least or (distance == least and seen[k].id < seen[found].id):
            found = k
            least = distance
    return found


@wp.func
def next_after(i: int, j: int, end: int, seen: wp.array(dtype=Seen), count: int) -> int:
    """Number of the neighbour that follows j, −1 if none is to the left of it; none is beyond the end, if any."""
    edge, found = seen[j], wp.int32(-1)
    ends = wp.bool(False)
    if end >= 0:
        ends = turn(edge, seen[end]) > wp.int64(0)
    for k in range(count):
        near = turn(edge, seen[k]) > wp.int64(0) and not (ends and turn(seen[k], seen[end]) < wp.int64(0))
        if near and (found < 0 or met_before(i, edge, seen[k], seen[found])):
            found = k
    return found


@wp.func
def sees_all(j: Seen, k: Seen, reach: int, weight: int) -> bool:
    """Whether no node out of reach can lie in the circle through i, j and k, which has its middle at c.

    Inside are those with |l|² − 2 c·l < w_l − w_i: none for which |l| ≥ 2|c| + w/|l|, with w the largest weight.
    """
    x = wp.float64(j.lift) * wp.float64(k.y) - wp.float64(k.lift) * wp.float64(j.y)
    y = wp.float64(k.lift) * wp.float64(j.x) - wp.float64(j.lift) * wp.float64(k.x)
    margin = wp.float64(reach) - wp.float64(weight) / wp.float64(reach)
    return wp.sqrt(x * x + y * y) < wp.float64(turn(j, k)) * margin


@cache
def wrap_kernel(most_seen: int, most_edges: int):
    """The stars of some nodes, each of which sees so many nodes, and edges of the outline, at most."""

    @forward_kernel
    def wrap(
        first: int,
        nodes: wp.array(dtype=wp.int32),
        grid: wp.uint64,
        spots: wp.array(dtype=wp.vec3),
        radius: float,
        reach: int,
        weight: int,
        site: wp.array(dtype=Site),
        before: wp.array(dtype=wp.int32),
        stars: Stars,
    ):
        # radius: the reach in the grid; weight: the largest one [units²]
        i = nodes[first + wp.tid()]
        here = site[i]
        seen = wp.zeros(shape=most_seen, dtype=Seen)
        starts = wp.zeros(shape=most_edges, dtype=Seen)
        ends = wp.zeros(shape=most_edges, dtype=Seen)
        count, edges, fate = wp.int32(0), wp.int32(0), wp.int32(CERTAIN)
        within = wp.int64(reach) * wp.int64(reach)
        query = wp.hash_grid_query(grid, spots[i], radius)
        k = wp.int32(0)
        while wp.hash_grid_query_next(query, k):
            there = site[k]
            node = seen_from(here, k, there)
            distance = square(node.x, node.y)
            if k != i and distance <= within:
                if distance == wp.int64(0):
                    fate = COINCIDENT
                elif count == most_seen:
                    fate = CROWDED
                else:
                    seen[count] = node
                    count += 1
                if there.after != INSIDE:
                    for way in range(2):  # the edge that starts there; the one that ends there, from out of reach
                        other = wp.where(way == 0, there.after, before[k])
                        end = seen_from(here, other, site[other])
                        if other != i and (way == 0 or square(end.x, end.y) > within):
                            if edges == most_edges:
                                fate = CROWDED
                            else:
                                starts[edges] = node
                                ends[edges] = end
                                edges += 1
        begin, last, kept = wp.int32(-1), wp.int32(-1), wp.int32(0)
        after, previous = here.after, before[i]
        for m in range(count):
            node = seen[m]
            hidden = wp.bool(False)
            for e in range(edges):
                hidden = hidden or hides(starts[e], ends[e], node)
            if not hidden:
                seen[kept] = node
                if node.id == after:
                    begin = kept
                if node.id == previous:
                    last = kept
                kept += 1
        count = kept
        bound = last + 0
        if here.after == INSIDE:
            begin = nearest(seen, count)
            last = begin
        if begin < 0 or last < 0:
            fate = wp.max(fate, wp.int32(OPEN))
        link = wp.zeros(shape=MOST_NEIGHBOURS, dtype=int)
        degree, least, j, going = wp.int32(0), wp.int32(0), begin, fate < OPEN
        while going:
            link[degree] = seen[j].id
            if link[degree] < link[least]:
                least = degree
            degree += 1
            following = next_after(i, j, bound, seen, count)
            if following < 0:
                fate = OPEN
            elif degree == MOST_NEIGHBOURS:
                fate = CROWDED
            elif not sees_all(seen[j], seen[following], reach, weight):
                fate = UNCERTAIN
            going = fate < OPEN and following != last
            j = following
        if here.after != INSIDE and fate < OPEN:  # the last is not the first again
            link[degree] = seen[last].id
            degree += 1
            least = 0
        if fate >= OPEN:
            degree = 0
        for m in range(degree):
            turned = m + least
            if turned >= degree:
                turned -= degree
            stars.row[i, m] = link[turned]
        stars.degree[i] = degree
        stars.fate[i] = fate

    return wrap
