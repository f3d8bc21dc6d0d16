"""Factors of small systems: dense, by SuperLU, and none of what is singular or large."""

import numpy as np
import pytest
from scipy import sparse

from amontons.core.errors import SingularOperator
from amontons.linear import small
from amontons.linear.small import factor_of_small


def system(n, seed=0):
    """A matrix without symmetry whose first pivot is zero, by columns."""
    shift = sparse.diags_array(np.ones(n - 1), offsets=1, shape=(n, n))
    corner = sparse.coo_array(([1.0], ([n - 1], [0])), shape=(n, n))
    rest = 0.1 * sparse.random_array((n, n), density=3 / n, rng=seed)
    matrix = (shift + corner + rest).tolil()
    matrix[0, 0] = 0.0
    return sparse.csc_array(matrix)


@pytest.mark.parametrize("n", [50, small.DENSE + 50])
def test_solves_one_and_several_right_hand_sides(n):
    matrix, b = system(n), np.random.default_rng(1).standard_normal((n, 3))
    factor = factor_of_small(matrix)
    assert factor.exact
    np.testing.assert_allclose(matrix @ factor.solve(b), b, atol=1e-11)
    np.testing.assert_allclose(factor.solve(b[:, 0]), factor.solve(b)[:, 0], rtol=1e-12)


@pytest.mark.parametrize("n", [50, small.DENSE + 50])
@pytest.mark.parametrize("what", ["empty", "twice", "nan"])
def test_says_that_a_matrix_is_singular(n, what):
    matrix = system(n).tolil()
    if what == "nan":
        matrix[3, 4] = np.nan
    else:
        matrix[3] = 0.0 if what == "empty" else matrix[4]
    with pytest.raises(SingularOperator, match="matrix|trial|singular|pivots"):
        factor_of_small(sparse.csc_array(matrix))


def test_leaves_large_and_empty_systems_to_others(monkeypatch):
    monkeypatch.setattr(small, "FEW", 100)
    assert factor_of_small(system(small.DENSE + 50)) is None
    assert factor_of_small(sparse.csc_array((0, 0))) is None
