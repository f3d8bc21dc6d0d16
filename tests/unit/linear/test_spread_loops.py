"""The compiled loops of aggregates that processes share, against products of whole matrices."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.linear.node_blocks import NodeBlocks
from amontons.linear.spread_loops import (
    add,
    add_blocks,
    restrict,
    smooth,
    triple,
    units_of_rows,
)
from amontons.mechanics.elements.elasticity import stiffness

OMEGA, WIDTH = 0.6, 6


@pytest.fixture
def tiles():
    """The stiffness of a small block, with ones added so that it is regular."""
    mesh = am.box((2, 1, 1), cells=(4, 2, 2))
    K = stiffness(mesh, am.LinearElastic(young=2.0, poisson=0.3)).toarray()
    blocks = sparse.bsr_array(sparse.csr_array(K + np.eye(len(K))).tobsr((3, 3)))
    blocks.sort_indices()
    return NodeBlocks.of(blocks.indptr, blocks.indices, blocks.data)


def transfer(tiles):
    """P of aggregates of four nodes, every seventh of none: pointers, units, blocks; whole."""
    n = tiles.nodes
    unit = np.arange(n) // 4
    unit[::7] = -1
    T = np.random.default_rng(0).standard_normal((n, 3, WIDTH))
    count = int(unit.max()) + 1
    pointers = units_of_rows(tiles.indptr, tiles.indices, unit, count)
    units = np.empty(pointers[-1], dtype=np.int32)
    blocks = np.zeros((pointers[-1], 3, WIDTH))
    smooth(tiles.indptr, tiles.indices, tiles.data, tiles.inverse, T, unit, OMEGA, count,
           pointers, units, blocks)  # fmt: skip
    whole = np.zeros((n, 3, count, WIDTH))
    for i in np.flatnonzero(unit >= 0):
        whole[i, :, unit[i]] = T[i]
    whole = whole.reshape(3 * n, count * WIDTH)
    whole -= OMEGA * np.vstack(
        [tiles.inverse[i] @ (tiles.dense()[3 * i : 3 * i + 3] @ whole) for i in range(n)]
    )
    return pointers, units, blocks, whole, count


def test_prolongations_are_smoothed_and_turn_vectors_both_ways(tiles):
    pointers, units, blocks, whole, count = transfer(tiles)
    found = np.zeros((tiles.nodes, 3, count, WIDTH))
    for i in range(tiles.nodes):
        some = slice(pointers[i], pointers[i + 1])
        assert len(set(units[some])) == pointers[i + 1] - pointers[i]
        found[i, :, units[some]] = blocks[some]
    np.testing.assert_allclose(found.reshape(whole.shape), whole, atol=1e-13)
    fine = np.random.default_rng(1).standard_normal((tiles.nodes, 3))
    out = np.zeros((count, WIDTH))
    restrict(tiles.nodes, pointers, units, blocks, fine, out)
    np.testing.assert_allclose(out.ravel(), whole.T @ fine.ravel(), atol=1e-12)
    moved = fine.copy()
    add(tiles.nodes, pointers, units, blocks, out, moved)
    np.testing.assert_allclose((moved - fine).ravel(), whole @ out.ravel(), atol=1e-11)


def test_coarse_matrices_are_products_of_all_rows_or_of_some(tiles):
    pointers, units, blocks, whole, count = transfer(tiles)
    ends, A = np.arange(count + 1) * count, tiles.dense()
    columns = np.tile(np.arange(count, dtype=np.int32), count)
    for nodes in (np.arange(tiles.nodes), np.array([3, 4, 20])):
        slots, indptr = tiles.slots(nodes)  # ends of int64
        values = np.zeros((count * count, WIDTH, WIDTH))
        triple(nodes, indptr, tiles.indices[slots], tiles.data[slots], pointers, units, blocks,
               units, count, ends, columns, values)  # fmt: skip
        rows = np.zeros_like(A)
        some = (3 * nodes[:, None] + np.arange(3)).ravel()
        rows[some] = A[some]
        found = values.reshape(count, count, WIDTH, WIDTH).transpose(0, 2, 1, 3)
        np.testing.assert_allclose(found.reshape(whole.shape[1], -1), whole.T @ rows @ whole,
                                   atol=1e-11)  # fmt: skip
    before = values.copy()
    add_blocks(np.array([1, 1]), np.array([2, 2]), values[:2].copy(), ends, columns, values)
    before[count + 2] += before[0] + before[1]
    np.testing.assert_allclose(values, before, atol=1e-14)
