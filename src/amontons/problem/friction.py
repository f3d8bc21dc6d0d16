"""The one discrete problem of frictional contact, in FCLib's letters.

    M v = H r + f,   u = H^T v + w,   u = W r + q   with W = H^T M^-1 H, q = H^T M^-1 f + w,
    K* ∋ u + mu |u_T| n  ⟂  r ∈ K   per contact (Coulomb), or another law of `law`.

v are n displacements or velocities; r and u are (nc, d) in the local frames, rows
[x_N, x_T1(, x_T2)], r.ravel() being FCLib's vector.  u_N >= 0 is open, r_N >= 0 compression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ..core.arrays import (
    Matrix,
    columns,
    contact_rows,
    expect_shape,
    integers,
    locked,
    number,
    numbers,
    real,
    sparse_matrix,
    sparse_rows,
)
from ..core.clock import NEVER, Deadline
from ..core.errors import InvalidInput, UnsupportedLaw, shown
from ..core.faces import Told
from ..core.prepared import Prepared
from ..linear.blocks import BlockRows, block_part, block_rows
from ..linear.grid_matrix import GridMatrix
from ..linear.hierarchy import Hierarchy
from ..linear.levels import Levels, checked_levels
from .equations import Equations
from .law import Coulomb, Law, Tresca
from .law.coulomb import as_law
from .matrices import OPERATORS
from .plain import check_dimension, plain_of
from .protocol import Form
from .structure import Structure

Array = NDArray[np.float64]
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class FrictionProblem(Told, Equations):
    """Either M, H, f, w (global form) or W, q (Delassus form), with a friction law.

    Build it with `from_global` or `from_delassus`; both check every shape and number.
    near_nullspace, (n, k), are the rigid modes of the bodies: multigrid uses them.
    u_scale, one number in the unit of u, replaces |u_ref| in the residual measure.
    levels (global form): prolongations of v from coarser spaces, finest first, levels[0] with n
    rows, levels[1] with as many as levels[0] has columns, …: geometric multigrid uses them.
    guess, (n,): some v near the solution, such as prescribed displacements continued into the
    bodies: iterative solvers start there.
    blur (nc,), unit of u: what rounding may have left of each q_i (Delassus form of a global
    problem); it is added to the scale of the contact in the contactwise error.
    structure (global form): what a model knows of its unknowns; else it is guessed of M and H.
    """

    law: Law
    M: sparse.csc_array | None = None
    H: sparse.csc_array | None = None
    f: Array | None = None
    w: Array | None = None
    W: Matrix | None = None
    q: Array | None = None
    near_nullspace: Array | None = None
    levels: Levels = ()
    guess: Array | None = None
    load_scale: float | None = None
    u_scale: float | None = None
    blur: Array | None = None
    structure: Structure | None = field(default=None, repr=False)
    name: str = ""
    _shared: Prepared = field(default_factory=Prepared, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.law, Law):
            raise InvalidInput(
                f"law: expected a law such as Coulomb(mu), got {shown(self.law)}; "
                "FrictionProblem.from_global and from_delassus take numbers too"
            )
        if self.law.has_moments:
            raise InvalidInput(
                "law: RollingFriction is between moments too, which a FrictionProblem has not; "
                "RollingProblem(W, q, law) and RigidBodies(..., rolling=, torsion=) take it"
            )
        name = "w" if self.W is None else "q"
        wanted = ("M", "H", "f", "w") if self.W is None else ("W", "q")
        missing = [each for each in wanted if getattr(self, each) is None]
        if missing:
            raise InvalidInput(
                "expected M, H, f and w, see FrictionProblem.from_global, or W and q, see "
                f"from_delassus; got no {missing[0]}", (), "FrictionProblem",
            )  # fmt: skip
        shape, nc = np.shape(getattr(self, name)), len(self.law)
        if len(shape) != 2 or shape[0] != nc or shape[1] not in (2, 3):
            raise InvalidInput(
                f"{name}: expected shape ({nc}, 2) or ({nc}, 3), a row for each contact of the "
                f"law, got {shape}; FrictionProblem.from_global and from_delassus check all"
            )

    # ---------------------------------------------------------------- construction
    @classmethod
    def from_global(
        cls,
        M: Matrix,
        H: Matrix,
        f: ArrayLike,
        w: ArrayLike,
        mu: ArrayLike | Law,
        *,
        near_nullspace: Array | None = None,
        levels: Sequence[sparse.csr_array] = (),
        guess: ArrayLike | None = None,
        load_scale: float | None = None,
        u_scale: float | None = None,
        structure: Structure | None = None,
        name: str = "",
    ) -> FrictionProblem:
        """The problem in v: M (n, n), H (n, nc d), f (n,), w (nc, d), mu (nc,) or a law.

        load_scale, unit of f, is the size of the load when f alone does not tell (prescribed
        displacements).  Raises InvalidInput naming the argument and the value.
        """
        law = as_law(mu)
        nc = len(law)
        stiffness: Any = M if isinstance(M, OPERATORS) else sparse_matrix("M", M)
        H = sparse_matrix("H", H)
        n = stiffness.shape[0]
        expect_shape("M", stiffness.shape, (n, n))
        f = numbers("f", f, (n,))
        w = contact_rows("w", w, nc)
        expect_shape("H", H.shape, (n, nc * w.shape[1]))
        check_dimension(law, w.shape[1])
        if near_nullspace is not None:
            near_nullspace = columns("near_nullspace", near_nullspace, n)
        if guess is not None:
            guess = numbers("guess", guess, (n,))
        if load_scale is not None:
            load_scale = number("load_scale", load_scale, least=0.0)
        if u_scale is not None:
            u_scale = number("u_scale", u_scale, least=0.0)
        if structure is not None:
            structure.check(n, nc)
        _check_name(name)
        return cls(law, M=stiffness, H=H, f=f, w=w, near_nullspace=near_nullspace,
                   levels=checked_levels(levels, n), guess=guess, load_scale=load_scale,
                   u_scale=u_scale, structure=structure, name=name)  # fmt: skip

    @classmethod
    def from_delassus(
        cls, W: Matrix, q: ArrayLike, mu: ArrayLike | Law, *, name: str = ""
    ) -> FrictionProblem:
        """The problem in r: W (nc d, nc d) dense or sparse, q (nc, d), mu (nc,) or a law.

        Raises InvalidInput naming the argument and the value.
        """
        law = as_law(mu)
        _check_name(name)
        q = contact_rows("q", q, len(law))
        check_dimension(law, q.shape[1])
        problem = cls(law, W=_checked(W, q.size), q=q, name=name)
        _ = problem.kernel_data, problem.blocks.eliminated  # once, not in the first solve
        return problem

    @classmethod
    def _from_blocks(cls, rows: BlockRows, q: Array, law: Law) -> FrictionProblem:
        """The problem in Delassus form whose W is there in block rows."""
        d = q.shape[1]
        shape = (q.size, q.size)
        tiles = sparse.bsr_array((rows.data[:, :d, :d], rows.indices, rows.indptr), shape=shape)
        problem = cls(law, W=locked(tiles.tocsr()), q=q)
        problem._shared.put(block_rows, (problem.W,), rows)
        return problem

    # ---------------------------------------------------------------- variants
    def with_mu(self, mu: ArrayLike) -> FrictionProblem:
        """The same problem with other friction coefficients: a number or (nc,).

        Raises UnsupportedLaw unless the law is Coulomb's.
        """
        _ = self.mu
        values = real("mu", mu)
        if values.shape not in ((), (self.contacts,)):
            raise InvalidInput(
                f"mu: expected a number or shape ({self.contacts},), got {values.shape}"
            )
        law = Coulomb(np.broadcast_to(values, (self.contacts,)))
        return replace(self, law=law)

    def with_load(self, load: ArrayLike) -> FrictionProblem:
        """The same problem with another f (global form) or q (Delassus form)."""
        if self.form is Form.GLOBAL:
            return replace(self, f=numbers("f", load, (self.unknowns,)), guess=None)
        q = contact_rows("q", load, self.contacts)
        expect_shape("q", q.shape, (self.contacts, self.dimension))
        return replace(self, q=q, blur=None)

    def update(
        self, *, W: Matrix | None = None, q: ArrayLike | None = None,
        mu: ArrayLike | None = None,
    ) -> FrictionProblem:  # fmt: skip
        """The problem of the next step: another W, q or mu, what is not given as it is.

        Delassus form; shapes as of `from_delassus`, the number of contacts stays.  Where the
        blocks of W stand where they stood, what was made of their places is kept: the order of
        Newton's elimination and its fill.  A W of another pattern is analysed anew.
        Raises InvalidInput, which names the argument; UnsupportedForm in the global form.
        """
        self._need(Form.DELASSUS)
        problem = self
        if W is not None:
            problem = problem._with_W(W)
        if q is not None:
            problem = problem.with_load(q)
        return problem if mu is None else problem.with_mu(mu)

    def _with_W(self, W: Matrix) -> FrictionProblem:
        """The problem with another W, whose blocks share the places of those before."""
        assert self.q is not None
        given = _checked(W, self.q.size)
        old, new = self.blocks, block_rows(given, self.dimension)
        alike = np.array_equal(old.indptr, new.indptr)
        if alike and np.array_equal(old.indices, new.indices):
            new = BlockRows(old.indptr, old.indices, new.data, old.diagonal)
        problem = replace(self, W=given, blur=None, _shared=self._shared.copied())
        problem._shared.put(block_rows, (given,), new)
        return problem

    def with_hierarchy(self, hierarchy: Hierarchy) -> FrictionProblem:
        """The same problem with multigrid levels of one's own for M (global form)."""
        problem = self.fresh()
        problem.matrices.put_hierarchy(hierarchy)
        return problem

    def assembled(self) -> FrictionProblem:
        """The same problem with M as a stored matrix, for solvers that need its entries.

        Its levels, which the operator has for itself, become those of the problem.
        """
        if not isinstance(self.M, GridMatrix):
            return self
        levels = self.levels or self.matrices.stored_levels()
        modes = self.near_nullspace
        if modes is None:
            modes = self.matrices.stored_modes()
        return replace(self, M=self.matrices.stored(), levels=levels, near_nullspace=modes)

    @property
    def knows_q(self) -> bool:  # type: ignore[override]
        """True where the free velocity is given, or has been found before."""
        return self.q is not None or "_free" in self.__dict__

    def condensed(self, deadline: Deadline = NEVER) -> FrictionProblem:
        """The Delassus form of this problem: W = H^T M^-1 H, q = H^T M^-1 f + w.

        Raises InvalidInput when W would not fit into memory, SingularOperator when M can not
        be inverted (a body held by contact alone), TimeUp when W is not there in time.
        """
        if self.form is Form.DELASSUS:
            return self
        if deadline is not NEVER:
            self._condensed_once(deadline)
        return self._condensed

    @cached_property
    def _condensed(self) -> FrictionProblem:
        base = self._condensed_once(NEVER)
        return replace(
            base, law=self.law, q=self.free_velocity, blur=self.free_blur, name=self.name
        )

    def _condensed_once(self, deadline: Deadline) -> FrictionProblem:
        return self._shared.once(FrictionProblem._condense, (self.M, self.H), self, deadline)

    def _condense(self, deadline: Deadline) -> FrictionProblem:
        W = self.matrices.delassus(deadline)
        if isinstance(W, BlockRows):
            return FrictionProblem._from_blocks(W, self.free_velocity, self.law)
        return FrictionProblem.from_delassus(W, self.free_velocity, self.law)

    @property
    def plain(self) -> FrictionProblem:
        """The problem of the plain law in other variables, see `plain_of`; else itself."""
        return self if self.law.plain is self.law else self._plain

    @cached_property
    def _plain(self) -> FrictionProblem:
        return plain_of(self)

    def restricted(self, contacts: NDArray[np.int64]) -> FrictionProblem:
        """The Delassus form of some contacts, (k,) in ascending order; `whole` leads back."""
        self._need(Form.DELASSUS)
        assert self.q is not None
        contacts = integers("contacts", contacts)
        inside = (contacts >= 0) & (contacts < self.contacts)
        if contacts.ndim != 1 or not inside.all() or (np.diff(contacts) <= 0).any():
            raise InvalidInput(
                f"contacts: expected numbers from 0 to {self.contacts - 1} in ascending order, "
                f"got {shown(contacts)}"
            )
        rows = block_part(self.blocks, contacts)
        part = self._from_blocks(rows, self.q[contacts], self.law.at(contacts))
        part._shared.put(_alone, (part.W,), (self, contacts))
        return part

    @property
    def whole(self) -> tuple[FrictionProblem, NDArray[np.int64]]:
        """The problem that this one is a part of, and its contacts there; else itself."""
        return self._shared.once(_alone, (self.W,), self)

    # ---------------------------------------------------------------- sizes and arrays
    @cached_property
    def form(self) -> Form:
        """GLOBAL or DELASSUS."""
        return Form.DELASSUS if self.W is not None else Form.GLOBAL

    @cached_property
    def has_v(self) -> bool:
        """True in the global form."""
        return self.form is Form.GLOBAL

    @cached_property
    def contacts(self) -> int:  # type: ignore[override]
        """Number of contacts nc."""
        return len(self.law)

    @cached_property
    def dimension(self) -> int:
        """2 or 3."""
        rows = self.q if self.q is not None else self.w
        assert rows is not None
        return rows.shape[1]

    @property
    def unknowns(self) -> int:
        """n in the global form, nc d in the Delassus form."""
        return self.f.size if self.f is not None else self.contacts * self.dimension

    @property
    def operations(self) -> float:
        """Of an iteration, roughly: some products with W, or a solve with M."""
        return super().operations if self.has_v else 100.0 * self.blocks.data.size

    @property
    def mu(self) -> Array:
        """Coefficients of Coulomb friction, (nc,); raises UnsupportedLaw under other laws."""
        if isinstance(self.law, Coulomb):
            return self.law.mu
        given = isinstance(self.law, Tresca)
        why = "it has a bound and no mu" if given else "expected Coulomb's"
        raise UnsupportedLaw(f"mu: this problem has {self.law.name}, {why}")

    def fresh(self) -> FrictionProblem:
        """The same problem with nothing prepared: no factor, no W."""
        return replace(self, _shared=Prepared())


def _checked(W: Matrix, size: int) -> Any:
    """A read-only copy of W, (size, size)."""
    if not sparse.issparse(W):
        return numbers("W", cast(Array, W), (size, size))
    W = sparse_rows("W", W)
    expect_shape("W", W.shape, (size, size))
    return W


def _alone(problem: FrictionProblem) -> tuple[FrictionProblem, NDArray[np.int64]]:
    """A problem that is no part of another, and its contacts."""
    return problem, np.arange(problem.contacts)


def _check_name(name: str) -> None:
    if not isinstance(name, str):
        raise InvalidInput(f"name: expected a text, got {shown(name)}")
