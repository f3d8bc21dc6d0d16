"""Forces of a body as derivatives of its energy, and tangents as derivatives of its forces."""

import numpy as np
import pytest


def check_energy_forces_and_tangent(body, u):
    """Asserts it at the displacements u (nodes, dim) in a random direction."""
    forces, blocks = body.tangent(u)
    np.testing.assert_allclose(body.forces(u), forces, atol=1e-13 * abs(forces).max())
    K = body.matrix(blocks)
    assert abs((K - K.T).data).max(initial=0.0) <= 1e-13 * abs(blocks).max()
    way = np.random.default_rng(5).standard_normal(u.shape)

    def central(function, h=2e-4):
        """To the fourth order."""
        first, second = (function(u + s * way) - function(u - s * way) for s in (h, 2 * h))
        return (8 * first - second) / (12 * h)

    slope = (K @ way.ravel()).reshape(u.shape)
    assert abs(central(body.forces) - slope).max() < 1e-7 * abs(slope).max()
    assert central(body.energy) == pytest.approx((forces * way).sum(), rel=1e-7)
