"""Products of blocks by lanes, beside numpy's; nothing beyond a block is read or written."""

import numpy as np
import pytest
from numba import njit, uint64

from amontons.linear import block_products
from amontons.linear.block_products import (
    add_block_inplace,
    product_of_blocks,
    product_of_blocks_back,
    spread_blocks_inplace,
    subtract_products_inplace,
)

NAN = np.nan


@njit
def _product(data, indices, r, first, last, without):
    return product_of_blocks(data, indices, r, uint64(first), uint64(last), uint64(without))


@njit
def _subtract(work, columns, U, L, l, first, last):
    subtract_products_inplace(work, columns, U, L, uint64(l), uint64(first), uint64(last))


@pytest.mark.parametrize("product", [_product, block_products._product_in_python])
@pytest.mark.parametrize(
    ("first", "last", "without"),
    [(1, 6, 3), (1, 6, 6), (2, 3, 2), (4, 4, 4), (1, 6, 1), (1, 6, 5)],
)
def test_a_row_of_blocks_times_a_vector_without_one_of_them(product, first, last, without):
    random = np.random.default_rng(first + 10 * without)
    data, r = random.standard_normal((7, 3, 3)), random.standard_normal((9, 3))
    indices = np.array([0, 8, 2, 5, 4, 7, 1], np.int32)
    chosen = [k for k in range(first, last) if k != without]
    unused = np.setdiff1d(np.arange(9), indices[chosen])
    data[[k for k in range(7) if k not in chosen]] = r[unused] = NAN
    expected = sum((data[k] @ r[indices[k]] for k in chosen), np.zeros(3))
    np.testing.assert_allclose(product(data, indices, r, first, last, without), expected,
                               rtol=0, atol=1e-15 * 30)  # fmt: skip


@pytest.mark.parametrize("subtract", [_subtract, block_products._subtract_in_python])
def test_products_of_blocks_are_subtracted_where_they_belong_and_nowhere_else(subtract):
    random = np.random.default_rng(3)
    work, U, L = (random.standard_normal((count, 3, 3)) for count in (6, 5, 4))
    columns, before = np.array([0, 5, 3, 1, 2], np.int32), work.copy()
    U[[0, 4]] = L[[0, 1, 3]] = NAN
    subtract(work, columns, U, L, 2, 1, 4)
    expected = before.copy()
    for j in (1, 2, 3):
        expected[columns[j]] -= L[2] @ U[j]
    np.testing.assert_allclose(work, expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(work[[0, 2, 4]], before[[0, 2, 4]])


@njit
def _back(data, indices, r, first, last):
    return product_of_blocks_back(data, indices, r, uint64(first), uint64(last))


@njit
def _spread(data, indices, out, first, last, x0, x1, x2):  # noqa: PLR0913
    spread_blocks_inplace(data, indices, out, uint64(first), uint64(last), x0, x1, x2)


@njit
def _add(out, t, weight, blocks, k):
    add_block_inplace(out, uint64(t), weight, blocks, uint64(k))


IN_PYTHON = (
    block_products._product_back_in_python,
    block_products._spread_in_python,
    block_products._add_in_python,
)


@pytest.mark.parametrize(("back", "spread", "add"), [(_back, _spread, _add), IN_PYTHON])
@pytest.mark.parametrize(("first", "last"), [(1, 6), (2, 3), (4, 4)])
def test_blocks_backwards_transposed_and_added(back, spread, add, first, last):
    random = np.random.default_rng(first)
    data, r = random.standard_normal((7, 3, 3)), random.standard_normal((9, 3))
    indices, x = np.array([0, 8, 2, 5, 2, 7, 1], np.int32), (0.5, -2.0, 3.0)
    chosen = range(first, last)
    data[[k for k in range(7) if k not in chosen]] = NAN
    r[np.setdiff1d(np.arange(9), indices[first:last])] = NAN
    wanted = sum((data[k] @ r[indices[k]] for k in chosen), np.zeros(3))
    np.testing.assert_allclose(back(data, indices, r, first, last), wanted, atol=1e-13)
    out = random.standard_normal((9, 4))
    wanted = out.copy()
    for k in chosen:
        wanted[indices[k], :3] += data[k].T @ x
    spread(data, indices, out, first, last, *x)
    np.testing.assert_allclose(out, wanted, rtol=0, atol=1e-13)
    blocks = random.standard_normal((3, 3, 3))
    wanted = blocks.copy()
    wanted[1] += 0.3 * data[first] if chosen else NAN
    add(blocks, 1, 0.3, data, first)
    np.testing.assert_allclose(blocks, wanted, rtol=0, atol=1e-14)
