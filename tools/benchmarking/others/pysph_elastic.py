"""PySPH's elastic scheme on its own example, a plate that oscillates in a clamp, refined.

Run by an interpreter in which PySPH is installed; it need not be the one of warpsph. Prints one JSON object.
Only the plate's particles are counted as advanced: those of the wall carry no equation of motion.
"""

import argparse
import json
import os
import tempfile
import time

PLATE_AREA = 0.25 * 0.02  # of the example [m²]
EXAMPLE_SPACING = 0.002  # [m], with the example's time step of 1e-5 s


def main() -> None:
    """Measure particle-steps a second after a warm-up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nodes", type=int, required=True)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--steps", type=int, default=20)
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = str(options.threads)
    try:
        print(json.dumps(measure(options.nodes, options.threads, options.steps)))
    except ImportError as error:
        print(json.dumps({"skipped": f"PySPH is not installed ({error})"}))


def measure(nodes: int, threads: int, steps: int) -> dict:
    """Run a quarter of the steps to warm up, then time the rest."""
    import pysph
    from pysph.examples.solid_mech.oscillating_plate import OscillatingPlate

    warm_up = max(2, steps // 4)

    class RefinedPlate(OscillatingPlate):
        def initialize(self):
            super().initialize()
            self.dx_plate = (PLATE_AREA / nodes) ** 0.5
            self.h = 1.3 * self.dx_plate
            self.dt *= self.dx_plate / EXAMPLE_SPACING

        def post_step(self, solver):
            clock.append(time.perf_counter())

    clock: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        options = ["--disable-output", "--no-adaptive-timestep", "--quiet", "--loglevel", "none"]
        options += ["--directory", folder]
        options += ["--max-steps", str(warm_up + steps), "--openmp" if threads > 1 else "--no-openmp"]
        app = RefinedPlate(fname="refined_plate")
        app.run(options)
    plate = next(array for array in app.particles if array.name == "plate")
    advanced = plate.get_number_of_particles()
    seconds = clock[-1] - clock[-1 - steps]
    return {
        "solver": f"PySPH {pysph.__version__}",
        "case": "elastic scheme, oscillating plate, 2D, float64",
        "threads": threads,
        "nodes": advanced,
        "steps": steps,
        "node_steps_per_second": advanced * steps / seconds,
    }


if __name__ == "__main__":
    main()
