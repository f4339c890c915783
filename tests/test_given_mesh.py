"""Bodies of given points and cells: kinds, order, boundary, sides, tags, and what is no body."""

import itertools

import numpy as np
import pytest

from warpsph import Box, GivenMesh, SceneError, edge, tag
from warpsph.mesh.components import components
from warpsph.mesh.faces import match_faces, row_keys
from warpsph.mesh.kinds import HEXAHEDRON, KINDS, QUAD

BOXES = {
    "segment": Box((1.0,), 0.25),
    "triangle": Box((1.0, 0.75), 0.25, cells="triangles"),
    "quad": Box((1.0, 0.75), 0.25),
    "tetrahedron": Box((1.0, 0.5, 0.75), 0.25, cells="tetrahedra"),
    "hexahedron": Box((1.0, 0.5, 0.75), 0.25),
}
every_box = pytest.mark.parametrize("box", BOXES.values(), ids=BOXES.keys())
SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def as_given(mesh):
    """Cells as a mesh generator would write them, counterclockwise or in VTK's order."""
    return mesh.cells[:, list(mesh.kind.drawn)]


def faces_of(mesh):
    """Each boundary face with its cell and its side."""
    corners = map(tuple, np.sort(mesh.faces, axis=1).tolist())
    return set(zip(corners, mesh.face_cell.tolist(), mesh.face_side.tolist(), strict=True))


@every_box
def test_the_cells_of_a_box_make_the_box(box):
    start = box.mesh()
    mesh = GivenMesh(points=start.nodes, cells=as_given(start)).mesh()
    assert mesh.kind is start.kind and np.array_equal(mesh.cells, start.cells)
    assert faces_of(mesh) == faces_of(start)
    order = np.lexsort(np.sort(mesh.faces, axis=1).T), np.lexsort(np.sort(start.faces, axis=1).T)
    assert np.allclose(mesh.face_normals()[order[0]], start.face_normals()[order[1]], atol=1e-15)


@every_box
def test_faces_are_in_the_order_of_the_cell_s_kind(box):
    """As a lattice has them: of a hexahedron the four corners as a quad counts its own."""
    mesh = GivenMesh(points=box.mesh().nodes, cells=as_given(box.mesh())).mesh()
    for face, cell in zip(mesh.faces, mesh.face_cell, strict=True):
        assert tuple(face) in [tuple(mesh.cells[cell][list(corners)]) for corners in mesh.kind.faces]


@every_box
def test_cells_may_count_either_way_round(box):
    """Every second one turned over: a plane cell's ring backwards, a hexahedron's top and bottom exchanged."""
    start = box.mesh()
    given = as_given(start)
    turned = {3: [0, 2, 1, 3], 8: [4, 5, 6, 7, 0, 1, 2, 3]}.get(given.shape[1], list(range(given.shape[1]))[::-1])
    if start.kind.name == "tetrahedron":
        turned = [1, 0, 2, 3]
    elif start.kind.name == "triangle":
        turned = [0, 2, 1]
    given[::2] = given[::2][:, turned]
    mesh = GivenMesh(points=start.nodes, cells=given).mesh()
    assert np.allclose(mesh.cell_volumes(), start.cell_volumes(), rtol=1e-12)
    assert np.array_equal(np.sort(mesh.cells, axis=1), np.sort(start.cells, axis=1))


def test_quads_and_hexahedra_are_counted_as_vtk_does():
    quad = GivenMesh(points=SQUARE, cells=[(0, 1, 2, 3)]).mesh()
    assert np.array_equal(quad.nodes[quad.cells[0]], QUAD.points)
    cube = [(*corner, z) for z in (0.0, 1.0) for corner in SQUARE]
    hexahedron = GivenMesh(points=cube, cells=[range(8)]).mesh()
    assert np.array_equal(hexahedron.nodes[hexahedron.cells[0]], HEXAHEDRON.points)


def test_spacing_is_the_mean_length_of_an_edge():
    mesh = GivenMesh(points=[(0.0, 0.0), (3.0, 0.0), (0.0, 4.0)], cells=[(0, 1, 2)]).mesh()
    assert mesh.spacing == pytest.approx((3.0 + 4.0 + 5.0) / 3.0)


def test_sides_are_those_of_the_box_around_the_points_where_faces_lie_on_them():
    """A house: the walls and the floor are flat, the roof is no side."""
    points = [*SQUARE, (0.5, 1.5)]
    mesh = GivenMesh(points=points, cells=[(0, 1, 2), (0, 2, 3), (3, 2, 4)]).mesh()
    for name, nodes in [("left", {0, 3}), ("right", {1, 2}), ("bottom", {0, 1}), ("top", set())]:
        assert set(np.flatnonzero(edge(name).nodes(mesh))) == nodes
    assert edge("boundary").nodes(mesh).all()
    turned = GivenMesh(points=points, cells=[(0, 1, 2), (0, 2, 3), (3, 2, 4)]).rotated(0.3).mesh()
    assert np.array_equal(turned.face_side, mesh.face_side)


# ---------------------------------------------------------------------------------------------------------
# Tags
# ---------------------------------------------------------------------------------------------------------

TWO = {"points": SQUARE, "cells": [(0, 1, 2), (0, 2, 3)]}


@pytest.mark.parametrize("given", [[1, 0], [(1, 0)], np.array([[0, 1]])], ids=["nodes", "face", "array"])
def test_a_tag_holds_its_nodes_and_the_faces_between_them(given):
    mesh = GivenMesh(**TWO, tags={"base": given}).mesh()
    assert np.flatnonzero(tag("base").nodes(mesh)).tolist() == [0, 1]
    assert [sorted(face) for face in mesh.faces[tag("base").faces(mesh)].tolist()] == [[0, 1]]


def test_a_tag_of_nodes_has_whole_faces_only():
    mesh = GivenMesh(**TWO, tags={"corner": [1], "all": [0, 1, 2, 3]}).mesh()
    assert tag("corner").nodes(mesh).sum() == 1 and not tag("corner").faces(mesh).any()
    assert tag("all").nodes(mesh).all() and tag("all").faces(mesh).all()


def test_tags_combine_and_stay_with_a_mapped_body():
    shape = GivenMesh(**TWO, tags={"base": [(0, 1)], "side": [(1, 2)]}).rotated(0.5)
    both = tag("base") & tag("side")
    assert np.flatnonzero(both.nodes(shape.mesh())).tolist() == [1]
    assert (tag("base") | edge("right")).nodes(shape.mesh()).sum() == 3


def test_ends_of_a_bar_are_tagged_as_nodes_or_faces():
    bar = {"points": [[0.0], [1.0], [2.0]], "cells": [(0, 1), (1, 2)]}
    for given in ([0], [[0]]):
        mesh = GivenMesh(**bar, tags={"end": given}).mesh()
        assert mesh.faces[tag("end").faces(mesh)].tolist() == [[0]]


@pytest.mark.parametrize(
    ("tags", "name", "said"),
    [
        ({"base": [0]}, "bases", "tag = 'bases' is not allowed: it must be one of base (did you mean base?)"),
        ({}, "base", "tag = 'base' is not allowed: the shape has no tags; a GivenMesh may have some"),
        ({"base": [0]}, 3, "tag = 3 is not allowed: it must be one of base"),
    ],
)
def test_tags_that_there_are_not_are_refused(tags, name, said):
    with pytest.raises(SceneError) as error:
        tag(name).nodes(GivenMesh(**TWO, tags=tags).mesh())
    assert str(error.value) == said


@pytest.mark.parametrize(
    ("tags", "said"),
    [
        (["base"], "tags = ['base'] is not allowed: it must be a mapping"),
        ({3: [0]}, "tags = 3 is not allowed: a name must be a text"),
        ({"": [0]}, "tags = '' is not allowed: a name must be a text"),
        (
            {"base": []},
            "tags['base'] = [] is not allowed: it must be numbers of nodes, or lists of the corners of faces",
        ),
        ({"base": [0.0]}, "tags['base'] = [0.0] is not allowed: it must be numbers of nodes"),
        ({"base": [True]}, "tags['base'] = [True] is not allowed: it must be numbers of nodes"),
        ({"base": "left"}, "tags['base'] = 'left' is not allowed: it must be numbers of nodes"),
        ({"base": [[0, 1], [1]]}, "tags['base'] = [[0, 1], [1]] is not allowed: it must be numbers of nodes"),
        (
            {"base": [0, 4]},
            "tags['base'] = 4 is not allowed: it must be a number of a point, at least 0 and below 4",
        ),
        ({"base": [-1]}, "tags['base'] = -1 is not allowed: it must be a number of a point"),
        ({"base": [(0, 1, 2)]}, "tags['base'] = (0, 1, 2) is not allowed: a face of a triangle has 2 corner(s)"),
        ({"base": [(0, 1), (2, 0)]}, "tags['base'] = (2, 0) is not allowed: it must be a face of the boundary"),
        ({"base": [(1, 3)]}, "tags['base'] = (1, 3) is not allowed: it must be a face of the boundary"),
    ],
)
def test_tags_that_hold_what_there_is_not_are_refused(tags, said):
    with pytest.raises(SceneError) as error:
        GivenMesh(**TWO, tags=tags)
    assert str(error.value).startswith(said) and "\n" not in str(error.value)


# ---------------------------------------------------------------------------------------------------------
# What is no body
# ---------------------------------------------------------------------------------------------------------


def ring(angles, radius=1.0):
    return [(radius * np.cos(a), radius * np.sin(a)) for a in angles]


def part_of(box, gone):
    """Points and cells of a box without the cells whose middle is where `gone` says."""
    mesh = box.mesh()
    kept = as_given(mesh)[~gone(*mesh.nodes[mesh.cells].mean(axis=1).T)]
    used, cells = np.unique(kept, return_inverse=True)
    return mesh.nodes[used], cells.reshape(kept.shape)


def hinged():
    """A ring of seven squares that touches itself in a corner."""
    return part_of(Box((3.0, 3.0), 1.0), lambda x, y: (np.abs(x - y) < 0.1) & (x < 2.0))


def pinched():
    """Three layers of four cubes, the middle one of two on a diagonal: they share an edge and no face."""
    return part_of(Box((2.0, 2.0, 3.0), 1.0), lambda x, y, z: (np.abs(z - 1.5) < 0.1) & ((x < 1.0) == (y < 1.0)))


def touching():
    """A hollow block of 4 × 4 × 4 cubes; two of those in the hollow are there, on a diagonal, and share a node."""

    def gone(*middle):
        inside = np.all([np.abs(x - 2.0) < 1.0 for x in middle], axis=0)
        return inside & ~np.all([np.sign(x - 2.0) == np.sign(middle[0] - 2.0) for x in middle], axis=0)

    return part_of(Box((4.0, 4.0, 4.0), 1.0), gone)


def coil():
    """A strip of squares around more than a turn: cells side by side, and the body on itself."""
    angles = np.linspace(0.0, 3.1 * np.pi, 25)
    return [*ring(angles, 1.0), *ring(angles + 0.01, 2.0)], [(k, k + 25, k + 26, k + 1) for k in range(24)]


def twice_around_a_node():
    """Ten triangles around a node, two turns in all; only the boundary shows it."""
    angles, radii = np.linspace(0.0, 4.0 * np.pi, 10, endpoint=False), np.linspace(1.0, 1.5, 10)
    around = [(r * np.cos(a), r * np.sin(a)) for a, r in zip(angles + 0.2 * radii, radii, strict=True)]
    return [(0.0, 0.0), *around], [(0, 1 + k, 1 + (k + 1) % 10) for k in range(10)]


def half_cells():
    """A square beside two halves of one: the node between them is no corner of the square."""
    points = [*SQUARE, (2.0, 0.0), (2.0, 0.5), (2.0, 1.0), (1.0, 0.5)]
    return points, [(0, 1, 2, 3), (1, 4, 5, 7), (7, 5, 6, 2)]


def half_cells_that_hold_together():
    points, cells = half_cells()
    more = [(0.0, -1.0), (1.0, -1.0), (2.0, -1.0)]
    return [*points, *more], [*cells, (8, 9, 1, 0), (9, 10, 4, 1)]


FLAT = "is not allowed: it is flat or folded: a"
NOT_A_BODY = {
    "no points": (3, [(0, 1, 2)], "points = 3 is not allowed: it must be numbers [m] of shape (n, 1), (n, 2)"),
    "texts": ([("0", "0")], [(0, 0, 0)], "points = [('0', '0')] is not allowed: it must be numbers [m] of shape"),
    "complex": ([(1j, 0.0)], [(0, 0, 0)], "points = [(1j, 0.0)] is not allowed: it must be numbers"),
    "uneven": ([(0.0, 0.0), (1.0,)], [(0, 1)], "points = [(0.0, 0.0), (1.0,)] is not allowed: it must be numbers"),
    "four axes": ([(0, 0, 0, 0)], [(0,)], "points = [(0, 0, 0, 0)] is not allowed: it must be numbers"),
    "infinite": (
        [(0.0, 0.0), (np.inf, 0.0)],
        [(0, 1)],
        "points[1] = (inf, 0.0) is not allowed: it must be finite",
    ),
    "not whole": (SQUARE, [(0.0, 1.0, 2.0)], "cells = [(0.0, 1.0, 2.0)] is not allowed: it must be whole numbers"),
    "truths": (SQUARE, [(True, False)], "cells = [(True, False)] is not allowed: it must be whole numbers"),
    "no cells": (SQUARE, [], "cells = [] is not allowed: it must be whole numbers"),
    "mixed": (SQUARE, [(0, 1, 2), (0, 1, 2, 3)], "cells = [(0, 1, 2), (0, 1, 2, 3)] is not allowed: it must be"),
    "no kind": (SQUARE, [(0, 1, 2, 3, 0)], "cells = '5 corners in 2D' is not allowed: it must be one of segment"),
    "too far": (
        SQUARE,
        [(0, 1, 2), (0, 2, 4)],
        "cells[1] = (0, 2, 4) is not allowed: its corners must be numbers of points, at least 0 and below 4",
    ),
    "below 0": (
        SQUARE,
        [(0, 1, -1)],
        "cells[0] = (0, 1, -1) is not allowed: its corners must be numbers of points",
    ),
    "corner twice": (
        SQUARE,
        [(0, 1, 2), (0, 2, 2)],
        "cells[1] = (0, 2, 2) is not allowed: its corners must differ",
    ),
    "cell twice": (
        SQUARE,
        [(0, 1, 2), (0, 2, 3), (2, 0, 1)],
        "cells[2] = (2, 0, 1) is not allowed: cells[0] has the same corners",
    ),
    "unused": ([*SQUARE, (2.0, 0.0)], [(0, 1, 2), (0, 2, 3)], "points = 4 is not allowed: it is the corner of no"),
    "node twice": (
        [*SQUARE, (1.0, 1.0 + 1e-8)],
        [(0, 1, 2), (0, 4, 3)],
        "points[4] = (1.0, 1.00000001) is not allowed: points[2] is in the same place",
    ),
    "flat": ([*SQUARE, (2.0, 0.0)], [(0, 1, 2), (0, 2, 3), (0, 1, 4)], f"cells[2] = (0, 1, 4) {FLAT} triangle"),
    "on a line": ([(0.0, 0.0), (0.3, 0.9), (3.3, 9.9)], [(0, 1, 2)], f"cells[0] = (0, 1, 2) {FLAT} triangle"),
    "bow tie": (
        SQUARE,
        [(0, 1, 3, 2)],
        f"cells[0] = (0, 1, 3, 2) {FLAT} quad must have a volume at each corner; corners go round it",
    ),
    "arrow": (
        [(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (1.0, 1.0)],
        [(0, 1, 2, 3)],
        f"cells[0] = (0, 1, 2, 3) {FLAT} quad",
    ),
    "cube by bits": (
        list(itertools.product((0.0, 1.0), repeat=3)),
        [range(8)],
        f"cells[0] = (0, 1, 2, 3, 4, 5, 6, 7) {FLAT} hexahedron",
    ),
    "plane tetrahedron": ([(x, y, 0.0) for x, y in SQUARE], [range(4)], f"cells[0] = (0, 1, 2, 3) {FLAT} tetra"),
    "three at a face": (
        [(0.0, 0.0), (1.0, 0.0), (0.5, 1.0), (0.4, 2.0), (0.5, -1.0)],
        [(0, 1, 2), (0, 1, 3), (1, 0, 4)],
        "is not allowed: one of its faces belongs to cells 0, 1 as well; a face has two cells at most",
    ),
    "one side": (
        [(0.0, 0.0), (1.0, 0.0), (0.5, 1.0), (0.4, 2.0)],
        [(0, 1, 2), (0, 1, 3)],
        "cells[1] = (0, 1, 3) is not allowed: it lies on cells[0], on the same side of the face they share",
    ),
    "two parts": (
        [*SQUARE, (3.0, 0.0), (4.0, 0.0), (3.0, 1.0)],
        [(0, 1, 2), (0, 2, 3), (4, 5, 6)],
        "cells[2] = (4, 5, 6) is not allowed: no faces join it to cells[0]; a body is in one piece",
    ),
    "two at a corner": (
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)],
        [(0, 1, 2), (0, 3, 4)],
        "cells[1] = (0, 3, 4) is not allowed: no faces join it to cells[0]",
    ),
    "hinge": (*hinged(), "= [1.0, 1.0] is not allowed: cells meet in it that no face there joins; a body has no"),
    "ball and socket": (*touching(), "= [2.0, 2.0, 2.0] is not allowed: cells meet in it that no face there"),
    "hinge along an edge": (*pinched(), "= [[1.0, 1.0, 1.0], [1.0, 1.0, 2.0]] is not allowed: cells meet in it"),
    "on itself": (*coil(), "the body must not lie on itself, as it does at ("),
    "two turns around a node": (*twice_around_a_node(), "the body must not lie on itself, as it does at ("),
    "half cells": (*half_cells(), "points[7] = (1.0, 0.5) is not allowed: it must not lie on a face whose corner"),
    "hanging node": (
        *half_cells_that_hold_together(),
        "points[7] = (1.0, 0.5) is not allowed: it must not lie on a face whose corner it is not, of points",
    ),
}


@pytest.mark.parametrize(("points", "cells", "said"), NOT_A_BODY.values(), ids=NOT_A_BODY.keys())
def test_what_is_no_body_is_refused(points, cells, said):
    with pytest.raises(SceneError) as error:
        GivenMesh(points=points, cells=cells)
    assert said in str(error.value) and "\n" not in str(error.value)


def test_holes_and_thin_bodies_are_bodies():
    """A ring of quads, a triangle alone, tetrahedra around a hollow."""
    points, cells = part_of(Box((3.0, 3.0), 1.0), lambda x, y: np.hypot(x - 1.5, y - 1.5) < 0.5)
    assert GivenMesh(points=points, cells=cells).mesh().face_areas().sum() == pytest.approx(12.0 + 4.0)
    assert len(GivenMesh(points=SQUARE[:3], cells=[(0, 1, 2)]).mesh().faces) == 3
    box = Box((3.0, 3.0, 3.0), 1.0, cells="tetrahedra")
    hollow = part_of(box, lambda x, y, z: np.maximum(np.maximum(abs(x - 1.5), abs(y - 1.5)), abs(z - 1.5)) < 0.5)
    mesh = GivenMesh(points=hollow[0], cells=hollow[1]).mesh()
    assert mesh.face_areas().sum() == pytest.approx(6.0 * 9.0 + 6.0)
    assert (mesh.face_side == -1).sum() == 12


def test_a_shape_keeps_what_it_was_given():
    points, cells = np.array(SQUARE), np.array([(0, 1, 2), (0, 2, 3)])
    shape = GivenMesh(points=points, cells=cells)
    before = shape.mesh().nodes.copy()
    points += 1.0
    cells[:] = 0
    assert np.array_equal(shape.mesh().nodes, before) and shape.mesh().cells.max() == 3


# ---------------------------------------------------------------------------------------------------------
# What it is made with
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 50, 400])
def test_components_are_those_of_a_search(count):
    random = np.random.default_rng(count)
    links = random.integers(0, count, (2, count // 2))
    found = components(count, *links)
    neighbours = {k: {k} for k in range(count)}
    for a, b in links.T.tolist():
        neighbours[a].add(b)
        neighbours[b].add(a)
    for k in range(count):
        reached, waiting = {k}, [k]
        while waiting:
            new = neighbours[waiting.pop()] - reached
            reached |= new
            waiting += new
        assert found[k] == min(reached)


def test_a_long_chain_is_one_component():
    order = np.random.default_rng(0).permutation(10_000)
    assert (components(10_000, order[:-1], order[1:]) == 0).all()


@pytest.mark.parametrize("largest", [3, 10**6, 10**15])
def test_row_keys_are_equal_where_rows_are(largest):
    """Also where the product of all numbers is beyond 64 bits."""
    random = np.random.default_rng(1)
    rows = random.integers(0, largest, (300, 4), endpoint=True)
    rows = np.concatenate([rows, rows[::3], np.full((1, 4), largest)])
    keys = row_keys(rows)
    same = (rows[:, None] == rows[None]).all(axis=2)
    assert np.array_equal(keys[:, None] == keys[None], same) and (keys >= 0).all()


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_faces_are_matched_by_their_corners(kind):
    mesh = BOXES[kind.name].mesh()
    match = match_faces(mesh.cells, kind)
    count = len(kind.faces)

    def corners(place):
        return frozenset(mesh.cells[place // count][list(kind.faces[place % count])].tolist())

    assert all(corners(a) == corners(b) and a != b for a, b in match.shared.tolist())
    assert len(match.alone) + 2 * len(match.shared) == count * len(mesh.cells) and not len(match.crowded)
    assert {corners(place) for place in match.alone.tolist()} == set(map(frozenset, mesh.faces.tolist()))
