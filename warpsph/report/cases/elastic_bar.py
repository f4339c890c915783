"""The elastic bar: the paper's figures 8 to 11, with d'Alembert's solution."""

from __future__ import annotations

import numpy as np

from ..case import Case, Picture, Row, Section
from ..drawing import BRIGHT, DARK, GREY, Curve, diagram, grid, save_picture
from ..prose import prose
from ..runs import published

MAGNIFIED = 20.0  # displacements in figure 11, as in the paper
BAR = published("elastic_bar", "elastic_bar", (), tuple(np.round(np.arange(0.0, 0.0301, 0.0005), 6).tolist()))


def case(quick: bool) -> Case:
    """One run of a second; the same in the quick form."""
    return Case("elastic_bar", (BAR,), section)


def dalembert(x, t, length, speed, velocity, impedance):
    """Velocity [m/s], stress [Pa] and displacement [m] at x of the pulled bar at times t (k,).

    The pulse p(t) = `velocity` for 0 ≤ t ≤ L/c leaves the right end to the left, is turned round at every fixed
    end, and carries the stress ρ c |v|, tension both ways.
    """
    v, stress, u = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    transit = length / speed
    for trip in range(int(t.max() / (2.0 * transit)) + 1):
        for arrival, sign in (((length - x) / speed, 1.0), ((length + x) / speed, -1.0)):
            since = t - arrival - 2.0 * trip * transit
            inside = (since >= 0.0) & (since <= transit)
            v += np.where(inside, sign * velocity, 0.0)
            stress += np.where(inside, impedance * velocity, 0.0)
            u += sign * velocity * np.clip(since, 0.0, transit)
    return v, stress, u


def section(results, picture) -> Section:
    """Figures 8 to 11 and the plateaus."""
    bar = results[BAR.name]
    p, module, history = bar.parameters, bar.file.module, bar.history
    speed = module.wave_speed(p)
    t = np.linspace(0.0, p.duration, 20001)
    exact = dalembert(module.POINT, t, module.LENGTH, speed, p.velocity, p.density * speed)
    pictures = []
    for number, name, label, values in zip(
        ("8", "9", "10"),
        ("velocity", "stress", "displacement"),
        ("velocity [m/s]", "stress [kPa]", "displacement [mm]"),
        (exact[0], 1e-3 * exact[1], 1e3 * exact[2]),
        strict=True,
    ):
        scale = {"velocity": 1.0, "stress": 1e-3, "displacement": 1e3}[name]
        curves = [
            Curve("exact", 1e3 * t, values, exact=True),
            Curve("warpsph", 1e3 * history["time"], scale * history[name]),
        ]
        path = diagram(picture(number), curves, x_label="time [ms]", y_label=label)
        pictures.append(Picture(path, f"Fig. {number}: {name} at node 11 (x = 0.1 m)."))
    pictures.append(
        Picture(
            _figure11(bar, picture("11")),
            "Fig. 11: the deformed bar in time (displacements × 20); every second node, those from the middle of "
            "the bar in orange with the space they sweep.",
        )
    )
    sigma = p.density * speed * p.velocity

    def row(check: str, unit: str, paper: float | str, **others) -> Row:
        return Row(check, bar.check(check.replace(" ", "_")), unit=unit, paper=paper, **others)

    rows = [
        row("worst velocity plateau", "m/s", 1.0, exact=p.velocity, seconds=bar.seconds),
        row("worst stress plateau", "Pa", "±4e5", exact=f"0, {sigma:.4g} or 8e5"),
        row("largest displacement", "m", 0.001, exact=2.0 * module.POINT / speed),
        row("smallest displacement", "m", 0.0, exact=0.0),
    ]
    return Section(
        prose=prose("elastic_bar"),
        rows=rows,
        pictures=pictures,
        results=[bar],
    )


def _figure11(bar, path):
    figure, axes = grid(1, 1, size=(7.5, 5.0))
    at, X = axes[0, 0], bar.mesh.nodes[:, 0]
    time, u = 1e3 * bar.times, np.array([frame.field("displacement")[:, 0] for frame in bar.frames])
    drawn = X + MAGNIFIED * u
    middle = np.abs(X - 0.5) < 0.051
    at.fill_betweenx(
        time, drawn[:, middle].min(axis=1), drawn[:, middle].max(axis=1), color=BRIGHT, alpha=0.2, linewidth=0.0
    )
    for nodes, colour in ((~middle, DARK), (middle, BRIGHT)):
        for k, moment in enumerate(time):
            x = drawn[k, nodes][::2]
            at.plot(x, np.full(len(x), moment), ".", color=colour, markersize=1.6)
    at.axvline(1.0, color=GREY, linewidth=0.8)
    at.set_xlabel("x + 20 u [m]")
    at.set_ylabel("time [ms]")
    return save_picture(figure, path)
