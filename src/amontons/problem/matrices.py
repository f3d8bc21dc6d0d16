"""What load and friction do not change: M and H, and what is prepared of them, each once.

Variants of a problem (another load, other friction, the steps of an evolution) hold the same
matrices.  What is made of them, a factor of M above all, all variants share (`Prepared`): where
a variant has another M or H, it is made again.

W = H^T M^-1 H is formed here too, and it is decided when that is the best to solve with.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.arrays import read_only
from ..core.clock import NEVER, Deadline
from ..core.errors import InvalidInput
from ..core.prepared import Prepared
from ..linear import Direct, Factor, GeometricMultigrid
from ..linear.base import stored
from ..linear.blocks import BlockRows
from ..linear.bodies import Bodies, BodyFactor
from ..linear.dense import DENSE_LIMIT
from ..linear.geometric import MultigridFactor, prepared
from ..linear.grid_matrix import GridMatrix
from ..linear.hierarchy import Hierarchy
from ..linear.levels import Levels
from ..linear.loose_modes import loose_modes, unresisted
from ..linear.small_blocks import block_diagonal_inverse, diagonal_blocks_inverse
from .condensation import SOLVE_COLUMNS, Condensation
from .structure import Structure

Array = NDArray[np.float64]
T = TypeVar("T")
OPERATORS = (GridMatrix,)  # which M may be instead of a stored matrix
DIRECT_LIMIT = 600_000  # unknowns of a mesh whose factor takes some 10 GB
CONDENSED_LIMIT = 250_000  # the same where W alone needs one: some 3 GB
MANY_COLUMNS = 60  # solves by cycles that take as long as a direct factor, at least
EXACT_WORK = 2e6  # n * nc * d up to which forming W costs nothing that matters
LARGE_BODY = 10_000  # unknowns of a body with levels from which multigrid is the way
CHEAP = 2.0  # work of W, relative to that of a compressed W, which is full and not exact


@dataclass(frozen=True, eq=False)
class GlobalMatrices:
    """M (n, n), H (n, nc d), rigid modes (n, k), levels, structure of a `FrictionProblem`."""

    M: sparse.csc_array
    H: sparse.csc_array
    dimension: int
    near_nullspace: Array | None
    levels: Levels
    structure: Structure | None
    shared: Prepared

    @property
    def contacts(self) -> int:
        """Number of contacts nc."""
        return self.H.shape[1] // self.dimension

    def _of_M(self, make: Callable[..., T], *arguments: object) -> T:
        """What is made of M alone."""
        return self.shared.once(make, (self.M,), *arguments)

    def _of_both(self, make: Callable[..., T], *arguments: object) -> T:
        """What is made of M and H."""
        return self.shared.once(make, (self.M, self.H), *arguments)

    # ---------------------------------------------------------------- M
    @property
    def modes(self) -> Array | None:
        """The rigid modes (n, k), also those that the operator of a grid has for itself."""
        return self.M.rigid_modes if isinstance(self.M, GridMatrix) else self.near_nullspace

    def stored(self) -> sparse.csc_array:
        """M as a stored matrix where it is the operator of a grid."""
        return self._of_M(stored, self.M)

    def stored_levels(self) -> Levels:
        """The levels that such an operator has for itself."""
        return self._of_M(GridMatrix.free_levels, self.M)

    def stored_modes(self) -> Array:
        """The rigid modes that such an operator has for itself, read-only."""
        return self._of_M(_modes_of, self.M)

    @cached_property
    def bodies(self) -> Bodies:
        """The blocks into which M falls apart."""
        return self._of_M(GlobalMatrices._bodies, self)

    def _bodies(self) -> Bodies:
        return Bodies.of(self.M, None if self.structure is None else self.structure.body)

    @cached_property
    def small_blocks(self) -> sparse.csc_array | None:
        """M^-1 when M is block diagonal with small blocks (rigid bodies), else None."""
        if isinstance(self.M, OPERATORS):
            return None
        return self._of_M(block_diagonal_inverse, self.M)

    def factor(self) -> Factor:
        """M prepared for solves, see `FrictionProblem.factor`."""
        return self._of_M(GlobalMatrices._factor, self)

    def _factor(self) -> Factor:
        M = self.M
        if isinstance(M, GridMatrix):
            return GeometricMultigrid().factor(M)  # type: ignore[arg-type]
        bodies = self.bodies
        if bodies.largest > DIRECT_LIMIT and self.near_nullspace is not None:
            hierarchy = self.hierarchy
            if hierarchy is not None:
                return MultigridFactor(hierarchy, hierarchy.nodes, GeometricMultigrid())
        return bodies.factor(M) if bodies.count > 1 else Direct().factor(M)

    @property
    def loose_modes(self) -> Array:
        """Rigid modes that M does not resist, orthonormal columns (n, k), see `linear`."""
        return self._of_M(loose_modes, self.M, self.bodies, self.modes)

    @property
    def balanced_modes(self) -> Array:
        """Those of them along which no motion changes the balance of forces: R^T M = 0."""
        if isinstance(self.M, OPERATORS):  # symmetric
            return self.loose_modes
        return self._of_M(unresisted, self.M, self.loose_modes)

    def solve(self, b: Array) -> Array:
        """M^-1 b, b of shape (n,) or (n, k)."""
        inverse = self.small_blocks
        return inverse @ b if inverse is not None else self.factor().solve(b)

    @property
    def hierarchy(self) -> Hierarchy | None:
        """Multigrid levels of M; None where the unknowns do not come in nodes."""
        return self._of_M(GlobalMatrices._hierarchy, self)

    def put_hierarchy(self, hierarchy: Hierarchy) -> None:
        """Let these be the levels."""
        self.shared.put(GlobalMatrices._hierarchy, (self.M,), hierarchy)

    def _hierarchy(self) -> Hierarchy | None:
        component = None if self.structure is None else self.structure.component
        return prepared(
            self.M, self.levels, self.near_nullspace, self.dimension, component=component
        )

    # ---------------------------------------------------------------- W
    @property
    def condensation(self) -> Condensation:
        """W body by body."""
        return self._of_both(Condensation, self.bodies, self.H, self.dimension)

    @property
    def condensing_is_cheap(self) -> bool:
        """True when W is the best to solve with, see `FrictionProblem.condensing_is_cheap`."""
        return self._of_both(GlobalMatrices._condensing_is_cheap, self)

    def _condensing_is_cheap(self) -> bool:
        if isinstance(self.M, OPERATORS):
            return False
        if self.small_blocks is not None:
            return True
        n, m = self.H.shape  # type: ignore[misc]  # scipy: may be None
        if n * m <= EXACT_WORK:
            return True
        if self.levels and self.bodies.largest >= LARGE_BODY:
            return False
        parts = self.condensation
        fits = 8.0 * self.dimension**2 * parts.blocks <= DENSE_LIMIT
        return fits and parts.work <= CHEAP * parts.compressed_work

    def delassus(self, deadline: Deadline = NEVER) -> BlockRows | sparse.csr_array | Array:
        """W = H^T M^-1 H: block rows of several bodies, sparse of rigid ones, dense of one.

        Raises InvalidInput when it would not fit into memory, SingularOperator when M can not
        be inverted, TimeUp when it is not there in time.
        """
        inverse = self.small_blocks
        if inverse is not None:
            return (self.H.T @ (inverse @ self.H)).tocsr()
        factor = self.factor()
        several = isinstance(factor, BodyFactor)
        entries = (
            self.dimension**2 * self.condensation.blocks if several else self.H.shape[1] ** 2
        )
        if 8.0 * entries > DENSE_LIMIT:
            raise InvalidInput(
                f"condensed: W would take {8e-9 * entries:.1f} GB for {self.contacts} "
                "contacts; solve the global form with SemismoothNewton, "
                "which does not form W"
            )
        if several:
            return self.condensation.delassus(factor, deadline)  # type: ignore[arg-type]
        return self._dense_delassus(deadline)

    def _dense_delassus(self, deadline: Deadline) -> Array:
        """By blocks of right-hand sides, so that memory stays near that of W itself."""
        H = sparse.csc_array(self.H)
        m = H.shape[1]
        W = np.empty((m, m))
        factor = self._factor_of_many(m)
        for part in self.column_parts(m, factor):
            deadline.check()
            W[:, part] = H.T @ factor.solve(H[:, part].toarray())
        return W

    def _factor_of_many(self, columns: int) -> Factor:
        """That of M, or a direct one, not kept, where cycles for each column take longer."""
        factor, n = self.factor(), self.H.shape[0]
        if factor.exact or columns < MANY_COLUMNS or n > CONDENSED_LIMIT:  # type: ignore
            return factor
        return Direct().factor(stored(self.M))

    def column_parts(self, count: int, factor: Factor | None = None) -> list[slice]:
        """Right-hand sides in parts that take no longer together than each for itself."""
        exact = self.small_blocks is not None or (factor or self.factor()).exact
        size = SOLVE_COLUMNS if exact else 1
        return [slice(first, first + size) for first in range(0, count, size)]

    @property
    def diagonal(self) -> Array:
        """The diagonal of M, (n,), positive; see `_diagonal`."""
        return self._of_both(GlobalMatrices._diagonal, self)

    def _diagonal(self) -> Array:
        """Unknowns of no stiffness, as rigid bodies have them, are given that of the others.

        A turn counts as the motion of the farthest contact, the largest |H_j|.  Where M is 0
        that of the others is 1.
        """
        own = np.asarray(self.M.diagonal(), dtype=float)
        stiff = own > 0
        if stiff.all():
            return own
        lever = np.zeros(len(own))
        H = self.H.tocoo()
        np.maximum.at(lever, H.row, np.abs(H.data))
        typical = float(np.median(own[stiff])) if stiff.any() else 1.0
        return np.where(stiff, own, typical * np.where(lever > 0, lever, 1.0) ** 2)

    @property
    def local_stiffness(self) -> Array:
        """H_i^T D^-1 H_i, (nc, d, d), D the block diagonal of M: a cheap stand-in for W_ii."""
        return self._of_both(GlobalMatrices._local_stiffness, self)

    def _local_stiffness(self) -> Array:
        M, d, n = self.M, self.dimension, self.H.shape[0]
        size = d if n % d == 0 else 1
        touched = np.unique(self.H.indices // size)  # the blocks that H sees
        index = (touched[:, None] * size + np.arange(size)).ravel()
        H = sparse.csr_array(self.H)[index]
        part = M.part(index) if isinstance(M, OPERATORS) else M[:, index].tocsr()[index]
        free = part.diagonal() == 0  # nothing but contacts resists: bodies that are rigid
        if free.any():
            part = part + sparse.diags_array(np.where(free, self.diagonal[index], 0.0))
        product = sparse.csc_array(diagonal_blocks_inverse(part, size) @ H)
        full = (sparse.csr_array(H.T) @ product).tobsr((d, d))
        out = np.zeros((self.contacts, d, d))
        rows = np.repeat(np.arange(self.contacts), np.diff(full.indptr))
        own = rows == full.indices
        out[rows[own]] = full.data[own]
        return out


def _modes_of(M: GridMatrix) -> Array:
    """Rigid modes of an operator, (n, 6)."""
    return read_only(M.rigid_modes)


def entry_sizes(M: Any, H: Any) -> tuple[Any, Any]:
    """|M| and |H|, entry by entry."""
    return abs(M), abs(H)
