"""The hanging bar: the paper's figure 6, complete and published velocity step side by side."""

from __future__ import annotations

import numpy as np

from ..case import Case, Picture, Row, Section
from ..drawing import Curve, Panel, diagram, draw_fields
from ..prose import prose
from ..runs import published

COMPLETE = published("hanging_bar_complete", "hanging_bar", ("velocity_scheme=taylor",), (0.2,))
PUBLISHED = published("hanging_bar_published", "hanging_bar", (), (0.2,))
MAGNIFIED = 200.0  # displacements in the figure, as in the paper


def case(quick: bool) -> Case:
    """Both schemes; the same in the quick form."""
    return Case("hanging_bar", (COMPLETE, PUBLISHED), section)


def section(results, picture) -> Section:
    """Figure 6, the checkerboard in time, and the amplitude left."""
    both = [(label, results[run.name]) for label, run in (("complete", COMPLETE), ("published", PUBLISHED))]
    figure6 = draw_fields(
        picture("6"),
        [[_panel(f"{label} scheme", result) for label, result in both]],
        label="vertical velocity [m/s]",
        size=(5.2, 7.0),
    )
    time = [
        Curve(f"{label} scheme", 1e3 * result.history["time"][1:], result.history["checkerboard"][1:])
        for label, result in both
    ]
    decay = diagram(
        picture("checkerboard"),
        time,
        x_label="time [ms]",
        y_label="checkerboard of v_y [m/s]",
        yscale="log",
        ylim=(1e-8, 0.1),
    )
    complete, published = (result for _, result in both)
    left = [float(result.history["checkerboard"][-1]) for _, result in both]
    rest = complete.file.module.static_tip(published.parameters)
    return Section(
        prose=prose("hanging_bar"),
        rows=[
            _checkerboard("complete scheme", left[0], paper="visible", seconds=complete.seconds),
            _checkerboard("published step", left[1], paper="none visible", seconds=published.seconds),
            Row("ratio of the two", left[0] / left[1], unit="-"),
            Row("deepest tip, complete scheme", float(complete.history["tip"].min()), unit="m", exact=2.0 * rest),
            Row("deepest tip, published step", float(published.history["tip"].min()), unit="m", exact=2.0 * rest),
        ],
        pictures=[
            Picture(figure6, "Fig. 6: vertical velocity on the deformed mesh at 0.2 s (displacements × 200)."),
            Picture(decay, "Amplitude of the checkerboard in time."),
        ],
        results=[complete, published],
    )


def _checkerboard(scheme: str, left: float, **others) -> Row:
    return Row(f"checkerboard of v_y, {scheme}", left, unit="m/s", exact=0.0, **others)


def _panel(title, result) -> Panel:
    return Panel(title, result.moved(magnified=MAGNIFIED), np.ascontiguousarray(result.at("velocity")[:, 1]))
