"""Block rows hold the same matrix, whatever it came from."""

import numpy as np
import pytest
from scipy import sparse

from amontons.linear.blocks import block_rows, spatial, velocity_inplace


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


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("stored", [1.0, 0.8])
@pytest.mark.parametrize("as_sparse", [False, True])
def test_rows_of_a_nearly_full_matrix(d, stored, as_sparse):
    rng = np.random.default_rng(d)
    W = rng.standard_normal((20, d, 20, d)) * (rng.random((20, 20)) < stored)[:, None, :, None]
    W = W.reshape(20 * d, 20 * d)
    W.flags.writeable = False
    found = block_rows(sparse.csr_array(W) if as_sparse else W, d)
    assert found.rows.shape == (20, 3, 60)
    np.testing.assert_array_equal(found.rows.reshape(20, 3, 20, 3), dense(found, d)[1])
    q, r, by_rows, by_blocks = rng.standard_normal((4, 20, 3))
    velocity_inplace(found.indptr, found.indices, found.rows, q, r, by_rows)
    velocity_inplace(found.indptr, found.indices, found.data, q, r, by_blocks)
    np.testing.assert_allclose(by_rows, by_blocks, atol=1e-13)


def test_rows_are_blocks_where_few_are_stored_and_for_few_contacts():
    for W in (sparse.eye_array(60, format="csr"), np.ones((9, 9))):
        found = block_rows(W, 3)
        assert found.rows is found.data


def test_spatial_is_a_copy():
    x = np.ones((2, 2))
    y = spatial(x)
    y[:] = 5
    assert x.max() == 1
    np.testing.assert_array_equal(spatial(x), [[1, 1, 0], [1, 1, 0]])


@pytest.mark.parametrize("d", [2, 3])
def test_rows_in_any_order_with_doubles(d):
    rng = np.random.default_rng(d)
    row, column = rng.integers(0, 6 * d, (2, 200))
    order = np.argsort(row, kind="stable")
    row, column, values = row[order], column[order], rng.standard_normal(200)
    indptr = np.searchsorted(row, np.arange(6 * d + 1))
    W = sparse.csr_array((values, column, indptr), shape=(6 * d, 6 * d))
    assert not W.has_canonical_format
    np.testing.assert_allclose(dense(block_rows(W, d), d)[0], W.toarray(), atol=1e-14)


def contacts(A):
    """Block rows of contacts without others, A (nc, 3, 3)."""
    return block_rows(sparse.csr_array(sparse.block_diag(list(A))), 3)


@pytest.mark.parametrize("size", [1e-140, 1e-3, 1.0, 1e120])
def test_inverse_norms_and_what_one_contact_needs(size):
    rng = np.random.default_rng(0)
    A = rng.standard_normal((40, 3, 3))
    A[:10] = A[:10] @ A[:10].swapaxes(1, 2)
    A[10:14] = np.eye(3) * np.array([1.0, 2.0, 0.5, 3.0])[:, None, None]
    A[14, :, 2] = A[14, :, 0]  # singular
    A[15] = 0.0
    rows = contacts(size * A)
    norms = np.linalg.norm(A, 2, axis=(1, 2))
    there = norms > 0
    np.testing.assert_allclose(rows.inverse_norms[there] * norms[there] * size, 1, rtol=1e-14)
    assert rows.inverse_norms[15] == 0
    e = rows.eliminated
    for i in np.flatnonzero(e[:, 0]):
        product = e[i, 1:10].reshape(3, 3) @ (size * A[i])
        np.testing.assert_allclose(product, np.eye(3), atol=1e-9)
    assert e[:14, 0].sum() >= 10
    assert not e[14:16, 0].any()
    own = np.where(A[:, 0, 0] > 0, A[:, 0, 0], 1 / size)
    k = A[:, 1:, 0] / own[:, None]
    left = A[:, 1:, 1:] - k[:, :, None] * A[:, :1, 1:]
    if size >= 1e-3:
        np.testing.assert_allclose(e[there, 12:16], size * left.reshape(-1, 4)[there],
                                   atol=1e-13 * size * abs(left).max())  # fmt: skip
        np.testing.assert_allclose(e[:, 16], (size * abs(np.diagonal(A, 0, 1, 2)).sum(1)) ** 2)


def test_rows_of_whole_blocks_beside_others():
    """Rows that are whole blocks in order are copied; one lacks an entry, one its diagonal."""
    there = np.array([[1, 0, 1, 1], [0, 1, 0, 0], [1, 0, 1, 1], [1, 1, 0, 0]])
    W = np.random.default_rng(4).standard_normal((12, 12)) * np.kron(there, np.ones((3, 3)))
    W[7, 0] = 0.0
    found = block_rows(sparse.csr_array(W), 3)
    np.testing.assert_array_equal(dense(found, 3)[0], W)
    assert found.indices.tolist() == [0, 2, 3, 1, 0, 2, 3, 0, 1, 3]
