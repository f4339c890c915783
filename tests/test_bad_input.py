"""Every wrong field is refused in one line that names the field, its value and what is allowed."""

import math
import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from warpsph import (
    BodyForce,
    Box,
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
    Parameter,
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
from warpsph.scene import KERNELS
from warpsph.scene.scheme import SCHEMES
from warpsph.simulation.time_step import courant_limit, time_step_limit

NAN, INF = math.nan, math.inf
NO_NUMBERS = [NAN, INF, -INF, "0.1", True, None, [0.1], 1j, np.complex128(1.0), 10**400, np.array([0.1])]
ELASTIC = {"young_modulus": 1e5, "poisson_ratio": 0.3, "density": 2000.0}
PERZYNA = {
    **ELASTIC,
    "fluidity": 2.0,
    "yield_size": 200.0,
    "exponent": 1.0,
    "hardening": -1e3,
    "residual_ratio": 0.1,
}
PLATE = Box((1.0, 0.5), 0.25)
CORNER = region((0.0, 0.0), (0.1, 0.1))


def scene(**changed):
    return Scene(**{"shape": PLATE, "material": Elastic(**ELASTIC), "duration": 1.0, **changed})


def dented(x, y):
    """The node in the middle of four cells is pushed into the first, which keeps a volume but no shape."""
    inner = (x == 0.2) & (y == 0.2)
    return np.where(inner, 0.06, x), np.where(inner, 0.06, y)


def refused(build, field, value, allowed):
    """Assert that a build raises one line "field = value is not allowed: … allowed …"."""
    with pytest.raises(SceneError) as caught:
        build()
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{field} = {value}" if value is not None else f"{field} = "), message
    assert " is not allowed: " in message
    assert re.search(allowed, message.split(" is not allowed: ", 1)[1]), message


def short(value):
    """A value as messages show it; long ones are cut."""
    return repr(value)[:100]


# Numbers: the name of each field, a builder, values out of range, and what the message allows.
NUMBERS = {
    "spacing": (lambda v: Box((1.0, 1.0), v), (0.0, -0.1), "above 0"),
    "young_modulus": (lambda v: Elastic(**{**ELASTIC, "young_modulus": v}), (0.0, -1.0), "above 0"),
    "density": (lambda v: Elastic(**{**ELASTIC, "density": v}), (0.0, -1.0), "above 0"),
    "poisson_ratio": (
        lambda v: Elastic(**{**ELASTIC, "poisson_ratio": v}),
        (0.5, 0.7, -1.0, -3.0),
        "above -1.*below 0.5",
    ),
    "fluidity": (lambda v: PerzynaVonMises(**{**PERZYNA, "fluidity": v}), (-1e-9,), "at least 0"),
    "yield_size": (lambda v: PerzynaVonMises(**{**PERZYNA, "yield_size": v}), (0.0, -1.0), "above 0"),
    "exponent": (lambda v: PerzynaVonMises(**{**PERZYNA, "exponent": v}), (0.999, 0.0), "at least 1"),
    "hardening": (lambda v: PerzynaVonMises(**{**PERZYNA, "hardening": v}), (-1e5, -2e5), "above -100000"),
    "residual_ratio": (
        lambda v: PerzynaVonMises(**{**PERZYNA, "residual_ratio": v}),
        (0.0, 1.01),
        "above 0.*at most 1",
    ),
    "courant": (lambda v: Numerics(courant=v), (0.0, -0.5), "above 0"),
    "duration": (lambda v: scene(duration=v), (0.0, -1.0), "above 0"),
    "damping": (lambda v: scene(damping=v), (-1.0,), "at least 0"),
    "radius": (lambda v: Disc(v, 0.1), (0.0, -1.0), "above 0"),
    "rotated.angle": (lambda v: PLATE.rotated(v), (), "finite number"),
    "Linear.rate": (Linear, (), "finite number"),
    "Ramp.duration": (Ramp, (0.0, -1.0), "above 0"),
    "Ramp.value": (lambda v: Ramp(1.0, v), (), "finite number"),
    "Pulse.value": (lambda v: Pulse(v, 1.0), (), "finite number"),
    "Pulse.duration": (lambda v: Pulse(1.0, v), (0.0,), "above 0"),
    "Table.times": (lambda v: Table((0.0, v), (1.0, 2.0)), (), "finite number"),
    "Table.values": (lambda v: Table((0.0, 1.0), (1.0, v)), (), "finite number"),
    "Rotating.angular_velocity": (lambda v: Rotating(edge("left"), v), (), "finite number"),
    "BodyForce.factor": (lambda v: BodyForce((0.0, 1.0), v), (), "finite number"),
    "Check.bound": (lambda v: Check("c", 1.0, 1.0, "-", v), (-0.1,), "at least 0"),
}
OPTIONAL_NUMBERS = {
    "smoothing_ratio": (lambda v: Numerics(velocity_scheme="taylor", smoothing_ratio=v), (0.0, -0.6), "above 0"),
    "time_step": (lambda v: Numerics(time_step=v), (0.0, -1e-3), "above 0"),
    "Output.interval": (lambda v: Output(interval=v), (-1e-3,), "at least 0"),
}


@pytest.mark.parametrize(
    ("field", "build", "value", "allowed"),
    [
        (field, build, value, allowed)
        for field, (build, out, allowed) in NUMBERS.items()
        for value in [*out, *NO_NUMBERS]
    ]
    + [
        (field, build, value, allowed)
        for field, (build, out, allowed) in OPTIONAL_NUMBERS.items()
        for value in [*out, *(v for v in NO_NUMBERS if v is not None)]
    ],
)
def test_number_out_of_range_is_refused(field, build, value, allowed):
    refused(lambda: build(value), field, short(value), allowed)


@pytest.mark.parametrize("value", [1, np.float32(0.25), np.int64(1), np.float64(0.5)])
def test_every_real_number_is_accepted(value):
    assert Box((1.0, 1.0), value).spacing == float(value)


def test_bounds_that_belong_to_the_range_are_accepted():
    assert PerzynaVonMises(**{**PERZYNA, "fluidity": 0, "residual_ratio": 1, "exponent": 1}).residual_ratio == 1.0
    assert Elastic(**{**ELASTIC, "poisson_ratio": 0.4999}).poisson_ratio == 0.4999


# Builder, field, how its value begins in the message (None: whatever it is), what is allowed.
SHAPES = [
    (lambda: Box((1.0, 0.5), 0.3), "spacing", 0.3, r"size 1 m .* whole number of spacings, for example 0\.333333"),
    (lambda: Box((0.1,), 0.3), "spacing", 0.3, r"for example 0\.1"),
    (lambda: Box((1.0, -1.0), 0.1), "size", -1.0, "above 0"),
    (lambda: Box((), 0.1), "size", "()", "1, 2 or 3 finite numbers"),
    (lambda: Box((1.0,) * 4, 0.1), "size", "(1.0, 1.0, 1.0, 1.0)", "1, 2 or 3 finite numbers"),
    (lambda: Box("ab", 0.1), "size", "'ab'", "finite numbers"),
    (lambda: Box(b"ab", 0.1), "size", "b'ab'", "finite numbers"),
    (lambda: Box((1.0, "x"), 0.1), "size", "(1.0, 'x')", "finite numbers"),
    (lambda: Box((1.0, 1.0), 0.1, origin=(0.0,)), "origin", "(0.0,)", "2 finite numbers"),
    (lambda: Box((1e300,), 1e-300), "spacing", 1e-300, "fewer than 1e[+]09 cells"),
    (lambda: Box((1e4,) * 3, 1.0), "spacing", 1.0, "fewer than 1e[+]09 cells, here 1e[+]12"),
    (lambda: Disc(0.1, 0.2), "spacing", 0.2, "at most 0.1"),
    (lambda: Disc(1.0, 0.1, centre=(0.0,)), "centre", "(0.0,)", "2 finite numbers"),
    (lambda: Polygon([(0, 0), (1, 1)], 0.1), "vertices", "[(0, 0), (1, 1)]", "three or more"),
    (lambda: Polygon([(0, 0), (1, 1), (1,)], 0.1), "vertices", "(1,)", "2 finite numbers"),
    (lambda: Polygon(3, 0.1), "vertices", 3, "three or more"),
    (lambda: Polygon([(0, 0), (1e12, 0), (2e12, 0)], 1.0), "spacing", 1.0, "fewer than"),
    (lambda: scene(shape=Polygon([(0, 0), (1, 0), (0, 1)], 1.0)), "spacing", 1.0, "it must be finer"),
    (lambda: scene(shape="Box"), "shape", "'Box'", "a shape such as Box"),
    (lambda: scene(shape=Box), "shape", None, "a shape such as Box"),
    (lambda: PLATE.rotated(0.1, about=(1.0,)), "rotated.about", "(1.0,)", "2 finite numbers"),
    (lambda: PLATE.mapped(3), "mapped.function", 3, "a function of position"),
    (lambda: scene(shape=PLATE.mapped(lambda x, y: ((x - 0.6) ** 2, y))), "mapped.function", None, "no folds"),
    (lambda: scene(shape=PLATE.mapped(lambda x, y: (-x, y))), "mapped.function", None, "volume positive"),
    (lambda: scene(shape=Box((0.4, 0.4), 0.2).mapped(dented)), "mapped.function", None, "at each corner"),
    (lambda: scene(shape=PLATE.mapped(lambda x, y: x)), "mapped.function", None, "must return 2 finite"),
    (lambda: scene(shape=PLATE.mapped(lambda x, y: (NAN * x, y))), "mapped.function", None, "2 finite"),
]
PARTS = [
    (lambda: scene(material=ELASTIC), "material", None, r"a material such as Elastic"),
    (lambda: scene(numerics="rk4"), "numerics", "'rk4'", r"Numerics\(…\)"),
    (lambda: scene(output=None), "output", None, r"Output\(…\)"),
    (lambda: scene(name=3), "name", 3, "a string"),
    (lambda: scene(large_displacements=1), "large_displacements", 1, "True or False"),
    (lambda: scene(body_force=(0.0, -9.81)), "body_force", "(0.0, -9.81)", r"BodyForce\(…\) or None"),
    (lambda: scene(body_force=BodyForce((0.0,))), "BodyForce.acceleration", "(0.0,)", "2 finite"),
    (lambda: BodyForce("gravity"), "BodyForce.acceleration", "'gravity'", "finite numbers"),
    (
        lambda: BodyForce((0.0, 1.0), lambda t: "x"),
        "BodyForce.factor",
        None,
        r"f\(0\.0\) must return a finite number",
    ),
    (lambda: BodyForce((0.0, 1.0), lambda: 1.0), "BodyForce.factor", None, r"f\(0\.0\) must return a finite"),
    (lambda: Table((0.0, 0.0), (1.0, 2.0)), "Table.times", "(0.0, 0.0)", "it must rise"),
    (lambda: Table((0.0, 1.0), (1.0,)), "Table.times", "(0.0, 1.0)", "as many values as times"),
    (lambda: Table(1.0, 2.0), "Table.times", 1.0, "a sequence of numbers"),
]
NAMES = [
    (
        lambda: Numerics(velocity_scheme="taylor", kernel="gausian"),
        "kernel",
        "'gausian'",
        r"one of gaussian.*did you mean gaussian\?",
    ),
    (lambda: Numerics(velocity_scheme="taylor", kernel=["gaussian"]), "kernel", "['gaussian']", "one of gaussian"),
    (
        lambda: Numerics(kernel="gaussian"),
        "kernel",
        "'gaussian'",
        "cells takes no sums over neighbours; leave it out",
    ),
    (lambda: Numerics(smoothing_ratio=0.6), "smoothing_ratio", 0.6, "cells takes no sums over neighbours"),
    (lambda: Numerics(sharpening=0.8), "sharpening", 0.8, "at least 0.0 and at most 0.7"),
    (lambda: Numerics(velocity_scheme="taylor", sharpening=0.0), "sharpening", 0.0, "taylor knows none"),
    (lambda: Numerics(source_scheme="rk4"), "source_scheme", "'rk4'", "cells takes analytic only"),
    (
        lambda: scene(free_surface=FreeSurface()),
        "free_surface",
        None,
        "nobody moves or loads is free; leave it out",
    ),
    (lambda: Numerics(velocity_scheme="tailor"), "velocity_scheme", "'tailor'", r"did you mean taylor\?"),
    (lambda: Numerics(source_scheme="rk5"), "source_scheme", "'rk5'", r"did you mean rk4\?"),
    (lambda: scene(conditions=[Fixed(edge("lfet"))]), "edge", "'lfet'", r"one of left.*did you mean left\?"),
    (lambda: scene(conditions=[Fixed(edge("front"))]), "edge", "'front'", "one of left, right, bottom, top"),
    (lambda: scene(conditions=[Fixed(edge(3))]), "edge", 3, "one of left"),
]
SELECTIONS = [
    (lambda: Fixed("left"), "Fixed.on", "'left'", "a selection such as edge"),
    (lambda: edge("left") & "top", "selection", "'top'", "edge"),
    (lambda: region((0.0, 0.0), (1.0,)), "region.upper", "(1.0,)", "2 finite numbers"),
    (lambda: region((0.0, 0.0), (1.0, -1.0)), "region.upper", "(1.0, -1.0)", "must not be below"),
    (lambda: scene(conditions=[Fixed(region((0.0,), (1.0,)))]), "region.lower", "(0.0,)", "2 dimension"),
    (
        lambda: scene(conditions=[Free(edge("left")), Fixed(where(lambda x, y: x > 9.0))]),
        "conditions[1]",
        "Fixed(",
        "at least one node",
    ),
    (
        lambda: scene(conditions=[Fixed(where(lambda x, y: x.top))]),
        "where",
        None,
        "True or False.*attribute 'top'",
    ),
    (
        lambda: scene(conditions=[Fixed(where(lambda x: x > 0))]),
        "where",
        None,
        "True or False.*positional argument",
    ),
    (
        lambda: scene(conditions=[Fixed(where(lambda x, y: x[:3] > 0))]),
        "where",
        None,
        "an array of one of them a node",
    ),
    (lambda: scene(conditions=[Fixed(where(3))]), "where", 3, "not callable"),
]
CONDITIONS = [
    (lambda: scene(conditions=Fixed(edge("left"))), "conditions", "Fixed(", "a sequence of conditions"),
    (lambda: scene(conditions=[edge("left")]), "conditions[0]", "edge(", "a condition such as"),
    (
        lambda: PrescribedVelocity(edge("left"), (None, None)),
        "PrescribedVelocity.velocity",
        "(None, None)",
        "not all None",
    ),
    (lambda: PrescribedVelocity(edge("left"), 1.0), "PrescribedVelocity.velocity", 1.0, "sequence of numbers"),
    (
        lambda: PrescribedVelocity(edge("left"), (NAN, 0.0)),
        "PrescribedVelocity.velocity",
        "nan",
        "function of time",
    ),
    (
        lambda: scene(conditions=[PrescribedVelocity(edge("left"), (1.0,))]),
        "PrescribedVelocity.velocity",
        "(1.0,)",
        "2 components",
    ),
    (lambda: Roller(edge("left"), normal=(0.0, 0.0)), "Roller.normal", "(0.0, 0.0)", "zero vector"),
    (lambda: Free(edge("left"), normal="x"), "Free.normal", "'x'", "finite numbers"),
    (lambda: scene(conditions=[Free(edge("left"), normal=(1.0,))]), "Free.normal", "(1.0,)", "2 components"),
    (
        lambda: scene(conditions=[Roller(edge("left"), normal=(1, 0, 0))]),
        "Roller.normal",
        "(1.0, 0.0, 0.0)",
        "2 comp",
    ),
    (lambda: Rotating(edge("left"), 1.0, (0.0,)), "Rotating.centre", "(0.0,)", "2 finite numbers"),
    (
        lambda: scene(shape=Box((1.0,), 0.1), conditions=[Rotating(edge("left"), 1.0)]),
        "conditions",
        "Rotating(",
        "a plane or a solid",
    ),
    (
        lambda: scene(conditions=[Fixed(edge("left")), PrescribedVelocity(edge("left"), (1.0, None))]),
        "conditions[0]",
        "Fixed(",
        r"with conditions\[1\] = PrescribedVelocity.*different velocities",
    ),
    (
        lambda: scene(conditions=[Fixed(edge("left")), Free(edge("left"))]),
        "conditions[1]",
        "Free(",
        r"shares 2 boundary face.*conditions\[0\] = Fixed.*either free or moved",
    ),
]
INITIAL_FIELDS = [
    (lambda: scene(velocity=(1.0, 0.0)), "velocity", "(1.0, 0.0)", "a function of position"),
    (lambda: scene(velocity=lambda x, y: x), "velocity", None, "must return 2 finite"),
    (lambda: scene(velocity=lambda x, y: (x, y, x)), "velocity", None, "must return 2 finite.*returned 3 parts"),
    (lambda: scene(velocity=lambda x, y: (x, NAN)), "velocity", None, "must return 2 finite"),
    (lambda: scene(velocity=lambda x, y: None), "velocity", None, "must return 2 finite"),
    (lambda: scene(stress=lambda x, y: (x, y)), "stress", None, "must return 4 finite.*returned 2 parts"),
]
OUTPUT = [
    (lambda: Probe(3, "m", len), "Probe.name", 3, "a name"),
    (lambda: Probe("a", None, len), "Probe.unit", None, "a unit"),
    (lambda: Probe("a", "m", 3), "Probe.function", 3, "a function of the simulation"),
    (lambda: NodeValue("velocity", "origin"), "NodeValue.near", "'origin'", "finite numbers"),
    (lambda: NodeValue(3, (0.0, 0.0)), "NodeValue.field", 3, "name of a field"),
    (lambda: EdgeForce("top", 1), "EdgeForce.on", "'top'", "a selection such as"),
    (lambda: EdgeForce(edge("top"), -1), "EdgeForce.axis", -1, "whole number, at least 0"),
    (lambda: EdgeForce(edge("top"), "y"), "EdgeForce.axis", "'y'", "whole number"),
    (lambda: Output(probes=3), "Output.probes", 3, "a sequence of Probe"),
    (lambda: Output(probes=Probe("a", "m", len)), "Output.probes", "Probe(", "a sequence of Probe"),
    (lambda: Output(probes=[len]), "Output.probes", None, "a sequence of Probe"),
    (lambda: Output(probes=[Probe("time", "m", len)]), "Output.probes", "'time'", "names must differ"),
    (lambda: Output(probes=[Probe("a", "m", len)] * 2), "Output.probes", "'a'", "names must differ"),
    (
        lambda: Output(curve=("time", "laod"), probes=[Probe("load", "N", len)]),
        "Output.curve",
        "'laod'",
        r"mean load\?",
    ),
    (lambda: Output(curve=("time",)), "Output.curve", "('time',)", "two probes"),
    (lambda: Output(curve=3), "Output.curve", 3, "two probes"),
    (lambda: Output(curve_reference=5.0), "Output.curve_reference", 5.0, "a label and a value"),
    (lambda: Output(curve_reference=("a", "b")), "Output.curve_reference", "'b'", "finite number"),
    (lambda: Output(field=None), "Output.field", None, "name of a field"),
    (lambda: Output(component=-1), "Output.component", -1, "whole number, at least 0"),
    (lambda: Output(component=True), "Output.component", True, "whole number"),
]
CHECKS_AND_PARAMETERS = [
    (lambda: Check("c", 1.0, 0.0, "-", 0.1), "Check.reference", 0.0, "with relative=True it must not be zero"),
    (lambda: Check("c", None, 1.0, "-", 0.1), "Check.value", None, "a number"),
    (lambda: Parameter("a", [1], "-", "a list"), "a", "[1]", "a number, True or False, a text or None"),
    (lambda: Parameter("a", 1.0, None, "no unit"), "Parameter.unit", None, "a text"),
]


@pytest.mark.parametrize(
    ("build", "field", "value", "allowed"),
    [
        pytest.param(*case, id=case[1])
        for case in (
            *SHAPES,
            *PARTS,
            *NAMES,
            *SELECTIONS,
            *CONDITIONS,
            *INITIAL_FIELDS,
            *OUTPUT,
            *CHECKS_AND_PARAMETERS,
        )
    ],
)
def test_wrong_field_is_refused(build, field, value, allowed):
    refused(build, field, value, allowed)


def test_message_stays_one_line_when_a_user_function_raises_several():
    def several_lines(x, y):
        raise RuntimeError("first\nsecond")

    refused(lambda: scene(velocity=several_lines), "velocity", None, "first second")


@pytest.mark.parametrize("shape", [Box((4.0,) * dim, 1.0) for dim in (1, 2, 3)], ids=["1D", "2D", "3D"])
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("scheme", [name for name, scheme in SCHEMES.items() if scheme.sums is not None])
def test_support_must_reach_the_neighbours_of_a_corner_and_not_too_far(scheme, kernel, shape):
    """A corner node must see the auxiliary nodes beside its own: r² = (3/2)² + (d − 1)/4; in 1D one is enough."""
    dim = len(shape.size)
    least = (1.0 if dim == 1 else math.sqrt(1.5**2 + 0.25 * (dim - 1))) / KERNELS[kernel].support
    most = 6.0 / KERNELS[kernel].support

    def build(ratio):
        return scene(shape=shape, numerics=Numerics(kernel=kernel, smoothing_ratio=ratio, velocity_scheme=scheme))

    build(least * 1.001)
    build(most * 0.999)
    allowed = f"{kernel} .* {scheme} in {dim}D .* above .* at most"
    for ratio in (least * 0.999, most * 1.001, 0.01, 100.0):
        refused(lambda ratio=ratio: build(ratio), "smoothing_ratio", ratio, allowed)


def test_round_support_must_reach_further_on_a_stretched_lattice():
    """Cells have no support."""
    long = Box((4.0, 4.0), 1.0).mapped(lambda x, y: (1.5 * x, y))
    round_kernel = Numerics(velocity_scheme="taylor")
    refused(lambda: scene(shape=long, numerics=round_kernel), "smoothing_ratio", 0.6, "must be above")
    scene(shape=long, numerics=Numerics(velocity_scheme="taylor", smoothing_ratio=0.9))
    scene(shape=long)


@pytest.mark.parametrize("kernel", KERNELS)
def test_courant_number_up_to_the_wave_limit(kernel):
    """2 √m₂ of sums over neighbours; of cells 0.8."""
    sums = {"velocity_scheme": "taylor", "kernel": kernel}
    limit = courant_limit(scene(numerics=Numerics(**sums)))

    def build(factor):
        return time_step_limit(scene(numerics=Numerics(**sums, courant=factor * limit)))

    assert build(1.0) == pytest.approx(limit * 0.25 / Elastic(**ELASTIC).wave_speed(2), rel=1e-12)
    refused(lambda: build(1.001), "courant", limit * 1.001, f"kernel {kernel} .* stable up to {limit:.4g}")
    too_large = scene(numerics=Numerics(courant=0.81))
    refused(lambda: time_step_limit(too_large), "courant", 0.81, "cells .* stable up to 0.8")


def test_time_step_up_to_the_wave_limit():
    limit = courant_limit(scene()) * 0.25 / Elastic(**ELASTIC).wave_speed(2)
    assert time_step_limit(scene(numerics=Numerics(time_step=limit))) == limit
    too_long = scene(numerics=Numerics(time_step=1.001 * limit))
    refused(lambda: time_step_limit(too_long), "time_step", 1.001 * limit, f"at most {limit:.6g} s")


@pytest.fixture(scope="module")
def simulation():
    return Simulation(scene(), device="cpu")


@pytest.mark.parametrize(
    ("use", "field", "value", "allowed"),
    [
        pytest.param(*case, id=case[1])
        for case in [
            (lambda s: s.field("velocty"), "field", "'velocty'", r"one of position.*did you mean velocity\?"),
            (lambda s: s.field("yield_size"), "field", "'yield_size'", "one of position"),
            (lambda s: s.field(None), "field", None, "one of position"),
            (lambda s: s.nearest_node((0.0,)), "point", "(0.0,)", "2 finite numbers"),
            (lambda s: s.nearest_node((9.0, 0.0)), "point", "(9.0, 0.0)", "the nearest node, at "),
            (lambda s: s.step(-1.0), "time_step", -1.0, "above 0"),
            (lambda s: s.step(2.0 * s.time_step_limit), "time_step", None, "at most"),
            (lambda s: s.run(until=-1.0), "until", -1.0, "at least 0"),
            (
                lambda s: NodeValue("velocity", (0.0, 0.0), 2)(s),
                "NodeValue.component",
                2,
                "at least 0 and below 2",
            ),
            (lambda s: NodeValue("density", (0.0, 0.0), 1)(s), "NodeValue.component", 1, "below 1"),
            (lambda s: NodeValue("velocity", (0.0,))(s), "point", "(0.0,)", "2 finite numbers"),
            (lambda s: EdgeForce(edge("top"), 2)(s), "EdgeForce.axis", 2, "below 2"),
            (lambda s: EdgeForce(CORNER, 0)(s), "EdgeForce.on", "region(", "one boundary face"),
            (lambda s: Simulation("scene"), "scene", "'scene'", "a Scene"),
            (lambda s: Simulation(s.scene, device="cuda:99"), "device", "'cuda:99'", "one of .*cpu"),
            (lambda s: Simulation(s.scene, device="gpu"), "device", "'gpu'", "one of .*cpu"),
            (
                lambda s: Simulation(s.scene, precision="float16"),
                "precision",
                "'float16'",
                "one of float32, float64",
            ),
            (lambda s: Simulation(s.scene, precision=None), "precision", None, "one of float32, float64"),
        ]
    ],
)
def test_wrong_use_of_a_simulation_is_refused(simulation, use, field, value, allowed):
    refused(lambda: use(simulation), field, value, allowed)


def test_every_component_of_a_tensor_can_be_probed(simulation):
    assert [NodeValue("velocity_gradient", (0.0, 0.0), k)(simulation) for k in range(4)] == [0.0] * 4


RIGHT = {
    Box: {"size": (1.0, 0.5), "spacing": 0.25, "origin": (0.0, 0.0)},
    Elastic: ELASTIC,
    PerzynaVonMises: PERZYNA,
    Numerics: {
        "kernel": "gaussian",
        "smoothing_ratio": 0.6,
        "courant": 0.9,
        "velocity_scheme": "taylor",
        "source_scheme": "rk4",
        "time_step": None,
    },
    Scene: {
        "shape": PLATE,
        "material": Elastic(**ELASTIC),
        "duration": 1.0,
        "conditions": (Fixed(edge("left")),),
        "body_force": BodyForce((0.0, -9.81)),
        "damping": 0.0,
        "velocity": lambda x, y: (x, y),
        "stress": None,
        "large_displacements": True,
        "numerics": Numerics(),
        "output": Output(),
        "name": "scene",
    },
}
ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 3),
    st.sampled_from([10**400, 1j, b"ab", {}, {"a": 1}, object, len, ..., np.array(1.0), np.eye(2), np.array("a")]),
    st.floats(-10.0, 10.0) | st.sampled_from([NAN, INF, -INF, -0.0]),
    st.text(max_size=5),
    st.lists(st.floats(-2.0, 2.0) | st.none() | st.text(max_size=2), max_size=4),
    st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 2.0)),
    st.sampled_from([PLATE, Box((1.0,), 0.25), Box((0.5, 0.5, 0.5), 0.25), PLATE.rotated(0.3), edge("left")]),
    st.sampled_from(
        [
            [Fixed(edge("left")), 3],
            [Fixed(edge("nowhere"))],
            [Free(edge("left")), Roller(edge("left"))],
            [Rotating(edge("left"), 1.0)],
            [PrescribedVelocity(edge("right"), (1.0, None))],
        ]
    ),
)


@settings(max_examples=400, deadline=1000, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(list(RIGHT)), st.data())
def test_anything_is_accepted_or_refused_in_one_line(kind, data):
    """Some arguments of a part that is otherwise right are replaced, and the part is put into a scene."""
    right = RIGHT[kind]
    names = data.draw(st.lists(st.sampled_from(list(right)), unique=True, min_size=1, max_size=3))
    arguments = {**right, **{name: data.draw(ANYTHING) for name in names}}
    slot = {Box: "shape", Elastic: "material", PerzynaVonMises: "material", Numerics: "numerics"}.get(kind)
    try:
        part = kind(**arguments)
        if slot and not (kind is Box and math.prod(part.size) / part.spacing ** len(part.size) > 1e4):
            Scene(**{**RIGHT[Scene], slot: part})
    except SceneError as error:
        assert "\n" not in str(error) and str(error).startswith(error.field)
