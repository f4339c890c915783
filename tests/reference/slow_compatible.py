"""One step of the compatible scheme, 2D plane strain, slow and plain on purpose.

Written from docs/velocity_steps.md and the modules' texts, in loops over cells and nodes; what is the same physics
as in the published step (corrected gradients, the law, RK4 sources) is that of `slow_step`. Conventions are those
there.

A cell's corners are numbered 00, 01, 10, 11 along its own axes (1, 2).
"""

import numpy as np

from tests.reference.slow_step import (
    De,
    components,
    div_f,
    full,
    gradient,
    in_space,
    rk4,
    stress_source,
    velocity_source,
)
from tests.reference.unloading import released

ENDS = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])  # of each corner, along the cell's axes
ALTERNATING = np.array([1.0, -1.0, -1.0, 1.0])
VELOCITY_SHARE, STRESS_SHARE, MOST_OF_STRAIN = 1.0, 0.1, 0.5
MEAN_YIELD_ITERATIONS = 4


# ---------------------------------------------------------------------------------------------------------
# Geometry of the cells
# ---------------------------------------------------------------------------------------------------------


def area(corners):
    """Of the quadrilateral 00, 10, 11, 01, by the shoelace formula."""
    a, d, b, c = corners  # anticlockwise: a, b, c, d
    ring = [a, b, c, d]
    return 0.5 * sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(ring, [*ring[1:], ring[0]], strict=True))


def axes_of(corners):
    """From the middle of one side to that of the opposite one, along each axis of the cell: one a row."""
    p00, p01, p10, p11 = corners
    return np.array([0.5 * (p10 + p11 - p00 - p01), 0.5 * (p01 + p11 - p00 - p10)])


def thickness(corners):
    """The smaller distance between opposite sides, sides taken parallel to the axes."""
    axes = axes_of(corners)
    return abs(np.linalg.det(axes)) / max(np.linalg.norm(axes[0]), np.linalg.norm(axes[1]))


def frame_of(corners):
    """∇ξ_a in row a."""
    return np.linalg.inv(axes_of(corners).T)


def stretched_gradient(place, frame, own, source, phi, model):
    """Corrected gradient about the value `own` there: round kernels of radius h/Δx in the coordinates ξ."""
    target = {"x": [frame @ place], "h": [model["smoothing_ratio"]]}
    seen = {"x": source["x"] @ frame.T, "V": source["V"]}
    return gradient(target, 0, own, seen, phi, model["kernel"]) @ frame


def linear_fit(corners, f):
    """(mean, gradient, checkerboard) of f = mean + gradient·(x − middle) + checkerboard·(±1), exactly."""
    middle = sum(corners) / 4.0
    system = np.array([[1.0, *(corner - middle), s] for corner, s in zip(corners, ALTERNATING, strict=True)])
    mean, slope_x, slope_y, checkerboard = np.linalg.solve(system, f)
    return mean, np.stack([slope_x, slope_y], axis=1), checkerboard


def cells_around(cells, n):
    """For each node [(cell, which of its corners the node is)]."""
    around = [[] for _ in range(n)]
    for C, members in enumerate(cells):
        for k, i in enumerate(members):
            around[i].append((C, k))
    return around


# ---------------------------------------------------------------------------------------------------------
# Sources
# ---------------------------------------------------------------------------------------------------------


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
    q = np.sqrt(1.5 * np.sum(deviator**2))
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


def sources(v, sigma, eps, L, t0, half, ends, model):
    """Steps 1-2 and 11-12, by the scheme of choice for the stress. Returns v, sigma, eps."""
    v, sigma, eps = v.copy(), sigma.copy(), eps.copy()
    for i in range(len(v)):
        spin = np.zeros((2, 2)) if model["small_strain"] else L[i]
        if model["source_scheme"] == "analytic":
            stress, eps[i] = relax(turned(full(sigma[i]), spin, half), eps[i], half, model)
            sigma[i] = components(stress)
        else:
            L3 = in_space(spin)
            omega = 0.5 * (L3 - L3.T)
            y = np.append(sigma[i], eps[i])
            y = rk4(lambda y, t, omega=omega: stress_source(y, omega, model), y, t0, half)
            sigma[i], eps[i] = y[:4], y[4]
        v[i] = velocity_source(v[i], t0, half, ends, model)
    return v, sigma, eps


# ---------------------------------------------------------------------------------------------------------
# Boundary conditions
# ---------------------------------------------------------------------------------------------------------


def tractions_that_vanish(i, model):
    """[(direction u, normal n)] with u · σ n = 0 at a node of the test box (see `boundary_conditions`)."""
    x, y = np.eye(2)
    left, bottom, right, top = (bool(model[side][i]) for side in ("left", "bottom", "right", "top"))
    free_directions = [u for u, held in ((x, left or bottom), (y, bottom or top)) if not held]
    pairs = []
    if left:
        pairs.append((y, x))
    if top:
        pairs.append((x, y))
    if right:
        pairs += [(u, x) for u in free_directions]
    if i in model["bare_normals"]:
        pairs += [(u, model["bare_normals"][i]) for u in free_directions]
    return pairs


def turned_edges(angle, L, time, model):
    """The angles of the edges' directions: those of free nodes that nobody holds turn with their spin."""
    if model["small_strain"]:
        return angle
    bare = np.isin(np.arange(len(angle)), list(model["bare_normals"]))
    turns = (model["right"] | bare) & ~(model["left"] | model["bottom"] | model["top"])
    return angle + np.where(turns, 0.5 * time * (L[:, 1, 0] - L[:, 0, 1]), 0.0)


def boundary_conditions(v, sigma, angle, t, model):
    """The test box: left a roller, bottom fixed, right free, top moved along y beyond some x, bare before it."""
    v, sigma = v.copy(), sigma.copy()
    shear = model["E"] / (2.0 * (1.0 + model["nu"]))
    lame = 2.0 * shear * model["nu"] / (1.0 - 2.0 * model["nu"])
    for i in range(len(v)):
        if model["top"][i]:
            v[i, 1] = model["top_velocity"](t)
        if model["left"][i]:
            v[i, 0] = 0.0
        if model["bottom"][i]:
            v[i] = 0.0
        R = np.array([[np.cos(angle[i]), -np.sin(angle[i])], [np.sin(angle[i]), np.cos(angle[i])]])
        tractions = [(R @ u, R @ normal) for u, normal in tractions_that_vanish(i, model)]
        if tractions:
            sigma[i] = components(released(full(sigma[i]), tractions, lame, shear))
    return v, sigma


# ---------------------------------------------------------------------------------------------------------
# Steps 3 to 10
# ---------------------------------------------------------------------------------------------------------


def bulk_viscous_pressure(rate, own_rates, corners, rho, dt, courant):
    """The tension ρ ν ψ e with ν = (1 − C²) Δ²/(4 Δt), ψ = min(1, (r/0.3)²), r = |e − mean|/largest."""
    largest = max(abs(rate), *(abs(own) for own in own_rates))
    if largest == 0.0:
        return 0.0
    roughness = abs(rate - sum(own_rates) / 4.0) / largest
    nu = max(1.0 - courant**2, 0.0) * thickness(corners) ** 2 / (4.0 * dt)
    return rho * nu * min(1.0, (roughness / 0.3) ** 2) * rate


def corner_share(courant):
    """κ in two dimensions: the most for which ½ C² (16 C² − 16 + 8 κ) ≤ 0.9 of the mean share, in 0 … 1."""
    theta = 0.9 * VELOCITY_SHARE / 2.0
    return float(np.clip(2.0 * (1.0 - courant**2) + 2.0 * theta / (8.0 * courant**2), 0.0, 1.0))


def stress_change(sigma, eps, grad_v, L_smooth, dt, model):
    """δσ in a cell: smooth strain and flow for Δt/2, then the rest of the strain, elastic."""

    def elastic(L):
        L3 = in_space(L)
        return 0.5 * dt * De(0.5 * (L3 + L3.T), model)

    flowed, _ = relax(full(sigma) + elastic(L_smooth), eps, 0.5 * dt, model)
    return components(flowed + elastic(grad_v - L_smooth)) - sigma


def cells_half_step(x, nodes, aux, v_s, sigma_s, eps_s, L, dt, courant, model):
    """Steps 3-6: for each cell ∇φ, its checkerboard, its axes' gradients ∇ξ, and δφ."""
    phi_s = np.hstack([v_s, sigma_s])
    found = []
    for C, members in enumerate(model["cells"]):
        corners, rho = [x[i] for i in members], aux["rho"][C]
        mean, _, checkerboard = linear_fit(corners, phi_s[members])
        frame = frame_of(corners)
        grad = stretched_gradient(aux["x"][C], frame, mean, nodes, phi_s, model)
        div_v, _ = div_f(grad[:2], grad[2:], rho, model)
        smooth, eps = (sum(part[i] for i in members) / 4.0 for part in (L, eps_s))
        q = bulk_viscous_pressure(
            grad[0, 0] + grad[1, 1], [L[i, 0, 0] + L[i, 1, 1] for i in members], corners, rho, dt, courant
        )
        pressed = stress_change(mean[2:], eps, grad[:2], smooth, dt, model) + q * np.array([1.0, 1.0, 0.0, 1.0])
        change = np.append(-0.5 * dt * div_v, pressed)
        found.append((grad, checkerboard, frame, change))
    return found


def bounded(off, L, dt, model):
    """A stress no larger than a share of that of the strains and turns of a step."""
    shear = model["E"] / (2.0 * (1.0 + model["nu"]))
    size, most = np.linalg.norm(full(off)), MOST_OF_STRAIN * 2.0 * shear * dt * np.linalg.norm(L)
    return off if size <= most else off * most / size


def nodes_full_step(nodes, aux, cells, v_s, sigma_s, L, angle, t, dt, courant, model):
    """Steps 7-10: v_adv, σ_adv, v^{n+1/2} and L."""
    n, kappa = len(v_s), corner_share(courant)
    around = cells_around(model["cells"], n)
    phi_s = np.hstack([v_s, sigma_s])
    own_change = np.array([sum(cells[C][3] for C, _ in around[i]) / len(around[i]) for i in range(n)])
    half = phi_s + own_change
    v_half, sigma_half = boundary_conditions(half[:, :2], half[:, 2:], angle, t + 0.5 * dt, model)
    half = np.hstack([v_half, sigma_half])
    changes = np.array([change for _, _, _, change in cells])

    adv, L_new = np.zeros((n, 6)), np.zeros((n, 2, 2))
    for i in range(n):
        grad, seen = np.zeros((6, 2)), np.zeros(6)
        own_frame = sum(cells[C][2] for C, _ in around[i]) / len(around[i])
        for C, k in around[i]:
            cell_grad, checkerboard, frame, _ = cells[C]
            grad += cell_grad / len(around[i])
            for a, b in ((0, 1), (1, 0)):  # ∂/∂ξ_a of checkerboard·(2ξ_1)(2ξ_2) at 2ξ_b = κ·end
                along = 2.0 * checkerboard * kappa * ENDS[k, b]
                grad[:2] += np.outer(along[:2], frame[a]) / len(around[i])
            seen += ALTERNATING[k] * checkerboard / len(around[i])
        grad += stretched_gradient(nodes["x"][i], own_frame, half[i] - phi_s[i], aux, changes, model)
        rho = nodes["rho"][i]
        if not model["small_strain"]:
            stretch = np.eye(2) + 0.5 * dt * grad[:2]
            grad, rho = grad @ np.linalg.inv(stretch), rho / np.linalg.det(stretch)
        div_v, div_sigma = div_f(grad[:2], grad[2:], rho, model)
        adv[i] = phi_s[i] - dt * np.append(div_v, div_sigma)
        adv[i, :2] -= VELOCITY_SHARE * seen[:2]
        adv[i, 2:] -= bounded(STRESS_SHARE * seen[2:], L[i], dt, model)
        L_new[i] = grad[:2]
    return adv[:, :2], adv[:, 2:], v_half, L_new


# ---------------------------------------------------------------------------------------------------------
# The configuration and the whole step
# ---------------------------------------------------------------------------------------------------------


def configuration(x, rho, model):
    """Nodes and cells. Where nodes move, a cell's density is that of its own volume, otherwise its nodes' mean."""
    V = model["V0"] * model["rho0"] / rho
    nodes = {"x": x, "rho": rho, "V": V}
    m = len(model["cells"])
    aux = {"x": np.zeros((m, 2)), "rho": np.zeros(m), "V": np.zeros(m)}
    for C, members in enumerate(model["cells"]):
        aux["x"][C] = sum(x[i] for i in members) / 4.0
        if model["small_strain"]:
            aux["rho"][C] = sum(rho[i] for i in members) / 4.0
            aux["V"][C] = sum(V[i] for i in members) / 4.0
        else:
            aux["V"][C] = area([x[i] for i in members])
            initial = area([model["x0"][i] for i in members])
            aux["rho"][C] = model["rho0"] * initial / aux["V"][C]
    return nodes, aux


def densities(x, model):
    """Step 14: ρ₀ times the mean volume a node's cells had, over the mean they have now."""
    volume, initial = ([area([p[i] for i in members]) for members in model["cells"]] for p in (x, model["x0"]))
    rho = np.zeros(len(x))
    for i, cells in enumerate(cells_around(model["cells"], len(x))):
        rho[i] = model["rho0"] * sum(initial[C] for C, _ in cells) / sum(volume[C] for C, _ in cells)
    return rho


def slow_compatible_step(state: dict, model: dict, t: float, dt: float) -> dict:
    """The state at t + dt from the state at t; the input is not changed.

    Besides what `slow_step` needs: displacements `u`, which x is too coarse for in float32, and the `angle` by
    which the edge's directions have turned at each node.
    """
    x, L = state["x"], state["L"]
    courant = dt * model["wave_speed"] / model["spacing"]
    nodes, aux = configuration(x, state["rho"], model)
    v_s, sigma_s, eps_s = sources(state["v"], state["sigma"], state["eps"], L, t, 0.5 * dt, False, model)
    cells = cells_half_step(x, nodes, aux, v_s, sigma_s, eps_s, L, dt, courant, model)
    angle = turned_edges(state["angle"], L, 0.5 * dt, model)
    v_adv, sigma_adv, v_half, L_new = nodes_full_step(
        nodes, aux, cells, v_s, sigma_s, L, angle, t, dt, courant, model
    )
    v, sigma, eps = sources(v_adv, sigma_adv, eps_s, L_new, t + 0.5 * dt, 0.5 * dt, True, model)
    angle = turned_edges(angle, L_new, 0.5 * dt, model)
    v, sigma = boundary_conditions(v, sigma, angle, t + dt, model)
    new = {"v": v, "sigma": sigma, "eps": eps, "L": L_new, "angle": angle}
    new["u"] = state["u"] + dt * v_half
    if model["small_strain"]:
        return new | {"x": x, "rho": state["rho"]}
    x_new = x + dt * v_half
    return new | {"x": x_new, "rho": densities(x_new, model)}
