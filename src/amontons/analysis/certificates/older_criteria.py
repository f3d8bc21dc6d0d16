"""Two older criteria of critical friction, in 2D and 3D: P-matrices, and full contact.

Let d be the difference of two solutions of one load and y = W d the difference of their
motions.  Whatever the statuses, also with friction discs,

    d_N y_N <= 0,    d_T . y_T <= mu |d_N| |y_T|    at every contact.                      (1)

P-matrix criterion [Rey]: W [[I, 0], [m, I]] is a P-matrix for all m.  In 3D column N of a
contact is W (e_N + m_1 e_T1 + m_2 e_T2).  As printed m is in the square [-mu, mu]^2 and both
tangents are those given: principal minors then depend on how they were chosen, and those with
one tangent of a contact miss the directions in which it slips otherwise.  That is no safe
friction for Coulomb's law.  With |m| <= mu and *every* orthonormal choice of tangents the
criterion holds if and only if no d != 0 has (1): x_T = d_T - m d_N has x_T . y_T <= 0 if and
only if both terms are <= 0 in some basis.  That does not depend on the basis, and it is safe.
Both tangents of a contact in or out alone would not be: r_T also turns with the slip, so that
a contact with r_T = m r_N + x t, u_N = 0, t . u_T = 0, t across m, is a piece of the law.

Full contact [Andersson]: c is the least over r, u = W r with u_N = 0 at every contact, of the
largest r_T . u_T / (|r| |u_T|) of contacts with r != 0, u_T != 0; mu = c / sqrt(1 - c^2).  It
is about rates: the direction of friction is given, and two rates of one load have r_T . u_T <=
mu |r_N| |u_T| <= c |r| |u_T| with u_N = 0 as long as all contacts stay closed.  So below it
rates are unique while no contact opens; it is no bound where contacts open.  Sharp puts the
part of (r_N, r_T) across which u_T does no work to r_N alone, r_T . u_T <= mu |r_N| |u_T|.  In
2D both are the same, in 3D the number as printed is the smaller one.

With contacts that may be open the smallest sharp value over all groups of closed contacts is
the critical friction of 3D (`critical_discs`): below it all pieces of the law have the sign of
no friction, above it some load has several solutions.  (The P-matrix criterion also has d_N = 0
with any y_N beside d_T != 0, which no contact has, and so is smaller or equal.)

[Andersson] L.-E. Andersson, "Quasistatic frictional contact problems with finitely many degrees
of freedom" (1999), in [Rey] section 5.
[Rey] V. Rey, "On the influence of resolution algorithm's parameters ..." (2026), section 4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline, TimeLimit, deadline_of, now
from ...core.errors import InvalidInput, TimeUp, UnsupportedForm
from ...problem.friction import FrictionProblem
from .critical_friction import (
    COMPARED,
    FULL_CONTACT,
    full_contact_difference,
    full_contact_threshold,
    p_matrix_threshold,
)
from .disc_criteria import Criterion, Found, disc_threshold
from .exact_threshold import CLOSE, LARGEST, Threshold
from .status_pieces import REAL, Pieces

Array = NDArray[np.float64]
Ask = Callable[[Array, Array, float, Deadline], Found]
AskPieces = Callable[[Pieces, Deadline], Found]
SECONDS = 60.0  # whose work a criterion without a time limit may take
DISCS = 4  # contacts in 3D up to which a criterion is computed
SINGULAR = 1e12  # condition of W from which on it counts as singular


@dataclass(frozen=True, eq=False)
class CriterionFriction:
    """lower <= t <= upper: a criterion holds below lower and fails at upper; t is largest mu.

    difference (nc, d): what it fails with at upper, d of (1) in the module docstring, scaled to
    one; None with given tangents or where none was found.  In 3D lower is what halving boxes of
    angles shows, in floating point, and upper what local searches found.  reason: why the
    bounds are not closer.
    """

    lower: float
    upper: float
    difference: Array | None
    examined: int
    seconds: float
    reason: str = ""

    def __str__(self) -> str:
        upper = "no upper bound found" if np.isinf(self.upper) else f"{self.upper:.5g}"
        return f"between {self.lower:.5g} and {upper}"


def p_matrix_friction(
    problem: FrictionProblem, *, given_tangents: bool = False, gap: float = 1e-2,
    time_limit: TimeLimit = None,
) -> CriterionFriction:  # fmt: skip
    """The friction up to which the P-matrix criterion holds, in 2D or 3D.

    Below `lower` every load has at most one solution: safe.  given_tangents: as printed, with
    the tangents of the problem and m in a square in 3D; it depends on the tangents and is not
    safe for friction discs.  gap: relative distance of the bounds that is good enough in 3D.
    time_limit: seconds; without it operations are counted, as many as take about SECONDS.
    Raises UnsupportedForm for more than COMPARED contacts in 2D, DISCS in 3D, and under
    Tresca's law.
    """
    if problem.dimension == 2:
        return _bounds(problem, COMPARED, _p_matrix_planar, time_limit)
    if given_tangents:
        return _spatial(problem, DISCS, _given_tangents, gap, time_limit)
    return _spatial(problem, DISCS, _p_matrix_discs, gap, time_limit)


def full_contact_friction(
    problem: FrictionProblem, *, sharp: bool = False, gap: float = 1e-2,
    time_limit: TimeLimit = None,
) -> CriterionFriction:  # fmt: skip
    """The friction c / sqrt(1 - c^2) of the full contact number c, in 2D or 3D.

    Not safe: below it rates are unique as long as every contact stays closed, but loads at
    which contacts open may have several solutions.  sharp: with |r_N| in the place of what c
    has, see the module docstring; never smaller, and the same in 2D.  Other arguments, and
    errors: as of `p_matrix_friction`; FULL_CONTACT contacts in 2D.
    """
    if problem.dimension == 2:
        return _bounds(problem, FULL_CONTACT, _full_contact_planar, time_limit)
    criterion = Criterion.SHARP if sharp else Criterion.FULL_CONTACT

    def ask(W: Array, shape: Array, gap: float, deadline: Deadline) -> Found:
        return disc_threshold(W, shape, criterion, gap, deadline)

    return _spatial(problem, DISCS, ask, gap, time_limit)


def critical_discs(
    problem: FrictionProblem, *, gap: float = 1e-2, time_limit: TimeLimit = None
) -> CriterionFriction:
    """Bounds on the critical friction of a 3D problem with few contacts.

    Below `lower` every load has at most one solution, just above `upper` some load several.
    """

    def ask(W: Array, shape: Array, gap: float, deadline: Deadline) -> Found:
        return disc_threshold(W, shape, Criterion.CRITICAL, gap, deadline)

    return _spatial(problem, DISCS, ask, gap, time_limit)


def _bounds(
    problem: FrictionProblem, most: int, ask: AskPieces, time_limit: TimeLimit
) -> CriterionFriction:
    """The bounds of `ask` for the contacts that react."""
    deadline, began = deadline_of(time_limit, SECONDS), now()
    _check_size(problem, most)
    pieces = None
    try:
        pieces = Pieces.of(problem, deadline)
        found = ask(pieces, deadline) if pieces.contacts else _nothing_reacts()
    except TimeUp as reason:
        found = Found(reason=str(reason))
    difference = None
    if pieces is not None and found.difference is not None:
        difference = pieces.reaction(found.difference)
    return CriterionFriction(found.lower, found.upper, difference, found.examined,
                             now() - began, found.reason)  # fmt: skip


def _nothing_reacts() -> Found:
    """Where no contact reacts every load has one solution, whatever the friction."""
    return Found(np.inf, np.inf, reason="no contact can react")


# ---------------------------------------------------------------------------- in 3D
def _spatial(
    problem: FrictionProblem, most: int, ask: Ask, gap: float, time_limit: TimeLimit
) -> CriterionFriction:
    """The bounds of `ask`, where W is regular."""
    if not 0 < gap < 1:
        raise InvalidInput(f"gap: expected a number between 0 and 1, got {gap!r}")
    if problem.dimension != 3:
        raise UnsupportedForm("critical friction: expected a 3D problem, this one is 2D")

    def regular(pieces: Pieces, deadline: Deadline) -> Found:
        if not np.linalg.cond(pieces.W) < SINGULAR:
            return Found(reason="W is singular: reactions are not unique without friction too")
        return ask(pieces.W, pieces.shape, gap, deadline)

    return _bounds(problem, most, regular, time_limit)


def _check_size(problem: FrictionProblem, most: int) -> None:
    _ = problem.mu  # under Tresca's law there is none
    if problem.contacts > most:
        raise UnsupportedForm(
            f"criteria of critical friction: expected {most} contacts at most in "
            f"{problem.dimension}D, this problem has {problem.contacts}"
        )


def _p_matrix_discs(W: Array, shape: Array, gap: float, deadline: Deadline) -> Found:
    return disc_threshold(W, shape, Criterion.P_MATRIX, gap, deadline)


def _given_tangents(W: Array, shape: Array, gap: float, deadline: Deadline) -> Found:
    """All 13^n principal minors at the corners of the squares: they are affine in every m."""
    found = Found()
    for rows, normals, m in _minors(len(shape)):
        deadline.spend(50.0 * len(rows) ** 3)
        if deadline.passed:
            return Found(0.0, found.upper, None, found.examined, "time is up")
        found.examined += 1
        if not len(normals):
            continue
        by_m = np.einsum("ipj,pj->ip", W[rows].reshape(len(rows), -1, 3)[:, normals, 1:], m)
        columns = np.linalg.solve(W[np.ix_(rows, rows)], -by_m * shape[normals])
        values = np.linalg.eigvals(columns[np.searchsorted(rows, 3 * normals)])
        real = values.real[np.abs(values.imag) <= REAL * np.abs(values)]
        found.upper = min(found.upper, 1 / max(real.max(initial=0.0), 1 / LARGEST))
    found.upper = np.inf if found.upper >= LARGEST else found.upper
    found.lower = min(found.upper, LARGEST) * (1 - CLOSE)
    return found


def _minors(k: int) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], Array]]:
    """(rows, contacts with their normal, m = +-1 or 0 of these) of every principal minor.

    A tangent among the rows makes the minor independent of its m.
    """
    states = []
    for normal, one, two in product([False, True], repeat=3):
        signs = [(0,) if not normal or tangent else (-1, 1) for tangent in (one, two)]
        states += [((normal, one, two), m) for m in product(*signs)]
    for pattern in product(states, repeat=k):
        rows = np.flatnonzero([state for state, _ in pattern])
        normals = np.flatnonzero([state[0] for state, _ in pattern])
        yield rows, normals, np.array([pattern[p][1] for p in normals], float).reshape(-1, 2)


# ---------------------------------------------------------------------------- in 2D
def _p_matrix_planar(pieces: Pieces, deadline: Deadline) -> Found:
    threshold = p_matrix_threshold(pieces, deadline)
    return _of(threshold, threshold.null)


def _full_contact_planar(pieces: Pieces, deadline: Deadline) -> Found:
    threshold = full_contact_threshold(pieces, deadline)
    if threshold is None:
        return Found(reason="W is singular")
    return _of(threshold, full_contact_difference(pieces, threshold))


def _of(threshold: Threshold, difference: Array | None) -> Found:
    reason = "" if threshold.proved else "time is up, or a determinant is too near to zero"
    return Found(threshold.lower, threshold.upper, difference, threshold.seen, reason)
