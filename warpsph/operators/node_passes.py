"""The passes over nodes of a step of the scheme `cells`; what they are about is said in `cell_passes`."""

from functools import cache

import warp as wp

from ..device.arrays import packed
from ..device.compiling import forward_kernel
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cell_body import CONDITIONS, DAMPING, ELASTIC, FLOW, FORCES, cell_node_types, enter
from ..state.cells import NodeCells, cell_in_slot, corner_place
from ..state.clock import END, HALF, NON_FINITE, STAGES, TOO_FAST
from .cell_numbers import tensors_of
from .cell_shape import cell_shape
from .conditions import MOST_A_STEP
from .held import held_types
from .sharpening import around, sharp_types

CALMING = 0.9  # a step: how fast a node that has flowed is taken for an elastic one again
MOST_STRAIN = 0.02  # between two looks at the time step


@cache
def kick_kernel(space: Space, moves: bool):
    """v^{n+1/2} = e^{−cΔt/2} (v + ½Δt a), held; x^{n+1/2} = x + ½Δt v^{n+1/2}."""
    real, CellNodes, (Held, hold) = space.real, cell_node_types(space)[1], held_types(space)
    packed_nodes = packed(CellNodes)

    @forward_kernel
    def kick(first: int, held: Held, damping: real, time_step: wp.array(dtype=real), nodes: CellNodes):
        i = first + wp.tid()
        packed_nodes(nodes)
        h = real(0.5) * time_step[0]
        point = nodes.point[i]
        start = space.phi.velocity(point.phi)
        last = start - nodes.half[i].v
        free = wp.exp(-damping * h) * (start + h * nodes.acceleration[i])
        v = hold(i, free, HALF, held)
        nodes.half[i].v = v
        if wp.static(moves):
            nodes.half[i].x = point.x + h * v
        else:
            nodes.half[i].x = point.x
        row = held.row[i]
        if row >= 0:  # what holds it pushes before the damping, and takes the jumps of what it holds
            P, jump = held.projector[row], v - start
            jumps = real(0.5) * (wp.length_sq(last - P * last) - wp.length_sq(jump - P * jump))
            pushes = wp.exp(damping * h) * wp.dot(v - free, v)
            enter(CONDITIONS, i, wp.float64(nodes.mass[i] * (pushes + jumps)), nodes.books)

    return kick


@cache
def rate_kernel(space: Space, kind: CellKind, slots: bool):
    """V and L of each node from its cells."""
    real, types, shape, CellNodes = space.real, space.types, cell_shape(space, kind), cell_node_types(space)[1]
    cell_at, place_of = cell_in_slot(kind), corner_place(kind)
    sign, (tensor_at, _) = shape.signs, tensors_of(space)
    packed_nodes, packed_numbers = packed(CellNodes), packed(wp.array2d(dtype=real))

    @wp.func
    def corner_gradient(c: int, k: int, numbers: wp.array2d(dtype=real)):
        g = tensor_at(c, 0, numbers)
        if wp.static(shape.partial > 0):
            share = numbers[c, 2]
            for p in range(wp.static(shape.partial)):
                g += (share * sign[k, p]) * tensor_at(c, 1 + p, numbers)
        return g

    @forward_kernel
    def rate(first: int, least_volume: real, table: NodeCells, numbers: wp.array2d(dtype=real), nodes: CellNodes):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_numbers(numbers)
        volume, weighted = real(0.0), types.tensor()
        if wp.static(slots):
            for k in range(wp.static(kind.corners)):
                c = cell_at(i, k, table)
                if c >= 0:
                    volume += numbers[c, 0]
                    weighted += corner_gradient(c, k, numbers)
        else:  # the same, entry by entry
            for entry in range(table.first[i], table.first[i + 1]):
                c, k = place_of(entry, table)
                volume += numbers[c, 0]
                weighted += corner_gradient(c, k, numbers)
        volume = wp.max(volume, least_volume * nodes.mass[i])
        nodes.volume[i] = volume
        nodes.velocity_gradient[i] = weighted / volume

    return rate


@cache
def stress_kernel(space: Space, kind: CellKind, law: Law, *, slots: bool, moves: bool, sharp: bool):
    """L sharpened; σ turned, strained and relaxed; the node moves on to t^{n+1}."""
    real, types, d = space.real, space.types, space.dim
    CellNodes, Means = cell_node_types(space)[1], sharp_types(space)
    internal, remembers = space.vec(max(1, len(law.internals))), len(law.internals) > 0
    packed_nodes, packed_means = packed(CellNodes), packed(Means)
    sums = around(space, kind, slots, types.tensor)

    @forward_kernel
    def stress(
        first: int,
        material: law.Parameters,
        time_step: wp.array(dtype=real),
        table: NodeCells,
        means: Means,
        nodes: CellNodes,
        internals: wp.array(dtype=internal),
        outdated: wp.array(dtype=wp.int32),
        faults: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_means(means)
        dt, volume, plain = time_step[0], nodes.volume[i], nodes.velocity_gradient[i]
        rate = space.stress.elastic_rate(plain, material.lame, material.shear, material.young)
        nodes.elastic_rate[i] = rate  # what is rough departs from this one
        L = plain + types.tensor()
        if wp.static(sharp):
            weight, mean = sums(i, table, means.weight, means.rate)
            L += (weight * plain - mean) / volume
            nodes.velocity_gradient[i] = L
            rate = space.stress.elastic_rate(L, material.lame, material.shear, material.young)
        half, point = nodes.half[i], nodes.point[i]
        turned, Q = space.phi.stress(point.phi), types.tensor()
        if wp.static(moves and d > 1):
            # L is in the axes of the half step: half of the turn comes before straining, half after it. With all
            # of it before, stresses lag behind their forces, and pump energy into a body that spins.
            Q = space.algebra.rotation(L, real(0.5) * dt)
            turned = space.stress.transform(turned, Q)
        trial = turned + dt * rate
        sigma, taken = trial, wp.float64(0.0)
        if wp.static(law.flows):
            own = internal()
            if wp.static(remembers):
                own = internals[i]
            sigma, own = law.relax(trial, own, material, dt)
            if wp.static(remembers):
                internals[i] = own
            lost, flowed = trial - sigma, real(CALMING) * nodes.flowed[i]
            if wp.length_sq(lost) > real(0.0):
                flowed = real(1.0)
                work = space.stress.complementary(
                    turned + sigma, lost, material.lame, material.shear, material.young
                )
                taken = wp.float64(real(0.5) * volume * work)
                enter(FLOW, i, taken, nodes.books)
            nodes.flowed[i] = flowed
        power, middle = real(0.0), turned + sigma
        for a in range(wp.static(d)):  # 2 σ : L
            power += space.stress.traction(middle, L[a])[a]
        enter(ELASTIC, i, wp.float64(real(0.5) * dt * volume * power) - taken, nodes.books)
        if wp.static(moves and d > 1):
            sigma = space.stress.transform(sigma, Q)
        u = nodes.displacement[i] + dt * half.v
        nodes.displacement[i] = u
        if wp.static(moves):
            nodes.point[i].x = nodes.reference[i] + u
            d_dt = real(0.5) * dt * (L + wp.transpose(L))
            strained = nodes.strained[i] + wp.sqrt(wp.ddot(d_dt, d_dt))
            nodes.strained[i] = strained
            if strained > real(MOST_STRAIN):
                outdated[0] = 1
            if not wp.ddot(L, L) * dt * dt < real(wp.static(MOST_A_STEP**2)):
                faults[TOO_FAST] = 1
        nodes.point[i].phi = space.phi.with_stress(point.phi, sigma)

    return stress


@cache
def push_kernel(space: Space, kind: CellKind, slots: bool):
    """f of each node from its cells, a = f/m + b, v = e^{−cΔt/2} v^{n+1/2} + ½Δt a, held."""
    real, types, (Held, hold) = space.real, space.types, held_types(space)
    CellNodes, cell_at, place_of = cell_node_types(space)[1], cell_in_slot(kind), corner_place(kind)
    packed_nodes, packed_forces = packed(CellNodes), packed(wp.array2d(dtype=types.vector))

    @forward_kernel
    def push(
        first: int,
        held: Held,
        body_force: wp.array(dtype=types.vector),
        damping: real,
        time_step: wp.array(dtype=real),
        table: NodeCells,
        forces: wp.array2d(dtype=types.vector),
        nodes: CellNodes,
        reactions: wp.array(dtype=types.vector),
        faults: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        packed_nodes(nodes)
        packed_forces(forces)
        f = types.vector()
        if wp.static(slots):
            for k in range(wp.static(kind.corners)):
                c = cell_at(i, k, table)
                if c >= 0:
                    f += forces[c, k]
        else:  # the same, entry by entry
            for entry in range(table.first[i], table.first[i + 1]):
                c, k = place_of(entry, table)
                f += forces[c, k]
        dt, mass, v_half = time_step[0], nodes.mass[i], nodes.half[i].v
        h = real(0.5) * dt
        b, decay = body_force[STAGES - 1], wp.exp(-damping * h)
        a = f / mass + b
        free = decay * v_half + h * a
        v = hold(i, free, END, held)
        pull = body_force[0] + b
        if wp.length_sq(pull) > real(0.0):
            enter(FORCES, i, wp.float64(h * mass * wp.dot(pull, v_half)), nodes.books)
        if damping > real(0.0):
            lost = mass * wp.length_sq(v_half) * (real(1.0) / decay - decay)
            enter(DAMPING, i, wp.float64(lost), nodes.books)
        row = held.row[i]
        if row >= 0:
            if h > real(0.0):
                reactions[row] = (mass / h) * (v - free)
                enter(CONDITIONS, i, wp.float64(mass * wp.dot(v - free, v_half)), nodes.books)
            else:  # before the first step: what holds the node back
                reactions[row] = mass * (held.projector[row] * a - a)
        nodes.acceleration[i] = a
        phi = space.phi.with_velocity(nodes.point[i].phi, v)
        nodes.point[i].phi = phi
        if not wp.isfinite(wp.dot(phi, phi) + wp.dot(nodes.displacement[i], nodes.displacement[i])):
            faults[NON_FINITE] = 1

    return push
