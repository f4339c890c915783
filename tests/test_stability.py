"""No wave grows: of sums on an endless lattice by von Neumann's analysis, of cells in small boxes by the matrix of
the code."""

import sys
from pathlib import Path

import numpy as np
import pytest

from warpsph import Box, Elastic, Fixed, Free, Numerics, Roller, Scene, Simulation, edge
from warpsph.mesh.continuum import CONTINUA
from warpsph.scene import KERNELS
from warpsph.simulation.time_step import courant_limit
from warpsph.step.cells import CELLS

sys.path.insert(0, str(Path(__file__).parent.parent / "tools"))
from von_neumann import Mesh, spectral_radius


def resting(dim, **numerics):
    """A lattice of six cells a side."""
    return Scene(
        shape=Box((6.0,) * dim, 1.0),
        material=Elastic(young_modulus=1.0, poisson_ratio=0.3, density=1.0),
        duration=1.0,
        numerics=Numerics(**numerics),
    )


@pytest.mark.parametrize("scheme", ["taylor", "blanc-pastor"])
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("dim", "waves"), [(1, 129), (2, 41), (3, 13)])
def test_courant_limit_is_where_waves_begin_to_grow(dim, waves, kernel, scheme):
    """On an endless lattice, to 3 %."""
    for reach in (1.7, 1.8, 2.2):
        ratio = reach / KERNELS[kernel].support
        limit = courant_limit(resting(dim, kernel=kernel, smoothing_ratio=ratio, velocity_scheme=scheme))
        mesh = Mesh(dim, kernel, ratio)
        assert spectral_radius(mesh, scheme, limit * (1.0 - 1e-9), n=waves) <= 1.0 + 1e-9, reach
        assert spectral_radius(mesh, scheme, limit * 1.03, n=waves) > 1.0 + 1e-6, reach


@pytest.mark.parametrize("dim", [2, 3])
def test_analysis_is_that_of_the_code(dim):
    """One step of a wave of eight cells, far from the edges of a lattice: what the matrices say, to rounding."""
    k = 2.0 * np.pi / 8.0 * np.array([1.0, 2.0, 0.5])[:dim]
    size, cells = CONTINUA[dim].stress_size, 8
    amplitude = np.random.default_rng(1).normal(size=dim + size)
    pairs = CONTINUA[dim].pairs
    kept = [*range(dim), *(dim + row for row, (i, j) in enumerate(pairs) if max(i, j) < dim)]
    material = Elastic(young_modulus=1.0, poisson_ratio=0.3, density=1.0)
    unit = material.density * material.wave_speed(dim)
    for scheme in ("taylor", "blanc-pastor"):
        numerics = Numerics(velocity_scheme=scheme, courant=0.6)
        scene = Scene(
            shape=Box((float(cells),) * dim, 1.0),
            material=material,
            duration=1.0,
            large_displacements=False,
            numerics=numerics,
        )
        simulation = Simulation(scene, device="cpu")
        x = simulation.mesh.nodes
        middle = simulation.nearest_node((0.5 * cells,) * dim)
        phase = np.exp(1j * (x - x[middle]) @ k)
        found = np.zeros(dim + size, dtype=complex)
        scale = np.array([1.0] * dim + [unit] * size)
        for part, factor in ((phase.real, 1.0), (phase.imag, 1j)):
            found += factor * stepped(simulation, part[:, None] * amplitude * scale)[middle] / scale
        matrix = Mesh(dim).step(k[None], scheme, 0.6)[0]
        turn = np.array([1.0] * dim + [1j] * (len(kept) - dim))  # the analysis has σ/i for σ
        expected = turn * (matrix @ (amplitude[kept] / turn))
        assert np.abs(found[kept] - expected).max() <= 1e-12, scheme


def stepped(simulation, phi):
    """φ (n, d + s) after one step of the stepper: no run, and no books, know of states from elsewhere."""
    point = simulation.nodes.point.numpy()
    point["phi"] = phi
    simulation.nodes.point.assign(point)
    simulation.stepper.advance([0.0], simulation.time_step_limit)
    return simulation.nodes.point.numpy()["phi"].copy()


EDGES = {
    "free": {},
    "cantilever": {"left": Fixed},
    "clamped all round": dict.fromkeys(("left", "right", "bottom", "top"), Fixed),
    "mixed": {"left": Roller, "bottom": Fixed, "right": Roller},
    "between rollers": {"bottom": Roller, "top": Roller},
}
BOXES = [
    ((5, 4), "lattice", 0.8, 0.3),
    ((3, 3), "lattice", None, 0.499),
    ((4, 3), "lattice", None, 0.0),
    ((4, 3), "triangles", None, 0.45),
    ((4, 3), "lattice", 0.4, -0.5),
    ((2, 2, 2), "lattice", None, 0.3),
    ((2, 2, 2), "tetrahedra", None, 0.3),
]
SHAPES = {
    "square": lambda *x: x,
    "flat": lambda x, *y: (10.0 * x, *y),
    "leaning": lambda x, y, *z: (x + 2.0 * y, y, *z),
    "jittered": lambda *x: tuple(
        p + np.random.default_rng(k).uniform(-0.25, 0.25, p.shape) for k, p in enumerate(x)
    ),
    "bent": lambda x, y, *z: (x, y + 0.3 * (-1.0) ** np.round(x + y), *z),
    "disc": lambda x, y, *z: (x * np.sqrt(1.0 - y**2 / 18.0), y * np.sqrt(1.0 - x**2 / 32.0), *z),
}
KINDS = [((4, 3), "lattice"), ((4, 3), "triangles"), ((2, 2, 2), "lattice"), ((2, 2, 2), "tetrahedra")]


@pytest.mark.parametrize("edges", EDGES)
@pytest.mark.parametrize(("size", "cells", "courant", "poisson"), BOXES)
def test_no_state_of_a_small_box_of_cells_grows(edges, size, cells, courant, poisson):
    """Free, clamped or on rollers, up to the Courant limit: a step of the code from a unit state is a column."""
    assert radius(size, cells, "square", edges=edges, poisson=poisson, courant=courant) <= 1.0 + 1e-12


@pytest.mark.parametrize("edges", ["free", "mixed"])
@pytest.mark.parametrize("shape", ["flat", "leaning", "jittered", "bent", "disc"])
@pytest.mark.parametrize(("size", "cells"), KINDS)
def test_no_state_of_cells_of_any_shape_grows(size, cells, shape, edges):
    """10 : 1, leaning by 63°, nodes within a quarter of a spacing, trapezia, a quarter of an ellipse."""
    assert radius(size, cells, shape, edges=edges, poisson=0.49) <= 1.0 + 1e-12


@pytest.mark.parametrize("poisson", [0.49, 0.4999])
@pytest.mark.parametrize("size", [(3, 2, 2), (3, 3, 2)])
def test_no_state_of_a_thin_nearly_incompressible_solid_grows(size, poisson):
    """It swells along three axes at once, faster than a wave crosses a cell (`warpsph.step.cells.spacing`)."""
    assert radius(size, "lattice", "square", edges="free", poisson=poisson) <= 1.0 + 1e-12


@pytest.mark.long
@pytest.mark.parametrize("poisson", [-0.5, 0.3, 0.49])
@pytest.mark.parametrize("edges", EDGES)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("size", "cells"), KINDS)
def test_no_state_of_cells_of_any_shape_grows_on_any_edges(size, cells, shape, edges, poisson):
    assert radius(size, cells, shape, edges=edges, poisson=poisson) <= 1.0 + 1e-12


def radius(size, cells, shape, *, edges, poisson, courant=None):
    """Largest absolute eigenvalue of a step from the state v, σ and the acceleration a that it begins with."""
    names, held = CONTINUA[len(size)].edges, EDGES[edges]
    scene = Scene(
        shape=Box(tuple(float(n) for n in size), 1.0, cells=cells).mapped(SHAPES[shape]),
        material=Elastic(young_modulus=1.0, poisson_ratio=poisson, density=1.0),
        conditions=[held.get(name, Free)(edge(name)) for name in names],
        duration=1.0,
        large_displacements=False,
        numerics=Numerics(courant=CELLS.courant_limit if courant is None else courant),
    )
    simulation = Simulation(scene, device="cpu")
    nodes = simulation.nodes
    shapes = nodes.point.numpy()["phi"].shape, nodes.acceleration.numpy().shape
    split = shapes[0][0] * shapes[0][1]

    def column(state):
        nodes.acceleration.assign(state[split:].reshape(shapes[1]))
        phi = stepped(simulation, state[:split].reshape(shapes[0]))
        return np.concatenate([phi.ravel(), nodes.acceleration.numpy().ravel()])

    unit = np.eye(split + shapes[1][0] * shapes[1][1])
    matrix = np.stack([column(state) for state in unit], axis=1)
    return np.abs(np.linalg.eigvals(matrix)).max()
