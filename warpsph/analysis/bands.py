"""Shear bands in a field of plastic strain: a straight one fitted, a curved one traced, and how wide they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .sampling import Sampler


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


def fit_band(points: np.ndarray, strain: np.ndarray, *, threshold: float = 0.2) -> Band:
    """The principal axis of the strain-weighted nodes of a band (total least squares).

    Args:
        points: positions of the nodes [m], shape (n, 2).
        strain: ε̄ there, shape (n,).
        threshold: a node belongs to the band where ε̄ is at least this part of its 99th percentile; a single node
            at a footing's edge does not decide.

    >>> x, y = np.meshgrid(np.arange(21.0), np.arange(21.0))
    >>> points = np.stack([x.ravel(), y.ravel()], axis=1)
    >>> round(fit_band(points, np.where(x == y, 1.0, 0.0).ravel()).angle, 6)
    45.0
    """
    weight = np.where(strain >= threshold * np.percentile(strain, 99), strain, 0.0)
    weight = weight / weight.sum()
    centre = weight @ points
    away = points - centre
    moments, axes = np.linalg.eigh((weight[:, None] * away).T @ away)
    x, y = axes[:, 1] if axes[0, 1] > 0.0 else -axes[:, 1]
    return Band(centre, float(np.degrees(np.arctan2(y, x))), float(np.sqrt(12.0 * moments[1])))


def band_profile(
    sample: Sampler, band: Band, *, reach: float, sections: int = 41
) -> tuple[np.ndarray, np.ndarray]:
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
    return across, _strain(sample, points).mean(axis=0)


def _strain(sample: Sampler, points: np.ndarray) -> np.ndarray:
    """The strain at points; none where there is no body."""
    values = sample(points)
    return np.where(np.isnan(values), 0.0, values)


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
    *,
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
    strain = np.array([np.convolve(along, window, mode="same") / covered for along in _strain(sample, points)])
    best = strain.argmax(axis=1)
    row = np.arange(len(angles))
    return Ridge(np.asarray(angles), radii[best], strain[row, best], points[row, best])
