"""Other solvers, where they are installed: one script each, run by an interpreter that has the solver.

A script takes `--nodes` and `--threads` and prints, as its last line, a JSON object with `solver`, `case`,
`threads`, `nodes`, `steps` and `node_steps_per_second`, or with `skipped` and a reason.
"""

from pathlib import Path

ADAPTERS = {"pysph": Path(__file__).parent / "pysph_elastic.py"}
