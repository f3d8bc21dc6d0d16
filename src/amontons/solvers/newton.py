"""Semismooth Newton: exact generalised Jacobians, non-monotone line search, both forms.

With (F, A, B) of a complementarity function (`functions`):

    Delassus form   (A + B W) dr = -F
    global form     M dv - H dr = -(M v - H r - f),   A dr + B H^T dv = -F

The global form never forms W.  Either the whole system is factorised in each step (Augmented), or
M is factorised once and dr comes from GMRES on A + B W, one solve with M per iteration
(SchurComplement).  Its preconditioner replaces W by S^-1, S = E^T M E with E = H (H^T H)^-1 the
stiffness of the contact unknowns alone, which is sparse: (A S + B) y = g, dr = S y.  The tolerance
of GMRES follows the Newton residual (Eisenstat-Walker), so early steps are cheap.

Merit function of the line search: |F / rho|, unit of u, against the largest of the last values.
Contacts that can not react (W_ii = 0) keep r = 0.

[QS] L. Qi, J. Sun, "A nonsmooth version of Newton's method", Math. Program. 58 (1993);
[EW] S. Eisenstat, H. Walker, "Choosing the forcing terms in an inexact Newton method", SIAM J.
Sci. Comput. 17 (1996); [GLL] L. Grippo, F. Lampariello, S. Lucidi, SIAM J. Numer. Anal. 23 (1986).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from ..errors import SingularOperator
from ..linear import Direct, LinearSolver
from ..problem import Form, FrictionProblem
from .base import Breakdown, Iterate, Target, check_at_least, check_positive
from .functions import AlartCurnier, ComplementarityFunction

Array = NDArray[np.float64]
DENSE_UNKNOWNS = 1200  # reactions up to which a dense factor of A + B W is quicker than a sparse
FORCING = (1e-10, 0.1)  # smallest and largest relative tolerance of GMRES


class Linearisation(Protocol):
    """The Newton equation of one problem; W is hidden in it."""

    def velocity(self, r: Array) -> tuple[Array, Array | None]:
        """(u, v) that r causes."""
        ...

    def step(self, A: Array, B: Array, F: Array, forcing: float) -> tuple[Array, Array, int]:
        """(dr, du, linear iterations), dr and du (nc, d), of (A + B W) dr = -F."""
        ...


@dataclass(frozen=True)
class SemismoothNewton:
    """Semismooth Newton with a non-monotone line search.

    linear: None takes the best for the form: dense or sparse LU of A + B W in the Delassus form,
    the Schur complement with one factor of M in the global form.  A LinearSolver given here
    factorises the whole system of the global form in each step.
    """

    form: ClassVar[Form] = Form.ANY
    function: ComplementarityFunction = field(default_factory=AlartCurnier)
    linear: LinearSolver | None = None
    memory: int = 5  # merit values the line search may look back on; 1: monotone
    halvings: int = 12  # of the step before it is taken as it is; 0: no line search
    rho: float = 1.0  # augmentation parameter relative to 1 / |W_ii|

    def __post_init__(self) -> None:
        check_at_least(1, memory=self.memory)
        check_at_least(0, halvings=self.halvings)
        check_positive(rho=self.rho)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Newton steps from `start`; raises Breakdown when a step can not be computed."""
        system = self._linearise(problem)
        law, d = problem.law, problem.dimension
        able = problem.rho > 0
        rho = self.rho * np.where(able, problem.rho, 1.0)
        r = np.where(able[:, None], start.r, 0.0)
        u, v = system.velocity(r)
        values: list[float] = []
        forcing, blocked = FORCING[1], np.where(able, 0.0, 1.0)[:, None, None] * np.eye(d)
        while True:
            F, A, B = self.function.linearise(r, u, law, rho)
            F, A, B = F * able[:, None], A * able[:, None, None] + blocked, B * able[:, None, None]
            values = [*values, _size(F, rho)][-self.memory :]
            if len(values) > 1:  # [EW] choice 2
                ratio = values[-1] / max(values[-2], np.finfo(float).tiny)
                forcing = float(np.clip(0.5 * ratio**2, *FORCING))
            dr, du, count = system.step(A, B, F, forcing)
            if not np.isfinite(dr).all():
                raise Breakdown("the Newton step is not finite")
            t = self._search(r, u, dr, du, max(values), rho, able, law)
            r = r + t * dr
            u, v = system.velocity(r)
            yield Iterate(r, v, linear_iterations=count)

    def _search(self, r, u, dr, du, ceiling, rho, able, law) -> float:  # noqa: PLR0913
        """[GLL] step length; the full step when no shorter one helps."""
        t = 1.0
        for _ in range(self.halvings):
            F = self.function.residual(r + t * dr, u + t * du, law, rho) * able[:, None]
            if _size(F, rho) <= (1 - 1e-4 * t) * ceiling:
                return t
            t /= 2
        return t if self.halvings else 1.0

    def _linearise(self, problem: FrictionProblem) -> Linearisation:
        if problem.form is Form.DELASSUS:
            return Condensed(problem)
        if self.linear is not None:
            return Augmented(problem, self.linear)
        return SchurComplement.of(problem)


def _size(F: Array, rho: Array) -> float:
    """|F / rho|, unit of u."""
    return float(np.linalg.norm(F / rho[:, None]))


def block_diagonal(blocks: Array) -> sparse.csr_array:
    """Sparse matrix with the given (nc, d, d) blocks on its diagonal."""
    nc, d, _ = blocks.shape
    index = np.arange(nc + 1)
    return sparse.csr_array(
        sparse.bsr_array((blocks, index[:-1], index), shape=(nc * d, nc * d))
    )


@dataclass(frozen=True, eq=False)
class Condensed:
    """Newton equation of the Delassus form."""

    problem: FrictionProblem

    def velocity(self, r: Array) -> tuple[Array, Array | None]:
        """(u, None) that r causes."""
        return self.problem.velocity(r)

    def step(self, A: Array, B: Array, F: Array, forcing: float) -> tuple[Array, Array, int]:
        """A dense factor for few reactions or a full W, else a sparse one."""
        W = self.problem.W
        assert W is not None
        if sparse.issparse(W) and F.size > DENSE_UNKNOWNS:
            matrix = block_diagonal(A) + block_diagonal(B) @ W
            dr = Direct().factor(sparse.csc_array(matrix)).solve(-F.ravel())
        else:
            dr = _dense_step(A, B, W, F)
        dr = dr.reshape(F.shape)
        return dr, (W @ dr.ravel()).reshape(F.shape), 0


def _dense_step(A: Array, B: Array, W, F: Array) -> Array:
    """Solution of (A + B W) dr = -F; least squares when the matrix is singular."""
    nc, d = F.shape
    full = W.toarray() if sparse.issparse(W) else W
    matrix = (B @ full.reshape(nc, d, nc * d)).reshape(nc * d, nc * d)
    own = matrix.reshape(nc, d, nc, d)
    own[np.arange(nc), :, np.arange(nc), :] += A
    scale = np.abs(matrix).max(axis=1, keepdims=True)
    matrix, b = matrix / scale, -F.ravel() / scale[:, 0]
    try:
        dr = np.linalg.solve(matrix, b)
        if np.abs(matrix @ dr - b).max() <= 1e-6 * np.abs(b).max():
            return dr
    except np.linalg.LinAlgError:
        pass
    return np.linalg.lstsq(matrix, b, rcond=1e-12)[0]


@dataclass(frozen=True, eq=False)
class Augmented:
    """Newton equation of the global form, factorised whole: n + nc d unknowns in each step."""

    problem: FrictionProblem
    linear: LinearSolver

    def velocity(self, r: Array) -> tuple[Array, Array | None]:
        """(u, v) that r causes."""
        return self.problem.velocity(r)

    def step(self, A: Array, B: Array, F: Array, forcing: float) -> tuple[Array, Array, int]:
        """dr from [M, -H; B H^T, A]."""
        p = self.problem
        assert p.M is not None and p.H is not None
        coupling = block_diagonal(B) @ p.H.T
        matrix = sparse.block_array([[p.M, -p.H], [coupling, block_diagonal(A)]], format="csc")
        b = np.concatenate([np.zeros(p.unknowns), -F.ravel()])
        solution = self.linear.factor(matrix).solve(b)
        dv, dr = solution[: p.unknowns], solution[p.unknowns :]
        return dr.reshape(F.shape), (p.H.T @ dv).reshape(F.shape), 0


@dataclass(frozen=True, eq=False)
class SchurComplement:
    """Newton equation of the global form by GMRES on A + B W with one factor of M."""

    problem: FrictionProblem
    S: sparse.csr_array  # stiffness of the contact unknowns alone, (nc d, nc d)

    @classmethod
    def of(cls, problem: FrictionProblem) -> SchurComplement:
        """Prepare the preconditioner; the factor of M is the problem's own."""
        assert problem.M is not None and problem.H is not None
        H = sparse.csr_array(problem.H)
        d, nc = problem.dimension, problem.contacts
        gram = (H.T @ H).tobsr((d, d))
        rows = np.repeat(np.arange(nc), np.diff(gram.indptr))
        inverse = np.zeros((nc, d, d))
        own = rows == gram.indices
        inverse[rows[own]] = np.linalg.pinv(gram.data[own])
        E = H @ block_diagonal(inverse)  # exact where contacts share no unknown
        return cls(problem, sparse.csr_array(E.T @ problem.M @ E))

    def velocity(self, r: Array) -> tuple[Array, Array | None]:
        """(u, v) that r causes."""
        return self.problem.velocity(r)

    def apply(self, r: Array) -> Array:
        """W r, flat, by one solve with M."""
        p = self.problem
        assert p.H is not None
        return p.H.T @ p.solve_M(p.H @ r)

    def step(self, A: Array, B: Array, F: Array, forcing: float) -> tuple[Array, Array, int]:
        """GMRES to the relative tolerance `forcing`, preconditioned from the right."""
        D, E = block_diagonal(A), block_diagonal(B)
        try:
            local = Direct().factor(sparse.csc_array(D @ self.S + E))
        except SingularOperator as reason:
            raise Breakdown(f"preconditioner: {reason}") from reason
        count = 0
        images: list[tuple[Array, Array]] = []

        def operator(y: Array) -> Array:
            nonlocal count
            count += 1
            dr = self.S @ local.solve(y)
            Wdr = self.apply(dr)
            images.append((dr, Wdr))
            return D @ dr + E @ Wdr

        m = F.size
        matrix = sparse_linalg.LinearOperator((m, m), matvec=operator, dtype=float)
        y, _ = sparse_linalg.gmres(
            matrix, -F.ravel(), rtol=forcing, atol=0.0, restart=80, maxiter=3
        )
        dr = self.S @ local.solve(y)
        return dr.reshape(F.shape), self.apply(dr).reshape(F.shape), count
