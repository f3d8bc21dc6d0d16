"""Points and weights of quadrature, from eigenvalues as of Golub and Welsch (1969).

As `roots_jacobi` and `roots_legendre` of scipy.special, whose import takes longer than a small
solve assembles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]


def roots_legendre(count: int) -> Rule:
    """Points in (-1, 1), ascending, and weights, exact for degrees up to 2 count - 1."""
    return np.polynomial.legendre.leggauss(count)


def roots_jacobi(count: int, alpha: float) -> Rule:
    """The same for integrals with the weight (1 - x)^alpha, alpha >= 0."""
    if alpha == 0:
        return roots_legendre(count)
    k = np.arange(1, count)
    n = 2 * k + alpha
    middle = np.r_[-alpha / (alpha + 2), -(alpha**2) / (n * (n + 2))]
    beside = 2 * k * (k + alpha) / (n * np.sqrt(n**2 - 1))
    x, vectors = np.linalg.eigh(np.diag(middle) + np.diag(beside, 1) + np.diag(beside, -1))
    return x, 2.0 ** (alpha + 1) / (alpha + 1) * vectors[0] ** 2
