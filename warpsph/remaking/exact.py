"""Which node is met first as a star is wrapped: decided exactly, in integers, with one answer for whoever asks.

Places are whole numbers of units from the node i whose star it is, at most `REACH` away. To the left of its edge
to j the triangle of Delaunay ends at the k whose circle, through i, j and k, is empty: a node l is met before k if
it lies in that circle,

    D(j, k, l) = (j × k) Λ_l − (j × l) Λ_k + (k × l) Λ_j < 0,        Λ_k = |k|² + w_i − w_k.

Λ lifts the plane onto a paraboloid; with weights w cells are those of a power diagram. Products are below 2⁶¹, D
below 2⁶³. D = 0, as of every square of a lattice, is decided as if the lift of the node of the least hash had been
lowered by next to nothing: a diagonal ends in that node.
"""

import warp as wp

REACH = 32767  # units: how far a star sees


@wp.func
def hash_of(i: int) -> wp.uint32:
    """A number for each index, no two alike, in no order."""
    h = wp.uint32(i)
    h = (h ^ (h >> wp.uint32(16))) * wp.uint32(2146121005)
    h = (h ^ (h >> wp.uint32(15))) * wp.uint32(1540483477)
    return h ^ (h >> wp.uint32(16))


@wp.func
def cross(ax: int, ay: int, bx: int, by: int) -> wp.int64:
    """a × b: positive if b is left of a."""
    return wp.int64(ax) * wp.int64(by) - wp.int64(ay) * wp.int64(bx)


@wp.func
def square(ax: int, ay: int) -> wp.int64:
    """|a|²."""
    return wp.int64(ax) * wp.int64(ax) + wp.int64(ay) * wp.int64(ay)


@wp.struct
class Seen:
    """A node as node i sees it.

    Attributes:
        x, y: its place from there [units].
        lift: Λ.
        id: its index.
    """

    x: int
    y: int
    lift: wp.int64
    id: int


@wp.func
def turn(a: Seen, b: Seen) -> wp.int64:
    """a × b of two places."""
    return cross(a.x, a.y, b.x, b.y)


@wp.func
def met_before(i: int, j: Seen, k: Seen, met: Seen) -> bool:
    """Whether k is met before the node met, as the star of i is wrapped to the left of j; both are left of j."""
    between = turn(met, k)
    inside = turn(j, met) * k.lift - turn(j, k) * met.lift + between * j.lift
    if inside != wp.int64(0):
        return inside < wp.int64(0)
    if between < wp.int64(0):  # i, j, k, met in this order round a circle: cut by i-k or by j-met
        return wp.min(hash_of(i), hash_of(k.id)) < wp.min(hash_of(j.id), hash_of(met.id))
    # i, j, met, k: cut by i-met or by j-k
    return wp.min(hash_of(j.id), hash_of(k.id)) < wp.min(hash_of(i), hash_of(met.id))
