"""One step of the scheme `cells`, unsharpened, in plane strain, of quads and triangles: slow and plain on purpose.

Written from docs/method.md, section 8, in loops over cells, corners and nodes; the elastic law is that of
`slow_step`, and so are its conventions. A corner p of a cell has a gradient G_p v = sum_k v_k (x) g_pk, the mean
one over the cell and, of a quad, a share of its hourglass mode. A quad's corners are numbered 00, 01, 10, 11 along
its own axes.
"""

import numpy as np

from tests.reference.slow_step import De, components, full, in_space

ENDS = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])  # of each corner, along the quad's axes
ALTERNATING = np.array([1.0, -1.0, -1.0, 1.0])
ROUND = {3: [0, 1, 2], 4: [0, 2, 3, 1]}  # the corners in the order in which one walks around the cell
CORNER_SHARE = BENT_SHARE = 2.0 / 3.0
FLOWING_SHARE = 0.04
ROUGH = 1.0
LEAST_VOLUME = 0.15
CALMING = 0.9
BENT = 0.5
MEAN_YIELD_ITERATIONS = 4


# ---------------------------------------------------------------------------------------------------------
# Geometry of a cell
# ---------------------------------------------------------------------------------------------------------


def area_and_slopes(corners):
    """The area of a polygon, and its derivative by the position of each corner."""
    order = ROUND[len(corners)]
    area, slopes = 0.0, np.zeros((len(corners), 2))
    for before, here, after in zip(np.roll(order, 1), order, np.roll(order, -1), strict=True):
        (x, y), (x2, y2) = corners[here], corners[after]
        area += 0.5 * (x * y2 - x2 * y)
        across = corners[after] - corners[before]
        slopes[here] = 0.5 * np.array([across[1], -across[0]])
    sign = np.sign(area)
    return sign * area, sign * slopes


def corner_gradients(corners, share):
    """g_pk, shape (c, c, 2): of the values f_k the gradient at corner p is sum_k f_k g_pk."""
    n = len(corners)
    area, slopes = area_and_slopes(corners)
    g = np.tile(slopes / area, (n, 1, 1))
    if n == 4:
        edges = corners.T @ ENDS / 4.0  # dx/dxi_a in column a
        frame = np.linalg.inv(edges)  # grad xi_a in row a
        mode = ALTERNATING / 4.0 - slopes @ (ALTERNATING @ corners / 4.0) / area  # without its linear part
        for p in range(4):
            bend = ENDS[p, 1] * frame[0] + ENDS[p, 0] * frame[1]
            g[p] += share * np.outer(mode, bend)
    return g


def bend(corners):
    """b² of a cell, by the part that its hourglass mode has of its axes."""
    if len(corners) == 3:
        return 0.0
    return np.sum((np.linalg.inv(corners.T @ ENDS / 4.0) @ (ALTERNATING @ corners / 4.0)) ** 2)


# ---------------------------------------------------------------------------------------------------------
# The law: rotation and flow by its own solution
# ---------------------------------------------------------------------------------------------------------


def von_mises(sigma):
    deviator = sigma - np.trace(sigma) / 3.0 * np.eye(3)
    return np.sqrt(1.5 * np.sum(deviator**2))


def yield_size(eps, model):
    return max(model["Y0"] + model["H"] * eps, model["r"] * model["Y0"])


def overstress(F, Y, modulus, time, model):
    """q − Y after dF/dt = −modulus γ (F/Y)^N at a constant Y."""
    N, rate = model["N"], modulus * model["gamma"] / Y
    if N == 1.0:
        return F * np.exp(-rate * time)
    return Y * ((F / Y) ** (1.0 - N) + (N - 1.0) * rate * time) ** (1.0 / (1.0 - N))


def relax(sigma, eps, time, model):
    """Flow alone at the mean Y of the time; the strain from so many iterations of its implicit equation."""
    Y = yield_size(eps, model)
    deviator = sigma - np.trace(sigma) / 3.0 * np.eye(3)
    q = von_mises(sigma)
    if q <= Y:
        return sigma, eps
    three_g = 3.0 * model["E"] / (2.0 * (1.0 + model["nu"]))
    b = three_g + model["H"]
    strain = 0.0
    for _ in range(MEAN_YIELD_ITERATIONS):
        mean = 0.5 * (Y + yield_size(eps + strain, model))
        strain = (q - Y - overstress(q - Y, mean, b, time, model)) / b
    assert yield_size(eps + strain, model) > model["r"] * model["Y0"], "softening that ends is not in here"
    return sigma - strain * three_g / q * deviator, eps + strain


def turned(sigma, L, time):
    """exp(ω t) σ exp(−ω t) in the plane."""
    angle = 0.5 * (L[1, 0] - L[0, 1]) * time
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return R @ sigma @ R.T


def elastic(L, model):
    """D_e : sym L, a 3 × 3 tensor."""
    L3 = in_space(L)
    return De(0.5 * (L3 + L3.T), model)


# ---------------------------------------------------------------------------------------------------------
# The passes
# ---------------------------------------------------------------------------------------------------------


def held(v, t, model):
    """The test box's conditions on velocities: rollers left, fixed below, a footing on part of the top."""
    v = v.copy()
    v[model["left"], 0] = 0.0
    v[model["top"], 1] = model["top_velocity"](t)
    v[model["bottom"]] = 0.0
    return v


def volumes(x, model):
    """V_i = sum_p w_p over the corners p at each node."""
    volume = np.zeros(len(x))
    for cell in model["cells"]:
        volume[cell] += area_and_slopes(x[cell])[0] / len(cell)
    return volume


def share_of(cell, x, flowed):
    """κ of a cell: where a corner has just flowed little, and what holds a cell that is bent already."""
    lately, bent = max(flowed[i] for i in cell), min(bend(x[cell]) / BENT**2, 1.0)
    straight = CORNER_SHARE * (1.0 - lately) + FLOWING_SHARE * lately
    return (1.0 - bent) * straight + bent * BENT_SHARE


def nodal_gradients(x, v, flowed, model):
    """L_i = sum_p w_p G_p v / V_i over the corners p at each node."""
    L = np.zeros((len(x), 2, 2))
    for cell in model["cells"]:
        weight = area_and_slopes(x[cell])[0] / len(cell)
        g = corner_gradients(x[cell], share_of(cell, x, flowed))
        for p, i in enumerate(cell):
            for k, j in enumerate(cell):
                L[i] += weight * np.outer(v[j], g[p, k])
    volume = np.maximum(volumes(x, model), LEAST_VOLUME * model["mass"] / model["rho0"])
    return L / volume[:, None, None]


def bounded(taus, most, model):
    """τ_p of corners; their mean, and what alternates along each axis, no larger than the most."""
    signs = [np.ones(len(taus)), *(ENDS.T if len(taus) == 4 else ())]
    parts = [np.tensordot(s, taus, axes=1) / len(taus) for s in signs]
    share = model["nu"] / (1.0 + model["nu"])
    sizes = [np.sqrt(np.sum(part**2) - share * np.trace(part) ** 2) for part in parts]
    parts = [part * min(1.0, most / size) if size > 0.0 else part for part, size in zip(parts, sizes, strict=True)]
    return sum(np.multiply.outer(s, part) for s, part in zip(signs, parts, strict=True))


def forces(x, x_half, v_half, sigma, L, flowed, flows, dt, model):
    """f_k = −sum_p w_p (σ_p g_pk(κ) + τ_p g_pk(1)), τ_p = η D_e : (G_p(1) v − L_p) of the half step.

    `flowed` was before the step's flow, `flows` is after it.
    """
    f = np.zeros_like(x)
    for cell in model["cells"]:
        n = len(cell)
        (area, slopes), area0 = area_and_slopes(x[cell]), area_and_slopes(model["x0"][cell])[0]
        smooth, whole = (corner_gradients(x[cell], share) for share in (share_of(cell, x_half, flowed), 1.0))
        before = corner_gradients(x_half[cell], 1.0)
        speed2 = model["wave_speed"] ** 2 * area / area0  # the mass stays, and so does the stiffness
        frequency2 = n * speed2 * np.sum(slopes**2) / area**2 * (1.0 + bend(x[cell]))
        eta = min(0.5 * dt, 1.0 / (dt * frequency2))
        rates = [elastic(L[i], model) for i in cell]
        if n == 4:  # what alternates along both axes is no part of a gradient
            alternating = sum(s * rate for s, rate in zip(ALTERNATING, rates, strict=True)) / 4.0
            rates = [rate - s * alternating for s, rate in zip(ALTERNATING, rates, strict=True)]
        else:  # a triangle has one gradient
            rates = [sum(rates) / n] * n
        G = [sum(np.outer(v_half[j], before[p, k]) for k, j in enumerate(cell)) for p in range(n)]
        taus = np.array([eta * (elastic(G[p], model) - rates[p]) for p in range(n)])
        if (lately := max(flows[i] for i in cell)) > 0.0:
            q = von_mises(sum(full(sigma[i]) for i in cell) / n)
            taus = bounded(taus, ROUGH * q / lately, model)
        for p, i in enumerate(cell):
            tau = taus[p]
            for k, j in enumerate(cell):
                f[j] -= area / n * (full(sigma[i])[:2, :2] @ smooth[p, k] + tau[:2, :2] @ whole[p, k])
    return f


def slow_cells_step(state: dict, model: dict, t: float, dt: float) -> dict:
    """The state at t + dt from the state at t; the input is not changed."""
    x, v, a = (np.array(state[name], dtype=float) for name in ("x", "v", "a"))
    sigma, eps, flowed = (np.array(state[name], dtype=float) for name in ("sigma", "eps", "flowed"))
    h, damped, moves = 0.5 * dt, np.exp(-0.5 * model["damping"] * dt), not model["small_strain"]

    v_half = held(damped * (v + h * a), t + h, model)
    x_half = x + h * v_half if moves else x
    L, flows = nodal_gradients(x_half, v_half, flowed, model), CALMING * flowed
    for i in range(len(x)):
        stress, strained_by = full(sigma[i]), dt * elastic(L[i], model)
        if moves:  # L is in the axes of the half step
            stress, strained_by = turned(stress, L[i], dt), turned(strained_by, L[i], h)
        trial = stress + strained_by
        stress, eps[i] = relax(trial, eps[i], dt, model)
        if np.any(stress != trial):
            flows[i] = 1.0
        sigma[i] = components(stress)
    x = x + dt * v_half if moves else x
    f = forces(x, x_half, v_half, sigma, L, flowed, flows, dt, model)
    a = f / model["mass"][:, None] + np.asarray(model["body_force"](t + dt), dtype=float)
    v = held(damped * v_half + h * a, t + dt, model)
    rho = model["mass"] / volumes(x, model)
    return {"x": x, "v": v, "a": a, "sigma": sigma, "eps": eps, "flowed": flows, "rho": rho, "L": L}
