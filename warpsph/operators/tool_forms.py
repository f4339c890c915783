"""The forms of tools on the device (`warpsph.scene.tool.Form`): where they are, how far from their surfaces."""

from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..physics.space import Space
from ..scene.scene import Scene
from ..scene.tool import Form
from ..state.clock import HALF

SLACK = 1e-6  # spacings
OWN = -1.0  # strength that stands for that of the soil


@cache
def exact_vector(space: Space) -> type:
    """A vector in float64."""
    return wp.types.vector(length=space.dim, dtype=wp.float64)


@cache
def tool_types(space: Space) -> type:
    """The tools, an entry each: a `Form`'s attributes, `function`s of time, and what their interfaces carry."""
    types = space.types

    @wp.struct
    class ToolTable:
        centre: wp.array(dtype=types.vector)
        axes: wp.array(dtype=types.tensor)
        half: wp.array(dtype=types.vector)
        rounding: wp.array(dtype=space.real)
        plane: wp.array(dtype=wp.int32)
        revolved: wp.array(dtype=wp.int32)
        function: wp.array2d(dtype=wp.int32)
        friction: wp.array(dtype=space.real)
        strength: wp.array(dtype=space.real)
        lag: wp.array(dtype=space.real)
        glued: wp.array(dtype=wp.int32)
        slack: wp.array(dtype=space.real)

    return ToolTable


def tool_table(scene: Scene, space: Space, device: wp.Device, offset: int):
    """The tools of a scene; `offset` is where their functions of time begin among the clock's."""
    mesh, table, types, d = scene.mesh, tool_types(space)(), space.types, space.dim
    forms = [tool.form(d) for tool in scene.tools]
    count, carried = len(forms), [tool.interface.carried for tool in scene.tools]
    centres = np.array([_from(mesh.middle, form) for form in forms]).reshape(count, d)
    strengths = [OWN if own.strength is None else own.strength for own in carried]
    for name, values, dtype, shape in (
        ("centre", centres, types.vector, count),
        ("axes", np.array([form.axes for form in forms]).reshape(count, d, d), types.tensor, count),
        ("half", np.array([form.half for form in forms]).reshape(count, d), types.vector, count),
        ("rounding", [form.rounding for form in forms], space.real, count),
        ("plane", [form.plane for form in forms], wp.int32, count),
        ("revolved", [form.revolved for form in forms], wp.int32, count),
        ("function", offset + scene.tool_functions[1], wp.int32, (count, d)),
        ("friction", [own.friction for own in carried], space.real, count),
        ("strength", strengths, space.real, count),
        ("lag", [own.lag for own in carried], space.real, count),
        ("slack", [_slack(scene, space, *part) for part in zip(forms, centres, strict=True)], space.real, count),
        ("glued", [own.glued for own in carried], wp.int32, count),
    ):
        numbers = np.array(values, dtype=np.int32 if dtype is wp.int32 else float)
        setattr(table, name, wp.array(numbers, dtype=dtype, shape=shape, device=device))
    return table


def _from(middle: np.ndarray, form: Form) -> np.ndarray:
    """Where a form is, seen from the body's middle; a plane where it is nearest to that, which keeps digits."""
    centre = form.centre - middle
    return form.axes[0] * (form.axes[0] @ centre) if form.plane else centre


def _slack(scene: Scene, space: Space, form: Form, centre: np.ndarray) -> float:
    """So near to a surface a node is on it [m]; positions of both are rounded as seen from the body's middle."""
    mesh, rounding = scene.mesh, 16.0 * float(np.finfo(space.precision.dtype).eps)
    sizes = [np.abs(mesh.nodes - mesh.middle).max(), np.abs(centre).max(), form.rounding]
    return max(SLACK * mesh.spacing, rounding * max(sizes))


@cache
def velocity_function(space: Space) -> wp.Function:
    """(tool, HALF or END, table, drive) → its velocity."""
    vector, ToolTable = space.types.vector, tool_types(space)

    @wp.func
    def velocity(t: int, when: int, table: ToolTable, drive: wp.array2d(dtype=space.real)):
        V = vector()
        for a in range(wp.static(space.dim)):
            V[a] = drive[when, table.function[t, a]]
        return V

    return velocity


@cache
def middle_function(space: Space) -> wp.Function:
    """(tool, table, travel) → where its middle is, from the body's."""
    ToolTable = tool_types(space)

    @wp.func
    def middle(t: int, table: ToolTable, travel: wp.array(dtype=exact_vector(space))):
        x = table.centre[t] + space.types.vector()
        for a in range(wp.static(space.dim)):
            x[a] = x[a] + space.real(travel[t][a])
        return x

    return middle


@cache
def move_kernel(space: Space):
    """Tools move on by Δt."""
    ToolTable, velocity, exact = tool_types(space), velocity_function(space), exact_vector(space)

    @forward_kernel
    def move(
        first: int,
        table: ToolTable,
        drive: wp.array2d(dtype=space.real),
        time_step: wp.array(dtype=space.real),
        travel: wp.array(dtype=exact),
    ):
        t = first + wp.tid()
        V, on = velocity(t, HALF, table, drive), travel[t] + exact()
        for a in range(wp.static(space.dim)):
            on[a] = on[a] + wp.float64(time_step[0]) * wp.float64(V[a])
        travel[t] = on

    return move


@cache
def distance_function(space: Space) -> wp.Function:
    """(x, middle, tool, table) → distance of x from the tool's surface, negative inside, and the way out there."""
    real, vector, d, ToolTable = space.real, space.types.vector, space.dim, tool_types(space)

    @wp.func
    def distance(x: vector, middle: vector, t: int, table: ToolTable):
        axes, half = table.axes[t], table.half[t]
        local = axes * (x - middle)
        if table.plane[t] == 1:
            return local[0] - table.rounding[t], axes[0]
        # `along` is measured: all coordinates, or of a round body that along its axis and the distance from it.
        along, width = vector(), wp.int32(d)
        for a in range(wp.static(d)):
            along[a] = wp.abs(local[a])
        if wp.static(d == 3):  # noqa: SIM102 — known as the kernel is built
            if table.revolved[t] == 1:
                along[1] = wp.sqrt(local[1] * local[1] + local[2] * local[2])
                width = wp.int32(2)
        out, most, side = vector(), along[0] - half[0], wp.int32(0)
        for a in range(wp.static(d)):
            if a < width:
                beyond = along[a] - half[a]
                out[a] = wp.max(beyond, real(0.0))
                if beyond > most:
                    most = beyond
                    side = a
        gap = wp.length(out)
        if most > real(0.0):
            out = out / gap
        else:
            gap = most
            out[side] = real(1.0)
        if wp.static(d == 3):  # noqa: SIM102 — known as the kernel is built
            if width == 2:
                radial = out[1] / wp.max(along[1], real(1e-30))
                out[1] = radial * local[1]
                out[2] = radial * local[2]
                if local[0] < real(0.0):
                    out[0] = -out[0]
                return gap - table.rounding[t], wp.transpose(axes) * out
        for a in range(wp.static(d)):
            if local[a] < real(0.0):
                out[a] = -out[a]
        return gap - table.rounding[t], wp.transpose(axes) * out

    return distance
