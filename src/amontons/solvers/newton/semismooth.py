"""Semismooth Newton: exact generalised Jacobians, a line search, both forms.

With (F, A, B) of a complementarity function (`functions`):

    Delassus form   (A + B W) dr = -F
    global form     M dv - H dr = -(M v - H r - f),   A dr + B H^T dv = -F

The global form never forms W.  Either the whole system is factorised in each step
(Augmented), or M is factorised once and dr comes from GMRES on A + B W, a solve with M per
iteration (SchurComplement).  Its preconditioner replaces W by S^-1, S = E^T M E with
E = H (H^T H)^-1 the stiffness of the contact unknowns alone, which is sparse:
(A S + B) y = g, dr = S y.  The tolerance of GMRES follows the Newton residual ([EW]), so early
steps are cheap.

Merit function of the line search (`line_search`): |F / rho|, unit of u.  Where rho comes from:
`augmentation`.  Contacts that can not react (W_ii = 0) keep r = 0.

[ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017 (see `gauss_seidel`);
[QS] L. Qi, J. Sun, "A nonsmooth version of Newton's method", Math. Program. 58 (1993);
[EW] S. Eisenstat, H. Walker, "Choosing the forcing terms in an inexact Newton method",
SIAM J. Sci. Comput. 17 (1996).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, SingularOperator
from ...core.options import check_options
from ...linear import Direct, LinearSolver
from ...problem.friction import Form, FrictionProblem
from ...problem.nitsche import NitscheProblem
from ..augmentation import RhoStrategy, augmentation
from ..contract import Breakdown, Iterate, Target, check_positive
from ..driven import able_directions, driven_directions, sliding_rho
from .functions import AlartCurnier, ComplementarityFunction, Linearised, columns
from .line_search import LineSearch, NonMonotone
from .nitsche import newton_iterates
from .steps import Condensed, Linearisation, State, block_diagonal

Array = NDArray[np.float64]
FUNCTION_FLOPS, LINEARISE_FLOPS = 60.0, 200.0  # of F, and of F, A, B, per contact, about
FORCING = (1e-10, 0.1)  # smallest and largest relative tolerance of GMRES


@dataclass(frozen=True)
class SemismoothNewton:
    """Semismooth Newton with a line search, [ABD] eq. (11).

    linear: None takes the best for the form: LU of A + B W in the Delassus form,
    the Schur complement with one factor of M in the global form.  A LinearSolver given here
    factorises the whole system of the global form in each step.

    With Nitsche's method only linear and line_search count: function and rho are its own.

    The natural map and Fischer-Burmeister's function need one rho per contact, because
    Coulomb's cone is that of one norm; Alart-Curnier and Jean-Moreau take rho_N and rho_T.
    """

    solves: ClassVar[tuple[type, ...]] = (FrictionProblem, NitscheProblem)
    form: ClassVar[Form] = Form.ANY
    function: ComplementarityFunction = field(default_factory=AlartCurnier)
    linear: LinearSolver | None = None
    line_search: LineSearch = field(default_factory=NonMonotone)
    rho: float = 1.0  # augmentation parameter relative to what the strategy gives
    rho_strategy: RhoStrategy = RhoStrategy.PER_CONTACT

    def __post_init__(self) -> None:
        check_options(self)
        check_positive(rho=self.rho)
        if self.rho_strategy.splits and getattr(self.function, "one_rho", False):
            raise InvalidInput(
                f"{_words(self.function)} works on the whole cone and needs one "
                f"rho per contact, got {self.rho_strategy.value}; use per-contact or spectral, "
                "or the function AlartCurnier or JeanMoreau", ("rho_strategy",),
            )

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Newton steps from `start`; raises Breakdown when a step can not be computed."""
        if isinstance(problem, NitscheProblem):
            yield from newton_iterates(problem, start, self.line_search, self.linear)
            return
        system = self._linearise(problem)
        rho = augmentation(problem, self.rho_strategy, self.rho)
        law = _Residual(self.function, problem, rho)
        state = system.state(Iterate(law.admissible(start.r), start.v))
        state = replace(state, r=law.admissible(state.r))
        values: list[float] = []
        while True:
            state, count, flops = self._next(law, system, state, values)
            yield Iterate(state.r, state.v, linear_iterations=count, flops=flops)

    @np.errstate(over="ignore", invalid="ignore")  # steps without a line search may run away
    def _next(
        self, law: _Residual, system: Linearisation, state: State, values: list[float]
    ) -> tuple[State, int, float | None]:
        """The state after one step, its linear iterations and operations; appends to values."""
        law.evaluations = 0
        linearised = law.linearise(state)
        values.append(law.size(linearised[0]))
        forcing = FORCING[1]
        if len(values) > 1:  # [EW] choice 2
            ratio = min(values[-1] / max(values[-2], np.finfo(float).tiny), 1.0)
            forcing = float(np.clip(0.5 * ratio**2, *FORCING))
        if not np.isfinite(values[-1]):
            raise Breakdown("the iterates grow without bound")
        step, count = system.step(state, linearised, forcing)
        if not np.isfinite(step.r).all():
            raise Breakdown("the Newton step is not finite")
        merit = partial(_merit, law, state, step)
        state = state.moved(self.line_search.length(merit, values), step)
        each = LINEARISE_FLOPS + FUNCTION_FLOPS * law.evaluations
        flops = None if step.flops is None else step.flops + each * len(state.r)
        return state, count, flops

    def _linearise(self, problem: FrictionProblem) -> Linearisation:
        if problem.form is Form.DELASSUS:
            return Condensed(problem)
        if self.linear is not None:
            return Augmented(problem, self.linear)
        return SchurComplement.of(problem)


def _words(function: ComplementarityFunction) -> str:
    """Its name in a message."""
    return re.sub(r"(?<!^)(?=[A-Z])", " ", type(function).__name__).lower()


def _merit(law: _Residual, state: State, step: State, t: float) -> float:
    """|F / rho| after t times the step."""
    return law.size(law.evaluate(state.moved(t, step)))


class _Residual:
    """A complementarity function on one problem.

    Directions that can not react keep r = 0: contacts with W_ii = 0, and tangents that a
    support holds already at rest.  Those that it drives have a rho with which they slide.
    """

    def __init__(
        self, function: ComplementarityFunction, problem: FrictionProblem, rho: Array
    ) -> None:
        self.function, self.law, self.rho = function, problem.law, rho
        driven = driven_directions(problem)
        self.able, self.driven = able_directions(problem) | driven, np.any(driven, axis=1)
        self.now, self.evaluations = rho, 0
        self.rows = columns(rho, problem.dimension)
        self.blocked = (~self.able)[:, :, None] * np.eye(problem.dimension)

    def admissible(self, r: Array) -> Array:
        """r with zero in the directions that can not react."""
        return np.where(self.able, r, 0.0)

    def evaluate(self, state: State) -> Array:
        """F, (nc, d), unit of r."""
        self.evaluations += 1
        return self.admissible(self.function.residual(state.r, state.u, self.law, self.now))

    def linearise(self, state: State) -> Linearised:
        """(F, A, B), with rows A = 1 and B = 0 in directions that can not react."""
        self.now = self._sliding(state)
        F, A, B = self.function.linearise(state.r, state.u, self.law, self.now)
        able = self.able[:, :, None]
        return self.admissible(F), A * able + self.blocked, B * able

    def _sliding(self, state: State) -> Array:
        """rho, (nc,) or (nc, 2), for the next step: driven contacts slide with it."""
        if not self.driven.any():
            return self.rho
        normal, tangent = columns(self.rho, 2).T if self.rho.ndim == 2 else (self.rho,) * 2
        pressed = state.r.copy()
        pressed[:, 0] = np.maximum(state.r[:, 0], state.r[:, 0] - normal * state.u[:, 0])
        bound = np.maximum(self.law.bound(pressed), 0.0)
        tangent = sliding_rho(tangent, self.driven, bound, state.u)
        if getattr(self.function, "one_rho", False):
            return tangent
        return np.column_stack([normal, tangent])

    def size(self, F: Array) -> float:
        """|F / rho|, unit of u."""
        return float(np.linalg.norm(F / self.rows))


@dataclass(frozen=True, eq=False)
class Augmented:
    """Newton equation of the global form, factorised whole: n + nc d unknowns in each step."""

    problem: FrictionProblem
    linear: LinearSolver

    def state(self, start: Iterate) -> State:
        """r and v of the start; where there is none, of the contacts bonded by springs.

        M may be singular here, and Newton from r = 0 would have a singular matrix too.
        """
        p = self.problem
        if start.v is not None:
            return State(start.r, p.local_velocity(start.v), start.v)
        assert p.M is not None and p.H is not None and p.f is not None and p.w is not None
        spring = abs(p.H).T @ p.M.diagonal()
        bonded = (
            p.M + p.H @ sparse.dia_array((spring[None], 0), shape=2 * (spring.size,)) @ p.H.T
        )
        factor = self.linear.factor(sparse.csc_array(bonded))
        v = factor.solve(p.f - p.H @ (spring * p.w.ravel()))
        u = p.local_velocity(v)
        return State(-spring.reshape(u.shape) * u, u, v)

    def step(self, state: State, linearised: Linearised, forcing: float) -> tuple[State, int]:
        """The whole step from [M, -H; B H^T, A]."""
        F, A, B = linearised
        p = self.problem
        assert p.M is not None and p.H is not None and p.f is not None and state.v is not None
        coupling = block_diagonal(B) @ p.H.T
        rows = [[p.M, -p.H], [coupling, block_diagonal(A)]]
        matrix: Any = sparse.block_array(rows, format="csc")
        balance = p.f + p.H @ state.r.ravel() - p.M @ state.v
        factor = self.linear.factor(matrix)
        solution = factor.solve(np.concatenate([balance, -F.ravel()]))
        dv, dr = solution[: p.unknowns], solution[p.unknowns :]
        flops = getattr(factor, "flops", None)
        return State(dr.reshape(F.shape), (p.H.T @ dv).reshape(F.shape), dv, flops), 0


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
        S = sparse.csr_array(E.T @ problem.M @ E)
        held = (S.diagonal() == 0).astype(float)  # directions that a support holds already
        return cls(problem, sparse.csr_array(S + sparse.diags_array(held)))

    def state(self, start: Iterate) -> State:
        """r of the start and its velocities."""
        return State(start.r, *self.problem.velocity(start.r))

    def response(self, r: Array) -> tuple[Array, Array]:
        """(W r flat, M^-1 H r) by one solve with M."""
        p = self.problem
        assert p.H is not None
        v = p.solve_M(p.H @ r)
        return p.H.T @ v, v

    def step(self, state: State, linearised: Linearised, forcing: float) -> tuple[State, int]:
        """GMRES to the relative tolerance `forcing`, preconditioned from the right."""
        from scipy.sparse import linalg as sparse_linalg

        F, A, B = linearised
        D, E = block_diagonal(A), block_diagonal(B)
        try:
            local = Direct().factor(sparse.csc_array(D @ self.S + E))
        except SingularOperator as reason:
            raise Breakdown(f"preconditioner: {reason}") from reason
        count = 0

        def operator(y: Array) -> Array:
            nonlocal count
            count += 1
            dr = self.S @ local.solve(y)
            return D @ dr + E @ self.response(dr)[0]

        matrix = sparse_linalg.LinearOperator((F.size, F.size), matvec=operator, dtype=float)
        y, _ = sparse_linalg.gmres(
            matrix, -F.ravel(), rtol=forcing, atol=0.0, restart=80, maxiter=3
        )
        dr = self.S @ local.solve(y)
        du, dv = self.response(dr)
        return State(dr.reshape(F.shape), du.reshape(F.shape), dv), count
