"""Contact without friction by an interior point, also where contact alone holds bodies.

    M v = f + H_N p,   s = H_N^T v + w_N >= 0,   p >= 0,   s_i p_i = 0                       (1)

are the conditions of a convex quadratic program.  Bodies that nothing but friction would hold
in some direction make M singular there, with all contacts: its solutions are a set that has no
end, and methods that need one solution, or the right contacts, wander.  A predictor-corrector
step [M] solves

    (M + H_N D H_N^T + e diag M) dv = -r_d + H_N (c / s - D r_p),   D = p / s,

r_d and r_p what (1) leaves, c the change of s p that is wanted: one sparse, definite matrix,
which needs the e only where neither bodies nor contacts resist.  As r_d is taken from the
iterate itself, e slows steps down and does not change what they tend to.

[M] S. Mehrotra, "On the implementation of a primal-dual interior point method", SIAM J. Optim.
2 (1992) 575-601.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline
from ...core.errors import SingularOperator
from ...linear.direct import Direct
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Coulomb
from ..contract import Breakdown, Iterate, Target

Array = NDArray[np.float64]
STEPS = 80
BOUNDARY = 0.995  # part of the way to p = 0 or s = 0 that a step goes
HELD = 1e-8  # e, share of the diagonal of M
BALANCE, GAPS, CLOSED = 1e-11, 1e-9, 1e-9  # what r_d, r_p and s.p may be, relative, at the end
FILL = 60.0  # operations of a factor per entry of M and root of the unknowns, roughly


@dataclass(frozen=True)
class FrictionlessInteriorPoint:
    """Interior point on M v = f + H_N p, 0 <= p, 0 <= H_N^T v + w_N: contact without friction.

    M may be singular, bodies held by contact alone.  It begins at a point of its own; a problem
    with friction or without a load f ends with the outcome BREAKDOWN.  Source: [M], Mehrotra.
    """

    form: ClassVar[Form] = Form.GLOBAL

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """A step each, until (1) holds to rounding or STEPS are done."""
        if not has_no_friction(problem):
            raise Breakdown("there is friction: this method is for mu = 0 at every contact")
        program = _Program.of(problem)
        if not program.load > 0:
            raise Breakdown("there is no load f")
        r = np.zeros((problem.contacts, problem.dimension))
        for v, p, _ in program.iterates(target.deadline):
            if not (np.isfinite(p).all() and np.isfinite(v).all()):
                raise Breakdown("its steps are no longer finite")
            r[:, 0] = p
            yield Iterate(r.copy(), v, stage="interior point without friction")


def has_no_friction(problem: FrictionProblem) -> bool:
    """Whether it has contacts and all are Coulomb's with mu = 0."""
    law = problem.law
    return isinstance(law, Coulomb) and problem.contacts > 0 and not law.mu.any()


@dataclass(frozen=True, eq=False)
class Frictionless:
    """Pressures p (nc,) >= 0 and motion v (n,); balance: |M v - f - H_N p| / |f| left."""

    p: Array
    v: Array
    balance: float


def without_friction(problem: FrictionProblem, deadline: Deadline) -> Frictionless | None:
    """(1) of a problem in global form: a solution, or the last iterate; `balance` tells.

    Where there is no solution (no pressures balance the load, say) that leaves much of the
    balance.  None without contacts or a load f, and where a matrix is singular.  Raises TimeUp.
    """
    if not problem.contacts:
        return None
    program = _Program.of(problem)
    if not program.load > 0:
        return None
    try:
        *_, last = program.iterates(deadline)
    except SingularOperator:
        return None
    v, p, _ = last
    return Frictionless(p, v, program.balance(last)) if np.isfinite(p).all() else None


_Iterate = tuple[Array, Array, Array]  # v, p, s


@dataclass(frozen=True, eq=False)
class _Program:
    """The matrices and vectors of (1); H (n, nc) of normal directions."""

    M: sparse.csc_array
    H: sparse.csc_array
    f: Array
    w: Array
    held: Array

    @classmethod
    def of(cls, problem: FrictionProblem) -> _Program:
        """Those of a problem."""
        whole = problem.assembled()
        assert whole.f is not None and whole.w is not None
        M, H = sparse.csc_array(whole.M), sparse.csc_array(whole.H)
        diagonal = M.diagonal()
        held = HELD * np.where(diagonal > 0, diagonal, float(diagonal.max(initial=0.0)))
        return cls(M, H[:, :: whole.dimension], whole.f, whole.w[:, 0], held)

    def iterates(self, deadline: Deadline = NEVER) -> Iterator[_Iterate]:
        """The first point and the steps from there, until one solves (1); pays the deadline."""
        n = self.M.shape[0]
        cost = FILL * float(self.M.nnz) * float(n) ** 0.5
        deadline.pay(cost)
        at = self.first()
        yield at
        for _ in range(STEPS):
            if self.is_solved(at):
                return
            deadline.pay(cost)
            at = self.stepped(at)
            yield at

    @property
    def load(self) -> float:
        """|f|."""
        return float(np.linalg.norm(self.f))

    def balance(self, at: _Iterate) -> float:
        """|r_d| over |f|."""
        v, p, _ = at
        return float(np.linalg.norm(self.M @ v - self.f - self.H @ p)) / self.load

    def first(self) -> _Iterate:
        """Contacts as springs that pull as well, then p and s made positive."""
        stiffness = self._stiffness()
        solve = self._factor(stiffness)
        v = solve(self.f - self.H @ (stiffness * self.w))
        u = self.H.T @ v + self.w
        p = stiffness * np.abs(u)
        even = float(p.mean()) or 1.0
        return v, p + even, np.abs(u) + even / stiffness

    def _stiffness(self) -> Array:
        """Of the bodies at every contact, by the diagonal of M, (nc,)."""
        soft = self.H.power(2).T @ (HELD / self.held)
        return 1.0 / np.where(soft > 0, soft, float(soft.max(initial=0.0)) or 1.0)

    def _factor(self, D: Array) -> Any:
        whole = self.M + self.H @ sparse.diags_array(D) @ self.H.T
        whole = whole + sparse.diags_array(self.held)
        return Direct().factor(sparse.csc_array(whole)).solve

    def is_solved(self, at: _Iterate) -> bool:
        """Whether (1) holds to what is asked."""
        v, p, s = at
        u = self.H.T @ v + self.w
        size = float(np.abs(s).max(initial=0.0))
        power = abs(float(self.f @ v)) + float(v @ (self.M @ v)) + float(p @ np.abs(self.w))
        return (self.balance(at) <= BALANCE and float(np.abs(u - s).max()) <= GAPS * size
                and float(s @ p) <= CLOSED * power)  # fmt: skip

    def stepped(self, at: _Iterate) -> _Iterate:
        """The next iterate."""
        v, p, s = at
        left = self.M @ v - self.f - self.H @ p
        miss = self.H.T @ v + self.w - s
        D = p / s
        solve = self._factor(D)

        def way(change: Array) -> _Iterate:
            dv = solve(-left + self.H @ (change / s - D * miss))
            ds = self.H.T @ dv + miss
            return dv, (change - p * ds) / s, ds

        gap = float(s @ p) / len(p)
        _, dp, ds = way(-s * p)
        far = min(_room(p, dp), _room(s, ds))
        after = float((p + far * dp) @ (s + far * ds)) / len(p)
        wanted = (after / gap) ** 3 * gap
        dv, dp, ds = way(wanted - s * p - dp * ds)
        far = min(1.0, BOUNDARY * min(_room(p, dp), _room(s, ds)))
        return v + far * dv, p + far * dp, s + far * ds


def _room(x: Array, dx: Array) -> float:
    """The largest t <= 1 / BOUNDARY with x + t dx >= 0."""
    falls = dx < 0
    return float(min((-x[falls] / dx[falls]).min(initial=np.inf), 1.0 / BOUNDARY))
