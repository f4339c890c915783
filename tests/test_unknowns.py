"""φ as named blocks: who changes one leaves the others alone."""

import numpy as np
import pytest
import warp as wp

from warpsph.device.compiling import forward_kernel
from warpsph.device.precision import PRECISIONS
from warpsph.physics.unknowns import Unknowns

BLOCKS = {"velocity": 2, "stress": 4, "pore_pressure": 1}
VALUES, OTHERS = np.arange(1.0, 8.0), np.arange(10.0, 17.0)
PLACES = {"velocity": slice(0, 2), "stress": slice(2, 6), "pore_pressure": slice(6, 7)}


@pytest.mark.parametrize("name", BLOCKS)
def test_a_block_is_taken_out_and_replaced_and_no_other_changes(name, precision, device):
    """Also with a third one, which those who replace velocities or stresses know nothing of."""
    real = PRECISIONS[precision]
    phi = Unknowns(2, real, BLOCKS.items())
    block, matrix = real.vec(BLOCKS[name]), real.mat(BLOCKS[name], 2)
    take, replace, rows = (getattr(phi, key) for key in (name, f"with_{name}", f"{name}_gradient"))

    @forward_kernel
    def use(
        values: wp.array(dtype=phi.phi),
        other: wp.array(dtype=phi.phi),
        gradient: wp.array(dtype=phi.gradient),
        taken: wp.array(dtype=block),
        replaced: wp.array(dtype=phi.phi),
        of_gradient: wp.array(dtype=matrix),
    ):
        taken[0] = take(values[0])
        replaced[0] = replace(values[0], take(other[0]))
        of_gradient[0] = rows(gradient[0])

    gradients = np.arange(14.0).reshape(7, 2)
    values, other, gradient = (
        wp.array(array[None], dtype=kind, device=device)
        for array, kind in ((VALUES, phi.phi), (OTHERS, phi.phi), (gradients, phi.gradient))
    )
    taken, replaced, of_gradient = (
        wp.full(1, wp.nan, dtype=kind, device=device) for kind in (block, phi.phi, matrix)
    )
    wp.launch(use, 1, inputs=[values, other, gradient, taken, replaced, of_gradient], device=device)
    place, expected = PLACES[name], VALUES.copy()
    expected[place] = OTHERS[place]
    assert np.array_equal(taken.numpy().ravel(), VALUES[place])
    assert np.array_equal(replaced.numpy()[0], expected)
    assert np.array_equal(of_gradient.numpy().reshape(-1, 2), gradients[place])
    assert np.array_equal(values.numpy()[0], VALUES)
