"""Is a solution of a Coulomb problem the only one for its load?  A certificate, or another.

Another solution z differs from the found one z0 by d with d_u = W d_r.  In status s contact p
has d_p in the cone K_ps = cone(C_s - z0_p).  Symmetric matrices W_p with d_p^T W_p d_p <= 0 on
all K_ps and sum_p d_p^T W_p d_p > 0 for all d with d_u = W d_r leave d = 0 only.  They solve a
linear matrix inequality (`multipliers.lmi`): -G^T W_p G = positive semidefinite + nonnegative,
G the generators of K_ps, which in up to four dimensions is all that copositivity asks for.

More contacts, and 3D, first try the few numbers of every contact of `load_multipliers`, which
take next to no time and hardly depend on the mesh; then the matrices.

Where none exist for all statuses together, they are divided: free or closed, stick or slip,
slip + or -, in 3D arcs of its direction.  Parts with z0 are treated alike, without the
velocities and reactions that vanish there; parts without z0 must be shown to hold no solution,
by multipliers of (z, 1).  Other solutions are looked for with Newton's method, from many starts
and from where an inequality fails.  `tree` does that.

What CERTIFIED means, in floating point with all rounding accounted for (`branch_proof`): every
solution of the problem, with W, q and mu as given, is within `distance` of the one found; where
no contact of it is nearer than that to another status, it is the only one.

P. Parrilo, "Structured semidefinite programs and semialgebraic geometry methods in robustness
and optimization", thesis, Caltech (2000), chapter 5 (copositive matrices).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import Deadline, TimeLimit, deadline_of, now
from ....core.errors import InvalidInput, TimeUp
from ....problem.friction import FrictionProblem
from ....problem.solution import FrictionSolution
from ...scaled import Scaled
from ...solutions.discs.known import NEAR
from ...solutions.enumerate import PieceSolution
from ...solutions.existence import exist, takes_too_long
from ...solutions.newton_batch import polished
from ...tolerances import REFINED
from ..load_multipliers import LoadMultipliers, load_multipliers
from .answer import LoadCertificate, LoadOutcome
from .tree import DiscTree, PlaneTree

Array = NDArray[np.float64]
SECONDS = 60.0  # whose work a certificate without a time limit may take
# contacts in 2D and 3D up to which branches are looked for at once: they prove more
FEW = {2: 25, 3: 0}
SHARE = 0.5  # of the time, for multipliers of every contact


def certify_load(
    problem: FrictionProblem | Scaled, solution: FrictionSolution | PieceSolution, *,
    time_limit: TimeLimit = None, brief: bool = False,
) -> LoadCertificate:  # fmt: skip
    """Certificate that a Coulomb problem has no solution but the given one, or another one.

    time_limit: seconds, after which the answer is undecided; without it operations are
    counted, as many as take about SECONDS.  brief: undecided where multipliers of every contact
    do not prove it.  The branches of the certificate are of the type
    `LoadBranch` in 2D, `DiscBox` in 3D.  The global form is condensed.  Raises UnsupportedForm
    under Tresca's law, InvalidInput where `solution` does not solve the problem.
    """
    deadline, began = deadline_of(time_limit, SECONDS), now()
    r, shape = np.asarray(solution.r), (problem.contacts, problem.dimension)
    if r.shape != shape:
        raise InvalidInput(f"solution: expected reactions {shape}, got {r.shape}")
    tree: PlaneTree | DiscTree | None = None
    by: LoadMultipliers | None = None
    other: PieceSolution | None = None
    try:
        scaled = Scaled.of(problem, deadline)
        if not scaled.contacts:
            outcome, reason = LoadOutcome.CERTIFIED, "there is no contact"
        elif not scaled.q.any():
            outcome, reason = LoadOutcome.UNDECIDED, "q is zero: nothing sets a scale"
        elif (by := _by_contacts(scaled, r, deadline)) is not None and by.proved:
            return _certified(scaled, by, began)
        elif brief:
            outcome, reason = LoadOutcome.UNDECIDED, "multipliers of every contact do not reach"
        else:
            tree = (PlaneTree if shape[1] == 2 else DiscTree)(scaled, r, deadline)
            r = tree.known * scaled.to_r
            tree.close()
            other = tree.other
            outcome, reason = _outcome(tree, r, other, deadline)
    except TimeUp as stopped:
        outcome, reason = LoadOutcome.UNDECIDED, str(stopped)
    distance, branches = np.inf, ()
    if outcome is LoadOutcome.CERTIFIED:
        distance, branches = (tree.resolution, tree.branches) if tree else (0.0, ())
    return LoadCertificate(
        outcome, other if outcome is LoadOutcome.REFUTED else None, branches, r, distance,
        tree.examined if tree else 0, reason, now() - began,
        unresolved=tree is not None and tree.unresolved, multipliers=by,
    )  # fmt: skip


def _by_contacts(scaled: Scaled, r: Array, deadline: Deadline) -> LoadMultipliers | None:
    """Multipliers of every contact, None where others are at hand or there was no time."""
    if scaled.contacts <= FEW[scaled.dimension] or (scaled.q[~scaled.reacts, 0] < 0).any():
        return None
    known = r / scaled.to_r
    size = 1 + float(np.abs(known).max(initial=0.0))
    better, _ = polished(scaled, known)
    if np.abs(better - known).max() <= REFINED * size:
        known = better
    try:
        return load_multipliers(scaled, known, deadline.share(SHARE), near=NEAR * size)
    except TimeUp:
        return None


def _certified(scaled: Scaled, by: LoadMultipliers, began: float) -> LoadCertificate:
    """The answer by multipliers of every contact."""
    distance = scaled.relative(by.distance, by.r0 / scaled.to_r)
    reason = "multipliers of every contact exclude all others"
    return LoadCertificate(LoadOutcome.CERTIFIED, None, (), by.r0, distance, 1,
                           reason, now() - began, multipliers=by)  # fmt: skip


def _outcome(
    tree: PlaneTree | DiscTree, r: Array, other: PieceSolution | None, deadline: Deadline
) -> tuple[LoadOutcome, str]:
    """The answer and its reason; REFUTED only if both solutions are proved to exist.

    A small error alone is no proof (`existence`).
    """
    if other is None and tree.complete:
        parts = f" on {tree.parts} parts" if tree.parts > 1 else ""
        return LoadOutcome.CERTIFIED, f"multipliers exclude all others{parts}"
    if other is None:
        return LoadOutcome.UNDECIDED, tree.reason
    if takes_too_long(tree.scaled, 2, deadline):
        reason = f"there was no time to prove that {other.pattern} is another solution"
        return LoadOutcome.UNDECIDED, reason
    if not exist(tree.scaled, [r, other.r], deadline):
        reason = f"rounding of W, q and mu decides whether {other.pattern} is another solution"
        return LoadOutcome.UNDECIDED, reason
    return LoadOutcome.REFUTED, f"another solution is {other.pattern}"
