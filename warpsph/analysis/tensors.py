"""Stress invariants and strains of node fields, in the stored components of the body's continuum."""

from __future__ import annotations

import numpy as np

from ..mesh.continuum import Continuum
from ..mesh.mesh import Mesh


def von_mises(stress: np.ndarray, continuum: Continuum) -> np.ndarray:
    """q = √(3 J₂) [Pa] of stored stresses (n, s); |σ| in a bar."""
    mean, squares = mean_stress(stress, continuum), 0.0
    for k, (i, j) in enumerate(continuum.pairs):
        squares = squares + ((stress[:, k] - mean) ** 2 if i == j else 2.0 * stress[:, k] ** 2)
    stressless = 3 - sum(i == j for i, j in continuum.pairs)  # directions, of a bar
    return np.sqrt(1.5 * (squares + stressless * mean**2))


def mean_stress(stress: np.ndarray, continuum: Continuum) -> np.ndarray:
    """tr σ/3 [Pa], tension positive; σ/3 in a bar."""
    return sum(stress[:, k] for k, (i, j) in enumerate(continuum.pairs) if i == j) / 3.0


def green_strain(mesh: Mesh, displacement: np.ndarray) -> np.ndarray:
    """Green-Lagrange strain E = (H + Hᵀ + HᵀH)/2, H = ∂u/∂X, shape (n, s): the mean over a node's cells.

    In the components and the order of the stored stresses; E33 of plane strain is zero.

    Args:
        mesh: the initial mesh.
        displacement: of the nodes [m], shape (n, d).
    """
    H = mesh.cell_gradients(displacement)

    def part(i: int, j: int) -> np.ndarray:
        if max(i, j) >= mesh.dim:
            return np.zeros(len(H))
        return 0.5 * (H[:, i, j] + H[:, j, i] + sum(H[:, k, i] * H[:, k, j] for k in range(mesh.dim)))

    return mesh.at_nodes(np.stack([part(i, j) for i, j in mesh.continuum.pairs], axis=1))
