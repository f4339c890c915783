"""Standard SPH, for comparison: the scheme whose tensile instability the two node sets avoid.

One set of nodes carries position, velocity, stress and density (collocated); the momentum equation is symmetric,

    dv_I/dt = Σ m_J (σ_I/ρ_I² + σ_J/ρ_J²) · ∇W_IJ,        L_I = Σ (m_J/ρ_J) (v_J − v_I) ⊗ ∇W_IJ,

with the Gaussian W of the solver's sums, of fixed h, without correction and artificial viscosity; RK4 in time.
Elastic plane strain with the Jaumann rate, as in the solver. NumPy, all pairs: for some hundred nodes. A
comparator beside the examples, no part of the solver.
"""

import numpy as np

COURANT = 0.3  # c_p Δt/Δx
SUPPORT = 3.0  # radius of the support in smoothing lengths


class StandardSPH:
    """A scene (plane strain, elastic; nodes under velocity conditions are held) by standard SPH.

    Args:
        scene: the scene.
        smoothing_ratio: smoothing length over spacing h/Δx [-].

    Attributes:
        time: simulated time [s].
        x, v: positions [m] and velocities [m/s], shape (n, 2).
        stress: s11, s22, s12, s33 [Pa], shape (n, 4).
        density: ρ [kg/m³], shape (n,).
        blown: whether it has failed: a node is farther from its start than the body is wide, or nowhere.
    """

    def __init__(self, scene, smoothing_ratio):
        mesh, material = scene.mesh, scene.material
        volume = mesh.node_weights()
        self.time, self.blown = 0.0, False
        self.x, self.v = mesh.nodes.copy(), scene.initial_velocity.copy()
        self.stress = scene.initial_stress.copy()
        self.density = np.full(len(volume), material.density)
        self._mass, self._h = material.density * volume, smoothing_ratio * np.sqrt(volume.mean())
        self._lame, self._shear = material.lame_modulus, material.shear_modulus
        self._held = scene.boundary.nodes[scene.boundary.moved]
        self._start, self._size = mesh.nodes, np.ptp(mesh.nodes, axis=0).max()
        self._dt = COURANT * mesh.smallest_distance() / material.wave_speed(2)

    def run(self, until, observe):
        """Advance to a time [s]; call `observe(self)` at the start and after every step; stop when it fails."""
        observe(self)
        for _ in range(int(np.ceil((until - self.time) / self._dt - 1e-9))):
            self._step(min(self._dt, until - self.time))
            away = np.abs(self.x - self._start).max()
            self.blown = not away <= self._size
            if self.blown:
                return
            observe(self)

    def _step(self, dt):
        start = (self.x, self.v, self.stress, self.density)
        with np.errstate(all="ignore"):  # a run that fails overflows before it is stopped
            k1 = self.rates(*start)
            k2 = self.rates(*_moved(start, k1, 0.5 * dt))
            k3 = self.rates(*_moved(start, k2, 0.5 * dt))
            k4 = self.rates(*_moved(start, k3, dt))
            slope = [(a + 2.0 * b + 2.0 * c + d) / 6.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
            self.x, self.v, self.stress, self.density = _moved(start, slope, dt)
        self.time += dt

    def rates(self, x, v, stress, density):
        """Time derivatives of position, velocity, stress and density."""
        i, j, gradient = _pairs(x, self._h)
        n, mass = len(x), self._mass
        sigma = np.empty((n, 2, 2))
        sigma[:, 0, 0], sigma[:, 1, 1] = stress[:, 0], stress[:, 1]
        sigma[:, 0, 1] = sigma[:, 1, 0] = stress[:, 2]
        flux = sigma / density[:, None, None] ** 2
        acceleration = _sum(i, mass[j, None] * np.einsum("pab,pb->pa", flux[i] + flux[j], gradient), n)
        acceleration[self._held] = 0.0
        pull = (mass[j] / density[j])[:, None] * (v[j] - v[i])
        L = _sum(i, np.einsum("pa,pb->pab", pull, gradient).reshape(-1, 4), n).reshape(n, 2, 2)
        d, spin = 0.5 * (L + L.transpose(0, 2, 1)), 0.5 * (L - L.transpose(0, 2, 1))
        turn = spin @ sigma - sigma @ spin
        volume_rate = L[:, 0, 0] + L[:, 1, 1]
        rate = np.empty_like(stress)
        for k, (a, b) in enumerate(((0, 0), (1, 1), (0, 1))):
            rate[:, k] = self._lame * volume_rate * (a == b) + 2.0 * self._shear * d[:, a, b] + turn[:, a, b]
        rate[:, 3] = self._lame * volume_rate
        return v, acceleration, rate, -density * volume_rate


def alternating_growth_rate(spacing, smoothing_length, stress, density):
    """Growth rate [1/s] of the fastest mode that alternates from node to node, in uniform tension σ11 = σ22.

    On a square lattice such modes, k Δx = (π, 0), (0, π) or (π, π), have no velocity gradient, hence no elastic
    response, and small displacements u obey d²u/dt² = (2σV/ρ) Σ_J ∇∇W(x_J) (1 − cos k·x_J) u.
    """
    reach = int(SUPPORT * smoothing_length / spacing)
    grid = np.arange(-reach, reach + 1) * spacing
    x = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
    distance = np.linalg.norm(x, axis=1)
    x = x[(distance > 0.0) & (distance < SUPPORT * smoothing_length)]
    h2 = smoothing_length**2
    W = np.exp(-np.sum(x**2, axis=1) / h2) / (np.pi * h2)
    hessian = (4.0 * x[:, :, None] * x[:, None, :] / h2**2 - 2.0 * np.eye(2) / h2) * W[:, None, None]
    fastest = -np.inf
    for k in np.pi / spacing * np.array([(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]):
        matrix = np.sum(hessian * (1.0 - np.cos(x @ k))[:, None, None], axis=0)
        fastest = max(fastest, np.linalg.eigvalsh(matrix)[-1])
    return float(np.sqrt(2.0 * stress * spacing**2 / density * fastest))


def _pairs(x, h):
    """Indices i ≠ j of all pairs within the support, and ∂W_ij/∂x_i [1/m³]."""
    away = x[:, None] - x[None]
    squares = np.sum(away**2, axis=2)
    i, j = np.nonzero((squares < (SUPPORT * h) ** 2) & (squares > 0.0))
    W = np.exp(-squares[i, j] / h**2) / (np.pi * h**2)
    return i, j, -2.0 * away[i, j] / h**2 * W[:, None]


def _sum(i, terms, n):
    """Sums (n, k) of the terms (pairs, k) of each node."""
    return np.stack([np.bincount(i, column, n) for column in terms.T], axis=1)


def _moved(state, slope, dt):
    return [value + dt * rate for value, rate in zip(state, slope, strict=True)]
