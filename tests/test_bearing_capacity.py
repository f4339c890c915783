"""Limit loads by what a footing takes up: of a vertical cut, and of a rough circular footing in space."""

import itertools
import math
from functools import partial

import numpy as np
import pytest

from tests.test_conjugate_cells import NUMERICS
from warpsph import (
    Box,
    EdgeForce,
    Fixed,
    GivenMesh,
    Linear,
    PerzynaVonMises,
    PrescribedVelocity,
    Reaction,
    Roller,
    Scene,
    Simulation,
    edge,
    tag,
    where,
)

STRENGTH = 10e3  # s_u [Pa]
CORE = ((0.0, 0.0), (0.55, 0.0), (0.42, 0.42), (0.0, 0.55))
RADII = (0.68, 0.79, 0.90, 1.0, 1.12, 1.27, 1.46, 1.7, 2.0, 2.37)  # the fourth is the footing's
DEPTHS = (0.0, 0.12, 0.27, 0.46, 0.69, 0.98, 1.35)


def divided(places, n):
    """The places, and n − 1 between any two of them."""
    return np.interp(np.arange(n * (len(places) - 1) + 1) / n, np.arange(len(places)), places)


def quarter(n, radii):
    """Points and quads of a quarter disc: a core of n × n cells, and rings around it in two sectors."""
    points, cells, number = [], [], {}
    corners, share = np.array(CORE), np.arange(n + 1) / n

    def node(point):
        key = tuple(np.round(point, 9) + 0.0)
        if key not in number:
            number[key] = len(points)
            points.append(point)
        return number[key]

    def core(u, v):
        return np.array([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v]) @ corners

    def rings(side, first):
        for j in range(n + 1):
            angle = first + 0.25 * math.pi * share[j]
            inner, way = side(share[j]), np.array([math.cos(angle), math.sin(angle)])
            yield [inner, *(inner + (way - inner) * (r - 0.55) / 0.45 if r < 1.0 else r * way for r in radii)]

    for block in (
        [[core(u, v) for u in share] for v in share],
        list(rings(lambda t: core(1.0, t), 0.0)),
        list(rings(lambda t: core(1.0 - t, 1.0), 0.25 * math.pi)),
    ):
        rows = [[node(point) for point in row] for row in block]
        for low, high in itertools.pairwise(rows):
            cells += zip(low, low[1:], high[1:], high, strict=False)
    return np.array(points), np.array(cells)


def quarter_cylinder(refined):
    """The body, hexahedra that get larger away from the footing's edge; its round side is `side`."""
    plan, quads = quarter(4 * refined, divided((0.55, *RADII), refined)[1:])
    depths, count = divided(DEPTHS, refined), len(plan)
    points = np.concatenate([np.column_stack([plan, np.full(count, -depth)]) for depth in depths])
    layers = range(len(depths) - 1)
    cells = np.concatenate([np.column_stack([quads + k * count, quads + (k + 1) * count]) for k in layers])
    side = np.flatnonzero(np.linalg.norm(points[:, :2], axis=1) > RADII[-1] - 1e-6)
    return GivenMesh(points=points, cells=cells, tags={"side": side.tolist()})


class Sampler:
    """Values of probes from a time on."""

    def __init__(self, probes, begin, interval):
        self.probes, self.begin, self.interval = probes, begin, interval
        self.rows, self.next_time = [], begin

    def observe(self, simulation):
        if simulation.time >= self.begin:
            self.rows.append([probe(simulation) for probe in self.probes])
            self.next_time = simulation.time + self.interval


@pytest.mark.parametrize(
    ("refined", "within"), [(1, 0.05), pytest.param(2, 0.03, marks=pytest.mark.long)], ids=["coarse", "fine"]
)
def test_bearing_capacity_of_a_rough_circular_footing(refined, within):
    """Nc = 5.50 for von Mises with the strength s_u in simple shear, and the base carries the load.

    Not 6.05, which is Tresca's (Cox, Eason and Hopkins 1961): with the same strength in simple shear von Mises has
    √3/2 of Tresca's in triaxial compression. 5.50 is by limit analysis, the least power of rigid-plastic quadratic
    elements in cylindrical coordinates: 5.655, 5.555, 5.534 with 6, 10, 14 of them under the radius, where as many
    give 5.256, 5.191, 5.177 for a rough strip's 2 + π. Theory is about the shape before settlement.
    """
    footing = edge("top") & where(lambda x, y, z: x**2 + y**2 <= 1.0 + 1e-6)
    scene = Scene(
        shape=quarter_cylinder(refined),
        material=PerzynaVonMises(
            young_modulus=2.5e7,
            poisson_ratio=0.4,
            density=20000.0,
            fluidity=20.0,
            yield_size=math.sqrt(3.0) * STRENGTH,
        ),
        conditions=[
            Fixed(edge("bottom") | tag("side")),
            Roller(edge("left")),
            Roller(edge("front")),
            PrescribedVelocity(footing, (0.0, 0.0, Linear(-0.02))),
        ],
        duration=1.2,
        large_displacements=False,
        numerics=NUMERICS,
    )
    probes = [Reaction(footing, 2), Reaction(edge("bottom") | tag("side"), 2), EdgeForce(footing, 2)]
    late = Sampler(probes, 1.0, 0.0)
    Simulation(scene, device="cpu").run(observers=[late])
    load, base, by_stress = np.mean(late.rows, axis=0)
    assert load == pytest.approx(5.50 * STRENGTH * math.pi / 4.0, rel=within)
    assert base == pytest.approx(-load, rel=0.003)
    assert by_stress == pytest.approx(load, rel=0.05)


def test_reaction_on_a_cut_is_high_by_half_a_cell():
    """2 b Y/√3 exactly, by a band at 45° (examples/vertical_cut.py). Its last node moves what is beside it too.

    The trapezium of stresses ends at that node: it has no such part, and no balance either.
    """
    footing, width = edge("top") & where(lambda x, y: x >= 5.0), 5.0
    excess = []
    for spacing in (0.5, 0.25):
        scene = Scene(
            shape=Box((10.0, 10.0), spacing),
            material=PerzynaVonMises(
                young_modulus=1e5, poisson_ratio=0.35, density=2000.0, fluidity=2.0, yield_size=200.0
            ),
            conditions=[
                Roller(edge("left")),
                Fixed(edge("bottom")),
                PrescribedVelocity(footing, (None, Linear(-3e-5))),
                Roller(edge("top") & where(lambda x, y: x < 5.0)),
            ],
            duration=math.sqrt(2.0 * 0.15 / 3e-5),
            numerics=NUMERICS,
        )
        nodes = footing.nodes(scene.mesh)
        covered = partial(lambda nodes, simulation: np.ptp(simulation.field("position")[nodes, 0]), nodes)
        formed = Sampler([Reaction(footing, 1), EdgeForce(footing, 1), covered], math.sqrt(2.0 * 0.05 / 3e-5), 0.5)
        Simulation(scene, device="cpu").run(observers=[formed])
        by_reaction, by_stress, covers = np.array(formed.rows).T
        reaction, stress = (
            np.mean(load * width / covers) / (2.0 * width * 200.0 / math.sqrt(3.0)) - 1.0
            for load in (by_reaction, by_stress)
        )
        assert abs(stress) <= 0.04 * spacing
        excess.append(reaction * width / spacing)
    assert excess == pytest.approx([0.57, 0.57], abs=0.06)
