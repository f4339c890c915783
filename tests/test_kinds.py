"""Kinds of cell as data, against geometry: the one place where corners have an order."""

import itertools

import numpy as np
import pytest

from warpsph import Box, Elastic, Numerics, Scene, SceneError, Shape
from warpsph.device.precision import PRECISIONS
from warpsph.mesh.kinds import GRID_KINDS, HEXAHEDRON, KINDS, QUAD, SEGMENT, TETRAHEDRON, TRIANGLE
from warpsph.mesh.mesh import Mesh
from warpsph.mesh.small_matrices import determinants, least_singular_values
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


def shaken(kind, seed=0):
    """A mesh of that kind whose nodes are moved by up to a fifth of the spacing, so that hexahedra are warped."""
    size = (1.0, 0.5, 0.75)[: kind.dim]
    box = Box(size, 0.25) if kind.grid else Box(size, 0.25, cells=f"{kind.name}s".replace("drons", "dra"))
    mesh = box.mesh()
    return mesh.with_nodes(mesh.nodes + np.random.default_rng(seed).uniform(-0.05, 0.05, mesh.nodes.shape))


@every_kind
def test_slopes_are_those_of_the_shape_functions(kind):
    """N_k is 1 at its corner and 0 at the others; along each axis it is linear, so that differences are exact."""
    place, step = np.linspace(0.2, 0.4, kind.dim), 0.1 * np.eye(kind.dim)
    points = np.array(kind.points)

    def shape(ξ):
        if not kind.grid:
            return np.array([1.0 - ξ.sum(), *ξ])
        return np.where(points == 1.0, ξ, 1.0 - ξ).prod(axis=1)

    expected = np.stack([(shape(place + e) - shape(place - e)) / 0.2 for e in step], axis=1)
    assert np.allclose(kind.slopes(place), expected, atol=1e-14)
    middle = points.mean(axis=0)
    assert np.allclose(kind.slopes(middle), kind.gradients, atol=1e-15)


@every_kind
def test_volumes_are_those_that_faces_enclose(kind):
    """Gauss on the cell's own faces; a bilinear face lets through the mean of what its two cuts do."""
    mesh = shaken(kind)
    x = mesh.nodes[mesh.cells]
    x = x - x.mean(axis=1, keepdims=True)
    if kind.dim == 1:
        enclosed = x[:, 1, 0] - x[:, 0, 0]
    elif kind.dim == 2:
        a, b = x[:, list(kind.drawn)], np.roll(x[:, list(kind.drawn)], -1, axis=1)
        enclosed = 0.5 * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(axis=1)
    else:
        enclosed = 0.0
        for face in kind.faces:
            ring = [face[k] for k in kind.face_kind.drawn]
            cuts = (
                [ring] if len(ring) == 3 else [ring[k:] + ring[:k] for k in range(4)]
            )  # all four corners cut off
            flux = sum(np.linalg.det(x[:, cut[:3]]) / 6.0 for cut in cuts) / (1 if len(ring) == 3 else 2)
            out = np.sign(np.linalg.det(np.array(kind.points)[ring[:3]] - np.mean(kind.points, axis=0)))
            enclosed = enclosed + out * flux
    assert np.allclose(mesh.cell_volumes(), enclosed, rtol=1e-12)


def test_volumes_by_the_middle_differ_in_warped_hexahedra_only():
    for kind in KINDS.values():
        mesh = shaken(kind)
        equal = np.allclose(mesh.middle_volumes(), mesh.cell_volumes(), rtol=1e-12)
        assert equal == (kind is not HEXAHEDRON), kind.name
    block = Box((1.0, 0.5, 0.75), 0.25).mapped(lambda x, y, z: (2.0 * x + z, y - 0.3 * x, z)).mesh()
    assert np.allclose(block.middle_volumes(), block.cell_volumes(), rtol=1e-12)


@every_kind
def test_stretches_do_not_depend_on_which_corner_is_the_first(kind):
    """A regular cell has its edge in all directions; cells counted from another corner have the same lengths."""
    regular = np.array(kind.points) @ kind.regular.T
    lengths = [np.linalg.norm(regular[b] - regular[a]) for a, b in kind.edges]
    assert np.allclose(lengths, 1.0)
    mesh = shaken(kind)
    turns = [kind.mirrored] if kind.grid else list(itertools.permutations(range(kind.corners)))
    for turn in turns:
        other = Mesh(**(vars(shaken(kind)) | {"cells": mesh.cells[:, turn]}))
        assert np.allclose(other.least_stretches(), mesh.least_stretches(), rtol=1e-10)


def test_least_distance_of_right_triangles():
    """Legs 1: the map from a regular triangle has singular values √2 and √(2/3), in every cell."""
    for diagonals in ("rising", "falling", "alternating"):
        mesh = Box((3.0, 2.0), 1.0, cells="triangles", diagonals=diagonals).mesh()
        assert np.allclose(mesh.least_stretches(), (2.0 / 3.0) ** 0.5)
        assert mesh.smallest_distance() == pytest.approx((2.0 / 3.0) ** 0.5)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_small_matrices_against_lapack(dim):
    """Of any kind, of rotations, of those with equal singular values, and of flat ones."""
    random = np.random.default_rng(dim)
    matrices = random.normal(size=(300, dim, dim))
    matrices[:50] = np.linalg.qr(matrices[:50])[0]
    matrices[50:60] *= np.array([2.0, 2.0, 1e-4])[:dim]
    matrices[60:70] = np.diag([2.0, 1.0, 1.0][:dim])
    assert determinants(matrices) == pytest.approx(np.linalg.det(matrices), rel=1e-11)
    least = np.linalg.svd(matrices, compute_uv=False)[:, -1]
    assert least_singular_values(matrices) == pytest.approx(least, rel=1e-11)


@every_kind
def test_waves_in_the_middle_of_a_cell_follow_from_the_least_of_its_stretches(kind):
    """√(λ_max Σ_j ∇N_j ⊗ ∇N_j), the bound of `operators/cell_limit.py`, times it is what a regular cell has."""
    mesh = shaken(kind)
    gradients = np.array(kind.gradients) @ np.linalg.inv(mesh.cell_jacobians())
    regular = np.array(kind.gradients) @ np.linalg.inv(kind.regular)
    largest = np.linalg.norm(gradients, 2, axis=(1, 2))
    assert largest * mesh.least_stretches() == pytest.approx(np.linalg.norm(regular, 2), rel=1e-12)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_one_cell_unlike_the_others_of_a_lattice_is_seen(dim):
    lattice = Box((1.0,) * dim, 0.25).mesh()
    assert np.allclose(lattice.least_stretches(), 0.25, rtol=1e-12)
    nodes = lattice.nodes.copy()
    nodes[-1, 0] -= 1e-6
    assert lattice.with_nodes(nodes).smallest_distance() < 0.25 - 1e-7


@pytest.mark.parametrize("kind", [TRIANGLE, QUAD], ids=lambda kind: kind.name)
def test_angles_of_faces_around_a_node_of_a_flat_surface_are_a_full_turn(kind):
    box = Box((1.0, 1.0, 1.0), 0.25, cells="lattice" if kind is QUAD else "tetrahedra").mesh()
    top = box.face_side == 5
    angles = np.bincount(box.faces[top].ravel(), box.face_angles()[top].ravel(), len(box.nodes))
    x, y, z = box.nodes.T
    inner = (z == 1.0) & (x > 0.1) & (x < 0.9) & (y > 0.1) & (y < 0.9)
    assert np.allclose(angles[inner], 2.0 * np.pi)
    assert np.allclose(box.face_angles().sum(axis=1), np.pi * (kind.corners - 2))


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
        Scene(shape=Triangles(), material=SOFT, duration=1.0, numerics=Numerics(velocity_scheme="taylor"))
    assert str(error.value) == (
        "cells = 'triangle' is not allowed: velocity_scheme taylor takes a 2D body's cells as quad only"
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


@pytest.mark.parametrize("kind", [SEGMENT, TRIANGLE, QUAD], ids=lambda kind: kind.name)
def test_product_rule_integrates_products_of_two_shares(kind):
    """∫ N_i N_j is (1 + δ)/6 over a segment, (1 + δ)/24 over a triangle, over a quad that of two segments."""
    segment = (1.0 + np.eye(2)) / 6.0
    exact = {
        "segment": segment,
        "triangle": (1.0 + np.eye(3)) / 24.0,
        "quad": np.kron(segment, segment),
    }[kind.name]
    found = sum(weight * np.outer(shares, shares) for weight, shares, _ in kind.product_rule)
    assert found == pytest.approx(exact, abs=1e-15)
    assert sum(weight for weight, _, _ in kind.product_rule) == pytest.approx(kind.volume, abs=1e-15)


@every_kind
def test_shares_are_one_at_their_corner(kind):
    assert [kind.shares(point).tolist() for point in kind.points] == np.eye(kind.corners).tolist()
