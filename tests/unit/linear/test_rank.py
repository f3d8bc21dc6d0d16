"""Ranks of sparse matrices: equal to numpy's, by every way there is."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.clock import Deadline
from amontons.core.errors import TimeUp
from amontons.linear import rank as ranks
from amontons.linear.rank import matrix_rank, semidefinite_rank


def product(random, n, m, inner, share):
    """A random matrix (n, m) of rank `inner` at most, with a share of its rows and columns."""
    left = random.standard_normal((n, inner)) * (random.random((n, inner)) < share)
    right = random.standard_normal((inner, m)) * (random.random((inner, m)) < share)
    return sparse.csr_array(left @ right)


@pytest.mark.parametrize("dense", [1500, 0])
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_rank_of_random_matrices(dense, share, monkeypatch):
    monkeypatch.setattr(ranks, "DENSE", dense)
    random = np.random.default_rng(3)
    for _ in range(60):
        n, m, inner = random.integers(1, 30, 3)
        A = product(random, n, m, inner, share)
        found = matrix_rank(A)
        assert (found.rows, found.columns) == (n, m)
        assert found.least <= np.linalg.matrix_rank(A.toarray()) <= found.value


def test_units_of_rows_and_columns_do_not_matter():
    random = np.random.default_rng(5)
    A = product(random, 12, 9, 5, 1.0)
    scaled = sparse.diags_array(10.0 ** random.uniform(-8, 8, 12)) @ A
    assert matrix_rank(A).value == matrix_rank(scaled).value == 5
    assert str(matrix_rank(A)) == "5 of 9"


def test_a_doubtful_rank_says_so(monkeypatch):
    monkeypatch.setattr(ranks, "DENSE", 0)
    A = sparse.csr_array(np.array([[1.0, 1.0], [0.0, 5e-6], [1.0, 1.0]]))
    found = matrix_rank(A @ sparse.csr_array(np.array([[1.0, 0.3], [0.0, 1.0]])) @ A.T)
    assert found.least <= found.value <= 2


def test_spheres_are_hyperstatic_and_walls_of_elastic_blocks_are_not():
    packing = am.SpherePacking(count=60).problem()
    found = matrix_rank(packing.H)
    assert found.value == np.linalg.matrix_rank(packing.H.toarray()) == 360
    assert not found.is_full
    made = am.Wall(3, 3, (0.4, 0.2, 0.2), (2, 1, 1), am.LinearElastic(1e9, 0.2),
                   bond=am.Bond.ALTERNATING, plate=0.05, base=0.05,
                   plate_material=am.Rigid())  # fmt: skip
    H = made.sheared((0, 0, -1.0), (0, 0, None)).discretisation.H
    assert matrix_rank(H).is_full


def test_rank_of_w_by_cholesky_and_empty_matrices():
    random = np.random.default_rng(1)
    H = random.standard_normal((7, 15))
    assert semidefinite_rank(sparse.csr_array(H.T @ H)).value == 7
    assert matrix_rank(sparse.csr_array((3, 4))).value == 0
    assert matrix_rank(sparse.csr_array((0, 4))).value == 0
    assert semidefinite_rank(np.zeros((0, 0))).value == 0


def test_ranks_end_with_their_time():
    A = sparse.csr_array(np.ones((300, 200)))
    with pytest.raises(TimeUp):
        matrix_rank(A, Deadline.counted(1e-9))
    with pytest.raises(TimeUp):
        semidefinite_rank(np.eye(500), Deadline.counted(1e-9))
