"""Free-surface detection: the paper's figures 3 and 4, and bodies whose normals are known exactly."""

from __future__ import annotations

from ..case import Case, Picture, ReportTable, Row, Section
from ..prose import prose
from ..runs import Run

SCENE = "wavy_surface"
IMPROVED = Run(SCENE, SCENE)
MARRONE = Run(f"{SCENE}_marrone", SCENE, ("normals=marrone",))
OTHERS = ("disc", "ellipse", "staircase")


def case(quick: bool) -> Case:
    """The same in the quick form."""
    others = (Run(f"{SCENE}_{body}", SCENE, (f"body={body}",)) for body in OTHERS)
    return Case(SCENE, (IMPROVED, MARRONE, *others), section)


def section(results, picture) -> Section:
    """Classification and both normals as pictures; angles of all bodies, the staircase beside the smooth ones."""
    wave = results[IMPROVED.name]
    bodies = {body: wave.file.module.compare(body, wave.parameters) for body in wave.file.module.BODIES}
    surface = "surface.png"
    return Section(
        prose=prose(SCENE),
        rows=[
            *(Row(f"{b}, mean angle, improved normals", float(bodies[b][0]), unit="°", exact=0.0) for b in bodies),
            *(
                Row(f"{b}, mean angle, Marrone's normals", float(bodies[b][1]), unit="°", exact=0.0)
                for b in bodies
            ),
        ],
        pictures=[
            Picture(
                wave.folder / surface, "Fig. 3b and 4a: nodes on the free surface, and their improved normals."
            ),
            Picture(results[MARRONE.name].folder / surface, "Fig. 4b: the same with Marrone's normals."),
            *(Picture(results[f"{SCENE}_{b}"].folder / surface, f"{b.capitalize()}.") for b in OTHERS),
        ],
        results=[wave],
        tables=[
            ReportTable(
                "Nodes misjudged (interior nodes called free, or edge nodes missed):",
                tuple(bodies),
                [tuple(str(bodies[body][2]) for body in bodies)],
            )
        ],
    )
