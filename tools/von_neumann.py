"""Von Neumann analysis of a step on an endless lattice: stability, dispersion, damping of the published schemes.

python tools/von_neumann.py                                     # three sheets in runs/von_neumann
python tools/von_neumann.py --kernel wendland_c2 --smoothing-ratio 1.0 --poisson-ratio 0.45
python tools/von_neumann.py --limits                            # largest stable Courant numbers instead

In units of the lattice (Δx = ρ = c_p = 1, so that Δt is the Courant number C) a step multiplies a wave exp(i k·x)
of φ = (v, σ) by a matrix. Every difference of a lattice is i times a real symbol, so with σ/i as the unknown the
matrix is real. With S the symbol of a Shepard value, g that of a corrected gradient, R(g) that of −div f,

    φ_aux = S φ + (C/2) R(g) φ;  σ ← σ + C R(g) φ_aux;  v the same (taylor), or ← 2 S v_aux − v (blanc-pastor).

Weights are the package's. Phase speeds are the numerical over the exact one, the loss is of the amplitude in a
period. tests/test_stability.py holds these matrices against the code.
"""

import argparse
import itertools
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from warpsph import Numerics
from warpsph.device.precision import PRECISIONS
from warpsph.errors import WarpSPHError
from warpsph.mesh.continuum import CONTINUA
from warpsph.operators.neighbour_sums import EDGE
from warpsph.scene.registry import KERNELS
from warpsph.scene.scheme import SCHEMES

ANALYSED = tuple(name for name, scheme in SCHEMES.items() if scheme.sums is not None)
COURANT = (0.3, 0.5, 0.8, 0.95)
STABLE = 1.0 + 1e-9
COLOURS = {"taylor": "#d62728", "blanc-pastor": "#7f7f7f"}
LINES = (":", "-.", "--", "-")


@cache
def neighbours(dim: int, kernel: str, ratio: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The lattice points around the middle of a cell inside the support (P, d) and their W and −W′/ξ (P,)."""
    precision, support = PRECISIONS["float64"], KERNELS[kernel].support
    weigh, reach = KERNELS[kernel].weights(precision), int(np.ceil(ratio * support))
    x = np.array(list(itertools.product(np.arange(-reach, reach) + 0.5, repeat=dim)))
    s = (x**2).sum(axis=1) / ratio**2
    inside = s < EDGE * support**2
    w, g = np.array([[float(part) for part in weigh(precision.real(one))] for one in s[inside]]).T
    return x[inside], w, g


@dataclass(frozen=True)
class Mesh:
    """An endless lattice of spacing 1 with both sets of nodes.

    Args:
        dim: number of dimensions.
        kernel, ratio: smoothing function and h/Δx.
        poisson_ratio: ν; without meaning in a bar.
    """

    dim: int
    kernel: str = "gaussian"
    ratio: float = KERNELS["gaussian"].smoothing_ratio
    poisson_ratio: float = 0.3

    @property
    def moduli(self) -> tuple[float, float]:
        """λ and G over λ + 2G."""
        if self.dim == 1:
            return 0.0, 0.5
        shear = (1.0 - 2.0 * self.poisson_ratio) / (2.0 * (1.0 - self.poisson_ratio))
        return 1.0 - 2.0 * shear, shear

    def sweep(self, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Symbols of the value (K,) and, over i, of the corrected gradient (K, d) at wave vectors (K, d)."""
        x, w, g = neighbours(self.dim, self.kernel, self.ratio)
        phase = k @ x.T
        return np.cos(phase) @ w / w.sum(), np.sin(phase) @ (g[:, None] * x) / (g @ x[:, 0] ** 2)

    def rate(self, g: np.ndarray) -> np.ndarray:
        """−div f for gradients i g (K, d), as real matrices (K, n, n) of (v, σ/i)."""
        (lame, shear), d = self.moduli, self.dim
        pairs = [(i, j) for i, j in CONTINUA[d].pairs if max(i, j) < d]
        matrix = np.zeros((len(g), d + len(pairs), d + len(pairs)))
        for row, (i, j) in enumerate(pairs, start=d):
            matrix[:, i, row] -= g[:, j]
            if i == j:
                matrix[:, row, :d] += lame * g
                matrix[:, row, i] += 2.0 * shear * g[:, i]
            else:
                matrix[:, j, row] -= g[:, i]
                matrix[:, row, i] += shear * g[:, j]
                matrix[:, row, j] += shear * g[:, i]
        return matrix

    def step(self, k: np.ndarray, scheme: str, courant: float) -> np.ndarray:
        """The matrices (K, n, n) of one step at wave vectors (K, d).

        Args:
            k: wave vectors [1/Δx].
            scheme: velocity scheme.
            courant: c_p Δt/Δx.
        """
        value, g = self.sweep(k)
        wave, d = self.rate(g), self.dim
        one = np.broadcast_to(np.eye(wave.shape[1]), wave.shape)
        auxiliary = value[:, None, None] * one + 0.5 * courant * wave
        full = one + courant * wave @ auxiliary
        if scheme == "blanc-pastor":
            full[:, :d] = (2.0 * value[:, None, None] * auxiliary - one)[:, :d]
        return full


def wave_vectors(dim: int, n: int) -> np.ndarray:
    """Wave vectors (K, d) with n values from 0 to π along an axis, one of each set that symmetry makes equal."""
    line = np.linspace(0.0, np.pi, n)
    return np.array(list(itertools.combinations_with_replacement(line, dim)))[1:]


def spectral_radius(mesh: Mesh, scheme: str, courant: float, n: int = 17) -> float:
    """The largest growth of any wave in one step."""
    matrices = mesh.step(wave_vectors(mesh.dim, n), scheme, courant)
    return float(np.abs(np.linalg.eigvals(matrices)).max())


def largest_courant(mesh: Mesh, scheme: str, n: int = 17) -> float:
    """The Courant number up to which no wave grows, to 10⁻³; 0 when waves grow at any."""
    low, high = 0.0, 2.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        stable = spectral_radius(mesh, scheme, middle, n) <= STABLE
        low, high = (middle, high) if stable else (low, middle)
    return low


def curves(mesh: Mesh, scheme: str, courant: float, kind: str, direction: np.ndarray, per_wave: np.ndarray):
    """Phase speed over the exact one and loss of amplitude in an exact period, of a P or S wave.

    Along an axis or a diagonal, symmetry keeps a wave's polarisation and the stress that goes with it: its step
    is a 2 × 2 matrix.

    Args:
        direction: unit vector along an axis or a diagonal.
        per_wave: cells per wavelength (K,).
    """
    number = 2.0 * np.pi / per_wave
    across = np.eye(mesh.dim)[-1] - direction[-1] * direction
    if np.linalg.norm(across) < 1e-12 and mesh.dim > 1:
        across = np.eye(mesh.dim)[0]
    polarisation = direction if kind == "P" else across / np.linalg.norm(across)
    exact = mesh.rate(direction[None])[0]
    start = np.zeros(len(exact))
    start[: mesh.dim] = polarisation
    pair = np.stack([start, exact @ start], axis=1)
    speed = float(np.sqrt(-start @ exact @ exact @ start))
    matrices = mesh.step(number[:, None] * direction, scheme, courant)
    roots = np.linalg.eigvals(np.linalg.pinv(pair) @ matrices @ pair)
    root = np.take_along_axis(roots, np.abs(roots).argmax(axis=1)[:, None], axis=1)[:, 0]
    exact_angle = speed * number * courant
    return np.abs(np.angle(root)) / exact_angle, 1.0 - np.abs(root) ** (2.0 * np.pi / exact_angle)


def sheet(mesh: Mesh, path: Path) -> Path:
    """Draw dispersion above damping, a column for each wave and direction."""
    d = mesh.dim
    axis, diagonal = np.eye(d)[0], np.ones(d) / np.sqrt(d)
    columns = [("P", "along an axis", axis)]
    if d > 1:
        columns += [("P", "diagonal", diagonal), ("S", "along an axis", axis), ("S", "diagonal", diagonal)]
    figure = Figure(figsize=(2.0 + 3.4 * len(columns), 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(2, len(columns), squeeze=False, sharex=True, sharey="row")
    per_wave = np.geomspace(3.0, 60.0, 200)
    for (kind, where, direction), (above, below) in zip(columns, grid.T, strict=True):
        for scheme, (courant, line) in itertools.product(COLOURS, zip(COURANT, LINES, strict=True)):
            speed, loss = curves(mesh, scheme, courant, kind, direction, per_wave)
            style = {"color": COLOURS[scheme], "linestyle": line, "linewidth": 1.3}
            above.plot(per_wave, speed, label=f"{scheme}, C = {courant:g}", **style)
            below.plot(per_wave, np.maximum(loss, 1e-7), **style)
        above.set(title=f"{kind} wave, {where}", xscale="log", ylim=(0.8, 1.1))
        below.set(yscale="log", ylim=(1e-6, 1.0), xlabel="cells per wavelength")
        below.set_xticks([3, 5, 10, 20, 40, 60], labels=["3", "5", "10", "20", "40", "60"])
        below.minorticks_off()
        for panel in (above, below):
            panel.grid(alpha=0.3)
    grid[0, 0].set_ylabel("phase speed over the exact one")
    grid[1, 0].set_ylabel("loss of amplitude a period")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=9 if d > 1 else 7)
    nu = f", ν = {mesh.poisson_ratio:g}" if d > 1 else ""
    figure.suptitle(f"{d}D, {mesh.kernel}, h = {mesh.ratio:g} Δx{nu}")
    figure.savefig(path, dpi=110)
    return path


def main(arguments: list[str] | None = None) -> int:
    """The command; 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kernel", default="gaussian", help=f"of {', '.join(KERNELS)}")
    parser.add_argument("--smoothing-ratio", type=float, help="h/Δx; the kernel's own unless given")
    parser.add_argument("--poisson-ratio", type=float, default=0.3, help="ν, from 0 to below 0.5")
    parser.add_argument(
        "--limits", action="store_true", help="print the largest stable Courant numbers, draw nothing"
    )
    parser.add_argument("--out", type=Path, default=Path("runs/von_neumann"), help="folder of the pictures")
    options = parser.parse_args(arguments)
    try:
        if not 0.0 <= options.poisson_ratio < 0.5:
            raise ValueError(
                f"--poisson-ratio = {options.poisson_ratio} is not allowed: it must be from 0 to below 0.5"
            )
        numerics = Numerics(
            velocity_scheme="taylor", kernel=options.kernel, smoothing_ratio=options.smoothing_ratio
        )
        meshes = [Mesh(d, numerics.kernel, numerics.smoothing_ratio, options.poisson_ratio) for d in CONTINUA]
        for mesh in meshes:
            numerics.check_support(CONTINUA[mesh.dim])
        if options.limits:
            for mesh, scheme in itertools.product(meshes, ANALYSED):
                print(f"{mesh.dim}D {scheme}: {largest_courant(mesh, scheme):.3f}")
            return 0
        options.out.mkdir(parents=True, exist_ok=True)
        for mesh in meshes:
            print(sheet(mesh, options.out / f"{mesh.dim}d.png"))
    except (WarpSPHError, ValueError, OSError) as error:
        print(f"von_neumann: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
