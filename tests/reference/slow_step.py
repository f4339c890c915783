"""One time step of Runge-Kutta Taylor SPH, 2D plane strain, slow and plain on purpose.

An independent float64 reference for the tests: Python loops over targets and neighbours, one function per
numbered step group of docs/method.md, section 3. Nothing here is shared with the implementation it checks.

Conventions
-----------
sigma (n, 4) is ordered (11, 22, 12, 33); L[i, j] = dv_i/dx_j; d = sym L; omega = skew L.
Subscript s: after steps 1-2. Subscript half: phi^{n+1/2}. The configuration (x, rho, V, h) is that of t^n
during the whole step and moves only in step 14.
"""

# ruff: noqa: E741  (I and J are the target and the source, as in docs/method.md)

import numpy as np

S11, S22, S12, S33 = range(4)

MAX_CONDITION = 1.0e10  # a correction matrix A worse than this has lost rank: the node set is at fault


# ---------------------------------------------------------------------------------------------------------
# Smoothing functions of xi = r/h: (W, dW/dxi). Normalisation cancels in the Shepard value and in A^-1.
# ---------------------------------------------------------------------------------------------------------


def gaussian(xi):
    W = np.exp(-(xi**2))
    return W, -2.0 * xi * W


def cubic_spline(xi):
    if xi < 1.0:
        return 1.0 - 1.5 * xi**2 + 0.75 * xi**3, -3.0 * xi + 2.25 * xi**2
    return 0.25 * (2.0 - xi) ** 3, -0.75 * (2.0 - xi) ** 2


def wendland_c2(xi):
    return (1.0 - 0.5 * xi) ** 4 * (1.0 + 2.0 * xi), -5.0 * xi * (1.0 - 0.5 * xi) ** 3


KERNELS = {  # name: (function, support in units of h)
    "gaussian": (gaussian, 3.0),
    "cubic_spline": (cubic_spline, 2.0),
    "wendland_c2": (wendland_c2, 2.0),
}


# ---------------------------------------------------------------------------------------------------------
# Configuration of t^n: the two node sets
# ---------------------------------------------------------------------------------------------------------


def material_nodes(state, model):
    """x, rho, V, h of the material nodes."""
    x = np.array(state["x"], dtype=float)
    rho = np.array(state["rho"], dtype=float)
    V = model["V0"] * model["rho0"] / rho
    h = model["h0"] * np.sqrt(model["rho0"] / rho)
    return {"x": x, "rho": rho, "V": V, "h": h}


def auxiliary_nodes(nodes, cells):
    """x, rho, V, h of the auxiliary nodes: each the plain mean over the 4 nodes of the cell."""
    m = len(cells)
    aux = {"x": np.zeros((m, 2)), "rho": np.zeros(m), "V": np.zeros(m), "h": np.zeros(m)}
    for C in range(m):
        a, b, c, d = cells[C]
        for name, of_aux in aux.items():
            of_node = nodes[name]
            of_aux[C] = (of_node[a] + of_node[b] + of_node[c] + of_node[d]) / 4.0
    return aux


# ---------------------------------------------------------------------------------------------------------
# Interpolation from one node set (the source, J) to a point of the other (the target, I)
# ---------------------------------------------------------------------------------------------------------


def neighbours(target, I, source, kernel):
    """[(J, V_J W_IJ, V_J grad W_IJ)] over the source nodes with r < support * h_I; gradient w.r.t. x_I."""
    function, support = KERNELS[kernel]
    x_I, h_I = target["x"][I], target["h"][I]
    found = []
    for J in range(len(source["x"])):
        separation = x_I - source["x"][J]
        r = np.sqrt(separation[0] ** 2 + separation[1] ** 2)
        if r < support * h_I:
            W, dW_dxi = function(r / h_I)
            grad_W = (dW_dxi / h_I) * separation / r if r > 0.0 else np.zeros(2)
            V_J = source["V"][J]
            found.append((J, V_J * W, V_J * grad_W))
    if not found:
        raise ValueError(f"target {I} sees no neighbour")
    return found


def value(target, I, source, phi, kernel):
    """Shepard: phi_I = sum V_J phi_J W_IJ / sum V_J W_IJ."""
    numerator = np.zeros(phi.shape[1])
    denominator = 0.0
    for J, V_W, _ in neighbours(target, I, source, kernel):
        numerator += V_W * phi[J]
        denominator += V_W
    return numerator / denominator


def gradient(target, I, phi_I, source, phi, kernel):
    """grad[k, j] = d phi_k / d x_j at target I: A^-1 sum V_J (phi_J - phi_I) grad W_IJ, exact for linear phi.

    phi_I is the target's own value, phi the values at the source nodes.
    """
    A = np.zeros((2, 2))
    B = np.zeros((2, phi.shape[1]))
    for J, _, V_grad_W in neighbours(target, I, source, kernel):
        A += np.outer(V_grad_W, source["x"][J] - target["x"][I])
        B += np.outer(V_grad_W, phi[J] - phi_I)
    if np.linalg.cond(A) > MAX_CONDITION:
        raise np.linalg.LinAlgError(f"rank loss in the correction matrix of target {I}")
    return np.linalg.solve(A, B).T


# ---------------------------------------------------------------------------------------------------------
# Constitutive law, plane strain
# ---------------------------------------------------------------------------------------------------------


def full(sigma):
    """The 3x3 tensor of (11, 22, 12, 33)."""
    return np.array(
        [[sigma[S11], sigma[S12], 0.0], [sigma[S12], sigma[S22], 0.0], [0.0, 0.0, sigma[S33]]], dtype=float
    )


def components(tensor):
    """(11, 22, 12, 33) of a 3x3 tensor."""
    return np.array([tensor[0, 0], tensor[1, 1], tensor[0, 1], tensor[2, 2]])


def in_space(L):
    """The 3x3 velocity gradient of a plane one."""
    L3 = np.zeros((3, 3))
    L3[:2, :2] = L
    return L3


def De(d, model):
    """Elastic stiffness applied to a symmetric 3x3 tensor: lambda tr(d) I + 2 G d."""
    E, nu = model["E"], model["nu"]
    lam = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    G = E / (2.0 * (1.0 + nu))
    return lam * np.trace(d) * np.eye(3) + 2.0 * G * d


def perzyna(sigma, eps, model):
    """(d_vp, d eps/dt) for a 3x3 stress; Y from eps, held at r Y0 at least."""
    gamma = model["gamma"]
    if gamma is None or gamma == 0.0:
        return np.zeros((3, 3)), 0.0
    Y = max(model["Y0"] + model["H"] * eps, model["r"] * model["Y0"])
    s = sigma - np.trace(sigma) / 3.0 * np.eye(3)
    J2 = 0.5 * np.sum(s * s)
    q = np.sqrt(3.0 * J2)
    if q <= Y:
        return np.zeros((3, 3)), 0.0
    rate = gamma * ((q - Y) / Y) ** model["N"]
    return rate * 1.5 * s / q, rate


# ---------------------------------------------------------------------------------------------------------
# Steps 1-2 and 11-12: the sources alone over half a step, one classical RK4 step at every node
# ---------------------------------------------------------------------------------------------------------


def rk4(rate, y, t, k):
    """One classical fourth order Runge-Kutta step of size k for dy/dt = rate(y, t)."""
    k1 = rate(y, t)
    k2 = rate(y + 0.5 * k * k1, t + 0.5 * k)
    k3 = rate(y + 0.5 * k * k2, t + 0.5 * k)
    k4 = rate(y + k * k3, t + k)
    return y + k / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def stress_source(y, omega, model):
    """d/dt of (sigma11, sigma22, sigma12, sigma33, eps): -De:d_vp + omega sigma - sigma omega, and eps."""
    sigma, eps = full(y[:4]), y[4]
    d_vp, deps_dt = perzyna(sigma, eps, model)
    dsigma_dt = -De(d_vp, model) + omega @ sigma - sigma @ omega
    return np.append(components(dsigma_dt), deps_dt)


def velocity_source(v, t0, half, ends, model):
    """Damped by e^(-c half) and pushed by the integral of b (Simpson); pushed first in the second half."""
    b0, b1, b2 = (np.asarray(model["body_force"](t0 + part * half), dtype=float) for part in (0.0, 0.5, 1.0))
    push, left = half / 6.0 * (b0 + 4.0 * b1 + b2), np.exp(-model["damping"] * half)
    return left * (v + push) if ends else left * v + push


def steps_1_2_and_11_12_sources(v, sigma, eps, L, t0, half, ends, model):
    """phi <- L(half) phi from t0 to t0 + half, with the spin of L frozen. Returns v, sigma, eps."""
    n = len(v)
    v_new, sigma_new, eps_new = np.zeros((n, 2)), np.zeros((n, 4)), np.zeros(n)
    for I in range(n):
        if model["small_strain"]:
            omega = np.zeros((3, 3))
        else:
            L3 = in_space(L[I])
            omega = 0.5 * (L3 - L3.T)

        y = np.append(sigma[I], eps[I])
        y = rk4(lambda y, t, omega=omega: stress_source(y, omega, model), y, t0, half)
        sigma_new[I], eps_new[I] = y[:4], y[4]

        v_new[I] = velocity_source(v[I], t0, half, ends, model)
    return v_new, sigma_new, eps_new


# ---------------------------------------------------------------------------------------------------------
# Flux
# ---------------------------------------------------------------------------------------------------------


def div_f(grad_v, grad_sigma, rho, model):
    """(div f for v, div f for sigma), where d phi/dt = -div f + s.

    div f for v is -div(sigma)/rho with 1/rho outside the sum; div f for sigma is -De:d.
    grad_sigma[k, j] is the derivative of component k of (11, 22, 12, 33) along x_j.
    """
    div_sigma = np.array([grad_sigma[S11, 0] + grad_sigma[S12, 1], grad_sigma[S12, 0] + grad_sigma[S22, 1]])
    L3 = in_space(grad_v)
    d = 0.5 * (L3 + L3.T)
    return -div_sigma / rho, -components(De(d, model))


# ---------------------------------------------------------------------------------------------------------
# Steps 3 to 10
# ---------------------------------------------------------------------------------------------------------


def step_3_value_at_aux(nodes, aux, v_s, sigma_s, model):
    """phi_aux: the value of phi_s at the auxiliary nodes."""
    m = len(aux["x"])
    v_aux, sigma_aux = np.zeros((m, 2)), np.zeros((m, 4))
    for C in range(m):
        v_aux[C] = value(aux, C, nodes, v_s, model["kernel"])
        sigma_aux[C] = value(aux, C, nodes, sigma_s, model["kernel"])
    return v_aux, sigma_aux


def steps_4_6_half_step_at_aux(nodes, aux, v_aux, sigma_aux, v_s, sigma_s, dt, model):
    """phi_aux^{n+1/2} = phi_aux - dt/2 div f(phi_s)."""
    m = len(aux["x"])
    v_aux_half, sigma_aux_half = np.zeros((m, 2)), np.zeros((m, 4))
    for C in range(m):
        grad_v = gradient(aux, C, v_aux[C], nodes, v_s, model["kernel"])
        grad_sigma = gradient(aux, C, sigma_aux[C], nodes, sigma_s, model["kernel"])
        div_v, div_sigma = div_f(grad_v, grad_sigma, aux["rho"][C], model)
        v_aux_half[C] = v_aux[C] - 0.5 * dt * div_v
        sigma_aux_half[C] = sigma_aux[C] - 0.5 * dt * div_sigma
    return v_aux_half, sigma_aux_half


def step_7_value_at_nodes(nodes, aux, v_aux_half, sigma_aux_half, t, dt, model):
    """phi_node^{n+1/2}: the value of phi_aux^{n+1/2} at the nodes, then boundary conditions at t + dt/2."""
    n = len(nodes["x"])
    v_half, sigma_half = np.zeros((n, 2)), np.zeros((n, 4))
    for I in range(n):
        v_half[I] = value(nodes, I, aux, v_aux_half, model["kernel"])
        sigma_half[I] = value(nodes, I, aux, sigma_aux_half, model["kernel"])
    return boundary_conditions(v_half, sigma_half, t + 0.5 * dt, model)


def steps_8_10_advance_at_nodes(
    nodes, aux, v_half, sigma_half, v_aux_half, sigma_aux_half, v_s, sigma_s, dt, model
):
    """sigma_adv, v_adv, and the velocity gradient of v^{n+1/2} at the nodes.

    8-10a: sigma_adv = sigma_s - dt div f(phi^{n+1/2}).
    10b:   'blanc-pastor' v_adv = 2 v^{n+1/2} - v_s; 'taylor' v_adv = v_s - dt div f(phi^{n+1/2}).
    """
    n = len(nodes["x"])
    v_adv, sigma_adv, L_new = np.zeros((n, 2)), np.zeros((n, 4)), np.zeros((n, 2, 2))
    for I in range(n):
        grad_v = gradient(nodes, I, v_half[I], aux, v_aux_half, model["kernel"])
        grad_sigma = gradient(nodes, I, sigma_half[I], aux, sigma_aux_half, model["kernel"])
        rho = nodes["rho"][I]
        if not model["small_strain"]:
            # Fluxes of t^{n+1/2} in the configuration x + dt/2 v^{n+1/2}: chain rule, and its density.
            half_stretch = np.eye(2) + 0.5 * dt * grad_v
            grad_v, grad_sigma = grad_v @ np.linalg.inv(half_stretch), grad_sigma @ np.linalg.inv(half_stretch)
            rho = rho / np.linalg.det(half_stretch)
        div_v, div_sigma = div_f(grad_v, grad_sigma, rho, model)
        L_new[I] = grad_v
        sigma_adv[I] = sigma_s[I] - dt * div_sigma
        if model["scheme"] == "blanc-pastor":
            v_adv[I] = 2.0 * v_half[I] - v_s[I]
        elif model["scheme"] == "taylor":
            v_adv[I] = v_s[I] - dt * div_v
        else:
            raise ValueError(f"unknown scheme {model['scheme']!r}")
    return v_adv, sigma_adv, L_new


# ---------------------------------------------------------------------------------------------------------
# Boundary conditions (steps 7 and 13)
# ---------------------------------------------------------------------------------------------------------


def boundary_conditions(v, sigma, t, model):
    """The test box at time t; returns new v, sigma.

    left:   roller, v_x = 0 and sigma12 = 0.
    bottom: fixed, v = 0.
    top:    v_y = f(t) and sigma12 = 0.
    right:  traction-free, sigma11 = 0 and sigma12 = 0, but a traction component is left alone where the
            velocity in its direction is prescribed (sigma11 by v_x, sigma12 by v_y).
    """
    v, sigma = v.copy(), sigma.copy()
    for I in range(len(v)):
        left, bottom, right, top = (bool(model[side][I]) for side in ("left", "bottom", "right", "top"))
        v_x_prescribed = left or bottom
        v_y_prescribed = bottom or top

        if top:
            v[I, 1] = model["top_velocity"](t)
            sigma[I, S12] = 0.0
        if left:
            v[I, 0] = 0.0
            sigma[I, S12] = 0.0
        if bottom:
            v[I] = 0.0
        if right:
            if not v_x_prescribed:
                sigma[I, S11] = 0.0
            if not v_y_prescribed:
                sigma[I, S12] = 0.0
    return v, sigma


# ---------------------------------------------------------------------------------------------------------
# Step 14 and the whole step
# ---------------------------------------------------------------------------------------------------------


def step_14_move(nodes, v_half, L_new, dt, model):
    """x <- x + dt v^{n+1/2}, rho <- rho / det(F); V and h follow rho, auxiliary nodes follow x.

    F = I + dt dv/dx with the gradient in the configuration of t^n. L_new is the one in that of the half step,
    L_new = L_n (I + dt/2 L_n)^-1, hence L_n = (I - dt/2 L_new)^-1 L_new.
    """
    x, rho = nodes["x"].copy(), nodes["rho"].copy()
    if model["small_strain"]:
        return x, rho
    for I in range(len(x)):
        x[I] = x[I] + dt * v_half[I]
        F = np.eye(2) + dt * np.linalg.solve(np.eye(2) - 0.5 * dt * L_new[I], L_new[I])
        rho[I] = rho[I] / (F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0])
    return x, rho


def slow_step(state: dict, model: dict, t: float, dt: float) -> dict:
    """The state at t + dt from the state at t; the input is not changed."""
    v = np.array(state["v"], dtype=float)
    sigma = np.array(state["sigma"], dtype=float)
    eps = np.array(state["eps"], dtype=float)
    L = np.array(state["L"], dtype=float)

    nodes = material_nodes(state, model)
    aux = auxiliary_nodes(nodes, model["cells"])

    v_s, sigma_s, eps_s = steps_1_2_and_11_12_sources(v, sigma, eps, L, t, 0.5 * dt, False, model)

    v_aux, sigma_aux = step_3_value_at_aux(nodes, aux, v_s, sigma_s, model)
    v_aux_half, sigma_aux_half = steps_4_6_half_step_at_aux(nodes, aux, v_aux, sigma_aux, v_s, sigma_s, dt, model)
    v_half, sigma_half = step_7_value_at_nodes(nodes, aux, v_aux_half, sigma_aux_half, t, dt, model)
    v_adv, sigma_adv, L_new = steps_8_10_advance_at_nodes(
        nodes, aux, v_half, sigma_half, v_aux_half, sigma_aux_half, v_s, sigma_s, dt, model
    )

    v_new, sigma_new, eps_new = steps_1_2_and_11_12_sources(
        v_adv, sigma_adv, eps_s, L_new, t + 0.5 * dt, 0.5 * dt, True, model
    )
    v_new, sigma_new = boundary_conditions(v_new, sigma_new, t + dt, model)  # step 13
    x_new, rho_new = step_14_move(nodes, v_half, L_new, dt, model)

    return {"x": x_new, "v": v_new, "sigma": sigma_new, "eps": eps_new, "rho": rho_new, "L": L_new}
