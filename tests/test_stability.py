"""No wave grows: on an endless lattice by von Neumann's analysis, in a small box by the matrix of the code."""

import sys
from pathlib import Path

import numpy as np
import pytest

from warpsph import Box, Elastic, Fixed, Free, Numerics, Roller, Scene, Simulation, edge
from warpsph.mesh.continuum import CONTINUA
from warpsph.scene import KERNELS
from warpsph.simulation.time_step import courant_limit

sys.path.insert(0, str(Path(__file__).parent.parent / "tools"))
from von_neumann import COURANT, Mesh, curves, spectral_radius

POISSON = (0.0, 0.3, 0.45, 0.499)
REACH = (1.7, 1.8, 2.2, 3.0)  # of the kernel [Δx]; 1.8 is the default


def resting(dim, **numerics):
    """A lattice of six cells a side."""
    return Scene(
        shape=Box((6.0,) * dim, 1.0),
        material=Elastic(young_modulus=1.0, poisson_ratio=0.3, density=1.0),
        duration=1.0,
        numerics=Numerics(**numerics),
    )


@pytest.mark.parametrize("viscosity", [0.0, 1.0])
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("dim", "waves"), [(1, 65), (2, 17), (3, 7)])
def test_no_wave_grows_with_the_compatible_scheme(dim, waves, kernel, viscosity):
    """Every Courant number up to 1, any Poisson's ratio, with the front viscosity off and full."""
    for reach in REACH:
        for nu in POISSON:
            mesh = Mesh(dim, kernel, reach / KERNELS[kernel].support, nu)
            for courant in np.linspace(0.1, 1.0, 10):
                radius = spectral_radius(mesh, "compatible", courant, viscosity, waves)
                assert radius <= 1.0 + 1e-9, (reach, nu, courant)


@pytest.mark.parametrize("scheme", ["compatible", "taylor", "blanc-pastor"])
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("dim", "waves"), [(1, 129), (2, 41), (3, 13)])
def test_courant_limit_is_where_waves_begin_to_grow(dim, waves, kernel, scheme):
    """On an endless lattice the compatible scheme's is 1; what a scene allows is less, for its edges."""
    for reach in (1.7, 1.8, 2.2):
        ratio = reach / KERNELS[kernel].support
        limit = courant_limit(resting(dim, kernel=kernel, smoothing_ratio=ratio, velocity_scheme=scheme))
        if scheme == "compatible":
            assert limit <= 1.0
            limit = 1.0
        mesh = Mesh(dim, kernel, ratio)
        assert spectral_radius(mesh, scheme, limit * (1.0 - 1e-9), n=waves) <= 1.0 + 1e-9, reach
        assert spectral_radius(mesh, scheme, limit * 1.03, n=waves) > 1.0 + 1e-6, reach


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_long_waves_are_of_second_order_in_speed_and_of_fourth_in_damping(dim):
    """Of every wave and direction; the published velocity step is what it is."""
    per_wave = np.array([40.0, 80.0])
    for kind in ("P", "S")[: 1 if dim == 1 else 2]:
        for direction in (np.eye(dim)[0], np.ones(dim) / np.sqrt(dim)):
            for courant in COURANT:
                speed, loss = curves(Mesh(dim), "compatible", courant, kind, direction, per_wave)
                assert np.log2(np.divide(*np.abs(speed - 1.0))) == pytest.approx(2.0, abs=0.1)
                assert np.log2(np.divide(*loss)) == pytest.approx(3.0, abs=0.6), (
                    "a period has as many steps as cells"
                )


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
    for scheme in ("compatible", "taylor", "blanc-pastor"):
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
        matrix = Mesh(dim).step(k[None], scheme, 0.6, viscosity=float(scheme == "compatible"))[0]
        turn = np.array([1.0] * dim + [1j] * (len(kept) - dim))  # the analysis has σ/i for σ
        expected = turn * (matrix @ (amplitude[kept] / turn))
        assert np.abs(found[kept] - expected).max() <= 1e-12, scheme


def stepped(simulation, phi, calm=True):
    """φ (n, d + s) after one step. A body that kept its volume so far has the front viscosity in full; one that
    was not `calm` was strained so much faster, by a checkerboard, that no rate now looks like a front. Both were
    sheared so fast that the stress's checkerboard is damped without bound."""
    nodes, cells = simulation.nodes, simulation.mesh.nodes
    point = nodes.point.numpy()
    point["phi"] = phi
    nodes.point.assign(point)
    rate = np.zeros((len(cells), cells.shape[1], cells.shape[1]))
    if rate.shape[1] > 1:
        rate[:, 0, 1] = 1e12
    if not calm:
        rate[:, 0, 0] = 1e12 * (-1.0) ** np.round(cells).sum(axis=1)
    nodes.velocity_gradient.assign(rate)
    simulation.step()
    return nodes.point.numpy()["phi"].copy()


EDGES = {
    "free": {},
    "cantilever": {"left": Fixed},
    "clamped all round": dict.fromkeys(("left", "right", "bottom", "top"), Fixed),
    "mixed": {"left": Roller, "bottom": Fixed, "right": Roller},
    "between rollers": {"bottom": Roller, "top": Roller},
}
WIDEST = 2.1  # [Δx]; beyond 3/√2, where a diagonal neighbour joins, edges feed waves between rollers 10⁻⁵ a step
BOXES = [
    ((5, 4), "gaussian", 1.8, 0.8, 0.3, False),
    ((3, 3), "gaussian", 1.8, None, 0.499, True),
    ((4, 3), "gaussian", WIDEST, None, 0.0, True),
    ((4, 3), "wendland_c2", 1.8, None, 0.45, True),
    ((4, 3), "cubic_spline", 1.8, 0.4, 0.0, True),
    ((2, 2, 2), "gaussian", 1.8, None, 0.3, True),
]


@pytest.mark.parametrize("edges", EDGES)
@pytest.mark.parametrize(("cells", "kernel", "reach", "courant", "poisson", "calm"), BOXES)
def test_no_state_of_a_small_box_grows(edges, cells, kernel, reach, courant, poisson, calm):
    """Free, clamped or on rollers, up to the Courant limit: a step of the code from a unit state is a column."""
    names, held = CONTINUA[len(cells)].edges, EDGES[edges]
    numerics = {"kernel": kernel, "smoothing_ratio": reach / KERNELS[kernel].support}
    limit = courant_limit(resting(len(cells), **numerics)) if courant is None else courant
    scene = Scene(
        shape=Box(tuple(float(n) for n in cells), 1.0),
        material=Elastic(young_modulus=1.0, poisson_ratio=poisson, density=1.0),
        conditions=[held.get(name, Free)(edge(name)) for name in names],
        duration=1.0,
        large_displacements=False,
        numerics=Numerics(**numerics, courant=limit),
    )
    simulation = Simulation(scene, device="cpu")
    shape = simulation.nodes.point.numpy()["phi"].shape
    unit = np.eye(shape[0] * shape[1])
    matrix = np.stack([stepped(simulation, column.reshape(shape), calm).ravel() for column in unit], axis=1)
    assert np.abs(np.linalg.eigvals(matrix)).max() <= 1.0 + 1e-7
