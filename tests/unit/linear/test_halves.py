"""Rows in two halves: the sweeps and the residual of whole ones."""

import numpy as np
import pytest

from amontons.linear import chunks
from amontons.linear.coarsest import factored_at_rest, inverse_at_rest
from amontons.linear.halves import Halves
from amontons.linear.node_blocks import NodeBlocks

N, FIRST = 400, 360


def matrix():
    """A symmetric band of blocks, diagonally dominant; the last rows couple with any others."""
    rng = np.random.default_rng(0)
    dense = np.zeros((N, N, 3, 3))
    for i in range(N):
        others = {j for j in (i + 1, i + 2, i + 7) if j < FIRST}
        for j in others | ({i, *rng.integers(0, N, 3).tolist()} if i >= FIRST else {i}):
            block = rng.standard_normal((3, 3))
            dense[i, j] += block
            dense[j, i] += block.T
        dense[i, i] += 40 * np.eye(3)
    there = np.abs(dense).max(axis=(2, 3)) > 0
    row, column = there.nonzero()
    indptr = np.concatenate([[0], np.cumsum(there.sum(axis=1))])
    return NodeBlocks.of(indptr, column, np.ascontiguousarray(dense[row, column]))


@pytest.mark.parametrize("cut", [False, True])
def test_back_and_forth_as_with_whole_rows(cut, monkeypatch):
    if cut:
        monkeypatch.setattr(chunks, "LEAST_ENTRIES", 1)
        monkeypatch.setattr(chunks, "LEAST_ROWS", 16)
    A = matrix()
    first = A.leading(FIRST)
    assert (len(first.chunks) > 2) == cut
    halves = Halves.of(A, first)
    assert halves is not None
    rng = np.random.default_rng(1)
    b, x = (rng.standard_normal((N, 3)) for _ in range(2))
    wanted, held, left = x.copy(), np.zeros(N, dtype=bool), np.empty((FIRST, 3))
    sums = halves.sums()
    halves.backward(b, x, sums)
    first.smooth(b, wanted, held, True)
    np.testing.assert_allclose(x, wanted, rtol=0, atol=1e-13)
    halves.forward(b, x, sums, left)
    first.smooth(b, wanted, held, False)
    np.testing.assert_allclose(x, wanted, rtol=0, atol=1e-13)
    x[FIRST:] = wanted[FIRST:] = rng.standard_normal((N - FIRST, 3))  # by somebody else
    residual, whole = np.zeros((N, 3)), np.zeros((N, 3))
    halves.leave(x, left, sums, residual[:FIRST])
    A.residual(wanted, b, whole)
    np.testing.assert_allclose(residual[:FIRST], whole[:FIRST], rtol=0, atol=1e-11)
    halves.residual(x, b, residual)
    np.testing.assert_allclose(residual, whole, rtol=0, atol=1e-11)
    halves.times(x, residual)
    np.testing.assert_allclose(b - residual, whole, rtol=0, atol=1e-11)


@pytest.mark.parametrize("backward", [False, True])
def test_a_sweep_over_all_rows(backward):
    A = matrix()
    halves = Halves.of(A, A.leading(FIRST))
    assert halves is not None
    b = np.random.default_rng(2).standard_normal((N, 3))
    x, wanted, held = np.zeros((N, 3)), np.zeros((N, 3)), np.zeros(N, dtype=bool)
    halves.smooth(b, x, held, backward)
    A.smooth(b, wanted, held, backward)
    np.testing.assert_allclose(x, wanted, rtol=0, atol=1e-13)


@pytest.mark.parametrize("kind", ["not symmetric", "at rest"])
def test_one_half_is_not_the_whole_of_every_matrix(kind):
    A = matrix()
    own = A.diagonal()[7]
    if kind == "at rest":
        A.data[own, 2], A.data[own, :, 2] = 0.0, 0.0
    else:
        A.data[own + 1, 0, 1] += 1.0
    A = NodeBlocks.of(A.indptr, A.indices, A.data)
    assert Halves.of(A, A.leading(FIRST)) is None


@pytest.mark.parametrize("kind", ["regular", "at rest", "singular"])
def test_a_factored_matrix_is_its_inverse(kind):
    A = matrix().dense()[:30, :30].copy()
    size = np.abs(A).max() * np.ones(10)
    if kind != "regular":  # a direction of a node without stiffness
        A[4], A[:, 4] = 0.0, 0.0
    if kind == "singular":  # two nodes that move against each other alone
        A[:12, :12] = np.kron([[1.0, -1.0], [-1.0, 1.0]], 9 * np.eye(6))
        A[:12, 12:], A[12:, :12] = 0.0, 0.0
    k = np.arange(10)
    diagonal = A.reshape(10, 3, 10, 3)[k, :, k, :]
    b = np.random.default_rng(3).standard_normal(30)
    wanted = inverse_at_rest(A, diagonal, size) @ b
    np.testing.assert_allclose(factored_at_rest(A, diagonal, size) @ b, wanted, atol=1e-12)
