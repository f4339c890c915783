"""A body on a device: what it is made of, and its nodes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import warp as wp

from ..device.launching import Launcher
from ..errors import SceneError
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..mesh.mesh import Mesh
from ..physics.space import Space
from ..scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Body(ABC):
    """One material, one kind of cell, and the arrays that every scheme has.

    Attributes:
        scene: the scene it is of.
        space: its continuum and precision.
        kind: the kind of its cells.
        law: its material's law.
        parameters: the law's parameters.
        nodes: the nodes, a struct of arrays of the scheme's own.
        internals: what each node remembers of the material, or None.
        launcher: launches the kernels that work on it.
    """

    scene: Scene
    space: Space
    kind: CellKind
    law: Law
    parameters: object
    nodes: object
    internals: wp.array | None
    launcher: Launcher

    def mesh(self) -> Mesh:
        """The nodes where they began, and the cells as they are now."""
        return self.scene.mesh

    @abstractmethod
    def density(self) -> np.ndarray:
        """ρ of the nodes [kg/mᵈ], shape (n,)."""

    def stress(self) -> np.ndarray:
        """σ of the nodes [Pa], stored components, shape (n, s)."""
        return self.nodes.point.numpy()["phi"][:, self.space.dim :].copy()


def shared_parts(scene: Scene, space: Space, launcher: Launcher) -> dict[str, object]:
    """What every scheme's body of a scene has alike, by attribute.

    Raises:
        SceneError: the law can not be integrated by the scene's source scheme.
    """
    law, scheme = scene.material.law(space), scene.numerics.source_scheme
    if scheme not in law.source_schemes:
        takes = ", ".join(law.source_schemes)
        raise SceneError("source_scheme", scheme, f"the law of {type(scene.material).__name__} takes {takes} only")
    return {
        "scene": scene,
        "space": space,
        "kind": scene.mesh.kind,
        "law": law,
        "parameters": law.fill(scene.material),
        "internals": _internals(scene, law, space, launcher.device),
        "launcher": launcher,
    }


def _internals(scene: Scene, law: Law, space: Space, device: wp.Device) -> wp.array | None:
    """The internal variables of the nodes at the start; None for a law without any."""
    if not law.internals:
        return None
    return wp.array(scene.initial_internals, dtype=space.vec(len(law.internals)), device=device)
