"""Couplings of units of nodes, from which multigrid makes its aggregates."""

import numpy as np

from amontons.linear.aggregation import _couplings
from amontons.linear.node_blocks import NodeBlocks


def test_a_coupling_that_is_zero_keeps_its_place():
    """Stored zeros are couplings of no strength, of units as of nodes."""
    indptr = np.arange(0, 20, 4, dtype=np.int32)
    indices = np.tile(np.arange(4, dtype=np.int32), 4)
    data = np.where(np.eye(4).ravel()[:, None, None] > 0, np.eye(3), np.zeros((3, 3)))
    blocks = NodeBlocks.of(indptr, indices, data)
    for width in (1, 2):
        row, column, squares, largest = _couplings(blocks, width)
        units = 4 // width
        assert len(row) == len(column) == len(squares) == units**2
        assert (squares[row != column] == 0).all() and (largest == 0).all()
