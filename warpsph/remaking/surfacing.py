"""Nodes that come to the outline, and nodes that leave it, where its edges have grown long or short.

A node inside that has come near an edge, and sees it all but straight, joins it: the cell between them would turn
over next. It is moved onto the edge, so that no area is made or lost, and the edge becomes two. A node of the
outline with short edges on both sides, all but in line, is moved inside, and both become one. Each node decides
for itself, and looks at stars only.
"""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..device.launching import Launcher
from ..device.precision import Precision
from .exact import hash_of
from .outline import INSIDE, OutlineArrays
from .wrapping import Stars, neighbour

# Tangent of what the angle lacks to 180 degrees under which a node that joins sees an edge of one spacing; of one
# twice as long four times as much.
STRAIGHT = 0.0875
SHORT = 1.0  # spacings, both edges of a node that leaves together
BENT = 0.2  # tangent of the angle between them
LEAST = 0.02  # area of a cell of a node that has left [spacings²]


class Surfacing:
    """Takes nodes onto the outline, and off it.

    Args:
        n: number of nodes.
        spacing: length of an edge [m].
        precision: of the positions.
        launcher: launches the kernels.

    Attributes:
        held: 1 for nodes that conditions hold: they stay where they are, and edges between two of them as well.
        kernels: all that it launches.
    """

    def __init__(self, n: int, spacing: float, precision: Precision, launcher: Launcher):
        self._launcher, self._spacing = launcher, spacing
        self._find, self._wish, self._move = (
            _find_kernel(precision),
            _wish_kernel(precision),
            _move_kernel(precision),
        )
        self._chosen, self.held, self._after, self._before = (
            wp.zeros(n, dtype=wp.int32, device=launcher.device) for _ in range(4)
        )
        self._places = wp.zeros(n, dtype=precision.vec(2), device=launcher.device)
        self.kernels = (self._find, _join, self._wish, _leave, self._move)

    def join(self, positions: wp.array, stars: Stars, outline: OutlineArrays) -> None:
        """Move nodes [m] onto edges of the outline, of which they are then a part."""
        launch, onto = self._launcher.launch, self._chosen
        inputs = [STRAIGHT / self._spacing**2, self.held, positions, stars, outline, onto]
        launch(self._find, onto, inputs)
        launch(_join, onto, [onto, stars, outline])

    def leave(self, positions: wp.array, stars: Stars, outline: OutlineArrays) -> None:
        """Move nodes [m] of the outline inside."""
        launch, wishes = self._launcher.launch, self._chosen
        inputs = [self._spacing, self.held, positions, stars, outline, wishes, self._places]
        launch(self._wish, wishes, inputs)
        launch(_leave, wishes, [wishes, outline, self._after, self._before])
        launch(self._move, wishes, [self._after, outline, self._places, positions])
        wp.copy(outline.after, self._after)
        wp.copy(outline.before, self._before)


@cache
def _find_kernel(precision: Precision):
    """Of each node the start of the edge that it joins, or `INSIDE`; it is moved there."""
    real, vector = precision.real, precision.vec(2)

    @forward_kernel
    def find(
        first: int,
        share: real,
        held: wp.array(dtype=wp.int32),
        positions: wp.array(dtype=vector),
        stars: Stars,
        outline: OutlineArrays,
        onto: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        joined, degree, x, least = wp.int32(INSIDE), stars.degree[i], positions[i], real(wp.inf)
        place = vector()
        if outline.after[i] == INSIDE and held[i] == 0:
            for k in range(degree):
                a, b = stars.row[i, k], neighbour(i, k + 1, degree, stars)
                if outline.after[a] == b and held[a] + held[b] < 2:
                    start, end = positions[a] - x, positions[b] - x
                    ahead = -wp.dot(start, end)
                    height = start[0] * end[1] - start[1] * end[0]
                    edge = end - start
                    near = height < share * wp.dot(edge, edge) * ahead
                    if ahead > real(0.0) and near and height < least * ahead:
                        least = height / ahead
                        joined = a
                        place = x + start - (wp.dot(start, edge) / wp.dot(edge, edge)) * edge
        onto[i] = joined
        if joined != INSIDE:
            positions[i] = place

    return find


@forward_kernel
def _join(first: int, onto: wp.array(dtype=wp.int32), stars: Stars, outline: OutlineArrays):
    """The outline goes through nodes that join it. An edge has one cell, and that has one such node."""
    i = first + wp.tid()
    degree, after = stars.degree[i], outline.after[i]
    if after != INSIDE:
        if degree > 2:
            opposite = stars.row[i, 1]
            if onto[opposite] == i:
                outline.after[i] = opposite
            opposite = stars.row[i, degree - 2]
            if onto[opposite] != INSIDE and onto[opposite] == outline.before[i]:
                outline.before[i] = opposite
    elif onto[i] != INSIDE:
        for k in range(degree):
            if stars.row[i, k] == onto[i]:
                outline.before[i] = onto[i]
                outline.after[i] = neighbour(i, k + 1, degree, stars)


@cache
def _wish_kernel(precision: Precision):
    """Which nodes would leave the outline, and for where: the middle of their cells, of an ear the next one."""
    real, vector = precision.real, precision.vec(2)

    @wp.func
    def area(a: vector, b: vector, c: vector):
        return real(0.5) * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))

    @forward_kernel
    def wish(
        first: int,
        spacing: real,
        held: wp.array(dtype=wp.int32),
        positions: wp.array(dtype=vector),
        stars: Stars,
        outline: OutlineArrays,
        wishes: wp.array(dtype=wp.int32),
        places: wp.array(dtype=vector),
    ):
        i = first + wp.tid()
        wishes[i] = 0
        after = outline.after[i]
        before = outline.before[i]
        degree = stars.degree[i]
        if after == INSIDE or held[i] != 0 or degree < 2:
            return
        x, ahead, behind = positions[i], positions[after], positions[before]
        u, v = ahead - x, behind - x
        bent = wp.abs(u[0] * v[1] - u[1] * v[0]) > real(BENT) * -wp.dot(u, v)
        if bent or wp.length(u) + wp.length(v) > real(SHORT) * spacing:
            return
        place, whole, least = vector(), real(0.0), real(wp.inf)
        if degree == 2:
            if stars.degree[before] < 3:
                return
            third = stars.row[before, 2]
            beyond = positions[third]
            place = (ahead + behind + beyond) / real(3.0)
            least = area(behind, ahead, beyond) / real(3.0)
        else:
            for k in range(1, degree - 1):
                a, b = stars.row[i, k], stars.row[i, k + 1]
                part = area(ahead, positions[a], positions[b])
                whole += part
                place += part * (ahead + positions[a] + positions[b]) / real(3.0)
            if whole <= real(0.0):
                return
            place = place / whole
            least = area(place, behind, ahead)
            for k in range(degree - 1):
                c, d = stars.row[i, k], stars.row[i, k + 1]
                least = wp.min(least, area(place, positions[c], positions[d]))
        if least > real(LEAST) * spacing * spacing:
            wishes[i] = 1
            places[i] = place

    return wish


@forward_kernel
def _leave(
    first: int,
    wishes: wp.array(dtype=wp.int32),
    outline: OutlineArrays,
    new_after: wp.array(dtype=wp.int32),
    new_before: wp.array(dtype=wp.int32),
):
    """The outline without those that leave: of two side by side the one of lesser hash."""
    i = first + wp.tid()
    after, before = int(outline.after[i]), int(outline.before[i])
    if after != INSIDE:
        if _leaves(i, wishes, outline):
            after = INSIDE
            before = INSIDE
        else:
            if _leaves(after, wishes, outline):
                after = outline.after[after]
            if _leaves(before, wishes, outline):
                before = outline.before[before]
    new_after[i] = after
    new_before[i] = before


@wp.func
def _leaves(i: int, wishes: wp.array(dtype=wp.int32), outline: OutlineArrays) -> bool:
    """Whether a node of the outline leaves it."""
    after = outline.after[i]
    before = outline.before[i]
    if wishes[i] == 0 or outline.after[after] == before:
        return False
    first = wishes[after] == 0 or hash_of(i) < hash_of(after)
    return first and (wishes[before] == 0 or hash_of(i) < hash_of(before))


@cache
def _move_kernel(precision: Precision):
    vector = precision.vec(2)

    @forward_kernel
    def move(
        first: int,
        new_after: wp.array(dtype=wp.int32),
        outline: OutlineArrays,
        places: wp.array(dtype=vector),
        positions: wp.array(dtype=vector),
    ):
        i = first + wp.tid()
        if outline.after[i] != INSIDE and new_after[i] == INSIDE:
            positions[i] = places[i]

    return move
