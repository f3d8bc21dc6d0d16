"""The one discrete problem of frictional contact, in FCLib's letters.

    M v = H r + f,   u = H^T v + w,   u = W r + q   with W = H^T M^-1 H, q = H^T M^-1 f + w,
    K* ∋ u + mu |u_T| n  ⟂  r ∈ K   per contact (Coulomb), or Tresca's law with a given bound.

v are n displacements or velocities; r and u are (nc, d) in the local frames, rows
[x_N, x_T1(, x_T2)], r.ravel() being FCLib's vector.  u_N >= 0 is open, r_N >= 0 compression.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import Any

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
)
from ..core.clock import NEVER, Deadline
from ..core.errors import InvalidInput, SingularOperator, UnsupportedForm, shown
from ..linear import Factor
from ..linear.blocks import BlockRows, block_part, block_rows, spatial, velocity_inplace
from ..linear.bodies import Bodies
from ..linear.distributed import DistributedMatrix
from ..linear.grid_matrix import GridMatrix
from ..linear.hierarchy import Hierarchy
from ..linear.levels import Levels, checked_levels
from .judge import measures as judge
from .judge.contacts import Assessed, assessed
from .judge.measures import Measure, Weakest
from .judge.sharp import sharp_error
from .law.cones import Coulomb, Law, Tresca
from .matrices import OPERATORS, GlobalMatrices, Shared, made_once

Array = NDArray[np.float64]
JUDGE_FLOPS = 18, 60  # floating point operations of a judgement per block of W, per contact
ESTIMATED = 9_000  # unknowns of a mesh above which the size of u is taken from a coarse level


class Form(Enum):
    """Which matrices a problem holds, or a solver needs."""

    GLOBAL = "global"
    DELASSUS = "local"
    ANY = "any"  # of these two
    NITSCHE = "nitsche"  # a NitscheProblem: displacements only


@dataclass(frozen=True, eq=False)
class FrictionProblem:
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
    name: str = ""
    _shared: Shared = field(default_factory=dict, repr=False)

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
        name: str = "",
    ) -> FrictionProblem:
        """The problem in v: M (n, n), H (n, nc d), f (n,), w (nc, d), mu (nc,) or a law.

        load_scale, unit of f, is the size of the load when f alone does not tell (prescribed
        displacements).  Raises InvalidInput naming the argument and the value.
        """
        law = _law(mu)
        nc = len(law.coefficient)
        M, H = M if isinstance(M, OPERATORS) else sparse_matrix("M", M), sparse_matrix("H", H)
        n = M.shape[0]
        expect_shape("M", M.shape, (n, n))
        f = numbers("f", f, (n,))
        w = contact_rows("w", w, nc)
        expect_shape("H", H.shape, (n, nc * w.shape[1]))
        if near_nullspace is not None:
            near_nullspace = columns("near_nullspace", near_nullspace, n)
        if guess is not None:
            guess = numbers("guess", guess, (n,))
        if load_scale is not None:
            load_scale = number("load_scale", load_scale, least=0.0)
        if u_scale is not None:
            u_scale = number("u_scale", u_scale, least=0.0)
        _check_name(name)
        return cls(law, M=M, H=H, f=f, w=w, near_nullspace=near_nullspace,
                   levels=checked_levels(levels, n), guess=guess, load_scale=load_scale,
                   u_scale=u_scale, name=name)  # fmt: skip

    @classmethod
    def from_delassus(
        cls, W: Matrix, q: ArrayLike, mu: ArrayLike | Law, *, name: str = ""
    ) -> FrictionProblem:
        """The problem in r: W (nc d, nc d) dense or sparse, q (nc, d), mu (nc,) or a law.

        Raises InvalidInput naming the argument and the value.
        """
        law = _law(mu)
        _check_name(name)
        q = contact_rows("q", q, len(law.coefficient))
        if sparse.issparse(W):
            W = locked(sparse_matrix("W", W).tocsr())
        else:
            W = numbers("W", W, (q.size, q.size))
        expect_shape("W", W.shape, (q.size, q.size))
        problem = cls(law, W=W, q=q, name=name)
        _ = problem.kernel_data, problem.blocks.eliminated  # once, not in the first solve
        return problem

    @classmethod
    def _from_blocks(cls, rows: BlockRows, q: Array, law: Law) -> FrictionProblem:
        """The problem in Delassus form whose W is there in block rows."""
        d = q.shape[1]
        shape = (q.size, q.size)
        tiles = sparse.bsr_array((rows.data[:, :d, :d], rows.indices, rows.indptr), shape=shape)
        problem = cls(law, W=locked(tiles.tocsr()), q=q)
        problem._kept("blocks", (problem.W,), lambda: rows)
        return problem

    # ---------------------------------------------------------------- variants
    def with_mu(self, mu: ArrayLike) -> FrictionProblem:
        """The same problem with other friction coefficients: a number or (nc,).

        Raises UnsupportedForm under Tresca's law, which has no mu.
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

    def assembled(self) -> FrictionProblem:
        """The same problem with M as a stored matrix, for solvers that need its entries.

        Its levels, which the operator has for itself, become those of the problem.
        """
        if not isinstance(self.M, GridMatrix):
            return self
        levels = self.levels or self.matrices.stored_levels()
        return replace(self, M=self.matrices.stored(), levels=levels)

    def condensed(self, deadline: Deadline = NEVER) -> FrictionProblem:
        """The Delassus form of this problem: W = H^T M^-1 H, q = H^T M^-1 f + w.

        Raises InvalidInput when W would not fit into memory, SingularOperator when M can not
        be inverted (a body held by contact alone), TimeUp when W is not there in time.
        """
        if self.form is Form.DELASSUS:
            return self
        if deadline is not NEVER:
            self._kept("condensed", (self.M, self.H), lambda: self._condense(deadline))
        return self._condensed

    @cached_property
    def _condensed(self) -> FrictionProblem:
        base = self._kept("condensed", (self.M, self.H), lambda: self._condense(NEVER))
        return replace(
            base, law=self.law, q=self.free_velocity, blur=self.free_blur, name=self.name
        )

    def _condense(self, deadline: Deadline) -> FrictionProblem:
        W = self.matrices.delassus(deadline)
        if isinstance(W, BlockRows):
            return FrictionProblem._from_blocks(W, self.free_velocity, self.law)
        return FrictionProblem.from_delassus(W, self.free_velocity, self.law)

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
        part._shared["whole"] = ((part.W,), (self, contacts))
        return part

    @property
    def whole(self) -> tuple[FrictionProblem, NDArray[np.int64]]:
        """The problem that this one is a part of, and its contacts there; else itself."""
        return self._kept("whole", (self.W,), lambda: (self, np.arange(self.contacts)))

    # ---------------------------------------------------------------- sizes and arrays
    @cached_property
    def form(self) -> Form:
        """GLOBAL or DELASSUS."""
        return Form.DELASSUS if self.W is not None else Form.GLOBAL

    @cached_property
    def contacts(self) -> int:
        """Number of contacts nc."""
        return len(self.law.coefficient)

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
    def mu(self) -> Array:
        """Coefficients of Coulomb friction, (nc,); raises UnsupportedForm under Tresca's."""
        if isinstance(self.law, Coulomb):
            return self.law.mu
        raise UnsupportedForm("mu: this problem has Tresca friction, it has a bound and no mu")

    @cached_property
    def blocks(self) -> BlockRows:
        """W in rows of 3x3 blocks (Delassus form only)."""
        self._need(Form.DELASSUS)
        W, d = self.W, self.dimension
        assert W is not None
        return self._kept("blocks", (W,), lambda: block_rows(W, d))

    @cached_property
    def kernel_data(self) -> tuple[Any, ...]:
        """What kernels take: indptr, indices, data, q (nc, 3), coefficient, Tresca?, rho."""
        b = self.blocks
        assert self.q is not None
        q = spatial(self.q)
        rho = _inverse_norms(b.diagonal_blocks)
        for array in (q, rho):
            array.flags.writeable = False
        tresca = isinstance(self.law, Tresca)
        return b.indptr, b.indices, b.data, q, self.law.coefficient, tresca, rho

    @cached_property
    def judge_flops(self) -> float:
        """Floating point operations of one judgement, 0 where they are not counted."""
        if self.form is Form.GLOBAL:
            return 0.0
        each, own = JUDGE_FLOPS
        return float(each * len(self.blocks.indices) + own * self.contacts)

    @cached_property
    def q_norm(self) -> float:
        """Euclidean norm of q (Delassus form only)."""
        self._need(Form.DELASSUS)
        return float(np.linalg.norm(self.q))  # type: ignore[arg-type]

    def _need(self, form: Form) -> None:
        if self.form is not form:
            raise UnsupportedForm(
                f"this needs the {form.value} form, the problem is {self.form.value}"
                + ("; use problem.condensed()" if form is Form.DELASSUS else "")
            )

    # ---------------------------------------------------------------- M and W
    def _kept(self, name: str, sources: tuple, make: Callable[[], Any]) -> Any:
        """What `make` gives, made once for all variants that hold the same source matrices."""
        return made_once(self._shared, name, sources, make)

    def kept(self, name: str, make: Callable[[], Any]) -> Any:
        """What a solver prepares of M, H or W alone, once for all variants of this problem.

        make() is called when nothing of that name is kept for these matrices.
        """
        return self._kept(name, (self.M, self.H, self.W), make)

    @cached_property
    def matrices(self) -> GlobalMatrices:
        """M and H with what is prepared of them (global form only)."""
        self._need(Form.GLOBAL)
        assert self.M is not None and self.H is not None
        return GlobalMatrices(
            self.M, self.H, self.dimension, self.near_nullspace, self.levels, self._shared
        )

    def factor(self) -> Factor:
        """M prepared for solves, made once and shared by all variants of this problem.

        A sparse factor, equal bodies sharing one; conjugate gradients with multigrid where the
        factor of a mesh would not fit into memory (more than DIRECT_LIMIT unknowns in one body,
        near_nullspace given).
        """
        return self.matrices.factor()

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

    @property
    def hierarchy(self) -> Hierarchy | None:
        """Multigrid levels of M, made once; None where the unknowns do not come in nodes."""
        return self.matrices.hierarchy

    @property
    def local_stiffness(self) -> Array:
        """H_i^T D^-1 H_i, (nc, d, d), D the block diagonal of M: a cheap stand-in for W_ii."""
        return self.matrices.local_stiffness

    @property
    def condensing_is_cheap(self) -> bool:
        """True when W is the best to solve with: it then also judges (`measure`).

        For rigid bodies, small problems, and where it takes less work than CHEAP compressed W
        and fits into memory; see `condensation` for the counts.  Not where a body is large and
        its mesh has levels: contact multigrid then solves before W stands.
        """
        return self.form is Form.DELASSUS or self.matrices.condensing_is_cheap

    @cached_property
    def free_velocity(self) -> Array:
        """q, (nc, d): local velocity without reactions, w + H^T M^-1 f in the global form."""
        if self.q is not None:
            return self.q
        return self._free[0]

    @property
    def free_blur(self) -> Array:
        """What rounding may have left of the free velocity, (nc,), unit of u."""
        return self._free[1]

    @cached_property
    def _free(self) -> tuple[Array, Array]:
        """H^T M^-1 f + w, and its blur (global form only)."""
        assert self.f is not None and self.H is not None and self.w is not None
        v = self.solve_M(self.f)
        q = self.local_velocity(v)
        terms = (abs(self.H).T @ np.abs(v)).reshape(self.w.shape) + np.abs(self.w)
        blur = judge.FLOOR * judge.EPSILON * np.linalg.norm(terms, axis=1)
        for array in (q, blur):
            array.flags.writeable = False
        return q, blur

    def velocity(self, r: Array) -> tuple[Array, Array | None]:
        """(u, v) of reactions r, (nc, d); v is None in the Delassus form."""
        if self.form is Form.DELASSUS:
            indptr, indices, data, q = self.kernel_data[:4]
            u = np.empty_like(q)
            velocity_inplace(indptr, indices, data, q, spatial(r), u)
            return u[:, : self.dimension], None
        assert self.H is not None and self.f is not None
        v = self.solve_M(self.H @ r.ravel() + self.f)
        return self.local_velocity(v), v

    def local_velocity(self, v: Array) -> Array:
        """u = H^T v + w, (nc, d)."""
        assert self.H is not None and self.w is not None
        return (self.H.T @ v).reshape(self.w.shape) + self.w

    # ---------------------------------------------------------------- judging
    @cached_property
    def measure(self) -> Measure:
        """Which error measure applies, see `judge`."""
        if self.form is Form.DELASSUS:
            return Measure.EXACT
        try:
            cheap = self.condensing_is_cheap and self.condensed() is not None
        except SingularOperator:
            cheap = False
        return Measure.EXACT if cheap else Measure.RESIDUAL

    def prepare(self, deadline: Deadline) -> None:
        """Form W where `measure` asks for it; raises TimeUp when it is not there in time."""
        if self.form is Form.GLOBAL:
            with suppress(SingularOperator):
                if self.condensing_is_cheap:
                    self.condensed(deadline)

    def error(self, r: Array, v: Array | None = None) -> float:
        """Unit-free error of reactions r, (nc, d), and of the motion v, (n,), if it is given.

        Without v it is that of the motion of r.  Infinite when r or v hold a number that is not
        finite, and without v when M is singular.  Raises UnsupportedForm for a v in the
        Delassus form, which has none, InvalidInput for one of another size.
        """
        if v is not None:
            self._check_motion(v)
        if self.measure is Measure.EXACT:
            error = self.condensed().exact_error(r)
            return error if v is None else max(error, self.imbalance(r, v))
        if v is None:
            try:
                v = self.velocity(r)[1]
            except SingularOperator:
                return np.inf
        assert v is not None
        return self._residual_error(r, v)

    def rounding(self, r: Array) -> float:
        """What rounding alone may hide in `error`, unit-free: no smaller error can be known."""
        if self.measure is Measure.EXACT:
            p = self.condensed()
            return judge.ratio(p._hidden(p.rho, r), p.q_norm)
        return judge.ratio(self._hidden(self.rho, r), self.scales[1])

    def certain_error(self, r: Array, v: Array | None = None) -> float:
        """`error`, evaluated sharply where rounding could hide one in it."""
        error, hidden = self.error(r, v), self.rounding(r)
        if hidden <= error or self.measure is not Measure.EXACT:
            return max(error, hidden)
        p = self.condensed()
        found, left = sharp_error(*p.kernel_data, _rows(r))
        return max(judge.ratio(max(found, left), p.q_norm), self.imbalance(r, v))

    @np.errstate(over="ignore", invalid="ignore")  # of iterates that run away
    def imbalance(self, r: Array, v: Array | None) -> float:
        """|M v - H r - f| relative to the load; 0 for v = None, the motion of r.

        Where the exact measure judges, only what is beyond the rounding of its terms counts: a
        factor of stiff bodies beside small loads gives no better v.
        """
        if v is None:
            return 0.0
        assert self.M is not None and self.H is not None and self.f is not None
        push = self.H @ r.ravel()
        rest = float(np.linalg.norm(self.M @ v - push - self.f))
        if not np.isfinite(rest):
            return np.inf
        load = self.load or float(np.linalg.norm(push))
        if self.measure is Measure.EXACT and rest > judge.EPSILON * load:
            terms = self._sizes[0] @ np.abs(v) + self._sizes[1] @ np.abs(r.ravel())
            rounding = judge.FLOOR * judge.EPSILON * np.linalg.norm(terms + np.abs(self.f))
            rest = max(rest - float(rounding), 0.0)
        return judge.ratio(rest, load)

    @cached_property
    def _sizes(self) -> tuple[Any, Any]:
        """|M| and |H|, entry by entry."""
        return self._kept("sizes", (self.M, self.H), lambda: (abs(self.M), abs(self.H)))

    def _check_motion(self, v: Array) -> None:
        if self.form is Form.DELASSUS:
            raise UnsupportedForm(
                "v: expected None, the problem is in its local form, which has reactions only"
            )
        expect_shape("v", np.shape(v), (self.unknowns,))

    def _hidden(self, rho: Array, r: Array) -> float:
        tresca = isinstance(self.law, Tresca)
        return judge.rounding_error(self.law.coefficient, tresca, rho, _rows(r))

    def weakest(self, r: Array, v: Array | None = None) -> Weakest:
        """The contact farthest from its law on its own scale; arguments as in `error`."""
        if self.measure is Measure.EXACT:
            return self.condensed().assessed(r).weakest
        if v is None:
            try:
                v = self.velocity(r)[1]
            except SingularOperator:
                return Weakest(np.inf, None)
        assert v is not None
        if not (np.isfinite(r).all() and np.isfinite(v).all()):
            return Weakest(np.inf, None)
        u, q = self.local_velocity(v), self.open_velocity
        rho = np.where(self.rho > 0, self.rho, np.inf)
        parts = (q, u - q, r / rho[:, None])
        scale = sum(np.linalg.norm(part, axis=1) for part in parts)
        found = judge.weakest_of(r, u, self.law, self.rho, scale)
        return found._replace(hidden=self.rounding(r))

    def assessed(self, r: Array) -> Assessed:
        """All that is asked of reactions that may have converged (Delassus form only)."""
        return assessed(self.kernel_data, _rows(r), self._floor, self.q_norm)

    @cached_property
    def _floor(self) -> Array:
        return self.blur if self.blur is not None else np.zeros(self.contacts)

    def exact_error(self, r: Array) -> float:
        """The exact measure of the Delassus form."""
        rows = _rows(r)
        size = self.q_norm
        if size == 0:
            return 0.0 if not rows.any() else np.inf
        return judge.natural_error(*self.kernel_data, rows) / size

    @np.errstate(over="ignore", invalid="ignore")
    def _residual_error(self, r: Array, v: Array) -> float:
        law = judge.scaled_residual(r, self.local_velocity(v), self.law, self.rho)
        error = max(
            self.imbalance(r, v), judge.ratio(law, self.scales[1]), self.unbalanced(r)
        )
        return float(error) if np.isfinite(error) else np.inf

    def unbalanced(self, r: Array) -> float:
        """Largest force that moves a loose body as a whole, relative to those on it.

        A loose body is one that contact alone holds; 0 where there is none, and in the Delassus
        form, which has none.
        """
        modes = self.loose_modes
        if modes.shape[1] == 0:
            return 0.0
        assert self.f is not None and self.H is not None
        load = modes.T @ self.f
        pushes = (self.H.T @ modes).reshape(*r.shape, -1) * r[:, :, None]
        least = judge.FLOOR * judge.EPSILON * (np.abs(modes).T @ np.abs(self.f))
        size = np.abs(load) + np.abs(pushes).sum(axis=(0, 1)) + least
        rest = np.abs(load + pushes.sum(axis=(0, 1)))
        return float(np.divide(rest, size, out=np.zeros_like(rest), where=size > 0).max())

    @cached_property
    def loose_modes(self) -> Array:
        """Rigid modes of bodies that contact alone holds, orthonormal columns (n, k)."""
        loose = self.u_scale is not None and self.guess is not None
        if self.form is Form.GLOBAL and not loose:
            try:
                _ = self.open_velocity if self._is_estimated else self.free_velocity
            except SingularOperator:
                loose = True
        if not loose:
            return np.zeros((self.unknowns, 0))
        return self.matrices.loose_modes

    @cached_property
    def rho(self) -> Array:
        """Augmentation parameter, (nc,), unit of r / u; 0 where a contact can not react."""
        if self.form is Form.DELASSUS:
            return self.kernel_data[-1]
        return _inverse_norms(self.local_stiffness)

    @cached_property
    def scales(self) -> tuple[float, float]:
        """Sizes of the load and of u for the residual measure (global form only)."""
        if self.u_scale is not None:
            return self.load, self.u_scale
        return self.load, float(np.linalg.norm(self.open_velocity))

    @cached_property
    def load(self) -> float:
        """Size of the load, unit of f (global form only)."""
        assert self.f is not None
        return self.load_scale if self.load_scale is not None else float(np.linalg.norm(self.f))

    @cached_property
    def open_velocity(self) -> Array:
        """u without reactions, (nc, d); of large meshes from a coarse level, to some per cent.

        Where contact alone holds a body: u of the guess, else w (global form only).
        """
        assert self.w is not None
        if self.u_scale is not None and self.guess is not None:
            return self.local_velocity(self.guess)
        try:
            return self._open_velocity()
        except SingularOperator:
            return self.w

    @property
    def _is_estimated(self) -> bool:
        """True for large meshes, where M^-1 f would cost too much only to judge."""
        large = self.unknowns > ESTIMATED and not isinstance(self.M, DistributedMatrix)
        return large and (bool(self.levels) or self.near_nullspace is not None)

    def _open_velocity(self) -> Array:
        hierarchy = self.hierarchy if self._is_estimated else None
        if hierarchy is None:
            return self.free_velocity
        assert self.f is not None and self.M is not None
        v = self.guess if self.guess is not None else np.zeros(self.unknowns)
        rest = self.f - self.M @ v if self.guess is not None else self.f
        nodes = hierarchy.nodes
        v = v + nodes.gather(hierarchy.estimate(nodes.spread(rest), ESTIMATED // 9))
        return self.local_velocity(v)


def _rows(r: Array) -> Array:
    """r as kernels take it, (nc, 3); the same array where it is so already."""
    return r if r.shape[1] == 3 and r.flags.c_contiguous else spatial(r)


def _check_name(name: str) -> None:
    if not isinstance(name, str):
        raise InvalidInput(f"name: expected a text, got {shown(name)}")


def _law(mu: ArrayLike | Law) -> Law:
    return mu if isinstance(mu, Coulomb | Tresca) else Coulomb(real("mu", mu))


def _inverse_norms(blocks: Array) -> Array:
    """1 / |A|_2 of blocks A, (nc, d, d); 0 where A is 0."""
    size = np.linalg.norm(blocks, 2, axis=(1, 2))
    return np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
