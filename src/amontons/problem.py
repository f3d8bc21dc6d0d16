"""The one discrete problem of frictional contact, in FCLib's letters.

    M v = H r + f,   u = H^T v + w,   u = W r + q   with W = H^T M^-1 H, q = H^T M^-1 f + w,
    K* ∋ u + mu |u_T| n  ⟂  r ∈ K   per contact (Coulomb), or Tresca's law with a given bound.

v are n displacements or velocities; r and u are (nc, d) in the local frames, rows
[x_N, x_T1(, x_T2)], r.ravel() being FCLib's vector.  u_N >= 0 is open, r_N >= 0 compression.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from . import judge
from .blocks import BlockRows, block_part, block_rows, spatial, velocity_inplace
from .condensation import Condensation
from .cones import Coulomb, Law, Tresca
from .errors import InvalidInput, SingularOperator, UnsupportedForm
from .judge import Measure
from .linear import ConjugateGradient, Direct, Factor, GeometricMultigrid, LinearSolver
from .linear.bodies import Bodies, BodyFactor
from .linear.distributed import DistributedMatrix
from .linear.geometric import prepared
from .linear.grid_matrix import GridMatrix
from .linear.hierarchy import Hierarchy
from .linear.levels import Levels, checked_levels
from .linear.small_blocks import block_diagonal_inverse

Array = NDArray[np.float64]
Matrix = sparse.csr_array | sparse.csc_array | Array
LARGEST = 1e100  # entry in any unit: squares must stay finite, and 1 / LARGEST positive
OPERATORS = (GridMatrix, DistributedMatrix)  # which M may be instead of a stored matrix
DENSE_LIMIT = 4e9  # bytes that condensed() may fill before it refuses
DIRECT_LIMIT = 600_000  # unknowns of a mesh whose factor takes some 10 GB
EXACT_WORK = 2e6  # n * nc * d up to which forming W costs nothing that matters
ESTIMATED = 9_000  # unknowns of a mesh above which the size of u is taken from a coarse level
LARGE_BODY = 10_000  # unknowns of a body with levels from which multigrid is the way
CHEAP = 2.0  # work of W, relative to that of a compressed W, which is full and not exact


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
    name: str = ""
    _shared: dict[str, tuple[tuple, Any]] = field(default_factory=dict, repr=False)

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
        M, H = M if isinstance(M, OPERATORS) else _sparse("M", M), _sparse("H", H)
        n = M.shape[0]
        _expect("M", M.shape, (n, n))
        f = _vector("f", f, (n,))
        w = _contact_rows("w", w, nc)
        _expect("H", H.shape, (n, nc * w.shape[1]))
        if near_nullspace is not None and near_nullspace.shape[0] != n:
            raise InvalidInput(
                f"near_nullspace: expected {n} rows, got {near_nullspace.shape[0]}"
            )
        if guess is not None:
            guess = _vector("guess", guess, (n,))
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
        q = _contact_rows("q", q, len(law.coefficient))
        if sparse.issparse(W):
            W = _read_only(_sparse("W", W).tocsr())
        else:
            W = _vector("W", W, (q.size, q.size))
        _expect("W", W.shape, (q.size, q.size))
        problem = cls(law, W=W, q=q, name=name)
        _ = problem.kernel_data, problem.blocks.eliminated  # once, not in the first solve
        return problem

    # ---------------------------------------------------------------- sizes and views
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
        size = (
            np.linalg.norm(b.diagonal_blocks, 2, axis=(1, 2)) if self.contacts else np.zeros(0)
        )
        able = size > 0
        rho = np.where(able, 1 / np.where(able, size, 1.0), 0.0)
        for array in (q, rho):
            array.flags.writeable = False
        tresca = isinstance(self.law, Tresca)
        return b.indptr, b.indices, b.data, q, self.law.coefficient, tresca, rho

    @cached_property
    def q_norm(self) -> float:
        """Euclidean norm of q (Delassus form only)."""
        self._need(Form.DELASSUS)
        return float(np.linalg.norm(self.q))  # type: ignore[arg-type]

    def _kept(self, name: str, sources: tuple, make: Callable[[], Any]) -> Any:
        """What `make` gives, made once for all variants that hold the same source matrices."""
        entry = self._shared.get(name)
        if entry is None or any(a is not b for a, b in zip(entry[0], sources, strict=True)):
            entry = self._shared[name] = (sources, make())
        return entry[1]

    def kept(self, name: str, make: Callable[[], Any]) -> Any:
        """What a solver prepares of M, H or W alone, once for all variants of this problem.

        make() is called when nothing of that name is kept for these matrices.
        """
        return self._kept(name, (self.M, self.H, self.W), make)

    def restricted(self, contacts: NDArray[np.int64]) -> FrictionProblem:
        """The Delassus form of some contacts, (k,) in ascending order; `whole` leads back."""
        self._need(Form.DELASSUS)
        assert self.q is not None
        rows = block_part(self.blocks, contacts)
        part = self._from_blocks(rows, self.q[contacts], self.law.at(contacts))
        part._shared["whole"] = ((part.W,), (self, contacts))
        return part

    @property
    def whole(self) -> tuple[FrictionProblem, NDArray[np.int64]]:
        """The problem that this one is a part of, and its contacts there; else itself."""
        return self._kept("whole", (self.W,), lambda: (self, np.arange(self.contacts)))

    def _need(self, form: Form) -> None:
        if self.form is not form:
            raise UnsupportedForm(
                f"this needs the {form.value} form, the problem is {self.form.value}"
                + ("; use problem.condensed()" if form is Form.DELASSUS else "")
            )

    # ---------------------------------------------------------------- operators
    def factor(self) -> Factor:
        """M prepared for solves, made once and shared by all variants of this problem.

        A sparse factor, equal bodies sharing one; conjugate gradients with multigrid where the
        factor of a mesh would not fit into memory (more than DIRECT_LIMIT unknowns in one body,
        near_nullspace given).
        """
        self._need(Form.GLOBAL)
        M, modes = self.M, self.near_nullspace
        assert M is not None
        if isinstance(M, GridMatrix):
            return self._kept("factor", (M,), lambda: GeometricMultigrid().factor(M))  # type: ignore[arg-type]
        if isinstance(M, DistributedMatrix):
            return self._kept("factor", (M,), M.factor)
        bodies = self.bodies
        iterative = bodies.largest > DIRECT_LIMIT and modes is not None
        if bodies.count > 1 and not iterative:
            return self._kept("factor", (M,), lambda: bodies.factor(M))
        solver: LinearSolver = ConjugateGradient() if iterative else Direct()
        return self._kept("factor", (M,), lambda: solver.factor(M, modes))

    def assembled(self) -> FrictionProblem:
        """The same problem with M as a stored matrix, for solvers that need its entries.

        Its levels, which the operator has for itself, become those of the problem.
        """
        if not isinstance(self.M, GridMatrix):
            return self
        M = self.M
        levels = self.levels or self._kept("stored levels", (M,), M.free_levels)
        return replace(self, M=self._kept("stored", (M,), M.tocsc), levels=levels)

    @cached_property
    def bodies(self) -> Bodies:
        """The blocks into which M falls apart (global form only)."""
        self._need(Form.GLOBAL)
        M = self.M
        assert M is not None
        return self._kept("bodies", (M,), lambda: Bodies.of(M))

    @cached_property
    def _condensation(self) -> Condensation:
        H = self.H
        assert H is not None
        return self._kept(
            "condensation", (self.M, H), lambda: Condensation(self.bodies, H, self.dimension)
        )

    @cached_property
    def small_blocks(self) -> sparse.csc_array | None:
        """M^-1 when M is block diagonal with small blocks (rigid bodies), else None."""
        self._need(Form.GLOBAL)
        M = self.M
        assert M is not None
        if isinstance(M, OPERATORS):
            return None
        return self._kept("inverse", (M,), lambda: block_diagonal_inverse(M))

    def solve_M(self, b: Array) -> Array:
        """M^-1 b, b of shape (n,) or (n, k)."""
        inverse = self.small_blocks
        return inverse @ b if inverse is not None else self.factor().solve(b)

    @property
    def condensing_is_cheap(self) -> bool:
        """True when W is the best to solve with: it then also judges (`measure`).

        For rigid bodies, small problems, and where it takes less work than CHEAP compressed W
        and fits into memory; see `condensation` for the counts.  Not where a body is large and
        its mesh has levels: contact multigrid then solves before W stands.
        """
        if self.form is Form.DELASSUS:
            return True
        return self._kept("cheap", (self.M, self.H), self._condensing_is_cheap)

    def _condensing_is_cheap(self) -> bool:
        if isinstance(self.M, OPERATORS):
            return False
        if self.small_blocks is not None:
            return True
        if self.unknowns * self.contacts * self.dimension <= EXACT_WORK:
            return True
        if self.levels and self.bodies.largest >= LARGE_BODY:
            return False
        parts = self._condensation
        fits = 8.0 * self.dimension**2 * parts.blocks <= DENSE_LIMIT
        return fits and parts.work <= CHEAP * parts.compressed_work

    def condensed(self) -> FrictionProblem:
        """The Delassus form of this problem: W = H^T M^-1 H, q = H^T M^-1 f + w.

        Raises InvalidInput when W would not fit into memory, SingularOperator when M can not
        be inverted (a body held by contact alone).
        """
        return self if self.form is Form.DELASSUS else self._condensed

    @cached_property
    def _condensed(self) -> FrictionProblem:
        base = self._kept("condensed", (self.M, self.H), self._condense)
        return replace(base, law=self.law, q=self.free_velocity, name=self.name)

    def _condense(self) -> FrictionProblem:
        assert self.H is not None
        m = self.contacts * self.dimension
        inverse = self.small_blocks
        if inverse is not None:
            W: Matrix = (self.H.T @ (inverse @ self.H)).tocsr()
            return FrictionProblem.from_delassus(W, self.free_velocity, self.law)
        several = isinstance(self.factor(), BodyFactor)
        size = 8.0 * (self.dimension**2 * self._condensation.blocks if several else m * m)
        if size > DENSE_LIMIT:
            raise InvalidInput(
                f"condensed: W would take {1e-9 * size:.1f} GB for {self.contacts} "
                "contacts; solve the global form with SemismoothNewton, "
                "which does not form W"
            )
        if several:
            rows = self._condensation.delassus(self.factor())  # type: ignore[arg-type]
            return self._from_blocks(rows, self.free_velocity, self.law)
        return FrictionProblem.from_delassus(
            self._dense_delassus(), self.free_velocity, self.law
        )

    @classmethod
    def _from_blocks(cls, rows: BlockRows, q: Array, law: Law) -> FrictionProblem:
        """The problem in Delassus form whose W is there in block rows."""
        d = q.shape[1]
        shape = (q.size, q.size)
        tiles = sparse.bsr_array((rows.data[:, :d, :d], rows.indices, rows.indptr), shape=shape)
        problem = cls(law, W=_read_only(tiles.tocsr()), q=q)
        problem._kept("blocks", (problem.W,), lambda: rows)
        return problem

    @cached_property
    def free_velocity(self) -> Array:
        """q, (nc, d): local velocity without reactions, w + H^T M^-1 f in the global form."""
        if self.q is not None:
            return self.q
        assert self.f is not None
        q = self.local_velocity(self.solve_M(self.f))
        q.flags.writeable = False
        return q

    def _dense_delassus(self) -> Array:
        """W by blocks of right-hand sides, so that memory stays near that of W itself."""
        H = sparse.csc_array(self.H)
        m = H.shape[1]
        W = np.empty((m, m))
        for first in range(0, m, 64):
            columns = H[:, first : first + 64].toarray()
            W[:, first : first + 64] = H.T @ self.solve_M(columns)
        return W

    def with_mu(self, mu: ArrayLike) -> FrictionProblem:
        """The same problem with other friction coefficients: a number or (nc,).

        Raises UnsupportedForm under Tresca's law, which has no mu.
        """
        _ = self.mu
        values = _real("mu", mu)
        if values.shape not in ((), (self.contacts,)):
            raise InvalidInput(
                f"mu: expected a number or shape ({self.contacts},), got {values.shape}"
            )
        law = Coulomb(np.broadcast_to(values, (self.contacts,)))
        return replace(self, law=law)

    def with_load(self, load: ArrayLike) -> FrictionProblem:
        """The same problem with another f (global form) or q (Delassus form)."""
        if self.form is Form.GLOBAL:
            return replace(self, f=_vector("f", load, (self.unknowns,)), guess=None)
        q = _contact_rows("q", load, self.contacts)
        _expect("q", q.shape, (self.contacts, self.dimension))
        return replace(self, q=q)

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

    def error(self, r: Array, v: Array | None = None) -> float:
        """Unit-free error of reactions r, (nc, d); v, (n,), is read by the residual measure.

        Infinite when r or v hold a number that is not finite, and without v when M is singular.
        """
        if self.measure is Measure.EXACT:
            return self.condensed().exact_error(r)
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
            return judge.ratio(judge.rounding_error(p.rho, r), p.q_norm)
        return judge.ratio(judge.rounding_error(self.rho, r), self.scales[1])

    def exact_error(self, r: Array) -> float:
        """The exact measure of the Delassus form."""
        rows = r if r.shape[1] == 3 and r.flags.c_contiguous else spatial(r)
        size = self.q_norm
        if size == 0:
            return 0.0 if not rows.any() else np.inf
        return judge.natural_error(*self.kernel_data, rows) / size

    def _residual_error(self, r: Array, v: Array) -> float:
        assert self.M is not None and self.H is not None and self.f is not None
        u = self.local_velocity(v)
        balance = np.linalg.norm(self.M @ v - self.H @ r.ravel() - self.f)
        law = judge.scaled_residual(r, u, self.law, self.rho)
        load, reference = self.scales
        error = max(judge.ratio(balance, load), judge.ratio(law, reference))
        return float(error) if np.isfinite(error) else np.inf

    @property
    def local_stiffness(self) -> Array:
        """H_i^T D^-1 H_i, (nc, d, d), D the block diagonal of M: a cheap stand-in for W_ii."""
        self._need(Form.GLOBAL)
        return self._kept("local stiffness", (self.M, self.H), self._local_stiffness)

    def _local_stiffness(self) -> Array:
        assert self.M is not None and self.H is not None
        d, n = self.dimension, self.unknowns
        size = d if n % d == 0 else 1
        touched = np.unique(self.H.indices // size)  # the blocks that H sees
        index = (touched[:, None] * size + np.arange(size)).ravel()
        H = sparse.csr_array(self.H)[index]
        M = self.M
        part = M.part(index) if isinstance(M, OPERATORS) else M[:, index].tocsr()[index]
        inverse = _node_blocks_inverse(part, size)
        product = sparse.csc_array(inverse @ H)
        full = (sparse.csr_array(H.T) @ product).tobsr((d, d))
        out = np.zeros((self.contacts, d, d))
        rows = np.repeat(np.arange(self.contacts), np.diff(full.indptr))
        own = rows == full.indices
        out[rows[own]] = full.data[own]
        return out

    @cached_property
    def rho(self) -> Array:
        """Augmentation parameter, (nc,), unit of r / u; 0 where a contact can not react."""
        if self.form is Form.DELASSUS:
            return self.kernel_data[-1]
        size = np.linalg.norm(self.local_stiffness, 2, axis=(1, 2))
        return np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)

    @cached_property
    def scales(self) -> tuple[float, float]:
        """Sizes of the load and of u for the residual measure (global form only)."""
        assert self.f is not None and self.w is not None
        load = self.load_scale if self.load_scale is not None else float(np.linalg.norm(self.f))
        if self.u_scale is not None:
            return load, self.u_scale
        try:
            free = self._free_size()
        except SingularOperator:
            free = float(np.linalg.norm(self.w))
        return load, free

    def _free_size(self) -> float:
        """|u| without reactions; of large meshes from a coarse level, to some per cent."""
        large = self.unknowns > ESTIMATED and not isinstance(self.M, DistributedMatrix)
        nested = self.levels or self.near_nullspace is not None
        hierarchy = self.hierarchy if large and nested else None
        if hierarchy is None:
            return float(np.linalg.norm(self.free_velocity))
        assert self.f is not None and self.M is not None
        v = self.guess if self.guess is not None else np.zeros(self.unknowns)
        rest = self.f - self.M @ v if self.guess is not None else self.f
        nodes = hierarchy.nodes
        v = v + nodes.gather(hierarchy.estimate(nodes.spread(rest), ESTIMATED // 9))
        return float(np.linalg.norm(self.local_velocity(v)))

    @property
    def hierarchy(self) -> Hierarchy | None:
        """Multigrid levels of M, made once; None where the unknowns do not come in nodes."""
        self._need(Form.GLOBAL)
        M, levels, modes = self.M, self.levels, self.near_nullspace
        assert M is not None
        return self._kept("hierarchy", (M,), lambda: prepared(M, levels, modes, self.dimension))


def _node_blocks_inverse(M: sparse.csc_array, d: int) -> sparse.bsr_array:
    """Inverse of the d x d block diagonal of M, pseudo-inverse where a block is singular."""
    n = M.shape[0]
    nodes = n // d
    coo = M.tocoo()
    own = coo.row // d == coo.col // d
    blocks = np.zeros((nodes, d, d))
    np.add.at(blocks, (coo.row[own] // d, coo.row[own] % d, coo.col[own] % d), coo.data[own])
    index = np.arange(nodes)
    return sparse.bsr_array((np.linalg.pinv(blocks), index, np.arange(nodes + 1)), shape=(n, n))


# -------------------------------------------------------------------- checks at the border
def _law(mu: ArrayLike | Law) -> Law:
    return mu if isinstance(mu, Coulomb | Tresca) else Coulomb(_real("mu", mu))


def _expect(name: str, found: tuple[int, ...], expected: tuple[int, ...]) -> None:
    if found != expected:
        raise InvalidInput(f"{name}: expected shape {expected}, got {found}")


def _finite(name: str, values: Array) -> None:
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        where = ", ".join(str(k) for k in bad[0])
        raise InvalidInput(
            f"{name}[{where}]: expected a finite number, got {values[tuple(bad[0])]}"
        )


def _squarable(name: str, values: Array) -> None:
    """Refuse what is so large or small in all entries that its square is no number any more."""
    size = float(np.abs(values).max(initial=0.0))
    if size > LARGEST or 0 < size < 1 / LARGEST:
        raise InvalidInput(
            f"{name}: its largest entry is {size:.1e}, which can not be squared; use units in "
            f"which it lies between {1 / LARGEST:g} and {LARGEST:g}"
        )


def _real(name: str, values: object) -> Array:
    """A float copy; rejects texts, ragged lists and complex numbers."""
    try:
        raw = np.asarray(values)
        if np.iscomplexobj(raw):
            raise InvalidInput(f"{name}: expected real numbers, got complex ones")
        return np.array(raw, dtype=float, order="C")
    except (TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{name}: expected an array of numbers ({error})") from error


def _vector(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A read-only float copy of that shape."""
    array = _real(name, values)
    _expect(name, array.shape, shape)
    _finite(name, array)
    _squarable(name, array)
    array.flags.writeable = False
    return array


def _contact_rows(name: str, values: ArrayLike, nc: int) -> Array:
    """Contact rows (nc, 2 or 3), also from FCLib's flat vector."""
    array = _real(name, values)
    if array.ndim == 1 and nc and array.size in (2 * nc, 3 * nc):
        array = array.reshape(nc, -1)
    if array.ndim != 2 or array.shape[0] != nc or array.shape[1] not in (2, 3):
        raise InvalidInput(f"{name}: expected shape ({nc}, 2) or ({nc}, 3), got {array.shape}")
    _finite(name, array)
    _squarable(name, array)
    array.flags.writeable = False
    return array


def _read_only(matrix):
    """Lock the arrays of a sparse matrix, so that sharing it is safe."""
    for array in (matrix.data, matrix.indices, matrix.indptr):
        array.flags.writeable = False
    return matrix


def _sparse(name: str, matrix: Matrix) -> sparse.csc_array:
    """A canonical copy: columns sorted, duplicates summed, every entry finite."""
    if not sparse.issparse(matrix):
        matrix = _real(name, matrix)
    elif np.iscomplexobj(matrix.data):
        raise InvalidInput(f"{name}: expected real numbers, got complex ones")
    out = sparse.csc_array(matrix, dtype=float, copy=True)
    out.sum_duplicates()
    bad = np.flatnonzero(~np.isfinite(out.data))
    if bad.size:
        row = out.indices[bad[0]]
        column = int(np.searchsorted(out.indptr, bad[0], side="right")) - 1
        raise InvalidInput(
            f"{name}[{row}, {column}]: expected a finite number, got {out.data[bad[0]]}"
        )
    _squarable(name, out.data)
    return _read_only(out)
