"""Sums of entries and products in one pass, beside those of SciPy step by step."""

import numpy as np
import pytest
from scipy import sparse

from amontons.linear.sums import (
    among,
    by_components,
    in_rows,
    rows_of_products,
    sum_of_blocks,
    sum_of_products,
)


def some(n, m, seed):
    """A sparse matrix by rows."""
    return sparse.random_array((n, m), density=0.3, rng=seed, format="csr")


def same(found, wanted):
    """The same numbers, columns sorted and each there once."""
    assert found.has_canonical_format
    np.testing.assert_allclose(found.toarray(), wanted, atol=1e-14)


def test_blocks_add_up_and_negative_rows_are_none():
    rng = np.random.default_rng(0)
    blocks, wanted = [], np.zeros((9, 7))
    for q, m, w in ((5, 2, 3), (4, 1, 1), (0, 2, 2)):
        values = rng.standard_normal((q, m, w))
        rows, columns = rng.integers(-1, 9, (q, m)), rng.integers(0, 7, (q, w))
        blocks.append((values, rows, columns))
        for k, i, j in np.ndindex(q, m, w):
            if rows[k, i] >= 0:
                wanted[rows[k, i], columns[k, j]] += values[k, i, j]
    same(sum_of_blocks(blocks, (9, 7)), wanted)
    assert sum_of_blocks(blocks[2:], (9, 7)).nnz == 0


def test_products_add_up():
    a, b, c, e = some(6, 4, 1), some(4, 8, 2), some(6, 3, 3), some(3, 8, 4)
    alone = some(6, 8, 5)
    wanted = (a @ b + c @ e + alone).toarray()
    same(sum_of_products([(a, b), (c, e), (None, alone)], (6, 8)), wanted)
    assert sum_of_products([], (6, 8)).nnz == 0


def test_rows_go_on_as_they_are():
    every, wide = sparse.csr_array(np.ones((7, 2))), some(2, 9, 6)  # fills up
    found = rows_of_products([(every, wide), (None, some(7, 9, 7))], (7, 9))
    wanted = (every @ wide + some(7, 9, 7)).toarray()
    same(found.matrix, wanted)
    same((-found.times(np.arange(7.0))).matrix, -np.arange(7.0)[:, None] * wanted)
    same(sum_of_products([(some(4, 7, 8), found)], (4, 9)), some(4, 7, 8) @ wanted)
    chosen = np.array([0, 3, 6])
    same(among(rows_of_products([(None, some(9, 9, 9))], (9, 9)), chosen),
         some(9, 9, 9).toarray()[np.ix_(chosen, chosen)])  # fmt: skip


def test_components_repeat_a_matrix_and_leave_out_what_is_held():
    matrix, factors = some(5, 6, 6), np.random.default_rng(7).integers(0, 2, (6, 3))
    wanted = sparse.kron(matrix, np.eye(3)).toarray() * factors.ravel()
    found = by_components(matrix, factors.astype(float))
    same(found, wanted)
    assert found.nnz == np.count_nonzero(wanted)


@pytest.mark.parametrize("rows", [[1, 4, 5, 8], [5, 1, 8, 4]])
def test_rows_go_to_their_places(rows):
    matrix, wanted = some(4, 6, 8), np.zeros((10, 6))
    wanted[rows] = matrix.toarray()
    same(in_rows(matrix, np.array(rows), 10), wanted)


def test_some_rows_and_columns():
    matrix, chosen = some(9, 9, 9), np.array([0, 2, 3, 7])
    same(among(matrix, chosen), matrix.toarray()[np.ix_(chosen, chosen)])
