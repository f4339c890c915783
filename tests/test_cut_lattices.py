"""Lattices cut into triangles and tetrahedra: volumes, faces that match, how the cuts lie."""

import itertools
import math

import numpy as np
import pytest

from warpsph import Box, Disc, Polygon, SceneError, edge
from warpsph.mesh.kinds import GRID_KINDS, KINDS

PLATE, BLOCK = ((2.0, 1.0), 0.25), ((1.0, 0.5, 0.75), 0.25)
ARRANGED = [None, "rising", "falling", "alternating"]


def cut(size, spacing, diagonals=None, **more):
    return Box(size, spacing, cells="triangles" if len(size) == 2 else "tetrahedra", diagonals=diagonals, **more)


every_box = pytest.mark.parametrize(("size", "spacing"), [PLATE, BLOCK], ids=["plate", "block"])
every_cut = pytest.mark.parametrize("diagonals", ARRANGED)


@every_box
@every_cut
def test_cut_cells_are_equal_parts_of_the_lattice_s_and_keep_its_nodes(size, spacing, diagonals):
    whole, mesh = Box(size, spacing).mesh(), cut(size, spacing, diagonals).mesh()
    parts = math.factorial(len(size))
    assert np.array_equal(mesh.nodes, whole.nodes) and len(mesh.cells) == parts * len(whole.cells)
    assert np.allclose(mesh.cell_volumes(), spacing ** len(size) / parts, rtol=1e-12)
    held = np.repeat(whole.cells, parts, axis=0)
    assert (mesh.cells[:, :, None] == held[:, None, :]).any(axis=2).all()


@every_box
@every_cut
def test_cut_cells_match_across_their_faces(size, spacing, diagonals):
    """Each face belongs to two cells, or to one and the boundary, which is the surface of the box."""
    mesh = cut(size, spacing, diagonals).mesh()
    count = {}
    for cell in mesh.cells.tolist():
        for face in itertools.combinations(sorted(cell), mesh.dim):
            count[face] = count.get(face, 0) + 1
    assert set(count.values()) == {1, 2}
    alone = sorted(face for face, times in count.items() if times == 1)
    assert alone == sorted(tuple(face) for face in np.sort(mesh.faces, axis=1).tolist())
    surface = 2.0 * sum(math.prod(size) / length for length in size)
    assert mesh.face_areas().sum() == pytest.approx(surface, rel=1e-12)
    assert all(
        np.isin(face, mesh.cells[cell]).all() for face, cell in zip(mesh.faces, mesh.face_cell, strict=True)
    )


@every_box
@every_cut
def test_sides_of_a_cut_box_are_those_of_the_box(size, spacing, diagonals):
    whole, mesh = Box(size, spacing).mesh(), cut(size, spacing, diagonals).mesh()
    normals = mesh.face_normals()
    for side, name in enumerate(mesh.continuum.edges):
        axis, high = divmod(side, 2)
        assert np.array_equal(edge(name).nodes(mesh), edge(name).nodes(whole))
        own = mesh.face_side == side
        assert np.allclose(normals[own], (2 * high - 1) * np.eye(mesh.dim)[axis], atol=1e-14)
        assert mesh.face_areas()[own].sum() == pytest.approx(math.prod(size) / size[axis], rel=1e-12)


def diagonals_of(mesh, spacing):
    """Slope of each cut inside a cell of a plate, by the middle of it."""
    found = {}
    for cell in mesh.cells:
        for a, b in itertools.combinations(mesh.nodes[cell], 2):
            dx, dy = b - a
            if abs(dx * dy) > 0.0:
                found[tuple(np.rint((a + b) / spacing - 1.0).astype(int) // 2)] = round(dy / dx)
    return found


def test_diagonals_rise_fall_or_alternate():
    size, spacing = PLATE
    places = list(itertools.product(range(8), range(4)))
    for diagonals, slope in [
        ("rising", lambda i, j: 1),
        ("falling", lambda i, j: -1),
        ("alternating", lambda i, j: 1 if (i + j) % 2 == 0 else -1),
        (None, lambda i, j: 1 if (i + j) % 2 == 0 else -1),
    ]:
        assert diagonals_of(cut(size, spacing, diagonals).mesh(), spacing) == {p: slope(*p) for p in places}


@pytest.mark.parametrize(("diagonals", "counts"), [(None, {24}), ("falling", {24}), ("alternating", {16, 48})])
def test_tetrahedra_at_an_inner_node(diagonals, counts):
    mesh = cut((1.0, 1.0, 1.0), 0.25, diagonals).mesh()
    inner = ((mesh.nodes > 0.1) & (mesh.nodes < 0.9)).all(axis=1)
    assert set(np.bincount(mesh.cells.ravel())[inner]) == counts


def test_rising_tetrahedra_share_the_diagonal_of_their_cube_and_falling_ones_are_mirrored():
    rising, falling = (cut((1.0, 1.0, 1.0), 0.5, d).mesh() for d in ("rising", "falling"))
    corners = rising.nodes[rising.cells]
    long = np.abs(corners[:, :, None] - corners[:, None]).min(axis=3) > 0.25
    assert (long.sum(axis=(1, 2)) == 2).all()
    mirrored = (rising.nodes * [-1.0, 1.0, 1.0] + [1.0, 0.0, 0.0])[rising.cells]

    def sets(points):
        return {frozenset(map(tuple, cell)) for cell in points.tolist()}

    assert sets(mirrored) == sets(falling.nodes[falling.cells]) != sets(corners)


@pytest.mark.parametrize("shape", [Disc, Polygon], ids=["disc", "polygon"])
@every_cut
def test_shapes_cut_out_of_a_lattice_keep_their_outline(shape, diagonals):
    first = 1.0 if shape is Disc else [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    whole, mesh = shape(first, 0.25).mesh(), shape(first, 0.25, cells="triangles", diagonals=diagonals).mesh()
    assert mesh.cell_volumes().sum() == pytest.approx(whole.cell_volumes().sum(), rel=1e-12)
    lines, sides = ([*zip(map(frozenset, m.faces.tolist()), m.face_side, strict=True)] for m in (whole, mesh))
    assert set(lines) == set(sides)


@every_box
def test_mapped_and_turned_cut_boxes_keep_their_cells(size, spacing):
    box = cut(size, spacing)
    start, turned = box.mesh(), box.rotated(0.7).mesh()
    bent = box.mapped(lambda x, y, *z: (2.0 * x + 0.3 * y, y, *z)).mesh()
    assert np.array_equal(start.cells, turned.cells) and np.array_equal(start.face_side, bent.face_side)
    assert np.allclose(turned.cell_volumes(), start.cell_volumes(), rtol=1e-12)
    assert np.allclose(bent.cell_volumes(), 2.0 * start.cell_volumes(), rtol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("corner", range(8))
def test_simplices_of_a_cell_fill_it_from_any_corner(dim, corner):
    kind = GRID_KINDS[dim]
    start = kind.points[corner % kind.corners]
    found = kind.simplices(start)
    opposite = kind.points.index(tuple(1.0 - x for x in start))
    points = np.array(kind.points)
    edges = points[np.array(found)[:, 1:]] - points[np.array(found)[:, :1]]
    assert np.allclose(np.linalg.det(edges), 1.0)
    assert len(set(map(frozenset, found))) == math.factorial(dim)
    assert all({kind.points.index(start), opposite} <= set(simplex) for simplex in found)


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_mirrored_corners_are_the_same_cell_turned_over(kind):
    points, slopes = np.array(kind.points), np.array(kind.gradients)
    assert np.linalg.det(points[list(kind.mirrored)].T @ slopes) == pytest.approx(-1.0)
    for face in kind.faces:
        assert sorted(kind.mirrored[k] for k in face) in [sorted(other) for other in kind.faces]


@pytest.mark.parametrize(
    ("size", "more", "said"),
    [
        (
            (1.0, 1.0),
            {"cells": "tetrahedra"},
            "cells = 'tetrahedra' is not allowed: it must be one of lattice, triangles",
        ),
        ((1.0,), {"cells": "triangles"}, "cells = 'triangles' is not allowed: it must be one of lattice"),
        ((1.0,) * 3, {"cells": "quads"}, "cells = 'quads' is not allowed: it must be one of lattice, tetrahedra"),
        ((1.0, 1.0), {"cells": None}, "cells = None is not allowed: it must be one of lattice, triangles"),
        (
            (1.0, 1.0),
            {"cells": "triangles", "diagonals": "raising"},
            "diagonals = 'raising' is not allowed: it must be one of rising, falling, alternating (did you mean "
            "rising?)",
        ),
        (
            (1.0, 1.0),
            {"diagonals": "rising"},
            "diagonals = 'rising' is not allowed: a lattice has none; triangles and tetrahedra have them",
        ),
    ],
)
def test_cells_that_there_are_not_are_refused(size, more, said):
    with pytest.raises(SceneError) as error:
        Box(size, 0.5, **more)
    assert str(error.value) == said


@pytest.mark.parametrize("shape", [Disc, Polygon])
def test_plane_shapes_refuse_tetrahedra(shape):
    with pytest.raises(SceneError, match="one of lattice, triangles"):
        shape(1.0 if shape is Disc else [(0, 0), (1, 0), (0, 1)], 0.25, cells="tetrahedra")
