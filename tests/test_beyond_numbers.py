"""Numbers that are none, in the midst of a run: an error, whatever is found by them."""

import subprocess
import sys

from warpsph.scene.registry import SCHEMES

FAR_TOO_FAST = """
from warpsph import *
from warpsph.scene.registry import SCHEMES

common = dict(material=Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0), duration=1.0)
for shape in (Box((1.0, 0.5), 0.25), Box((0.5, 0.5, 0.5), 0.25)):
    for scheme in SCHEMES:
        numerics, speed = Numerics(velocity_scheme=scheme), lambda x, *rest: (1e30 * x, *(0.0 * x for _ in rest))
        scene = Scene(shape=shape, velocity=speed, free_surface=FreeSurface(), numerics=numerics, **common)
        try:
            Simulation(scene, device="cpu", precision="float32").run()
        except BreakdownError:
            print(scheme)
"""


def test_a_moving_surface_bears_numbers_that_are_none():
    """In a process of its own, which a segmentation fault would end: NaN was an index where stress is released."""
    done = subprocess.run([sys.executable, "-c", FAR_TOO_FAST], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stdout.splitlines() if line in SCHEMES] == [*SCHEMES, *SCHEMES]
