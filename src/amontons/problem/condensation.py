"""W = H^T M^-1 H body by body, and what forming it costs.

A reaction moves the bodies of its contact only, so W is the sum over the bodies of H_b^T C H_b,
where C, the part of M_b^-1 at the unknowns that H sees, is the same for equal bodies.  Two
contacts couple only when they share a body.

Work is counted in entries of triangular factors: a mesh of n unknowns in 3D has about n^(4/3).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.clock import NEVER, Deadline
from ..linear.blocks import BlockRows, embedded
from ..linear.bodies import Bodies, BodyFactor

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FILL = 4 / 3  # power of n in the entries of a factor, nested dissection in 3D
SOLVE_COLUMNS = 64  # right-hand sides of one block solve
SLAB_LAYERS = 4  # of unknowns around the contact that a compressed W sees exactly
WHOLE_SOLVES = 84  # with M that a compressed W takes: its far field and the corrections


class Condensation:
    """The bodies of a problem and their contacts: M (n, n), H (n, nc d)."""

    def __init__(self, bodies: Bodies, H: sparse.csc_array, d: int) -> None:
        self.bodies, self.H, self.d = bodies, sparse.csr_array(H), d
        self.nc = H.shape[1] // d

    # ------------------------------------------------------------------ costs
    @property
    def blocks(self) -> int:
        """Stored d x d blocks of W at most."""
        return sum(len(c) ** 2 for c in self._contacts)

    @property
    def work(self) -> float:
        """Of W: one solve with a body of each kind per unknown that H sees."""
        return sum(
            float(len(seen)) * members.shape[1] ** FILL
            for seen, members in zip(self._seen, self.bodies.members, strict=True)
        )

    @property
    def compressed_work(self) -> float:
        """Of a compressed W: a slab solve per reaction, and some solves with M."""
        slab = whole = 0.0
        for members, matrix, seen in zip(
            self.bodies.members, self.bodies.matrices, self._seen, strict=True
        ):
            copies, n = members.shape
            whole += copies * float(n) ** FILL
            slab += copies * float(_within(matrix, seen, SLAB_LAYERS)) ** FILL
        return self.d * self.nc * slab + WHOLE_SOLVES * whole

    # ------------------------------------------------------------------ W
    def delassus(self, factor: BodyFactor, deadline: Deadline = NEVER) -> BlockRows:
        """W in block rows; raises TimeUp when it is not there in time."""
        d, nc = self.d, self.nc
        keys = self._pattern()
        rows, columns = np.divmod(keys, nc)
        data = np.zeros((len(keys), d, d))
        for kind, solve in enumerate(factor.kinds):
            C = self._compliance(kind, solve, deadline)
            seen = self._seen[kind]
            for unknowns in self.bodies.members[kind]:
                deadline.check()
                part, contacts = self._of_body(unknowns[seen])
                W = part.T @ (part.T @ C.T).T
                k = len(contacts)
                tiles = W.reshape(k, d, k, d).swapaxes(1, 2).reshape(-1, d, d)
                at = (contacts[:, None] * nc + contacts).ravel()
                data[np.searchsorted(keys, at)] += tiles
        indptr = np.searchsorted(rows, np.arange(nc + 1)).astype(np.int32)
        diagonal = np.flatnonzero(rows == columns).astype(np.int32)
        return embedded(indptr, columns.astype(np.int32), data, diagonal)

    @cached_property
    def _seen(self) -> list[Index]:
        """Per kind, local unknowns that H sees in some body of the kind."""
        touched = np.diff(self.H.indptr) > 0
        return [np.flatnonzero(touched[m].any(axis=0)) for m in self.bodies.members]

    @cached_property
    def _contacts(self) -> list[Index]:
        """Contacts of every body."""
        bodies = (unknowns for members in self.bodies.members for unknowns in members)
        return [np.unique(self.H[b].indices // self.d).astype(np.int64) for b in bodies]

    def _of_body(self, unknowns: Index) -> tuple[sparse.csr_array, Index]:
        """H of one body, (unknowns, k d), and its k contacts."""
        rows = self.H[unknowns]
        contacts = np.unique(rows.indices // self.d).astype(np.int64)
        local = np.searchsorted(contacts, rows.indices // self.d) * self.d
        indices = local + rows.indices % self.d
        shape = (len(unknowns), self.d * len(contacts))
        return sparse.csr_array((rows.data, indices, rows.indptr), shape=shape), contacts

    def _pattern(self) -> Index:
        """row * nc + column of every stored block, sorted; the diagonal is always there."""
        pairs = [np.arange(self.nc) * (self.nc + 1)]
        pairs += [(c[:, None] * self.nc + c).ravel() for c in self._contacts]
        keys = np.sort(np.concatenate(pairs))  # np.unique hashes, ten times slower here
        return keys[np.concatenate([[True], keys[1:] != keys[:-1]])] if len(keys) else keys

    def _compliance(
        self, kind: int, solve: Callable[[Array], Array], deadline: Deadline
    ) -> Array:
        """Part of M_b^-1 at the unknowns that H sees."""
        n, seen = self.bodies.members[kind].shape[1], self._seen[kind]
        C = np.empty((len(seen), len(seen)))
        for first in range(0, len(seen), SOLVE_COLUMNS):
            deadline.check()
            columns = seen[first : first + SOLVE_COLUMNS]
            unit = np.zeros((n, len(columns)))
            unit[columns, np.arange(len(columns))] = 1.0
            C[:, first : first + SOLVE_COLUMNS] = solve(unit)[seen]
        return C


def _within(matrix: sparse.csc_array, start: Index, layers: int) -> int:
    """How many unknowns a matrix couples with those at `start` in so many steps."""
    inside = np.zeros(matrix.shape[0], dtype=bool)
    inside[start] = True
    newest = np.asarray(start)
    for _ in range(layers):
        first, count = matrix.indptr[newest], np.diff(matrix.indptr)[newest]
        ends = np.cumsum(count)
        at = np.arange(ends[-1] if len(ends) else 0) + np.repeat(first - ends + count, count)
        near = matrix.indices[at]
        newest = np.unique(near[~inside[near]])
        inside[newest] = True
    return int(inside.sum())
