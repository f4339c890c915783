"""Tools (`warpsph.scene.tool`) as contact of nodes: impulses by which none of the boundary's nodes passes a surface.

A step pushes a node twice, half of it before it moves and half after. Each time what the tools do comes last, as an
impulse on the node alone. Before it moves (`stop`): the normal velocity is raised to what brings the node to the
surface by the end of the step, −gap/Δt, and no lower, with the tool's. After (`settle`): to the tool's own, of nodes
that were stopped. So nothing is penetrated but by rounding, nodes at rest are at rest, and no stiffness is needed.
Along the surface, what velocity there is between node and tool is taken off, by no more than the interface carries:
friction times the normal impulse, and strength times the node's share of the surface times ½Δt. No impulse does
work on a tool that stands still; where nodes land it takes the energy of their approach, of one layer of nodes.

A condition on velocities comes first: impulses push a node only in directions in which it is free.
"""

from functools import cache

import numpy as np
import warp as wp

from ..device.compiling import forward_kernel
from ..errors import SceneError
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..scene.face_loads import area_vectors, surface_rule
from ..scene.scene import Scene
from ..scene.tool import ENDLESS, TOUCHING
from ..state.cell_body import CellBody, cell_node_types
from ..state.clock import END, HALF, Clock
from .held import held_types

SLACK = 1e-6  # spacings: so near to a surface, on either side, a node is on it
RETURN = 0.1  # of a depth below that, by which a node comes out in a step
SWEEPS = 4  # over the tools, of nodes in a corner between some
LEAST_FREE = 1e-6  # of a normal's square along which conditions leave a node free: with less they hold it
OWN = -1.0  # strength that stands for that of the soil


@cache
def tool_types(space: Space) -> type:
    """The tools, an entry each: `Form` by `Form`, and what their interfaces carry."""
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
        glued: wp.array(dtype=wp.int32)
        slack: space.real

    return ToolTable


@cache
def contact_types(space: Space) -> type:
    """What the boundary's nodes remember: `touched` of each tool, 1 or 0; `impulse` [N s] and `moment` [N m s] about
    the tool's middle that each had from the node in the last step; `total` of all impulses; `settled`, what the
    last `settle` gave the node; work of all of it on the node [J]."""
    vector = space.types.vector

    @wp.struct
    class Contacts:
        node: wp.array(dtype=wp.int32)
        impulse: wp.array2d(dtype=vector)
        moment: wp.array2d(dtype=space.vec(3))
        total: wp.array2d(dtype=wp.types.vector(length=space.dim, dtype=wp.float64))
        settled: wp.array(dtype=vector)
        work: wp.array(dtype=wp.float64)

    return Contacts


class Tools:
    """The tools of a scene; without any it does nothing.

    Args:
        body: the body.
        clock: drives them.
        offset: where their functions of time begin among the clock's.
        held: the table of the conditions.

    Attributes:
        work: done by the tools on the body [J], a number a node of the boundary.
        travel: how far each has come [m], float64.
        kernels: what it launches.

    Raises:
        SceneError: a rough tool, and the material's law does not say how strong it is.
    """

    def __init__(self, body: CellBody, clock: Clock, offset: int, held):
        self._body, self._clock, self._held = body, clock, held
        scene, space, device, tools = body.scene, body.space, body.launcher.device, body.scene.tools
        nodes = np.unique(scene.mesh.faces) if tools else np.zeros(0, dtype=np.int64)
        rows, count, vector = len(nodes), len(tools), space.types.vector
        self._any, self._table = count > 0, _table(scene, space, device, offset)
        contacts = self._contacts = contact_types(space)()
        contacts.node = wp.array(nodes, dtype=wp.int32, device=device)
        real64 = wp.types.vector(length=space.dim, dtype=wp.float64)
        for name, dtype in (("impulse", vector), ("moment", space.vec(3)), ("total", real64)):
            setattr(contacts, name, wp.zeros((rows, count), dtype=dtype, device=device))
        contacts.settled = wp.zeros(rows, dtype=vector, device=device)
        self.work = contacts.work = wp.zeros(rows, dtype=wp.float64, device=device)
        self.travel = wp.zeros(count, dtype=real64, device=device)
        glued = [tool.interface.carried[2] for tool in tools]
        touched = np.zeros((rows, count), dtype=np.int32)
        for t in np.flatnonzero(glued):
            gaps = tools[t].form(space.dim).distance(scene.mesh.nodes[nodes])
            touched[:, t] = gaps <= TOUCHING * scene.mesh.spacing
        self._touched = wp.array(touched, dtype=wp.int32, device=device)
        strengths = [tool.interface.carried[1] for tool in tools]
        if None in strengths and body.law.flows and body.law.shear_strength is None:
            tool = tools[strengths.index(None)]
            name = type(scene.material).__name__
            raise SceneError("tools", tool, f"the law of {name} does not say its shear strength; take Adhesive")
        shares = any(strength != 0.0 for strength in strengths)
        self._areas = _Areas(body, nodes) if shares else None
        self.kernels = ()
        if self._any:
            self._stop = stop_kernel(space, body.law, shares, SWEEPS if count > 1 else 1)
            self._move = move_kernel(space)
            self._settle = settle_kernel(space, body.law, shares, SWEEPS if count > 1 else 1)
            own = self._areas.kernels if shares else ()
            self.kernels = (self._stop, self._move, self._settle, *own)
        spare = wp.zeros(1, dtype=vector, device=device)
        self._shares = self._areas.shares if shares else spare
        remembers = body.internals is not None
        self._internals = body.internals if remembers else wp.zeros(1, dtype=space.vec(1), device=device)

    def _inputs(self) -> list:
        body, clock = self._body, self._clock
        return [
            *(self._table, self.travel, clock.drive, clock.time_step, self._held, body.scene.damping),
            *(body.parameters, self._internals, self._shares, body.nodes, self._contacts, self._touched),
        ]

    def stop(self) -> None:
        """After the first push: let no node pass a tool in this step."""
        if not self._any:
            return
        launch, clock = self._body.launcher.launch, self._clock
        if self._areas:
            self._areas.measure()
        launch(self._stop, self.work, self._inputs())
        launch(self._move, self.travel, [self._table, clock.drive, clock.time_step, self.travel])

    def settle(self) -> None:
        """After the second push: let nodes that were stopped move as their tools do."""
        if self._any:
            self._body.launcher.launch(self._settle, self.work, self._inputs())

    def force(self, tool: int) -> np.ndarray:
        """Mean force of the body on a tool in the last step [N], shape (d,)."""
        return -self._per_step(self._contacts.impulse, tool)

    def torque(self, tool: int) -> np.ndarray:
        """Mean torque of the body on a tool about its middle in the last step [N m], shape (3,)."""
        return -self._per_step(self._contacts.moment, tool)

    def impulse(self, tool: int) -> np.ndarray:
        """What the body has given a tool since the start [N s], shape (d,)."""
        return -self._contacts.total.numpy()[:, tool].sum(axis=0)

    def middle(self, tool: int) -> np.ndarray:
        """Where a tool's middle is [m], of a plane the point that it is given by, shape (d,)."""
        dim = self._body.space.dim
        return self._body.scene.tools[tool].form(dim).centre + self.travel.numpy()[tool]

    def _per_step(self, impulses: wp.array, tool: int) -> np.ndarray:
        dt = float(self._clock.time_step.numpy()[0])
        return (
            impulses.numpy()[:, tool].astype(float).sum(axis=0) / dt if dt > 0.0 else np.zeros(impulses.shape[1:])
        )


def _table(scene: Scene, space: Space, device: wp.Device, offset: int):
    tools, mesh, table, types = scene.tools, scene.mesh, tool_types(space)(), space.types
    count, d = len(tools), space.dim
    forms = [tool.form(d) for tool in tools]
    carried = [tool.interface.carried for tool in tools]
    centres = np.array([_near(form, mesh.middle) for form in forms]).reshape(count, d)
    strengths = [OWN if strength is None else strength for _, strength, _ in carried]
    for name, values, dtype, shape in (
        ("centre", centres, types.vector, count),
        ("axes", np.array([form.axes for form in forms]).reshape(count, d, d), types.tensor, count),
        ("half", np.array([form.half for form in forms]).reshape(count, d), types.vector, count),
        ("rounding", [form.rounding for form in forms], space.real, count),
        ("plane", [form.plane for form in forms], wp.int32, count),
        ("revolved", [form.revolved for form in forms], wp.int32, count),
        ("function", offset + scene.tool_functions[1], wp.int32, (count, d)),
        ("friction", [friction for friction, _, _ in carried], space.real, count),
        ("strength", strengths, space.real, count),
        ("glued", [glued for _, _, glued in carried], wp.int32, count),
    ):
        numbers = np.array(values, dtype=float if dtype is not wp.int32 else np.int32)
        setattr(table, name, wp.array(numbers, dtype=dtype, shape=shape, device=device))
    # Rounding of positions: they and the tools' are counted from the body's middle.
    sizes = [np.abs(mesh.nodes - mesh.middle).max(), *np.abs(centres).ravel(), *(form.rounding for form in forms)]
    table.slack = max(SLACK * mesh.spacing, 16.0 * float(np.finfo(space.precision.dtype).eps) * max(sizes))
    return table


def _near(form, middle: np.ndarray) -> np.ndarray:
    """Where a form is, seen from the body's middle; a plane where it is nearest, so that digits are kept."""
    centre = form.centre - middle
    return form.axes[0] * (form.axes[0] @ centre) if form.plane else centre


class _Areas:
    """Area vectors of boundary faces, each corner's share, out of which nodes gather what part of a surface is theirs."""

    def __init__(self, body: CellBody, nodes: np.ndarray):
        mesh, space, device = body.scene.mesh, body.space, body.launcher.device
        self._body = body
        outward = np.sum(area_vectors(mesh.nodes[mesh.faces], mesh.kind) * mesh.face_normals(), axis=1)
        self._faces = wp.array(mesh.faces, dtype=wp.int32, device=device)
        self._sign = wp.array(np.sign(outward), dtype=space.real, device=device)
        self._parts = wp.zeros(mesh.faces.shape, dtype=space.types.vector, device=device)
        place = np.argsort(mesh.faces.ravel(), kind="stable")
        first = np.searchsorted(mesh.faces.ravel()[place], np.append(nodes, len(mesh.nodes)))
        self._place = wp.array(place, dtype=wp.int32, device=device)
        self._first = wp.array(first, dtype=wp.int32, device=device)
        self.shares = wp.zeros(len(nodes), dtype=space.types.vector, device=device)
        self._part, self._gather = part_kernel(space, body.kind), share_kernel(space, mesh.faces.shape[1])
        self.kernels = (self._part, self._gather)

    def measure(self) -> None:
        """Measure them where the nodes are."""
        launch, nodes = self._body.launcher.launch, self._body.nodes
        launch(self._part, self._sign, [self._faces, self._sign, nodes, self._parts])
        launch(self._gather, self.shares, [self._first, self._place, self._parts, self.shares])


@cache
def part_kernel(space: Space, kind: CellKind):
    """∫ N_k n dA of each corner k of each boundary face, n outwards."""
    real, types, d = space.real, space.types, space.dim
    CellNodes, rule = cell_node_types(space)[1], surface_rule(kind)
    size, points = len(kind.faces[0]), len(rule)
    weights = space.vec(points)(*[weight for weight, _, _ in rule])
    shares = space.mat(points, size)(*np.ravel([share for _, share, _ in rule]).tolist())
    axes = max(1, d - 1)  # Warp has no matrix without columns
    slopes = np.zeros((points, size, axes))
    slopes[:, :, : d - 1] = [slope for _, _, slope in rule]
    Along = space.mat(axes, d)
    slope_at = space.mat(points * size, axes)(*slopes.ravel().tolist())

    @wp.func
    def area_vector(along: Along):
        if wp.static(d == 1):
            return types.vector(real(1.0))
        elif wp.static(d == 2):
            return types.vector(along[0, 1], -along[0, 0])
        else:
            return wp.cross(along[0], along[1])

    @forward_kernel
    def part(
        first: int,
        faces: wp.array2d(dtype=wp.int32),
        sign: wp.array(dtype=real),
        nodes: CellNodes,
        parts: wp.array2d(dtype=types.vector),
    ):
        f = first + wp.tid()
        for k in range(wp.static(size)):
            parts[f, k] = types.vector()
        for q in range(wp.static(points)):
            along = Along()
            for k in range(wp.static(size)):
                along += wp.outer(slope_at[wp.static(size) * q + k], nodes.point[faces[f, k]].x)
            area = (sign[f] * weights[q]) * area_vector(along)
            for k in range(wp.static(size)):
                parts[f, k] = parts[f, k] + shares[q, k] * area

    return part


@cache
def share_kernel(space: Space, size: int):
    """Σ of the parts of faces around each boundary node."""
    vector = space.types.vector

    @forward_kernel
    def share(
        first: int,
        start: wp.array(dtype=wp.int32),
        place: wp.array(dtype=wp.int32),
        parts: wp.array2d(dtype=vector),
        shares: wp.array(dtype=vector),
    ):
        row = first + wp.tid()
        total = vector()
        for entry in range(start[row], start[row + 1]):
            face = place[entry] // wp.static(size)
            total += parts[face, place[entry] - wp.static(size) * face]
        shares[row] = total

    return share


@cache
def distance_function(space: Space) -> wp.Function:
    """(x, middle, tool, table) → distance of x from the tool's surface, negative inside, and the way out there."""
    real, vector, d = space.real, space.types.vector, space.dim
    ToolTable = tool_types(space)

    @wp.func
    def distance(x: vector, middle: vector, t: int, table: ToolTable):
        axes, half = table.axes[t], table.half[t]
        local = axes * (x - middle)
        if table.plane[t] == 1:
            return local[0], axes[0]
        away, width = vector(), int(wp.static(d))  # unit vectors from the middle, along what is measured
        across = real(0.0)
        if wp.static(d == 3):
            if table.revolved[t] == 1:
                across = wp.sqrt(local[1] * local[1] + local[2] * local[2])
                width = 2
        # outside: the nearest point is on a side, an edge or a corner; inside on the nearest side
        beyond, most, side = vector(), real(-1e38), 0
        for a in range(wp.static(d)):
            if a < width:
                along = wp.abs(local[a])
                if a == 1 and width == 2 and wp.static(d == 3):
                    along = across
                beyond[a] = along - half[a]
                if beyond[a] > most:
                    most = beyond[a]
                    side = a
        if most > real(0.0):
            for a in range(wp.static(d)):
                if a < width:
                    away[a] = wp.max(beyond[a], real(0.0))
        else:
            away[side] = real(1.0)
        length = wp.length(away)
        away = away / length
        gap = wp.where(most > real(0.0), length, most) - table.rounding[t]
        if wp.static(d == 3):
            if width == 2:
                radial = away[1] / wp.max(across, real(1e-30))
                outward = vector()
                outward[0] = wp.where(local[0] < real(0.0), -away[0], away[0])
                outward[1] = radial * local[1]
                outward[2] = radial * local[2]
                return gap, wp.transpose(axes) * outward
        for a in range(wp.static(d)):
            if local[a] < real(0.0):
                away[a] = -away[a]
        return gap, wp.transpose(axes) * away

    return distance


@cache
def exact_function(space: Space) -> wp.Function:
    """A vector → the same in float64."""
    real64 = wp.types.vector(length=space.dim, dtype=wp.float64)

    @wp.func
    def exact(v: space.types.vector):
        result = real64()
        for a in range(wp.static(space.dim)):
            result[a] = wp.float64(v[a])
        return result

    return exact


@cache
def unit_function(space: Space) -> wp.Function:
    """() → 1."""

    @wp.func
    def unit():
        P = space.types.tensor()
        for a in range(wp.static(space.dim)):
            P[a, a] = space.real(1.0)
        return P

    return unit


@cache
def meet_function(space: Space) -> wp.Function:
    """(v, P, V, n, least normal velocity of v − V, μ, slip that strength stops, whether it pulls) → v, whether they met."""
    real, vector = space.real, space.types.vector

    @wp.func
    def meet(
        v: vector,
        P: space.types.tensor,
        V: vector,
        n: vector,
        least: real,
        friction: real,
        stopped: real,
        pulls: bool,
    ):
        along = P * n
        free = wp.dot(n, along)
        needed = least - wp.dot(v - V, n)
        if free < real(LEAST_FREE) or not (needed > real(0.0) or pulls):
            return v, False
        pressed = needed / free
        w = v + pressed * along
        slip = P * (w - V)
        slip = slip - (wp.dot(n, slip) / free) * along
        speed = wp.length(slip)
        most = friction * pressed + stopped
        if speed > most:
            slip = (most / speed) * slip
        return w - slip, True

    return meet


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
    real, vector, ToolTable = space.real, space.types.vector, tool_types(space)
    real64 = wp.types.vector(length=space.dim, dtype=wp.float64)

    @wp.func
    def middle(t: int, table: ToolTable, travel: wp.array(dtype=real64)):
        x = table.centre[t]
        for a in range(wp.static(space.dim)):
            x[a] = x[a] + real(travel[t][a])
        return x

    return middle


@cache
def move_kernel(space: Space):
    """Tools move on by Δt."""
    ToolTable, velocity = tool_types(space), velocity_function(space)
    real64 = wp.types.vector(length=space.dim, dtype=wp.float64)

    @forward_kernel
    def move(
        first: int,
        table: ToolTable,
        drive: wp.array2d(dtype=space.real),
        time_step: wp.array(dtype=space.real),
        travel: wp.array(dtype=real64),
    ):
        t = first + wp.tid()
        V, on = velocity(t, HALF, table, drive), travel[t]
        for a in range(wp.static(space.dim)):
            on[a] = on[a] + wp.float64(time_step[0]) * wp.float64(V[a])
        travel[t] = on

    return move


@cache
def arm_function(space: Space) -> wp.Function:
    """(arm, impulse) → their vector product; of the plane its part along z."""
    vector, d, moment = space.types.vector, space.dim, space.vec(3)

    @wp.func
    def moment_of(arm: vector, impulse: vector):
        result = moment()
        if wp.static(d == 2):
            result[2] = arm[0] * impulse[1] - arm[1] * impulse[0]
        if wp.static(d == 3):
            result = wp.cross(arm, impulse)
        return result

    return moment_of


@cache
def strength_function(space: Space, law: Law, strong: bool) -> wp.Function:
    """(strength of a tool, σ, internals, Parameters) → strength of the interface [Pa], without end if it never slips."""
    real, internal = space.real, space.vec(max(1, len(law.internals)))

    @wp.func
    def strength_of(given: real, sigma: space.types.stress, own: internal, material: law.Parameters):
        if given >= real(0.0):
            return given
        if wp.static(law.flows):
            return law.shear_strength(sigma, own, material)
        return real(1e30)

    @wp.func
    def none(given: real, sigma: space.types.stress, own: internal, material: law.Parameters):
        return real(0.0)

    return strength_of if strong and (not law.flows or law.shear_strength is not None) else none


@cache
def stop_kernel(space: Space, law: Law, strong: bool, sweeps: int):
    """v^{n+1/2} of boundary nodes so that none is behind a tool at t^{n+1}; the books of the impulses around tⁿ."""
    real, types, (Held, _) = space.real, space.types, held_types(space)
    vector, internal, moment = types.vector, space.vec(max(1, len(law.internals))), space.vec(3)
    CellNodes, ToolTable, Contacts = cell_node_types(space)[1], tool_types(space), contact_types(space)
    distance, meet, velocity = distance_function(space), meet_function(space), velocity_function(space)
    middle, moment_of = middle_function(space), arm_function(space)
    strength_of, remembers = strength_function(space, law, strong), len(law.internals) > 0
    unit, exact = unit_function(space), exact_function(space)
    real64 = wp.types.vector(length=space.dim, dtype=wp.float64)

    @forward_kernel
    def stop(
        first: int,
        table: ToolTable,
        travel: wp.array(dtype=real64),
        drive: wp.array2d(dtype=real),
        time_step: wp.array(dtype=real),
        held: Held,
        damping: real,
        material: law.Parameters,
        internals: wp.array(dtype=internal),
        shares: wp.array(dtype=vector),
        nodes: CellNodes,
        contacts: Contacts,
        touched: wp.array2d(dtype=wp.int32),
    ):
        row = first + wp.tid()
        dt = time_step[0]
        if dt == real(0.0):
            return
        i, h = contacts.node[row], real(0.5) * dt
        mass, point, before = nodes.mass[i], nodes.point[i], nodes.half[i].v
        P = unit()
        if held.row[i] >= 0:
            P = held.projector[held.row[i]]
        decay = wp.exp(-damping * h)
        v, own = before + vector(), internal()
        if wp.static(remembers):
            own = internals[i]
        for t in range(touched.shape[1]):
            contacts.impulse[row, t] = vector()
            contacts.moment[row, t] = moment()
        met = 0
        for sweep in range(wp.static(sweeps)):
            for t in range(touched.shape[1]):
                at = middle(t, table, travel)
                gap, n = distance(point.x, at, t, table)
                V = velocity(t, HALF, table, drive)
                sticks = table.glued[t] == 1 and touched[row, t] == 1
                least = -gap / dt
                if gap <= table.slack and not sticks:
                    least = wp.max(real(RETURN) * least - real(RETURN) * table.slack / dt, real(0.0))
                stopped = wp.where(table.glued[t] == 1, real(ENDLESS), real(0.0))
                if wp.static(strong):
                    area = wp.max(-wp.dot(shares[row], n), real(0.0))
                    sigma = space.phi.stress(point.phi)
                    stopped += strength_of(table.strength[t], sigma, own, material) * area * h / mass
                if sweep > 0 and table.glued[t] == 0:
                    stopped = real(0.0)
                w, meets = meet(v, P, V, n, least, table.friction[t], stopped, sticks)
                if meets:
                    met = 1
                    push = (mass / decay) * (w - v)
                    contacts.impulse[row, t] = contacts.impulse[row, t] + push
                    contacts.moment[row, t] = contacts.moment[row, t] + moment_of(point.x - at, push)
                    v = w
                if sweep == 0:
                    touched[row, t] = wp.where(meets, 1, 0)
                elif meets:
                    touched[row, t] = 1
        settled = contacts.settled[row]
        if met == 0 and wp.length_sq(settled) == real(0.0):
            return
        # The impulses around tⁿ, in the leapfrog's terms: what came after the last push, and what comes now.
        start, pushed = space.phi.velocity(point.phi), (mass / decay) * (v - before)
        last = (start - h * nodes.acceleration[i] - settled / mass) / decay  # v^{n−1/2}
        back, on = P * (start - last), P * (v - start)
        done = wp.dot(pushed, v) + real(0.5) * mass * (wp.length_sq(back) - wp.length_sq(on))
        contacts.work[row] = contacts.work[row] + wp.float64(done)
        nodes.half[i].v = v  # last, since `before` is read where it stands
        nodes.half[i].x = point.x + h * v
        for t in range(touched.shape[1]):
            contacts.total[row, t] = contacts.total[row, t] + exact(contacts.impulse[row, t])

    return stop


@cache
def settle_kernel(space: Space, law: Law, strong: bool, sweeps: int):
    """v^{n+1} of nodes that were stopped: at most towards their tools as these move."""
    real, types, (Held, _) = space.real, space.types, held_types(space)
    vector, internal = types.vector, space.vec(max(1, len(law.internals)))
    CellNodes, ToolTable, Contacts = cell_node_types(space)[1], tool_types(space), contact_types(space)
    distance, meet, velocity = distance_function(space), meet_function(space), velocity_function(space)
    middle, moment_of = middle_function(space), arm_function(space)
    strength_of, remembers = strength_function(space, law, strong), len(law.internals) > 0
    unit, exact = unit_function(space), exact_function(space)
    real64 = wp.types.vector(length=space.dim, dtype=wp.float64)

    @forward_kernel
    def settle(
        first: int,
        table: ToolTable,
        travel: wp.array(dtype=real64),
        drive: wp.array2d(dtype=real),
        time_step: wp.array(dtype=real),
        held: Held,
        damping: real,
        material: law.Parameters,
        internals: wp.array(dtype=internal),
        shares: wp.array(dtype=vector),
        nodes: CellNodes,
        contacts: Contacts,
        touched: wp.array2d(dtype=wp.int32),
    ):
        row = first + wp.tid()
        dt = time_step[0]
        if dt == real(0.0):
            return
        i, h = contacts.node[row], real(0.5) * dt
        mass, point = nodes.mass[i], nodes.point[i]
        before = space.phi.velocity(point.phi)
        P = unit()
        if held.row[i] >= 0:
            P = held.projector[held.row[i]]
        v, own = before + vector(), internal()
        if wp.static(remembers):
            own = internals[i]
        for sweep in range(wp.static(sweeps)):
            for t in range(touched.shape[1]):
                if touched[row, t] == 1:
                    at = middle(t, table, travel)
                    _, n = distance(point.x, at, t, table)
                    V = velocity(t, END, table, drive)
                    stopped = wp.where(table.glued[t] == 1, real(ENDLESS), real(0.0))
                    if wp.static(strong):
                        area = wp.max(-wp.dot(shares[row], n), real(0.0))
                        sigma = space.phi.stress(point.phi)
                        stopped += strength_of(table.strength[t], sigma, own, material) * area * h / mass
                    if sweep > 0 and table.glued[t] == 0:
                        stopped = real(0.0)
                    w, meets = meet(v, P, V, n, real(0.0), table.friction[t], stopped, table.glued[t] == 1)
                    if meets:
                        push = mass * (w - v)
                        contacts.impulse[row, t] = contacts.impulse[row, t] + push
                        contacts.moment[row, t] = contacts.moment[row, t] + moment_of(point.x - at, push)
                        contacts.total[row, t] = contacts.total[row, t] + exact(push)
                        v = w
        pushed = mass * (v - before)
        contacts.settled[row] = pushed
        if wp.length_sq(pushed) > real(0.0):
            nodes.point[i].phi = space.phi.with_velocity(point.phi, v)
            contacts.work[row] = contacts.work[row] + wp.float64(wp.dot(pushed, nodes.half[i].v))

    return settle
