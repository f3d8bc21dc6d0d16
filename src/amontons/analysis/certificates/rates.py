"""Can a body jump from a state of slow loading?  Uniqueness of the rates of all contacts.

Where loads change a little, so do motion and reactions, unless there are no such rates, or
several.  In a state with reactions r let primes be rates, u' = W r' + q', and per contact

    open       r' = 0                         sticks inside of its cone      u' = 0
    on its cone, t = -r_T / |r_T|:            u_N' = 0,  u_T' = l t,  l >= 0,
                                              f = mu r_N' + t.r_T' >= 0,  l f = 0         (1)
    grazes (r = 0, u_N = 0)                   Coulomb's law for r', u'                    (2)

so only contacts on their cones and grazing ones are in doubt: what is open or stuck is
eliminated by a Schur complement, and so are the reactions that hold u_N' and u_T' across t at
those on their cones.  What is left is y = D x + b with x = (l, r') and y = (f, u').  In 2D, and
in 3D without grazing contacts, it consists of linear pieces, and has exactly one solution for
all b just where all of them have the orientation of l = r' = 0 (without grazing contacts: where
all principal minors of D are positive, K. G. Murty, "Linear Complementarity, Linear and
Nonlinear Programming" (1988), theorem 3.13; `exact_threshold`): decided both ways where pieces
are not too many.  Sufficient for any number, in 2D and 3D, is that the form of two solutions,
which by (1) and (2) obey df dl <= 0 and, for any tau, sigma, alpha > 0,

    tau dr_N du_N + sigma dr_T.du_T <= mu sigma / 2 (alpha dr_N^2 + |du_T|^2 / alpha)     (3)

(`contact_multipliers`), is positive definite; tried with one set of multipliers, in variables
for which D has a unit diagonal, to rounding.  Existence follows as in these theorems.

Every b is asked for: some change of loads and supports, not the one that comes.  With the
reactions of the last step the pieces of the law between both states are all asked at once: (2)
for a contact that was open at one end alone, (1) for one that was on its cone at one of them.
As long as no other contact changes in between, there is no jump on the way; in 3D what slides
is taken to keep its direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import expect_shape, finite, number
from ...core.clock import TimeLimit, deadline_of
from ...core.errors import InvalidInput, UnsupportedLaw, shown
from ...core.faces import Told
from ...problem.friction import FrictionProblem
from ...problem.law import Coulomb
from ...problem.solution import FrictionSolution
from ..scaled import Scaled

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
ON = 1e-7  # distance to a border of the law that counts as none, of the largest reaction
PIECES = 2**14  # up to so many all are looked at
ROUNDING = 1e-11  # of a determinant relative to its rows, that may have either sign
MARGIN = 1e-9  # of an eigenvalue of unit diagonal that counts as positive; of a condition
ALPHAS = (1.0, 0.5, 2.0, 0.25, 4.0)  # tried in (3)
SECONDS = 60.0  # whose work W and the elimination may take


class RateVerdict(Enum):
    """Whether a body can jump from a state."""

    IMPOSSIBLE = "no jump"
    POSSIBLE = "a jump is possible"
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False, repr=False)
class Rates(Told):
    """Whether every small change of the loads has exactly one answer.

    sliding, grazing, sticking, open: numbers of the contacts that are on their cones, touch
    without reaction (or have opened or closed since the last step), stick inside of their
    cones, are apart; the first two alone are in doubt.
    D (m, m): of the module, x = (l, r' of grazing contacts, normals first).  margin: least
    eigenvalue of the form, of unit diagonal, where that decides, else 0.
    """

    verdict: RateVerdict
    reason: str
    sliding: Indices
    grazing: Indices
    sticking: Indices
    open: Indices
    D: Array
    margin: float = 0.0

    @property
    def jump_possible(self) -> bool | None:
        """False where a jump is excluded, None where that is not known."""
        known = {RateVerdict.IMPOSSIBLE: False, RateVerdict.POSSIBLE: True}
        return known.get(self.verdict)

    @property
    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "verdict": self.verdict.value, "jump_possible": self.jump_possible,
            "reason": self.reason, "sliding": self.sliding.tolist(),
            "grazing": self.grazing.tolist(), "margin": self.margin,
        }  # fmt: skip

    def __str__(self) -> str:
        doubt = f"{len(self.sliding)} on their cones, {len(self.grazing)} grazing or changing"
        return f"{self.verdict.value}: {self.reason} ({doubt})"


def rates(
    problem: FrictionProblem, solution: FrictionSolution, last: Array | None = None, *,
    tolerance: float = ON, time_limit: TimeLimit = None,
) -> Rates:  # fmt: skip
    """Whether the rates at a solution are unique for every change of the loads, see the module.

    problem, solution: of a quasi-static step (`step.problem`, `step.solution`) or of one load.
    last (nc, d): reactions of the step before, for all that is between both.
    tolerance: distance to a border of the law that counts as none, relative to the largest
    scaled reaction.  time_limit: seconds for W, by default the work of about a minute.  Raises
    UnsupportedLaw unless the law is Coulomb's, InvalidInput for a solution of another problem,
    SingularOperator where contact alone holds a body.
    """
    if not isinstance(problem, FrictionProblem):
        raise InvalidInput(f"problem: expected a FrictionProblem, got {shown(problem)}")
    if not hasattr(solution, "r"):
        raise InvalidInput(f"solution: expected a FrictionSolution, got {shown(solution)}")
    if not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(f"rates: expected Coulomb friction, got {problem.law.name}")
    shape = problem.contacts, problem.dimension
    expect_shape("solution", solution.r.shape, shape)
    if last is not None:
        last = finite("last", last, 2)
        expect_shape("last", last.shape, shape)
    number("tolerance", tolerance, least=0.0)
    scaled = Scaled.of(problem, deadline_of(time_limit, SECONDS))
    sets = _Sets.of(scaled, solution.r, last, tolerance)
    found = _eliminated(scaled, sets)
    if found is None:
        return sets.answer(RateVerdict.UNDECIDED, "what sticks can not be eliminated")
    return _judged(found, sets)


@dataclass(frozen=True, eq=False)
class _Sets:
    """What contacts do in a state; t (nc, d - 1): directions of slip."""

    sliding: Indices
    grazing: Indices
    sticking: Indices
    open: Indices
    t: Array
    mu: Array

    @classmethod
    def of(cls, scaled: Scaled, given: Array, last: Array | None, tolerance: float) -> _Sets:
        r = given / scaled.to_r
        size = tolerance * max(1.0, float(np.abs(r).max(initial=0.0)))
        closed, cone, t = _closed(scaled, r, size)
        apart = ~closed & (scaled.velocity(r[None])[0][:, 0] > size) | ~scaled.reacts
        grazes = ~closed & ~apart
        if last is not None:
            before = last / scaled.to_r
            least = tolerance * max(1.0, float(np.abs(before).max(initial=0.0)))
            was_closed, was_cone, was_t = _closed(scaled, before, least)
            turned = cone & was_cone & ((t * was_t).sum(axis=1) < 0)
            grazes |= (closed != was_closed) | turned
            t = np.where(cone[:, None], t, was_t)
            cone = (cone | was_cone) & ~grazes
        kinds = cone, grazes, closed & ~cone & ~grazes, apart & ~grazes
        return cls(*(np.flatnonzero(kind) for kind in kinds), t, scaled.mu)

    def answer(
        self, verdict: RateVerdict, reason: str, D: Array | None = None, margin: float = 0.0
    ) -> Rates:
        D = np.zeros((0, 0)) if D is None else D
        return Rates(verdict, reason, self.sliding, self.grazing, self.sticking, self.open, D,
                     margin)  # fmt: skip


def _closed(scaled: Scaled, r: Array, size: float) -> tuple[Mask, Mask, Array]:
    """(closed, on its cone (nc,), t (nc, d - 1)) of scaled reactions; size: a border."""
    shear = np.linalg.norm(r[:, 1:], axis=1)
    closed = (r[:, 0] > size) & scaled.reacts
    cone = closed & (scaled.mu > 0) & (scaled.mu * r[:, 0] - shear <= size)
    return closed, cone, -r[:, 1:] / np.where(shear > 0, shear, 1.0)[:, None]


def _eliminated(scaled: Scaled, sets: _Sets) -> Array | None:
    """D, None where a part of W that is to be eliminated is singular.

    Reactions are E h + L p + G g: held, along the slip of what slides, of grazing contacts.
    """
    nc, d = scaled.shape
    one = np.eye(nc * d).reshape(nc, d, nc * d)
    slide, stuck, graze = sets.sliding, sets.sticking, sets.grazing
    t, rubs = sets.t[slide], sets.mu[stuck] > 0
    L = np.einsum("ka,kan->kn", t, one[slide, 1:])
    held = [one[slide, 0], one[stuck, 0], one[stuck[rubs], 1:].reshape(-1, nc * d)]
    if d == 3:
        across = np.column_stack([-t[:, 1], t[:, 0]])
        held.append(np.einsum("ka,kan->kn", across, one[slide, 1:]))
    tangents = [one[graze[sets.mu[graze] > 0], 1 + j] for j in range(d - 1)]
    E, X = np.concatenate(held), np.concatenate([L, one[graze, 0], *tangents])
    W, m = scaled.W, len(slide)
    try:
        stiff = E @ W @ E.T
        if len(E) and np.linalg.cond(stiff, 1) > 1 / MARGIN:
            return None
        back = np.linalg.solve(stiff, E @ W @ X.T) if len(E) else np.zeros((0, len(X)))
        A = X @ W @ X.T - X @ W @ E.T @ back  # (l, u' of grazing) = A (p, g)
        slack = -sets.mu[slide, None] * back[:m]  # f = p + mu r_N'
        slack[:, :m] += np.eye(m)
        if m and np.linalg.cond(A[:m, :m], 1) > 1 / MARGIN:
            return None
        solve = np.linalg.solve(A[:m, :m], np.hstack([np.eye(m), -A[:m, m:]]))
    except np.linalg.LinAlgError:
        return None
    rest = np.zeros((len(A) - m, len(A)))
    rest[:, m:] = np.eye(len(A) - m)
    into = np.vstack([solve, rest])  # (p, g) of (l, g)
    return np.vstack([slack @ into, A[m:] @ into])


def _judged(D: Array, sets: _Sets) -> Rates:
    """By all minors where these are few, else by the form."""
    m, mu = len(sets.sliding), sets.mu[sets.grazing]
    d = sets.t.shape[1] + 1
    if not m + len(mu):
        return sets.answer(RateVerdict.IMPOSSIBLE, "no contact is at a border of the law", D)
    least = _least(D, m, mu, d)
    if least > MARGIN:
        reason = "an inequality on rates leaves one answer to every change of the loads"
        return sets.answer(RateVerdict.IMPOSSIBLE, reason, D, least)
    count = 2.0**m * float(np.prod(np.where(mu > 0, 4.0, 2.0)))
    if (d == 2 or not (mu > 0).any()) and count <= PIECES:
        signs = _orientations(D, m, mu)
        if (signs > 0).all():
            return sets.answer(RateVerdict.IMPOSSIBLE, "all pieces have one orientation", D)
        if (signs < 0).any():
            reason = "a piece is turned over: changes of the loads have several answers or none"
            return sets.answer(RateVerdict.POSSIBLE, reason, D)
        return sets.answer(RateVerdict.UNDECIDED, "a piece is singular to rounding", D)
    reason = "the inequality does not hold, and pieces are too many or grazing is in 3D"
    return sets.answer(RateVerdict.UNDECIDED, reason, D)


def _orientations(D: Array, m: int, mu: Array) -> Array:
    """Signs of the determinants of all pieces, 0 where rounding decides."""
    one, rubs = np.eye(len(D)), np.flatnonzero(mu > 0)
    rows = [[one[[k]], D[[k]]] for k in range(m)]
    tangent = {int(i): m + len(mu) + k for k, i in enumerate(rubs)}
    order = list(range(m))
    for i, own in enumerate(mu):
        k = m + i
        if i not in tangent:
            rows.append([one[[k]], D[[k]]])
            order.append(k)
            continue
        t = tangent[i]
        slips = [np.stack([D[k], one[t] - s * own * one[k]]) for s in (1, -1)]
        rows.append([one[[k, t]], D[[k, t]], *slips])
        order += [k, t]
    pieces = np.array([np.concatenate(choice) for choice in product(*rows)])[:, :, order]
    pieces /= np.linalg.norm(pieces, axis=2, keepdims=True)
    found = np.linalg.det(pieces)
    return np.where(np.abs(found) > ROUNDING, np.sign(found), 0.0)


def _least(D: Array, m: int, mu: Array, d: int) -> float:
    """Least eigenvalue of the form, of unit diagonal, with the best of ALPHAS."""
    rubs = np.flatnonzero(mu > 0)
    normal = m + np.arange(len(mu))
    tangent = m + len(mu) + np.arange((d - 1) * len(rubs)).reshape(d - 1, -1)
    own = np.diagonal(D)
    if not (own > 0).all():
        return -np.inf
    s = 1 / np.sqrt(own)
    for k, i in enumerate(rubs):  # one unit for all of a contact
        both = [normal[i], *tangent[:, k]]
        s[both] = 1 / np.sqrt(own[both].mean())
    A = D * s * s[:, None]
    best = -np.inf
    for alpha in ALPHAS if len(rubs) else ALPHAS[:1]:
        M = (A + A.T) / 2
        M[normal[rubs], normal[rubs]] -= mu[rubs] * alpha / 2
        for row in tangent:
            M -= A[row].T @ ((mu[rubs] / alpha / 2)[:, None] * A[row])
        best = max(best, float(np.linalg.eigvalsh(M)[0]))
    return best
