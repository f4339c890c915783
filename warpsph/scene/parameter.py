"""Parameters of a shipped or user-written scene file: what `--set name=value` may change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from types import SimpleNamespace

from ..errors import SceneError, one_of
from ..validate import instance, number
from .material import Material
from .numerics import SOURCE_SCHEMES, Numerics
from .registry import KERNELS
from .scheme import SCHEMES


@dataclass(frozen=True)
class Parameter:
    """One parameter of a scene file.

    Args:
        name: its name.
        default: its default; its type (float, int, bool or str) is the type of every value. None stands for
            "chosen by warpsph", written `auto`, and takes numbers.
        unit: its unit, `-` for none.
        meaning: one line.
        choices: the allowed values, if only some are.
        automatic: whether a number may also be `auto`.

    >>> Parameter("spacing", 0.1, "m", "distance between nodes").parse("0.05")
    0.05
    """

    name: str
    default: float | int | bool | str | None
    unit: str
    meaning: str
    choices: tuple[str, ...] = ()
    automatic: bool = False

    def __post_init__(self):
        instance("Parameter.name", self.name, str, "a name")
        for field in ("unit", "meaning"):
            instance(f"Parameter.{field}", getattr(self, field), str, "a text")
        instance(self.name, self.default, float | int | str | None, "a number, True or False, a text or None")

    @classmethod
    def of(cls, material: Material, *names: str) -> tuple[Parameter, ...]:
        """The parameters of a material, its values the defaults; `material.with_parameters(p)` is the way back.

        Args:
            material: an example of it.
            names: which, and in which order; all unless given.

        >>> from warpsph import Elastic
        >>> clay = Elastic(young_modulus=1e6, poisson_ratio=0.4, density=1800.0)
        >>> Parameter.of(clay, "density")[0].unit, clay.with_parameters(SimpleNamespace(density=1900.0)).density
        ('kg/m³', 1900.0)
        """
        known = {entry.name: entry.metadata for entry in fields(material) if "unit" in entry.metadata}
        for name in names:
            if name not in known:
                raise SceneError("Parameter.of", name, one_of(known, name))
        return tuple(
            cls(name, getattr(material, name), known[name]["unit"], known[name]["meaning"])
            for name in names or known
        )

    def parse(self, text: object) -> float | int | bool | str | None:
        """The value a command line gives."""
        value, automatic = str(text).strip(), self.automatic or self.default is None
        if automatic and value.lower() in ("auto", "none"):
            return None
        if self.choices:
            if value not in self.choices:
                raise SceneError(self.name, value, one_of(self.choices, value))
            return value
        try:
            if isinstance(self.default, bool):
                return {"true": True, "false": False, "1": True, "0": False}[value.lower()]
            return float(value) if self.default is None else type(self.default)(value)
        except (KeyError, ValueError):
            kind = {bool: "true or false", int: "a whole number"}.get(type(self.default), "a number")
            raise SceneError(self.name, value, f"it must be {kind}{' or auto' if automatic else ''}") from None


def numerical_parameters(defaults: Mapping[str, object]) -> tuple[Parameter, ...]:
    """The parameters every scene takes, with a scene's own defaults where it has any."""
    standard = {
        "velocity_scheme": (
            Numerics.velocity_scheme,
            "-",
            f"velocity step: {', '.join(SCHEMES)}",
            tuple(SCHEMES),
        ),
        "courant": (Numerics.courant, "-", "c_p Δt/Δx, c_p the fastest wave's speed", ()),
        "source_scheme": (
            Numerics.source_scheme,
            "-",
            f"sources: {', '.join(SOURCE_SCHEMES)}; cells takes analytic only",
            SOURCE_SCHEMES,
        ),
        "kernel": (
            None,
            "-",
            f"smoothing function of sums over neighbours: {', '.join(KERNELS)}; auto is gaussian; none with cells",
            tuple(KERNELS),
        ),
        "smoothing_ratio": (
            None,
            "-",
            "smoothing length over spacing h/Δx of these sums; auto is the kernel's own default",
            (),
        ),
        "sharpening": (
            None,
            "-",
            "of cells, 0 to 0.7, auto is 2/3: how far short waves get back what means take",
            (),
        ),
        "time_step": (None, "s", "Δt; auto follows from courant and the stiffness of the sources", ()),
    }
    automatic = [name for name, row in standard.items() if row[0] is None]
    for name, value in instance("NUMERICS", defaults, Mapping, "a dictionary").items():
        if name not in standard:
            raise SceneError("NUMERICS", name, one_of(standard, name))
        _, unit, meaning, choices = standard[name]
        if not choices and value is not None:
            value = number(f"NUMERICS[{name!r}]", value)
        standard[name] = value, unit, meaning, choices
    return tuple(Parameter(name, *row, automatic=name in automatic) for name, row in standard.items())


def assign(parameters: Iterable[Parameter], settings: Iterable[str]) -> dict[str, object]:
    """Values of all parameters, after settings of the form `name=value`.

    Changing the kernel also resets a smoothing ratio that was meant for the scene's default kernel.
    """
    by_name = {parameter.name: parameter for parameter in parameters}
    values = {name: parameter.default for name, parameter in by_name.items()}
    given = {}
    for setting in settings:
        name, separator, text = setting.partition("=")
        name = name.strip()
        if not separator:
            raise SceneError("--set", setting, "it must have the form name=value")
        if name not in by_name:
            raise SceneError("--set", name, one_of(by_name, name))
        given[name] = by_name[name].parse(text)
    if given.get("kernel", values["kernel"]) != values["kernel"]:
        values["smoothing_ratio"] = None
    return values | given


def namespace(values: Mapping[str, object]) -> SimpleNamespace:
    """The values as attributes, with the numerical ones collected in `numerics`."""
    numerical = {name: values[name] for name in Numerics.__dataclass_fields__}
    return SimpleNamespace(**values, numerics=Numerics(**numerical))
