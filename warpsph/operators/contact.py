"""Contact of a body's nodes with tools: what `warpsph.operators.tools` launches, and its rules."""

from functools import cache

import warp as wp

from ..device.compiling import forward_kernel
from ..materials.law import Law
from ..physics.space import Space
from ..scene.tool import ENDLESS
from ..state.cell_body import cell_node_types
from ..state.clock import END, HALF
from .held import held_types
from .tool_forms import distance_function, exact_vector, middle_function, tool_types, velocity_function

RETURN = 0.1  # of a depth below the slack, by which a node comes out in a step
NEVER = -1.0
LEAST_FREE = 1e-6  # of a normal's square along which conditions leave a node free: with less they hold it


@cache
def contact_types(space: Space) -> type:
    """What nodes that may meet tools remember, a row a node, a column a tool.

    `node`; `impulse` on it and its `moment` about the tool's middle, in the last step, and `total` of the
    former since the start; `pressed`, the force that friction goes by over the node's mass, `NEVER` before it has
    touched the tool; `last`, v^{n−1/2}; `settled`, what the last `settle` gave the node in all; `work` [J].
    """
    vector = space.types.vector

    @wp.struct
    class Contacts:
        node: wp.array(dtype=wp.int32)
        impulse: wp.array2d(dtype=vector)
        moment: wp.array2d(dtype=space.vec(3))
        total: wp.array2d(dtype=exact_vector(space))
        pressed: wp.array2d(dtype=space.real)
        last: wp.array(dtype=vector)
        settled: wp.array(dtype=vector)
        work: wp.array(dtype=wp.float64)

    return Contacts


@cache
def meet_function(space: Space) -> wp.Function:
    """(v, P, V, n, least, pulls, μ, pressed, h, lag, stopped) → v when the node has met the tool, the force per
    mass that friction goes by then, and whether they have met.

    v and P are the node's velocity and in which directions it is free, V the tool's velocity, n the way out of it,
    and `least` the least that (v − V)·n may be; a tool that `pulls` holds back as well. That force, `pressed`
    before, follows with a lag what presses for the time h; slip is stopped up to μ times its impulse + `stopped`.
    """
    real, vector = space.real, space.types.vector

    @wp.func
    def meet(
        v: vector,
        P: space.types.tensor,
        V: vector,
        n: vector,
        least: real,
        pulls: bool,
        friction: real,
        pressed: real,
        h: real,
        lag: real,
        stopped: real,
    ):
        keep = real(0.0)
        if lag > real(0.0):
            keep = wp.exp(-h / lag)
        along = P * n
        free = wp.dot(n, along)
        needed = least - wp.dot(v - V, n)
        if free < real(LEAST_FREE) or not (needed > real(0.0) or pulls):
            return v, keep * pressed, wp.int32(0)
        push = needed / free
        w, force = v + push * along, push / h
        mean, left = force, pressed - force
        if lag > real(0.0):
            mean += (real(1.0) - keep) * lag / h * left
            force += keep * left
        slip = P * (w - V)
        slip = slip - (wp.dot(n, slip) / free) * along
        speed, most = wp.length(slip), wp.max(friction * mean * h, real(0.0)) + stopped
        if speed > most:
            slip = (most / speed) * slip
        return w - slip, force, wp.int32(1)

    return meet


@cache
def vector_functions(space: Space) -> tuple[wp.Function, wp.Function, wp.Function]:
    """() → 1; (arm, impulse) → their vector product, of the plane its part along z; a vector → in float64."""
    types, d, moment, exact = space.types, space.dim, space.vec(3), exact_vector(space)

    @wp.func
    def unit():
        P = types.tensor()
        for a in range(wp.static(d)):
            P[a, a] = space.real(1.0)
        return P

    @wp.func
    def moment_of(arm: types.vector, impulse: types.vector):
        result = moment()
        if wp.static(d == 2):
            result[2] = arm[0] * impulse[1] - arm[1] * impulse[0]
        if wp.static(d == 3):
            result = wp.cross(arm, impulse)
        return result

    @wp.func
    def exactly(v: types.vector):
        result = exact()
        for a in range(wp.static(d)):
            result[a] = wp.float64(v[a])
        return result

    return unit, moment_of, exactly


@cache
def strength_function(space: Space, law: Law) -> wp.Function:
    """(strength of a tool, σ, internals, Parameters) → that of the interface [Pa], endless if it never slips."""
    real, internal = space.real, space.vec(max(1, len(law.internals)))

    @wp.func
    def strength(given: real, sigma: space.types.stress, own: internal, material: law.Parameters):
        if given >= real(0.0):
            return given
        if wp.static(law.shear_strength is not None):
            return law.shear_strength(sigma, own, material)
        return real(ENDLESS)

    return strength


@cache
def contact_kernel(space: Space, law: Law, *, ends: bool, strong: bool, sweeps: int):
    """`stop`: v^{n+1/2}, so that no node is behind a tool at t^{n+1}. Or, as the step `ends`, `settle`: v^{n+1}.

    Args:
        space: the continuum and the precision.
        law: the material's.
        ends: which of both.
        strong: whether interfaces have a strength at all.
        sweeps: over the tools, for nodes in a corner between some.
    """
    real, types, (Held, _) = space.real, space.types, held_types(space)
    vector, internal, moment = types.vector, space.vec(max(1, len(law.internals))), space.vec(3)
    CellNodes, ToolTable, Contacts = cell_node_types(space)[1], tool_types(space), contact_types(space)
    distance, meet, velocity = distance_function(space), meet_function(space), velocity_function(space)
    middle, strength, (unit, moment_of, exactly) = (
        middle_function(space),
        strength_function(space, law),
        vector_functions(space),
    )
    when, remembers = END if ends else HALF, len(law.internals) > 0

    @forward_kernel
    def contact(
        first: int,
        table: ToolTable,
        travel: wp.array(dtype=exact_vector(space)),
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
        meeting: wp.array(dtype=wp.int32),
    ):
        row, dt = first + wp.tid(), time_step[0]
        if dt == real(0.0):
            return
        i = contacts.node[row]
        h, met_before = real(0.5) * dt, meeting[row] + 0  # a value: else it is read where it is asked for
        if met_before == 0:  # most nodes are far away
            if wp.static(ends):
                return
            near = wp.int32(0)
            for t in range(touched.shape[1]):
                gap, n = distance(nodes.point[i].x, middle(t, table, travel), t, table)
                away = wp.dot(nodes.half[i].v - velocity(t, HALF, table, drive), n)
                if gap + dt * wp.min(away, real(0.0)) <= table.slack[t]:
                    near = wp.int32(1)
            if near == 0:
                return
        mass, x, own = nodes.mass[i], nodes.point[i].x, internal()
        start, sigma = space.phi.velocity(nodes.point[i].phi), space.phi.stress(nodes.point[i].phi)
        before, decay = start, real(1.0)
        if wp.static(not ends):
            before = nodes.half[i].v + vector()
            decay = wp.exp(-damping * h)
            meeting[row] = 0
            for t in range(touched.shape[1]):
                contacts.impulse[row, t] = vector()
                contacts.moment[row, t] = moment()
        if wp.static(remembers):
            own = internals[i]
        P = unit()
        if held.row[i] >= 0:
            P = held.projector[held.row[i]]
        v, met, rounds = before + vector(), wp.int32(0), wp.int32(sweeps)
        for sweep in range(rounds):
            pushes = wp.int32(0)
            for t in range(touched.shape[1]):
                if wp.static(not ends) or touched[row, t] == 1:
                    at = middle(t, table, travel)
                    gap, n = distance(x, at, t, table)
                    V, least = velocity(t, wp.static(when), table, drive), real(0.0)
                    pulls = table.glued[t] == 1 and touched[row, t] == 1
                    if wp.static(not ends):
                        if gap > table.slack[t] or pulls:
                            least = -gap / dt
                        else:
                            least = wp.max(real(-RETURN) * (gap + table.slack[t]) / dt, real(0.0))
                    stopped = wp.where(table.glued[t] == 1, real(ENDLESS), real(0.0))
                    if wp.static(strong) and sweep == 0:
                        area = wp.max(-wp.dot(shares[i], n), real(0.0))
                        stopped += strength(table.strength[t], sigma, own, material) * area * h / mass
                    pressed, lag = contacts.pressed[row, t] + real(0.0), table.lag[t] + real(0.0)
                    if pressed < real(0.0):  # it has not touched it yet
                        pressed = real(0.0)
                        if gap <= table.slack[t]:
                            lag = real(0.0)
                    if sweep > 0:
                        lag = real(0.0)
                    friction = table.friction[t]
                    w, force, meets = meet(v, P, V, n, least, pulls, friction, pressed, h, lag, stopped)
                    if sweep == 0:
                        if pressed > real(0.0) or meets == 1:
                            contacts.pressed[row, t] = force
                        if wp.static(not ends) and force > real(0.0):
                            meeting[row] = 1
                    if meets == 1:
                        push = (mass / decay) * (w - v)
                        contacts.impulse[row, t] = contacts.impulse[row, t] + push
                        contacts.moment[row, t] = contacts.moment[row, t] + moment_of(x - at, push)
                        contacts.total[row, t] = contacts.total[row, t] + exactly(push)
                        v = w
                        met = wp.int32(1)
                        pushes = wp.int32(1)
                        if wp.static(not ends):
                            meeting[row] = 1
                    if wp.static(not ends):
                        if sweep == 0:
                            touched[row, t] = meets
                        elif meets == 1:
                            touched[row, t] = 1
            if pushes == 0:
                break
        pushed = (mass / decay) * (v - before)
        if wp.static(ends):
            contacts.settled[row] = pushed
            contacts.last[row] = nodes.half[i].v
            if met == 1:
                done = wp.dot(pushed, nodes.half[i].v)
                contacts.work[row] = contacts.work[row] + wp.float64(done)
                nodes.point[i].phi = space.phi.with_velocity(nodes.point[i].phi, v)
        else:
            settled = contacts.settled[row]
            if met == 1 or wp.length_sq(settled) > real(0.0):
                # The impulses around tⁿ, in the leapfrog's terms: what the step before ended with, and these.
                last = contacts.last[row] + vector()  # v^{n−1/2}
                if met_before == 0:
                    last = (start - h * nodes.acceleration[i]) / decay
                back, on = P * (start - last), P * (v - start)
                done = wp.dot(pushed, v) + real(0.5) * mass * (wp.length_sq(back) - wp.length_sq(on))
                contacts.work[row] = contacts.work[row] + wp.float64(done)
                nodes.half[i].v = v
                nodes.half[i].x = x + h * v

    return contact
