"""Measures of computed fields: NumPy arrays in, numbers out.

They take a mesh, positions and values at its nodes, so that they measure any scheme's result, and synthetic fields
with a known answer (`tests/test_measures.py`). For a simulation: `checkerboard_amplitude(simulation.mesh,
simulation.field("velocity")[:, 0])`.
"""

from .bands import Band, Ridge, band_profile, fit_band, trace_ridge, width_at_half
from .checkerboard import checkerboard, checkerboard_amplitude
from .sampling import Sampler, split_cells
from .stability import growth_rate, smallest_distance
from .tensors import green_strain, mean_stress, von_mises

__all__ = [
    "Band",
    "Ridge",
    "Sampler",
    "band_profile",
    "checkerboard",
    "checkerboard_amplitude",
    "fit_band",
    "green_strain",
    "growth_rate",
    "mean_stress",
    "smallest_distance",
    "split_cells",
    "trace_ridge",
    "von_mises",
    "width_at_half",
]
