"""The slope that flows under gravity: the paper's figures 13 and 14, and the run-out against the time step."""

from __future__ import annotations

import numpy as np

from ...cli.catalogue import load
from ..case import Case, Picture, ReportTable, Row, Section
from ..drawing import Curve, Panel, diagram, draw_fields
from ..prose import prose
from ..runs import published

SCENE = "gravity_slope"
COURANTS = (1.0, 0.5, 0.25)
QUICK_FORM = "**Quick form: coarser and shorter, not to be compared with the paper's numbers.**"
TIMES = (5.0, 15.0, 25.0, 35.0)  # of the frames in full [s]


def case(quick: bool) -> Case:
    """Three Courant numbers; the scene's short form when quick."""
    settings, times = ((), TIMES) if not quick else (load(SCENE).short, (1.0, 2.0, 3.5, 5.0))
    runs = [
        published(f"{SCENE}_{courant:g}", SCENE, (*settings, f"courant={courant:g}"), times)
        for courant in COURANTS
    ]
    return Case(SCENE, tuple(runs), section)


def section(results, picture) -> Section:
    """Figures 13 and 14 at the largest Courant number, and the displacements at all three."""
    runs = list(results.values())
    first = runs[0]
    short = first.parameters.duration < TIMES[-1]
    strain = Panel(f"t = {first.times[-1]:.3g} s", first.moved(), first.at("equivalent_plastic_strain"))
    moved = [
        Panel(f"t = {time:.3g} s", first.moved(k), np.linalg.norm(first.at("displacement", k), axis=1))
        for k, time in enumerate(first.times)
    ]
    toes = [Curve(f"Courant {r.parameters.courant:g}", r.history["time"], r.history["toe"]) for r in runs]
    pictures = [
        Picture(
            draw_fields(picture("13"), [[strain]], label="equivalent viscoplastic strain [-]", size=(9.0, 3.6)),
            "Fig. 13: viscoplastic strain at the end, on the deformed mesh.",
        ),
        Picture(
            draw_fields(picture("14"), [moved[:2], moved[2:]], label="displacement [m]", size=(11.0, 4.6)),
            "Fig. 14: displacement on the deformed mesh (× 1).",
        ),
        Picture(
            diagram(picture("toe"), toes, x_label="time [s]", y_label="displacement of the toe [m]"),
            "Run-out of the toe.",
        ),
    ]
    lines = [
        (f"{label} [{unit}]", *(float(r.history[name][-1]) for r in runs))
        for label, name, unit in (
            ("toe, outward", "toe", "m"),
            ("crest, down", "crest_down", "m"),
            ("crest, outward", "crest_right", "m"),
            ("largest strain", "largest_strain", "-"),
        )
    ]
    lines.append(("run time [s]", *(round(r.seconds, 1) for r in runs)))
    (_, toe, *_), *_, (_, strained, *_), _ = lines
    paper = (1.5, "about 1.5") if not short else (None, None)
    return Section(
        prose=prose(SCENE, form=QUICK_FORM if short else ""),
        rows=[
            Row("displacement of the toe", toe, unit="m", paper=paper[0], seconds=first.seconds),
            Row("largest strain", strained, unit="-", paper=paper[1]),
        ],
        tables=[ReportTable("At three time steps:", ("", *(curve.label for curve in toes)), lines)],
        pictures=pictures,
        results=runs,
    )
