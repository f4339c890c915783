"""Picture of a free surface: which nodes the scan has found to be on it, and their normals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...simulation.simulation import Simulation
from .figures import BRIGHT, DARK, GREY, new_figure, save_picture


def plot_surface(simulation: Simulation, path: Path) -> bool:
    """Draw the material nodes, the free ones marked, with their normals, into a PNG; False unless plane strain."""
    if simulation.mesh.dim != 2 or simulation.scene.free_surface is None:
        return False
    position, normal = simulation.field("position"), simulation.field("surface_normal")
    free = simulation.field("free_surface").astype(bool)
    extent = np.ptp(position, axis=0)
    height = float(np.clip(8.0 * extent[1] / extent[0], 3.0, 9.0)) + 0.6
    figure = new_figure((8.0, height))
    axes = figure.add_subplot()
    size = np.clip(2e3 / len(position) ** 0.5, 4.0, 40.0)
    axes.scatter(*position[~free].T, s=0.5 * size, color=GREY, linewidths=0, label="not on the free surface")
    axes.scatter(*position[free].T, s=size, color=BRIGHT, linewidths=0, label="on the free surface")
    axes.quiver(*position[free].T, *normal[free].T, color=DARK, width=0.002, scale=22.0, label="normal")
    axes.margins(0.08)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(f"{simulation.scene.name}, t = {simulation.time:.4g} s")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    save_picture(figure, path)
    return True
