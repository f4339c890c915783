"""Free-surface detection, the paper's figures 3 and 4: whatever the scene `wavy_surface` checks and draws."""

from __future__ import annotations

from ...catalogue import shipped
from ..case import Case, Picture, Row, Section
from ..prose import prose
from ..runs import Run

SCENE = "wavy_surface"


def case(quick: bool) -> Case | None:
    """The case, where this version of warpsph ships the scene."""
    return Case(SCENE, (Run(SCENE, SCENE),), tell) if SCENE in shipped() else None


def tell(results, picture) -> Section:
    """Its checks as rows, its pictures as they are."""
    result = results[SCENE]
    return Section(
        prose=prose(SCENE, description=result.file.module.__doc__.strip()),
        rows=[
            Row(check["name"].replace("_", " "), check["value"], check["unit"], exact=check["reference"])
            for check in result.summary["checks"]
        ],
        pictures=[Picture(path, path.stem.replace("_", " ")) for path in sorted(result.folder.glob("*.png"))],
        results=[result],
    )
