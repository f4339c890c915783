"""The report from end to end: what is missing is run, then all is laid out."""

from __future__ import annotations

import time as clock
from pathlib import Path

from .. import __version__
from ..cli.queue import make_missing, processes
from ..simulation.device import choose_device
from .cases import cases
from .page import write_html, write_markdown

TITLE = "Blanc and Pastor (2012), reproduced by warpsph"


def make_report(folder: Path, *, quick: bool, device: str | None, jobs: int, quiet: bool = False) -> Path:
    """Make the report; returns the path of the HTML page.

    Args:
        folder: gets `runs/` (a folder a run), `figures/`, `report.html` and `report.md`.
        quick: coarser and shorter where a case takes minutes.
        device: Warp device.
        jobs: how many runs to make at a time.
        quiet: whether to say nothing.
    """
    begin = clock.perf_counter()
    chosen, figures = cases(quick), folder / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    device = choose_device(device).alias
    runs = [run for case in chosen for run in case.runs]
    for error in make_missing(runs, folder / "runs", device, processes(jobs), quiet).values():
        raise error
    sections, results = [], []
    for case in chosen:
        found = {run.name: run.read(folder / "runs" / run.name) for run in case.runs}
        results += found.values()
        sections.append(case.section(found, lambda name, case=case: figures / f"{case.name}_{name}.png"))
    seconds = sum(result.seconds for result in results)
    lead = [
        "T. Blanc, M. Pastor, A stabilized Runge-Kutta, Taylor smoothed particle hydrodynamics algorithm for "
        "large deformation problems in dynamics, Int. J. Numer. Meth. Engng (2012), doi:10.1002/nme.4324.",
        f"Every case by warpsph {__version__}, float64 on {results[0].summary['device_name']}, by the published "
        f"velocity step unless said; {len(results)} runs, {seconds:.0f} s of run time. "
        + ("**Quick form:** the slope is coarser and shorter, the finest spacings are left out. " if quick else "")
        + "Differences are (ours − exact)/exact where there is an exact value, else to the paper's.",
    ]
    write_markdown(folder / "report.md", sections, title=TITLE, lead=lead)
    page = folder / "report.html"
    write_html(page, sections, title=TITLE, lead=lead)
    if not quiet:
        print(f"{page} and {folder / 'report.md'} written after {clock.perf_counter() - begin:.0f} s")
    return page
