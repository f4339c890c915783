"""Measures of a computed field: checkerboards, shear bands, clumping. NumPy arrays in, numbers out.

They take positions, cells and values, so that they measure any scheme's result, and synthetic fields with a known
answer (`tests/test_measures.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.kinds import KINDS
from ..mesh.mesh import Mesh


def checkerboard(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    """The checkerboard part of a scalar field at every interior node, shape (interior nodes,).

    Of f = A (−1)^{i+j} + b(x, y), b bilinear, it is A (−1)^{i+j}: at the corners of each cell f has the
    hourglass component Σ s_k f_k/2ᵈ (s_k = ±1 alternating), and the part at a node is the mean of s h over
    its 2ᵈ cells, which in the plane is the stencil [1 −2 1] ⊗ [1 −2 1]/16. A plain projection onto (−1)^{i+j}
    would see a smooth field as well, by its edges. (Bars and plane strain alike; d = 1, 2 or 3.)
    """
    corners, sign = mesh.kind.corners, mesh.kind.sides.prod(axis=1)
    hourglass = values[mesh.cells] @ sign / corners
    part, cells = np.zeros(len(values)), np.zeros(len(values), dtype=int)
    np.add.at(part, mesh.cells, sign * hourglass[:, None] / corners)
    np.add.at(cells, mesh.cells, 1)
    return part[cells == corners]


def checkerboard_amplitude(mesh: Mesh, values: np.ndarray) -> float:
    """RMS of `checkerboard` over the interior nodes: A for a checkerboard ±A, 0 for a bilinear field.

    >>> from warpsph import Box
    >>> lattice = Box((3.0, 3.0), 1.0).mesh()
    >>> x, y = lattice.nodes.T
    >>> round(checkerboard_amplitude(lattice, 0.5 * (-1.0) ** (x + y) + 7.0 * x * y), 12)
    0.5
    """
    return float(np.sqrt(np.mean(checkerboard(mesh, values) ** 2)))


def smallest_distance(points: np.ndarray) -> float:
    """Distance of the two nearest of n points [m], shape (n, d): what tensile clumping drives to zero.

    >>> smallest_distance(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 6.0]]))
    2.0
    """
    ordered = points[np.argsort(points[:, 0])]
    smallest = np.inf
    for k in range(1, len(points)):  # k-th neighbours in x: their gaps in x grow with k
        gaps = ordered[k:] - ordered[:-k]
        if gaps[:, 0].min() >= smallest:
            break
        smallest = min(smallest, np.linalg.norm(gaps, axis=1).min())
    return float(smallest)


def growth_rate(time: np.ndarray, amplitude: np.ndarray, low: float, high: float) -> float:
    """Rate s [1/s] of A ∝ exp(s t), fitted (least squares of ln A) from where A last left `low` to `high`.

    An amplitude that never reaches `high` is fitted over its second half, where the start's transient is over.

    Args:
        time: [s], shape (k,), rising.
        amplitude: A > 0, shape (k,).
        low, high: between which amplitudes.

    >>> t = np.linspace(0.0, 1.0, 11)
    >>> round(growth_rate(t, 1e-3 * np.exp(5.0 * t), low=2e-3, high=0.1), 9)
    5.0
    """
    time, amplitude = np.asarray(time), np.asarray(amplitude)
    above = np.flatnonzero(amplitude >= high)
    if len(above):
        below = np.flatnonzero(amplitude[: above[0]] <= low)
        window = slice(below[-1] if len(below) else 0, above[0] + 1)
    else:
        window = slice(len(time) // 2, None)
    return float(np.polyfit(time[window], np.log(amplitude[window]), 1)[0])


class Sampler:
    """Values of a node field anywhere in a plane body, linear on the triangles of `split_cells`.

    Args:
        points: positions of the nodes [m], shape (n, 2).
        cells: their cells, shape (m, 4).
        values: at the nodes, shape (n,).

    >>> from warpsph import Box
    >>> lattice = Box((1.0, 1.0), 0.5).mesh()
    >>> x, y = lattice.nodes.T
    >>> Sampler(lattice.nodes, lattice.cells, x + 2.0 * y)(np.array([[0.25, 0.5], [9.0, 9.0]]))
    array([1.25, 0.  ])
    """

    def __init__(self, points: np.ndarray, cells: np.ndarray, values: np.ndarray):
        from matplotlib.tri import LinearTriInterpolator, Triangulation  # slow to import, and only needed here

        corners, triangles, heights = split_cells(points, cells, values)
        self._interpolate = LinearTriInterpolator(Triangulation(*corners.T, triangles), heights)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values at points (…, 2); 0 outside the body."""
        return self._interpolate(points[..., 0], points[..., 1]).filled(0.0)


def split_cells(
    points: np.ndarray, cells: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut each cell of a plane lattice into four triangles about its middle, where the value is the mean.

    That is where the auxiliary node stands; cutting along one diagonal would draw a checkerboard as stripes.

    Returns: corners of the triangles (n + m, 2), triangles (4m, 3), values at the corners (n + m,).
    """
    middle = len(points) + np.arange(len(cells))
    ring = cells.T[list(KINDS[2, cells.shape[1]].drawn)]
    sides = zip(ring, np.roll(ring, -1, axis=0), strict=True)
    triangles = np.concatenate([np.stack([middle, first, second], axis=1) for first, second in sides])
    corners = np.concatenate([points, points[cells].mean(axis=1)])
    return corners, triangles, np.concatenate([values, values[cells].mean(axis=1)])


@dataclass(frozen=True)
class Band:
    """A straight shear band.

    Attributes:
        centre: its centre (x, y) [m].
        angle: its inclination to the x axis [°], in (−90, 90].
        length: its length [m], from the second moment along it (exact for a uniform band).
    """

    centre: np.ndarray
    angle: float
    length: float

    @property
    def along(self) -> np.ndarray:
        """Unit vector along the band."""
        return np.array([np.cos(np.radians(self.angle)), np.sin(np.radians(self.angle))])


def fit_band(points: np.ndarray, strain: np.ndarray, share: float = 0.2) -> Band:
    """The principal axis of the strain-weighted nodes of a band (total least squares).

    Args:
        points: positions of the nodes [m], shape (n, 2).
        strain: ε̄ there, shape (n,).
        share: a node belongs to the band from this share of the strain's 99th percentile on; a single node at a
            footing's edge does not decide.

    >>> x, y = np.meshgrid(np.arange(21.0), np.arange(21.0))
    >>> points = np.stack([x.ravel(), y.ravel()], axis=1)
    >>> round(fit_band(points, np.where(x == y, 1.0, 0.0).ravel()).angle, 6)
    45.0
    """
    weight = np.where(strain >= share * np.percentile(strain, 99), strain, 0.0)
    weight = weight / weight.sum()
    centre = weight @ points
    away = points - centre
    moments, axes = np.linalg.eigh((weight[:, None] * away).T @ away)
    x, y = axes[:, 1] if axes[0, 1] > 0.0 else -axes[:, 1]
    return Band(centre, float(np.degrees(np.arctan2(y, x))), float(np.sqrt(12.0 * moments[1])))


def band_profile(sample: Sampler, band: Band, reach: float, sections: int = 41) -> tuple[np.ndarray, np.ndarray]:
    """Distance from a band's axis [m] and the strain there, averaged along its middle half.

    Args:
        sample: the strain.
        band: the band.
        reach: how far to go on either side [m].
        sections: number of sections across the band.
    """
    across = np.linspace(-reach, reach, 401)
    along = np.linspace(-0.25, 0.25, sections) * band.length
    normal = np.array([-band.along[1], band.along[0]])
    points = band.centre + along[:, None, None] * band.along + across[None, :, None] * normal
    return across, sample(points).mean(axis=0)


def width_at_half(across: np.ndarray, profile: np.ndarray) -> float:
    """Full width at half maximum of a profile with one peak [m], between linearly interpolated crossings."""
    half, peak = 0.5 * profile.max(), int(profile.argmax())
    left = np.flatnonzero(profile[:peak] < half)
    right = peak + np.flatnonzero(profile[peak:] < half)
    if not len(left) or not len(right):
        return float("nan")
    i, j = left[-1], right[0]
    x0 = np.interp(half, profile[i : i + 2], across[i : i + 2])
    x1 = np.interp(-half, -profile[j - 1 : j + 1], across[j - 1 : j + 1])
    return float(x1 - x0)


@dataclass(frozen=True)
class Ridge:
    """The ridge of a strain field as seen from a point: on each ray, where the strain is largest.

    Attributes:
        angles: of the rays to the x axis [°].
        radius: distance of the ridge from the point [m].
        strain: ε̄ on the ridge.
        points: positions of the ridge [m], shape (rays, 2).
    """

    angles: np.ndarray
    radius: np.ndarray
    strain: np.ndarray
    points: np.ndarray


def trace_ridge(
    sample: Sampler,
    centre: tuple[float, float],
    angles: np.ndarray,
    nearest: float,
    farthest: float,
    smoothing: float = 0.0,
) -> Ridge:
    """Follow a band that curves around a point.

    Args:
        sample: the strain.
        centre: the point [m].
        angles: of the rays to the x axis [°], in the order in which the band is followed.
        nearest, farthest: the part of each ray that is searched [m].
        smoothing: length along a ray over which the strain is averaged first [m].
    """
    radii = np.linspace(nearest, farthest, 801)
    rays = np.stack([np.cos(np.radians(angles)), np.sin(np.radians(angles))], axis=1)
    points = np.asarray(centre) + radii[None, :, None] * rays[:, None, :]
    window = np.ones(1 + 2 * int(0.5 * smoothing / (radii[1] - radii[0])))
    covered = np.convolve(np.ones(len(radii)), window, mode="same")
    strain = np.array([np.convolve(along, window, mode="same") / covered for along in sample(points)])
    best = strain.argmax(axis=1)
    row = np.arange(len(angles))
    return Ridge(np.asarray(angles), radii[best], strain[row, best], points[row, best])
