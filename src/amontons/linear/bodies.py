"""A block diagonal matrix body by body: equal bodies are factorised once.

The matrix of several bodies falls apart into one block per body.  The blocks of a wall are
copies of a few shapes, so their factors take the memory and time of these few, and one call
solves for all copies.  Copies differ by the rounding of their assembly (coordinates): blocks
that agree to EQUAL share a factor, and the trial solve of `checked` adds a refinement by the
true matrix where that shows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .base import LinearSolver
from .direct import Direct, checked

Array = NDArray[np.float64]
Index = NDArray[np.int64]
EQUAL = 1e-13  # largest difference of two equal blocks, relative to their largest entry


@dataclass(frozen=True, eq=False)
class Bodies:
    """Blocks of a matrix that are not coupled, by kind.

    members: per kind the unknowns of its bodies, (bodies, n_kind); matrices: per kind the block
    of its first body.
    """

    members: list[Index]
    matrices: list[sparse.csc_array]

    @classmethod
    def of(cls, matrix: sparse.csc_array, body: NDArray[np.integer] | None = None) -> Bodies:
        """The bodies of a square matrix (n, n); body (n,): their numbers, if known."""
        from scipy.sparse.csgraph import connected_components

        if body is None:
            count, label = connected_components(matrix, directed=False)
        else:
            count, label = _by_first(body)
        if count == 1:
            return cls([np.arange(matrix.shape[0])[None]], [matrix])
        order = np.argsort(label, kind="stable")
        ends = np.cumsum(np.bincount(label, minlength=count))
        rows = sparse.csr_array(matrix)[order]
        sorted_ = sparse.csc_array(rows)[:, order].sorted_indices()
        members: list[list[Index]] = []
        matrices: list[sparse.csc_array] = []
        sums: list[float] = []
        for start, end in zip(np.concatenate([[0], ends[:-1]]), ends, strict=True):
            a, b = sorted_.indptr[start], sorted_.indptr[end]
            indptr, indices = sorted_.indptr[start : end + 1] - a, sorted_.indices[a:b] - start
            block = sparse.csc_array(
                (sorted_.data[a:b], indices, indptr), shape=(end - start,) * 2
            )
            size = float(np.abs(block.data).sum())
            alike = (k for k, known in enumerate(sums) if abs(known - size) <= 1e-9 * size)
            kind = next((k for k in alike if _equal(matrices[k], block)), None)
            if kind is None:
                kind = len(matrices)
                matrices.append(block)
                sums.append(size)
                members.append([])
            members[kind].append(order[start:end])
        return cls([np.array(m) for m in members], matrices)

    @property
    def largest(self) -> int:
        """Unknowns of the largest body."""
        return max((m.shape[1] for m in self.members), default=0)

    @property
    def count(self) -> int:
        """Number of bodies."""
        return sum(len(m) for m in self.members)

    def factor(
        self, matrix: sparse.csc_array, solver: LinearSolver | None = None
    ) -> BodyFactor:
        """A factor of `matrix`, whose bodies these are; raises SingularOperator."""
        solver = solver if solver is not None else Direct()
        solves = [solver.factor(block).solve for block in self.matrices]
        return BodyFactor(checked(matrix, _BodyByBody(self.members, solves)), solves)


@dataclass(frozen=True, eq=False)
class _BodyByBody:
    """Solves of the whole by those of one body of each kind."""

    members: list[Index]
    solves: list[Callable[[Array], Array]]

    def __call__(self, b: Array) -> Array:
        """The solution x, shape of b."""
        x = np.empty_like(b, dtype=float)
        for members, one in zip(self.members, self.solves, strict=True):
            copies, n = members.shape
            columns = np.moveaxis(b[members].reshape(copies, n, -1), 0, 1)
            found = one(columns.reshape(n, -1)).reshape(columns.shape)
            x[members] = np.moveaxis(found, 1, 0).reshape(copies, n, *b.shape[1:])
        return x


@dataclass(frozen=True, eq=False)
class BodyFactor:
    """Factors of all kinds of bodies: `apply` for the whole, `kinds` for one body of a kind."""

    apply: Callable[[Array], Array]
    kinds: list[Callable[[Array], Array]]
    exact: bool = True
    iterations: int = 0

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b, shape of b."""
        return self.apply(b)


def _by_first(body: NDArray[np.integer]) -> tuple[int, Index]:
    """How many different numbers (n,) there are, and these renumbered as they first appear."""
    _, first, label = np.unique(body, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return len(first), rank[label]


def _equal(A: sparse.csc_array, B: sparse.csc_array) -> bool:
    """True for two blocks that differ by rounding only, also in which zeros they store."""
    if A.shape != B.shape:
        return False
    size = np.abs(A.data).max(initial=0.0)
    return bool(np.abs((A - B).data).max(initial=0.0) <= EQUAL * size)
