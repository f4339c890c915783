"""Selections of nodes: named edges, tags, boxes, functions of position, and their combinations.

A selection answers two questions about a lattice: which nodes it holds, and which boundary faces may give
those nodes a normal. `edge("top") & where(lambda x, y: x <= 1.0)` holds the nodes of the top with x ≤ 1, and
only top faces give them a normal, also at the corner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..mesh.mesh import Mesh, Tag
from ..validate import choice, index, mask_of_position, vector


class Selection:
    """A set of nodes; combine with `&`, `|` and `~`."""

    def nodes(self, mesh: Mesh) -> np.ndarray:
        """Which nodes are selected, boolean, shape (n,)."""
        raise NotImplementedError

    def faces(self, mesh: Mesh) -> np.ndarray:
        """Which boundary faces may give a normal, boolean, shape (f,)."""
        return np.ones(len(mesh.faces), dtype=bool)

    def __and__(self, other: Selection) -> Selection:
        return Both(self, other)

    def __or__(self, other: Selection) -> Selection:
        return Either(self, other)

    def __invert__(self) -> Selection:
        return Outside(self)

    def __bool__(self) -> bool:
        """Refused: Python's `and`, `or` and `not` would give one of the selections and forget the other."""
        raise SceneError("selection", self, "selections combine with &, | and ~, not with and, or and not")


@dataclass(frozen=True)
class edge(Selection):  # noqa: N801 - written as a word in scenes
    """The nodes of a named edge: left, right, bottom, top, in 3D also front and back; `boundary` is all.

    A name stands for the end of the lattice on that side, before it was rotated or mapped. Steps, notches and
    holes in between belong to `boundary` only: the slope of a bank is no part of its right edge.

    >>> from warpsph import Box
    >>> edge("left").nodes(Box((1.0,), 0.5).mesh())
    array([ True, False, False])
    """

    name: str

    def nodes(self, mesh: Mesh) -> np.ndarray:
        mask = np.zeros(len(mesh.nodes), dtype=bool)
        mask[mesh.faces[self.faces(mesh)]] = True
        return mask

    def faces(self, mesh: Mesh) -> np.ndarray:
        names = mesh.continuum.edges
        if choice("edge", self.name, (*names, "boundary")) == "boundary":
            return np.ones(len(mesh.faces), dtype=bool)
        return mesh.face_side == names.index(self.name)


@dataclass(frozen=True)
class tag(Selection):  # noqa: N801
    """The nodes that a mesh of one's own has a name for (`GivenMesh`).

    Of a tag of nodes those boundary faces may give a normal that have all of their corners in it; of a tag of
    faces those very faces.
    """

    name: str

    def nodes(self, mesh: Mesh) -> np.ndarray:
        mask = np.zeros(len(mesh.nodes), dtype=bool)
        mask[self._in(mesh).nodes] = True
        return mask

    def faces(self, mesh: Mesh) -> np.ndarray:
        mask = np.zeros(len(mesh.faces), dtype=bool)
        mask[self._in(mesh).faces] = True
        return mask

    def _in(self, mesh: Mesh) -> Tag:
        if not mesh.tags:
            raise SceneError("tag", self.name, "the shape has no tags; a GivenMesh may have some")
        return mesh.tags[choice("tag", self.name, mesh.tags)]


@dataclass(frozen=True)
class region(Selection):  # noqa: N801
    """The nodes inside a box, its sides included (to a millionth of the spacing).

    Args:
        lower, upper: opposite corners [m].

    >>> from warpsph import Box
    >>> region((0.4,), (1.0,)).nodes(Box((1.0,), 0.5).mesh())
    array([False,  True,  True])
    """

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __post_init__(self):
        lower = vector("region.lower", self.lower)
        upper = vector("region.upper", self.upper, len(lower))
        if any(a > b for a, b in zip(lower, upper, strict=True)):
            raise SceneError("region.upper", upper, f"it must not be below region.lower = {lower}")
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def nodes(self, mesh: Mesh) -> np.ndarray:
        if len(self.lower) != mesh.dim:
            raise SceneError("region.lower", self.lower, f"the shape has {mesh.dim} dimension(s)")
        slack = 1e-6 * mesh.spacing
        low, high = np.array(self.lower) - slack, np.array(self.upper) + slack
        return ((mesh.nodes >= low) & (mesh.nodes <= high)).all(axis=1)


@dataclass(frozen=True)
class where(Selection):  # noqa: N801
    """The nodes where a function of the initial position, f(x, y, …) with arrays, is true.

    Coordinates are rounded to 12 digits of the body's extent, so that `x <= 0.3` holds on a node at 0.3.

    >>> from warpsph import Box
    >>> (where(lambda x: x > 0.4) & ~edge("right")).nodes(Box((1.0,), 0.5).mesh())
    array([False,  True, False])
    """

    function: Callable

    def nodes(self, mesh: Mesh) -> np.ndarray:
        extent = max(np.abs(mesh.nodes).max(), mesh.spacing)
        decimals = 12 - int(np.ceil(np.log10(extent)))
        points = np.round(mesh.nodes, decimals)
        return mask_of_position("where", self.function, points)


@dataclass(frozen=True, eq=False)
class chosen(Selection):  # noqa: N801
    """Nodes by their numbers in the lattice: what a `where` has found, in a stored scene."""

    numbers: np.ndarray

    def __post_init__(self):
        numbers = np.asarray(self.numbers)
        if numbers.ndim != 1 or numbers.dtype.kind not in "iu":
            raise SceneError("chosen.numbers", self.numbers, "it must be a sequence of whole numbers")
        object.__setattr__(self, "numbers", numbers)

    def nodes(self, mesh: Mesh) -> np.ndarray:
        mask = np.zeros(len(mesh.nodes), dtype=bool)
        for number in (self.numbers.min(initial=0), self.numbers.max(initial=0)):
            index("chosen.numbers", number, below=len(mask))
        mask[self.numbers] = True
        return mask


@dataclass(frozen=True)
class everywhere(Selection):  # noqa: N801
    """All nodes."""

    def nodes(self, mesh: Mesh) -> np.ndarray:
        return np.ones(len(mesh.nodes), dtype=bool)


@dataclass(frozen=True)
class Both(Selection):
    """Nodes in both selections."""

    first: Selection
    second: Selection

    def __post_init__(self):
        _selection(self.first), _selection(self.second)

    def nodes(self, mesh: Mesh) -> np.ndarray:
        return self.first.nodes(mesh) & self.second.nodes(mesh)

    def faces(self, mesh: Mesh) -> np.ndarray:
        return self.first.faces(mesh) & self.second.faces(mesh)


@dataclass(frozen=True)
class Either(Selection):
    """Nodes in at least one of the selections."""

    first: Selection
    second: Selection

    def __post_init__(self):
        _selection(self.first), _selection(self.second)

    def nodes(self, mesh: Mesh) -> np.ndarray:
        return self.first.nodes(mesh) | self.second.nodes(mesh)

    def faces(self, mesh: Mesh) -> np.ndarray:
        return self.first.faces(mesh) | self.second.faces(mesh)


@dataclass(frozen=True)
class Outside(Selection):
    """Nodes not in the selection."""

    inner: Selection

    def __post_init__(self):
        _selection(self.inner)

    def nodes(self, mesh: Mesh) -> np.ndarray:
        return ~self.inner.nodes(mesh)


@dataclass(frozen=True)
class Bare(Selection):
    """The boundary faces that none of the given selections covers.

    Args:
        covering: the selections.
    """

    covering: tuple[Selection, ...]

    def nodes(self, mesh: Mesh) -> np.ndarray:
        mask = np.zeros(len(mesh.nodes), dtype=bool)
        mask[mesh.faces[self.faces(mesh)]] = True
        return mask

    def faces(self, mesh: Mesh) -> np.ndarray:
        bare = np.ones(len(mesh.faces), dtype=bool)
        for selection in self.covering:
            bare &= ~(selection.faces(mesh) & selection.nodes(mesh)[mesh.faces].all(axis=1))
        return bare


def _selection(value: object) -> Selection:
    if not isinstance(value, Selection):
        raise SceneError("selection", value, "it must be edge(…), tag(…), region(…), where(…) or a combination")
    return value
