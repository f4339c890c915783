"""What a scene must know of a material. Materials themselves, with their laws, are in `warpsph.materials`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import partial
from typing import ClassVar

import numpy as np

from ..errors import SceneError
from ..mesh.continuum import CONTINUA, Continuum
from ..validate import field_of_position, number


@dataclass(frozen=True)
class InternalVariable:
    """What a node remembers of its material beside the stress; a field of the nodes, and kept in checkpoints.

    Attributes:
        name: its name as a field.
        unit: its unit, `-` for none.
        meaning: one line.
        initial: its value at the start: a number, or a function (material, x, y, …) → a number or one value a
            node, for what a parameter sets or what varies with the initial position.
    """

    name: str
    unit: str
    meaning: str
    initial: float | Callable = 0.0


@dataclass(frozen=True)
class DerivedField:
    """A field of the nodes that follows from their stresses and internal variables.

    Attributes:
        name: its name as a field.
        unit: its unit, `-` for none.
        meaning: one line.
        values: (stress (n, s), internals (n, m), material) → values, shape (n,); all NumPy.
    """

    name: str
    unit: str
    meaning: str
    values: Callable[[np.ndarray, np.ndarray, Material], np.ndarray]


def parameter(unit: str, meaning: str, *, default: object = MISSING, **bounds: float):
    """A parameter of a material: the one place of its unit, its meaning and its bounds, those of `number`."""
    return field(default=default, metadata={"unit": unit, "meaning": meaning, "bounds": bounds})


@dataclass(frozen=True, kw_only=True)
class Material(ABC):
    """A material: its parameters, checked, and how fast its waves and its flow are.

    A subclass is a frozen dataclass with a `parameter` each; it also says its law, for the kernels.

    Attributes:
        continua: names of the continua that its law knows.
        internals: its internal variables, in the order in which the law has them.
        derived: what can be read from stresses and internal variables as further fields.

    Raises:
        SceneError: a parameter is not allowed.
    """

    continua: ClassVar[tuple[str, ...]] = tuple(continuum.name for continuum in CONTINUA.values())
    internals: ClassVar[tuple[InternalVariable, ...]] = ()
    derived: ClassVar[tuple[DerivedField, ...]] = ()

    density: float = parameter("kg/m³", "density ρ", above=0.0)

    def __post_init__(self):
        for entry in fields(self):
            if "bounds" in entry.metadata:
                self.require(entry.name, **self.bounds(entry.name))

    def bounds(self, name: str) -> Mapping[str, float]:
        """Bounds of a parameter; those of the parameters before it are checked already."""
        return type(self).__dataclass_fields__[name].metadata["bounds"]

    def require(self, name: str, **bounds: float) -> None:
        """Refuse a parameter that is no finite number within bounds `above`, `below`, `at_least`, `at_most`.

        Raises:
            SceneError: it is none.
        """
        object.__setattr__(self, name, number(name, getattr(self, name), **bounds))

    def with_parameters(self, values: object) -> Material:
        """The material with what `values`, a scene's p, has of its parameters; see `Parameter.of`."""
        given = {entry.name: getattr(values, entry.name) for entry in fields(self) if hasattr(values, entry.name)}
        return replace(self, **given)

    @abstractmethod
    def wave_speed(self, dim: int) -> float:
        """Speed of the fastest wave in so many dimensions [m/s], for the step limit."""

    @abstractmethod
    def stiffness(self, continuum: Continuum) -> np.ndarray:
        """Dₑ [Pa] from strains (engineering shear) to the stored stresses, shape (s, s)."""

    def flow_rate(self, dim: int) -> float:
        """Fastest rate at which inelastic flow relaxes the stress in slow loading [1/s]; 0 where nothing flows."""
        return 0.0

    @abstractmethod
    def law(self, space):
        """The `warpsph.materials.Law` in a `warpsph.materials.Space`; the same object for the same space."""

    def check_continuum(self, continuum: Continuum) -> None:
        """Refuse a body whose continuum the law does not know.

        Raises:
            SceneError: it does not.
        """
        if continuum.name not in self.continua:
            allowed = f"its law knows {', '.join(self.continua)} only, and this body is a {continuum.name}"
            raise SceneError("material", self, allowed)

    def initial_internals(self, points: np.ndarray) -> np.ndarray:
        """Initial values of the internal variables, shape (n, m), at initial positions (n, d) [m].

        Raises:
            SceneError: one is no finite number, or not one value a node.
        """
        columns = []
        for variable in self.internals:
            initial = variable.initial
            at = partial(initial, self) if callable(initial) else lambda *x, value=initial: value
            columns.append(field_of_position(variable.name, at, points, 1))
        return np.concatenate([np.empty((len(points), 0)), *columns], axis=1)
