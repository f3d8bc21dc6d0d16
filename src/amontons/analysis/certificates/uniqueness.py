"""Is the solution of a contact problem the only one?  A verdict in four grades.

Cheap answers come first: a friction that is safe for every load (`energy_bound`, then
`critical_friction`), then this load (all patterns, or the certificate about the solution that
was found), then a second solution.  What none of them settles is undecided, with the reason.
"""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ...core.clock import RATE, Deadline, TimeLimit, deadline_of, duration, now
from ...core.errors import InvalidInput, SingularOperator, TimeUp
from ...core.onlookers import say
from ...linear.dense import dense
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Coulomb, Law, Tresca
from ...problem.solution import FrictionSolution
from ...solvers.driver import drive
from ..hyperstatic.freedom import freedom_of
from ..quick import BOUND_WORK, allowed, quick_deadline, rows_of
from ..scaled import COPIES, UNRESOLVED, Scaled
from ..solutions.discs.search import enumerate_discs
from ..solutions.enumerate import PieceSolution, Solutions, enumerate_solutions
from ..tolerances import SAME
from .critical_friction import CriticalFriction, critical_friction
from .energy_bound import energy_bound
from .one_load.answer import LoadCertificate, LoadOutcome
from .one_load.certificate import certify_load
from .singular import blocked, if_held, if_singular
from .status_pieces import friction_shape
from .verdict import Cause, Uniqueness, Verdict, without_verdict

Array = NDArray[np.float64]
ENUMERATED = 25  # contacts up to which all solutions are looked for before a certificate
REGIONS = 10  # contacts in 3D up to which all solutions are looked for after it
INSTANT = 8  # contacts up to which the quick verdict examines all patterns: milliseconds
SECONDS = 60.0  # whose work a verdict without a time limit may take
ABOVE = 1e-9  # relative, at which a friction is proved to be safe
BOUNDS = 0.5  # part of the time for the bounds on the critical friction
MANY = {2: 25, 3: 100}  # contacts in 2D and 3D from which on short ways come first
PROMPT = {2: 0.1, 3: 0.2}  # part of the time for the bounds of a short way
SAME_MOTION = " Reactions differ, the motion is the same."


def assess(
    problem: FrictionProblem, solution: FrictionSolution | None = None, *,
    time_limit: TimeLimit = None, held: str = "a body",
) -> Uniqueness:  # fmt: skip
    """The verdict on a problem; the global form is condensed.

    solution: one that was found; by default the problem is solved.  time_limit: seconds;
    without it operations are counted, as many as take about SECONDS.  held: the bodies that
    contact alone may hold, for the reason.
    """
    deadline = deadline_of(time_limit, SECONDS)
    began = now()
    if isinstance(problem.law, Coulomb):
        found = if_held(problem, solution, deadline, assess)
        found = found or if_singular(problem, solution, deadline, held)
        if found is not None:
            return _finished(found, began)
    try:
        local = problem.condensed(deadline)
        coulomb = isinstance(problem.law, Coulomb)
        given = Scaled.of(local, deadline) if coulomb else dense(local.W, COPIES)
    except (SingularOperator, InvalidInput, TimeUp) as error:
        no_w = isinstance(error, SingularOperator)
        reason = f"Contact alone holds {held}, so there is no W" if no_w else str(error)
        return without_verdict(problem, _sentence(reason), began)
    if blocked(local):
        return _without_solution(local, began)
    if isinstance(problem.law, Tresca):
        return _given_friction(cast(Array, given), local.contacts, began, deadline)
    if not isinstance(given, Scaled):
        return without_verdict(local, _not_known(problem.law), began)
    verdict = _by_energy(given, deadline.share(BOUNDS))
    if verdict.verdict is Verdict.UNDECIDED and given.contacts > MANY[given.dimension]:
        prompt = deadline.share(PROMPT[given.dimension])
        verdict = _every_load(given, verdict, prompt, brief=True)
        if verdict.verdict is Verdict.UNDECIDED:
            verdict = _this_load(given, solution, verdict, deadline, brief=True)
            solution = solution or verdict.solution
    if verdict.verdict is Verdict.UNDECIDED:
        verdict = _every_load(given, verdict, deadline.share(BOUNDS))
    if verdict.verdict is Verdict.UNDECIDED:
        verdict = _this_load(given, solution, verdict, deadline)
    return _finished(verdict, began)


def quick_verdict(
    problem: FrictionProblem, spent: float = 0.0, solution: FrictionSolution | None = None
) -> Uniqueness | None:
    """The part of the verdict that costs next to nothing beside a solve.

    spent: operations of the solve, of which a fifth may be used; up to QUICK rows of W, some
    ten milliseconds, nobody asks.  Where that is not enough, `cause` says what was met and
    `decided_by` what would decide.  solution: the one found; where W is singular or missing
    `freedom` says what its motion leaves open of the reactions.  None under laws of which
    nothing is proved.
    """
    if not isinstance(problem.law, Coulomb | Tresca):
        return None
    began, deadline = now(), quick_deadline(problem, spent)
    verdict = _quickly(problem, allowed(problem, spent), deadline, began)
    given = solution is not None and solution.converged and isinstance(problem.law, Coulomb)
    if not given or not _may_hold_itself(verdict, problem):
        return verdict
    assert solution is not None
    found = freedom_of(problem, solution, deadline)
    reason = f"{verdict.reason} {found}"
    return _finished(replace(verdict, reason=reason, freedom=found), began)


def _may_hold_itself(verdict: Uniqueness, problem: FrictionProblem) -> bool:
    """Whether there may be reactions that move nothing, and telling is cheap."""
    if verdict.cause is Cause.LARGE:
        return problem.form is Form.GLOBAL and problem.condensing_is_cheap
    return verdict.cause in (Cause.NO_W, Cause.SINGULAR)


def _quickly(
    problem: FrictionProblem, work: float, deadline: Deadline, began: float
) -> Uniqueness:
    """`quick_verdict` without reactions; work: operations that may be spent."""
    rows = rows_of(problem)
    try:
        cause = _why_not(problem, rows, work)
        if cause is not None:
            return _not_examined(problem, cause, rows, began)
        local = problem.condensed()
    except SingularOperator:  # contact alone holds a body
        return _not_examined(problem, Cause.NO_W, rows, began)
    except InvalidInput:  # W does not fit into memory
        return _not_examined(problem, Cause.LARGE, rows, began)
    if blocked(local):
        return _without_solution(local, began)
    if isinstance(problem.law, Tresca):
        return _given_friction(dense(local.W), local.contacts, began, deadline)
    try:
        scaled = Scaled.of(local)
    except InvalidInput:
        return _not_examined(problem, Cause.LARGE, rows, began)
    verdict = _by_energy(scaled, deadline)
    if verdict.verdict is Verdict.UNDECIDED and _is_small(local):
        verdict = _by_bounds(verdict, critical_friction(scaled, time_limit=deadline))
    if verdict.verdict is Verdict.UNDECIDED:
        cause = Cause.FRICTION if verdict.lower > 0 else Cause.SINGULAR
        verdict = replace(verdict, cause=cause)
    return _finished(verdict, began)


def _why_not(problem: FrictionProblem, rows: int, work: float) -> Cause | None:
    """Why a problem is not examined, None where it is."""
    if problem.loose_modes.shape[1]:
        return Cause.NO_W
    if BOUND_WORK * float(rows) ** 3 > work:
        return Cause.LARGE
    return None if problem.condensing_is_cheap else Cause.NOT_FORMED


def _not_examined(
    problem: FrictionProblem, cause: Cause, rows: int, began: float
) -> Uniqueness:
    """The verdict where something stood in the way."""
    reason = cause.value[1]
    if cause is Cause.LARGE:
        seconds = BOUND_WORK * float(rows) ** 3 / RATE
        reason += f": a bound takes some {duration(seconds)}, more than a fifth of a solve"
    return replace(without_verdict(problem, f"{reason}.", began), cause=cause)


def _finished(verdict: Uniqueness, began: float) -> Uniqueness:
    """With the time it took; what is proved for every load leaves no other solution at all."""
    every = verdict.verdict is Verdict.UNIQUE_EVERY_LOAD
    resolution = 0.0 if every else verdict.resolution
    return replace(verdict, resolution=resolution, seconds=now() - began)


def _is_small(local: FrictionProblem) -> bool:
    return local.dimension == 2 and 0 < local.contacts <= INSTANT


# --------------------------------------------------------------------- no solution
def _not_known(law: Law) -> str:
    return f"Nothing is proved here of {law.name}, only of Coulomb's and of Tresca's."


def _without_solution(local: FrictionProblem, began: float) -> Uniqueness:
    reason = "There is no solution: a contact penetrates that can not react."
    return without_verdict(local, reason, began)


# ------------------------------------------------------------------- every load
def _given_friction(W: Array, nc: int, began: float, deadline: Deadline) -> Uniqueness:
    """Tresca's law is monotone: one solution where W is definite."""
    bound, late = _energy(W, np.ones(nc), deadline)
    definite = nc == 0 or bound > 0
    verdict = Verdict.UNIQUE_EVERY_LOAD if definite else Verdict.UNDECIDED
    reason = "W is singular: reactions may not be unique."
    if definite:
        reason = "With given friction bounds the law is monotone, and W is definite."
    elif late:
        reason = late
    return Uniqueness(verdict, 0.0, 0.0, np.inf, "given friction", reason,
                      seconds=now() - began)  # fmt: skip


def _energy(W: Array, shape: Array, deadline: Deadline) -> tuple[float, str]:
    """(bound of `energy_bound`, empty or why there was no time for one)."""
    try:
        return energy_bound(W, shape, deadline)[0], ""
    except TimeUp as reason:
        return 0.0, f"No bound on the friction is known: {reason}."


def _by_energy(scaled: Scaled, deadline: Deadline) -> Uniqueness:
    """The verdict of the cheapest bound."""
    friction = float(scaled.mu.max(initial=0.0))
    lower, late = _energy(scaled.given, friction_shape(scaled.mu), deadline)
    if friction < lower or scaled.contacts == 0:
        reason = _is_below(friction, lower)
        return Uniqueness(Verdict.UNIQUE_EVERY_LOAD, friction, lower, np.inf, "energy", reason)
    reason = (
        f"The cheapest safe bound is {lower:.3g}."
        if lower > 0
        else late or "W is singular: reactions may not be unique even without friction."
    )
    return Uniqueness(Verdict.UNDECIDED, friction, lower, np.inf, "energy", reason)


def _every_load(
    scaled: Scaled, known: Uniqueness, deadline: Deadline, *, brief: bool = False
) -> Uniqueness:
    """The verdict of the bounds on the critical friction, and of what is known of it."""
    if not scaled.contacts or deadline.passed:
        return known
    above = known.friction * (1 + ABOVE)  # safe up to there means safe at the friction itself
    bounds = critical_friction(scaled, time_limit=deadline, first=above, brief=brief)
    return _by_bounds(known, bounds)


def _by_bounds(cheap: Uniqueness, bounds: CriticalFriction) -> Uniqueness:
    """The verdict with the bounds on the critical friction."""
    lower, criterion = bounds.lower, bounds.criterion
    if cheap.lower > lower:
        lower, criterion = cheap.lower, cheap.criterion
    friction = cheap.friction
    if friction < lower:
        verdict = Verdict.UNIQUE_EVERY_LOAD
        reason = _is_below(friction, lower)
    elif friction >= bounds.upper:
        verdict = Verdict.UNDECIDED
        reason = "Friction is above the critical one: some loads have several solutions."
    else:
        verdict, reason = Verdict.UNDECIDED, "Friction is not proved to be safe for every load."
    return replace(cheap, verdict=verdict, lower=lower, upper=bounds.upper, reason=reason,
                   criterion=criterion, witness=bounds.witness, critical=bounds)  # fmt: skip


# --------------------------------------------------------------------- this load
def _this_load(
    scaled: Scaled, solution: FrictionSolution | None, verdict: Uniqueness,
    deadline: Deadline, *, brief: bool = False,
) -> Uniqueness:  # fmt: skip
    """All solutions where they can be enumerated, else the certificate about one.

    brief: only by multipliers of every contact.
    """
    local = scaled.problem
    if local.dimension == 2 and local.contacts <= ENUMERATED and local.q_norm > 0:
        listed = enumerate_solutions(scaled, time_limit=deadline.share(0.5))
        answer = _by_list(scaled, solution, replace(verdict, solution=solution), listed)
        if answer is not None:
            return answer
    given = solution is not None
    if solution is None:
        say("a solution for this load")
        solution = drive(local, time_limit=deadline)
    if not solution.converged:
        reason = f"No solution was found: {solution.convergence}."
        return replace(verdict, reason=reason)
    verdict = replace(verdict, solution=solution)
    if local.q_norm == 0:
        reason = "Without load r = 0 is a solution; others were not looked for."
        return replace(verdict, reason=f"{verdict.reason} {reason}")
    try:
        found = certify_load(scaled, solution, time_limit=deadline, brief=brief)
    except InvalidInput as reason:
        why = f"No certificate: {reason}." if given else "The solution is too rough to certify."
        return replace(verdict, reason=f"{verdict.reason} {why}")
    if found.outcome is LoadOutcome.CERTIFIED and not scaled.resolves(solution.r / scaled.to_r):
        return replace(verdict, reason=f"{verdict.reason} {_sentence(UNRESOLVED)}")
    if found.outcome is LoadOutcome.CERTIFIED:
        verdict = replace(verdict, certificate=found)
        return _alone(verdict, _sentence(found.reason), found.distance)
    if found.outcome is LoadOutcome.REFUTED:
        return _refuted(verdict, scaled, found)
    unsettled = not (found.unresolved or deadline.passed)
    if local.dimension == 3 and local.contacts <= REGIONS and unsettled:
        answer = _by_list(
            scaled, solution, verdict, enumerate_discs(scaled, time_limit=deadline)
        )
        if answer is not None:
            return answer
    return replace(verdict, reason=f"{verdict.reason} {_sentence(found.reason)}")


def _by_list(
    scaled: Scaled, solution: FrictionSolution | None, verdict: Uniqueness,
    found: Solutions,
) -> Uniqueness | None:  # fmt: skip
    """The verdict of a list of solutions, None where it settles nothing."""
    if found.one:
        reason = "All other patterns of statuses are excluded."
        return _alone(verdict, reason, found.resolution)
    if found.complete and not found.solutions:
        return replace(verdict, reason="There is no solution: all patterns are excluded.")
    if found.at_least > 1:
        return _several(verdict, scaled, found, solution)
    if found.complete:  # but the degree of a solution leaves open how many it stands for
        words = ", ".join("=".join((s.pattern, *s.touching[:3])) for s in found.solutions[:5])
        reason = f"Rounding of W, q and mu decides whether there is more than one of: {words}."
        return replace(verdict, reason=reason)
    if found.unresolved:  # a certificate would not tell more
        return replace(verdict, reason=f"{verdict.reason} {_sentence(found.reason)}")
    return None


def _several(
    verdict: Uniqueness, scaled: Scaled, found: Solutions,
    solution: FrictionSolution | None,
) -> Uniqueness:  # fmt: skip
    """NOT_UNIQUE by a list of solutions."""
    s = [entry for entry in found.solutions if entry.at_least]
    sets = [entry for entry in s if entry.freedom]
    first = s[0] if solution is None else solution
    size = np.sqrt(scaled.size)[:, None] / scaled.to_r
    far = max(s, key=lambda x: float(np.linalg.norm(size * (x.r - first.r))))
    count = "A set of solutions was found" if sets else f"{len(s)} solutions were found"
    words = [entry.pattern for entry in s]
    if len(s) == 1 and not sets:  # only their patterns tell
        count = f"{found.at_least} solutions are within {found.resolution:.1e} of each other"
        words = [s[0].pattern, *s[0].touching]
    reason = f"{count}: {', '.join(words[:5])}."
    alike = len(s) > 1 or bool(sets)
    alike = alike and all(entry.still for entry in sets)
    if alike and all(scaled.rests(entry.r - s[0].r) for entry in s[1:]):
        reason += SAME_MOTION
    return _two(verdict, sets[0] if sets else far, reason, found.resolution)


def _two(
    verdict: Uniqueness, other: PieceSolution, reason: str, resolution: float
) -> Uniqueness:
    """NOT_UNIQUE, saying how well solutions are known."""
    reason += f" Each is known to {resolution:.1e} of the largest reaction."
    return replace(verdict, verdict=Verdict.NOT_UNIQUE, other=other, reason=reason,
                   resolution=resolution)  # fmt: skip


def _alone(verdict: Uniqueness, reason: str, resolution: float) -> Uniqueness:
    """UNIQUE_THIS_LOAD, saying up to which difference."""
    if resolution > 0.0:
        share = f"{resolution:.1e} of the largest reaction"
        reason += f" Any other would differ by less than {share}."
    return replace(verdict, verdict=Verdict.UNIQUE_THIS_LOAD, reason=reason,
                   resolution=resolution)  # fmt: skip


def _refuted(
    verdict: Uniqueness, scaled: Scaled, found: LoadCertificate
) -> Uniqueness:
    """NOT_UNIQUE by a second solution."""
    other = found.other
    assert other is not None
    reason = _sentence(found.reason)
    if scaled.rests(other.r - found.r0):
        reason += SAME_MOTION
    return _two(verdict, other, reason, SAME)


# ----------------------------------------------------------------------- helpers
def _is_below(friction: float, lower: float) -> str:
    if np.isinf(lower):
        return "Every friction is safe."
    return f"Friction {friction:g} is below a safe bound of {lower:.4g}."


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}" + ("" if text.endswith(".") else ".")
