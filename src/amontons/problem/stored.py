"""The matrices of a friction problem, and what is prepared of them once for all variants."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import read_only
from ..core.errors import UnsupportedForm
from ..linear.blocks import inverse_norms
from ..linear.grid_matrix import GridMatrix
from .matrices import OPERATORS, GlobalMatrices
from .protocol import Form, Problem

if TYPE_CHECKING:
    from scipy import sparse

    from ..core.arrays import Matrix
    from ..core.prepared import Prepared
    from ..linear import Factor
    from ..linear.bodies import Bodies
    from ..linear.hierarchy import Hierarchy
    from ..linear.levels import Levels
    from .structure import Structure

Array = NDArray[np.float64]


def _resists(M: sparse.csc_array) -> bool:
    """True where M has any stiffness."""
    return isinstance(M, OPERATORS) or bool(M.diagonal().any())


class Matrices(Problem):
    """The members of `FrictionProblem` that M and H answer, whatever the load and the law."""

    M: sparse.csc_array | None
    H: sparse.csc_array | None
    W: Matrix | None
    form: Form  # type: ignore[assignment]
    near_nullspace: Array | None
    levels: Levels
    structure: Structure | None
    _shared: Prepared

    def _need(self, form: Form) -> None:
        if self.form is not form:
            raise UnsupportedForm(
                f"this needs the {form.value} form, the problem is {self.form.value}"
                + ("; use problem.condensed()" if form is Form.DELASSUS else "")
            )

    @cached_property
    def matrices(self) -> GlobalMatrices:
        """M and H with what is prepared of them (global form only)."""
        self._need(Form.GLOBAL)
        assert self.M is not None and self.H is not None
        return GlobalMatrices(
            self.M, self.H, self.dimension, self.near_nullspace, self.levels, self.structure,
            self._shared,
        )  # fmt: skip

    def factor(self) -> Factor:
        """M prepared for solves, made once and shared by all variants of this problem.

        A sparse factor, equal bodies sharing one; conjugate gradients with multigrid where the
        factor of a mesh would not fit into memory (more than DIRECT_LIMIT unknowns in one body,
        near_nullspace given).
        """
        return self.matrices.factor()

    @property
    def is_mesh(self) -> bool:
        """True of meshed bodies, whose levels or rigid modes are known (global form only)."""
        known = bool(self.levels) or self.near_nullspace is not None
        return known or isinstance(self.M, GridMatrix)

    @property
    def bodies(self) -> Bodies:
        """The blocks into which M falls apart (global form only)."""
        return self.matrices.bodies

    @property
    def small_blocks(self) -> sparse.csc_array | None:
        """M^-1 when M is block diagonal with small blocks (rigid bodies), else None."""
        return self.matrices.small_blocks

    def solve_M(self, b: Array) -> Array:
        """M^-1 b, b of shape (n,) or (n, k)."""
        return self.matrices.solve(b)

    def times_M(self, v: Array) -> Array:
        """M v, (n,), not to be written to; that of the last v that nobody can write is kept."""
        for known, product in self._products:
            if known is v and not v.flags.writeable:
                return product
        assert self.M is not None
        product = read_only(self.M @ v if v.any() else np.zeros(len(v)))  # all starts at rest
        if v.base is None and not v.flags.writeable:
            self._products[:] = [(v, product)]
        return product

    @cached_property
    def _products(self) -> list[tuple[Array, Array]]:
        """The last v and M v, or nothing."""
        return []

    @property
    def hierarchy(self) -> Hierarchy | None:
        """Multigrid levels of M, made once; None where the unknowns do not come in nodes."""
        return self.matrices.hierarchy

    @property
    def local_stiffness(self) -> Array:
        """H_i^T D^-1 H_i, (nc, d, d), D the block diagonal of M: a cheap stand-in for W_ii."""
        return self.matrices.local_stiffness / self._unit_stiffness

    @property
    def diagonal(self) -> Array:
        """The diagonal of M, (n,), with what stands in for it where nothing deforms."""
        return self.matrices.diagonal * self._unit_stiffness

    @property
    def contact_stiffness(self) -> Array:
        """1 / |`local_stiffness`|, (nc,), unit of r / u; 0 where a contact can not react."""
        blocks = self.matrices.local_stiffness
        return self._shared.once(inverse_norms, (blocks,), blocks) * self._unit_stiffness

    @cached_property
    def _unit_stiffness(self) -> float:
        """1, or load by motion where M is 0 and has no stiffness to compare with."""
        if self.M is None or self._shared.once(_resists, (self.M,), self.M):
            return 1.0
        load, size = self.scales
        return load / size if load > 0 and size > 0 else 1.0

    @property
    def condensing_is_cheap(self) -> bool:
        """True when W is the best to solve with: it then also judges (`measure`).

        For rigid bodies, small problems, and where it takes less work than CHEAP compressed W
        and fits into memory; see `condensation` for the counts.  Not where a body is large and
        its mesh has levels: contact multigrid then solves before W stands.
        """
        return self.form is Form.DELASSUS or self.matrices.condensing_is_cheap
