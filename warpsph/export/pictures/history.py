"""Curves of what a run recorded: a probe over time, or over another one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ...errors import SceneError
from ...scene.output import ENERGY_COLUMN
from ...simulation.history import History, read_history
from ...simulation.simulation import Simulation
from ..frames import Frames
from .energy import EnergyCurve
from .figures import BRIGHT, DARK, axis_label, new_figure, save_picture

CURVES = 3  # at most, on a sheet


@dataclass(frozen=True)
class HistoryCurve:
    """Two columns of a history, one over the other.

    Attributes:
        x, y: label of the axis and values, shape (rows,).
        reference: label and value of a line across it, if any.
    """

    x: tuple[str, np.ndarray]
    y: tuple[str, np.ndarray]
    reference: Sequence | None = None

    def draw(self, axes: Axes) -> None:
        """Draw it into axes."""
        axes.plot(self.x[1], self.y[1], color=DARK, linewidth=1.4)
        if self.reference:
            label, value = self.reference
            axes.axhline(value, color=BRIGHT, linestyle="--", linewidth=1.2, label=f"{label}: {value:.5g}")
            axes.legend(frameon=False, fontsize=9)
        axes.set(xlabel=self.x[0], ylabel=self.y[0])
        axes.locator_params(axis="x", nbins=5)  # its labels are wide
        axes.grid(alpha=0.3)


def plot_history(simulation: Simulation, history: History, path: Path) -> bool:
    """Draw the scene's curve into a PNG; False when the scene records nothing to draw."""
    output = simulation.scene.output
    if not output.probes:
        return False
    names = output.curve or ("time", output.probes[0].name)
    x, y = ((axis_label(name, history.unit(name)), history[name]) for name in names)
    figure = new_figure((7.0, 4.5))
    axes = figure.add_subplot()
    HistoryCurve(x, y, output.curve_reference).draw(axes)
    axes.set_title(f"{simulation.scene.name}, t = {simulation.time:.4g} s")
    save_picture(figure, path)
    return True


def curves_of(frames: Frames) -> list[HistoryCurve | EnergyCurve]:
    """The first curves of the run that the frames are of: the scene's own, its probes over time, its energy."""
    path = frames.run / "history.csv"
    if not path.exists():
        return []
    columns, units = read_history(path)
    probes = [name for name in columns if name not in ("step", "time") and not name.startswith(ENERGY_COLUMN)]

    def column(name: str) -> tuple[str, np.ndarray]:
        return axis_label(name, units[name]), columns[name]

    for name in frames.about["curve"] or ():
        if name not in columns:
            raise SceneError("history", str(path), f"it has no column {name!r}, which about.json says to draw")
    first = frames.about["curve"] or (("time", probes[0]) if probes else None)
    pairs = [tuple(first)] if first else []
    pairs += [("time", name) for name in probes if not first or name not in first]
    references = [frames.about["curve_reference"], *[None] * len(pairs)]
    curves = [HistoryCurve(column(x), column(y), r) for (x, y), r in zip(pairs, references, strict=False)]
    energy = EnergyCurve.of(columns, units)
    return [*curves, *([energy] if energy else [])][:CURVES]
