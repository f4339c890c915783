"""The node fields a simulation exposes, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..analysis.tensors import green_strain, mean_stress, von_mises
from ..device.precision import PRECISIONS
from ..materials import law
from ..mesh.continuum import Continuum
from ..physics.space import Space
from ..scene.material import PerzynaVonMises
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


def _has_yield(scene) -> bool:
    return isinstance(scene.material, PerzynaVonMises)


def _has_free_surface(scene) -> bool:
    return scene.free_surface is not None


def _phi(simulation) -> np.ndarray:
    return simulation.nodes.point.numpy()["phi"]


def _stress(simulation) -> np.ndarray:
    return _phi(simulation)[:, simulation.mesh.dim :].copy()


def _yield_size(simulation) -> np.ndarray:
    material, eps = simulation.scene.material, simulation.internals.numpy()[:, 0]
    return np.maximum(
        material.yield_size + material.hardening * eps, material.residual_ratio * material.yield_size
    )


def component_names(name: str, continuum: Continuum) -> tuple[str, ...]:
    """Names of the components of a field: s12, e11, y, or xy of a tensor; none of a scalar."""
    shape, axes = FIELDS[name].shape if name in FIELDS else "(n,)", continuum.axes
    if shape == "(n, s)":
        return tuple(("s" if name == "stress" else "e") + part[1:] for part in continuum.stress_components)
    if shape == "(n, d)":
        return axes
    return tuple(a + b for a in axes for b in axes) if shape == "(n, d, d)" else ()


FIELDS: dict[str, Field] = {
    "position": Field("m", "(n, d)", "current position x", lambda s: s.nodes.point.numpy()["x"].copy()),
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
    "yield_size": Field("Pa", "(n,)", "size of the yield surface Y", _yield_size, _has_yield),
    "density": Field("kg/m³", "(n,)", "density ρ", lambda s: s.nodes.density.numpy().copy()),
    "smoothing_length": Field(
        "m", "(n,)", "smoothing length h", lambda s: s.nodes.smoothing_length.numpy().copy()
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
        lambda s: s.scene.material.density * s.mesh.node_volumes()[0],
    ),
}


def fields_of(scene: Scene) -> dict[str, Field]:
    """The fields of a scene by name: those of `FIELDS` it has, and the internal variables of its material."""
    return {name: field for name, field in FIELDS.items() if field.available(scene)} | internal_variables(scene)


def internal_variables(scene: Scene) -> dict[str, Field]:
    """What the nodes of a scene remember of their material, by name."""
    variables = law(scene.material, Space(scene.mesh.continuum, PRECISIONS["float64"])).internals
    return {
        name: Field(unit, "(n,)", meaning, lambda s, k=k: s.internals.numpy()[:, k].copy())
        for k, (name, unit, meaning) in enumerate(variables)
    }
