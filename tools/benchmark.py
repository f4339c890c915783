"""Measures how fast warpsph is, by itself and beside other solvers; see BENCHMARKS.md.

python tools/benchmark.py                          # everything; hours on a CPU
python tools/benchmark.py --quick                  # under 2 minutes on two cores
python tools/benchmark.py --dimensions 2 --nodes 1e5 --materials viscoplastic
python tools/benchmark.py --other pysph=/path/to/python
python tools/benchmark.py --compare old.json new.json
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

from benchmarking.campaign import HEADLINE, Plan, run
from benchmarking.others import ADAPTERS
from benchmarking.scenes import MATERIALS
from benchmarking.tables import compare, tables
from benchmarking.work import work

QUICK = Plan(nodes=(1000, 10_000, HEADLINE["nodes"]), seconds=0.2, limit=60.0, focus=True)


def main(arguments: list[str] | None = None) -> int:
    """The command; 0, 2 for bad input, 130 when interrupted."""
    options = _parser().parse_args(arguments)
    if options.work:
        work(options.work)
        return 0
    try:
        if options.compare:
            print(compare(*(_load(path) for path in options.compare)))
            return 0
        plan = _plan(options)
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.touch()
    except (ValueError, OSError) as error:
        print(f"benchmark: {error}", file=sys.stderr)
        return 2
    command = ["python", "tools/benchmark.py", *(sys.argv[1:] if arguments is None else arguments)]
    try:
        report = run(plan, command, options.out, lambda text: print(text, file=sys.stderr, flush=True))
    except KeyboardInterrupt:
        print(f"benchmark: interrupted; what was measured is in {options.out}", file=sys.stderr)
        return 130
    print(tables(report))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--quick", action="store_true", help="fewer sizes and variants, shorter timings")
    add("--dimensions", help="of 1,2,3")
    add("--materials", help=f"of {','.join(MATERIALS)}")
    add("--precisions", help="of float32,float64")
    add("--nodes", help="sizes, e.g. 1e3,1e5")
    add("--devices", help="Warp devices, e.g. cpu,cuda:0; all unless given")
    add("--threads", help="threads of CPU kernels, e.g. 1,8; one and all cores unless given")
    add("--seconds", type=float, help="time to fill with steps, a case")
    add("--limit", type=float, help="skip a case that is expected to take longer [s]")
    add("--other", action="append", default=[], metavar="NAME[=PYTHON]", help=f"of {','.join(ADAPTERS)}")
    add("--other-nodes", type=float, help="number of particles for the other solvers")
    add("--only-cases", action="store_true", help="no copies of memory, no start-up times")
    add("--out", type=Path, default=Path("runs/benchmark.json"), help="JSON file to write")
    add("--compare", nargs=2, type=Path, metavar=("OLD", "NEW"), help="compare two JSON files, measure nothing")
    add("--work", help=argparse.SUPPRESS)  # a job of a process of its own
    return parser


def _plan(options: argparse.Namespace) -> Plan:
    """The plan that the options describe."""
    chosen = {
        "dimensions": _listed("dimensions", options.dimensions, int, (1, 2, 3)),
        "materials": _listed("materials", options.materials, str, MATERIALS),
        "precisions": _listed("precisions", options.precisions, str, ("float32", "float64")),
        "nodes": _listed("nodes", options.nodes, _count),
        "devices": _listed("devices", options.devices, str),
        "threads": _listed("threads", options.threads, _count),
        "seconds": options.seconds,
        "limit": options.limit,
        "others": tuple(_other(text) for text in options.other),
        "other_nodes": None if options.other_nodes is None else _count(options.other_nodes),
    }
    if options.only_cases:
        chosen |= {"copies": False, "starts": False}
    base = QUICK if options.quick else Plan()
    return replace(base, **{name: value for name, value in chosen.items() if value is not None})


def _listed(name: str, text: str | None, kind, allowed=None) -> tuple | None:
    if text is None:
        return None
    try:
        values = tuple(kind(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"--{name} = {text} is not allowed: it must be numbers, separated by commas") from None
    if allowed is not None and not set(values) <= set(allowed):
        among = ", ".join(str(value) for value in allowed)
        raise ValueError(f"--{name} = {text} is not allowed: it must be some of {among}, separated by commas")
    return values


def _count(text: str) -> int:
    value = int(float(text))
    if value < 1:
        raise ValueError
    return value


def _other(text: str) -> tuple[str, str]:
    name, _, interpreter = text.partition("=")
    if name not in ADAPTERS:
        raise ValueError(f"--other = {name} is not allowed: it must be one of {', '.join(ADAPTERS)}")
    return name, interpreter or sys.executable


def _load(path: Path) -> dict:
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        _ = report["results"], report["machine"], report["date"]
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"--compare = {path} is not allowed: it must be a JSON file of this tool") from None
    return report


if __name__ == "__main__":
    sys.exit(main())
