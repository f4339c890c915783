"""Kinds of cell as data, against geometry: the one place where corners have an order."""

import itertools

import numpy as np
import pytest

from warpsph import Box, Elastic, Scene, SceneError, Shape
from warpsph.device.precision import PRECISIONS
from warpsph.mesh.kinds import GRID_KINDS, HEXAHEDRON, KINDS, QUAD, TETRAHEDRON, TRIANGLE
from warpsph.mesh.mesh import Mesh
from warpsph.physics.space import Space
from warpsph.scene import CONTINUA
from warpsph.state.cells import cell_table
from warpsph.state.nodes import auxiliary_nodes

every_kind = pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)


@every_kind
def test_middle_gradients_are_exact_for_linear_fields_and_blind_to_constants(kind):
    points, slopes = np.array(kind.points), np.array(kind.gradients)
    assert np.allclose(points.T @ slopes, np.eye(kind.dim), atol=1e-15)
    assert np.allclose(slopes.sum(axis=0), 0.0, atol=1e-15)


@every_kind
def test_hourglass_modes_have_no_mean_and_no_gradient(kind):
    """Together with constants and linear fields they are all that the corners can hold."""
    signs = kind.signs
    assert signs.shape == (kind.corners, kind.corners - kind.dim - 1)
    assert np.allclose(signs.sum(axis=0), 0.0) and np.allclose(signs.T @ np.array(kind.gradients), 0.0)
    basis = np.column_stack([np.ones(kind.corners), np.array(kind.points), signs])
    assert np.linalg.matrix_rank(basis) == kind.corners


@every_kind
def test_faces_close_the_cell_and_give_its_volume(kind):
    """Gauss: Σ A n = 0 and Σ A x·n = d V, each face once, with the corners of its own kind."""
    if kind.dim == 1:
        assert kind.faces == ((0,), (1,))
        return
    points = np.array(kind.points)
    mesh = Mesh(
        spacing=1.0,
        nodes=points,
        cells=np.arange(kind.corners)[None],
        faces=np.array(kind.faces),
        face_cell=np.zeros(len(kind.faces), dtype=int),
        face_side=np.zeros(len(kind.faces), dtype=int),
    )
    areas, normals = mesh.face_areas(), mesh.face_normals()
    assert kind.face_kind.corners == len(kind.faces[0])
    assert np.allclose(areas @ normals, 0.0, atol=1e-15)
    middles = points[mesh.faces].mean(axis=1)
    assert np.isclose((areas * (middles * normals).sum(axis=1)).sum(), kind.dim * kind.volume)
    assert np.isclose(mesh.cell_volumes()[0], kind.volume)


@every_kind
def test_edges_are_the_sides_of_the_faces(kind):
    """Of a grid's cell those pairs that differ along one axis; of a simplex all pairs."""
    if kind in GRID_KINDS.values():
        pairs = itertools.combinations(range(kind.corners), 2)
        expected = {p for p in pairs if np.abs(np.subtract(*np.array(kind.points)[list(p)])).sum() == 1.0}
    else:
        expected = set(itertools.combinations(range(kind.corners), 2))
    assert set(map(tuple, map(sorted, kind.edges))) == expected


@pytest.mark.parametrize("kind", [TRIANGLE, QUAD], ids=lambda kind: kind.name)
def test_plane_cells_are_drawn_counterclockwise(kind):
    x, y = np.array(kind.points)[list(kind.drawn)].T
    assert np.isclose(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y), kind.volume)


@pytest.mark.parametrize("kind", [HEXAHEDRON, TETRAHEDRON], ids=lambda kind: kind.name)
def test_solid_cells_are_drawn_as_vtk_counts(kind):
    """A hexahedron: a face counterclockwise seen from the other one, then that one above it; a tetrahedron: the
    fourth corner above the first three."""
    points = np.array(kind.points)[list(kind.drawn)]
    base, first = (4, points[4]) if kind is HEXAHEDRON else (3, points[3])
    normal = np.cross(points[1] - points[0], points[base - 1] - points[0])
    assert normal @ (first - points[0]) > 0.0
    if kind is HEXAHEDRON:
        assert np.allclose(points[4:] - points[:4], first - points[0])


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_cells_of_nodes_are_the_table_of_cells_turned_round(dim):
    mesh = Box((1.0,) * dim, 0.25).mesh()
    first, places = mesh.cells_of_nodes()
    corners = mesh.kind.corners
    for i in range(len(mesh.nodes)):
        own = places[first[i] : first[i + 1]]
        assert (mesh.cells[own // corners, own % corners] == i).all()
        assert len(own) == (mesh.cells == i).sum() and (np.diff(own % corners) >= 0).all()


class Triangles(Shape):
    """The unit square as two triangles."""

    def mesh(self) -> Mesh:
        return Mesh(
            spacing=1.0,
            nodes=np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]),
            cells=np.array([(0, 1, 2), (0, 2, 3)]),
            faces=np.array([(0, 1), (1, 2), (2, 3), (3, 0)]),
            face_cell=np.array([0, 0, 1, 1]),
            face_side=np.array([2, 1, 3, 0]),
        )


def test_a_scheme_refuses_cells_that_its_sums_do_not_know():
    with pytest.raises(SceneError) as error:
        Scene(shape=Triangles(), material=SOFT, duration=1.0)
    assert str(error.value) == (
        "cells = 'triangle' is not allowed: velocity_scheme compatible takes a 2D body's cells as quad only"
    )


def test_kernels_refuse_a_table_of_another_width():
    """A table of three columns would be read across its rows."""
    mesh = Triangles().mesh()
    with pytest.raises(SceneError, match="kernels built for a quad read 4 corners a cell"):
        cell_table(mesh, QUAD, "cpu")
    scene = Scene(shape=Box((1.0, 1.0), 0.5), material=SOFT, duration=1.0)
    with pytest.raises(SceneError, match="kernels built for a triangle read 3 corners a cell"):
        auxiliary_nodes(scene, Space(CONTINUA[2], PRECISIONS["float64"]), TRIANGLE, "cpu")


def test_a_number_of_corners_that_no_kind_has_is_refused():
    mesh = Triangles().mesh()
    five = Mesh(**(vars(mesh) | {"cells": np.zeros((1, 5), dtype=int)}))
    with pytest.raises(SceneError, match=r"5 corners in 2D.*triangle \(2D, 3\), quad \(2D, 4\)"):
        _ = five.kind
