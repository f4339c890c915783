"""Where the energy of a run is and went, over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from ...scene.output import ENERGY_COLUMN
from ...simulation.history import History
from ...simulation.simulation import Simulation
from ...state.energy import TAKEN
from ..colours import COLOUR_MAP
from .figures import BRIGHT, axis_label, new_figure, save_picture

LEAST = 1e-2  # of the largest total: what is less is not drawn


@dataclass(frozen=True)
class EnergyCurve:
    """The energies of a history, one on top of the other, and the line of what came in: a gap is unaccounted for.

    Attributes:
        time: [s], shape (rows,).
        columns: the energies by name, each of shape (rows,).
        unit: their unit.
    """

    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    unit: str

    @staticmethod
    def of(columns: Mapping[str, np.ndarray], units: Mapping[str, str]) -> EnergyCurve | None:
        """That of a history's columns; None where it has no energies."""
        energies = [name for name in columns if name.startswith(ENERGY_COLUMN)]
        found = {name.removeprefix(ENERGY_COLUMN): columns[name] for name in energies}
        return EnergyCurve(columns["time"], found, units[ENERGY_COLUMN + TAKEN[0]]) if found else None

    def draw(self, axes: Axes) -> None:
        """Draw it into axes."""
        total = sum(self.columns[name] for name in TAKEN)
        least = LEAST * np.abs(total).max(initial=0.0)
        names = [name for name in TAKEN if np.abs(self.columns[name]).max(initial=0.0) > least]
        shades = matplotlib.colormaps[COLOUR_MAP](np.linspace(0.15, 0.95, len(names)))
        parts = [self.columns[name] for name in names]
        if names:
            axes.stackplot(self.time, *parts, labels=names, colors=shades, linewidth=0.0)
        axes.plot(self.time, total - self.columns["unaccounted"], color=BRIGHT, linewidth=1.2, label="came in")
        axes.legend(frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
        axes.set(xlabel=axis_label("time", "s"), ylabel=axis_label("energy", self.unit))
        axes.locator_params(axis="x", nbins=5)
        axes.margins(x=0.0)
        axes.grid(alpha=0.3)


def plot_energy(simulation: Simulation, history: History, path: Path) -> bool:
    """Draw where the energy is into a PNG; False where the scheme keeps no books."""
    columns = {name: history[name] for name in history.names}
    curve = EnergyCurve.of(columns, dict(zip(history.names, history.units, strict=True)))
    if curve is None:
        return False
    figure = new_figure((7.0, 4.5))
    axes = figure.add_subplot()
    curve.draw(axes)
    figure.suptitle(f"{simulation.scene.name}, t = {simulation.time:.4g} s")
    save_picture(figure, path)
    return True
