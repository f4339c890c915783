"""Selections of nodes against masks written out by hand."""

import numpy as np
import pytest

from warpsph import Box, SceneError, edge, everywhere, region, where

PLATE = Box((1.0, 0.5), 0.1).mesh()
X, Y = PLATE.nodes.T
BLOCK = Box((1.0, 0.5, 0.5), 0.25).mesh()


def face_names(selection, mesh=PLATE):
    """Names of the edges whose faces may give the selection's nodes a normal."""
    sides = np.unique(mesh.face_side[selection.faces(mesh)])
    return {mesh.continuum.edges[side] for side in sides}


@pytest.mark.parametrize(
    ("name", "axis", "value"), [("left", 0, 0.0), ("right", 0, 1.0), ("bottom", 1, 0.0), ("top", 1, 0.5)]
)
def test_edge_holds_the_nodes_of_one_side_and_its_faces(name, axis, value):
    assert np.array_equal(edge(name).nodes(PLATE), np.isclose(PLATE.nodes[:, axis], value))
    assert face_names(edge(name)) == {name}


@pytest.mark.parametrize(
    ("name", "axis", "value"),
    [
        ("left", 0, 0.0),
        ("right", 0, 1.0),
        ("front", 1, 0.0),
        ("back", 1, 0.5),
        ("bottom", 2, 0.0),
        ("top", 2, 0.5),
    ],
)
def test_edges_of_a_block(name, axis, value):
    assert np.array_equal(edge(name).nodes(BLOCK), BLOCK.nodes[:, axis] == value)


def test_edges_of_a_bar_are_its_ends():
    bar = Box((1.0,), 0.25).mesh()
    assert edge("left").nodes(bar).tolist() == [True, False, False, False, False]
    assert edge("right").nodes(bar).tolist() == [False, False, False, False, True]


def test_boundary_is_all_edges():
    interior = (X > 0.05) & (X < 0.95) & (Y > 0.05) & (Y < 0.45)
    assert np.array_equal(edge("boundary").nodes(PLATE), ~interior)
    assert face_names(edge("boundary")) == {"left", "right", "bottom", "top"}


def test_edge_names_turn_with_the_lattice():
    turned = Box((1.0, 0.5), 0.1).rotated(0.4).mesh()
    assert np.array_equal(edge("top").nodes(turned), edge("top").nodes(PLATE))


def test_region_includes_its_sides():
    inside = region((0.3, 0.1), (0.7, 0.2)).nodes(PLATE)
    assert np.array_equal(inside, (X > 0.25) & (X < 0.75) & (Y > 0.05) & (Y < 0.25))
    assert region((0.3, 0.1), (0.3, 0.1)).nodes(PLATE).sum() == 1


@pytest.mark.parametrize("origin", [0.0, 0.1, -0.7, 1000.0])
def test_where_includes_a_node_on_its_limit(origin):
    """0.1 + 2 · 0.1 > 0.3 in floating point: round-off must not decide which nodes are selected."""
    mesh = Box((1.0, 0.5), 0.1, origin=(origin, 0.0)).mesh()
    limit = round(origin + 0.3, 9)
    assert where(lambda x, y: x <= limit).nodes(mesh).sum() == 4 * 6
    assert where(lambda x, y: x >= limit).nodes(mesh).sum() == 8 * 6
    assert where(lambda x, y: x < limit).nodes(mesh).sum() == 3 * 6


def test_where_may_give_a_normal_on_every_edge():
    assert face_names(where(lambda x, y: x <= 0.3)) == {"left", "right", "bottom", "top"}


def test_everywhere_is_every_node():
    assert everywhere().nodes(PLATE).all() and len(everywhere().nodes(PLATE)) == 11 * 6


def test_and_keeps_common_nodes_and_common_faces():
    selection = edge("top") & where(lambda x, y: x <= 0.3)
    assert np.array_equal(selection.nodes(PLATE), np.isclose(Y, 0.5) & (X < 0.35))
    assert face_names(selection) == {"top"}


def test_or_keeps_all_nodes_and_all_faces():
    selection = edge("left") | edge("bottom")
    assert np.array_equal(selection.nodes(PLATE), np.isclose(X, 0.0) | np.isclose(Y, 0.0))
    assert face_names(selection) == {"left", "bottom"}


def test_not_is_the_complement():
    assert np.array_equal((~edge("left")).nodes(PLATE), X > 0.05)


def test_combinations_obey_de_morgan():
    a, b = edge("left"), where(lambda x, y: y <= 0.2)
    assert np.array_equal((~(a & b)).nodes(PLATE), (~a | ~b).nodes(PLATE))
    assert np.array_equal((~(a | b)).nodes(PLATE), (~a & ~b).nodes(PLATE))
    assert np.array_equal((~~a).nodes(PLATE), a.nodes(PLATE))


@pytest.mark.parametrize("combine", [lambda s: s & "left", lambda s: s | None])
def test_only_selections_combine(combine):
    with pytest.raises(SceneError, match="selection"):
        combine(edge("top"))
