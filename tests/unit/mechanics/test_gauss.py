"""Quadrature against scipy's, and against integrals known in closed form."""

import math

import numpy as np
import pytest
from scipy import special

from amontons.mechanics.meshes.gauss import roots_jacobi, roots_legendre


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("alpha", [0, 1, 2])
def test_points_and_weights_are_those_of_scipy(count, alpha):
    x, w = roots_jacobi(count, alpha)
    peer_x, peer_w = special.roots_jacobi(count, alpha, 0)
    assert np.allclose(x, peer_x, atol=1e-15, rtol=0)
    assert np.allclose(w, peer_w, rtol=1e-13, atol=0)


@pytest.mark.parametrize("alpha", [1, 2])
def test_integrals_of_powers_are_exact(alpha):
    x, w = roots_jacobi(4, alpha)
    for k in range(8):  # by the beta function, on (0, 1): t = (1 - x) / 2
        exact = 2.0 ** (alpha + 1) * math.factorial(k) * math.factorial(alpha)
        exact /= math.factorial(k + alpha + 1)
        assert w @ ((1 + x) / 2) ** k == pytest.approx(exact, rel=1e-14)
    assert w @ ((1 + x) / 2) ** 8 != pytest.approx(exact * 8 / (9 + alpha), rel=1e-9)


def test_without_a_weight_they_are_those_of_legendre():
    for mine, theirs in zip(roots_jacobi(3, 0), roots_legendre(3), strict=True):
        assert np.array_equal(mine, theirs)
    assert np.allclose(roots_legendre(3)[0], [-math.sqrt(0.6), 0, math.sqrt(0.6)], atol=1e-16)
