"""The passes of a step of the scheme `cells` (METHOD section 8), over nodes and over cells by turns.

A node's corner of a cell, the pair p = (T, i), is a point of the quadrature: it has the weight A_T/n, the gradient
G_p, taken a share κ of the way to the corner, and the stress of the node. L_i = (1/V_i) Σ_p w_p G_p v, and the
nodal force is its exact adjoint. What L does not see, G_p v − L_i, all the way to the corner, is rough: it meets a
viscosity, no smooth motion does.

Where soil flows velocities have kinks, and what serves bending and waves only carries load: κ and the sharpening
of a cell are multiplied by e_T, 0 if a corner has flowed in this step, and 0.1, 0.19, … in those that follow.
"""

from functools import cache

import warp as wp

from ..device.arrays import packed
from ..device.compiling import forward_kernel
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cell_body import CONDITIONS, FLOW, FORCES, cell_node_types
from ..state.cells import NodeCells, cell_in_slot, corner_place
from ..state.clock import END, FOLDED, HALF, NON_FINITE, TOO_FAST
from .cell_shape import CellShape, cell_shape
from .conditions import MOST_A_STEP
from .held import held_types
from .sharpening import around, sharp_types

CALMING = 0.9  # a step: how fast a node that has flowed is taken for an elastic one again
# Where soil flows κ is FLOWING_SHARE (b/BENT)², at most FLOWING_SHARE, with b = 0 in a parallelogram and 1 where a
# corner folds: with viscosity alone against it, flow bends a cell further and further until it does.
FLOWING_SHARE, BENT = 2.0 / 3.0, 0.5
MOST_STRAIN = 0.02  # between two looks at the time step


def corner_share(sharpening: float) -> float:
    """κ of a grid's cells, with sharpening c (`warpsph.operators.sharpening`).

    With the stress of edge nodes taken 1 − κ halves of a cell inside, n cells bend with
    1 + (2 − 6 (1 − κ) + 6 c)/n² + … of their stiffness. κ = ⅔ − c + c²/5 bends five cells exactly, and four and
    more within 0.6 %.
    """
    return 2.0 / 3.0 - sharpening + sharpening**2 / 5.0


def numbers_of(space: Space, shape: CellShape) -> int:
    """How many numbers the strain pass leaves of a cell: A/n, e_T, κ_T, (A/n) G v, and each mode's part of it."""
    return 3 + space.dim**2 * (1 + shape.partial)


@cache
def _tensors(space: Space) -> tuple[wp.Function, wp.Function]:
    """(cell, which, numbers) → one of the tensors that the strain pass has left of a cell, and what leaves it."""
    real, tensor, d = space.real, space.types.tensor, space.dim

    @wp.func
    def tensor_at(c: int, which: int, numbers: wp.array2d(dtype=real)):
        result = tensor()
        for a in range(wp.static(d)):
            for b in range(wp.static(d)):
                result[a, b] = numbers[c, 3 + d * d * which + d * a + b]
        return result

    @wp.func
    def put_tensor(c: int, which: int, value: tensor, numbers: wp.array2d(dtype=real)):
        for a in range(wp.static(d)):
            for b in range(wp.static(d)):
                numbers[c, 3 + d * d * which + d * a + b] = value[a, b]

    return tensor_at, put_tensor


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
        pushed = space.phi.velocity(point.phi) + h * nodes.acceleration[i]
        free = wp.exp(-damping * h) * pushed
        v = hold(i, free, HALF, held)
        nodes.half[i].v = v
        if wp.static(moves):
            nodes.half[i].x = point.x + h * v
        else:
            nodes.half[i].x = point.x
        book = nodes.books[i]
        book[CONDITIONS] += wp.float64(nodes.mass[i] * wp.dot(v - free, v))
        nodes.books[i] = book

    return kick


@cache
def strain_kernel(space: Space, kind: CellKind, flows: bool, corner_share: float):
    """Of each cell, at the half step: A/n, e_T, (A/n) G v, and what its hourglass modes add to it."""
    real, types = space.real, space.types
    shape, CellNodes = cell_shape(space, kind), cell_node_types(space)[1]
    per_corner, T, (_, put_tensor) = 1.0 / kind.corners, shape.weights, _tensors(space)
    packed_nodes, packed_table = packed(CellNodes), packed(wp.array2d(dtype=wp.int32))
    packed_numbers = packed(wp.array2d(dtype=real))

    @forward_kernel
    def strain(
        first: int,
        corners: wp.array2d(dtype=wp.int32),
        nodes: CellNodes,
        numbers: wp.array2d(dtype=real),
        faults: wp.array(dtype=wp.int32),
    ):
        c = first + wp.tid()
        packed_nodes(nodes)
        packed_table(corners)
        packed_numbers(numbers)
        x, v, flowed = shape.Modes(), shape.Modes(), real(0.0)
        for k in range(wp.static(kind.corners)):
            i = corners[c, k]
            half = nodes.half[i]
            if wp.static(flows):
                flowed = wp.max(flowed, nodes.flowed[i])
            x += wp.outer(T[k], half.x)
            v += wp.outer(T[k], half.v)
        B, volume, frame = shape.measure(x)
        if not volume > real(0.0):
            faults[FOLDED] = 1
        share = real(per_corner) * volume
        weighted = real(per_corner) * (wp.transpose(v) * B)  # (A/n) G v
        numbers[c, 0] = share
        elastic = real(1.0) - flowed
        numbers[c, 1] = elastic
        put_tensor(c, 0, weighted, numbers)
        if wp.static(shape.partial > 0):
            bent = real(0.0)
            for q in range(wp.static(len(shape.links))):
                mode, axis = x[wp.static(shape.links[q][0])], frame[wp.static(shape.links[q][1])]
                bent = wp.max(bent, wp.abs(wp.dot(mode, axis)) / real(BENT))
            flowing = real(FLOWING_SHARE) * wp.min(bent * bent, real(1.0))
            numbers[c, 2] = elastic * real(corner_share) + flowed * flowing
            G = weighted / share
            for p in range(wp.static(shape.partial)):
                part = types.tensor()
                for q in range(wp.static(len(shape.links))):
                    if wp.static(shape.links[q][2] == p):
                        bend = v[wp.static(shape.links[q][0])] - G * x[wp.static(shape.links[q][0])]
                        part += wp.outer(bend, frame[wp.static(shape.links[q][1])])
                put_tensor(c, 1 + p, share * part, numbers)

    return strain


@cache
def rate_kernel(space: Space, kind: CellKind, slots: bool):
    """V and L of each node from its cells."""
    real, types, shape, CellNodes = space.real, space.types, cell_shape(space, kind), cell_node_types(space)[1]
    cell_at, place_of = cell_in_slot(kind), corner_place(kind)
    sign, (tensor_at, _) = shape.signs, _tensors(space)
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
        turned, strained_by = space.phi.stress(point.phi), dt * rate
        if wp.static(moves and d > 1):
            # L is in the axes of the half step: half of the turn comes before it, half after. With all before,
            # stresses lag behind their forces by half a step's turn, and pump energy into a body that spins.
            half_turn = space.algebra.rotation(L, real(0.5) * dt)
            turned = space.stress.transform(turned, half_turn * half_turn)
            strained_by = space.stress.transform(strained_by, half_turn)
        trial = turned + strained_by
        sigma = trial
        if wp.static(law.flows):
            own = internal()
            if wp.static(remembers):
                own = internals[i]
            sigma, own = law.relax(trial, own, material, dt)
            if wp.static(remembers):
                internals[i] = own
            mean_stress, lost = real(0.5) * (turned + sigma), trial - sigma
            work = space.stress.complementary(mean_stress, lost, material.lame, material.shear, material.young)
            book = nodes.books[i]
            book[FLOW] += wp.float64(volume * work)
            nodes.books[i] = book
            flowed = real(CALMING) * nodes.flowed[i]
            if wp.dot(lost, lost) > real(0.0):
                flowed = real(1.0)
            nodes.flowed[i] = flowed
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
def force_kernel(space: Space, kind: CellKind, law: Law, sharp: bool):
    """Of each cell, at t^{n+1}: what its stress, and the viscosity that rough motion meets, do to its corners."""
    real, types, n = space.real, space.types, kind.corners
    shape, CellNodes = cell_shape(space, kind), cell_node_types(space)[1]
    T, per_corner, size = shape.weights, 1.0 / kind.corners, space.continuum.stress_size
    sign, (tensor_at, _) = shape.signs, _tensors(space)
    Parts = space.mat(max(1, shape.partial), size)
    packed_nodes, packed_table = packed(CellNodes), packed(wp.array2d(dtype=wp.int32))
    packed_numbers, packed_forces = packed(wp.array2d(dtype=real)), packed(wp.array2d(dtype=types.vector))

    @forward_kernel
    def force(
        first: int,
        material: law.Parameters,
        modulus: real,
        time_step: wp.array(dtype=real),
        corners: wp.array2d(dtype=wp.int32),
        cell_mass: wp.array(dtype=real),
        nodes: CellNodes,
        numbers: wp.array2d(dtype=real),
        forces: wp.array2d(dtype=types.vector),
        rough_loss: wp.array(dtype=wp.float64),
    ):
        c = first + wp.tid()
        packed_nodes(nodes)
        packed_table(corners)
        packed_numbers(numbers)
        packed_forces(forces)
        x, dt = shape.Modes(), time_step[0]
        mean, mean_rate = types.stress(), types.stress()
        stress_parts, rate_parts = Parts(), Parts()
        for k in range(wp.static(n)):
            i = corners[c, k]
            point = nodes.point[i]
            rate = nodes.elastic_rate[i]
            sigma = space.phi.stress(point.phi)
            if wp.static(sharp):
                sigma = nodes.sharpened[i]
            x += wp.outer(T[k], point.x)
            mean += sigma
            mean_rate += rate
            for p in range(wp.static(shape.partial)):
                stress_parts[p] += sign[k, p] * sigma
                rate_parts[p] += sign[k, p] * rate
        B, volume, frame = shape.measure(x)
        share = real(per_corner) * volume
        # η = min(Δt/2, 1/(Δt ω²)), ω² = n c² Σ_j |∇N_j|² a bound of the cell's own frequencies, ρ c² its modulus.
        stiff = real(n) * modulus * wp.trace(shape.spread(B)) / (cell_mass[c] * volume)
        eta = real(0.0)
        if dt > real(0.0):
            eta = wp.min(real(0.5) * dt, real(1.0) / (dt * stiff))
        per_share = real(1.0) / numbers[c, 0]
        G = per_share * tensor_at(c, 0, numbers)
        whole = space.stress.elastic_rate(G, material.lame, material.shear, material.young)
        tau = eta * (whole - real(per_corner) * mean_rate)
        S = real(per_corner) * mean + tau
        F = shape.Modes()
        for m in range(wp.static(shape.modes)):
            F[m] = space.stress.traction(S, B[m])
        # τ : G v, since Dₑ : G v is at hand.
        power = volume * space.stress.complementary(tau, whole, material.lame, material.shear, material.young)
        if wp.static(shape.partial > 0):
            W, towards = Parts(), numbers[c, 2]
            for p in range(wp.static(shape.partial)):
                Y = per_share * tensor_at(c, 1 + p, numbers)
                part = space.stress.elastic_rate(Y, material.lame, material.shear, material.young)
                rough = eta * (real(n) * part - rate_parts[p])
                W[p] = towards * stress_parts[p] + rough
                power += share * space.stress.complementary(
                    rough, part, material.lame, material.shear, material.young
                )
            bent = types.tensor()
            for q in range(wp.static(len(shape.links))):
                pull = share * space.stress.traction(
                    W[wp.static(shape.links[q][2])], frame[wp.static(shape.links[q][1])]
                )
                F[wp.static(shape.links[q][0])] += pull
                bent += wp.outer(pull, x[wp.static(shape.links[q][0])])
            bent = bent / volume
            for m in range(wp.static(shape.modes)):
                F[m] -= bent * B[m]
        rough_loss[c] += wp.float64(dt * power)
        for k in range(wp.static(n)):
            forces[c, k] = -(T[k] * F)

    return force


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
        b = body_force[2]
        a = f / mass + b
        free = wp.exp(-damping * h) * v_half + h * a
        v = hold(i, free, END, held)
        book = nodes.books[i]
        book[FORCES] += wp.float64(dt * mass * wp.dot(b, v_half))
        book[CONDITIONS] += wp.float64(mass * wp.dot(v - free, v_half))
        nodes.books[i] = book
        row = held.row[i]
        if row >= 0:
            if h > real(0.0):
                reactions[row] = (mass / h) * (v - free)
            else:  # before the first step: what holds the node back
                reactions[row] = mass * (held.projector[row] * a - a)
        nodes.acceleration[i] = a
        phi = space.phi.with_velocity(nodes.point[i].phi, v)
        nodes.point[i].phi = phi
        if not wp.isfinite(wp.dot(phi, phi) + wp.dot(nodes.displacement[i], nodes.displacement[i])):
            faults[NON_FINITE] = 1

    return push
