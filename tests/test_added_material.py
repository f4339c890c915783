"""The material that docs/materials.md adds, by its file and its row, is one like any other."""

import numpy as np
import pytest
from pxr import Usd

from warpsph import (
    Box,
    Checkpoint,
    Fixed,
    Numerics,
    Scene,
    SceneError,
    Simulation,
    edge,
    write_checkpoint,
)
from warpsph.export.usd import write_stage
from warpsph.frames import Frames, FrameWriter
from warpsph.materials import LAWS
from warpsph.mesh.continuum import CONTINUA
from warpsph.scene.document import decode, encode
from warpsph.scene.fingerprint import fingerprint

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
    simulation = Simulation(
        relaxing(maxwell, size, source_scheme=scheme, time_step=0.1 * TIME), device="cpu", precision=precision
    )
    simulation.run()
    bound = max(bound, 20 * np.finfo(precision).eps)
    left = np.exp(-2.0)
    q = 1e3 if len(size) == 1 else 1e3 * np.sqrt(3.0)
    energy = 0.5 * q**2 / (1e6 if len(size) == 1 else 3.0 * SHEAR)
    np.testing.assert_allclose(simulation.field("von_mises_stress"), q * left, rtol=bound)
    np.testing.assert_allclose(simulation.field("dissipated_energy"), (1.0 - left**2) * energy, rtol=10 * bound)
    assert "J/m³" in simulation.fields()["dissipated_energy"]


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
        scene = Scene(
            shape=Box((1.0, 0.5), 0.25), material=stiff, duration=1e-3, numerics=Numerics(source_scheme=scheme)
        )
        assert (Simulation(scene, device="cpu").time_step_limit < 1e-5) == limited


def test_a_material_without_a_row_is_refused_in_one_line(maxwell, monkeypatch):
    monkeypatch.delitem(LAWS, maxwell.Maxwell)
    with pytest.raises(SceneError, match=r"^material = Maxwell\(.* one of Elastic, PerzynaVonMises$"):
        Simulation(relaxing(maxwell, (1.0,)), device="cpu")
