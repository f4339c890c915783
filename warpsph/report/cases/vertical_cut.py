"""The vertical cut: the paper's figures 17 to 19, the band's angle, and its width at three spacings."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ...analysis import Sampler, band_profile, width_at_half
from ..case import Case, Picture, ReportTable, Row, Section
from ..drawing import BRIGHT, DARK, Curve, Panel, diagram, draw_curves, draw_fields, grid, save_picture
from ..prose import prose
from ..runs import Run, published

SCENE = "vertical_cut"
SLOW = f"{SCENE}_slow"
SOFTENING = "hardening=-1e3"
SETTLEMENTS = (0.05, 0.15, 0.30, 0.45)  # of the frames [m]
WIDTH_AT = 0.15  # settlement at which band widths are compared [m]
REACH = 2.5  # of the profiles on either side of the band [m]
PAPER_LOADS = "1171-1267"


def case(quick: bool) -> Case:
    """Both materials to 0.45 m; half the step and slower loading; two more spacings, in part to 0.15 m only."""
    fine = ("1.0", "0.25") if quick else ("0.25", "0.125")
    slow = (f"acceleration={3e-6 if quick else 3e-7:g}", f"settlement={WIDTH_AT}")
    runs = [_run("", ()), _run("soft", (SOFTENING,)), _run("step", ("courant=0.5",)), published(SLOW, SCENE, slow)]
    for spacing in fine:
        far = () if spacing == "0.25" and not quick else (f"settlement={WIDTH_AT}",)
        runs += [
            _run(spacing, (f"spacing={spacing}", *far)),
            _run(f"soft_{spacing}", (f"spacing={spacing}", SOFTENING, *far)),
        ]
    return Case(SCENE, tuple(runs), section)


def _run(name, settings) -> Run:
    end = WIDTH_AT if f"settlement={WIDTH_AT}" in settings else SETTLEMENTS[-1]
    times = tuple(round(math.sqrt(2.0 * s / 3e-5), 9) for s in SETTLEMENTS if s <= end)
    return published("_".join(filter(None, (SCENE, name))), SCENE, settings, times)


def section(results, picture) -> Section:
    """Figures 17 to 19, the fitted bands, and the band width against the spacing."""
    perfect, soft = results[SCENE], results[f"{SCENE}_soft"]
    slow = results[SLOW]
    finer = [result for result in results.values() if result.parameters.spacing != perfect.parameters.spacing]
    exact = perfect.file.module.limit_load(perfect.parameters)
    pictures = [
        Picture(_figure17(perfect, soft, exact, picture("17")), "Fig. 17: load against settlement."),
        Picture(
            _evolution(perfect, soft, picture("18")),
            "Fig. 18: viscoplastic strain as the footing settles, on the deformed mesh; perfectly viscoplastic "
            "(left) and softening (right).",
        ),
        Picture(
            _figure19(perfect, soft, picture("19")),
            "Fig. 19: displacement at the end on the deformed mesh (× 2).",
        ),
        Picture(
            _bands([perfect, soft], picture("band")),
            "The fitted bands: principal axis of the strain-weighted interior nodes, where they were initially.",
        ),
    ]
    spacings = [perfect, soft, *finer]
    width_picture, widths = _widths(spacings, picture("width"))
    pictures.append(
        Picture(
            width_picture,
            f"Strain across the band's middle half at {WIDTH_AT} m of settlement, at three spacings; perfectly "
            "viscoplastic (left) and softening (right).",
        )
    )
    formed, loads = _formed(perfect)
    softened = soft.history["load"]
    load, angle = partial(Row, unit="N/m", exact=exact), partial(Row, unit="°", paper=45.0, exact=45.0)
    rows = [
        load(
            "limit load, mean from 0.05 to 0.15 m", float(loads.mean()), paper=PAPER_LOADS, seconds=perfect.seconds
        ),
        load("load at 0.05 m", float(loads[0]), paper=PAPER_LOADS),
        load("load at 0.15 m", float(loads[-1]), paper=PAPER_LOADS),
        load("limit load over the footing's width", perfect.check("limit_load")),
        load("highest, 0.05 to 0.15 m, over its width", perfect.check("highest_load")),
        angle("band angle, perfectly viscoplastic", perfect.check("band_angle")),
        angle("band angle, softening", soft.check("band_angle"), seconds=soft.seconds),
        _largest_strain(perfect, paper=0.73),
        _largest_strain(soft, paper=0.89),
        load("peak load, softening", float(softened.max())),
        Row("load at the end, softening", float(softened[-1]), unit="N/m", paper="falls"),
    ]
    above = formed[loads > 1.1 * exact]
    beyond = (
        f"It passes + 10 % of the exact load at a settlement of {above[0]:.3g} m."
        if len(above)
        else "It stays below."
    )
    return Section(
        prose=prose(
            SCENE,
            misprint=exact / 11,
            lowest=loads.min(),
            highest=loads.max(),
            exact=exact,
            beyond=beyond,
            slow_acceleration=slow.parameters.acceleration,
            slow_load=_formed(slow)[1][-1],
            breakdown=_breakdown(finer),
        ),
        rows=rows,
        tables=[_loads(results, perfect, finer, exact), _width_table(widths)],
        pictures=pictures,
        results=list(results.values()),
    )


def _largest_strain(result, paper: float) -> Row:
    largest = float(result.at("equivalent_plastic_strain").max())
    return Row(f"largest strain, {_kind(result)}", largest, unit="-", paper=paper)


def _kind(result) -> str:
    return "softening" if result.parameters.hardening < 0.0 else "perfectly viscoplastic"


def _formed(result):
    """Settlements [m] and loads [N/m] while the mechanism stands and the shape has hardly changed."""
    low, high = result.file.module.MECHANISM
    settlement, load = result.history["settlement"], result.history["load"]
    inside = (settlement >= low) & (settlement <= high * (1.0 + 1e-9))
    return settlement[inside], load[inside]


def _loads(results, perfect, finer, exact) -> ReportTable:
    """The limit load at other spacings, a smaller step, and slower loading."""
    slow = results[SLOW]
    varied = [("as above", perfect)]
    varied += [(f"Δx = {r.parameters.spacing:g} m", r) for r in finer if r.parameters.hardening == 0.0]
    varied += [
        ("Courant 0.5", results[f"{SCENE}_step"]),
        (f"footing pressed with {slow.parameters.acceleration:g} m/s²", slow),
    ]
    return ReportTable(
        "What the limit load depends on (Δx = 0.5 m, Courant number 1 and 3e-5 m/s² unless said):",
        ("", "mean load [N/m]", "to exact", "load at 0.15 m [N/m]", "to exact", "run time [s]"),
        [_load_line(name, result, exact) for name, result in varied],
    )


def _width_table(widths) -> ReportTable:
    """Band widths against the spacing."""
    return ReportTable(
        f"Width of the band at half its height, at {WIDTH_AT} m of settlement:",
        ("Δx [m]", "H = 0 [m]", "softening [m]", "H = 0 [Δx]", "softening [Δx]"),
        [(f"{dx:g}", *both, *(width / dx for width in both)) for dx, both in widths.items()],
    )


def _load_line(name, result, exact) -> tuple[float | str, ...]:
    """A line of the second table."""
    _, loads = _formed(result)
    mean, last = float(loads.mean()), float(loads[-1])
    share = [f"{100.0 * (load / exact - 1.0):+.1f} %" for load in (mean, last)]
    return name, mean, share[0], last, share[1], round(result.seconds, 1)


def _breakdown(finer) -> str:
    """What became of the finer runs that went on to 0.45 m of settlement."""
    words = []
    for result in finer:
        if result.parameters.settlement > WIDTH_AT:
            load, settlement = result.history["load"], result.history["settlement"]
            wild = np.flatnonzero(~(np.abs(load) < 3.0 * load[settlement < WIDTH_AT].max()))
            if len(wild):
                words.append(
                    f"at Δx = {result.parameters.spacing:g} m, {_kind(result)}, the run breaks down at "
                    f"{settlement[wild[0]]:.3g} m of settlement"
                )
    if not words:
        return ""
    return (
        "Finer runs do not last: "
        + "; ".join(words)
        + ". The footing's end shears the cell beside it by its settlement over Δx, until that cell, whose middle "
        "is an auxiliary node, folds over."
    )


def _figure17(perfect, soft, exact, path):
    end = perfect.history["settlement"][-1]
    return diagram(
        path,
        [
            Curve("perfectly viscoplastic, H = 0", perfect.history["settlement"], perfect.history["load"]),
            Curve("softening, H = −1e3 Pa", soft.history["settlement"], soft.history["load"]),
            Curve(f"exact, {exact:.1f} N/m", [0.0, end], [exact, exact], exact=True),
        ],
        x_label="settlement of the footing [m]",
        y_label="load [N/m]",
        ylim=(0.0, None),
    )


def _evolution(perfect, soft, path):
    rows = [
        [
            Panel(
                f"{_kind(result)}, settlement {settlement:g} m",
                result.moved(k),
                result.at("equivalent_plastic_strain", k),
            )
            for result in (perfect, soft)
        ]
        for k, settlement in enumerate(SETTLEMENTS)
        if k > 0
    ]
    return draw_fields(path, rows, label="equivalent viscoplastic strain [-]", size=(8.5, 10.5), edges=False)


def _figure19(perfect, soft, path):
    row = [
        Panel(
            _kind(result),
            result.moved(magnified=2.0),
            np.linalg.norm(result.at("displacement"), axis=1),
        )
        for result in (perfect, soft)
    ]
    return draw_fields(path, [row], label="displacement [m]", size=(10.5, 5.0))


def _bands(pair, path):
    figure, axes = grid(1, len(pair), size=(10.5, 5.2), sharey=True)
    for at, result in zip(axes[0], pair, strict=True):
        strain, nodes = result.at("equivalent_plastic_strain"), result.mesh.nodes
        band = result.file.module.band(result.mesh, strain)
        at.scatter(*nodes.T, s=60.0 * strain, color=DARK, linewidth=0.0)
        ends = band.centre + np.array([[-0.5], [0.5]]) * band.length * band.along
        at.plot(*ends.T, color=BRIGHT, linewidth=1.6)
        at.set_title(f"{_kind(result)}: {abs(band.angle):.1f}°", fontsize=10)
        at.set(aspect="equal", xlim=(2.5, 10.3), ylim=(2.5, 10.3), xlabel="X [m]", ylabel="Y [m]")
        at.label_outer()
    return save_picture(figure, path)


def _widths(found, path):
    """The picture of the profiles across the bands, and spacing → widths [m] without and with softening."""
    figure, axes = grid(1, 2, size=(10.5, 4.0), sharey=True)
    widths, curves = {}, {"perfectly viscoplastic": [], "softening": []}
    for result in sorted(found, key=lambda result: -result.parameters.spacing):
        strain = result.at("equivalent_plastic_strain", SETTLEMENTS.index(WIDTH_AT))
        band = result.file.module.band(result.mesh, strain)
        sample = Sampler(result.mesh, strain)
        across, profile = band_profile(sample, band, reach=REACH)
        widths.setdefault(result.parameters.spacing, []).append(width_at_half(across, profile))
        curves[_kind(result)].append(Curve(f"Δx = {result.parameters.spacing:g} m", across, profile))
    for at, (kind, lines) in zip(axes[0], curves.items(), strict=True):
        draw_curves(
            at, lines, x_label="distance from the band's axis [m]", y_label="equivalent viscoplastic strain [-]"
        )
        at.set_title(kind, fontsize=10)
        at.label_outer()
    return save_picture(figure, path), widths
