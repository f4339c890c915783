"""The moving free surface: who is on it, with which normal, what it does to the stress, when it is found anew."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    Disc,
    Elastic,
    Fixed,
    Free,
    FreeSurface,
    Numerics,
    PerzynaVonMises,
    Polygon,
    PrescribedVelocity,
    Ramp,
    Roller,
    Scene,
    SceneError,
    Simulation,
    edge,
    where,
)
from warpsph.device.launching import Launcher
from warpsph.operators.conditions import Conditions
from warpsph.operators.surface.scan import SurfaceScan
from warpsph.physics.space import Space

ELASTIC = Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0)
# Exact to round-off: in float32 a position carries 1e-6 of a spacing, and a direction to the next node as much; in
# float64 what is left is the shift of the inverse iteration, (1e-4/0.1)² of the scan's own error.
ROUND_OFF = {"float64": 1e-6, "float32": 1e-5}  # [rad]

# Only published schemes need one; mapped lattices are stretched, and round kernels must be wide there.
SUMS = Numerics(velocity_scheme="taylor", smoothing_ratio=1.9)


def simulation_of(shape, device, precision, normals="improved", **options):
    """A scene with a free surface at its start."""
    fields = {"material": ELASTIC, "duration": 1.0, "numerics": SUMS} | options
    scene = Scene(shape=shape, free_surface=FreeSurface(normals=normals), **fields)
    return Simulation(scene, device=device, precision=precision)


def scan_of(simulation, candidates):
    """A scan of its own among some nodes."""
    space, launcher = Space(simulation.mesh.continuum, simulation.precision), Launcher(simulation.device)
    return SurfaceScan(simulation.scene, candidates, nodes=simulation.nodes, space=space, launcher=launcher)


def counted_searches(simulation):
    """A list that gets the number of steps made whenever the surface is sought from now on."""
    searches, refresh = [], simulation.conditions.refresh
    simulation.conditions.refresh = lambda: (searches.append(simulation.steps), refresh())
    return searches


def angles(a, b):
    """Angle between unit vectors [rad], exact for small ones as arccos is not."""
    return 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=1), 0.0, 1.0))


def on_boundary(mesh):
    mask = np.zeros(len(mesh.nodes), dtype=bool)
    mask[mesh.faces] = True
    return mask


# ---------------------------------------------------------------------------------------------------------
# Bodies with known normals
# ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Body:
    """A body, the exact normal as a function of its nodes before the mapping, and the nodes that have one.

    `bound` [rad] is for the largest angle between the improved and the exact normal; None stands for round-off.
    """

    shape: object
    reference: object
    normal: Callable
    smooth: Callable
    bound: float | None
    conditions: tuple = ()


def unit(vectors):
    """Unit vectors; zero ones stay zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


AMPLITUDE, NODES_PER_WAVE = 0.1, 20


def sine_error(nodes_per_wave, amplitude=AMPLITUDE):
    """Leading error of the fitted normal on y = A sin kx: y''' ⟨s²⟩/6, ⟨s²⟩ the mean square distance of the
    neighbours, at most 1.5 Δx² with weights that end at 2.7 Δx; wavelength 1.
    """
    return amplitude * (2 * np.pi) ** 3 * 1.5 / nodes_per_wave**2 / 6.0


def wavy(nodes_per_wave=NODES_PER_WAVE):
    """METHOD section 6, the paper's figure 3: a sine surface over a wall on the left and one below."""
    length, height, k = 2.0, 1.0, 2 * np.pi
    box = Box((length, height), 1.0 / nodes_per_wave)
    return Body(
        shape=box.mapped(lambda x, y: (x, y * (1.0 + AMPLITUDE * np.sin(k * x) / height))),
        reference=box,
        normal=lambda x: unit(np.stack([-AMPLITUDE * k * np.cos(k * x[:, 0]), np.ones(len(x))], axis=1)),
        smooth=lambda x: np.isclose(x[:, 1], height) & (x[:, 0] > 0.0) & ~np.isclose(x[:, 0], length),
        bound=sine_error(nodes_per_wave),
        conditions=(Roller(edge("left")), Fixed(edge("bottom"))),
    )


def to_ball(*x):
    """A square or cube (−1, 1)ᵈ onto the unit ball: shells onto shells."""
    largest, radius = np.max(np.abs(x), axis=0), np.sqrt(np.sum(np.square(x), axis=0))
    return tuple(part * largest / np.where(radius > 0.0, radius, 1.0) for part in x)


def ball(cells, axes=(1.0, 1.0)):
    """A disc, an ellipse or a ball.

    On a circle and a sphere the fit is exact. On an ellipse the curvature changes along the arc, and the error is
    dκ/ds ⟨s²⟩/6 as on a sine; with semi-axes a, b of 1.3 and 1/1.3 dκ/ds is below 2.4, and spacings there are up
    to 1.3 times those of the circle.
    """
    dim, spacing = len(axes), 1.0 / cells
    box = Box((2.0,) * dim, spacing, (-1.0,) * dim)
    axes = np.array(axes)

    def stretched(*x):
        return tuple(a * part for a, part in zip(axes, to_ball(*x), strict=True))

    return Body(
        shape=box.mapped(stretched),
        reference=box,
        normal=lambda x: unit(np.stack(to_ball(*x.T), axis=1) / axes),
        smooth=lambda x: np.isclose(np.abs(x).max(axis=1), 1.0),
        bound=None if np.ptp(axes) == 0.0 else 2.4 * 1.5 * (1.3 * spacing) ** 2 / 6.0,
    )


def deformed_box(size, deformation):
    """A box under a homogeneous deformation F: faces stay flat, with normals F⁻ᵀ N."""
    F = np.array(deformation)
    box = Box(size, 0.1)

    def face_count(x):
        return sum(np.isclose(x[:, k], side).astype(int) for k in range(len(size)) for side in (0.0, size[k]))

    def normal(x):
        N = np.stack([np.isclose(x[:, k], size[k]) * 1.0 - np.isclose(x[:, k], 0.0) for k in range(len(size))], 1)
        return unit(N @ np.linalg.inv(F))

    return Body(
        shape=box.mapped(lambda *x: tuple(F @ np.array(x))),
        reference=box,
        normal=normal,
        smooth=lambda x: face_count(x) == 1,
        bound=None,
    )


def thin_wedge(slope=0.05):
    """Two cells thick, so that each node has the other side's nodes in its support; the ends are left out."""
    box = Box((2.0, 0.2), 0.1)
    return Body(
        shape=box.mapped(lambda x, y: (x, y * (0.5 + 5.0 * slope * x))),
        reference=box,
        normal=lambda x: np.where(x[:, 1:] > 0.0, unit(np.array([[-slope, 1.0]])), np.array([[0.0, -1.0]])),
        smooth=lambda x: (x[:, 0] > 0.0) & ~np.isclose(x[:, 0], 2.0) & ~np.isclose(x[:, 1], 0.1),
        bound=None,
    )


def rotation(angle):
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def wavy_top_3d():
    """z = A sin kx cos ky over a flat bottom, the edges of the top left out.

    The error is that of the sine in either direction, and one-sided neighbours beside an edge double it.
    """
    height, k, spacing = 0.5, 2 * np.pi, 1.0 / NODES_PER_WAVE
    box = Box((1.0, 0.5, height), spacing)

    def surface(x, y):
        return AMPLITUDE * np.sin(k * x) * np.cos(k * y)

    def normal(x):
        cx, sx, cy, sy = (f(k * x[:, axis]) for axis in (0, 1) for f in (np.cos, np.sin))
        return unit(np.stack([-AMPLITUDE * k * cx * cy, AMPLITUDE * k * sx * sy, np.ones(len(x))], axis=1))

    def smooth(x):
        inside = (x[:, 0] > 1e-9) & (x[:, 0] < 1.0 - 1e-9) & (x[:, 1] > 1e-9) & (x[:, 1] < 0.5 - 1e-9)
        return np.isclose(x[:, 2], height) & inside

    return Body(
        shape=box.mapped(lambda x, y, z: (x, y, z * (1.0 + surface(x, y) / height))),
        reference=box,
        normal=normal,
        smooth=smooth,
        bound=2.0 * sine_error(NODES_PER_WAVE),
    )


BODIES = {
    "wavy": wavy,
    "disc": lambda: ball(13),
    "ellipse": lambda: ball(13, (1.3, 1.0 / 1.3)),
    "rotated box": lambda: deformed_box((2.0, 1.0), rotation(0.5)),
    "sheared box": lambda: deformed_box((2.0, 1.0), rotation(0.2) @ [[1.0, 0.6], [0.0, 1.0]]),
    "stretched box": lambda: deformed_box((2.0, 1.0), rotation(0.2) @ np.diag([1.5, 1 / 1.5])),
    "compressed box": lambda: deformed_box((2.0, 1.0), np.diag([0.7, 0.7])),
    "thin wedge": thin_wedge,
    "3D box": lambda: deformed_box((1.0, 0.8, 0.6), np.eye(3)),
    "3D sheared box": lambda: deformed_box((1.0, 0.8, 0.6), [[1.0, 0.4, 0.2], [0.0, 1.0, 0.3], [0.0, 0.0, 1.0]]),
    "3D wavy": wavy_top_3d,
    "ball": lambda: ball(6, (1.0, 1.0, 1.0)),
}


@pytest.mark.parametrize("name", BODIES)
def test_surface_nodes_and_normals(device, precision, name):
    """Exactly the boundary nodes that nobody moves are found, with normals as good as their order allows."""
    body = BODIES[name]()
    reference = body.reference.mesh().nodes
    simulation = simulation_of(body.shape, device, precision, conditions=body.conditions)
    moved = np.zeros(len(reference), dtype=bool)
    for condition in body.conditions:
        moved |= condition.on.nodes(simulation.mesh)
    free = simulation.field("free_surface")
    assert np.array_equal(free, on_boundary(simulation.mesh) & ~moved)

    smooth, exact = body.smooth(reference), body.normal(reference)
    improved = angles(simulation.field("surface_normal"), exact)[smooth]
    scanned = simulation_of(body.shape, device, precision, normals="marrone", conditions=body.conditions)
    marrone = angles(scanned.field("surface_normal"), exact)[smooth]
    assert improved.max() <= (body.bound or 0.0) + ROUND_OFF[precision]
    assert improved.mean() <= np.deg2rad(3.0)
    assert improved.mean() < marrone.mean()
    assert not simulation.field("surface_normal")[~free].any()


@pytest.mark.parametrize("name", BODIES)
def test_scan_alone_tells_inside_from_surface(device, precision, name):
    """Also when every node is a candidate, those inside are told apart, though n is noise there.

    The compressed and stretched lattices stay within what the text of `surface_scan` promises.
    """
    simulation = simulation_of(BODIES[name]().shape, device, precision)
    everyone = np.arange(len(simulation.mesh.nodes))
    scan = scan_of(simulation, everyone)
    scan.refresh()
    assert np.array_equal(scan.candidates.exposed.numpy() == 1, on_boundary(simulation.mesh))


def test_normals_converge_with_second_order(device):
    """Order between 1.8 and 2.2 on the sine surface: the fit leaves the third derivative out, and no more."""
    errors = []
    for nodes_per_wave in (20, 40):
        body = wavy(nodes_per_wave)
        reference = body.reference.mesh().nodes
        simulation = simulation_of(body.shape, device, "float64", conditions=body.conditions)
        error = angles(simulation.field("surface_normal"), body.normal(reference))[body.smooth(reference)]
        errors.append(np.sqrt(np.mean(error**2)))
    assert 1.8 <= np.log2(errors[0] / errors[1]) <= 2.2


def test_staircase(device, precision, record_property):
    """A disc cut out of the lattice. Where two steps meet inwards three cells surround a node, and it counts as
    inside; all other edge nodes are found. The normals are those of the steps, up to 45° off the circle's.
    """
    simulation = simulation_of(Disc(1.0, 1.0 / 13.0), device, precision)
    mesh = simulation.mesh
    cells = np.bincount(mesh.cells.ravel(), minlength=len(mesh.nodes))
    free = simulation.field("free_surface")
    assert np.array_equal(free, on_boundary(mesh) & (cells < 3))
    error = np.rad2deg(angles(simulation.field("surface_normal"), unit(mesh.nodes)))[free]
    record_property("mean angle to the circle's normal [deg]", float(error.mean()))
    assert error.max() <= 45.0


def test_inner_corner_is_not_free(device, precision):
    """An L: the node in its inner corner has material over 270° and keeps its stress; outer corners lose it."""
    shape = Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], spacing=0.1)
    simulation = simulation_of(shape, device, precision, stress=lambda x, y: (1.0, 2.0, 3.0, 4.0))
    inner = simulation.nearest_node((1.0, 1.0))
    assert not simulation.field("free_surface")[inner]
    assert simulation.field("stress")[inner].tolist() == [1.0, 2.0, 3.0, 4.0]
    for corner in [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 2.0), (0.0, 2.0)]:
        stress = simulation.field("stress")[simulation.nearest_node(corner)]
        assert np.abs(stress[:3]).max() <= 10 * ROUND_OFF[precision]


@pytest.mark.parametrize(("gap", "closed"), [(2, True), (3, False)])
def test_slot_closes(device, precision, gap, closed):
    """Two faces of one body opposite each other: they are free unless the scan, 8/3 Δx deep, reaches across."""
    spacing = 0.1
    low, high = 0.5, 0.5 + gap * spacing
    right = high + 0.5
    slot = [(high, 1.0), (high, 0.4), (low, 0.4), (low, 1.0)]
    shape = Polygon([(0.0, 0.0), (right, 0.0), (right, 1.0), *slot, (0.0, 1.0)], spacing)
    simulation = simulation_of(shape, device, precision)
    free = simulation.field("free_surface")
    for x in (low, high):
        assert free[simulation.nearest_node((x, 0.7))] != closed
    assert free[simulation.nearest_node((0.0, 0.7))]


def test_candidates_end_at_the_walls():
    """The free edges with their ends, which lie on walls as well; no other node of a wall."""
    walls = [Roller(edge("left")), Fixed(edge("bottom"))]
    scene = plane(conditions=walls, free_surface=FreeSurface())
    candidates = scene.free_surface.candidates(scene.mesh, scene.conditions)
    x = scene.mesh.nodes
    assert candidates.tolist() == np.flatnonzero(np.isclose(x, 1.0).any(axis=1)).tolist()


# ---------------------------------------------------------------------------------------------------------
# What it does to the stress
# ---------------------------------------------------------------------------------------------------------


def tensors(stress, pairs):
    full = np.zeros((len(stress), 3, 3))
    for k, (i, j) in enumerate(pairs):
        full[:, i, j] = full[:, j, i] = stress[:, k]
    return full


@pytest.mark.parametrize(("size", "stress"), [((1.0, 0.6), (1, 2, 3, 4)), ((0.5, 0.4, 0.6), (1, 2, 3, 4, 5, 6))])
def test_tractions_vanish(device, precision, size, stress):
    """A rotated box with a uniform stress: no traction is left on any face, and inside all is kept.

    Every node keeps exactly u·σ u along the directions u in all its faces: two on a face (one in the plane), one
    on an edge, none at a corner.
    """
    dim, angle = len(size), 0.4
    shape = Box(size, 0.1).rotated(angle)
    uniform = tuple(float(s) for s in stress)
    simulation = simulation_of(shape, device, precision, stress=lambda *x: uniform)
    reference = Box(size, 0.1).mesh().nodes
    turn = np.eye(3)
    turn[:2, :2] = rotation(angle)
    on_face = [np.isclose(reference[:, k], 0.0) | np.isclose(reference[:, k], size[k]) for k in range(dim)]
    on_face = np.stack(on_face, axis=1)
    pairs = simulation.mesh.continuum.pairs
    before = tensors(np.array([uniform]), pairs)[0]
    after = tensors(simulation.field("stress").astype(float), pairs)
    for node, on in enumerate(on_face):
        normals = turn[:dim, :dim].T[on]
        kept = np.eye(3)
        kept[:dim, :dim] -= normals.T @ normals
        expected = kept @ before @ kept
        assert np.abs(after[node] - expected).max() <= 10 * ROUND_OFF[precision]
        assert np.abs(normals @ after[node][:dim]).max(initial=0.0) <= 10 * ROUND_OFF[precision]


@pytest.mark.parametrize("dim", [2, 3])
def test_equals_free_edges_where_nothing_moves(device, precision, dim):
    """At small displacements it must do what `Free` does on the same edges, wall ends included."""
    walls = [Roller(edge("left")), Fixed(edge("bottom"))]
    free = [Free(edge(name)) for name in (("right", "top") if dim == 2 else ("right", "top", "front", "back"))]
    common = {
        "shape": Box((1.0, 0.6) if dim == 2 else (0.5, 0.4, 0.6), 0.1),
        "material": ELASTIC,
        "body_force": BodyForce((1.0, -2.0, -9.81)[-dim:]),
        "velocity": lambda *x: [0.1 * np.sin(3.0 * x[k] + k) for k in range(dim)],
        "duration": 1.0,
        "large_displacements": False,
        "numerics": Numerics(velocity_scheme="taylor"),
    }
    ours = Scene(conditions=walls, free_surface=FreeSurface(), **common)
    theirs = Scene(conditions=[*walls, *free], **common)
    results = []
    for scene in (ours, theirs):
        simulation = Simulation(scene, device=device, precision=precision)
        for _ in range(20):
            simulation.step()
        results.append((simulation.field("velocity"), simulation.field("stress")))
    for found, expected in zip(*results, strict=True):
        assert np.abs(found - expected).max() <= 10 * ROUND_OFF[precision] * np.abs(expected).max()


@pytest.mark.parametrize(("end", "tilt", "freed"), [(1.0, 15.0, False), (1.0, -15.0, False), (2.0, 0.0, True)])
def test_end_of_a_footing(device, precision, end, tilt, freed):
    """The last node of a smooth footing, which nobody moves along x, beside a top that rises or falls, or a cut.

    Where the free surface goes on smoothly from the footing the node keeps σ11; over a cut it is a corner and
    loses it. That leaves σ22, as the footing moves the node along y.
    """
    slope = np.tan(np.deg2rad(tilt))
    footing = edge("top") & where(lambda x, y: x <= end)
    simulation = simulation_of(
        Box((2.0, 1.0), 0.1).mapped(lambda x, y: (x, y * (1.0 + slope * np.maximum(x - end, 0.0)))),
        device,
        precision,
        conditions=[PrescribedVelocity(footing, (None, -0.1), normal=(0.0, 1.0)), Fixed(edge("bottom"))],
        stress=lambda x, y: (1.0, 2.0, 3.0, 4.0),
    )
    stress = simulation.field("stress")[simulation.nearest_node((end, 1.0))]
    expected = np.array([0.0 if freed else 1.0, 2.0, 0.0, 4.0])
    assert np.abs(stress - expected).max() <= 10 * ROUND_OFF[precision]


# ---------------------------------------------------------------------------------------------------------
# As the body moves
# ---------------------------------------------------------------------------------------------------------


def test_normals_follow_a_rotation(device, precision):
    """A small box that spins: normals lag by less than a degree, and the surface is not sought at every step.

    Without following it, only new pair lists would find it again, every 2.5° (half a skin, 0.125 Δx, at a corner,
    2.8 Δx off the centre). ∫|L| dt reaches 1° after 0.71° of rotation, so 20° take 28 searches, and some more
    since |L| is a little above that of the rotation (the body swells and shrinks).
    """
    simulation = simulation_of(
        Box((0.4, 0.4), 0.1, (-0.2, -0.2)),
        device,
        precision,
        material=Elastic(young_modulus=8e5, poisson_ratio=0.3, density=2000.0),
        velocity=lambda x, y: (-y, x),
        numerics=Numerics(velocity_scheme="taylor"),
    )
    x0 = simulation.mesh.nodes
    right = np.flatnonzero(np.isclose(x0[:, 0], 0.2) & (np.abs(x0[:, 1]) < 0.15))
    rim = np.flatnonzero(simulation.field("free_surface"))
    fresh = scan_of(simulation, rim)
    searches = counted_searches(simulation)
    turned, steps = 0.0, 0
    while turned < np.deg2rad(20.0):
        simulation.step()
        steps += 1
        x = simulation.field("position").astype(float)
        turned = np.arctan2((x0[:, 0] * x[:, 1] - x0[:, 1] * x[:, 0]).sum(), (x0 * x).sum())
        fresh.refresh()
        present = fresh.candidates.normal.numpy()[np.searchsorted(rim, right)]
        assert angles(simulation.field("surface_normal")[right], present).max() <= np.deg2rad(1.0)
    assert 20 <= len(searches) <= 36 < steps


def test_new_pair_lists_find_the_surface_anew(device):
    """Also where nothing turns, as in a translation: parts of a body may have come close to each other."""
    simulation = Simulation(plane(free_surface=FreeSurface(), velocity=lambda x, y: (20.0, 0.0)), device=device)
    searches = counted_searches(simulation)
    before = simulation.list_builds
    while simulation.list_builds < before + 3:
        simulation.step()
    assert len(searches) == 3


def test_slope_under_gravity(device, precision):
    """A coarse slope that collapses: who is free stays the same while the face turns and flows.

    The face's normals turn with it: it runs straight enough for the chord of its lower half to give its
    direction to a few degrees.
    """
    scene = Scene(
        shape=Box((4.0, 2.0), spacing=0.2),
        material=PerzynaVonMises(
            young_modulus=8e7,
            poisson_ratio=0.3,
            density=2000.0,
            fluidity=1.0,
            exponent=1.0,
            yield_size=2e3,
            hardening=0.0,
        ),
        conditions=[Roller(edge("left")), Roller(edge("bottom"))],
        free_surface=FreeSurface(),
        numerics=Numerics(velocity_scheme="blanc-pastor"),
        body_force=BodyForce((0.0, -9.81), Ramp(1.0)),
        damping=50.0,
        duration=2.0,
    )
    simulation = Simulation(scene, device=device, precision=precision)
    before = simulation.field("free_surface")
    simulation.run()
    assert np.array_equal(simulation.field("free_surface"), before)
    x, normals = simulation.field("position"), simulation.field("surface_normal")
    low, middle, high = (simulation.nearest_node((4.0, y)) for y in (0.2, 0.6, 1.0))
    along = x[high] - x[low]
    turned = np.arctan2(-along[0], along[1])
    assert turned > np.deg2rad(3.0), "the face must turn for this test to mean anything"
    tilt = np.arctan2(normals[middle, 1], normals[middle, 0])
    assert abs(tilt - turned) <= np.deg2rad(2.0)


# ---------------------------------------------------------------------------------------------------------
# The scene
# ---------------------------------------------------------------------------------------------------------


def test_scenes_without_one_pay_nothing(device):
    """No such fields, and no object that could find a surface."""
    scene = plane(shape=Box((0.4, 0.4), 0.1))
    simulation = Simulation(scene, device=device)
    assert "free_surface" not in simulation.fields()
    with pytest.raises(SceneError, match="surface_normal"):
        simulation.field("surface_normal")
    assert type(simulation.conditions) is Conditions


@pytest.mark.parametrize(
    ("field", "make"),
    [
        ("FreeSurface.scan_ratio", lambda: FreeSurface(scan_ratio=-1.0)),
        ("FreeSurface.scan_ratio", lambda: plane(free_surface=FreeSurface(scan_ratio=0.9))),
        ("FreeSurface.normals", lambda: FreeSurface(normals="improve")),
        ("free_surface", lambda: plane(free_surface="top")),
        ("free_surface", lambda: plane(free_surface=FreeSurface(), shape=Box((1.0,), 0.1))),
        ("free_surface", lambda: plane(free_surface=FreeSurface(), conditions=[Fixed(edge("boundary"))])),
        ("conditions[0]", lambda: plane(free_surface=FreeSurface(), conditions=[Free(edge("top"))])),
    ],
)
def test_refusals_name_the_field(field, make):
    """What is not allowed is refused when the scene is built."""
    with pytest.raises(SceneError) as caught:
        make()
    assert caught.value.field == field


def plane(**fields):
    own = {"shape": Box((1.0, 1.0), 0.1), "material": ELASTIC, "duration": 1.0}
    return Scene(**(own | {"numerics": Numerics(velocity_scheme="taylor")} | fields))
