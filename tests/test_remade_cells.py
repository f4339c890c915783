"""Cells that follow the flow: what was true of a body stays true when its cells are made anew."""

import numpy as np
import pytest
import warp as wp
from pxr import Usd, UsdGeom

from warpsph import (
    BodyForce,
    Box,
    BreakdownError,
    Elastic,
    Fixed,
    Numerics,
    PerzynaVonMises,
    Plane,
    Remade,
    Rough,
    Scene,
    SceneError,
    Simulation,
    Traction,
    edge,
)
from warpsph.errors import DamagedError
from warpsph.export.frame_files import frame_paths
from warpsph.export.pictures.field import plot_frame
from warpsph.export.quantity import quantity
from warpsph.export.usd import write_stage
from warpsph.frames import Frames, FrameWriter, evenly

HOPPER = 90  # compute capability 9.0
HEIGHT, WIDTH, DENSITY, GRAVITY = 2.0, 2.0, 1800.0, 9.81


def column(stability=11.8, spacing=0.1, cells=None, **changed):
    """A column of clay, H = 2 m, of which γH/c_u is given, on rough ground."""
    strength = DENSITY * GRAVITY * HEIGHT / stability
    parts = {
        "shape": Box(size=(WIDTH, HEIGHT), spacing=spacing, origin=(-0.5 * WIDTH, 0.0), cells="triangles"),
        "material": PerzynaVonMises(
            young_modulus=1e6,
            poisson_ratio=0.45,
            density=DENSITY,
            fluidity=100.0,
            yield_size=3.0**0.5 * strength,
        ),
        "tools": [Plane((0.0, 0.0), (0.0, 1.0), interface=Rough())],
        "body_force": BodyForce((0.0, -GRAVITY)),
        "duration": 2.0,
        "cells": cells,
    }
    return Scene(**(parts | changed))


def run_out(simulation):
    """To both sides [m]."""
    x = simulation.field("position")[:, 0]
    return np.array([-x.min(), x.max()])


def area(simulation):
    """Of the cells as they are [m²]."""
    return simulation.stepper.body.mesh().with_nodes(simulation.field("position")).cell_volumes().sum()


def state(simulation):
    return {name: simulation.field(name).tobytes() for name in ("position", "velocity", "stress")}


@pytest.fixture(scope="module")
def flowed():
    """The column at rest."""
    simulation = Simulation(column(cells=Remade()), "cpu")
    simulation.run()
    return simulation


def test_a_column_of_clay_flows_to_rest(flowed):
    """It ran out 4.22 to 4.24 m in an independent program with edge flips and nodes that come and go.

    Here 4.14 m at this spacing, nearer on finer ones; 3 % are allowed, and 1 % between left and right.
    """
    balance = flowed.energy()
    assert np.abs(flowed.field("velocity")).max() < 0.1
    assert np.abs(run_out(flowed) / 4.23 - 1.0).max() < 0.03
    assert np.ptp(run_out(flowed)) < 0.01 * 4.23
    assert abs(area(flowed) / (HEIGHT * WIDTH) - 1.0) < 0.002
    assert abs(balance.unaccounted) < 1e-4 * balance.gravity
    assert abs(balance.remade) < 0.01 * balance.gravity
    assert flowed.stepper.remaking.made > 50
    assert flowed.stepper.remaking.refused == 0


def test_work_of_gravity_is_what_the_body_came_down_by(flowed):
    """With that of nodes that were moved onto the outline, and off it."""
    fallen = -(flowed.nodes.mass.numpy() * flowed.field("displacement")[:, 1]).sum() * GRAVITY
    assert abs(flowed.energy().gravity / fallen - 1.0) < 1e-9


def test_without_new_cells_it_breaks_down():
    with pytest.raises(BreakdownError, match="so flat"):
        Simulation(column(), "cpu").run()


def test_run_out_does_not_depend_on_how_often_cells_are_made(flowed):
    often = Simulation(column(cells=Remade(every=5)), "cpu")
    often.run()
    assert np.abs(run_out(often) / run_out(flowed) - 1.0).max() < 0.01


def test_cells_that_keep_their_shape_are_let_alone():
    """Bit for bit."""
    held, found = {"tools": (), "conditions": [Fixed(edge("bottom"))], "duration": 0.1}, []
    held["body_force"] = BodyForce((0.0, -1.0))
    for cells in (None, Remade(every=1)):
        simulation = Simulation(column(2.0, cells=cells, **held), "cpu")
        simulation.run()
        found.append(state(simulation))
    assert found[0] == found[1]


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_a_body_that_spins_keeps_its_momenta(precision):
    """Cells of a lattice change as it turns: not those that are decided by weights, but by rounding."""
    scene = Scene(
        shape=Box(size=(1.0, 1.0), spacing=0.1, cells="triangles"),
        material=Elastic(young_modulus=1e5, poisson_ratio=0.3, density=1000.0),
        velocity=lambda x, y: (0.3 - 5.0 * (y - 0.5), 5.0 * (x - 0.5)),
        duration=0.7,
        cells=Remade(every=5),
    )
    simulation = Simulation(scene, "cpu", precision)
    simulation.stepper.remaking.begun = True
    mass, momenta = simulation.nodes.mass.numpy().astype(float), []
    for until in (0.01, 0.7):
        simulation.run(until)
        x, v = (simulation.field(name).astype(float) for name in ("position", "velocity"))
        spin = (mass * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])).sum()
        momenta.append([*(mass[:, None] * v).sum(axis=0), spin])
    assert simulation.stepper.remaking.made > 3
    rounding = {"float64": 1e-12, "float32": 2e-4}[precision]
    scale = mass.sum() * 5.0
    np.testing.assert_allclose(momenta[1][:2], momenta[0][:2], rtol=0.0, atol=rounding * scale)
    assert abs(momenta[1][2] / momenta[0][2] - 1.0) < rounding


def test_restored_run_and_any_number_of_threads_give_the_same_bits():
    scene = column(20.0, cells=Remade(every=5))
    whole = Simulation(scene, "cpu", threads=1)
    whole.run(0.8)
    kept = whole.state()
    whole.run(1.1)
    assert whole.stepper.remaking.made > 20
    restored, threaded = Simulation(scene, "cpu", threads=1), Simulation(scene, "cpu", threads=2)
    restored.restore(*kept)
    restored.run(1.1)
    threaded.run(0.8)
    threaded.run(1.1)
    end = state(whole)
    assert end == state(restored) == state(threaded)
    whole.restore(*kept)
    whole.run(1.1)
    assert state(whole) == end


LATTICE = Box(size=(WIDTH, HEIGHT), spacing=0.1)
REFUSED = {
    "quads": ({"shape": LATTICE}, "it takes triangles, not a quad"),
    "a published scheme": (
        {"shape": LATTICE, "tools": (), "numerics": Numerics(velocity_scheme="blanc-pastor")},
        "velocity_scheme blanc-pastor has cells of its own",
    ),
    "small strains": ({"tools": (), "large_displacements": False}, "take large_displacements=True"),
    "loads": ({"conditions": [Traction(edge("top"), (0.0, 1.0))]}, "loads are on faces of cells that stay"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_scenes_whose_cells_can_not_be_made_anew_are_refused(name):
    changed, allowed = REFUSED[name]
    with pytest.raises(SceneError, match=rf"cells = Remade\(every=20\).*{allowed}"):
        column(cells=Remade(), **changed)


def test_every_is_a_number_of_steps():
    with pytest.raises(SceneError, match=r"Remade.every = 0"):
        Remade(every=0)


def test_nodes_that_a_condition_holds_stay_on_the_outline():
    held, ground = [Fixed(edge("left"))], [Plane((0.0, 0.0), (0.0, 1.0))]
    simulation = Simulation(column(20.0, cells=Remade(every=5), conditions=held, tools=ground), "cpu")
    simulation.run(0.4)
    assert simulation.stepper.remaking.made > 10
    after, nodes = simulation.stepper.remaking.outline.after.numpy(), simulation.scene.boundary.nodes
    down = nodes[simulation.mesh.nodes[nodes, 1].argsort()[::-1]]
    np.testing.assert_array_equal(after[down[:-1]], down[1:])


@pytest.mark.skipif(HOPPER not in wp.get_cuda_supported_archs(), reason="this Warp can not compile for CUDA")
def test_all_kernels_compile_for_cuda(tmp_path):
    stepper = Simulation(column(cells=Remade()), "cpu").stepper
    shares = stepper.tools._shares
    modules = {kernel.module for part in (stepper.remaking, stepper._limit, shares) for kernel in part.kernels}
    for module in modules:
        wp.compile_aot_module(module, arch=HOPPER, module_dir=tmp_path, use_ptx=False)
    assert len(list(tmp_path.glob("*.cubin"))) == len(modules) > 15


def test_frames_pictures_and_exports_have_the_cells_of_their_time(tmp_path):
    """As the simulation has them; at the start those of the scene. A damaged cell is refused in one line."""
    simulation = Simulation(column(cells=Remade(), duration=0.7), "cpu")
    writer = FrameWriter(simulation, evenly(0.7, 2), tmp_path)
    simulation.run(observers=[writer])
    frames = Frames(tmp_path)
    first, last = frames[0], frames[-1]
    assert np.array_equal(np.sort(first.present_mesh.cells), np.sort(simulation.mesh.cells))
    assert np.array_equal(last.present_mesh.cells, simulation.present_mesh.cells)
    assert not np.array_equal(last.present_mesh.cells, first.present_mesh.cells)
    now = last.present_mesh.with_nodes(last.field("position")).cell_volumes().sum()
    assert now == pytest.approx(area(simulation), rel=1e-6)
    ask = quantity("equivalent_plastic_strain", frames)
    plot_frame(frames, ask, frame=last, path=tmp_path / "last.png")
    write_stage(frames, tmp_path / "column.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "column.usdc"))
    middles = UsdGeom.Points(stage.GetPrimAtPath("/Run/AuxiliaryNodes"))
    for frame in (first, last):
        code = frames.code(frame.number)
        assert len(middles.GetPointsAttr().Get(code)) == len(frame.present_mesh.cells)
        assert len(middles.GetIdsAttr().Get(code)) == len(frame.present_mesh.cells)
    path = frame_paths(tmp_path)[-1]
    with np.load(path) as arrays:
        parts = dict(arrays)
    parts["cells"][3, 1] = 10**6
    np.savez(path, **parts)
    with pytest.raises(DamagedError, match="cells"):
        frames[-1]
