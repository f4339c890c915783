"""A bulk viscosity that acts at fronts only: it takes the ringing of a second-order scheme off a shock.

In a cell with the volumetric rate e = tr L, the pressure −q = −ρ ν ψ e with ν = χ (1 − C²) Δ²/(4Δt) damps the
shortest compression wave by the factor 1 − χ (1 − C²) ψ a step, on top of Lax and Wendroff's 1 − 2C². How rough e
is, r = |e − mean of the corners' tr L|/largest of all, decides: ψ = min(1, (r/0.3)²). r is 1/2 at a jump and about
(k Δ)² in a wave, so a wave resolved by 40 cells is damped 10⁻⁴ times as much as a jump. Shear is left alone: a
shear band is as sharp as a shock, and a viscosity there would carry load.
"""

from functools import cache

import warp as wp

from ..mesh.kinds import CellKind
from ..physics.space import Space

STRENGTH = 1.0  # χ: ringing behind a front 4 % of the jump at C = 0.5 and 200 columns, 9 % without
ROUGH = 0.3


@cache
def front_pressure(space: Space, kind: CellKind) -> wp.Function:
    """(cell, tr L there, frame ∇ξ, auxiliary nodes, nodes, χ(1 − C²), Δt) → q [Pa], a tension."""
    types, real = space.types, space.real

    @wp.func
    def pressure(
        a: int,
        rate: real,
        frame: types.tensor,
        auxiliary: types.AuxiliaryNodes,
        nodes: types.MaterialNodes,
        strength: real,
        dt: real,
    ):
        mean, largest, per_width2 = real(0.0), wp.abs(rate), real(0.0)
        for k in range(wp.static(kind.corners)):
            i = auxiliary.cell[a, k]
            own = wp.trace(nodes.velocity_gradient[i])
            mean += own / real(wp.static(kind.corners))
            largest = wp.max(largest, wp.abs(own))
        for b in range(wp.static(space.dim)):
            per_width2 = wp.max(per_width2, wp.length_sq(frame[b]))
        if largest * per_width2 * dt <= real(0.0):
            return real(0.0)
        rough = (rate - mean) / (real(ROUGH) * largest)
        viscosity = strength * auxiliary.density[a] / (real(4.0) * dt * per_width2)
        return viscosity * wp.min(rough * rough, real(1.0)) * rate

    return pressure
