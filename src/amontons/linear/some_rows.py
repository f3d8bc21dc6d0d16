"""Some rows of a matrix on their own: relaxed and evaluated without a pass over the others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.threads import Range, over_rows, over_stages
from .block_products import product_of_blocks, product_of_blocks_back
from .chunks import chunks_among
from .level_matrix import LevelMatrix

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Pattern:
    """Rows of nodes (k,), and where their entries are: indptr (k + 1,), indices (e,)."""

    node: Index
    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]

    @cached_property
    def chunks(self) -> list[Range]:
        """Ranges of these rows, every second of which is swept at once."""
        return chunks_among(self.node, self.indptr, self.indices)

    def sweep(  # noqa: PLR0913
        self, data: Array, inverse: Array, b: Array, x: Array, held: NDArray[np.bool_],
        backward: bool,
    ) -> None:  # fmt: skip
        """A block Gauss-Seidel sweep on A x = b over those of the nodes that are not held.

        data (e, 3, 3): blocks of A; inverse (k, 3, 3): of the diagonal ones.
        """
        over_stages(sweep_rows, self.chunks, 10.0 * len(data), self.node, self.indptr,
                    self.indices, data, inverse, b, x, held, backward,
                    backward=backward)  # fmt: skip

    def evaluate(self, data: Array, x: Array, b: Array, out: Array) -> None:
        """out = b - A x in these rows."""
        over_rows(residual_rows, len(self.node), 10.0 * len(data), self.node, self.indptr,
                  self.indices, data, x, b, out)  # fmt: skip


@dataclass(frozen=True, eq=False)
class SomeRows(Pattern):
    """Rows of nodes (k,) in ascending order with their blocks, data (e, 3, 3).

    inverse (k, 3, 3): of the diagonal blocks.
    """

    data: Array
    inverse: Array

    @classmethod
    def of(cls, A: LevelMatrix, node: Index) -> SomeRows:
        """Copies of the rows of nodes (k,), ascending."""
        rows = A.rows(node)
        return cls(node, rows.indptr, rows.indices, rows.data, rows.inverse)

    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """A block Gauss-Seidel sweep on A x = b over those of the nodes that are not held."""
        self.sweep(self.data, self.inverse, b, x, held, backward)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x in these rows."""
        self.evaluate(self.data, x, b, out)


@njit(cache=True, error_model="numpy", inline="always")
def relax(D, b, s, x, i):
    """x_i += D (b_i - s)."""
    r0, r1, r2 = b[i, 0] - s[0], b[i, 1] - s[1], b[i, 2] - s[2]
    x[i, 0] += D[0, 0] * r0 + D[0, 1] * r1 + D[0, 2] * r2
    x[i, 1] += D[1, 0] * r0 + D[1, 1] * r1 + D[1, 2] * r2
    x[i, 2] += D[2, 0] * r0 + D[2, 1] * r1 + D[2, 2] * r2


@njit(cache=True, error_model="numpy", nogil=True)
def sweep_rows(begin, end, node, indptr, indices, data, inverse, b, x, held, backward):  # noqa: PLR0913
    """A block Gauss-Seidel sweep over the nodes of a chunk of rows that are not held."""
    for step in range(end - begin):
        k = end - 1 - step if backward else begin + step
        i = uint64(node[k])
        if not held[i]:
            first, last = uint64(indptr[k]), uint64(indptr[k + 1])
            if backward:
                s = product_of_blocks_back(data, indices, x, first, last)
            else:
                s = product_of_blocks(data, indices, x, first, last, last)
            relax(inverse[k], b, s, x, i)


@njit(cache=True, error_model="numpy", nogil=True)
def residual_rows(begin, end, node, indptr, indices, data, x, b, r):  # noqa: PLR0913
    """r = b - A x in some rows."""
    for k in range(begin, end):
        i = uint64(node[k])
        first, last = uint64(indptr[k]), uint64(indptr[k + 1])
        s = product_of_blocks(data, indices, x, first, last, last)
        r[i, 0], r[i, 1], r[i, 2] = b[i, 0] - s[0], b[i, 1] - s[1], b[i, 2] - s[2]
