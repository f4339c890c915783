"""A scene: everything a run needs to know, checked as it is built."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..errors import SceneError
from ..mesh.inside import inside
from ..mesh.mesh import Mesh
from ..validate import (
    TimeFunction,
    field_of_position,
    flag,
    instance,
    listed,
    number,
    time_function,
    vector,
)
from .code import identity
from .condition import Condition
from .face_loads import FaceLoads, face_loads
from .free_surface import FreeSurface
from .load import Load
from .material import Material
from .numerics import Numerics
from .output import Output
from .remade import Remade
from .resolve import BoundaryTable, resolve
from .shape import Shape
from .thickness import check_thickness
from .tool import TOUCHING, Tool


@dataclass(frozen=True)
class BodyForce:
    """A uniform body force b(t) = acceleration · factor(t), for example gravity.

    Args:
        acceleration: [m/s²], one component an axis.
        factor: a number or a function of time, e.g. `Ramp(1.0)`.

    >>> BodyForce((0.0, -9.81), lambda t: 2.0 * t)(0.5)
    array([ 0.  , -9.81])
    """

    acceleration: tuple[float, ...]
    factor: TimeFunction = 1.0

    def __post_init__(self):
        object.__setattr__(self, "acceleration", vector("BodyForce.acceleration", self.acceleration))
        object.__setattr__(self, "factor", time_function("BodyForce.factor", self.factor))

    def __call__(self, t: float) -> np.ndarray:
        factor = self.factor(t) if callable(self.factor) else self.factor
        return factor * np.array(self.acceleration)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A body, what it is made of, what is done to it, for how long, and what to record.

    Args:
        shape: the body with its lattice.
        material: what it is made of, such as `Elastic` (`warpsph.materials`).
        duration: simulated time [s].
        conditions: boundary conditions; an edge without one is free of traction (with a published velocity
            scheme it keeps whatever traction it has).
        tools: rigid ground and tools, which the body does not pass, such as `Plane` and `Cylinder`.
        free_surface: for a published velocity scheme, frees the edge that no condition moves of its tractions, as
            it moves and deforms; or None.
        body_force: uniform body force, or None.
        damping: mass-proportional damping c [1/s]: dv/dt = … − c v.
        velocity: initial velocity [m/s], a function of position f(x, y, …) → one part an axis; rest unless given.
        stress: initial stress [Pa], a function of position → one part a stored component
            (bar s11; plane strain s11, s22, s12, s33; solid s11, s22, s33, s12, s13, s23); zero unless given.
        large_displacements: whether nodes move and stresses turn with them (updated Lagrangian); if not, the
            initial configuration is kept (small strains).
        cells: cells that are made anew as the body flows, `Remade()`, or None.
        numerics: choices of the discretisation.
        output: what to record.
        name: a short name, for messages and results.

    Raises:
        SceneError: a field is not allowed; the message names it, its value and what is allowed.

    >>> from warpsph import Box, Elastic, Fixed, edge
    >>> scene = Scene(
    ...     shape=Box(size=(1.0, 1.0), spacing=0.5),
    ...     material=Elastic(young_modulus=1e6, density=2000.0),
    ...     conditions=[Fixed(edge("bottom"))],
    ...     velocity=lambda x, y: (0.1 * y, 0.0),
    ...     duration=1.0,
    ... )
    >>> scene.boundary.nodes, scene.initial_velocity.shape
    (array([0, 3, 6]), (9, 2))
    """

    shape: Shape
    material: Material
    duration: float
    conditions: tuple[Condition, ...] = ()
    tools: tuple[Tool, ...] = ()
    free_surface: FreeSurface | None = None
    body_force: BodyForce | None = None
    damping: float = 0.0
    velocity: Callable | None = None
    stress: Callable | None = None
    large_displacements: bool = True
    cells: Remade | None = None
    numerics: Numerics = field(default_factory=Numerics)
    output: Output = field(default_factory=Output)
    name: str = "scene"

    def __post_init__(self):
        instance("shape", self.shape, Shape, "a shape such as Box(size=(1, 1), spacing=0.1)")
        instance("material", self.material, Material, "a material such as Elastic(…)")
        instance("numerics", self.numerics, Numerics, "Numerics(…)")
        instance("output", self.output, Output, "Output(…)")
        instance("name", self.name, str, "a string")
        object.__setattr__(self, "duration", number("duration", self.duration, above=0.0))
        object.__setattr__(self, "damping", number("damping", self.damping, at_least=0.0))
        flag("large_displacements", self.large_displacements)
        object.__setattr__(
            self, "conditions", listed("conditions", self.conditions, object, "a sequence of conditions")
        )
        for index, condition in enumerate(self.conditions):
            instance(f"conditions[{index}]", condition, Condition, "a condition such as Fixed(edge('left'))")
        self.material.check_continuum(self.mesh.continuum)
        dim = self.mesh.dim
        if self.body_force is not None:
            instance("body_force", self.body_force, BodyForce, "BodyForce(…) or None")
            vector("BodyForce.acceleration", self.body_force.acceleration, dim)
        if self.free_surface is not None:
            self._check_free_surface()
        self.numerics.scheme.check_cells(self.mesh)
        self.numerics.check_support(self.mesh)
        self._check_loads()
        self._check_tools()
        if self.cells is not None:
            instance("cells", self.cells, Remade, "Remade(…) or None").check(self)
        self.output.check(self)
        check_thickness(self.mesh, self.boundary, self._freed_nodes())
        _ = self.initial_velocity, self.initial_stress, self.initial_internals

    def _freed_nodes(self) -> np.ndarray:
        """Indices of the nodes whose edges are free, conditions aside."""
        if self.numerics.scheme.sums is None:
            return np.unique(self.mesh.faces)
        return self.free_surface.candidates(self.mesh, self.conditions) if self.free_surface else np.arange(0)

    def _check_free_surface(self) -> None:
        surface = instance("free_surface", self.free_surface, FreeSurface, "FreeSurface(…) or None")
        if self.numerics.scheme.sums is None:
            scheme = self.numerics.velocity_scheme
            allowed = f"with velocity_scheme {scheme} an edge that nobody moves or loads is free; leave it out"
            raise SceneError("free_surface", surface, allowed)
        surface.check(self.mesh.dim)
        for index, condition in enumerate(self.conditions):
            if condition.unmoved:
                name = type(condition).__name__
                allowed = f"with a free_surface every edge that nobody moves is free; leave {name} out"
                raise SceneError(f"conditions[{index}]", condition, allowed)
        if not len(surface.candidates(self.mesh, self.conditions)):
            raise SceneError(
                "free_surface", surface, "a velocity is prescribed on the whole boundary; leave it out"
            )

    def _check_loads(self) -> None:
        scheme = self.numerics.scheme
        for index, load in enumerate(self.conditions):
            if not isinstance(load, Load):
                continue
            load.check(self.mesh.dim)
            load.check_faces(f"conditions[{index}]", self.mesh)
            if not scheme.nodal_forces and self.large_displacements and (load.turns or not load.follows):
                allowed = (
                    f"velocity_scheme {scheme.name} has loads on present areas in directions that stay; take "
                    "Traction, velocity_scheme cells or large_displacements=False"
                )
                raise SceneError(f"conditions[{index}]", load, allowed)
        _ = self.loads

    def _check_tools(self) -> None:
        allowed = "a sequence of tools such as Plane((0, 0), (0, 1))"
        object.__setattr__(self, "tools", listed("tools", self.tools, Tool, allowed))
        names = [tool.name for tool in self.tools]
        for index, tool in enumerate(self.tools):
            field = f"tools[{index}]"
            if not self.numerics.scheme.nodal_forces:
                scheme = self.numerics.velocity_scheme
                raise SceneError(field, tool, f"velocity_scheme {scheme} has no forces on nodes; take cells")
            if not self.large_displacements:
                raise SceneError(field, tool, "tools meet nodes where they are; take large_displacements=True")
            tool.check(self.mesh.dim)
            if names.index(tool.name) < index:
                raise SceneError(f"{field}.name", tool.name, "another tool has this name")
            form = tool.form(self.mesh.dim)
            if not form.plane and inside(self.mesh, form.centre):
                raise SceneError(field, tool, "at the start it is inside the body")
            depth = -form.distance(self.mesh.nodes)
            if depth.max() > TOUCHING * self.mesh.spacing:
                node = int(depth.argmax())
                at = tuple(round(x, 6) for x in self.mesh.nodes[node].tolist())
                raise SceneError(field, tool, f"at the start node {node} at {at} is {depth[node]:.4g} m inside it")

    @cached_property
    def tool_functions(self) -> tuple[tuple[TimeFunction, ...], np.ndarray]:
        """The distinct functions of time that move the tools, and which are each tool's velocity, shape (k, d)."""
        rest = (0.0,) * self.mesh.dim
        velocities = [rest if tool.velocity is None else tool.velocity for tool in self.tools]
        functions: list[TimeFunction] = []
        for part in (part for velocity in velocities for part in velocity):
            if part not in functions:
                functions.append(part)
        which = [[functions.index(part) for part in velocity] for velocity in velocities]
        return tuple(functions), np.array(which, dtype=np.int64).reshape(len(self.tools), self.mesh.dim)

    @cached_property
    def mesh(self) -> Mesh:
        """The initial nodes, cells and faces."""
        return self.shape.mesh()

    @cached_property
    def wave_spacing(self) -> float:
        """Δx in the Courant number [m], the scheme's."""
        return self.numerics.scheme.spacing(self.mesh)

    @cached_property
    def sharpening(self) -> float:
        """c of the scheme `cells` [-], see `Numerics.sharpening`."""
        numerics, mesh = self.numerics, self.mesh
        return numerics.sharpening_of(mesh, self.material.wave_speed(mesh.dim), spacing=self.wave_spacing)

    @cached_property
    def boundary(self) -> BoundaryTable:
        """The conditions, resolved node by node, without the `loads`."""
        conditions = self.conditions
        if self.numerics.scheme.nodal_forces:
            conditions = tuple(condition for condition in conditions if not isinstance(condition, Load))
        return resolve(self.mesh, conditions, duration=self.duration)

    @cached_property
    def rigid_cells(self) -> np.ndarray:
        """Cells that no motion strains, since one condition moves all of their corners rigidly; boolean (m,)."""
        rigid = np.zeros(len(self.mesh.cells), dtype=bool)
        for condition in self.conditions:
            if condition.rigid:
                rigid |= condition.nodes(self.mesh)[self.mesh.cells].all(axis=1)
        return rigid

    @cached_property
    def loads(self) -> FaceLoads:
        """The loads that are forces on nodes: all of them, or none where the scheme has stresses take them."""
        return face_loads(self.mesh, self.conditions if self.numerics.scheme.nodal_forces else ())

    @cached_property
    def initial_velocity(self) -> np.ndarray:
        """[m/s], shape (n, d)."""
        return self._initial("velocity", self.velocity, self.mesh.dim)

    @cached_property
    def initial_stress(self) -> np.ndarray:
        """[Pa], shape (n, s)."""
        return self._initial("stress", self.stress, self.mesh.continuum.stress_size)

    @cached_property
    def probe_identities(self) -> dict[str, str]:
        """What each probe computes, by its name, as it was when this was asked first: functions may keep notes."""
        return {probe.name: identity(probe.function) for probe in self.output.probes}

    @cached_property
    def initial_internals(self) -> np.ndarray:
        """The material's internal variables, in its order, shape (n, m)."""
        return self.material.initial_internals(self.mesh.nodes)

    def _initial(self, name: str, function: Callable | None, size: int) -> np.ndarray:
        if function is None:
            return np.zeros((len(self.mesh.nodes), size))
        if not callable(function):
            raise SceneError(name, function, "it must be a function of position f(x, y, …) or None")
        return field_of_position(name, function, self.mesh.nodes, size)
