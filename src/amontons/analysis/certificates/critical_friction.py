"""The critical friction of a problem: below it every load has one solution, above not.

Where no pattern of statuses has a singular linear piece, all pieces have the orientation that
they have without friction, and the solution is unique for every load.  Just above the smallest
friction with a singular piece some pieces have the other orientation, and there are loads with
three solutions.  That smallest friction is bounded here from both sides; friction is t times
the shape of the coefficients given, whose largest entry is one, and all bounds are values of t.
In 3D there are no linear pieces but directions; `bounds_in_space` bounds it there.

Two older criteria are there for comparison: the P-matrix property asks the same of patterns in
which only the tangent of a contact is closed, which no state of contact is (a safe bound, but
it may be smaller); full contact ([Andersson], [Rey]) leaves out all patterns with free
contacts, and its threshold is above the critical friction: it is not safe.

[Andersson] L.-E. Andersson, A. Rietz, A. Klarbring, "On the uniqueness of solutions of quasi-
static and discrete friction problems", in [Rey] section 5.
[Rey] V. Rey et al., on several solutions of static friction problems (2026), section 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline, TimeLimit, deadline_of, now
from ...core.errors import InvalidInput, TimeUp
from ...core.faces import Told
from ...core.onlookers import say
from ...problem.friction import FrictionProblem
from ..scaled import Scaled
from ..statuses import STICK
from . import bounds_in_space as space
from .contact_multipliers import ContactMultipliers
from .determinant_search import NEGATIVE, POSITIVE, STOPPED, UNKNOWN
from .energy_bound import energy_bound
from .exact_threshold import LARGEST, Threshold, exact_threshold, search_windows
from .friction_branching import Branching, Leaf
from .status_pieces import Pieces

Array = NDArray[np.float64]
ENUMERATED = 13  # contacts up to which all 4^n patterns are examined: 5 s
SECONDS = 60.0  # whose work a search without a time limit may take
CONTACTS = 0.2  # part of the time for multipliers of every contact
WINDOWS = 0.2  # part of the time for windows of contacts
COMPARED = 10  # contacts up to which the P-matrix threshold is computed: 5^n patterns
DIRECT = 18  # contacts up to which the whole gap is tried at once
PATIENCE = 0.75  # part of the time left for one attempt
EASY = 20.0  # contacts times the part of the upper bound that takes one matrix inequality
SINGULAR = "W is singular: reactions are not unique without friction either"
FULL_CONTACT = 12  # contacts up to which the full contact threshold is: 3^n patterns


@dataclass(frozen=True, eq=False)
class Witness:
    """A linear piece that is singular: with it friction `friction` is not safe for every load.

    pattern: f free, s stick, slip + or -, of every contact.  coefficients (nc,): m in
    r_T = m r_N of slipping contacts, |m| = friction * shape.  null_vector (nc, d): r != 0 with
    r = 0 at free and r_T = m r_N at slipping contacts, for which W r vanishes along u_N of
    all closed and u_T of sticking contacts, up to `residual`, relative to |W_ij| |r_j|.
    In 3D slip is l or h along t = directions (nc, 2), t.r_T = -m r_N; across t the reaction
    is zero with l, and the velocity with h.
    """

    friction: float
    pattern: str
    coefficients: Array
    null_vector: Array
    residual: float
    directions: Array | None = None

    def __str__(self) -> str:
        return f"the pattern {self.pattern} is singular at friction {self.friction:.6g}"


@dataclass(frozen=True, eq=False, repr=False)
class CriticalFriction(Told):
    """Bounds on the critical friction, lower <= mu_* <= upper, in terms of t (largest mu).

    criterion: what proves lower: "determinants" (all patterns), "multipliers" (`proof`),
    "contact multipliers" (`multipliers`), "energy", or "none" where there is no proof.  upper
    is inf where no singular piece was found up to LARGEST.  witness: the piece behind upper.
    p_matrix, full_contact: the two older thresholds, None where they would take too long.
    proof: groups of patterns that together are all of them.  examined: determinants and linear
    matrix inequalities.  reason: why the bounds are not closer.
    """

    lower: float
    upper: float
    criterion: str
    witness: Witness | None
    p_matrix: float | None
    full_contact: float | None
    examined: int
    seconds: float
    reason: str = ""
    proof: tuple[Leaf, ...] = ()
    multipliers: ContactMultipliers | None = None

    def __str__(self) -> str:
        upper = "no upper bound found" if np.isinf(self.upper) else f"{self.upper:.5g}"
        return f"critical friction between {self.lower:.5g} ({self.criterion}) and {upper}"


def critical_friction(
    problem: FrictionProblem | Scaled, *, gap: float = 1e-2, time_limit: TimeLimit = None,
    first: float | None = None, brief: bool = False,
) -> CriticalFriction:  # fmt: skip
    """Bounds on the friction below which every load has exactly one solution.

    gap: relative distance of the bounds that is good enough.  time_limit: seconds; without it
    operations are counted, as many as take about SECONDS.  first: a friction of interest, which
    is proved to be safe before others if it can be; in 3D a lower bound above it is enough,
    and no upper one is looked for then.
    brief: without what takes long, branches in 2D and an upper bound in 3D.
    Raises UnsupportedForm under Tresca's law.
    """
    deadline = deadline_of(time_limit, SECONDS)
    if not 0 < gap < 1:
        raise InvalidInput(f"gap: expected a number between 0 and 1, got {gap!r}")
    began = now()
    try:
        pieces = Pieces.of(problem, deadline)
        energy = energy_bound(pieces.W, pieces.shape, deadline)[0]
    except TimeUp as reason:
        return CriticalFriction(0.0, np.inf, "none", None, None, None, 0, now() - began,
                                str(reason))  # fmt: skip
    definite = energy > 0  # also where no contact reacts
    if definite and not pieces.couples:
        why = "no tangential force moves a contact along its normal"
        return CriticalFriction(np.inf, np.inf, "determinants", None, None, None, 0,
                                now() - began, why)  # fmt: skip
    if problem.dimension == 3:
        return _in_space(pieces, energy, deadline, first, began, brief=brief)
    search = _Search(pieces, deadline, energy, gap, first, brief=brief)
    search.run()
    found = search.found
    witness = None if found.states is None else make_witness(pieces, found)
    comparison = _comparison(pieces, found, deadline)
    return CriticalFriction(found.lower, found.upper, search.criterion, witness, *comparison,
                            found.seen, now() - began, search.reason,
                            search.proof, search.multipliers)  # fmt: skip


def _in_space(
    pieces: Pieces, energy: float, deadline: Deadline, first: float | None, began: float, *,
    brief: bool,
) -> CriticalFriction:  # fmt: skip
    """Bounds of a 3D problem, brief: without an upper one; no more once `first` is safe."""
    by, late = None, ""
    if energy > 0 and (first is None or energy <= first):
        by, late = space.lower_bound(pieces, deadline.share(space.LOWER), first)
    lower, criterion = energy, "energy" if energy > 0 else "none"
    if by is not None and by.t > energy:
        lower, criterion = by.t, "contact multipliers"
    upper, witness = np.inf, None
    search = energy > 0 and not brief and (first is None or lower <= first)
    found = space.upper_bound(pieces, deadline) if search else None
    if found is not None:
        upper = found.t
        witness = Witness(
            found.t, space.pattern(pieces, found), space.coefficients(pieces, found),
            pieces.reaction(found.null), space.residual(pieces, found),
            space.directions(pieces, found),
        )  # fmt: skip
    why = "in 3D nothing closes bounds" if energy > 0 else SINGULAR
    return CriticalFriction(lower, upper, criterion, witness, None, None, 0, now() - began,
                            late or why, multipliers=by)  # fmt: skip


@dataclass(eq=False)
class _Search:
    """Upper bounds by windows, then a lower one by the strongest method that fits."""

    pieces: Pieces
    deadline: Deadline
    energy: float  # the bound of `energy_bound`
    gap: float
    first: float | None = None
    brief: bool = False
    found: Threshold = field(default_factory=Threshold)
    criterion: str = "none"
    reason: str = ""
    proof: tuple[Leaf, ...] = ()
    multipliers: ContactMultipliers | None = None

    def run(self) -> None:
        """Close the bounds as far as time allows."""
        pieces, found = self.pieces, self.found
        say("critical friction: upper bounds")
        search_windows(pieces, found, self.deadline.share(WINDOWS))
        if pieces.contacts <= ENUMERATED:
            exact_threshold(pieces, found, self.deadline)
            if found.proved:
                self.criterion = "determinants"
                return
        found.lower = min(self.energy, found.upper)
        if found.lower == 0:
            self.reason = SINGULAR
            return
        self.criterion = "energy"
        self._by_contacts()
        if not self.brief:
            self._branch()

    def _by_contacts(self) -> None:
        """Raise the lower bound by multipliers of every contact."""
        share = self.deadline.share(CONTACTS)
        by, _ = space.lower_bound(self.pieces, share, self.first)
        if by is not None and by.t > self.found.lower:
            self.found.lower, self.criterion = by.t, "contact multipliers"
            self.multipliers = by

    def _branch(self) -> None:
        """Raise the lower bound by branch and bound, in steps that cost more and more.

        An attempt gets PATIENCE of the time that is left; where it is stopped, a smaller one
        follows.
        """
        found, first, n = self.found, self.first, self.pieces.contacts
        if first is not None and found.lower < first < min(found.upper, LARGEST):
            self._prove(first, 0.5)
        if n <= DIRECT:
            self._prove(min(found.upper, LARGEST) * (1 - self.gap / 2), 0.5)
        failed, part = 1.0, min(EASY / n, 0.9)
        while not self.deadline.passed:
            cap = min(found.upper, LARGEST)
            lower = found.lower / cap
            if lower >= 1 - self.gap or failed - lower < self.gap:
                return
            part = lower + 0.5 * (failed - lower) if part <= lower else part
            began = self.deadline.time
            sign = self._prove(cap * part, PATIENCE)
            if sign == UNKNOWN:
                return
            if sign == STOPPED:
                failed, part = part, 0.5 * (lower + part)
            else:
                part = self._next(found.lower / min(found.upper, LARGEST), failed, began)

    def _prove(self, t: float, share: float) -> int:
        """Prove that t is safe in a share of the time that is left, or find a witness.

        POSITIVE, NEGATIVE with a smaller upper bound, STOPPED, or UNKNOWN within rounding.
        """
        found = self.found
        say(f"critical friction: between {found.lower:.4g} and {found.upper:.4g}, is {t:.4g} "
            "safe?")  # fmt: skip
        branching = Branching(self.pieces, t, self.deadline.share(share))
        sign = branching.run()
        found.seen += branching.patterns + branching.inequalities
        if sign == POSITIVE:
            found.lower, self.criterion, self.reason = t, "multipliers", ""
            self.proof = tuple(leaf.of_problem(self.pieces) for leaf in branching.leaves)
            return POSITIVE
        states = branching.failed
        if states is not None and found.take(self.pieces, states):
            return NEGATIVE
        stopped = f"stopped after {self.deadline}"
        self.reason = stopped if sign == STOPPED else "a determinant is too near to zero"
        return STOPPED if sign == STOPPED else UNKNOWN

    def _next(self, part: float, failed: float, began: float) -> float:
        """The next part of the upper bound to prove: further on where the last one was easy."""
        spent, left = self.deadline.time - began, self.deadline.left
        further = part + (0.35 if spent < 0.03 * left else 0.2) * (1 - part)
        if failed < 1:
            further = min(further, 0.5 * (part + failed))
        return 1 - self.gap / 2 if further > 1 - 3 * self.gap else further


def make_witness(pieces: Pieces, found: Threshold) -> Witness:
    """The witness of an upper bound, in the units of the problem.

    Moves upper up to where the determinant is provably negative, if rounding allows it within
    1e-6 of itself.
    """
    states, r, t = found.states, found.null, found.upper
    assert states is not None and r is not None
    for room in (1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6):
        if pieces.sign(states, t * (1 + room)) == NEGATIVE:
            found.upper = t * (1 + room)
            break
    slip, m = pieces.slipping(states)
    coefficients = np.zeros(pieces.total)
    coefficients[pieces.places[slip]] = t * m
    rows = pieces.rows(states)
    size = np.abs(pieces.W[rows]) @ np.abs(r)
    residual = np.abs(pieces.W[rows] @ r) / np.where(size > 0, size, 1.0)
    return Witness(t, pieces.word(states), coefficients, pieces.reaction(r),
                   float(residual.max(initial=0.0)))  # fmt: skip


# ----------------------------------------------------------- the older criteria
def _comparison(
    pieces: Pieces, found: Threshold, deadline: Deadline
) -> tuple[float | None, float | None]:
    """(P-matrix threshold, full contact threshold), None where they would take too long."""
    p_matrix = None
    if pieces.contacts <= COMPARED:
        threshold = p_matrix_threshold(pieces, deadline, found)
        p_matrix = threshold.upper if threshold.proved else None
    full = full_contact_threshold(pieces, deadline)
    return p_matrix, full.upper if full is not None and full.proved else None


def p_matrix_threshold(
    pieces: Pieces, deadline: Deadline, known: Threshold | None = None
) -> Threshold:
    """Smallest t at which a pattern is singular, also one with only its tangent closed.

    known: an upper bound with its pattern, to begin with.
    """
    begin = known or Threshold()
    threshold = Threshold(begin.upper, begin.states, begin.null)
    exact_threshold(pieces, threshold, deadline, pieces.allowed(tangent=True))
    return threshold


def full_contact_threshold(pieces: Pieces, deadline: Deadline = NEVER) -> Threshold | None:
    """Smallest t at which a pattern without free contacts is singular; not a safe friction.

    In terms of u = 0 off the slipping tangents, such a piece reads (K u)_T = m (K u)_N with
    K = W^-1: the patterns of K' with T and N exchanged and stick in the place of free.  None
    for a singular W or more than FULL_CONTACT contacts.
    """
    if pieces.contacts > FULL_CONTACT or np.linalg.cond(pieces.W) > 1e12:
        return None
    swap = np.arange(2 * pieces.contacts).reshape(-1, 2)[:, ::-1].ravel()
    K: Any = np.linalg.inv(pieces.W).T[np.ix_(swap, swap)]
    dual = Pieces(K, pieces.shape, pieces.scale, pieces.places, pieces.total)
    allowed = dual.allowed()
    allowed[:, STICK] = False
    threshold = Threshold()
    exact_threshold(dual, threshold, deadline, allowed=allowed)
    return threshold


def full_contact_difference(pieces: Pieces, threshold: Threshold) -> Array | None:
    """r = K u (2 k,) of the singular piece behind a threshold of `full_contact_threshold`.

    Its matrix K' there is the transpose of (K u)_T + m (K u)_N on the slipping contacts.
    """
    if threshold.states is None:
        return None
    slip, m = pieces.slipping(threshold.states)
    K = np.linalg.inv(pieces.W)[:, 2 * slip + 1]
    rows = K[2 * slip + 1] + threshold.upper * m[:, None] * K[2 * slip]
    return K @ np.linalg.svd(rows)[2][-1]
