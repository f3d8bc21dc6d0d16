"""The least load at which a motion can begin, relaxed to a linear program: a lower bound.

Every product of an equation of (1) of `begins` in y = (r, x, 1) with w, and of an inequality in
y with u_N >= 0, is linear in V = y w^T, as are r_N u_N = 0 and |mu r_N u_T| <= -r_T u_T.  So
are x = sum live_j V_xj and all of y, as live.w = 1.  The least x over all V, products or not,
is a linear program ([SA], first level), and no more than the least x of (1).

`signed` adds the slip of faces by directions, u_T = a - b with a, b >= 0, to w as columns
of V.  Then the inequalities in y are multiplied with them as well, and

    (r_T + mu r_N) a = 0,   (r_T - mu r_N) b = 0

say what |.| says above.  Contacts may be decided beforehand: closed, u_N = 0, or open, r_N = 0;
a face slips one way only, a = 0 or b = 0; each times everything.

All rows but live.w = 1 are homogeneous.  That one reads live.w + t = 1 with a cost of `most` t,
t >= 0, so that there always is a least value, `most` where the rest has no solution below.  Its
multipliers are the proof: their combination of the rows leaves nothing but the bound.

The forces of a straight face, whose contacts all have the same tangential motion, are its
normal forces and one tangential force, of at most mu times their sum.

[SA] H. D. Sherali, W. P. Adams, SIAM J. Discrete Math. 3 (1990) 411-430.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline

if TYPE_CHECKING:
    from .begins import Assembly

Array = NDArray[np.float64]
BELOW = 1e-6  # part of a bound that the tolerances of programs may be worth
RESIDUAL = 1e-6  # that multipliers may leave of the rows that they combine
WORK = 2200.0  # operations per square of the unknowns, measured


class Decided(Enum):
    """What a contact or face was decided to do."""

    CLOSED = "closed"
    OPEN = "open"
    FORWARD = "slips forward, or not"
    BACKWARD = "slips backward, or not"


Decision = tuple[Decided, int]  # of a contact, or of a face


@dataclass(frozen=True, eq=False)
class Bounded:
    """A bound with the residual of its multipliers; what the program has for motion and forces.

    value: no state below it; 0 where the program failed.  motion (n,), slip (faces, 2) either
    way, normal (nc,), opening (nc,); None where nothing lies below `most`.
    """

    value: float
    residual: float
    motion: Array | None = None
    slip: Array | None = None
    normal: Array | None = None
    opening: Array | None = None


class Relaxation:
    """The program in V, row by row: y = (N of contacts, T of faces, x, 1)."""

    def __init__(self, blocks: Assembly, *, signed: bool) -> None:
        G, mu = blocks.dense, blocks.mu
        owner, nf = blocks.faces
        nc, n = len(mu), len(G)
        first = np.array([np.flatnonzero(owner == f)[0] for f in range(nf)], dtype=int)
        self.signed, self.n, self.nc, self.nf = signed, n, nc, nf
        self.rows, self.columns = nc + nf + 2, n + nf * signed
        self.opening = self._wide(G[:, ::2].T)  # u_N of w
        self.sliding = self._wide(G[:, 1::2].T[first])  # u_T of faces
        self.live = self._wide(blocks.live[None])
        balance = np.column_stack([G[:, ::2], G[:, 1::2][:, first], blocks.live, blocks.dead])
        self.balance = sparse.csr_array(balance)
        self.normal = sparse.csr_array(sparse.eye_array(nc, self.rows))
        self.force = sparse.csr_array(
            (mu, (owner, np.arange(nc))), shape=(nf, self.rows)
        )  # mu sum N of faces
        self.shear = sparse.csr_array(
            (np.ones(nf), (np.arange(nf), nc + np.arange(nf))), shape=(nf, self.rows)
        )
        self.x, self.one = (sparse.csr_array(sparse.eye_array(1, self.rows, k=self.rows - k))
                            for k in (2, 1))  # fmt: skip

    def _wide(self, rows: Array) -> sparse.csr_array:
        """Rows in w as rows in all columns of V."""
        nothing = sparse.csr_array((len(rows), self.columns - self.n))
        return sparse.csr_array(sparse.hstack([sparse.csr_array(rows), nothing]))

    @property
    def unknowns(self) -> int:
        """Entries of V."""
        return self.rows * self.columns

    @cached_property
    def ways(self) -> tuple[sparse.csr_array, sparse.csr_array]:
        """(a, b) of faces as rows in the columns of V."""
        forward = sparse.csr_array(sparse.eye_array(self.nf, self.columns, k=self.n))
        return forward, sparse.csr_array(forward - self.sliding)

    def program(self, most: float) -> tuple[Array, Any, Any, Array]:
        """(c, A of A V <= 0, E of E V = e, e) for x from 0 to most; V flat."""
        inside = sparse.vstack([self.normal, self.force + self.shear, self.force - self.shear,
                                self.x, most * self.one - self.x])  # fmt: skip
        apart = [_each(self.normal, self.opening)]  # r_N u_N = 0
        times = self.opening
        if self.signed:
            forward, backward = self.ways
            times = sparse.vstack([times, forward, backward, self.live])
            apart += [_each(self.force + self.shear, forward),
                      _each(self.force - self.shear, backward)]  # fmt: skip
        A = [-sparse.kron(inside, times)]
        if not self.signed:  # T u_T + mu N |u_T| <= 0
            A += [_each(self.shear + sign * self.force, self.sliding) for sign in (1.0, -1.0)]
        E = sparse.vstack([
            sparse.kron(self.balance, sparse.eye_array(self.columns)), *apart,
            sparse.kron(self.one, self.live),
        ], format="csr")  # fmt: skip
        e = np.zeros(E.shape[0])
        e[-1] = 1.0
        c = sparse.kron(self.x, self.live).toarray().ravel()
        return c, sparse.vstack(A, format="csr"), E, e

    def _decided(self, decision: Decision) -> Any:
        """Rows that are zero where a contact or, with directions of slip, a face is decided."""
        kind, k = decision
        if kind is Decided.OPEN:
            return sparse.kron(self.normal[[k]], sparse.eye_array(self.columns))
        if kind is Decided.CLOSED:
            row = self.opening
        else:
            assert self.signed  # else V has no columns for directions
            forward, backward = self.ways
            row = backward if kind is Decided.FORWARD else forward
        return sparse.kron(sparse.eye_array(self.rows), row[[k]])

    def bound(
        self, most: float, deadline: Deadline, decided: Sequence[Decision] = ()
    ) -> Bounded:
        """What bounds all states with x <= most, and decisions; raises TimeUp beforehand."""
        from scipy.optimize import linprog

        deadline.pay(WORK * float(self.unknowns) ** 2)
        c, A, E, e = self.program(most)
        if decided:
            E = sparse.vstack([*map(self._decided, decided), E], format="csr")
            e = np.concatenate([np.zeros(E.shape[0] - len(e)), e])
        c = np.append(c, most)  # of t
        A = sparse.hstack([A, sparse.csr_array((A.shape[0], 1))], format="csr")
        t = sparse.csr_array(e[:, None])
        E = sparse.hstack([E, t], format="csr")
        free = np.full((len(c), 2), [-np.inf, np.inf])
        free[-1, 0] = 0.0
        limit = {} if deadline.work is not None else {"time_limit": max(deadline.left, 0.1)}
        found = linprog(c, A, np.zeros(A.shape[0]), E, e, free, method="highs-ipm",
                        options=limit)  # fmt: skip
        if found.status != 0:
            return Bounded(0.0, 0.0)
        # multipliers of equations and, at most zero, of inequalities: the proof
        y = np.asarray(found.eqlin.marginals)
        z = np.minimum(np.asarray(found.ineqlin.marginals), 0.0)
        left = c - E.T @ y - A.T @ z
        left[-1] = min(left[-1], 0.0)  # t >= 0
        residual = float(np.abs(left).max()) / float(np.abs(c).max())
        value = float(e @ y) * (1 - BELOW) if residual <= RESIDUAL else 0.0
        return self._answer(value, residual, np.asarray(found.x))

    def _answer(self, value: float, residual: float, x: Array) -> Bounded:
        """With the motion and forces of a solution x = (V, t)."""
        V, part = x[:-1].reshape(self.rows, self.columns), 1.0 - x[-1]
        if not part > BELOW:
            return Bounded(value, residual)
        w = V[-1] / part
        slip = np.column_stack([row @ w for row in self.ways]) if self.signed else None
        normal = (V @ self.live.toarray()[0])[: self.nc] / part
        return Bounded(value, residual, w[: self.n], slip, normal, self.opening @ w)


def _each(left: sparse.csr_array, right: sparse.csr_array) -> Any:
    """Rows left_k V right_k, for every k."""
    return sparse.vstack([sparse.kron(left[[k]], right[[k]]) for k in range(left.shape[0])])
