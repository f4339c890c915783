"""Which stars no longer serve: a look at a node's own neighbours, and at the stars of those that changed."""

import warp as wp

from ..device.compiling import forward_kernel
from .exact import REACH, met_before, square, turn
from .outline import INSIDE
from .sight import seen_from
from .sites import Site
from .wrapping import Stars, neighbour


@wp.func
def beside(a: int, b: int, i: int, stars: Stars, site: wp.array(dtype=Site)) -> bool:
    """Whether b follows a in the star of i."""
    degree = stars.degree[i]
    for k in range(degree):
        if stars.row[i, k] == a:
            if k + 1 < degree:
                return stars.row[i, k + 1] == b
            return site[i].after == INSIDE and stars.row[i, 0] == b
    return False


@forward_kernel
def check(
    first: int,
    site: wp.array(dtype=Site),
    before: wp.array(dtype=wp.int32),
    stars: Stars,
    wanted: wp.array(dtype=wp.int32),
):
    """Want a star anew where a cell has turned over, or a neighbour is no longer met before the one after it."""
    i = first + wp.tid()
    here, degree, bad = site[i], stars.degree[i], wp.bool(False)
    closed = here.after == INSIDE
    if degree < 2:
        bad = True
    elif not closed:
        bad = stars.row[i, 0] != here.after or stars.row[i, degree - 1] != before[i]
    cells = degree
    if not closed:
        cells -= 1
    if cells > 0:
        j = stars.row[i, 0]
        k = stars.row[i, 1]
        a, b = seen_from(here, j, site[j]), seen_from(here, k, site[k])
        for m in range(cells):
            far = square(a.x, a.y) > wp.int64(REACH) * wp.int64(REACH)
            bad = bad or far or turn(a, b) <= wp.int64(0)
            if not bad and (closed or m + 2 < degree):
                following = neighbour(i, m + 2, degree, stars)
                c = seen_from(here, following, site[following])
                if square(c.x, c.y) <= wp.int64(REACH) * wp.int64(REACH):
                    bad = turn(a, c) > wp.int64(0) and met_before(i, a, c, b)
                else:
                    bad = True
                a = b
                b = c
    wanted[i] = int(bad)


@forward_kernel
def follow(
    first: int,
    site: wp.array(dtype=Site),
    fresh: wp.array(dtype=wp.int32),
    stars: Stars,
    wanted: wp.array(dtype=wp.int32),
):
    """Want the star of a node anew if a cell of it is none of a neighbour's fresh star. Fresh stars are right."""
    i = first + wp.tid()
    degree, missing = stars.degree[i], wp.bool(False)
    if fresh[i] == 0:
        cells = degree
        if site[i].after != INSIDE:
            cells -= 1
        for m in range(cells):
            a, b = stars.row[i, m], neighbour(i, m + 1, degree, stars)
            if fresh[a] != 0:
                missing = missing or not beside(b, i, a, stars, site)
            if fresh[b] != 0:
                missing = missing or not beside(i, a, b, stars, site)
    wanted[i] = int(missing)
