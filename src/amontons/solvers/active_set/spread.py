"""Primal-dual active sets with matrix, vectors and contacts spread over processes of MPI.

The semismooth Newton method of [HSW] section 7 in the basis in which a contact sees one node
only, and in its frame: unknowns of that node are y = u - w, its rows of K y - f are r.  With
the conditions G_r r + G_u u = b of a step (`conditions`), and d the next change of y,

    y_D := w-shifted values where u is given (G_r = 0),     (K d)_i = f_i - (K y)_i elsewhere,
    G_r (K d) + G_u d = b - G_r r - G_u u                   in rows of contacts,

a law at a node needs nothing of another process.  Sticking contacts have u_T = 0, the limit of
(7.2).  The first step leaves all contacts open: its u is the scale of the judge's law.  Steps
are solved as exactly as they deserve: loosely while sets change, by the square of the error
after that.  Every decision is made of numbers that all processes have summed up together.

[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.distributed import Sliding, SpreadMatrix
from ...problem.judge.measures import ratio, residual_sizes
from ...problem.law import Law
from ...problem.law.law import TRESCA
from .conditions import Conditions, Modification, Settings, conditions, newton_conditions

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
LOOSE = 0.03  # reduction of the linear residual while sets change
LAGS_AFTER = 14  # steps after which the bound of friction lags behind, [HSW] Algorithm 2
MOST_STEPS = 60
MOST_IDLE = 15  # steps without a smaller error
SAFETY = 0.3  # of the tolerance: what a last linear solve aims at


@dataclass(frozen=True, eq=False)
class OwnContacts:
    """Contacts (k,) whose slave node this process has.

    dofs (k, d): own numbers of the unknowns of the slave, in the order of the local frame;
    gap (k,): of the undeformed sides; able (k, d): directions that no support holds.
    """

    dofs: Index
    gap: Array
    law: Law
    able: Mask


@dataclass(frozen=True, eq=False)
class SpreadProblem:
    """One process's part: f, y (own,) in the basis, y what supports prescribe, else 0.

    fixed (own,): directions that supports hold.
    """

    K: SpreadMatrix
    f: Array
    y: Array
    fixed: Mask
    contacts: OwnContacts


@dataclass(frozen=True, eq=False)
class SpreadSolution:
    """y (own,); r, u (k, d) of own contacts, r within its law; error as of the judge.

    closed, sliding (k,); steps: of Newton; why: in words how it has ended.
    """

    y: Array
    r: Array
    u: Array
    closed: Mask
    sliding: Mask
    error: float
    converged: bool
    steps: int
    why: str


@dataclass(frozen=True, eq=False)
class _State:
    """y, what is missing to balance K y - f (own,), r and u (k, d) of the contacts."""

    y: Array
    rest: Array
    r: Array
    u: Array


class SpreadActiveSet:
    """The steps of one solve; all processes call `solve`."""

    def __init__(self, problem: SpreadProblem) -> None:
        self.p, self.K, self.contacts = problem, problem.K, problem.contacts
        own, able = self.contacts, self.contacts.able
        block = self.K.blocks(own.dofs)
        both = able[:, :, None] & able[:, None, :]
        d = able.shape[1]
        block = np.where(both, block, np.eye(d) * (~able)[:, :, None])
        compliance = np.where(both, np.linalg.inv(block), 0.0)
        self.rho = 1 / np.linalg.norm(compliance, 2, axis=(1, 2))
        self.block = block
        diagonal = np.diagonal(block, axis1=1, axis2=2)
        count = able[:, 1:].sum(axis=1)
        tangential = np.where(able[:, 1:], diagonal[:, 1:], 0.0).sum(axis=1)
        c_t = np.where(count > 0, tangential / np.maximum(count, 1), diagonal[:, 0])
        self.settings = Settings(diagonal[:, 0], c_t, Modification.FIRST, tied=own.law.tied)
        self.is_contact = np.zeros(len(problem.fixed), dtype=bool)
        self.is_contact[own.dofs] = True
        self.tresca = bool(self.K.total(int((own.law.kind == TRESCA).sum())))
        self.count = int(self.K.total(len(own.gap)))

    # ------------------------------------------------------------------ the solve
    def solve(self, tolerance: float) -> SpreadSolution:
        """Steps until the judge's error is below the tolerance, or nothing gets better."""
        state, self.load = self._first()
        best, least, why, idle, step = state, np.inf, "", 0, 0
        self.u_size, sets, error = 0.0, None, np.inf
        while True:
            if step:
                error = self.error(state)
                if error < least:
                    best, least, idle = state, error, 0
                else:
                    idle += 1
                if error <= tolerance:
                    break
            if step >= MOST_STEPS or idle >= MOST_IDLE:
                why = f"{step} Newton steps, {idle} of them without a smaller error"
                break
            given = self._conditions(state, step)
            now = self._given_directions(given)
            same = sets is not None and self._all(bool((now == sets).all()))
            sets, part = now, self._exactness(error, tolerance, same, given)
            try:
                state = self._step(state, given, now, part)
            except SingularOperator as reason:
                if not step:
                    raise
                why = f"a linear problem of Newton's method: {reason}"
                break
            step += 1
            if step == 1:
                self.u_size = self._norm(state.u.ravel())
        return self._solution(best, least, least <= tolerance, step, why)

    def _first(self) -> tuple[_State, float]:
        """The undeformed state, and the size of the load, overlaps included."""
        p, own = self.p, self.contacts
        state = self._state(p.y)
        overlap = np.zeros_like(p.y)
        overlap[own.dofs[:, 0]] = np.minimum(own.gap, 0.0)
        pushed = self.K.times(overlap)
        free = ~p.fixed
        return state, float(np.hypot(self._norm(state.rest[free]), self._norm(pushed[free])))

    def _state(self, y: Array) -> _State:
        """Forces and motions of y."""
        own = self.contacts
        rest = self.p.f - self.K.times(y)
        u = y[own.dofs]
        u[:, 0] += own.gap
        r = np.where(own.able, -rest[own.dofs], 0.0)
        return _State(y, rest, r, u)

    def error(self, state: _State) -> float:
        """The judge's residual measure, the same number on all processes."""
        missing = self._norm(state.rest[~self.p.fixed & ~self.is_contact])
        law = self._norm(residual_sizes(state.r, state.u, self.contacts.law, self.rho))
        error = max(ratio(missing, self.load), ratio(law, self.u_size))
        return float(error) if np.isfinite(error) else np.inf

    def _norm(self, values: Array) -> float:
        """Euclidean norm over all processes."""
        return float(np.sqrt(self.K.total(float(values @ values))))

    def _all(self, mine: bool) -> bool:
        """Whether all processes say so."""
        return not self.K.total(int(not mine))

    # ------------------------------------------------------------------ one step
    def _conditions(self, state: _State, step: int) -> Conditions:
        law, d = self.contacts.law, state.r.shape[1]
        if not step:  # all open
            G_r = np.tile(np.eye(d), (len(law), 1, 1))
            none, nan = np.zeros(len(law), dtype=bool), np.full(len(law), np.nan)
            return Conditions(G_r, 0 * G_r, np.zeros(state.r.shape), none, ~none, nan, nan)
        if self.tresca or step > LAGS_AFTER:
            return conditions(state.r, state.u, law.bound(state.r), False, self.settings)
        given = newton_conditions(state.r, state.u, law, self.settings)
        stick = given.normal & ~given.tangential
        given.G_r[stick, 1:, 0] = 0.0
        given.b[stick, 1:] = 0.0
        return given

    def _given_directions(self, given: Conditions) -> Mask:
        """Directions (k, d) of contacts whose motion is given, by supports or conditions."""
        return (np.einsum("kii->ki", given.G_r) == 0) | ~self.contacts.able

    def _exactness(
        self, error: float, tolerance: float, same: bool, given: Conditions
    ) -> float:
        """The reduction of the linear residual that a step is worth."""
        if not self.count:
            return max(SAFETY * tolerance, 1e-14)
        if not same:
            return LOOSE
        slides = np.any(given.G_u[:, 1:, 1:], axis=(1, 2)) & given.normal
        last = SAFETY * tolerance / error
        curved = self.K.total(int(slides.sum())) > 0
        return float(np.clip(max(last, error) if curved else last, 1e-14, LOOSE))

    def _step(self, state: _State, given: Conditions, now: Mask, part: float) -> _State:
        """The next state: what is given at once, the rest by one linear solve."""
        own, y = self.contacts, state.y.copy()
        y[own.dofs] -= np.where(now & own.able, state.u, 0.0)
        held = self.p.fixed.copy()
        held[own.dofs] |= now
        d = now.shape[1]
        plain = (given.G_r == np.eye(d)).all(axis=2) & ~given.G_u.any(axis=2)
        wanted = ~now & ~plain
        some = wanted.any(axis=1)
        given = self._scaled(given, wanted)
        self.K.hold(held, Sliding(own.dofs[some], wanted[some], given.G_r[some],
                                  given.G_u[some]))  # fmt: skip
        moved = self._state(y)
        b = moved.rest.copy()
        asked = given.b - np.einsum("kij,kj->ki", given.G_r, moved.r)
        asked -= np.einsum("kij,kj->ki", given.G_u, moved.u)
        b[own.dofs] = asked
        b[held] = 0.0
        return self._state(y + self.K.solve(b, part))

    def _scaled(self, given: Conditions, wanted: Mask) -> Conditions:
        """The same conditions, in rows whose blocks on the diagonal are diag K.

        A contact that hardly slides has a large G_u, which no smoother of K bears.
        """
        both = wanted[:, :, None] & wanted[:, None, :]
        d = wanted.shape[1]
        block = np.einsum("kij,kjl->kil", given.G_r, self.block) + given.G_u
        others = np.eye(d) * (~wanted)[:, :, None]
        inverse = np.linalg.inv(np.where(both, block, others))
        diagonal = np.diagonal(self.block, axis1=1, axis2=2)
        scale = np.where(both, inverse * diagonal[:, :, None], others)
        G_r, G_u = (np.einsum("kij,kjl->kil", scale, G) for G in (given.G_r, given.G_u))
        return replace(given, G_r=G_r, G_u=G_u, b=np.einsum("kij,kj->ki", scale, given.b))

    def _solution(
        self, state: _State, error: float, converged: bool, steps: int, why: str
    ) -> SpreadSolution:
        own = self.contacts
        x = state.r - self.rho[:, None] * state.u
        r = np.where(own.able, own.law.augmented_reaction(x), 0.0)
        closed, sliding = own.law.regions(state.r, state.u, self.rho)
        closed = closed & ((r[:, 0] > 0) | own.law.tied)
        words = why or f"error {error:.1e} <= tolerance after {steps} Newton steps"
        return SpreadSolution(
            state.y, r, state.u, closed, sliding & closed, error, converged, steps, words
        )
