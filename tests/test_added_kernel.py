"""The smoothing kernel that docs/kernels.md adds is one like any other."""

import dataclasses
import subprocess
import sys

import pytest

from tests import test_sweeps
from tests.documents import ROOT, blocks, run_as_module
from warpsph import Box, Elastic, Numerics, Scene, SceneError, SmoothingKernel, register
from warpsph.cli.main import main
from warpsph.physics.smoothing import cubic_spline
from warpsph.scene.parameter import numerical_parameters
from warpsph.scene.scheme import SCHEMES

pytestmark = pytest.mark.usefixtures("undrawn")

FILE = """
from warpsph import Box, Elastic, Scene, SmoothingKernel, register
from warpsph.physics.smoothing import wendland_c2

def wide(precision):
    return wendland_c2(precision)

register(SmoothingKernel(name="wide", support=2.0, smoothing_ratio=1.0, weights=wide))
NUMERICS = {"velocity_scheme": "taylor", "kernel": "wide"}

def scene(p):
    elastic = Elastic(young_modulus=1e6, density=1e3)
    return Scene(shape=Box((1.0,), 0.1), material=elastic, duration=1e-3, numerics=p.numerics)
"""


@pytest.fixture
def quintic(registered, tmp_path):
    (block,) = blocks(ROOT / "docs/kernels.md", "python")
    return run_as_module("quintic", block, tmp_path)


def test_weights_gradients_and_batches_are_those_of_a_kernel(quintic, precision):
    test_sweeps.test_second_weight_is_minus_the_derivative_over_xi("quintic_spline")
    for dim in (1, 2, 3):
        test_sweeps.test_gradients_of_linear_fields_and_values_of_constants_are_exact(
            precision, "quintic_spline", dim
        )
    test_sweeps.test_nothing_depends_on_how_many_weights_are_found_at_a_time("quintic_spline")


def test_it_has_a_default_ratio_limits_and_a_place_among_the_parameters(quintic):
    numerics = Numerics(velocity_scheme="taylor", kernel="quintic_spline")
    assert (numerics.smoothing_ratio, numerics.support) == (0.7, pytest.approx(2.1))
    assert "quintic_spline" in next(p for p in numerical_parameters({}) if p.name == "kernel").choices
    elastic = Elastic(young_modulus=1e6, density=1e3)
    with pytest.raises(SceneError, match=r"with kernel quintic_spline .* above 0.527 .* at most 2"):
        Scene(
            shape=Box((1.0, 1.0), 0.1),
            material=elastic,
            duration=1.0,
            numerics=Numerics(velocity_scheme="taylor", kernel="quintic_spline", smoothing_ratio=0.5),
        )


def test_a_stored_scene_finds_the_kernel_its_scene_file_registers(registered, tmp_path, monkeypatch):
    """In this process, which reads the file and then its copy, and in one that has not read it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bar.py").write_text(FILE)
    options = ["--device", "cpu", "--quiet"]
    assert main(["run", "bar.py", "--out", "first", *options]) == 0
    assert main(["run", "first/scene.toml", "--out", "second", *options]) == 0
    command = [sys.executable, "-m", "warpsph", "run", "first/scene.toml", "--out", "third", *options]
    assert subprocess.run(command, check=False).returncode == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "gaussian"}, r"name of .*cubic_spline = 'gaussian' .*gaussian has this name"),
        ({"name": 3}, "SmoothingKernel.name = 3 .* a text"),
        ({"support": 0.0}, "SmoothingKernel.support = 0.0 .* above 0"),
        ({"smoothing_ratio": float("nan")}, "SmoothingKernel.smoothing_ratio = nan .* finite"),
        ({"weights": "cubic"}, "SmoothingKernel.weights = 'cubic' .* function of the precision"),
    ],
)
def test_what_is_no_kernel_or_has_a_taken_name_is_refused_in_one_line(change, message, registered):
    record = {"name": "mine", "support": 2.0, "smoothing_ratio": 0.9, "weights": cubic_spline}
    with pytest.raises(SceneError, match=f"^{message}"):
        register(SmoothingKernel(**(record | change)))


def test_only_records_can_be_registered():
    with pytest.raises(SceneError, match=r"^register = 3 is not allowed: it must be a subclass of Material"):
        register(3)


def test_a_scheme_is_registered_by_the_same_function(registered):
    mine = dataclasses.replace(SCHEMES["cells"], name="mine")
    assert register(mine) is mine and Numerics(velocity_scheme="mine").scheme is mine
    with pytest.raises(SceneError, match=r"^name of .*CellStepper = 'taylor' .* has this name$"):
        register(dataclasses.replace(mine, name="taylor"))
