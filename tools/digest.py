"""Digests of what runs end in, to show that a change of structure changes no bit.

    python tools/digest.py --out before.json         # with the code as it was
    python tools/digest.py --compare before.json     # with the code as it is: exit status 1 where one differs

Every scheme, elastic and viscoplastic, in 1D, 2D and 3D, in both precisions, on one thread and on two, with moving
free surfaces, turning edges, drives, body force, damping and both source schemes among them. A digest covers every
bit of every field after so many steps, and how often the lists were built. A digest holds on one kind of machine
and with one version of Warp only: make both files in one place.

Kernels are compiled without fused multiplications and additions here. Which product of a·b + c·d is fused is the
compiler's choice, made anew for every shape of the code around it: with it, digests of equal formulas differ.
`--fused` compiles kernels as runs do.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import itertools
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from warpsph import (
    BodyForce,
    Box,
    BreakdownError,
    Elastic,
    Fixed,
    Free,
    FreeSurface,
    Numerics,
    PerzynaVonMises,
    PrescribedVelocity,
    Roller,
    Rotating,
    Scene,
    Simulation,
    edge,
)
from warpsph.device import compiling

STEPS = 200
EXACT_FLAGS = "-ffp-contract=off -mstackrealign"  # IEEE arithmetic as it is written
SCHEMES = ("cells", "blanc-pastor", "taylor")
SPACING = {1: 0.005, 2: 0.0625, 3: 0.2}
SOFT = {"young_modulus": 1e6, "poisson_ratio": 0.3, "density": 2000.0}
CLAY = {"fluidity": 2.0, "yield_size": 4e3, "hardening": -1e3}


def material(viscoplastic: bool, exponent: float = 1.0) -> Elastic:
    """Soft ground, elastic or with flow that softens."""
    return PerzynaVonMises(**SOFT, **CLAY, exponent=exponent) if viscoplastic else Elastic(**SOFT)


def press(t: float) -> float:
    """A velocity that presses and lets go."""
    return -1.0 * math.sin(12.0 * t)


def pressed(dim: int, scheme: str, viscoplastic: bool, **more: object) -> Scene:
    """A body on its foot, pressed at its head under its weight, that yields, bulges and turns."""
    low, high = {1: ("left", "right"), 2: ("bottom", "top"), 3: ("bottom", "top")}[dim]
    down = np.eye(dim)[-1]
    conditions = [Fixed(edge(low)), PrescribedVelocity(edge(high), (None,) * (dim - 1) + (press,))]
    if dim > 1:
        conditions.append(Roller(edge("left")))
    if dim > 1 and "free_surface" not in more:
        conditions.append(Free(edge("right")))
    options = {
        "conditions": conditions,
        "body_force": BodyForce(tuple(-9.81 * down), lambda t: 1.0 + t),
        "damping": 1.0,
        "duration": 10.0,
        "numerics": Numerics(velocity_scheme=scheme, courant=0.7),
    }
    return Scene(shape=Box((1.0,) * dim, SPACING[dim]), material=material(viscoplastic), **(options | more))


def scenes() -> Iterator[tuple[str, Scene]]:
    """The scenes by name."""
    for scheme, dim, viscoplastic in itertools.product(SCHEMES, (1, 2, 3), (False, True)):
        flow = "viscoplastic" if viscoplastic else "elastic"
        yield f"{scheme} {dim}D {flow}", pressed(dim, scheme, viscoplastic)
    sums = "blanc-pastor"
    for dim in (2, 3):
        yield f"{sums} {dim}D free surface", pressed(dim, sums, True, free_surface=FreeSurface())
    numerics = Numerics(velocity_scheme=sums, source_scheme="rk4", courant=0.7, kernel="wendland_c2")
    yield f"{sums} 2D rk4, wendland_c2", pressed(2, sums, True, numerics=numerics)
    spline = Numerics(velocity_scheme=sums, courant=0.7, kernel="cubic_spline")
    for small in (spline, Numerics(courant=0.7)):
        fixed = pressed(2, small.velocity_scheme, True, numerics=small, large_displacements=False)
        yield f"{small.velocity_scheme} 2D small displacements, {small.kernel}", fixed
    hinge = Scene(
        shape=Box((1.0, 0.4), 0.05).rotated(0.3).mapped(lambda x, y: (x + 0.2 * y, y)),
        material=PerzynaVonMises(**SOFT, **CLAY, exponent=2.0),
        conditions=[Rotating(edge("left"), angular_velocity=2.0)],
        velocity=lambda x, y: (-2.0 * y, 2.0 * x),
        stress=lambda x, y: (500.0, 0.0, 0.0, 100.0 * x),
        duration=10.0,
    )
    yield "default 2D mapped, rotating", hinge


def digest(scene: Scene, precision: str, threads: int, steps: int) -> str:
    """SHA-256 of every field after so many steps, of the time, and of the number of list builds.

    A scene that breaks down is told as it is when it does: the published schemes may, and must do it alike.
    """
    simulation = Simulation(scene, device="cpu", precision=precision, threads=threads)
    with contextlib.suppress(BreakdownError):
        for _ in range(steps // 2):
            simulation.step()
        simulation.run(until=simulation.time + (steps - steps // 2) * simulation.time_step_limit)
    content = hashlib.sha256(repr((simulation.time, simulation.steps, simulation.list_builds)).encode())
    for name in sorted(simulation.fields()):
        content.update(name.encode() + np.ascontiguousarray(simulation.field(name)).tobytes())
    if not np.isfinite(simulation.field("velocity")).all():
        raise SystemExit(f"digest: {scene.name} ends in values that are not finite")
    return f"{content.hexdigest()[:32]} after {simulation.steps} steps, {simulation.list_builds} lists"


def main() -> int:
    """Make the digests, and write or compare them."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, help="write the digests into this JSON file")
    parser.add_argument("--compare", type=Path, help="compare them with those in this JSON file")
    parser.add_argument("--steps", type=int, default=STEPS, help=f"steps a run (default {STEPS})")
    parser.add_argument("--only", default="", help="only scenes whose name holds this text")
    parser.add_argument("--fused", action="store_true", help="compile kernels as runs do")
    options = parser.parse_args()
    if not options.fused:
        compiling.CPU_FLAGS = EXACT_FLAGS
    before = json.loads(options.compare.read_text(encoding="utf-8")) if options.compare else {}
    found: dict[str, str] = {}
    differ = 0
    for (name, scene), precision, threads in itertools.product(scenes(), ("float64", "float32"), (1, 2)):
        if options.only not in name:
            continue
        key = f"{name}, {precision}, {threads} thread{'s' if threads > 1 else ''}"
        found[key] = digest(scene, precision, threads, options.steps)
        same = not before or before.get(key) == found[key]
        differ += not same
        print(f"{key}: {found[key]}{'' if same else f'   before: {before.get(key)}'}", flush=True)
    if options.out:
        options.out.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    if before:
        print(f"{len(found)} digests, {differ} differ")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
