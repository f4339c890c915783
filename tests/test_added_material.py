"""The material that docs/materials.md adds, in a file of one's own, is one like any other."""

import subprocess
import sys
from dataclasses import make_dataclass, replace
from functools import cache

import numpy as np
import pytest
import warp as wp
from pxr import Usd

from tests.documents import LAW, ROOT, blocks
from tests.law_tester import LawTester
from warpsph import (
    Box,
    Checkpoint,
    Elastic,
    Fixed,
    Material,
    Numerics,
    Scene,
    SceneError,
    Simulation,
    edge,
    register,
    write_checkpoint,
)
from warpsph.cli.main import main
from warpsph.export.usd import write_stage
from warpsph.frames import Frames, FrameWriter
from warpsph.materials import DerivedField, InternalVariable
from warpsph.mesh.continuum import CONTINUA
from warpsph.scene.document import decode, encode
from warpsph.scene.fingerprint import fingerprint

pytestmark = pytest.mark.usefixtures("undrawn")

TIME, SHEAR = 0.01, 1e6 / 2.6  # τ [s], G [Pa]


def relaxing(law, size, **numerics):
    """A uniform stress that relaxes for two relaxation times, held at all edges; a shear, but in a bar."""
    shear = {1: (1e3,), 2: (0.0, 0.0, 1e3, 0.0), 3: (0.0, 0.0, 0.0, 1e3, 0.0, 0.0)}[len(size)]
    return Scene(
        shape=Box(size, 0.25),
        material=law.Maxwell(young_modulus=1e6, poisson_ratio=0.3, density=2000.0, relaxation_time=TIME),
        stress=lambda *x: shear,
        duration=2.0 * TIME,
        conditions=[Fixed(edge(name)) for name in CONTINUA[len(size)].edges],
        large_displacements=False,
        numerics=Numerics(**numerics),
    )


# RK4 errs by (λ Δt/2)⁵/120 a half step: 1e-7 in 40 of them at λ Δt = 0.1.
@pytest.mark.parametrize(("scheme", "bound"), [("rk4", 2e-7), ("analytic", 1e-12)])
@pytest.mark.parametrize("size", [(1.0,), (1.0, 0.5), (1.0, 0.5, 0.5)], ids=["bar", "plane strain", "solid"])
def test_stress_relaxes_and_the_energy_it_loses_is_remembered(scheme, bound, size, precision, maxwell):
    numerics = {"source_scheme": scheme, "velocity_scheme": "taylor" if scheme == "rk4" else "cells"}
    scene = relaxing(maxwell, size, time_step=0.1 * TIME, **numerics)
    simulation = Simulation(scene, device="cpu", precision=precision)
    simulation.run()
    bound = max(bound, 20 * np.finfo(precision).eps)
    left = np.exp(-2.0)
    q = 1e3 if len(size) == 1 else 1e3 * np.sqrt(3.0)
    energy = 0.5 * q**2 / (1e6 if len(size) == 1 else 3.0 * SHEAR)
    np.testing.assert_allclose(simulation.field("von_mises_stress"), q * left, rtol=bound)
    dissipated = (1.0 - left**2) * energy
    np.testing.assert_allclose(simulation.field("dissipated_energy"), dissipated, rtol=10 * bound)
    np.testing.assert_allclose(simulation.field("temperature_rise"), dissipated / 2e6, rtol=10 * bound)
    assert "J/m³" in simulation.fields()["dissipated_energy"]
    assert simulation.fields()["temperature_rise"] == "(n,) [K] rise of temperature by flow"


def test_it_is_in_frames_stages_checkpoints_and_stored_scenes(maxwell, tmp_path):
    scene = relaxing(maxwell, (1.0, 0.5))
    simulation = Simulation(scene, device="cpu")
    simulation.run(observers=[FrameWriter(simulation, (0.0, TIME, 2.0 * TIME), tmp_path)])
    energy, frames = simulation.field("dissipated_energy"), Frames(tmp_path)
    np.testing.assert_allclose(frames[-1].field("dissipated_energy"), energy, rtol=1e-6)
    assert "dissipated_energy" in frames.fields and frames.unit("dissipated_energy") == "J/m³"
    write_stage(frames, tmp_path / "run.usda")
    stage = Usd.Stage.Open(str(tmp_path / "run.usda"))
    drawn = stage.GetPrimAtPath("/Run/MaterialNodes").GetAttribute("primvars:dissipated_energy")
    np.testing.assert_allclose(drawn.Get(stage.GetEndTimeCode()), energy, rtol=1e-6)
    write_checkpoint(simulation, tmp_path / "checkpoint.npz")
    again = Simulation(scene, device="cpu")
    Checkpoint.read(tmp_path / "checkpoint.npz").restore(again)
    np.testing.assert_array_equal(again.field("dissipated_energy"), energy)
    document, arrays = encode(scene)
    assert document["material"]["type"] == "Maxwell" and document["material"]["relaxation_time"] == TIME
    assert fingerprint(decode(document, arrays)) == fingerprint(scene)


def test_the_step_is_limited_by_what_it_relaxes(maxwell):
    """RK4 sub-steps: λ Δt/2 ≤ 256 · 1.39; the analytic scheme needs no limit."""
    stiff = maxwell.Maxwell(young_modulus=1e6, poisson_ratio=0.3, density=2000.0, relaxation_time=1e-8)
    for scheme, limited in (("rk4", True), ("analytic", False)):
        numerics = Numerics(velocity_scheme="taylor", source_scheme=scheme)
        scene = Scene(shape=Box((1.0, 0.5), 0.25), material=stiff, duration=1e-3, numerics=numerics)
        assert (Simulation(scene, device="cpu").time_step_limit < 1e-5) == limited


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_what_relaxes_is_what_flows(dim, maxwell):
    """RK4 comes to what `relax` gives with the fourth power of its step."""
    material = maxwell.Maxwell(young_modulus=1e6, poisson_ratio=0.3, density=2000.0, relaxation_time=TIME)
    tester = LawTester(material, dim)
    stress = np.arange(1.0, 1.0 + CONTINUA[dim].stress_size)
    exact = np.concatenate(tester.relax(stress, tester.at_rest(), 2.0 * TIME))
    coarse, fine = (
        np.concatenate(tester.flow_for(stress, tester.at_rest(), 2.0 * TIME, steps=steps)) - exact
        for steps in (20, 40)
    )
    np.testing.assert_allclose(coarse, 16.0 * fine, rtol=0.1, atol=1e-14)
    assert coarse[0] != 0.0 != coarse[-1]


class Relaxing:
    """A material whose law says what relaxes, and not how fast."""

    def law(self, space):
        return _without_flow(super().law(space))


@cache
def _without_flow(law):
    return replace(law, flow=None, flow_stiffness=None)


def test_a_law_that_only_relaxes_runs_with_analytic_sources_and_is_refused_with_rk4(maxwell):
    relaxing_only = type("RelaxingOnly", (Relaxing, maxwell.Maxwell), {})
    scene = relaxing(maxwell, (1.0, 0.5), time_step=0.1 * TIME)
    only = replace(scene, material=relaxing_only(**vars(scene.material)))
    simulations = [Simulation(each, device="cpu") for each in (scene, only)]
    for simulation in simulations:
        simulation.run()
    np.testing.assert_array_equal(*(simulation.field("dissipated_energy") for simulation in simulations))
    assert simulations[0].field("dissipated_energy").min() > 0.0
    with pytest.raises(SceneError, match=r"^source_scheme = 'rk4' .* law of RelaxingOnly takes analytic only$"):
        Simulation(replace(only, numerics=Numerics(velocity_scheme="taylor", source_scheme="rk4")), device="cpu")


@cache
def _forgetful(law, space):
    @wp.func
    def relax(sigma: space.types.stress, internals: space.vec(1), p: law.Parameters, dt: space.real):
        result, _ = law.relax(sigma, internals, p, dt)
        return result + internals[0] * sigma, internals  # there is nothing: it must be zero

    return replace(law, internals=(), relax=relax, flow=None, flow_stiffness=None)


class Forgetful:
    """The example without what its nodes remember."""

    internals = derived = ()

    def law(self, space):
        return _forgetful(super().law(space), space)


@pytest.mark.parametrize("velocity_scheme", ["cells", "taylor"])
def test_a_law_that_flows_may_remember_nothing(velocity_scheme, maxwell):
    scene = relaxing(maxwell, (1.0, 0.5), time_step=0.1 * TIME, velocity_scheme=velocity_scheme)
    kind = type("Forgetting", (Forgetful, maxwell.Maxwell), {})
    simulation = Simulation(replace(scene, material=kind(**vars(scene.material))), device="cpu")
    simulation.run()
    np.testing.assert_allclose(simulation.field("stress")[:, 2], 1e3 * np.exp(-2.0), rtol=1e-12)
    assert "dissipated_energy" not in simulation.fields() and simulation.internals is None


@pytest.mark.parametrize("missing", ["relax", "flow", "flow_stiffness"])
def test_a_law_that_lacks_a_function_it_needs_is_refused_in_one_line(missing, maxwell):
    law = LawTester(maxwell.Maxwell(young_modulus=1e6, density=2000.0, relaxation_time=TIME), 1).law
    with pytest.raises(SceneError, match=r"^Law\."):
        replace(law, **{missing: None})


def test_a_law_for_other_continua_is_refused_when_the_scene_is_built(maxwell):
    plane = type("Plane", (maxwell.Maxwell,), {"continua": ("plane_strain", "solid")})
    scene = relaxing(maxwell, (1.0, 0.5))
    replace(scene, material=plane(**vars(scene.material)))
    with pytest.raises(SceneError, match=r"^material = Plane\(.* knows plane_strain, solid only, .* is a bar$"):
        replace(relaxing(maxwell, (1.0,)), material=plane(**vars(scene.material)))


def varied(maxwell, initial):
    """The example, with energy that the nodes have from before."""
    (energy,), scene = maxwell.Maxwell.internals, relaxing(maxwell, (1.0, 0.5))
    kind = type("Varied", (maxwell.Maxwell,), {"internals": (replace(energy, initial=initial),)})
    return replace(scene, material=kind(**vars(scene.material)))


def test_internal_variables_start_where_the_material_says(maxwell, precision):
    """A number, or a function of the material and the position."""
    x, y = relaxing(maxwell, (1.0, 0.5)).mesh.nodes.T
    for initial, expected in (
        (3.0, np.full(len(x), 3.0)),
        (lambda material, x, y: material.density * (1.0 + y), 2000.0 * (1.0 + y)),
        (lambda material, *at: material.heat_capacity, np.full(len(x), 1000.0)),
    ):
        simulation = Simulation(varied(maxwell, initial), device="cpu", precision=precision)
        energy = simulation.field("dissipated_energy")
        np.testing.assert_array_equal(energy, expected.astype(energy.dtype))
        np.testing.assert_array_equal(simulation.field("temperature_rise"), energy / 2e6)


@pytest.mark.parametrize("initial", [float("nan"), "much", lambda material, x, y: x[:2], lambda material: 1.0])
def test_an_initial_value_that_is_none_is_refused_when_the_scene_is_built(initial, maxwell):
    with pytest.raises(SceneError, match=r"^dissipated_energy = "):
        varied(maxwell, initial)


def test_a_fingerprint_sees_the_values_of_functions_of_position(maxwell):
    """Not which function gave them, which differs from process to process."""
    (energy,), scene = maxwell.Maxwell.internals, relaxing(maxwell, (1.0, 0.5))
    own = {"internals": (replace(energy, initial=lambda material, *x: material.profile(*x)),)}
    kind = make_dataclass(
        "Layered", [("profile", object)], bases=(maxwell.Maxwell,), namespace=own, frozen=True, kw_only=True
    )

    def layered(slope):
        return replace(scene, material=kind(profile=lambda x, y: slope * y, **vars(scene.material)))

    scenes = [layered(slope) for slope in (1.0, 1.0, 2.0)]  # all alive: no function takes another's address
    prints = [fingerprint(each) for each in scenes]
    assert prints[0] == prints[1] != prints[2]


@pytest.mark.parametrize(
    "fields",
    [
        {"internals": (InternalVariable("stress", "-", ""),)},
        {"derived": (DerivedField("dissipated_energy", "-", "", lambda *parts: parts),)},
        {"derived": (DerivedField("density", "-", "", lambda *parts: parts),)},
    ],
)
def test_a_field_with_the_name_of_another_is_refused_in_one_line(fields, maxwell):
    scene = relaxing(maxwell, (1.0,))
    twice = type("Twice", (maxwell.Maxwell,), fields)(**vars(scene.material))
    with pytest.raises(SceneError, match=r"^Twice field = '.*another field has this name$"):
        Simulation(replace(scene, material=twice), device="cpu").fields()


def test_a_name_is_taken_once_but_the_same_code_may_run_again(maxwell):
    again = type("Maxwell", (maxwell.Maxwell,), {"__module__": maxwell.__name__})
    assert register(again) is again and decode(*encode(relaxing(maxwell, (1.0,)))).material.__class__ is again
    for name in ("Maxwell", "Elastic"):
        with pytest.raises(SceneError, match=rf"^name of tests.*{name} = '{name}' .*{name} has this name$"):
            register(type(name, (Elastic,), {"__module__": __name__}))


def test_a_material_that_is_not_registered_runs_and_is_code_in_a_document(maxwell):
    scene = relaxing(maxwell, (1.0,))
    scene = replace(scene, material=type("Unnamed", (maxwell.Maxwell,), {})(**vars(scene.material)))
    Simulation(scene, device="cpu").step()
    document, arrays = encode(scene)
    assert document["material"] == {"code": "material"}
    assert decode(document, arrays, lambda place: scene).material is scene.material


def test_a_material_must_have_a_law():
    with pytest.raises(TypeError, match=r"abstract"):
        Material(density=1.0)


def test_a_stored_scene_finds_the_material_its_scene_file_registers(registered, tmp_path, monkeypatch):
    """In this process, which reads the file and then its copy, and in one that has not read it."""
    (law,) = (block for block in blocks(ROOT / "docs/materials.md", "python") if block.startswith(LAW))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "relaxing.py").write_text(law + SCENE, encoding="utf-8")
    options = ["--device", "cpu", "--quiet"]
    assert main(["run", "relaxing.py", "--out", "first", *options]) == 0
    assert main(["run", "first/scene.toml", "--out", "second", *options]) == 0
    assert 'type = "Maxwell"' in (tmp_path / "second/scene.toml").read_text(encoding="utf-8")
    command = [sys.executable, "-m", "warpsph", "run", "second/scene.toml", "--out", "third", *options]
    assert subprocess.run(command, check=False).returncode == 0


SCENE = """

def scene(p):
    from warpsph import Box, Scene

    material = Maxwell(young_modulus=1e6, density=2000.0, relaxation_time=0.01)
    return Scene(shape=Box((1.0,), 0.1), material=material, duration=1e-3, numerics=p.numerics)
"""
