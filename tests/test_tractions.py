"""Tractions put in place in the stresses of edge nodes, as published schemes have loads: exact states, waves."""

import math

import numpy as np
import pytest

from warpsph import (
    Box,
    Elastic,
    Fixed,
    Free,
    GivenMesh,
    Numerics,
    Polygon,
    PrescribedVelocity,
    Roller,
    Scene,
    SceneError,
    Simulation,
    Traction,
    edge,
    tag,
    where,
)
from warpsph.scene.fingerprint import fingerprint
from warpsph.scene.resolve import resolve

SOIL = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=2000.0)
SCHEMES = ("taylor", "blanc-pastor")  # `cells` takes no tractions
STRESS = {1: (3e3,), 2: (3e3, -1e3, 2e3, 500.0), 3: (3e3, -1e3, 2e3, 500.0, 700.0, -300.0)}  # [Pa]
PLATE = Box((1.0, 0.5), 0.25)


def tensor(stored, continuum):
    """Stored stress components as a symmetric d × d matrix, without σ33 of plane strain."""
    full = np.zeros((3, 3))
    for k, (i, j) in enumerate(continuum.pairs):
        full[i, j] = full[j, i] = stored[k]
    return full[: continuum.dim, : continuum.dim]


def loads_of(mesh, stress):
    """A load on every side, the one that a uniform stress has there."""
    normals = mesh.face_normals()
    return [
        Traction(edge(name), traction=tuple(stress @ normals[mesh.face_side == side][0]))
        for side, name in enumerate(mesh.continuum.edges)
    ]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_a_uniform_stress_is_in_equilibrium_with_its_tractions(dim, angle, scheme, device):
    """With all its components, in a box however it stands, at faces, edges and corners: nothing moves.

    Normals are kept to 12 digits, hence stresses to 1e-12 of the largest, and more where steps add that up.
    """
    if dim == 1 and angle:
        pytest.skip("a bar has one direction")
    shape = Box((1.0,) * dim, 0.25)
    shape = shape.rotated(angle) if angle else shape
    mesh = shape.mesh()
    scene = Scene(
        shape=shape,
        material=SOIL,
        stress=lambda *x: STRESS[dim],
        conditions=loads_of(mesh, tensor(STRESS[dim], mesh.continuum)),
        duration=1.0,
        numerics=Numerics(velocity_scheme=scheme),
    )
    simulation = Simulation(scene, device=device, precision="float64")
    for _ in range(50):
        simulation.step()
    speed = 3e3 / SOIL.density / SOIL.wave_speed(dim)  # of a wave that brings such a stress
    assert np.abs(simulation.field("stress") - STRESS[dim]).max() <= 3e3 * 1e-11
    assert np.abs(simulation.field("velocity")).max() <= speed * 1e-11


def pull(t):
    """Rises smoothly from 0 to 1 in 30 ms."""
    return math.sin(0.5 * math.pi * min(max(t, 0.0) / 0.03, 1.0)) ** 4


def error_of_wave(size, cells, scheme, device):
    """Root mean square errors of σ11 and ρ c v1 over the load, when its wave has almost come to the other end."""
    dim = len(size)
    scene = Scene(
        shape=Box(size, 1.0 / cells),
        material=SOIL,
        conditions=[
            Roller(edge("left")),
            Traction(edge("right"), traction=(1.0,) + (0.0,) * (dim - 1), factor=pull),
            *(Roller(edge(name)) for name in ("bottom", "top")[: 2 * (dim - 1)]),
        ],
        duration=0.9 / SOIL.wave_speed(dim),
        large_displacements=False,
        numerics=Numerics(velocity_scheme=scheme, courant=0.5),
    )
    simulation = Simulation(scene, device=device, precision="float64")
    simulation.run()
    speed = SOIL.wave_speed(dim)
    wave = [pull(simulation.time - (1.0 - x) / speed) for x in scene.mesh.nodes[:, 0]]
    velocity = SOIL.density * speed * simulation.field("velocity")[:, 0]
    return np.sqrt(np.mean(np.square([simulation.field("stress")[:, 0] - wave, velocity - wave]), axis=1))


@pytest.mark.parametrize(
    ("size", "scheme", "low", "high"),
    [
        ((1.0,), "taylor", 1.8, 2.3),
        ((1.0,), "blanc-pastor", 0.7, 1.1),  # its viscosity ∝ Δx²/Δt is of first order
    ],
)
def test_wave_of_an_end_that_is_pulled(size, scheme, low, high, device):
    """d'Alembert: σ11 = t and v1 = t/(ρ c), (L − x)/c later; of second order, from both sides.

    In the plane between rollers, at whose ends the load is.
    """
    coarse, fine = (error_of_wave(size, cells, scheme, device) for cells in (20, 40))
    order = np.log2(coarse / fine)
    assert (low <= order).all() and (order <= high).all()
    assert (fine <= (0.004 if low > 1.0 else 0.045)).all()


def test_a_load_between_a_roller_and_a_free_edge_is_in_equilibrium(device, precision):
    """A block in plane strain: σ11 = t, σ33 = ν t, all else zero, with a bare edge above."""
    expected = (1e3, 0.0, 0.0, SOIL.poisson_ratio * 1e3)
    scene = Scene(
        shape=PLATE,
        material=SOIL,
        stress=lambda x, y: expected,
        conditions=[
            Roller(edge("left")),
            Roller(edge("bottom")),
            Traction(edge("right"), traction=(1e3, 0.0)),
            Free(edge("top")),
        ],
        duration=1.0,
        numerics=Numerics(velocity_scheme="taylor"),
    )
    simulation = Simulation(scene, device=device, precision=precision)
    for _ in range(50):
        simulation.step()
    assert np.abs(simulation.field("stress") - expected).max() <= 1e3 * 50 * np.finfo(precision).eps


class Resolved:
    """Conditions of the plate, or of another body, asked node by node for the stress that they leave."""

    def __init__(self, *conditions, shape=PLATE):
        self.mesh = shape.mesh()
        self.table = resolve(self.mesh, conditions)

    def stress(self, *point, given=(0.0, 0.0, 0.0, 0.0)):
        """Π σ + Σ G_k t_k f_k at t = 0, for constant factors."""
        node = np.flatnonzero(np.isclose(self.mesh.nodes, point).all(axis=1))[0]
        row = self.table.nodes.tolist().index(node)
        table, factors = self.table, np.array(self.table.functions)[self.table.traction_function[row]]
        loads = np.einsum("ksd,kd,k->s", table.traction_stress[row], table.traction[row], factors)
        return pytest.approx(table.stress_projector[row] @ given + loads, abs=1e-12)


def test_a_traction_is_put_in_place_whatever_the_stress_was():
    """All else is kept."""
    plate = Resolved(Traction(edge("top"), traction=(3.0, 5.0)))
    assert plate.stress(0.5, 0.5, given=(1.0, 2.0, 4.0, 8.0)) == [1.0, 5.0, 3.0, 8.0]


def test_velocities_beat_tractions():
    """At a roller's end only the direction along the wall is loaded, at a fixed end none is."""
    load = Traction(edge("right"), traction=(3.0, 5.0))
    plate = Resolved(load, Roller(edge("bottom")), Fixed(edge("top")))
    assert plate.stress(1.0, 0.0, given=(1.0, 2.0, 4.0, 8.0)) == [3.0, 2.0, 0.0, 8.0]
    assert plate.stress(1.0, 0.25, given=(1.0, 2.0, 4.0, 8.0)) == [3.0, 2.0, 5.0, 8.0]
    assert plate.stress(1.0, 0.5, given=(1.0, 2.0, 4.0, 8.0)) == [1.0, 2.0, 4.0, 8.0]


def test_where_a_load_ends_its_last_node_has_the_mean():
    """The trapezoidal rule then gives the force of the load, 6 Pa on half a metre. So with shears at a corner."""
    load = Traction(edge("top") & where(lambda x, y: x <= 0.5), traction=(0.0, -6.0))
    plate = Resolved(load, Free(edge("top") & where(lambda x, y: x >= 0.5)))
    for x, pressure in ((0.0, -6.0), (0.25, -6.0), (0.5, -3.0), (0.75, 0.0)):
        assert plate.stress(x, 0.5) == [0.0, pressure, 0.0, 0.0]
    sheared = Resolved(Traction(edge("right"), traction=(2.0, 4.0)), Free(edge("top")))
    assert sheared.stress(1.0, 0.5) == [2.0, 0.0, 2.0, 0.0]


def test_corners_that_look_alike_have_the_loads_of_their_own_faces():
    """A step with two corners: the upper one is loaded on both of its faces, the lower one on top only."""
    step = Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 1.0).mesh()
    number = {tuple(point): k for k, point in enumerate(step.nodes.tolist())}
    upper, lower, inner = number[1.0, 2.0], number[2.0, 1.0], number[1.0, 1.0]
    tags = {
        "loaded": [(number[0.0, 2.0], upper), (inner, upper), (inner, lower)],
        "free": [(lower, number[2.0, 0.0])],
    }
    body = GivenMesh(points=step.nodes, cells=step.cells[:, list(step.kind.drawn)], tags=tags)
    resolved = Resolved(Traction(tag("loaded"), traction=(2.0, 0.0)), Free(tag("free")), shape=body)
    assert resolved.stress(1.0, 2.0) == [2.0, 0.0, 1.0, 0.0]
    assert resolved.stress(2.0, 1.0) == [0.0, 0.0, 1.0, 0.0]


def test_a_load_of_zero_is_none():
    table = Resolved(Traction(edge("top"), traction=(1.0, 2.0), factor=0.0)).table
    assert not table.loaded and table.functions == ()


def test_loads_and_motions_share_their_functions_and_wild_ones_stay_at_their_nodes():
    wild = Traction(edge("right"), traction=(1.0, 0.0), factor=math.sin)
    table = Resolved(wild, PrescribedVelocity(edge("left"), (math.sin, 1.0))).table
    named = [getattr(function, "function", function) for function in table.functions]
    assert named == [math.sin, math.sin, 1.0, 0.0], "once of the motion, checked at every time, once of the load"
    others = ~np.isin(table.nodes, np.flatnonzero(edge("right").nodes(PLATE.mesh())))
    assert (table.traction_function[others] == 3).all() and not table.traction[others].any()


def test_a_face_is_loaded_once():
    load = Traction(edge("top"), traction=(0.0, -1.0))
    for other in (load, Free(edge("top"))):
        with pytest.raises(SceneError, match=r"^conditions.*shares 4 boundary face.*loaded has one condition$"):
            Resolved(other, load)
    with pytest.raises(SceneError, match=r"either free or moved"):
        Resolved(load, Roller(edge("top")))
    with pytest.raises(SceneError, match=r"^Traction.traction = \(1.0,\) .* 2 components$"):
        Resolved(Traction(edge("top"), traction=(1.0,)))


def test_free_conditions_that_meet_on_a_smooth_edge_have_one_normal():
    """A circle called free by halves is as one that is free as a whole: the joint keeps its hoop stress."""
    ring = Box((1.0, 1.0), 0.125).mapped(lambda x, y: ((1 + x) * np.cos(1.5 * y), (1 + x) * np.sin(1.5 * y)))
    half, rest = (edge("right") & where(side) for side in (lambda x, y: y <= x, lambda x, y: y >= x))
    whole, named = (resolve(ring.mesh(), c) for c in ([Free(edge("right"))], [Free(half), Free(rest)]))
    assert np.array_equal(whole.nodes, named.nodes)
    assert np.allclose(whole.stress_projector, named.stress_projector, atol=1e-11)


def test_scenes_with_other_loads_have_other_fingerprints():
    def scene(**load):
        load = Traction(edge("right"), **load)
        return Scene(shape=PLATE, material=SOIL, conditions=[Fixed(edge("left")), load], duration=1.0)

    loads = [{"traction": (1.0, 0.0)}, {"traction": (0.0, 1.0)}, {"traction": (1.0, 0.0), "factor": pull}]
    assert len({fingerprint(scene(**load)) for load in loads}) == 3
    assert fingerprint(scene(**loads[0])) == fingerprint(scene(**loads[0]))
