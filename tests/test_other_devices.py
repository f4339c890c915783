"""What can be said of GPUs without one: their kernels compile, and what is laid out otherwise gives the same."""

import numpy as np
import pytest
import warp as wp

from tests.test_launching import SCENES, STATE, pressed
from warpsph import Numerics, Simulation
from warpsph.device.arrays import ALIGNMENT
from warpsph.operators.cell_limit import CellLimit
from warpsph.operators.conditions import Conditions
from warpsph.operators.neighbour_sums import GPU_BATCH
from warpsph.operators.surface.release import FreeSurfaceConditions
from warpsph.simulation.state import slots
from warpsph.step import cells, lists, published, sums

HOPPER = 90  # compute capability 9.0
# These two have every kernel of both families of schemes; the others are variants of them.
SHORT = ("default", "published, free surface")
COMPILED = [
    pytest.param(name, precision, marks=[] if name in SHORT else [pytest.mark.long])
    for name, precision in [*((name, "float32") for name in SCENES), ("solid", "float64")]
]


@pytest.fixture
def as_on_a_gpu(monkeypatch):
    """Simulations made now have the kernels and the layout of a GPU, wherever they run."""
    monkeypatch.setattr(published, "batch_on", lambda device: GPU_BATCH)


@pytest.mark.skipif(HOPPER not in wp.get_cuda_supported_archs(), reason="this Warp can not compile for CUDA")
@pytest.mark.parametrize(("name", "precision"), COMPILED)
def test_all_kernels_compile_for_cuda(as_on_a_gpu, name, precision, monkeypatch, tmp_path):
    """To machine code, which needs no driver."""
    kernels = []
    for module in (cells, sums, lists):
        monkeypatch.setattr(module, "load_kernels", lambda of_step, device: kernels.extend(of_step))
    for part in (CellLimit, lists.PairLists, Conditions, FreeSurfaceConditions):
        monkeypatch.setattr(part, "refresh", lambda self: None)
    monkeypatch.setattr(cells.CellStepper, "step", lambda self: None)
    monkeypatch.setattr(sums.SumsStepper, "_initial_spin", lambda self, scene: None)
    Simulation(SCENES[name](), "cpu", precision)
    modules = {kernel.module for kernel in kernels}
    for module in modules:
        wp.compile_aot_module(module, arch=HOPPER, module_dir=tmp_path, use_ptx=False)
    assert len(list(tmp_path.glob("*.cubin"))) == len(modules) > 8


@pytest.mark.parametrize("dim", [2, 3])
def test_the_layout_of_a_gpu_gives_the_same(precision, dim, request):
    """On one thread of the CPU; sums are added up in the same order, by code that may round otherwise."""
    runs, numerics = [], Numerics(velocity_scheme="blanc-pastor")
    for _ in range(2):
        simulation = Simulation(pressed(dim, numerics=numerics), "cpu", precision, threads=1)
        simulation.run(0.02)
        runs.append({name: simulation.field(name) for name in STATE})
        request.getfixturevalue("as_on_a_gpu")
    rounding = {"float64": 1e-11, "float32": 2e-4}[precision]
    for name, expected in runs[0].items():
        assert np.abs(runs[1][name] - expected).max() <= rounding * np.abs(expected).max(), name


@pytest.mark.parametrize("scheme", ["cells", "blanc-pastor"])
@pytest.mark.parametrize("dim", [2, 3])
def test_what_the_compilers_are_told_of_arrays_is_true(device, precision, dim, scheme):
    """Also of those that a restored state brought along."""
    scene = pressed(dim, numerics=Numerics(velocity_scheme=scheme))
    first, restored = (Simulation(scene, device, precision) for _ in range(2))
    first.run(0.05)
    restored.restore(*first.state())
    told_of = (
        "body.nodes.",
        "body.auxiliary.",
        "body.node_cells.",
        "lists._auxiliary.",
        "lists._nodes.",
        "_numbers",
        "_forces",
        "_sharpening.means.",
    )
    every = (slot for slot in slots(restored.stepper) if isinstance(slot.value, wp.array))
    arrays = {slot.path: slot.value for slot in every if slot.path.startswith(told_of)}
    assert len(arrays) > 15
    for path, array in arrays.items():
        assert array.ptr % ALIGNMENT == 0, path
        assert array.is_contiguous, path
