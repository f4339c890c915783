"""Elastic unloading of tractions, from strains and Dₑ on 3 × 3 tensors, without any projector."""

import numpy as np


def released(sigma, tractions, lame, shear):
    """σ − Dₑ : Σ μ_k sym(u_k n_k), the strains that work on the tractions, with the μ_k for which u_k · σ n_k = 0.

    Args:
        sigma: stress, shape (3, 3).
        tractions: pairs (u, n) of vectors, of as many components as the body has axes.
        lame, shear: λ and G.
    """
    dyads = np.zeros((len(tractions), 3, 3))
    for k, (u, n) in enumerate(tractions):
        dyads[k, : len(u), : len(n)] = np.outer(u, n)
    strains = 0.5 * (dyads + dyads.swapaxes(1, 2))
    trace = np.trace(strains, axis1=1, axis2=2)[:, None, None]
    stresses = lame / shear * trace * np.eye(3) + 2.0 * strains
    of_strains = np.tensordot(strains, stresses, axes=((1, 2), (1, 2)))
    amounts = np.linalg.lstsq(of_strains, np.tensordot(strains, sigma, axes=2), rcond=1e-9)[0]
    return sigma - np.tensordot(amounts, stresses, axes=1)


def faces(normals):
    """All tractions on faces with these normals."""
    return [(u, n) for n in normals for u in np.eye(len(n))]
