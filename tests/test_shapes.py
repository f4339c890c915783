"""Lattices of the shapes: counts, volumes, faces and normals, against geometry."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpsph import Box, Disc, Polygon
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
    mass, weight = mesh.node_volumes()
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


@pytest.mark.parametrize("spacing", [0.25, 0.3, 0.4, 0.7])
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
    assert (mesh.largest_edge(), mesh.smallest_edge()) == pytest.approx((1.0, 0.25), rel=1e-12)


@every_shape
def test_masses_add_up_to_volume(shape):
    mesh = shape.mesh()
    mass, weight = mesh.node_volumes()
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
    mass, _ = mesh.node_volumes()
    normals = mesh.face_normals()
    middle = np.array(origin[:dim]) + 0.5 * np.array(size)
    assert mass.sum() == pytest.approx(math.prod(size), rel=1e-8)
    assert mesh.cells.shape == (math.prod(cells), 2**dim)
    assert all(len(set(cell)) == 2**dim for cell in mesh.cells.tolist())
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert (np.sum(normals * (mesh.nodes[mesh.faces].mean(axis=1) - middle), axis=1) > 0.0).all()
