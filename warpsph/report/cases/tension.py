"""Tension: a block held with one perturbed node, a block released from twice its length, beside standard SPH."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ..case import Case, Picture, ReportTable, Row, Section
from ..drawing import BRIGHT, DARK, Curve, draw_curves, grid, save_picture
from ..prose import prose
from ..runs import published

SCHEMES = {"published step": (), "complete scheme": ("velocity_scheme=taylor",)}
STRAINS = {"tension": 0.05, "no stress": 0.0, "compression": -0.05}
# The support must reach the next column of the stretched lattice; the step's viscosity brings it to rest.
UNDAMPED = ("damping=0", "courant=0.9", "smoothing_ratio=1.1")
RELEASED = (0.0, 0.002, 0.2)  # frames of the released block [s]


def case(quick: bool) -> Case:
    """Seconds; the same in the quick form."""
    runs = [
        published(_name("tensile_block", scheme, state), "tensile_block", (*settings, f"strain={strain}"), (0.02,))
        for scheme, settings in SCHEMES.items()
        for state, strain in STRAINS.items()
    ]
    runs += [
        published(_name("stretched_block", scheme), "stretched_block", (*settings, *UNDAMPED), RELEASED)
        for scheme, settings in SCHEMES.items()
    ]
    return Case("tension", tuple(runs), section)


def section(results, picture) -> Section:
    """Clumping and hourglassing, each by its own measure."""
    held = {scheme: [results[_name("tensile_block", scheme, state)] for state in STRAINS] for scheme in SCHEMES}
    free = {scheme: results[_name("stretched_block", scheme)] for scheme in SCHEMES}
    first = held["published step"][0]
    module, p = first.file.module, first.parameters
    standard = [module.standard_sph(result.scene, result.parameters) for result in held["published step"]]
    named = {"standard SPH": [history for _, history in standard]}
    named |= {f"two node sets, {scheme}": [r.history for r in runs] for scheme, runs in held.items()}
    rate = module.alternating_growth_rate(
        p.spacing, module.STANDARD_RATIO * p.spacing, module.tension(p), p.density
    )
    published = free["published step"]
    return Section(
        prose=prose("tension", rate=rate),
        rows=[
            Row(
                "held: growth rate, standard SPH",
                module.growth(standard[0][1], p),
                unit="1/s",
                paper="clumps",
                exact=rate,
            ),
            Row(
                "held: growth rate, two node sets",
                module.growth(first.history, p),
                unit="1/s",
                paper="stable",
                exact=0.0,
                seconds=first.seconds,
            ),
            Row(
                "released: length at rest, two node sets",
                float(published.history["length"][-1]),
                unit="m",
                exact=1.0,
                seconds=published.seconds,
            ),
        ],
        tables=[*_held_tables(named, module, p), _released_table(free)],
        pictures=[
            Picture(
                _held(named, standard[0][0], first, p, picture("held")),
                "The held block. Top left, in tension: departure from the lattice, which grows when nodes clump. "
                "Top right, without stress: checkerboard of the velocity, the hourglass mode. Bottom: the nodes "
                "in tension after 20 ms.",
            ),
            Picture(
                _released(published, picture("released")),
                "The block released from twice its length: standard SPH clumps, the two node sets contract.",
            ),
        ],
        results=list(results.values()),
    )


def _name(scene, scheme, state="") -> str:
    return "_".join(filter(None, (scene, scheme, state))).replace(" ", "_")


def _held_tables(named, module, p) -> list[ReportTable]:
    """Clumping and hourglassing of the held block: schemes down, states across."""

    def lines(measure):
        return [(scheme, *(measure(history) for history in histories)) for scheme, histories in named.items()]

    return [
        ReportTable(
            "Clumping: growth rate of the displacements [1/s]:",
            ("held block", *STRAINS),
            lines(lambda history: module.growth(history, p)),
        ),
        ReportTable(
            "Clumping: smallest distance of two nodes on the way [Δx]:",
            ("held block", *STRAINS),
            lines(lambda history: float(history["smallest_distance"].min() / p.spacing)),
        ),
        ReportTable(
            "Hourglass: checkerboard of the velocity after 20 ms over the start's (under stress, clumping "
            "alternates too):",
            ("held block", *STRAINS),
            lines(lambda history: float(history["checkerboard"][-1] / history["checkerboard"][0])),
        ),
    ]


def _released_table(free) -> ReportTable:
    """Clumping and hourglassing of the released block."""
    first = free["published step"]
    _, standard = first.file.module.standard_sph(first.scene, first.parameters)
    histories = {"standard SPH": standard} | {f"two node sets, {scheme}": r.history for scheme, r in free.items()}
    start = standard["smallest_distance"][0]
    return ReportTable(
        "The released block; standard SPH is stopped when a node has left the body:",
        ("", "smallest distance [start's]", "checkerboard of v_x at 5 ms [m/s]", "length at the end [m]"),
        [
            (
                scheme,
                float(history["smallest_distance"].min() / start),
                float(np.interp(0.005, history["time"], history["checkerboard"])),
                float(history["length"][-1])
                if np.abs(history["length"]).max() < 3.0 and scheme != "standard SPH"
                else "breaks down",
            )
            for scheme, history in histories.items()
        ],
    )


def _held(named, standard, result, p, path):
    figure, axes = grid(2, 2, size=(10.5, 9.0))
    tension, calm = (list(STRAINS).index(state) for state in ("tension", "no stress"))
    departures = [
        Curve(name, 1e3 * h[tension]["time"], h[tension]["departure"] / p.spacing) for name, h in named.items()
    ]
    draw_curves(axes[0, 0], departures, x_label="time [ms]", y_label="RMS departure [Δx]")
    checkerboards = [
        Curve(name, 1e3 * h[calm]["time"], 1e3 * h[calm]["checkerboard"]) for name, h in named.items()
    ]
    draw_curves(axes[0, 1], checkerboards, x_label="time [ms]", y_label="checkerboard of v_x [mm/s]")
    axes[0, 0].set(yscale="log", title="tension")
    axes[0, 1].set(ylim=(0.0, None), title="no stress")
    _nodes(axes[1, 0], standard.x, "standard SPH", BRIGHT)
    _nodes(axes[1, 1], result.at("position"), "two node sets, published step", DARK)
    return save_picture(figure, path)


def _released(result, path):
    p = SimpleNamespace(**(vars(result.parameters) | {"duration": RELEASED[1]}))
    standard, _ = result.file.module.standard_sph(result.scene, p)
    figure, axes = grid(2, 2, size=(11.0, 4.8), sharex=True, sharey=True)
    moments = [f"{1e3 * time:.3g} ms" for time in result.times]
    _nodes(axes[0, 0], result.at("position", 0), "start", DARK)
    _nodes(axes[0, 1], standard.x, f"standard SPH, {1e3 * standard.time:.3g} ms", BRIGHT)
    _nodes(axes[1, 0], result.at("position", 1), f"two node sets, {moments[1]}", DARK)
    _nodes(axes[1, 1], result.at("position", 2), f"two node sets, {moments[2]}", DARK)
    return save_picture(figure, path)


def _nodes(at, points, title, colour) -> None:
    at.plot(*points.T, "o", color=colour, markersize=3)
    at.set_title(title, fontsize=10)
    at.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    at.label_outer()
