"""Conditions resolved node by node, against the rules of METHOD section 5 and of `warpsph.scene.resolve`."""

import itertools
import math

import numpy as np
import pytest

from warpsph import (
    Box,
    Fixed,
    Free,
    Linear,
    Polygon,
    PrescribedVelocity,
    Roller,
    Rotating,
    SceneError,
    edge,
    region,
    where,
)
from warpsph.scene import CONTINUA
from warpsph.scene.resolve import resolve

PLATE = Box((1.0, 0.5), 0.25)  # nodes at x = 0, 0.25, …, 1 and y = 0, 0.25, 0.5
BLOCK = Box((0.5, 0.5, 0.5), 0.25)
STRESS = {1: [1.0], 2: [1.0, 2.0, 4.0, 8.0], 3: [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]}
EX, EY, EZ = np.eye(3)


class Resolved:
    """The resolved conditions of a shape, asked node by node."""

    def __init__(self, shape, *conditions):
        self.mesh = shape.mesh()
        self.table = resolve(self.mesh, conditions)

    def row(self, *point):
        node = np.argmin(np.linalg.norm(self.mesh.nodes - point, axis=1))
        assert np.allclose(self.mesh.nodes[node], point)
        return self.table.nodes.tolist().index(node)

    def freedom(self, *point):
        """P at a node."""
        return self.table.velocity_projector[self.row(*point)]

    def drive(self, *point, t=0.0):
        """Σ a_k f_k(t) at a node."""
        return drives(self.table, t)[self.row(*point)]

    def kept(self, *point):
        """The stored stress components that remain of 1, 2, 4, … at a node."""
        remains = self.table.stress_projector[self.row(*point)] @ STRESS[self.mesh.dim]
        return remains.tolist()


def drives(table, t):
    """Σ a_k f_k(t), shape (b, d)."""
    values = np.array([f(t) if callable(f) else f for f in table.functions] or [0.0])
    return np.einsum("bkd,bk->bd", table.amplitude, values[table.function])


def tensor(stored, continuum):
    """Stored stress components as symmetric 3 × 3 matrices."""
    full = np.zeros((*stored.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(continuum.pairs):
        full[..., i, j] = full[..., j, i] = stored[..., k]
    return full


def turned(angle, *normal):
    c, s = math.cos(angle), math.sin(angle)
    return (c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], *normal[2:])


SLOPE = (Roller(edge("left")), Roller(edge("bottom")), Free(edge("right")), Free(edge("top")))
FOOTING = (
    Roller(edge("left")),
    Roller(edge("right")),
    Fixed(edge("bottom")),
    PrescribedVelocity(edge("top") & where(lambda x, y: x <= 0.5), (None, Linear(-2.0))),
    Free(edge("top") & where(lambda x, y: x >= 0.5)),
)
SCENES = {
    "slope": (PLATE, SLOPE),
    "footing": (PLATE, FOOTING),
    "oblique": (PLATE.rotated(0.6), SLOPE),
    "bar": (Box((1.0,), 0.25), (Fixed(edge("left")), Free(edge("right")))),
    "ell": (Polygon([(0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1)], 0.25), (Free(edge("boundary")),)),
    "block": (
        BLOCK.rotated(-0.3),
        (
            Roller(edge("left")),
            Roller(edge("bottom")),
            PrescribedVelocity(edge("front"), (None, 3.0, None)),
            Free(edge("top") | edge("right")),
        ),
    ),
    "spin": (BLOCK, (Rotating(edge("right"), 3.0, (0.1, 0.2)), Roller(edge("top")))),
}


@pytest.mark.parametrize(("shape", "conditions"), SCENES.values(), ids=SCENES.keys())
def test_projectors_are_orthogonal_projectors_and_drives_lie_across_them(shape, conditions):
    mesh = shape.mesh()
    table = resolve(mesh, conditions)
    freedom, stress = table.velocity_projector, table.stress_projector
    weight = np.sqrt([1.0 if i == j else 2.0 for i, j in mesh.continuum.pairs])
    frobenius = stress * weight[:, None] / weight
    for matrix in (freedom, frobenius):
        assert np.allclose(matrix @ matrix, matrix, atol=1e-12)
        assert np.allclose(matrix, matrix.swapaxes(1, 2), atol=1e-12)
    assert np.allclose(np.einsum("bij,bkj->bki", freedom, table.amplitude), 0.0, atol=1e-12)
    assert np.array_equal(table.moved, np.trace(freedom, axis1=1, axis2=2) < mesh.dim - 0.5)


def test_table_holds_the_selected_nodes_and_no_others():
    resolved = Resolved(PLATE, Fixed(edge("left")), Free(edge("top")))
    selected = edge("left").nodes(resolved.mesh) | edge("top").nodes(resolved.mesh)
    assert resolved.table.nodes.tolist() == np.flatnonzero(selected).tolist()


def test_no_condition_constrains_no_node():
    table = resolve(PLATE.mesh(), ())
    assert len(table.nodes) == 0 and table.functions == ()


def test_fixed_holds_every_direction_and_no_stress():
    left = Resolved(PLATE, Fixed(edge("left")))
    assert not left.freedom(0, 0.25).any()
    assert not left.drive(0, 0.25).any()
    assert left.kept(0, 0.25) == [1, 2, 4, 8]


def test_roller_holds_the_normal_and_has_no_shear():
    left = Resolved(PLATE, Roller(edge("left")))
    assert np.array_equal(left.freedom(0, 0.25), np.diag([0, 1]))
    assert left.kept(0, 0.25) == [1, 2, 0, 8]


def test_free_edge_has_no_traction_and_moves_freely():
    top = Resolved(PLATE, Free(edge("top")))
    assert np.array_equal(top.freedom(0.5, 0.5), np.eye(2))
    assert not top.table.moved.any()
    assert top.kept(0.5, 0.5) == [1, 0, 0, 8]


def test_free_end_of_a_bar_has_no_stress():
    assert Resolved(Box((1.0,), 0.25), Free(edge("right"))).kept(1.0) == [0]


def test_two_rollers_hold_their_corner_without_shear():
    corner = Resolved(PLATE, Roller(edge("left")), Roller(edge("bottom")))
    assert not corner.freedom(0, 0).any()
    assert corner.kept(0, 0) == [1, 2, 0, 8]


def test_fixed_and_roller_hold_their_corner_and_the_wall_keeps_its_zero_shear():
    corner = Resolved(PLATE, Roller(edge("left")), Fixed(edge("bottom")))
    assert not corner.freedom(0, 0).any()
    assert corner.kept(0, 0) == [1, 2, 0, 8]


def test_fixed_and_free_leave_a_corner_fixed():
    """A velocity condition beats a traction condition."""
    corner = Resolved(PLATE, Fixed(edge("left")), Free(edge("top")))
    assert not corner.freedom(0, 0.5).any()
    assert corner.kept(0, 0.5) == [1, 2, 4, 8]


def test_roller_and_free_leave_one_stress_in_the_plane():
    """The wall keeps its normal stress: along the wall the node is free, so the free edge's traction vanishes."""
    corner = Resolved(PLATE, Roller(edge("left")), Free(edge("top")))
    assert np.array_equal(corner.freedom(0, 0.5), np.diag([0, 1]))
    assert corner.kept(0, 0.5) == [1, 0, 0, 8]


def test_where_two_free_edges_meet_all_stresses_in_the_plane_vanish():
    corner = Resolved(PLATE, Free(edge("right")), Free(edge("top")))
    assert np.array_equal(corner.freedom(1, 0.5), np.eye(2))
    assert corner.kept(1, 0.5) == [0, 0, 0, 8]


def test_re_entrant_corner_of_a_free_edge_keeps_its_stress():
    """Three quarters of the space around it are material; a normal that is given is taken at its word."""
    shape, conditions = SCENES["ell"]
    ell = Resolved(shape, *conditions)
    inner = int(np.argmin(np.linalg.norm(ell.mesh.nodes - 0.5, axis=1)))
    assert inner not in ell.table.nodes
    assert ell.kept(0.75, 0.5) == [1, 0, 0, 8]
    assert Resolved(shape, Free(edge("boundary"), normal=(1.0, 0.0))).kept(0.5, 0.5) == [0, 2, 0, 8]


def test_free_and_partly_moved_edges_meet():
    """The top is pulled along y and free along x; at its corner with a free side only the shear vanishes."""
    corner = Resolved(PLATE, PrescribedVelocity(edge("top"), (None, 1.0)), Free(edge("right")))
    assert np.array_equal(corner.freedom(1, 0.5), np.diag([1, 0]))
    assert corner.drive(1, 0.5).tolist() == [0, 1]
    assert corner.kept(1, 0.5) == [0, 2, 0, 8]


def test_free_and_wholly_moved_edges_meet():
    corner = Resolved(PLATE, PrescribedVelocity(edge("top"), (2.0, 1.0)), Free(edge("right")))
    assert corner.drive(1, 0.5).tolist() == [2, 1]
    assert corner.kept(1, 0.5) == [1, 2, 4, 8]


def test_smooth_footing_moves_down_without_shear():
    footing = Resolved(PLATE, *FOOTING)
    assert np.array_equal(footing.freedom(0.25, 0.5), np.diag([1, 0]))
    assert footing.drive(0.25, 0.5, t=3.0).tolist() == [0, -6]
    assert footing.kept(0.25, 0.5) == [1, 2, 0, 8]


def test_last_node_of_a_footing_belongs_to_the_footing():
    """The free surface begins at the same node: the footing's velocity wins, the shear vanishes for both."""
    footing = Resolved(PLATE, *FOOTING)
    assert np.array_equal(footing.freedom(0.5, 0.5), np.diag([1, 0]))
    assert footing.drive(0.5, 0.5, t=3.0).tolist() == [0, -6]
    assert footing.kept(0.5, 0.5) == [1, 2, 0, 8]
    assert footing.kept(0.75, 0.5) == [1, 0, 0, 8]


def test_footing_on_the_plane_of_symmetry_moves_down_without_shear():
    footing = Resolved(PLATE, *FOOTING)
    assert not footing.freedom(0, 0.5).any()
    assert footing.drive(0, 0.5, t=3.0).tolist() == [0, -6]
    assert footing.kept(0, 0.5) == [1, 2, 0, 8]


def test_velocity_beats_the_zero_traction_of_another_velocity_condition():
    """A side that is pushed along itself has no normal traction, except where a wall holds that direction."""
    plate = Resolved(PLATE, PrescribedVelocity(edge("left"), (None, 0.0)), Roller(edge("bottom")))
    assert plate.kept(0, 0.25) == [0, 2, 4, 8]
    clamped = Resolved(PLATE, PrescribedVelocity(edge("left"), (None, 0.0)), Fixed(edge("bottom")))
    assert clamped.kept(0, 0) == [1, 2, 4, 8]


def test_zero_normal_velocity_is_a_roller():
    roller = resolve(PLATE.mesh(), [Roller(edge("top"))])
    moved = resolve(PLATE.mesh(), [PrescribedVelocity(edge("top"), (None, 0.0))])
    assert np.array_equal(roller.velocity_projector, moved.velocity_projector)
    assert np.array_equal(roller.stress_projector, moved.stress_projector)


@pytest.mark.parametrize(
    ("free", "kept"),
    [
        (("right",), [0, 2, 4, 0, 0, 32]),
        (("right", "back"), [0, 0, 4, 0, 0, 0]),
        (("right", "back", "top"), [0, 0, 0, 0, 0, 0]),
    ],
)
def test_free_face_edge_and_corner_of_a_block(free, kept):
    point = [0.5 if name in free else 0.25 for name in ("right", "back", "top")]
    assert Resolved(BLOCK, *(Free(edge(name)) for name in free)).kept(*point) == kept


@pytest.mark.parametrize(
    ("walls", "kept"),
    [
        (("right",), [1, 2, 4, 0, 0, 32]),
        (("right", "back"), [1, 2, 4, 0, 0, 0]),
        (("right", "back", "top"), [1, 2, 4, 0, 0, 0]),
    ],
)
def test_roller_face_edge_and_corner_of_a_block(walls, kept):
    held = [name in walls for name in ("right", "back", "top")]
    block = Resolved(BLOCK, *(Roller(edge(name)) for name in walls))
    point = [0.5 if side else 0.25 for side in held]
    assert np.array_equal(block.freedom(*point), np.diag([not side for side in held]))
    assert block.kept(*point) == kept


def test_oblique_wall_holds_its_normal_and_has_no_shear():
    angle = math.radians(30.0)
    normal, tangent = np.array(turned(angle, 1, 0)), np.array(turned(angle, 0, 1))
    wall = Resolved(PLATE, Roller(edge("right"), normal=tuple(7.0 * normal)))
    assert np.allclose(wall.freedom(1, 0.25), np.outer(tangent, tangent), atol=1e-15)
    stress = tensor(np.array(wall.kept(1, 0.25)), CONTINUA[2])
    before = tensor(np.array(STRESS[2]), CONTINUA[2])
    assert tangent @ stress[:2, :2] @ normal == pytest.approx(0.0, abs=1e-14)
    for u in (normal, tangent):
        assert u @ stress[:2, :2] @ u == pytest.approx(u @ before[:2, :2] @ u, rel=1e-12)
    assert stress[2, 2] == 8.0


def test_oblique_free_edge_has_no_traction():
    normal = np.array(turned(0.5, 0, 1))
    top = Resolved(PLATE, Free(edge("top"), normal=tuple(normal)))
    stress = tensor(np.array(top.kept(0.5, 0.5)), CONTINUA[2])
    before = tensor(np.array(STRESS[2]), CONTINUA[2])
    tangent = np.array(turned(0.5, 1, 0))
    assert np.allclose(stress[:2, :2] @ normal, 0.0, atol=1e-14)
    assert tangent @ stress[:2, :2] @ tangent == pytest.approx(tangent @ before[:2, :2] @ tangent, rel=1e-12)


def test_normals_of_a_curved_edge_are_means_of_the_faces_beside_the_node():
    """On a circle of equal faces the mean of two neighbouring face normals points along the radius."""
    ring = Box((1.0, 1.0), 0.125).mapped(lambda x, y: ((1 + x) * np.cos(1.5 * y), (1 + x) * np.sin(1.5 * y)))
    table = resolve(ring.mesh(), [Roller(edge("right") & where(lambda x, y: (y > 0) & (y < 2 * np.sin(1.4))))])
    radial = ring.mesh().nodes[table.nodes] / 2.0
    assert len(radial) == 7
    expected = np.eye(2) - radial[:, :, None] * radial[:, None, :]
    assert np.allclose(table.velocity_projector, expected, atol=1e-11)


@pytest.mark.parametrize(
    "conditions",
    [SLOPE, (Fixed(edge("left")), Free(edge("top")), Roller(edge("bottom")), Free(edge("right")))],
)
@pytest.mark.parametrize("shape", [PLATE, Box((0.5, 0.5, 0.25), 0.25)])
def test_turned_box_gives_the_turned_result(shape, conditions):
    angle = 0.7
    turn = np.eye(3)
    turn[:2, :2] = np.transpose([turned(angle, 1, 0), turned(angle, 0, 1)])
    straight = resolve(shape.mesh(), conditions)
    oblique = resolve(shape.rotated(angle, about=(2.0, 1.0)).mesh(), conditions)
    continuum = shape.mesh().continuum
    small, basis = turn[: continuum.dim, : continuum.dim], np.eye(continuum.stress_size)
    assert np.array_equal(straight.nodes, oblique.nodes)
    assert np.allclose(oblique.velocity_projector, small @ straight.velocity_projector @ small.T, atol=1e-11)
    for unit in basis:
        turned_unit = turn @ tensor(unit, continuum) @ turn.T
        stored = np.array([turned_unit[i, j] for i, j in continuum.pairs])
        expected = turn @ tensor(straight.stress_projector @ unit, continuum) @ turn.T
        assert np.allclose(tensor(oblique.stress_projector @ stored, continuum), expected, atol=1e-11)


@pytest.mark.parametrize("t", [0.0, 0.3, 10.0])
@pytest.mark.parametrize("shape", [PLATE, BLOCK])
def test_rotating_nodes_have_the_velocity_of_a_rigid_rotation(shape, t):
    rate, centre = -1.7, np.array([0.3, -0.2])
    mesh = shape.mesh()
    table = resolve(mesh, [Rotating(edge("right"), rate, tuple(centre))])
    arm = mesh.nodes[table.nodes, :2] - centre
    c, s = math.cos(rate * t), math.sin(rate * t)
    arm = arm @ np.array([[c, s], [-s, c]])
    expected = np.zeros((len(arm), mesh.dim))
    expected[:, 0], expected[:, 1] = -rate * arm[:, 1], rate * arm[:, 0]
    assert np.allclose(drives(table, t), expected, rtol=0.0, atol=1e-13)
    assert not table.velocity_projector.any()


@pytest.mark.parametrize("t", [0.0, 0.5, 4.0])
def test_prescribed_components_follow_their_functions_of_time(t):
    right = Resolved(PLATE, PrescribedVelocity(edge("right"), (Linear(2.0), lambda t: math.cos(t))))
    assert right.drive(1, 0.25, t=t) == pytest.approx([2.0 * t, math.cos(t)], rel=1e-15)


def test_equal_functions_are_evaluated_once():
    """The zero at the end fills the rows of nodes with fewer terms."""
    conditions = [
        PrescribedVelocity(edge("left"), (Linear(2.0), 0.0)),
        PrescribedVelocity(edge("right"), (Linear(2.0), 3.0)),
    ]
    first, *rest = resolve(PLATE.mesh(), conditions).functions
    assert (first.function, *rest) == (Linear(2.0), 3.0, 0.0)


def test_agreeing_conditions_move_a_shared_node_once():
    plate = Resolved(
        PLATE,
        PrescribedVelocity(edge("left"), (1.5, Linear(2.0))),
        PrescribedVelocity(edge("top"), (1.5, Linear(2.0))),
    )
    assert plate.drive(0, 0.5, t=2.0) == pytest.approx([1.5, 4.0], rel=1e-15)


def test_two_walls_at_a_sharp_angle_leave_no_direction_free():
    normals = [turned(angle, 1, 0) for angle in (0.0, 0.2)]
    wedge = Resolved(PLATE, *(Roller(edge("right"), normal=n) for n in normals))
    assert not wedge.freedom(1, 0.25).any()


LEFT, CORE = edge("left"), region((0.25, 0.25), (0.75, 0.25))


@pytest.mark.parametrize(
    "conditions",
    [
        (Fixed(LEFT), PrescribedVelocity(LEFT, (1.0, None))),
        (PrescribedVelocity(LEFT, (1.0, None)), PrescribedVelocity(edge("bottom"), (2.0, 0.0))),
        (PrescribedVelocity(LEFT, (Linear(1.0), None)), PrescribedVelocity(LEFT, (Linear(2.0), None))),
        (Roller(LEFT), PrescribedVelocity(LEFT, (0.5, None))),
        (Roller(LEFT, normal=(1.0, 1.0)), PrescribedVelocity(LEFT, (0.0, 1.0))),
        (Rotating(LEFT, 1.0), Fixed(LEFT)),
        (Rotating(LEFT, 1.0), Rotating(LEFT, 1.0, (0.0, 1.0))),
        (Rotating(CORE, 1.0, (0.25, 0.25)), Fixed(CORE)),  # they agree at the first node, the centre
    ],
)
def test_two_velocities_in_one_direction_are_refused(conditions):
    for order in itertools.permutations(conditions):
        with pytest.raises(SceneError, match=r"conditions\[0\].*conditions\[1\].*different velocities"):
            resolve(PLATE.mesh(), order)


@pytest.mark.parametrize(
    "moved",
    [
        Fixed(edge("top")),
        Roller(edge("top")),
        PrescribedVelocity(edge("top"), (None, 1.0)),
        Rotating(edge("top"), 1.0),
    ],
)
def test_free_and_moved_face_is_refused(moved):
    for order in itertools.permutations([moved, Free(edge("top") & where(lambda x, y: x >= 0.5))]):
        with pytest.raises(SceneError, match=r"shares 2 boundary face\(s\).*either free or moved"):
            resolve(PLATE.mesh(), order)


@pytest.mark.parametrize("condition", [Roller, Free])
def test_normal_of_an_inner_node_must_be_given(condition):
    with pytest.raises(SceneError, match=r"node 4 at \(0\.25, 0\.25\) lies on no selected boundary face"):
        resolve(PLATE.mesh(), [condition(CORE)])
    assert len(resolve(PLATE.mesh(), [condition(CORE, normal=(0.0, 1.0))]).nodes) == 3
