"""Products of matrices in blocks are scipy's, to the last bit, for any number of threads."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.linear.products import product


def blocks(rows, columns, each, seed):
    """A matrix with `each` random blocks in a row, some of them twice."""
    random = np.random.default_rng(seed)
    where = np.sort(random.integers(0, columns, (rows, each)), axis=1).ravel()
    data = random.standard_normal((rows * each, 3, 3))
    return sparse.bsr_array((data, where, np.arange(rows + 1) * each),
                            shape=(3 * rows, 3 * columns))  # fmt: skip


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("rows", [2, 1500])
def test_parts_of_a_product_are_put_together(rows, threads):
    left, right = blocks(rows, 700, 8, 1), blocks(700, 90, 5, 2)
    before = am.threads()
    try:
        am.threads(threads)
        found = product(left, right)
    finally:
        am.threads(before)
    expected = left @ right
    assert found.shape == expected.shape
    for name in ("data", "indices", "indptr"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_a_product_without_entries_is_zero():
    nothing = sparse.bsr_array((3, 6), blocksize=(3, 3))
    assert product(nothing, blocks(2, 4, 2, 0)).nnz == 0
