"""Block rows hold the same matrix, whatever it came from."""

import numpy as np
import pytest
from scipy import sparse

from amontons.linear.blocks import block_rows, spatial


def dense(rows, d):
    """The matrix that the block rows hold, restricted to the first d axes of a contact."""
    nc = len(rows.diagonal)
    out = np.zeros((nc, 3, nc, 3))
    for i in range(nc):
        for k in range(rows.indptr[i], rows.indptr[i + 1]):
            out[i, :, rows.indices[k], :] = rows.data[k]
    return out[:, :d, :, :d].reshape(nc * d, nc * d), out


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("as_sparse", [False, True])
def test_same_matrix(d, as_sparse):
    rng = np.random.default_rng(d)
    W = rng.standard_normal((5 * d, 5 * d)) * (rng.random((5 * d, 5 * d)) < 0.15)
    rows = block_rows(sparse.csr_array(W) if as_sparse else W, d)
    np.testing.assert_array_equal(dense(rows, d)[0], W)
    np.testing.assert_array_equal(rows.indices[rows.diagonal], np.arange(5))
    for i in range(5):
        assert (np.diff(rows.indices[rows.indptr[i] : rows.indptr[i + 1]]) > 0).all()
    assert 0.2 <= rows.density <= 1


def test_a_planar_contact_gets_a_decoupled_second_tangent():
    W = np.array([[2.0, 1.0], [1.0, 3.0]])
    block = block_rows(W, 2).diagonal_blocks[0]
    np.testing.assert_array_equal(block, [[2, 1, 0], [1, 3, 0], [0, 0, 3]])
    assert block_rows(np.zeros((2, 2)), 2).diagonal_blocks[0, 2, 2] == 0  # can not react
    held = np.diag([1e-9, 0.0])  # in its own unit, whatever that is
    assert block_rows(held, 2).diagonal_blocks[0, 2, 2] == 1e-9


def test_spatial_is_a_copy():
    x = np.ones((2, 2))
    y = spatial(x)
    y[:] = 5
    assert x.max() == 1
    np.testing.assert_array_equal(spatial(x), [[1, 1, 0], [1, 1, 0]])
