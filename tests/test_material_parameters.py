"""Parameters of materials: the material's fields are their one place; scenes, docs and checks take them there."""

import dataclasses
from types import SimpleNamespace

import pytest

from warpsph import Elastic, Parameter, PerzynaVonMises, SceneError
from warpsph.scene.parameter import assign, namespace, numerical_parameters
from warpsph.scene.registry import MATERIALS

CLAY = PerzynaVonMises(
    young_modulus=2e7, poisson_ratio=0.4, density=1900.0, fluidity=3.0, yield_size=2e3, hardening=-1e3
)


@pytest.mark.parametrize("material", MATERIALS.values(), ids=lambda material: material.__name__)
def test_every_parameter_of_every_material_has_unit_and_meaning(material):
    for entry in dataclasses.fields(material):
        assert entry.metadata["unit"] and entry.metadata["meaning"], entry.name


def test_an_example_becomes_parameters_and_they_become_the_example():
    parameters = Parameter.of(CLAY)
    assert [p.name for p in parameters] == [entry.name for entry in dataclasses.fields(CLAY)]
    assert {p.name: p.default for p in parameters} == dataclasses.asdict(CLAY)
    values = assign([*parameters, *numerical_parameters({})], [])
    assert CLAY.with_parameters(namespace(values)) == CLAY


def test_what_is_set_arrives_and_the_rest_stays():
    parameters = Parameter.of(CLAY, "yield_size", "density")
    assert [p.name for p in parameters] == ["yield_size", "density"] and parameters[0].unit == "Pa"
    given = namespace(assign([*parameters, *numerical_parameters({})], ["yield_size=5e3"]))
    assert CLAY.with_parameters(given) == dataclasses.replace(CLAY, yield_size=5e3)


def test_bad_values_and_names_are_refused_in_one_line():
    with pytest.raises(SceneError, match=r"^density = -1.0 is not allowed: it must be a finite number above 0.0$"):
        CLAY.with_parameters(SimpleNamespace(density=-1.0))
    with pytest.raises(SceneError, match=r"^hardening = -30000000.0 .* above -20000000.0$"):
        CLAY.with_parameters(SimpleNamespace(hardening=-3e7))
    with pytest.raises(
        SceneError, match=r"^Parameter.of = 'yield' .* one of density, young_modulus, poisson_ratio$"
    ):
        Parameter.of(Elastic(young_modulus=1e6, density=1.0), "yield")
