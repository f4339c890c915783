"""Thousands of scenes with something wrong in them: each is refused at once, by a line that names the field."""

import contextlib
import math
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from warpsph import (
    BodyForce,
    Box,
    BreakdownError,
    Check,
    Disc,
    EdgeForce,
    Elastic,
    Fixed,
    Free,
    FreeSurface,
    Linear,
    NodeValue,
    Numerics,
    Output,
    PerzynaVonMises,
    Polygon,
    PrescribedVelocity,
    Probe,
    Pulse,
    Ramp,
    Roller,
    Rotating,
    Scene,
    SceneError,
    Simulation,
    Table,
    edge,
    region,
    where,
)
from warpsph.scene.document import decode, encode
from warpsph.simulation.time_step import time_step_limit

NAN, INF = math.nan, math.inf


def raises(*arguments):
    raise RuntimeError("several\nlines")


# Values of each kind that are wrong wherever they stand.
no_numbers = st.one_of(
    st.sampled_from(
        [NAN, INF, -INF, None, True, "1", "", b"1", 1j, 10**400, [1.0], (), {}, object(), len, np.eye(2)]
    ),
    st.text(max_size=3),
    st.lists(st.floats(), max_size=3),
)
negative = st.floats(max_value=-1e-300, allow_nan=False)
not_positive = st.one_of(no_numbers, negative, st.sampled_from([0, 0.0, -0.0, -1]))
below_zero = st.one_of(no_numbers, negative, st.just(-1))
no_vectors = st.one_of(
    st.sampled_from(
        [None, "ab", b"ab", {}, (), (1.0,), (1.0, 2.0, 3.0), (1.0, NAN), (INF, 1.0), (1.0, "x"), object(), 5.0]
    ),
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=6),
)
no_texts = st.sampled_from([None, 3, 1.5, True, b"name", ["name"], object()])
no_names = st.one_of(no_texts, st.text(max_size=8).filter(lambda text: text not in NAMES))
no_functions = st.sampled_from(
    [
        3,
        "f",
        (1.0, 2.0),
        {},
        lambda: 1.0,
        lambda x: x,
        lambda x, y: None,
        lambda x, y: (NAN, x),
        raises,
        lambda x, y: "ab",
    ]
)
no_time_functions = st.sampled_from(
    [
        "fast",
        (1.0,),
        NAN,
        INF,
        {},
        raises,
        lambda: 1.0,
        lambda t: "x",
        lambda t: NAN,
        lambda t: None,
        lambda t, u: 1.0,
    ]
)
no_truths = st.sampled_from(
    [
        lambda x, y: x,
        lambda x, y: x * 1j,
        lambda x, y: np.full_like(x, NAN),
        lambda x, y: np.flatnonzero(x < 9.0),
        lambda x, y: 1,
        lambda x, y: None,
        lambda x, y: x[:2] > 0.0,
    ]
)
nothing_of_ours = st.sampled_from([3, "Box", (), {}, Box, len, object(), lambda x, y: x, NAN])
NAMES = {
    "left",
    "right",
    "bottom",
    "top",
    "boundary",
    "gaussian",
    "cubic_spline",
    "wendland_c2",
    "rk4",
    "analytic",
}
NAMES |= {"cells", "taylor", "blanc-pastor", "improved", "marrone"}

ELASTIC = {"young_modulus": 1e5, "poisson_ratio": 0.3, "density": 2000.0}
SOIL = {**ELASTIC, "fluidity": 2.0, "yield_size": 200.0, "exponent": 1.0, "hardening": -1e3, "residual_ratio": 0.1}
PLATE = Box((1.0, 0.5), 0.25)


def part(kind, right, name):
    """A builder of a part that is right but for one argument."""
    return lambda value: kind(**{**right, name: value})


SUMS = Numerics(velocity_scheme="taylor")


def in_scene(name, build=lambda value: value, numerics=SUMS):
    """A builder of a scene that is right but for one argument, made by `build`."""
    right = {
        "shape": PLATE,
        "material": Elastic(**ELASTIC),
        "duration": 1.0,
        "conditions": [Fixed(edge("bottom"))],
        "numerics": numerics,
    }
    return lambda value: Scene(**{**right, name: build(value)})


def material(name):
    return part(PerzynaVonMises, SOIL, name)


def condition(build):
    return in_scene("conditions", lambda value: [build(value)])


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
BAR = Box((8.0, 0.5), 0.25)
CHECK = {"name": "load", "value": 1.0, "reference": 1.0, "unit": "N", "bound": 0.1}


def _crosses(square):
    """Whether the corners of the square stand in an order in which two sides cross: some side is a diagonal."""
    return any(a[0] != b[0] and a[1] != b[1] for a, b in zip(square, [*square[1:], square[0]], strict=True))


def _bent(x, y, turns):
    angle = 2.0 * math.pi * turns / 8.0 * x
    return (3.0 - y) * np.cos(angle), (3.0 - y) * np.sin(angle)


# What is built, with which wrong values, and the fields that the message may name.
WRONG = {
    "size": (
        part(Box, {"spacing": 0.25}, "size"),
        st.one_of(no_vectors.filter(lambda v: v != 5.0 and _no_size(v))),
        {"size", "spacing"},
    ),
    "spacing": (
        part(Box, {"size": (1.0, 1.0)}, "spacing"),
        st.one_of(not_positive, st.sampled_from([0.3, 0.7, 1e-9, 1e300])),
        {"spacing"},
    ),
    "origin": (
        part(Box, {"size": (1.0, 1.0), "spacing": 0.5}, "origin"),
        no_vectors.filter(lambda v: v is not None),
        {"origin"},
    ),
    "radius": (part(Disc, {"spacing": 0.1}, "radius"), not_positive, {"radius"}),
    "disc spacing": (
        part(Disc, {"radius": 1.0}, "spacing"),
        st.one_of(not_positive, st.floats(1.01, 1e9)),
        {"spacing"},
    ),
    "vertices": (
        part(Polygon, {"spacing": 0.1}, "vertices"),
        st.one_of(no_vectors, nothing_of_ours, st.just([(0, 0), (1, 1)])),
        {"vertices"},
    ),
    "crossing vertices": (
        part(Polygon, {"spacing": 0.1}, "vertices"),
        st.permutations([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]).filter(_crosses),
        {"vertices"},
    ),
    "repeated vertices": (
        part(Polygon, {"spacing": 0.1}, "vertices"),
        st.integers(0, 3).map(lambda k: [*SQUARE[: k + 1], *SQUARE[k:]]),
        {"vertices"},
    ),
    "polygon spacing": (
        part(Polygon, {"vertices": SQUARE}, "spacing"),
        st.one_of(not_positive, st.floats(0.501, 0.999), st.floats(1.001, 1e9), st.sampled_from([0.3, 0.15, 0.7])),
        {"spacing"},
    ),
    "thin": (
        in_scene("shape", lambda v: Box((1.0, v, 1.0), v), Numerics()),
        st.sampled_from([0.5, 0.25, 0.125]),
        {"spacing"},
    ),
    "overlap": (
        lambda turns: BAR.mapped(lambda x, y: _bent(x, y, turns)).mesh(),
        st.floats(1.0, 3.0),
        {"mapped.function"},
    ),
    "mapped": (
        in_scene("shape", PLATE.mapped),
        st.one_of(no_functions, st.just(lambda x, y: (-x, y))),
        {"mapped.function"},
    ),
    "rotated": (PLATE.rotated, no_numbers, {"rotated.angle"}),
    "shape": (in_scene("shape"), nothing_of_ours, {"shape"}),
    "material": (in_scene("material"), nothing_of_ours, {"material"}),
    "young_modulus": (material("young_modulus"), not_positive, {"young_modulus"}),
    "density": (material("density"), not_positive, {"density"}),
    "poisson_ratio": (
        material("poisson_ratio"),
        st.one_of(no_numbers, st.floats(0.5, 1e9), st.floats(-1e9, -1.0)),
        {"poisson_ratio"},
    ),
    "fluidity": (material("fluidity"), below_zero, {"fluidity"}),
    "yield_size": (material("yield_size"), not_positive, {"yield_size"}),
    "exponent": (material("exponent"), st.one_of(no_numbers, st.floats(-10.0, 0.9999)), {"exponent"}),
    "hardening": (material("hardening"), st.one_of(no_numbers, st.floats(-1e9, -1e5)), {"hardening"}),
    "residual_ratio": (
        material("residual_ratio"),
        st.one_of(not_positive, st.floats(1.0001, 1e9)),
        {"residual_ratio"},
    ),
    "duration": (in_scene("duration"), not_positive, {"duration"}),
    "damping": (in_scene("damping"), below_zero, {"damping"}),
    "velocity": (in_scene("velocity"), no_functions, {"velocity"}),
    "stress": (in_scene("stress"), no_functions, {"stress"}),
    "large_displacements": (
        in_scene("large_displacements"),
        st.sampled_from([0, 1, None, "yes", [], 1.0]),
        {"large_displacements"},
    ),
    "numerics": (in_scene("numerics"), nothing_of_ours, {"numerics"}),
    "output": (in_scene("output"), nothing_of_ours, {"output"}),
    "name": (in_scene("name"), no_texts, {"name"}),
    "conditions": (
        in_scene("conditions"),
        st.sampled_from([3, Fixed(edge("left")), [3], [edge("left")], "ab", None, [None], [Fixed]]),
        {"conditions", "conditions[0]"},
    ),
    "free_surface": (in_scene("free_surface"), nothing_of_ours.filter(lambda v: v is not None), {"free_surface"}),
    "body_force": (in_scene("body_force"), nothing_of_ours, {"body_force"}),
    "acceleration": (in_scene("body_force", BodyForce), no_vectors, {"BodyForce.acceleration"}),
    "factor": (part(BodyForce, {"acceleration": (0.0, 1.0)}, "factor"), no_time_functions, {"BodyForce.factor"}),
    "kernel": (
        part(Numerics, {"velocity_scheme": "taylor"}, "kernel"),
        no_names.filter(lambda v: v is not None),
        {"kernel"},
    ),
    "velocity_scheme": (part(Numerics, {}, "velocity_scheme"), no_names, {"velocity_scheme"}),
    "source_scheme": (part(Numerics, {"velocity_scheme": "taylor"}, "source_scheme"), no_names, {"source_scheme"}),
    "smoothing_ratio": (
        in_scene("numerics", lambda v: Numerics(velocity_scheme="taylor", smoothing_ratio=v)),
        st.one_of(not_positive.filter(lambda v: v is not None), st.floats(0.01, 0.5), st.floats(2.1, 1e9)),
        {"smoothing_ratio"},
    ),
    "courant": (
        lambda v: time_step_limit(in_scene("numerics", lambda c: Numerics(courant=c))(v)),
        st.one_of(not_positive, st.floats(2.0, 1e300)),
        {"courant"},
    ),
    "time_step": (
        lambda v: time_step_limit(in_scene("numerics", lambda c: Numerics(time_step=c))(v)),
        st.one_of(not_positive.filter(lambda v: v is not None), st.floats(1.0, 1e300)),
        {"time_step"},
    ),
    "scan_ratio": (
        in_scene("free_surface", lambda v: FreeSurface(scan_ratio=v)),
        st.one_of(not_positive, st.floats(1e-9, 0.9), st.floats(2.1, 1e9)),
        {"FreeSurface.scan_ratio"},
    ),
    "normals": (part(FreeSurface, {}, "normals"), no_names, {"FreeSurface.normals"}),
    "edge": (condition(lambda v: Fixed(edge(v))), no_names, {"edge"}),
    "where": (condition(lambda v: Fixed(where(v))), no_functions, {"where", "conditions[0]"}),
    "no truths": (condition(lambda v: Fixed(where(v))), no_truths, {"where"}),
    "words": (
        lambda v: v(edge("left"), edge("top")),
        st.sampled_from([lambda a, b: a and b, lambda a, b: a or b, lambda a, b: not a]),
        {"selection"},
    ),
    "region": (
        condition(lambda v: Fixed(region((0.0, 0.0), v))),
        st.one_of(no_vectors, st.just((-1.0, -1.0))),
        {"region.upper", "region.lower", "conditions[0]"},
    ),
    "on": (condition(Fixed), nothing_of_ours, {"Fixed.on"}),
    "free on": (condition(Free), nothing_of_ours, {"Free.on"}),
    "interior": (condition(lambda v: Roller(region(v, v))), st.just((0.25, 0.25)), {"conditions[0]"}),
    "normal": (
        condition(lambda v: Roller(edge("left"), v)),
        st.one_of(no_vectors.filter(lambda v: v is not None), st.just((0.0, 0.0))),
        {"Roller.normal"},
    ),
    "prescribed": (
        condition(lambda v: PrescribedVelocity(edge("left"), (None, v))),
        no_time_functions,
        {"PrescribedVelocity.velocity"},
    ),
    "components": (
        condition(lambda v: PrescribedVelocity(edge("left"), v)),
        st.sampled_from([3, None, (), (1.0,), (None, None), (1.0,) * 3, "ab"]),
        {"PrescribedVelocity.velocity"},
    ),
    "rate": (condition(lambda v: Rotating(edge("left"), v)), no_numbers, {"Rotating.angular_velocity"}),
    "centre": (condition(lambda v: Rotating(edge("left"), 1.0, v)), no_vectors, {"Rotating.centre"}),
    "Linear": (Linear, no_numbers, {"Linear.rate"}),
    "Ramp": (Ramp, not_positive, {"Ramp.duration"}),
    "Pulse": (part(Pulse, {"value": 1.0}, "duration"), not_positive, {"Pulse.duration"}),
    "Table": (
        part(Table, {"values": (1.0, 2.0)}, "times"),
        st.sampled_from([(0.0,), (1.0, 0.0), (0.0, NAN), 3, None, "ab", (0.0, 1.0, 2.0)]),
        {"Table.times"},
    ),
    "Probe": (
        part(Probe, {"name": "a", "unit": "m"}, "function"),
        st.sampled_from([3, None, "f", (), {}]),
        {"Probe.function"},
    ),
    "near": (
        part(NodeValue, {"field": "velocity"}, "near"),
        st.sampled_from([None, "ab", (), (NAN,), (1.0,) * 4, {}]),
        {"NodeValue.near"},
    ),
    "near the body": (
        in_scene("output", lambda v: Output(probes=(Probe("a", "m", NodeValue("velocity", v)),))),
        st.tuples(st.floats(2.0, 1e6), st.floats(-1e6, 1e6)),
        {"NodeValue.near"},
    ),
    "force on": (
        in_scene("output", lambda v: Output(probes=(Probe("a", "N", EdgeForce(v, 0)),))),
        st.one_of(
            nothing_of_ours, st.sampled_from([region((0.1, 0.1), (0.4, 0.4)), region((2.0, 2.0), (3.0, 3.0))])
        ),
        {"EdgeForce.on"},
    ),
    "force axis": (
        in_scene("output", lambda v: Output(probes=(Probe("a", "N", EdgeForce(edge("top"), v)),))),
        st.sampled_from([-1, 2, 3, 0.5, None, "x", True]),
        {"EdgeForce.axis"},
    ),
    "long interval": (
        in_scene("output", lambda v: Output(interval=v)),
        st.floats(1.001, 1e300),
        {"Output.interval"},
    ),
    "check value": (
        part(Check, CHECK, "value"),
        st.sampled_from([None, 1j, "1", [1.0], (), np.ones(2)]),
        {"Check.value"},
    ),
    "check reference": (
        part(Check, CHECK, "reference"),
        st.sampled_from([None, 1j, "1", [1.0], 0.0]),
        {"Check.reference"},
    ),
    "check bound": (part(Check, CHECK, "bound"), below_zero, {"Check.bound"}),
    "check name": (part(Check, CHECK, "name"), no_texts, {"Check.name"}),
    "interval": (part(Output, {}, "interval"), below_zero.filter(lambda v: v is not None), {"Output.interval"}),
    "probes": (
        part(Output, {}, "probes"),
        st.sampled_from([3, None, [3], [len], Probe("a", "m", len), [Probe("time", "s", len)]]),
        {"Output.probes"},
    ),
    "component": (
        part(Output, {}, "component"),
        st.sampled_from([-1, 0.5, True, None, "x"]),
        {"Output.component"},
    ),
}


def _no_size(value):
    """One to three lengths, each a whole number of spacings, are a size: chance may find [1.0, 1.0, 1.0]."""
    if not isinstance(value, tuple | list) or not 1 <= len(value) <= 3:
        return True
    return not all(isinstance(part, float) and part > 0.0 and part % 0.25 == 0.0 for part in value)


def check_refusal(name, value):
    build, _, fields = WRONG[name]
    begin = time.perf_counter()
    with pytest.raises(SceneError) as caught:
        build(value)
    assert time.perf_counter() - begin < 1.0
    message = str(caught.value)
    assert "\n" not in message and len(message) < 1000
    assert caught.value.field in fields and message.startswith(f"{caught.value.field} = "), message
    assert " is not allowed: " in message


def wrong():
    """A name and a wrong value of it; every name is as likely as any other."""
    return st.sampled_from(list(WRONG)).flatmap(lambda name: st.tuples(st.just(name), WRONG[name][1]))


OPTIONS = {"deadline": 1000, "suppress_health_check": list(HealthCheck), "database": None}


@settings(max_examples=1000, **OPTIONS)
@given(wrong())
def test_a_thousand_wrong_scenes_are_refused(case):
    check_refusal(*case)


@pytest.mark.long
@settings(max_examples=10_000, **OPTIONS)
@given(wrong())
def test_ten_thousand_wrong_scenes_are_refused(case):
    check_refusal(*case)


def document():
    """A scene as data with every kind of part in it."""
    return encode(
        Scene(
            shape=PLATE,
            material=PerzynaVonMises(**SOIL),
            conditions=[
                Fixed(edge("bottom")),
                Roller(edge("left") & region((0.0, 0.1), (0.1, 0.3))),
                PrescribedVelocity(edge("top"), (None, Table((0.0, 1.0), (0.0, 1.0)))),
            ],
            free_surface=FreeSurface(),
            numerics=Numerics(velocity_scheme="taylor"),
            body_force=BodyForce((0.0, -9.81), Ramp(0.5)),
            velocity=lambda x, y: (0.0, 0.01),
            duration=1.0,
            output=Output(probes=(Probe("v", "m/s", NodeValue("velocity", (1.0, 0.5), 1)),), curve=("time", "v")),
        )
    )[0]


def places(part, path=()):
    """Every place in a document."""
    inner = part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ()
    for key, value in inner:
        yield (*path, key)
        yield from places(value, (*path, key))


PLACES = list(places(document()))
ANYTHING = st.one_of(
    st.sampled_from(
        [NAN, INF, 0, -1, 1, 2, 0.5, True, "", "left", "free", "Box", [], {}, [[]], [1.0, 2.0], "Table"]
    ),
    st.sampled_from([{"type": "Box"}, {"type": "Elastic"}, {"code": "shape"}, {"values": "v"}, {"type": ["Box"]}]),
    st.sampled_from([{"type": "edge", "name": 3}, {"type": "Linear", "rate": 0.1}, {"values": []}, {"code": 3}]),
    st.floats(-10.0, 10.0),
    st.text(max_size=3),
)
KEYS = st.sampled_from(["more", "0", "", "a.b", "type", "values", "code"])


@settings(max_examples=400, **{**OPTIONS, "deadline": None})
@example(("duration",), {}, "add", "0")
@given(st.sampled_from(PLACES), ANYTHING, st.sampled_from(["replace", "remove", "add"]), KEYS)
def test_document_with_something_wrong_is_refused_in_one_line_or_runs(place, value, change, key):
    """What is accepted is a scene: it is built, compiled and stepped."""
    found = document()
    *way, last = place
    part = found
    for key in way:
        part = part[key]
    if change == "remove":
        del part[last]
    elif change == "add" and isinstance(part, dict):
        part[key] = value
    else:
        part[last] = value
    begin = time.perf_counter()
    try:
        scene = decode(found)
        limit = time_step_limit(scene)
    except SceneError as error:
        assert "\n" not in str(error) and str(error).startswith(f"{error.field} = ")
        assert time.perf_counter() - begin < 1.0
        return
    simulation = Simulation(scene, device="cpu")
    with contextlib.suppress(BreakdownError):  # some are pulled apart within a step
        simulation.run(until=min(3.0 * limit, scene.duration))
        assert all(np.isfinite(simulation.field(name)).all() for name in ("velocity", "stress"))
