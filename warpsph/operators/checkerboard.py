"""How much of the stress's checkerboard a step takes off: a share of it, and no more than a share of what it adds.

A static load is held by stresses that are not free of checkerboards, at edges and where the soil yields. Bled off
every step, they would be made up for by a strain rate d with Dₑ : d Δt = what is taken off: the body would flow.
With no more taken off than β 2G |L| Δt, β < 1, there is no such d but 0, since |Dₑ : d| ≥ 2G |d| (ν ≥ 0); but for
a body that spins as it flows, |d| < β |L|. What has come to rest stays. Whatever moves is damped as if there were
no bound: in a wave on 20 cells, which loses 4·10⁻⁶ of its stress a step, that is 15 000 times as much.
"""

from functools import cache

import warp as wp

from ..physics.space import Space

STRESS_SHARE = 0.1  # θ of the stress. More strengthens a shear band one cell wide
MOST_OF_STRAIN = 0.5  # β. With 0.1 plastic zones of slow loadings turn rough, with 0.9 bodies at rest flow


@cache
def taken_off(space: Space) -> wp.Function:
    """(checkerboard of the stress, L, G, Δt) → what is taken off [Pa], along the checkerboard."""
    real = space.real

    @wp.func
    def off(checkerboard: space.types.stress, L: space.types.tensor, shear: real, dt: real):
        whole = real(STRESS_SHARE) * checkerboard
        most = real(2.0 * MOST_OF_STRAIN) * shear * dt * wp.sqrt(wp.ddot(L, L))
        size = space.stress.norm(whole)
        if size > most:
            return (most / size) * whole
        return whole

    return off
