"""Lattices of the shapes: counts, volumes, faces and normals, against geometry."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from warpsph import Box, Disc, Polygon, SceneError
from warpsph.mesh.lattice import hinges, parts
from warpsph.scene import CONTINUA

BAR = Box((1.0,), 0.1)
PLATE = Box((2.0, 1.0), 0.25)
BLOCK = Box((1.0, 0.5, 0.75), 0.25, origin=(-1.0, 2.0, 0.5))
ELL = Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 0.25)
CHANNEL = Polygon([(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)], 0.25)


def quarter_ring(x, y):
    """Maps the plate [0, 2] × [0, 1] onto the quarter ring 1 ≤ r ≤ 3; its rows y = const become rays."""
    angle = 0.5 * math.pi * y
    return (1.0 + x) * np.cos(angle), (1.0 + x) * np.sin(angle)


RING = PLATE.mapped(quarter_ring)
SLANTED = BLOCK.mapped(lambda x, y, z: (2.0 * x + 0.5 * y, y - 0.3 * z, 1.5 * z))

SHAPES = {
    "bar": BAR,
    "plate": PLATE,
    "block": BLOCK,
    "disc": Disc(1.0, 0.25, centre=(3.0, -1.0)),
    "ell": ELL,
    "channel": CHANNEL,
    "rotated plate": PLATE.rotated(0.7, about=(1.0, 2.0)),
    "rotated block": BLOCK.rotated(-2.0),
    "ring": RING,
    "slanted block": SLANTED,
}
every_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES.keys())


def box_nodes(size, spacing, origin):
    """The nodes of a box as a set of points, written as loops."""
    counts = [round(length / spacing) + 1 for length in size]
    return {
        tuple(round(o + spacing * k, 9) for o, k in zip(origin, index, strict=True))
        for index in np.ndindex(*counts)
    }


def points(array):
    return {tuple(row) for row in np.round(array, 9).tolist()}


@pytest.mark.parametrize(
    ("shape", "nodes", "cells", "faces"),
    [(BAR, 11, 10, 2), (PLATE, 9 * 5, 8 * 4, 2 * (8 + 4)), (BLOCK, 5 * 3 * 4, 4 * 2 * 3, 2 * (8 + 12 + 6))],
)
def test_box_has_all_lattice_points(shape, nodes, cells, faces):
    mesh = shape.mesh()
    assert (len(mesh.nodes), len(mesh.cells), len(mesh.faces)) == (nodes, cells, faces)
    assert points(mesh.nodes) == box_nodes(shape.size, shape.spacing, shape.origin)


def test_box_cell_is_the_corners_around_its_centre_last_axis_fastest():
    mesh = PLATE.mesh()
    corners = mesh.nodes[mesh.cells]
    half = 0.125 * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
    assert np.allclose(corners - corners.mean(axis=1, keepdims=True), half, atol=1e-15)


@pytest.mark.parametrize("shape", [BAR, PLATE, BLOCK])
def test_box_node_mass_halves_on_every_side_and_weight_does_not(shape):
    mesh = shape.mesh()
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    sides = np.isclose(mesh.nodes, low) | np.isclose(mesh.nodes, high)
    mass, weight = mesh.node_volumes(), mesh.node_weights()
    cell = shape.spacing**mesh.dim
    assert np.allclose(mass, cell * 0.5 ** sides.sum(axis=1), rtol=1e-12)
    assert np.allclose(weight, cell, rtol=1e-12)


@pytest.mark.parametrize("shape", [BAR, PLATE, BLOCK])
def test_box_edges_are_its_sides_with_axis_normals(shape):
    mesh = shape.mesh()
    normals = mesh.face_normals()
    for side, name in enumerate(CONTINUA[mesh.dim].edges):
        axis, high = divmod(side, 2)
        faces = mesh.face_side == side
        wall = shape.origin[axis] + (shape.size[axis] if high else 0.0)
        on_wall = np.isclose(mesh.nodes[:, axis], wall)
        assert set(mesh.faces[faces].ravel()) == set(np.flatnonzero(on_wall)), name
        assert np.array_equal(normals[faces], np.tile((2 * high - 1) * np.eye(mesh.dim)[axis], (faces.sum(), 1)))


def test_end_coordinates_of_a_long_bar_are_exact():
    nodes = Box((0.7,), 0.7 / 997, origin=(0.1,)).mesh().nodes[:, 0]
    assert nodes[0] == 0.1 and nodes[-1] == 0.1 + 0.7


def test_disc_is_the_cells_whose_centre_is_inside():
    radius, spacing, centre = 1.0, 0.25, np.array([3.0, -1.0])
    mesh = Disc(radius, spacing, tuple(centre)).mesh()
    inside = {
        (x, y)
        for x in np.arange(-7, 8, 2) * spacing / 2
        for y in np.arange(-7, 8, 2) * spacing / 2
        if math.hypot(x, y) < radius
    }
    assert points(mesh.nodes[mesh.cells].mean(axis=1) - centre) == inside


@pytest.mark.parametrize("spacing", [0.25, 0.3, 0.4, 0.45])
def test_disc_looks_the_same_after_a_quarter_turn(spacing):
    nodes = Disc(1.0, spacing, centre=(3.0, -1.0)).mesh().nodes - [3.0, -1.0]
    assert points(nodes) == points(nodes @ [[0.0, 1.0], [-1.0, 0.0]])


def test_disc_area_approaches_the_circle():
    """Gauss's circle problem: the cells cut by the circle bound the error, and it is far smaller than that."""
    volumes = Disc(1.0, 0.02).mesh().cell_volumes()
    assert volumes.sum() == pytest.approx(math.pi, abs=0.02)


@pytest.mark.parametrize(("polygon", "area", "outline"), [(ELL, 3.0, 8.0), (CHANNEL, 5.0, 12.0)])
def test_polygon_with_lattice_sides_has_its_area_and_outline(polygon, area, outline):
    mesh = polygon.mesh()
    assert mesh.cell_volumes().sum() == pytest.approx(area, rel=1e-12)
    assert mesh.face_areas().sum() == pytest.approx(outline, rel=1e-12)
    assert (1.25, 1.25) not in points(mesh.nodes)


def test_polygon_does_not_depend_on_the_sense_of_its_corners():
    forth, back = ELL.mesh(), Polygon(ELL.vertices[::-1], 0.25).mesh()
    assert np.array_equal(forth.nodes, back.nodes) and np.array_equal(forth.cells, back.cells)


def test_triangle_keeps_cells_whose_centre_is_inside():
    mesh = Polygon([(0, 0), (2, 0), (0, 1)], 0.125).mesh()
    centres = mesh.nodes[mesh.cells].mean(axis=1)
    grid = (np.indices((16, 8)).reshape(2, -1).T + 0.5) * 0.125
    assert points(centres) == points(grid[grid[:, 0] + 2.0 * grid[:, 1] < 2.0])


def cells_of(vertices, spacing):
    """Middles of a polygon's cells, in hundredths of the spacing."""
    mesh = Polygon(vertices, spacing).mesh()
    return {
        tuple(row) for row in np.rint(100.0 / spacing * mesh.nodes[mesh.cells].mean(axis=1)).astype(int).tolist()
    }


BANK = [(0, 0), (4, 0), (3, 1), (1, 1)]  # its sides, at 45°, go through the middles of cells


@pytest.mark.parametrize("spacing", [1 / 3, 0.25, 0.2, 0.1, 0.05])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.3, -0.7), (1e5 / 7, 1e6 / 3)])
def test_bank_is_symmetric_wherever_it_stands(spacing, place):
    """Each row has two cells less than the one below; none of those whose middle lies on the outline is there."""
    mesh = Polygon(np.array(BANK) + place, spacing).mesh()
    middles = mesh.nodes[mesh.cells].mean(axis=1) - place
    rows, counts = np.unique(np.rint(middles[:, 1] / spacing - 0.5), return_counts=True)
    wide = round(4 / spacing)
    assert counts.tolist() == [wide - 2 * (k + 1) for k in range(round(1 / spacing))], rows
    assert middles[:, 0].mean() == pytest.approx(2.0, abs=1e-9)


LENGTHS = st.integers(-12, 12).map(lambda k: k / 10)
SIMPLE = st.lists(st.tuples(LENGTHS, LENGTHS), min_size=3, max_size=7, unique=True)
MOVES = {
    "mirrored": lambda x, y: (-x, y),
    "upside down": lambda x, y: (x, -y),
    "quarter turn": lambda x, y: (-y, x),
    "across the diagonal": lambda x, y: (y, x),
}


@settings(max_examples=300, deadline=None)
@example([(-0.7, -1.0), (-1.0, -0.1), (-0.7, -0.5)], 0.1, "mirrored", 1)  # a fifth less area, to the last digit
@given(SIMPLE, st.sampled_from([0.1, 0.2, 0.05, 0.15]), st.sampled_from(list(MOVES)), st.integers(0, 6))
def test_moved_polygon_gives_the_moved_body(vertices, spacing, name, first):
    """Whatever side comes first, and which way round; sides at 45° and others go through middles of cells."""
    try:
        cells = cells_of(vertices, spacing)
    except SceneError:
        return
    moved = [MOVES[name](x, y) for x, y in vertices]
    moved = moved[first % len(moved) :] + moved[: first % len(moved)]
    assert cells_of(moved, spacing) == {MOVES[name](*cell) for cell in cells}
    assert cells_of(moved[::-1], spacing) == cells_of(moved, spacing)


def test_lattice_lines_go_through_the_sides_along_the_axes():
    """A corner lower than the lowest side along the axes, at 0.1: the lattice reaches below it from there."""
    mesh = Polygon([(0, 0.1), (0.5, -0.17), (1, 0.1), (1, 1), (0, 1)], 0.1).mesh()
    assert np.allclose(np.unique(np.round(mesh.nodes[:, 1], 9)), np.arange(-1, 11) / 10)
    assert (mesh.nodes[:, 0].min(), mesh.nodes[:, 0].max(), mesh.nodes[:, 1].max()) == (0.0, 1.0, 1.0)


def test_lattice_is_in_the_middle_where_no_side_is_along_the_axes():
    mesh = Polygon([(0, 0.3), (1.1, 0), (1.4, 1.1), (0.3, 1.4)], 0.15).mesh()
    assert (mesh.nodes[:, 0].min() + mesh.nodes[:, 0].max()) / 2 == pytest.approx(0.7, abs=1e-12)


@pytest.mark.parametrize(
    ("vertices", "spacing", "field", "said"),
    [
        ([(0, 0), (1, 0), (1, 1), (0, 1)], 0.3, "spacing", "x = 0 and 1 m must be a whole number of spacings"),
        ([(0, 0), (1, 0), (1, 1), (0, 1)], 1.9, "spacing", "for example 1"),
        ([(0, 0), (2, 0), (2, 0.55), (1, 0.55), (1, 2), (0, 2)], 0.1, "spacing", "y = 0 and 0.55 m"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], 0.1, "vertices", "(1.0, 1.0) and from (1.0, 0.0)"),
        ([(0, 0), (2, 0), (2, 1), (1, 0), (0, 1)], 0.1, "vertices", "meet"),  # a corner on another side
        ([(0, 0), (2, 0), (1, 0), (1, 1), (0, 1)], 0.1, "vertices", "meet"),  # forth and back
        ([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)], 0.1, "vertices", "(0.0, 0.0) stands twice"),
        ([(0, 0), (1, 0), (1, 0), (1, 1), (0, 1)], 0.1, "vertices", "(1.0, 0.0) stands twice"),
        ([(0, 0), (1, 0), (2, 0)], 0.1, "vertices", "meet"),
        ([(0, 0), (3, 2), (3, 2.3), (0, 0.3)], 0.2, "spacing", "share a corner and no side"),
        ([(0, 0), (0.9, 0.3), (1.2, 1.2), (0.3, 0.9)], 0.1, "spacing", "near (0.1, 0.1)"),
        (
            [(0, 0), (3, 3), (3, 3.3), (0, 0.3)],
            0.2,
            "spacing",
            "finer: the cells have 0.6 m² in all, the shape 0.9",
        ),
    ],
)
def test_polygon_that_a_lattice_can_not_hold_is_refused(vertices, spacing, field, said):
    with pytest.raises(SceneError) as caught:
        Polygon(vertices, spacing).mesh()
    assert caught.value.field == field and said in str(caught.value) and "\n" not in str(caught.value)


def test_disc_of_too_few_cells_is_refused():
    """Nine cells 0.7 m wide are 4.41 m²; the disc is π m²."""
    with pytest.raises(SceneError, match=r"4\.41 m² in all, the shape 3\.142 m²"):
        Disc(1.0, 0.7).mesh()


@pytest.mark.parametrize(("thick", "cells"), [(0.2, 2 * 25 + 5), (0.04, None)])
def test_body_in_two_parts_is_refused(thick, cells):
    """Two blocks on a beam a cell thick, or so thin that it holds no cell's middle."""
    upper = [(2, 1), (2, 0.4 + thick), (1, 0.4 + 0.9 * thick), (1, 1), (0, 1)]
    shape = Polygon([(0, 0), (1, 0), (1, 0.4), (2, 0.4), (2, 0), (3, 0), (3, 1), *upper], 0.2)
    if cells:
        assert len(shape.mesh().cells) == cells
    else:
        with pytest.raises(SceneError, match="fall apart"):
            shape.mesh()


@pytest.mark.parametrize(
    ("rows", "hinged", "count"),
    [
        (["11", "11"], 0, 1),
        (["10", "01"], 1, 2),
        (["101", "111"], 0, 1),
        (["101", "101"], 0, 2),
        (["1110111", "1000001", "1111111"], 0, 1),
        (["1110111", "1000001", "1110111"], 0, 2),
        (["11111", "00001", "11101", "10001", "11111"], 0, 1),
        (["111", "101", "110"], 1, 1),
    ],
)
def test_hinges_and_parts_of_cells(rows, hinged, count):
    kept = np.array([[letter == "1" for letter in row] for row in rows])
    for turned in (kept, kept.T, kept[::-1], kept[:, ::-1]):
        assert (len(hinges(turned)), parts(turned)) == (hinged, count)
    assert hinged == 0 or hinges(kept).tolist() == ([[1, 1]] if count == 2 else [[2, 2]])


@pytest.mark.parametrize("shape", [PLATE, BLOCK, ELL])
def test_rotation_turns_nodes_and_normals_and_keeps_volumes(shape):
    angle, about = 0.7, np.array([1.0, 2.0])
    before, after = shape.mesh(), shape.rotated(angle, about=tuple(about)).mesh()
    turn = np.eye(before.dim)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    centre = np.concatenate([about, np.zeros(before.dim - 2)])
    assert np.allclose(after.nodes, centre + (before.nodes - centre) @ turn.T, atol=1e-14)
    assert np.allclose(after.face_normals(), before.face_normals() @ turn.T, atol=1e-13)
    assert np.allclose(after.cell_volumes(), before.cell_volumes(), rtol=1e-12)
    assert np.array_equal(after.face_side, before.face_side)


def test_linear_map_scales_volumes_by_its_determinant():
    assert np.allclose(SLANTED.mesh().cell_volumes(), 2.0 * 1.0 * 1.5 * 0.25**3, rtol=1e-12)


def test_mapped_cell_areas_are_those_of_the_quadrilaterals():
    mesh = RING.mesh()
    a, b, c, d = np.moveaxis(mesh.nodes[mesh.cells], 1, 0)
    ring = np.stack([a, c, d, b], axis=1)
    x, y = ring[..., 0], ring[..., 1]
    shoelace = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y, axis=1)
    assert np.allclose(mesh.cell_volumes(), shoelace, rtol=1e-12)


def test_mapped_edges_keep_the_names_of_the_unmapped_shape():
    mesh = RING.mesh()
    radius = np.linalg.norm(mesh.nodes, axis=1)
    outer = mesh.faces[mesh.face_side == CONTINUA[2].edges.index("right")]
    top = mesh.faces[mesh.face_side == CONTINUA[2].edges.index("top")]
    assert np.allclose(radius[outer], 3.0, rtol=1e-12)
    assert np.allclose(mesh.nodes[top][..., 0], 0.0, atol=1e-12)


def test_longest_and_shortest_distances_of_a_stretched_cell():
    mesh = Box((1.0, 1.0), 0.5).mapped(lambda x, y: (2.0 * x, 0.5 * y)).mesh()
    assert (mesh.largest_edge(), mesh.smallest_distance()) == pytest.approx((1.0, 0.25), rel=1e-12)


@every_shape
def test_masses_add_up_to_volume(shape):
    mesh = shape.mesh()
    mass, weight = mesh.node_volumes(), mesh.node_weights()
    assert mass.sum() == pytest.approx(mesh.cell_volumes().sum(), rel=1e-12)
    assert (weight >= mass * (1.0 - 1e-12)).all()


@every_shape
def test_faces_close_the_body(shape):
    """Σ A n = 0, and Σ A x·n = d V with x the middle of each face (Gauss's theorem, flat faces)."""
    mesh = shape.mesh()
    corners, normals = mesh.nodes[mesh.faces], mesh.face_normals()
    areas = mesh.face_areas()
    flux = np.sum(areas * np.sum(corners.mean(axis=1) * normals, axis=1))
    assert np.allclose(areas @ normals, 0.0, atol=1e-12)
    assert flux == pytest.approx(mesh.dim * mesh.cell_volumes().sum(), rel=1e-12)


@every_shape
def test_normals_are_unit_and_point_out_of_the_face_s_cell(shape):
    mesh = shape.mesh()
    normals = mesh.face_normals()
    outward = mesh.nodes[mesh.faces].mean(axis=1) - mesh.nodes[mesh.cells[mesh.face_cell]].mean(axis=1)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-14)
    assert (np.sum(normals * outward, axis=1) > 0.0).all()


@every_shape
def test_interior_sides_of_cells_are_no_faces(shape):
    """Every side of every cell is either shared by two cells or one boundary face."""
    mesh = shape.mesh()
    dim, count = mesh.dim, {}
    bits = np.array(list(np.ndindex(*(2,) * dim)))
    for axis in range(dim):
        for high in (0, 1):
            for side in np.sort(mesh.cells[:, bits[:, axis] == high], axis=1).tolist():
                count[tuple(side)] = count.get(tuple(side), 0) + 1
    alone = sorted(side for side, times in count.items() if times == 1)
    assert alone == sorted(tuple(face) for face in np.sort(mesh.faces, axis=1).tolist())


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.integers(1, 6), min_size=1, max_size=3),
    st.floats(1e-3, 1e3),
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
)
def test_any_box_is_whole(cells, spacing, origin):
    dim = len(cells)
    size = tuple(spacing * n for n in cells)
    mesh = Box(size, spacing, origin=tuple(origin[:dim])).mesh()
    mass = mesh.node_volumes()
    normals = mesh.face_normals()
    middle = np.array(origin[:dim]) + 0.5 * np.array(size)
    assert mass.sum() == pytest.approx(math.prod(size), rel=1e-8)
    assert mesh.cells.shape == (math.prod(cells), 2**dim)
    assert all(len(set(cell)) == 2**dim for cell in mesh.cells.tolist())
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert (np.sum(normals * (mesh.nodes[mesh.faces].mean(axis=1) - middle), axis=1) > 0.0).all()
