"""The node fields a simulation exposes, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..analysis.tensors import green_strain, mean_stress, von_mises
from ..errors import SceneError
from ..mesh.continuum import Continuum
from ..scene.scene import Scene


@dataclass(frozen=True)
class Field:
    """A field of the material nodes.

    Attributes:
        unit: its unit.
        shape: its shape; n nodes, d dimensions, s stored stress components.
        meaning: what it is.
        read: simulation → NumPy array.
        available: scene → whether the scene has it.
    """

    unit: str
    shape: str
    meaning: str
    read: Callable[[object], np.ndarray]
    available: Callable[[object], bool] = lambda scene: True


def _sums_over_neighbours(scene) -> bool:
    return scene.numerics.scheme.sums is not None


def _has_free_surface(scene) -> bool:
    return scene.free_surface is not None


def _phi(simulation) -> np.ndarray:
    return simulation.nodes.point.numpy()["phi"]


def _stress(simulation) -> np.ndarray:
    return simulation.stepper.body.stress()


def component_names(name: str, continuum: Continuum) -> tuple[str, ...]:
    """Names of the components of a field: s12, e11, y, or xy of a tensor; none of a scalar."""
    shape, axes = FIELDS[name].shape if name in FIELDS else "(n,)", continuum.axes
    if shape == "(n, s)":
        return tuple(("s" if name == "stress" else "e") + part[1:] for part in continuum.stress_components)
    if shape == "(n, d)":
        return axes
    return tuple(a + b for a in axes for b in axes) if shape == "(n, d, d)" else ()


FIELDS: dict[str, Field] = {
    "position": Field("m", "(n, d)", "position x = X + u", lambda s: s.mesh.nodes + s.nodes.displacement.numpy()),
    "displacement": Field("m", "(n, d)", "u = x − X", lambda s: s.nodes.displacement.numpy().copy()),
    "velocity": Field("m/s", "(n, d)", "velocity v", lambda s: _phi(s)[:, : s.mesh.dim].copy()),
    "stress": Field("Pa", "(n, s)", "Cauchy stress σ, stored components, tension positive", _stress),
    "von_mises_stress": Field("Pa", "(n,)", "q = √(3 J₂)", lambda s: von_mises(_stress(s), s.mesh.continuum)),
    "mean_stress": Field(
        "Pa", "(n,)", "tr σ/3, tension positive", lambda s: mean_stress(_stress(s), s.mesh.continuum)
    ),
    "strain": Field(
        "-",
        "(n, s)",
        "Green-Lagrange strain, components as of the stress",
        lambda s: green_strain(s.mesh, s.nodes.displacement.numpy()),
    ),
    "density": Field("kg/m³", "(n,)", "density ρ", lambda s: s.stepper.body.density()),
    "smoothing_length": Field(
        "m", "(n,)", "smoothing length h", lambda s: s.nodes.smoothing_length.numpy().copy(), _sums_over_neighbours
    ),
    "velocity_gradient": Field(
        "1/s", "(n, d, d)", "L = ∂v_i/∂x_j of v^{n+1/2}", lambda s: s.nodes.velocity_gradient.numpy().copy()
    ),
    "free_surface": Field(
        "-",
        "(n,)",
        "whether the node is on the free surface, not under a velocity condition",
        lambda s: s.conditions.on_surface(),
        _has_free_surface,
    ),
    "surface_normal": Field(
        "-",
        "(n, d)",
        "outward unit normal of the free surface, zero elsewhere",
        lambda s: s.conditions.normals(),
        _has_free_surface,
    ),
    "mass": Field(
        "kg",
        "(n,)",
        "mass of the node (per metre of thickness in plane strain, per square metre of section in a bar)",
        lambda s: s.scene.material.density * s.mesh.node_volumes(),
    ),
}


def fields_of(scene: Scene) -> dict[str, Field]:
    """The fields of a scene by name: those of `FIELDS` it has, and those of its material.

    Raises:
        SceneError: the material calls one of its own as another one is called.
    """
    own = internal_variables(scene) | derived_fields(scene)
    names = [field.name for field in (*scene.material.internals, *scene.material.derived)]
    for name in names:
        if name in FIELDS or names.count(name) > 1:
            raise SceneError(f"{type(scene.material).__name__} field", name, "another field has this name")
    return {name: field for name, field in FIELDS.items() if field.available(scene)} | own


def internal_variables(scene: Scene) -> dict[str, Field]:
    """What the nodes of a scene remember of their material, by name."""
    return {
        variable.name: Field(variable.unit, "(n,)", variable.meaning, lambda s, k=k: _internals(s)[:, k].copy())
        for k, variable in enumerate(scene.material.internals)
    }


def derived_fields(scene: Scene) -> dict[str, Field]:
    """What follows from the stresses and internal variables of a scene's material, by name."""
    return {
        field.name: Field(
            field.unit,
            "(n,)",
            field.meaning,
            lambda s, values=field.values: values(_stress(s), _internals(s), s.scene.material),
        )
        for field in scene.material.derived
    }


def _internals(simulation) -> np.ndarray:
    if simulation.internals is None:
        return np.empty((len(simulation.mesh.nodes), 0))
    return simulation.internals.numpy()
