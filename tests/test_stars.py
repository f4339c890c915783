"""Cells made anew: stars of nodes against edge flips, and what must be true of any triangulation of a body."""

import itertools

import numpy as np
import pytest
import warp as wp

from tests.reference.edge_flips import flipped, hashes, inserted, ordered
from warpsph.device.launching import Launcher
from warpsph.device.precision import PRECISIONS
from warpsph.errors import SceneError
from warpsph.mesh.faces import mesh_of_cells
from warpsph.remaking.exact import REACH
from warpsph.remaking.outline import INSIDE, outline_of
from warpsph.remaking.triangulation import Triangulation

SEEN = 3.0  # spacings: how far stars see
HOPPER = 90  # compute capability 9.0


def lattice(columns, rows, without=lambda x, y: x < 0.0):
    """A lattice of spacing 1, each square cut in two, but for squares whose middles are left out."""
    x, y = (
        values.ravel() for values in np.meshgrid(*(np.arange(k + 1.0) for k in (columns, rows)), indexing="ij")
    )
    number = np.arange(len(x)).reshape(columns + 1, rows + 1)
    a, b, c, d = (
        corner.ravel() for corner in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    kept = ~without(x[a] + 0.5, y[a] + 0.5)
    cells = np.concatenate([np.stack([a, b, c], axis=1)[kept], np.stack([a, c, d], axis=1)[kept]])
    used = np.unique(cells)
    return mesh_of(np.stack([x, y], axis=1)[used], np.searchsorted(used, cells))


def mesh_of(points, cells):
    """The mesh of triangles."""
    return mesh_of_cells(np.asarray(points, dtype=float), np.asarray(cells), 1.0)


def moved(mesh, motion):
    """The mesh with its nodes elsewhere."""
    return mesh.with_nodes(motion(mesh.nodes))


def jittered(mesh, size, edges=False, seed=0):
    """Nodes inside, or all, moved by up to `size` along each axis."""
    shifts = size * np.random.default_rng(seed).uniform(-1.0, 1.0, mesh.nodes.shape)
    if not edges:
        shifts[np.unique(mesh.faces)] = 0.0
    return moved(mesh, lambda x: x + shifts)


def linear(*matrix):
    """The motion x → M x, M given row by row."""
    return lambda x: x @ np.reshape(matrix, (2, 2)).T


def turned(angle):
    return linear(np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle))


def quarter(x, y):
    return (x > 10.0) & (y > 10.0)


def closing(angle, first=1.0, last=1.0):
    """A motion that bends a lattice without its upper right quarter round (10, 10), to that angle.

    Both sides of the notch are so many times as long as before.
    """

    def motion(x):
        radius, phi = np.hypot(*(x - 10.0).T), np.arctan2(*(x - 10.0).T[::-1])
        share = np.mod(phi - 0.5 * np.pi, 2.0 * np.pi) / (1.5 * np.pi)
        radius = radius * (first + (last - first) * share)
        phi = np.radians(angle) * share
        return 10.0 + radius[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=1)

    return motion


def random_box(side, seed=1):
    """A mesh of a square, for its outline, and its nodes: anywhere inside, on its sides a spacing apart."""
    frame = lattice(side, side)
    outer, n = np.unique(frame.faces), len(frame.nodes)
    points = frame.nodes.copy()
    inner = np.setdiff1d(np.arange(n), outer)
    points[inner] = np.random.default_rng(seed).uniform(0.0, side, (len(inner), 2))
    columns = np.lexsort([points[:, 1], np.floor(points[:, 0])])
    return mesh_of(frame.nodes[columns], np.argsort(columns)[frame.cells]), points[columns]


def triangulation(mesh, device="cpu", threads=1, precision="float64", reach=SEEN, weight=0.0, outline=None):
    launcher = Launcher(wp.get_device(device), threads)
    return Triangulation(
        outline or outline_of(mesh),
        near=2.0,
        reach=reach,
        weight=weight,
        precision=PRECISIONS[precision],
        launcher=launcher,
    )


def positions(points, precision="float64", device="cpu"):
    return wp.array(points, dtype=PRECISIONS[precision].vec(2), device=device)


def cells_of(made):
    return made.tables.corners.numpy()[: made.tables.cells]


def bits(made):
    """All that the tables hold."""
    tables = made.tables
    first = tables.node_cells.first.numpy()
    return cells_of(made).tobytes(), first.tobytes(), tables.node_cells.place.numpy()[: first[-1]].tobytes()


def places(points, reach=SEEN):
    """Whole numbers, as the stars have them."""
    return np.floor(points / (reach / REACH) + 0.5).astype(np.int64)


def areas(points, cells):
    a, b, c = (points[corner] for corner in cells.T)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def check_tables(mesh, made):
    check_tables_of(mesh, mesh.nodes, made)


def check_tables_of(mesh, points, made):
    """A triangulation of the body: cells side by side or on the outline, its area, and a table that agrees."""
    n, cells, after = len(points), cells_of(made).astype(np.int64), outline_of(mesh).after
    ways = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    keys = np.sort(ways[:, 0] * n + ways[:, 1])
    assert (np.diff(keys) > 0).all(), "an edge that two cells have on the same side"
    edges = np.flatnonzero(after != INSIDE)
    alone = np.setdiff1d(keys, ways[:, 1] * n + ways[:, 0])
    np.testing.assert_array_equal(alone, np.sort(edges * n + after[edges]))
    assert (areas(points.astype(float), cells) > 0.0).all()
    ends = points[after[edges]]
    outlined = 0.5 * np.sum(points[edges, 0] * ends[:, 1] - points[edges, 1] * ends[:, 0])
    assert abs(areas(points, cells).sum() / outlined - 1.0) < 1e-12
    first, place = made.tables.node_cells.first.numpy(), made.tables.node_cells.place.numpy()
    owner = np.repeat(np.arange(n), np.diff(first))
    np.testing.assert_array_equal(cells.ravel()[place[: first[-1]]], owner)
    np.testing.assert_array_equal(np.sort(place[: first[-1]]), np.arange(cells.size))


HOLES = {"without": lambda x, y: (np.hypot(x - 8.0, y - 8.0) < 3.0) | (np.hypot(x - 20.0, y - 9.0) < 2.5)}
SLIT = {"without": lambda x, y: (np.abs(x - 10.0) < 0.6) & (y > 4.0)}
BODIES = {
    "lattice": lattice(30, 30),
    "a lattice that is turned": moved(lattice(30, 30), turned(0.3)),
    "a lattice that is turned by 45 degrees": moved(lattice(30, 30), turned(np.pi / 4.0)),
    "a lattice stretched 4:1": moved(lattice(30, 30), linear(2.0, 0.0, 0.0, 0.5)),
    "stretched 4:1, turned, jittered": moved(
        moved(jittered(lattice(30, 30), 0.25, edges=True), linear(2.0, 0.0, 0.0, 0.5)), turned(0.3)
    ),
    "sheared": moved(jittered(lattice(30, 30), 0.2), linear(1.0, 1.5, 0.0, 1.0)),
    "jittered by 1e-6": jittered(lattice(30, 30), 1e-6, edges=True),
    "jittered by 0.05": jittered(lattice(30, 30), 0.05, edges=True),
    "jittered by 0.25": jittered(lattice(30, 30), 0.25, edges=True),
    "a notch of 20 degrees": moved(lattice(20, 20, quarter), closing(340.0)),
    "a notch with a long side": moved(lattice(20, 20, quarter), closing(340.0, 0.6, 1.4)),
    "a notch with the other side long": moved(lattice(20, 20, quarter), closing(340.0, 1.4, 0.6)),
    "two holes": jittered(lattice(30, 18, **HOLES), 0.2),
    "two holes, a lattice": lattice(30, 18, **HOLES),
    "a slit pressed shut": moved(
        jittered(lattice(20, 20, **SLIT), 0.1),
        lambda x: (
            x
            + np.stack(
                [0.9 * np.sign(10.0 - x[:, 0]) * (np.abs(x[:, 0] - 10.0) < 1.5) * (x[:, 1] > 4.5), 0.0 * x[:, 1]],
                axis=1,
            )
        ),
    ),
    "a slit with staggered sides, all but shut": moved(
        lattice(20, 20, **SLIT),
        lambda x: np.stack(
            [
                x[:, 0] + (x[:, 1] > 4.5) * np.select([x[:, 0] == 9.0, x[:, 0] == 11.0], [0.98, -0.98], 0.0),
                x[:, 1] + 0.5 * (x[:, 0] > 9.5),
            ],
            axis=1,
        ),
    ),
    "a column that has flowed": moved(
        jittered(lattice(20, 40), 0.2),
        lambda x: np.stack(
            [
                x[:, 0] * (1.0 + 0.6 * (1.0 - x[:, 1] / 40.0)) + 1e-3 * x[:, 1] ** 2,
                x[:, 1] / (1.6 - 0.6 * x[:, 1] / 40.0),
            ],
            axis=1,
        ),
    ),
}


@pytest.mark.parametrize("name", BODIES)
def test_stars_are_what_edge_flips_make(name):
    """Cell by cell, ties included: a lattice is all ties."""
    mesh = BODIES[name]
    made = triangulation(mesh)
    assert made.make(positions(mesh.nodes))
    check_tables(mesh, made)
    np.testing.assert_array_equal(ordered(cells_of(made)), flipped(places(mesh.nodes), mesh.cells))


@pytest.mark.parametrize("side", [12, 40])
def test_random_nodes_are_triangulated_as_by_insertion(side):
    """Where cells have no lattice to start from; a star may see farther than three spacings."""
    frame, points = random_box(side)
    made = triangulation(frame, reach=4.5)
    assert made.make(positions(points))
    check_tables_of(frame, points, made)
    corners = [
        np.flatnonzero((frame.nodes == corner).all(axis=1))[0]
        for corner in np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * side
    ]
    np.testing.assert_array_equal(ordered(cells_of(made)), inserted(places(points, 4.5), corners))


def test_weights_make_a_power_diagram():
    mesh, weight = jittered(lattice(25, 25), 0.2), 0.02
    made = triangulation(mesh, weight=weight)
    assert made.make(positions(mesh.nodes))
    check_tables(mesh, made)
    largest = round(weight / (SEEN / REACH) ** 2)
    weights = [h * largest >> 32 for h in hashes(len(mesh.nodes))]
    expected = flipped(places(mesh.nodes), mesh.cells, weights)
    np.testing.assert_array_equal(ordered(cells_of(made)), expected)
    assert (expected != flipped(places(mesh.nodes), mesh.cells)).any(), "weights that change nothing test nothing"


def test_a_lattice_that_turns_keeps_its_cells_by_weights():
    """Without them the diagonal of a square is decided by how its corners are rounded, and half of them change.

    Rounding by half a unit moves D by some 2e-4 Δx², against weights that differ by up to 5e-3 Δx²: some 4 %.
    """
    mesh, changed = lattice(40, 40), {}
    for weight in (0.0, 5e-3):
        made, kept = triangulation(mesh, weight=weight), []
        for angle in (0.0, 0.1, 0.2):
            assert made.make(positions(turned(angle)(mesh.nodes)))
            kept.append({tuple(cell) for cell in cells_of(made).tolist()})
        changed[weight] = max(len(after - before) for before, after in itertools.pairwise(kept)) / len(kept[0])
    assert changed[0.0] > 0.3
    assert changed[5e-3] < 0.04


FLOWS = {
    "sheared": (jittered(lattice(30, 30), 0.25), lambda x: x @ np.array([[1.0, 0.0], [0.03, 1.0]])),
    "a lattice, sheared": (lattice(30, 30), lambda x: x @ np.array([[1.0, 0.0], [0.03, 1.0]])),
    "a lattice, turned": (lattice(30, 30), turned(0.05)),
    "a column that slumps": (
        jittered(lattice(20, 40), 0.2),
        lambda x: (
            x * [1.0, 1.0]
            + 0.02 * np.stack([x[:, 0] * (1.0 - x[:, 1] / 40.0), -x[:, 1] + 0.5 * x[:, 1] ** 2 / 40.0], axis=1)
        ),
    ),
}


@pytest.mark.parametrize("weight", [0.0, 5e-3])
@pytest.mark.parametrize("name", FLOWS)
def test_renewed_cells_are_those_made_from_nothing(name, weight):
    """Bit by bit; most stars are let alone."""
    (mesh, flow), least = FLOWS[name], 1.0
    points, renewed, made = mesh.nodes, triangulation(mesh, weight=weight), triangulation(mesh, weight=weight)
    assert renewed.make(positions(points))
    for _ in range(20):
        points = flow(points)
        assert renewed.renew(positions(points))
        assert made.make(positions(points))
        assert bits(renewed) == bits(made)
        least = min(least, renewed.wrapped / len(points))
    check_tables(mesh.with_nodes(points), made)
    assert least < 0.5 or name == "a lattice, turned"


def test_nothing_is_wrapped_where_nothing_moved():
    mesh = jittered(lattice(20, 20), 0.25)
    made = triangulation(mesh)
    assert made.make(positions(mesh.nodes))
    assert made.wrapped >= len(mesh.nodes)
    assert made.renew(positions(mesh.nodes))
    assert made.wrapped == 0


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_same_bits_twice_and_on_any_number_of_threads(device, precision):
    points, found = jittered(lattice(60, 60), 0.3), []
    moved_on = points.nodes @ np.array([[1.0, 0.0], [0.05, 1.0]])
    for threads in (1, 1, 2, 3):
        made = triangulation(points, device, threads, precision)
        assert made.make(positions(points.nodes, precision, device))
        assert made.renew(positions(moved_on, precision, device))
        found.append(bits(made))
    assert len(set(found)) == 1


def test_positions_in_float32_serve():
    mesh = jittered(lattice(40, 40), 0.25)
    made = triangulation(mesh, precision="float32")
    assert made.make(positions(mesh.nodes, "float32"))
    check_tables(mesh.with_nodes(mesh.nodes.astype(np.float32).astype(float)), made)


@pytest.mark.parametrize("side", [316, pytest.param(1000, marks=pytest.mark.long)])
@pytest.mark.parametrize("jitter", [0.0, 1e-6, 0.25, 0.5])
def test_large_bodies(side, jitter):
    mesh = jittered(lattice(side, side), jitter)
    made = triangulation(mesh)
    assert made.make(positions(mesh.nodes - side / 2))
    check_tables(mesh.with_nodes(mesh.nodes - side / 2), made)


@pytest.mark.parametrize("side", [60, pytest.param(316, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", ["jittered", "stretched", "random"])
def test_stars_agree_with_scipy(kind, side):
    """But for ties, of which there are none. It triangulates the hull: what lies outside the body is left out."""
    spatial = pytest.importorskip("scipy.spatial", reason="SciPy is not installed")
    mesh, points = random_box(side)
    reach = 4.5
    if kind != "random":
        mesh, reach = jittered(lattice(side, side), 0.3), SEEN
        points = mesh.nodes @ (np.diag([2.0, 0.5]) if kind == "stretched" else np.eye(2))
    made = triangulation(mesh, reach=reach)
    assert made.make(positions(points))
    expected = spatial.Delaunay(places(points, reach).astype(float)).simplices
    expected = expected[np.abs(areas(points, expected)) > 1e-9]  # flat ones along straight sides
    found = {frozenset(cell) for cell in cells_of(made).tolist()}
    assert found == {frozenset(cell) for cell in expected.tolist()}


def test_what_is_no_body_is_refused_and_what_becomes_one_again_is_not():
    """Nodes in one place, a node that left through the outline, or far away; cells larger than the reach."""
    mesh = jittered(lattice(12, 12), 0.1)
    made, good = triangulation(mesh), mesh.nodes
    inner = int(np.setdiff1d(np.arange(len(good)), np.unique(mesh.faces))[40])
    for node, place in ((inner, good[inner + 1]), (inner, (-0.7, 5.2)), (inner, (1e9, 0.0))):
        bad = good.copy()
        bad[node] = place
        assert not made.make(positions(bad))
        assert not made.renew(positions(bad))
        assert made.renew(positions(good))
        check_tables(mesh, made)
    assert not triangulation(mesh, reach=0.9).make(positions(good))


def test_parts_that_touch_in_a_node_are_refused():
    mesh = lattice(4, 4, lambda x, y: (x - 2.0) * (y - 2.0) > 0.0)
    with pytest.raises(SceneError, match=r"shape = 'two parts that touch in the node at \(2.0, 2.0\)'"):
        outline_of(mesh)


@pytest.mark.skipif(HOPPER not in wp.get_cuda_supported_archs(), reason="this Warp can not compile for CUDA")
def test_all_kernels_compile_for_cuda(tmp_path):
    modules = {kernel.module for kernel in triangulation(lattice(3, 3)).kernels}
    for module in modules:
        wp.compile_aot_module(module, arch=HOPPER, module_dir=tmp_path, use_ptx=False)
    assert len(list(tmp_path.glob("*.cubin"))) == len(modules)


def at(mesh, *place):
    """The node in a place."""
    return int(np.flatnonzero((mesh.nodes == place).all(axis=1))[0])


def surfaced(mesh, points, joining, held=()):
    """Cells of a body after nodes have joined its outline, or left it, and its nodes and outline then."""
    made, placed = triangulation(mesh), positions(points)
    made.surfacing.held.assign(np.isin(np.arange(len(points)), held).astype(np.int32))
    assert made.make(placed)
    if joining:
        made.join(placed, wp.zeros_like(placed))
    else:
        made.leave(placed)
    assert made.renew(placed)
    after, before = made.outline.after.numpy(), made.outline.before.numpy()
    rim = np.flatnonzero(after != INSIDE)
    np.testing.assert_array_equal(before[after[rim]], rim)
    np.testing.assert_array_equal(np.flatnonzero(before != INSIDE), rim)
    cells, points = cells_of(made), placed.numpy()
    assert abs(areas(points, cells).sum() / 100.0 - 1.0) < 1e-12
    assert len(cells) == 2 * len(points) - len(rim) - 2
    return points, after


def test_a_node_that_comes_to_an_edge_joins_the_outline():
    mesh = lattice(10, 10)
    start, end, node, points = at(mesh, 5, 0), at(mesh, 6, 0), at(mesh, 5, 1), mesh.nodes.copy()
    points[node] = (5.6, 0.01)
    found, after = surfaced(mesh, points, joining=True)
    assert (after[start], after[node]) == (node, end)
    np.testing.assert_allclose(found[node], (5.6, 0.0), atol=1e-15)
    np.testing.assert_array_equal(np.delete(found, node, axis=0), np.delete(points, node, axis=0))


def test_held_nodes_stay_on_the_outline_and_edges_between_them_as_they_are():
    mesh, points = lattice(10, 10), lattice(10, 10).nodes.copy()
    start, end, node = at(mesh, 5, 0), at(mesh, 6, 0), at(mesh, 5, 1)
    points[node] = (5.6, 0.01)
    for held, joins in (((start,), True), ((node,), False), ((start, end), False)):
        _, after = surfaced(mesh, points, True, held)
        assert (after[start] == node) == joins
    points = mesh.nodes.copy()
    points[[start, end], 0] = 5.4, 5.8
    points[at(mesh, 7, 0), 0] = 6.2
    assert surfaced(mesh, points, False)[1][end] == INSIDE
    assert surfaced(mesh, points, False, (end,))[1][end] != INSIDE


def test_a_long_edge_takes_a_node_from_farther():
    """Of three spacings nine times as far: 0.3 above the middle of the edge it sees 157 degrees."""
    mesh, points = lattice(10, 10), lattice(10, 10).nodes.copy()
    for x, to in ((3, 2.2), (4, 2.6), (5, 3.0), (6, 6.0), (7, 7.0)):
        points[at(mesh, x, 0), 0] = to
    node = at(mesh, 5, 1)
    points[node] = (4.5, 0.3)
    _, after = surfaced(mesh, points, joining=True)
    assert after[at(mesh, 5, 0)] == node
    points[node] = (4.5, 0.7)
    _, after = surfaced(mesh, points, joining=True)
    assert after[at(mesh, 5, 0)] == at(mesh, 6, 0)


def test_a_node_with_short_edges_leaves_the_outline():
    """Of three in a row one: between others that leave, an edge could pass through what has left."""
    mesh, points = lattice(10, 10), lattice(10, 10).nodes.copy()
    row = [at(mesh, x, 0) for x in (3, 4, 5, 6, 7)]
    points[row, 0] = 4.2, 4.6, 5.0, 5.4, 5.8
    found, after = surfaced(mesh, points, joining=False)
    left = [node for node in row if after[node] == INSIDE]
    assert 1 <= len(left) <= 2
    assert (found[left, 1] > 0.1).all()
    np.testing.assert_array_equal(np.delete(found, left, axis=0), np.delete(points, left, axis=0))


def test_cells_that_were_kept_elsewhere_are_renewed_alike():
    """As after a checkpoint: stars are taken from tables."""
    (mesh, flow), made = FLOWS["sheared"], triangulation(FLOWS["sheared"][0])
    assert made.make(positions(mesh.nodes))
    other = triangulation(mesh)
    other.adopt(made.tables.corners, made.tables.node_cells)
    for cells in (made, other):
        assert cells.renew(positions(flow(mesh.nodes)))
    assert bits(other) == bits(made)
    assert other.wrapped == made.wrapped < 0.5 * len(mesh.nodes)
