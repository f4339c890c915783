"""Bodies of given cells: as a lattice has them whatever their order, tags, and what is refused."""

import numpy as np
import pytest

from warpsph import Box, GivenMesh, SceneError, tag

BOXES = {
    "segment": Box((1.0,), 0.5),
    "quad": Box((1.0, 0.5), 0.25),
    "triangle": Box((1.0, 0.5), 0.25, cells="triangles"),
    "hexahedron": Box((1.0, 0.5, 0.5), 0.25),
    "tetrahedron": Box((1.0, 0.5, 0.5), 0.25, cells="tetrahedra"),
}


@pytest.mark.parametrize("name", BOXES)
@pytest.mark.parametrize("turned", [False, True])
def test_given_cells_of_a_box_are_its_mesh_either_way_round(name, turned):
    box = BOXES[name].mesh()
    own = box.cells[:, box.kind.mirrored] if turned else box.cells
    mesh = GivenMesh(box.nodes, own[:, box.kind.drawn]).mesh()
    assert mesh.kind is box.kind and np.array_equal(mesh.cells, box.cells)

    def faces(m):
        return {(*sorted(f), c, s) for f, c, s in zip(m.faces.tolist(), m.face_cell, m.face_side, strict=True)}

    assert faces(mesh) == faces(box)


def test_tags_hold_nodes_or_boundary_faces():
    points, cells = [(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)]
    mesh = GivenMesh(points, cells, tags={"base": [(1, 0)], "nodes": [0, 1, 3]}).mesh()
    assert tag("base").nodes(mesh).tolist() == [True, True, False, False]
    assert [sorted(face) for face in mesh.faces[tag("base").faces(mesh)].tolist()] == [[0, 1]]
    assert tag("nodes").faces(mesh).sum() == 2
    with pytest.raises(SceneError, match="must be one of base, nodes"):
        tag("bass").nodes(mesh)
    with pytest.raises(SceneError, match="a face of the boundary"):
        GivenMesh(points, cells, tags={"inner": [(0, 2)]})


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


@pytest.mark.parametrize(
    ("points", "cells", "said"),
    [
        (SQUARE, [(0, 1, 2), (0, 2, 4)], "below 4"),
        (SQUARE, [(0, 1, 2), (2, 1, 0), (0, 2, 3)], "same corners"),
        (SQUARE, [(0, 1, 2)], "corner of no cell"),
        (SQUARE, [(0, 2, 1, 3)], "flat or folded"),
        ([*SQUARE, (0.0, 0.0)], [(0, 1, 2), (4, 2, 3)], "in the same place"),
        ([*SQUARE, (2.0, 1.0), (2.0, 2.0)], [(0, 1, 2), (0, 2, 3), (2, 4, 5)], "one piece"),
        ([*SQUARE, (0.6, 0.7)], [(0, 1, 2), (0, 2, 3), (0, 2, 4)], "two cells at most"),
        ([*SQUARE, (0.9, 0.2)], [(0, 1, 2), (0, 2, 4), (0, 2, 3)], "two cells at most"),
        ([(0, 0), (1, 0), (0, 1), (0.2, 0.2)], [(0, 1, 2), (0, 1, 3)], "same side"),
    ],
)
def test_cells_that_are_no_body_are_refused(points, cells, said):
    with pytest.raises(SceneError, match=said):
        GivenMesh(points, cells)
