"""Finding the free surface and its normals (Blanc and Pastor 2012, figures 3 and 4).

A body with a wavy top between a wall on its left and one below; a disc and an ellipse whose edge nodes follow the
curve; and a disc cut out of the lattice, whose staircase has no normal of its own. Nothing moves: the scene is
about which nodes are called free, and about the angle between their normals and the exact ones, with the improved
normals and with Marrone's. Corners, where two free edges meet, have no normal and are left out.
"""

from types import SimpleNamespace

import numpy as np

from warpsph import (
    PUBLISHED,
    Box,
    Check,
    Disc,
    Elastic,
    Fixed,
    FreeSurface,
    Numerics,
    Output,
    Parameter,
    Probe,
    Roller,
    Scene,
    Simulation,
    edge,
)

AMPLITUDE = 0.1  # of the wave [m]; its length is 1 m
ELLIPSE = (1.3, 1.0 / 1.3)  # semi-axes [m]
BODIES = ("wave", "disc", "ellipse", "staircase")

NUMERICS = PUBLISHED | {"smoothing_ratio": 1.2}  # round kernels on cells that are stretched
PARAMETERS = (
    Parameter("body", "wave", "-", f"one of {', '.join(BODIES)}", BODIES),
    Parameter("spacing", 0.05, "m", "distance between neighbouring nodes: 20 a wavelength"),
    Parameter("scan_ratio", 4.0 / 3.0, "-", "length of the scan over the spacing"),
    Parameter("normals", "improved", "-", "improved or marrone", ("improved", "marrone")),
)


def to_disc(x, y):
    """The square (−1, 1)² onto the unit disc, squares onto circles."""
    largest, radius = np.maximum(np.abs(x), np.abs(y)), np.hypot(x, y)
    factor = largest / np.where(radius > 0.0, radius, 1.0)
    return x * factor, y * factor


def to_ellipse(x, y):
    x, y = to_disc(x, y)
    return ELLIPSE[0] * x, ELLIPSE[1] * y


def to_wave(x, y):
    return x, y * (1.0 + AMPLITUDE * np.sin(2.0 * np.pi * x))


def shape(body, spacing):
    if body == "wave":
        return Box((2.0, 1.0), spacing).mapped(to_wave)
    if body == "staircase":
        return Disc(1.0, spacing)
    square = Box((2.0, 2.0), spacing, origin=(-1.0, -1.0))
    return square.mapped(to_disc if body == "disc" else to_ellipse)


def exact_normals(body, x, y):
    """Exact normals at the positions of edge nodes (n, 2), and which of them lie on the smooth free edge (n,)."""
    if body == "wave":
        k = 2.0 * np.pi
        normals = np.stack([-AMPLITUDE * k * np.cos(k * x), np.ones_like(x)], axis=1)
        smooth = np.isclose(y, 1.0 + AMPLITUDE * np.sin(k * x)) & (x > 0.0) & (x < 2.0)
        side = np.isclose(x, 2.0) & (y < 0.999)  # the straight right side, its corner with the wave left out
        normals[side], smooth = (1.0, 0.0), smooth | (side & (y > 0.0))
    else:
        a, b = ELLIPSE if body == "ellipse" else (1.0, 1.0)
        normals = np.stack([x / a**2, y / b**2], axis=1)
        smooth = np.ones(len(x), dtype=bool)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0.0, length, 1.0), smooth


def scene(p):
    walls = [Roller(edge("left"), normal=(-1.0, 0.0)), Fixed(edge("bottom"))]
    return Scene(
        shape=shape(p.body, p.spacing),
        material=Elastic(young_modulus=8e7, poisson_ratio=0.3, density=2000.0),
        conditions=walls if p.body == "wave" else [],
        free_surface=FreeSurface(scan_ratio=p.scan_ratio, normals=p.normals),
        duration=1e-4,
        large_displacements=False,
        numerics=p.numerics,
        output=Output(
            probes=(Probe("free_nodes", "-", lambda s: float(s.field("free_surface").sum())),),
            field="free_surface",
        ),
    )


def surface_errors(simulation, body):
    """Angles to the exact normals [degrees] at the smooth free edge, and the number of nodes misjudged."""
    mesh = simulation.mesh
    on_edge = np.zeros(len(mesh.nodes), dtype=bool)
    on_edge[mesh.faces] = True
    moved = np.zeros(len(on_edge), dtype=bool)
    moved[simulation.scene.boundary.nodes] = simulation.scene.boundary.moved
    found = simulation.field("free_surface").astype(bool)
    misjudged = int((found != (on_edge & ~moved)).sum())
    exact, smooth = exact_normals(body, *mesh.nodes.T)
    chosen = on_edge & smooth & found
    cosine = np.sum(simulation.field("surface_normal")[chosen] * exact[chosen], axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), misjudged


def compare(body, p, device="cpu"):
    """(mean error of the improved normals, of Marrone's [degrees], nodes misjudged) of one body."""
    errors = {}
    for normals in ("improved", "marrone"):
        choice = SimpleNamespace(
            **(vars(p) | {"body": body, "normals": normals, "numerics": Numerics(**NUMERICS)})
        )
        errors[normals], misjudged = surface_errors(Simulation(scene(choice), device=device), body)
    return errors["improved"].mean(), errors["marrone"].mean(), misjudged


def checks(run):
    """Every smooth body, whichever was drawn: mean error at most 3°, smaller than Marrone's, no node misjudged."""
    results = []
    for body in BODIES[:3]:
        improved, marrone, misjudged = compare(body, run.parameters, run.simulation.device.alias)
        results += [
            Check(f"{body}_normals", improved, 0.0, "degree", 3.0, relative=False),
            Check(f"{body}_normals_over_marrone", improved / marrone, 0.0, "-", 0.999, relative=False),
            Check(f"{body}_nodes_misjudged", misjudged, 0.0, "-", 0.0, relative=False),
        ]
    return results
