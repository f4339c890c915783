"""How accurate a result is for what it costs, over the choices of the discretisation; see docs/accuracy.md.

python tools/work_precision.py                      # everything; about half an hour on one core
python tools/work_precision.py --quick              # coarse spacings only, under 3 minutes
python tools/work_precision.py --cases impact,p_mode --rungs 3
python tools/work_precision.py --draw               # tables and pictures of what is there, run nothing

Writes results.csv, a picture a case, overview.png and tables.md into --out. Interrupted, it goes on where it was;
remove the file to measure anew. Errors repeat on any machine, wall times only on one that does nothing else.
"""

import argparse
import sys
from pathlib import Path

from precision.campaign import members, read, run
from precision.cases import CASES
from precision.drawing import overview, sheet
from precision.tables import tables

from warpsph.errors import WarpSPHError
from warpsph.simulation.device import choose_device


def main(arguments: list[str] | None = None) -> int:
    """The command; 0, 2 for bad input, 130 when interrupted."""
    options = _parser().parse_args(arguments)
    path = options.out / "results.csv"
    try:
        cases = _cases(options.cases)
        if options.rungs is not None and options.rungs < 1:
            raise ValueError(f"--rungs = {options.rungs} is not allowed: it must be at least 1")
        device = choose_device(options.device).alias
        options.out.mkdir(parents=True, exist_ok=True)
        if options.draw:
            results = [result for result in read(path) if result.case in cases]
        else:
            plan = members(cases, options.rungs, options.quick)
            results = run(plan, path, device, lambda text: print(text, file=sys.stderr, flush=True))
    except KeyboardInterrupt:
        print(f"work_precision: interrupted; what has run is in {path}, --draw draws it", file=sys.stderr)
        return 130
    except (WarpSPHError, ValueError, OSError) as error:
        print(f"work_precision: {error}", file=sys.stderr)
        return 2
    by_case = {name: [result for result in results if result.case == name] for name in cases}
    for name, rows in by_case.items():
        sheet(CASES[name], rows, options.out / f"{name}.png")
    overview({CASES[name]: rows for name, rows in by_case.items()}, options.out / "overview.png")
    text = tables({CASES[name]: rows for name, rows in by_case.items()})
    (options.out / "tables.md").write_text(text, encoding="utf-8")
    print(text)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--quick", action="store_true", help="the coarsest spacings only")
    add("--cases", help=f"of {','.join(CASES)}")
    add("--rungs", type=int, help="how many spacings a case, from the coarsest")
    add("--device", default="cpu", help="Warp device, e.g. cpu or cuda:0")
    add("--draw", action="store_true", help="tables and pictures of the results that are there; run nothing")
    add("--out", type=Path, default=Path("runs/work_precision"), help="folder to write into and to go on from")
    return parser


def _cases(text: str | None) -> list[str]:
    names = list(CASES) if text is None else text.split(",")
    unknown = [name for name in names if name not in CASES]
    if unknown:
        raise ValueError(f"--cases = {text} is not allowed: it must be some of {', '.join(CASES)}")
    return names


if __name__ == "__main__":
    sys.exit(main())
