"""What was taken without a word and made something else of: each is refused in one line that names the field."""

import math

import numpy as np
import pytest

from warpsph import (
    BodyForce,
    Box,
    Check,
    EdgeForce,
    Elastic,
    Fixed,
    NodeValue,
    Output,
    PrescribedVelocity,
    Probe,
    Scene,
    SceneError,
    Simulation,
    edge,
    region,
    where,
)
from warpsph.mesh.overlap import overlap
from warpsph.simulation.history import History


def plate(**changes):
    right = {"shape": Box((1.0, 0.5), 0.25), "material": Elastic(young_modulus=1e5, density=1e3), "duration": 0.1}
    return Scene(**{**right, **changes})


def refused(build, field, *said):
    with pytest.raises(SceneError) as caught:
        build()
    message = str(caught.value)
    assert caught.value.field == field and "\n" not in message and len(message) < 400, message
    for text in said:
        assert text in message


# ---------------------------------------------------------------------------------------------------------
# Mappings
# ---------------------------------------------------------------------------------------------------------


def ring(angle, *depth):
    """A bar bent about the origin, its inner radius 2 m and its outer one 3 m."""
    return Box((8.0, 1.0, *depth), 0.25).mapped(
        lambda x, y, *z: ((3.0 - y) * np.cos(angle / 8.0 * x), (3.0 - y) * np.sin(angle / 8.0 * x), *z)
    )


def helix(pitch):
    """A bar 1 m square wound about the z axis one turn and a quarter."""
    return Box((8.0, 1.0, 1.0), 0.25).mapped(
        lambda x, y, z: ((3.0 - y) * np.cos(x), (3.0 - y) * np.sin(x), z + pitch * x / (2.0 * math.pi))
    )


@pytest.mark.parametrize("depth", [(), (0.5,)])
@pytest.mark.parametrize(
    ("angle", "whole"), [(3.0, True), (6.1, True), (2.0 * math.pi, False), (6.5, False), (9.0, False)]
)
def test_ring_that_closes_on_itself_is_refused(angle, whole, depth):
    """A whole turn lays one end on the other; more lays the body on itself, though no cell is turned over."""
    if whole:
        assert (ring(angle, *depth).mesh().cell_volumes() > 0.0).all()
    else:
        refused(ring(angle, *depth).mesh, "mapped.function", "must not lay the body on itself")


@pytest.mark.parametrize(("pitch", "whole"), [(1.3, True), (0.9, False), (0.2, False)])
def test_helix_whose_turns_lie_on_each_other_is_refused(pitch, whole):
    if whole:
        helix(pitch).mesh()
    else:
        refused(helix(pitch).mesh, "mapped.function", "must not lay the body on itself")


def test_overlap_is_where_the_boundary_meets_itself():
    """A strip one cell wide that turns by 3/4 of a circle and runs through its own start, node beside node."""
    x = np.linspace(0.0, 1.0, 41)[:, None]
    start = np.hstack([6.0 * x, 0.0 * x])
    angle = -0.5 * math.pi + 1.5 * math.pi * x[1:]
    bend = np.hstack([6.0 + 2.0 * np.cos(angle), 2.0 + 2.0 * np.sin(angle)])
    back = np.hstack([4.0 + 0.0 * x[1:], 2.0 - 4.0 * x[1:] + 0.013])
    line = np.concatenate([start, bend, back])
    along = np.gradient(line, axis=0)
    left = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    strip = Box((float(len(line) - 1), 1.0), 1.0).mesh()
    rows = np.rint(strip.nodes).astype(int)
    placed = strip.with_nodes(line[rows[:, 0]] + 0.1 * rows[:, 1:] * left[rows[:, 0]])
    assert (placed.cell_volumes() > 0.0).all()
    assert np.allclose(overlap(placed), (4.0, 0.05), atol=0.2)


@pytest.mark.parametrize("size", [(1.0,), (2.0, 1.0), (1.0, 0.5, 0.5)])
def test_body_as_it_is_does_not_meet_itself(size):
    mesh = Box(size, 0.125).mesh()
    assert overlap(mesh) is None
    skew = np.eye(mesh.dim) + 0.4 * np.triu(np.ones((mesh.dim, mesh.dim)), 1)
    assert overlap(mesh.with_nodes(mesh.nodes @ skew)) is None


# ---------------------------------------------------------------------------------------------------------
# Selections
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("function", "kind"),
    [
        (lambda x, y: x, "float64"),
        (lambda x, y: np.sqrt(x - 0.3 + 0j), "complex128"),
        (lambda x, y: np.full_like(x, np.nan), "float64"),
        (lambda x, y: np.flatnonzero(x < 2.0), "int64"),
        (lambda x, y: 1, "int64"),
        (lambda x, y: np.array(["a"] * len(x)), "str"),
        (lambda x, y: [None] * len(x), "object"),
    ],
)
def test_where_takes_truths_only(function, kind):
    refused(lambda: plate(conditions=[Fixed(where(function))]), "where", "True or False", kind)


@pytest.mark.parametrize("value", [True, np.True_])
def test_where_takes_one_truth_for_all(value):
    mesh = plate().mesh
    assert where(lambda x, y: value).nodes(mesh).all() and where(lambda x, y: x >= 0.5).nodes(mesh).sum() == 9


@pytest.mark.parametrize(
    "combine",
    [
        lambda: edge("left") and edge("top"),
        lambda: edge("left") or edge("top"),
        lambda: not edge("left"),
        lambda: Fixed(edge("left") if edge("top") else edge("right")),
    ],
)
def test_selections_do_not_combine_by_words(combine):
    """`edge("left") or edge("top")` was the left edge alone."""
    refused(combine, "selection", "&, | and ~")


# ---------------------------------------------------------------------------------------------------------
# Fields and functions of time
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("field", ["velocity", "stress"])
@pytest.mark.parametrize("part", [lambda x: x + 1j, lambda x: x > 0.5, lambda x: x.astype(str)])
def test_initial_fields_are_real_numbers(field, part):
    size = {"velocity": 2, "stress": 4}[field]
    refused(lambda: plate(**{field: lambda x, y: (part(x), *(0.0,) * (size - 1))}), field, "finite number(s)")


@pytest.mark.parametrize(
    ("later", "said"),
    [
        (lambda: None, "not None"),
        (lambda: math.nan, "not nan"),
        (lambda: 1j, "not 1j"),
        (lambda: np.array([1.0]), "not array([1.])"),
        (lambda: 1 / 0, "it raised ZeroDivisionError: division by zero"),
    ],
)
@pytest.mark.parametrize("field", ["BodyForce.factor", "PrescribedVelocity.velocity"])
def test_function_of_time_that_fails_later_is_named_with_the_time(field, later, said):
    def f(t):
        return later() if t > 0.05 else 1.0

    if field == "BodyForce.factor":
        scene = plate(body_force=BodyForce((0.0, -1.0), f))
    else:
        scene = plate(conditions=[PrescribedVelocity(edge("left"), (f, None))])
    simulation = Simulation(scene, device="cpu")
    refused(simulation.run, field, "f(0.05", "must return a finite number", said)
    assert simulation.time <= 0.05 and np.isfinite(simulation.field("velocity")).all()


# ---------------------------------------------------------------------------------------------------------
# Output
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("function", "field", "said"),
    [
        (NodeValue("velocity", (3.0, 0.0)), "NodeValue.near", "the nearest node, at (1.0, 0.0), is 2 m away"),
        (NodeValue("velocity", (0.5,)), "NodeValue.near", "2 finite numbers"),
        (EdgeForce(edge("top"), 2), "EdgeForce.axis", "below 2"),
        (EdgeForce(region((2.0, 2.0), (3.0, 3.0)), 1), "EdgeForce.on", "at least one boundary face"),
    ],
)
def test_probe_that_does_not_fit_the_body_is_refused_with_the_scene(function, field, said):
    refused(lambda: plate(output=Output(probes=(Probe("p", "m", function),))), field, said)


@pytest.mark.parametrize("near", [(0.5, 0.25), (0.0, 0.0), (1.0, 0.6), (-0.3, -0.1)])
def test_probe_in_the_body_or_a_cell_beside_it_is_taken(near):
    plate(output=Output(probes=(Probe("p", "m", NodeValue("velocity", near)),)))


@pytest.mark.parametrize(
    ("value", "said"),
    [(None, "None"), (1j, "1j"), (np.ones(2), "array([1., 1.])"), ("a", "'a'"), ([1.0], "[1.0]")],
)
def test_probe_gives_a_real_number(value, said):
    scene = plate(output=Output(probes=(Probe("p", "m", lambda s: value),)))
    refused(lambda: History(Simulation(scene, device="cpu")), "Output.probes", "t = 0 s", said)


@pytest.mark.parametrize("value", [1, 2.5, True, np.float32(3.0), np.int64(4), np.True_, math.nan])
def test_probe_gives_numbers_of_any_kind(value):
    scene = plate(output=Output(probes=(Probe("p", "m", lambda s: value),)))
    assert np.array_equal(History(Simulation(scene, device="cpu"))["p"], [float(value)], equal_nan=True)


def test_interval_longer_than_the_run_is_refused():
    refused(lambda: plate(output=Output(interval=0.2)), "Output.interval", "at most 0.1")
    plate(output=Output(interval=0.1))


@pytest.mark.parametrize("field", ["name", "unit"])
def test_check_has_a_name_and_a_unit(field):
    right = {"name": "load", "value": 1.0, "reference": 1.0, "unit": "N", "bound": 0.1}
    refused(lambda: Check(**{**right, field: 3}), f"Check.{field}", "a text")
