"""LU of a matrix of large dense blocks, front by front, at the speed of dense products.

The unknowns come in groups, and a group couples with few others: the joints of a wall, each
with all joints of the two blocks that it parts.  A general sparse LU finds such blocks again in
each analysis, which takes it as long as the factor; here the analysis is done once on the
groups (a hundred instead of thousands), and a factor is a few dense operations per group.

Pivots are taken within a group only: in single precision a preconditioner; in double one whose
solutions want a check, and refinement, against the matrix.

[DR] I. Duff, J. Reid, "The multifrontal solution of unsymmetric sets of linear equations",
SIAM J. Sci. Stat. Comput. 5 (1984).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..core.errors import SingularOperator

Array = NDArray[np.floating]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Fronts:
    """Order of elimination of groups, and the groups that each one is coupled with by then.

    sizes (groups,): unknowns of a group; order: groups as they are eliminated; borders: per
    group those eliminated later that its front holds, in order of elimination.
    """

    sizes: Index
    order: list[int]
    borders: list[list[int]]

    @classmethod
    def of(cls, sizes: Sequence[int] | Index, neighbours: Sequence[set[int]]) -> Fronts:
        """Minimum degree, counted in unknowns; neighbours without the group itself."""
        sizes = np.asarray(sizes, dtype=np.int64)
        graph = [set(n) for n in neighbours]
        weight = [int(sizes[list(n)].sum()) if n else 0 for n in graph]
        left, order = set(range(len(graph))), []
        borders: list[list[int]] = [[] for _ in graph]
        while left:
            g = min(left, key=weight.__getitem__)
            left.remove(g)
            order.append(g)
            border = graph[g]
            for h in border:
                graph[h] |= border
                graph[h] -= {g, h}
                weight[h] = int(sizes[list(graph[h])].sum()) if graph[h] else 0
            borders[g] = list(border)
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        return cls(sizes, order, [sorted(b, key=place.__getitem__) for b in borders])

    @cached_property
    def rows(self) -> list[Index]:
        """Unknowns of every group, groups one after another."""
        ends = np.cumsum(self.sizes)
        return [np.arange(e - s, e) for e, s in zip(ends, self.sizes, strict=True)]

    @cached_property
    def border_rows(self) -> list[Index]:
        """Unknowns of the border of every group."""
        empty = np.empty(0, dtype=np.int64)
        return [np.concatenate([empty, *(self.rows[h] for h in b)]) for b in self.borders]

    @cached_property
    def flops(self) -> float:
        """Floating point operations of a factor."""
        k = self.sizes.astype(float)
        b = np.array([len(rows) for rows in self.border_rows], dtype=float)
        return float((2 * k**3 + 2 * k**2 * b + 2 * k * b**2).sum())

    @cached_property
    def entries(self) -> float:
        """Numbers that a factor stores, each of which a solve reads once."""
        k = self.sizes.astype(float)
        b = np.array([len(rows) for rows in self.border_rows], dtype=float)
        return float((k**2 + 2 * k * b).sum())

    def factor(self, block: Callable[[int, Sequence[int]], tuple[Array, Array]]) -> FrontLU:
        """The LU of a matrix; block(g, others) gives its rows and its columns at a group.

        The rows (k, k + b) hold group g and then `others`, the columns (b, k) only these, zero
        where nothing couples.  Raises SingularOperator when a pivot block can not be inverted.
        """
        waiting: list[list[tuple[int, Array]]] = [[] for _ in self.order]
        pivots: list[NDArray] = [np.empty(0)] * len(self.order)
        right, left = pivots.copy(), pivots.copy()
        for g in self.order:
            border, k = self.borders[g], int(self.sizes[g])
            whole = np.concatenate([self.rows[g], self.border_rows[g]])
            rows, columns = block(g, border)
            front = np.zeros((len(whole), len(whole)), dtype=rows.dtype)
            front[:k], front[k:, :k] = rows, columns
            ends = np.cumsum([k, *self.sizes[border]])
            place = dict(zip([g, *border], ends - self.sizes[[g, *border]], strict=True))
            for child, rest in waiting[g]:
                rows_of = (place[h] + np.arange(self.sizes[h]) for h in self.borders[child])
                at = np.concatenate(list(rows_of))
                if at.size:
                    _add(front, rest, at)
            waiting[g] = []
            try:
                inverse = np.linalg.inv(front[:k, :k])
            except np.linalg.LinAlgError as reason:
                raise SingularOperator(f"front of group {g}: singular") from reason
            pivots[g], right[g], left[g] = (
                inverse,
                inverse @ front[:k, k:],
                front[k:, :k].copy(),
            )
            if border:
                waiting[border[0]].append((g, front[k:, k:] - left[g] @ right[g]))
        return FrontLU(self, pivots, right, left)  # type: ignore[arg-type]


def _add(front: Array, rest: Array, at: Index) -> None:
    """front[at, at] += rest, run by run of neighbouring rows: slices beat index arrays."""
    breaks = np.flatnonzero(np.diff(at) != 1) + 1
    starts, ends = np.concatenate([[0], breaks]), np.concatenate([breaks, [len(at)]])
    runs = [
        (slice(at[a], at[b - 1] + 1), slice(a, b)) for a, b in zip(starts, ends, strict=True)
    ]
    for rows, i in runs:
        for columns, j in runs:
            front[rows, columns] += rest[i, j]


@dataclass(frozen=True, eq=False)
class FrontLU:
    """A factor: per group the inverse P of its pivot, P F_12 and F_21 of its front."""

    fronts: Fronts
    pivots: list[Array]
    right: list[Array]
    left: list[Array]

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b, both (n,), in the order of the groups."""
        f, x = self.fronts, b.astype(self.pivots[0].dtype)
        for g in f.order:
            own = self.pivots[g] @ x[f.rows[g]]
            x[f.rows[g]] = own
            x[f.border_rows[g]] -= self.left[g] @ own
        for g in reversed(f.order):
            x[f.rows[g]] -= self.right[g] @ x[f.border_rows[g]]
        return x
