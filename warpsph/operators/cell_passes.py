"""The passes over cells of a step of the scheme `cells` (METHOD section 8); those over nodes: `node_passes`.

A node's corner of a cell, the pair p = (T, i), is a point of the quadrature: it has the weight A_T/n, the gradient
G_p, taken a share κ of the way to the corner, and the stress of the node. L_i = (1/V_i) Σ_p w_p G_p v, and the
nodal force is its exact adjoint. What L does not see, G_p v − L_i, all the way to the corner, is rough: it meets a
viscosity, no smooth motion does.

Where soil flows velocities have kinks, and what serves bending and waves only carries load: κ and the sharpening
of a cell are multiplied by e_T, 0 if a corner has flowed in this step, and 0.1, 0.19, … in those that follow. What
is rough is then met by a stress of the cell's q at most: soil cannot carry more. Bent cells lose both too,
and get another κ for it.
"""

from functools import cache

import warp as wp

from ..device.arrays import packed
from ..device.compiling import forward_kernel
from ..materials.law import Law
from ..mesh.kinds import CellKind
from ..physics.space import Space
from ..state.cell_body import cell_node_types
from ..state.clock import FOLDED
from .cell_numbers import tensors_of
from .cell_shape import cell_shape

# As β = (b/BENT)² goes to 1, with b = 0 in a parallelogram and up to 1 where a corner folds, a cell goes over to
# BENT_SHARE and no sharpening; without that κ is FLOWING_SHARE where soil flows. With viscosity alone against it,
# flow bends a cell further and further: the free surface beside a footing gets saw-toothed, and cells fold. In
# elastic bodies layers of a bar of jittered hexahedra, spinning with half of c_s at its rim, drifted to and fro
# until they folded; sharpened cells with that κ grow.
FLOWING_SHARE, BENT_SHARE, BENT = 0.04, 2.0 / 3.0, 0.5
# Of q, the most that viscosity adds to the stress of a cell that flows: of what is rough soil can carry no more
# than its strength. With less, columns of clay fold (0.1 and 0.3, docs/method.md).
ROUGH = 1.0


def corner_share(sharpening: float) -> float:
    """κ of a grid's cells, with sharpening c (`warpsph.operators.sharpening`).

    With the stress of edge nodes taken 1 − κ halves of a cell inside, n cells bend with
    1 + (2 − 6 (1 − κ) + 6 c)/n² + … of their stiffness. κ = ⅔ − c + c²/5 bends five cells exactly, and four and
    more within 0.6 %.
    """
    return 2.0 / 3.0 - sharpening + sharpening**2 / 5.0


@cache
def strain_kernel(space: Space, kind: CellKind, flows: bool):
    """Of each cell, at the half step: A/n, e_T, (A/n) G v, and what its hourglass modes add to it."""
    real, types = space.real, space.types
    shape, CellNodes = cell_shape(space, kind), cell_node_types(space)[1]
    per_corner, T, bend, (_, put_tensor) = 1.0 / kind.corners, shape.weights, shape.bend, tensors_of(space)
    joined, d = shape.joined, space.dim
    packed_nodes, packed_table = packed(CellNodes), packed(wp.array2d(dtype=wp.int32))
    packed_numbers = packed(wp.array2d(dtype=real))

    @forward_kernel
    def strain(
        first: int,
        kappa: real,
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
        put_tensor(c, 0, weighted, numbers)
        if wp.static(shape.partial > 0):
            bent = wp.min(bend(x, frame) / (real(BENT) * real(BENT)), real(1.0))
            straight = elastic * kappa + flowed * real(FLOWING_SHARE)
            numbers[c, 2] = wp.lerp(straight, real(BENT_SHARE), bent)
            elastic *= real(1.0) - bent
            G = weighted / share
            for p in range(wp.static(shape.partial)):
                part = types.tensor()
                for a in range(wp.static(d)):
                    m = joined[p, a]
                    if m >= 0:
                        part += wp.outer(v[m] - G * x[m], frame[a])
                put_tensor(c, 1 + p, share * part, numbers)
        numbers[c, 1] = elastic

    return strain


@cache
def force_kernel(space: Space, kind: CellKind, law: Law, sharp: bool):
    """Of each cell, at t^{n+1}: what its stress, and the viscosity that rough motion meets, do to its corners."""
    real, types, n = space.real, space.types, kind.corners
    shape, CellNodes = cell_shape(space, kind), cell_node_types(space)[1]
    T, per_corner, size = shape.weights, 1.0 / kind.corners, space.continuum.stress_size
    sign, joined, bend, (tensor_at, _), d = shape.signs, shape.joined, shape.bend, tensors_of(space), space.dim
    Parts = space.mat(max(1, shape.partial), size)
    packed_nodes, packed_table = packed(CellNodes), packed(wp.array2d(dtype=wp.int32))
    packed_numbers, packed_forces = packed(wp.array2d(dtype=real)), packed(wp.array2d(dtype=types.vector))

    @wp.func
    def bounded(tau: types.stress, most: real, material: law.Parameters):
        """τ, or the multiple of it whose size √(2G τ : Dₑ⁻¹ : τ) is the most that may be."""
        energy = space.stress.complementary(tau, tau, material.lame, material.shear, material.young)
        size = wp.sqrt(real(2.0) * material.shear * energy)
        return wp.where(size > most, most / size, real(1.0)) * tau

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
        x, dt, flowed = shape.Modes(), time_step[0], real(0.0)
        mean, mean_rate = types.stress(), types.stress()
        stress_parts, rate_parts = Parts(), Parts()
        for k in range(wp.static(n)):
            i = corners[c, k]
            point = nodes.point[i]
            rate = nodes.elastic_rate[i]
            sigma = space.phi.stress(point.phi)
            if wp.static(sharp):
                sigma = nodes.sharpened[i]
            if wp.static(law.flows):
                flowed = wp.max(flowed, nodes.flowed[i])
            x += wp.outer(T[k], point.x)
            mean += sigma
            mean_rate += rate
            for p in range(wp.static(shape.partial)):
                stress_parts[p] += sign[k, p] * sigma
                rate_parts[p] += sign[k, p] * rate
        B, volume, frame = shape.measure(x)
        share = real(per_corner) * volume
        # η = min(Δt/2, 1/(Δt ω²)), ω² = n c² Σ_j |∇N_j|² (1 + b²) a bound of the cell's own frequencies, ρ c² its
        # modulus, b how far it is bent: its hourglass modes see linear motion too then.
        stiff = (
            real(n) * modulus * wp.trace(shape.spread(B)) * (real(1.0) + bend(x, frame)) / (cell_mass[c] * volume)
        )
        eta = real(0.0)
        if dt > real(0.0):
            eta = wp.min(real(0.5) * dt, real(1.0) / (dt * stiff))
        per_share = real(1.0) / numbers[c, 0]
        G = per_share * tensor_at(c, 0, numbers)
        whole = space.stress.elastic_rate(G, material.lame, material.shear, material.young)
        tau = eta * (whole - real(per_corner) * mean_rate)
        most = real(0.0)
        if wp.static(law.flows) and flowed > real(0.0):
            most = real(ROUGH) * real(per_corner) * space.stress.von_mises(mean) / flowed
            tau = bounded(tau, most, material)
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
                if wp.static(law.flows) and flowed > real(0.0):
                    rough = bounded(rough, real(n) * most, material)  # n times a corner's
                W[p] = towards * stress_parts[p] + rough
                power += share * space.stress.complementary(
                    rough, part, material.lame, material.shear, material.young
                )
            bent = types.tensor()
            for p in range(wp.static(shape.partial)):
                for a in range(wp.static(d)):
                    m = joined[p, a]
                    if m >= 0:
                        pull = share * space.stress.traction(W[p], frame[a])
                        F[m] += pull
                        bent += wp.outer(pull, x[m])
            bent = bent / volume
            for m in range(wp.static(shape.modes)):
                F[m] -= bent * B[m]
        rough_loss[c] += wp.float64(dt * power)
        for k in range(wp.static(n)):
            forces[c, k] = -(T[k] * F)

    return force
