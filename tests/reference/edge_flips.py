"""Triangulations of Delaunay by insertion and edge flips (Lawson 1977), one by one, in whole numbers."""

import numpy as np


def hashes(n):
    """The hash of each index, by which ties are decided."""
    h = np.arange(n, dtype=np.uint64)
    for shift, factor in ((16, 2146121005), (15, 1540483477)):
        h = ((h ^ (h >> np.uint64(shift))) * np.uint64(factor)) & np.uint64(0xFFFFFFFF)
    return (h ^ (h >> np.uint64(16))).tolist()


class EdgeFlips:
    """A triangulation of a polygon.

    Args:
        places: whole numbers, shape (n, 2).
        weights: of the power diagram, whole numbers, shape (n,); none makes it Delaunay's.
    """

    def __init__(self, places, weights=None):
        self.places = [tuple(map(int, place)) for place in places]
        self.weights = [0] * len(self.places) if weights is None else [int(w) for w in weights]
        self.hash = hashes(len(self.places))
        self.opposite = {}  # (a, b) → c of the cell (a, b, c), counterclockwise

    def turn(self, a, b, c):
        """Twice the area of (a, b, c)."""
        (ax, ay), (bx, by), (cx, cy) = (self.places[k] for k in (a, b, c))
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    def add(self, a, b, c):
        """Add a cell."""
        assert self.turn(a, b, c) > 0, "a cell that has turned over"
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            self.opposite[p, q] = r

    def remove(self, a, b, c):
        """Take a cell away."""
        for edge in ((a, b), (b, c), (c, a)):
            del self.opposite[edge]

    def illegal(self, a, b, c, d):
        """Whether (a, b, c) and (b, a, d) should be (a, d, c) and (d, b, c)."""
        rows = []
        for k in (a, b, c):
            x, y = (s - t for s, t in zip(self.places[k], self.places[d], strict=True))
            rows.append((x, y, x * x + y * y - self.weights[k] + self.weights[d]))
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = rows
        inside = ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
        if inside == 0:
            return min(self.hash[c], self.hash[d]) < min(self.hash[a], self.hash[b])
        return inside > 0

    def settle(self, edges):
        """Flip what is illegal, from these edges on."""
        edges = list(edges)
        while edges:
            a, b = edges.pop()
            c, d = self.opposite.get((a, b)), self.opposite.get((b, a))
            if c is None or d is None or not self.illegal(a, b, c, d):
                continue
            self.remove(a, b, c)
            self.remove(b, a, d)
            self.add(a, d, c)
            self.add(d, b, c)
            edges += [(a, d), (d, b), (b, c), (c, a)]
        return self

    def insert(self, p, start):
        """Insert a node that lies in the triangulation, found by a walk from an edge; an edge of it."""
        a, b = start if start in self.opposite else next(iter(self.opposite))
        while True:
            c = self.opposite[a, b]
            beyond = next(((q, r) for q, r in ((a, b), (b, c), (c, a)) if self.turn(q, r, p) < 0), None)
            if beyond is None:
                break
            a, b = beyond[::-1]
        on = next(((q, r, s) for q, r, s in ((a, b, c), (b, c, a), (c, a, b)) if self.turn(q, r, p) == 0), None)
        self.remove(a, b, c)
        rim = [(a, b), (b, c), (c, a)]
        if on is not None:
            q, r, _ = on
            rim.remove((q, r))
            if (r, q) in self.opposite:
                s = self.opposite[r, q]
                self.remove(r, q, s)
                rim += [(q, s), (s, r)]
        for q, r in rim:
            self.add(q, r, p)
        self.settle(rim)
        return rim[0][1], p

    def cells(self):
        """Node indices, counterclockwise from the least, in rising order, shape (m, 3)."""
        return ordered([(a, b, c) for (a, b), c in self.opposite.items() if a < b and a < c])


def ordered(cells):
    """Cells (m, 3) that begin with their least corner, in rising order."""
    cells = np.asarray(cells)
    return cells[np.lexsort(cells.T[::-1])]


def flipped(places, cells, weights=None):
    """The triangulation that flips make of cells (m, 3), counterclockwise; edges of one cell stay."""
    flips = EdgeFlips(places, weights)
    for cell in cells.tolist():
        flips.add(*cell)
    return flips.settle(list(flips.opposite)).cells()


def inserted(places, box, weights=None):
    """The triangulation of nodes in a box, whose four corners are nodes given counterclockwise."""
    flips = EdgeFlips(places, weights)
    a, b, c, d = (int(k) for k in box)
    flips.add(a, b, c)
    flips.add(a, c, d)
    edge = (a, b)
    columns = np.round(np.asarray(places)[:, 0] / (np.ptp(places, axis=0).max() / len(places) ** 0.5))
    for p in np.lexsort([np.asarray(places)[:, 1], columns]).tolist():
        if p not in (a, b, c, d):
            edge = flips.insert(p, edge)
    return flips.cells()
