"""What a node sees: others as it sees them, and which of them the outline hides."""

import warp as wp

from .exact import Seen, square, turn
from .sites import Site


@wp.func
def seen_from(here: Site, k: int, there: Site) -> Seen:
    """Node k, which is there, as the node here sees it."""
    seen = Seen()
    seen.x = there.x - here.x
    seen.y = there.y - here.y
    seen.id = k
    seen.lift = square(seen.x, seen.y) + wp.int64(here.weight - there.weight)
    return seen


@wp.func
def hides(start: Seen, end: Seen, seen: Seen) -> bool:
    """Whether an edge of the outline stands before a node. Its own ends do not hide what is in line with them."""
    if seen.id == start.id or seen.id == end.id:
        return False
    left, right = turn(seen, start) > wp.int64(0), turn(seen, end) > wp.int64(0)
    if left == right or turn(seen, start) == wp.int64(0) or turn(seen, end) == wp.int64(0):
        return False
    # Of the edge's line: on which side is who looks, on which the other?
    along, to = Seen(), Seen()
    along.x = end.x - start.x
    along.y = end.y - start.y
    to.x = seen.x - start.x
    to.y = seen.y - start.y
    mine, its = turn(start, end), turn(along, to)
    return (mine > wp.int64(0) and its < wp.int64(0)) or (mine < wp.int64(0) and its > wp.int64(0))
