"""The strip footing: the paper's figures 22 to 24, and the second band traced to the surface."""

from __future__ import annotations

import numpy as np

from ..case import Case, Picture, ReportTable, Row, Section
from ..drawing import BRIGHT, Curve, Panel, diagram, draw_cells, draw_fields, grid, save_picture
from ..prose import prose
from ..runs import published

SCENE = "strip_footing"
SLOW = ("acceleration=3e-4", "duration=10.119")  # a tenth of the acceleration, to the same settlement
STRAIN = "equivalent_plastic_strain"
TIMES = (0.4, 1.0, 1.53, 2.18, 3.2)  # of the paper's figure 23 [s]


def case(quick: bool) -> Case:
    """Both materials, and the perfectly viscoplastic one at other spacings and, in full, loaded slowly."""
    runs = [published(SCENE, SCENE, (), TIMES), published(f"{SCENE}_soft", SCENE, ("hardening=-1e6",), TIMES)]
    for spacing in ("0.2",) if quick else ("0.2", "0.05"):
        runs.append(published(f"{SCENE}_{spacing}", SCENE, (f"spacing={spacing}",)))
    if not quick:
        runs.append(published(f"{SCENE}_slow", SCENE, SLOW))
    return Case(SCENE, tuple(runs), section)


def section(results, picture) -> Section:
    """Figures 22 to 24, the traced bands, and the limit load against the spacing."""
    perfect, soft = results[SCENE], results[f"{SCENE}_soft"]
    others = [result for result in results.values() if result not in (perfect, soft)]
    module, exact = perfect.file.module, perfect.file.module.limit_load(perfect.parameters)
    ridges = [module.second_band(r.mesh, r.at(STRAIN)) for r in (perfect, soft)]
    pictures = [
        Picture(_figure22(perfect, soft, exact, picture("22")), "Fig. 22: load against settlement."),
        Picture(
            _figure23(perfect, soft, picture("23")),
            "Fig. 23: viscoplastic strain at the paper's times, each with its own scale; perfectly viscoplastic "
            "(left), softening (right). At 0.4 s the soil is still elastic.",
        ),
        Picture(
            _figure24(perfect, soft, picture("24")),
            "Fig. 24: displacement on the deformed mesh (× 2); perfectly viscoplastic (left), softening (right).",
        ),
        Picture(
            _traces((perfect, soft), ridges, picture("band")),
            "The second band: where the strain is largest on rays from the footing's edge (dots), at the end.",
        ),
    ]
    peak, end = float(soft.history["load"].max()), float(soft.history["load"][-1])
    rows = [
        Row(
            "limit load, mean from 9 mm of settlement",
            perfect.check("limit_load"),
            unit="N/m",
            paper=90650.0,
            exact=exact,
            seconds=perfect.seconds,
        ),
        Row("load at the end", float(perfect.history["load"][-1]), unit="N/m", paper=90650.0, exact=exact),
        Row("peak load, softening", peak, unit="N/m", seconds=soft.seconds),
        Row("load at the end, softening", end, unit="N/m"),
    ]
    for kind, result in (("H = 0", perfect), ("softening", soft)):
        strain = result.at(STRAIN)
        rows += [
            Row(f"largest strain, {kind}", float(strain.max()), unit="-", paper=0.06),
            Row(
                f"strain of the 99.5th percentile of the nodes, {kind}",
                float(np.percentile(strain, 99.5)),
                unit="-",
                paper=0.06,
            ),
        ]
    bands = ReportTable(
        "The second band, traced from the axis to the surface (strain averaged over 0.3 m along a ray):",
        ("", "least strain", "median strain", "deepest point [m]", "comes out at x [m]"),
        [
            (
                kind,
                float(ridge.strain.min()),
                float(np.median(ridge.strain)),
                float(module.SIZE[1] - ridge.points[:, 1].min()),
                float(ridge.points[-1, 0]),
            )
            for kind, ridge in zip(("H = 0", "softening"), ridges, strict=True)
        ],
    )
    loads = ReportTable(
        "The limit load at other spacings and rates (Δx = 0.1 m and 3e-3 m/s² unless said):",
        ("", "mean load [N/m]", "to exact", "run time [s]"),
        [
            (
                _variation(result),
                result.check("limit_load"),
                f"{100.0 * (result.check('limit_load') / exact - 1.0):+.1f} %",
                round(result.seconds, 1),
            )
            for result in (perfect, *others)
        ],
    )
    return Section(
        prose=prose(SCENE),
        rows=rows,
        tables=[loads, bands],
        pictures=pictures,
        results=list(results.values()),
    )


def _variation(result) -> str:
    p = result.parameters
    if p.acceleration != 3e-3:
        return f"footing pressed with {p.acceleration:g} m/s²"
    return "as above" if p.spacing == 0.1 else f"Δx = {p.spacing:g} m"


def _figure22(perfect, soft, exact, path):
    end = 1e3 * perfect.history["settlement"][-1]
    return diagram(
        path,
        [
            Curve(
                "perfectly viscoplastic, H = 0",
                1e3 * perfect.history["settlement"],
                1e-3 * perfect.history["load"],
            ),
            Curve("softening, H = −1e6 Pa", 1e3 * soft.history["settlement"], 1e-3 * soft.history["load"]),
            Curve(f"exact, {1e-3 * exact:.2f} kN/m", [0.0, end], [1e-3 * exact] * 2, exact=True),
        ],
        x_label="settlement of the footing [mm]",
        y_label="load of the whole footing [kN/m]",
        ylim=(0.0, None),
    )


def _figure23(perfect, soft, path):
    rows = [
        [
            Panel(f"{kind}, t = {time:g} s", result.moved(k), result.at(STRAIN, k))
            for kind, result in (("H = 0", perfect), ("softening", soft))
        ]
        for k, time in enumerate(TIMES)
    ]
    return draw_fields(path, rows, label="ε̄ [-]", size=(12.0, 11.5), edges=False, shared=False)


def _figure24(perfect, soft, path):
    rows = [
        [
            Panel(
                f"{kind}, t = {TIMES[k]:g} s",
                result.moved(k, magnified=2.0),
                1e3 * np.linalg.norm(result.at("displacement", k), axis=1),
            )
            for kind, result in (("H = 0", perfect), ("softening", soft))
        ]
        for k in (2, 3, 4)
    ]
    return draw_fields(path, rows, label="displacement [mm]", size=(11.0, 7.2), edges=False)


def _traces(pair, ridges, path):
    figure, axes = grid(2, 1, size=(9.0, 8.0))
    for at, result, ridge, kind in zip(axes[:, 0], pair, ridges, ("H = 0", "softening"), strict=True):
        span = (0.0, 3.0 * float(np.median(ridge.strain)))
        colours = draw_cells(at, result.mesh, result.at(STRAIN), span=span)
        at.plot(
            *ridge.points.T,
            "o",
            color=BRIGHT,
            markersize=3.5,
            markeredgecolor="white",
            markeredgewidth=0.4,
        )
        at.set_title(
            f"{kind}: least strain {ridge.strain.min():.2g}, median {np.median(ridge.strain):.2g}", fontsize=10
        )
        figure.colorbar(colours, ax=at, label="ε̄ [-]", extend="max", shrink=0.8)
    return save_picture(figure, path)
