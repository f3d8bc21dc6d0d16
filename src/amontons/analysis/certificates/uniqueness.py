"""Is the solution of a contact problem the only one?  A verdict in four grades.

Cheap answers come first: a friction that is safe for every load (`energy_bound`, then
`critical_friction`), then this load (all patterns, or the certificate about the solution that
was found), then a second solution.  What none of them settles is undecided, with the reason.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline, TimeLimit, deadline_of, now
from ...core.errors import InvalidInput, SingularOperator, TimeUp
from ...core.onlookers import say
from ...linear.dense import dense
from ...problem.friction import FrictionProblem
from ...problem.law import Coulomb, Law, Tresca
from ...problem.law.law import MU
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate
from ...solvers.driver import drive
from ..hyperstatic.held_tangents import relaxed
from ..hyperstatic.indeterminacy import indeterminacy, is_singular
from ..scaled import COPIES, UNRESOLVED, Scaled
from ..solutions.discs.search import enumerate_discs
from ..solutions.enumerate import PieceSolution, Solutions, enumerate_solutions
from ..tolerances import SAME
from .critical_friction import CriticalFriction, critical_friction
from .energy_bound import energy_bound
from .one_load.answer import LoadCertificate, LoadOutcome
from .one_load.certificate import certify_load
from .status_pieces import friction_shape
from .verdict import Uniqueness, Verdict, with_indeterminacy

Array = NDArray[np.float64]
ENUMERATED = 25  # contacts up to which all solutions are looked for before a certificate
REGIONS = 10  # contacts in 3D up to which all solutions are looked for after it
SMALL = 60  # rows of a singular W up to which all solutions are looked for first
INSTANT = 8  # contacts up to which the quick verdict examines all patterns: milliseconds
QUICK = 400  # rows of W up to which the quick verdict is given: some ten milliseconds
SECONDS = 60.0  # whose work a verdict without a time limit may take
QUICK_SECONDS = 1.0  # the same of a quick one
SOLVING = 0.7  # part of the time for a solution where W is singular
RELAXED = 0.7  # part of the time for the motion where supports hold tangents
ABOVE = 1e-9  # relative, at which a friction is proved to be safe
BOUNDS = 0.5  # part of the time for the bounds on the critical friction
PENETRATES = 1e-6  # gap of a contact that can not react, relative to the load
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
        found = _if_held(problem, solution, deadline)
        found = found or _if_singular(problem, solution, deadline, held)
        if found is not None:
            return _finished(found, began)
    try:
        local = problem.condensed(deadline)
        coulomb = isinstance(problem.law, Coulomb)
        given = Scaled.of(local, deadline) if coulomb else dense(local.W, COPIES)
    except (SingularOperator, InvalidInput, TimeUp) as error:
        no_w = isinstance(error, SingularOperator)
        reason = f"Contact alone holds {held}, so there is no W" if no_w else str(error)
        return _without_verdict(problem, _sentence(reason), began)
    if _blocked(local):
        return _without_solution(local, began)
    if isinstance(problem.law, Tresca):
        return _given_friction(cast(Array, given), local.contacts, began, deadline)
    if not isinstance(given, Scaled):
        return _without_verdict(local, _not_known(problem.law), began)
    verdict = _every_load(given, deadline.share(BOUNDS))
    if verdict.verdict is Verdict.UNDECIDED:
        verdict = _this_load(given, solution, verdict, deadline)
    return _finished(verdict, began)


def _if_held(
    problem: FrictionProblem, solution: FrictionSolution | None, deadline: Deadline
) -> Uniqueness | None:
    """The verdict where supports hold tangents of contacts, by the relaxed problem."""
    try:
        found = relaxed(problem, deadline)
    except (TimeUp, InvalidInput, SingularOperator):
        return None
    if found is None or _blocked(problem):
        return None
    other, held = found
    if solution is None or not solution.converged:
        say("a solution for this load")
        solution = drive(problem, time_limit=deadline.share(BOUNDS))
    if not solution.converged:
        return None
    known = None
    with suppress(InvalidInput):
        r = np.where(held, 0.0, solution.r)
        known = drive(other, start=Iterate(r), tolerance=1e-10, time_limit=deadline.share(0.1))
    verdict = assess(other, known, time_limit=deadline.share(RELAXED))
    proved = verdict.verdict is not Verdict.UNDECIDED
    apart = indeterminacy(
        problem, solution, deadline, proved=verdict.verdict.value if proved else "",
        why=verdict.reason,
    )  # fmt: skip
    count = int(held.any(axis=1).sum())
    told = f"Supports hold tangents of {count} contacts."
    return with_indeterminacy(replace(verdict, solution=solution, reason=told), apart)


def _if_singular(
    problem: FrictionProblem, solution: FrictionSolution | None, deadline: Deadline, held: str
) -> Uniqueness | None:
    """The verdict where W is singular or missing; None where it is not, or all is small.

    Then the lists of `_this_load` say more, and where they do not it is asked for again.
    """
    try:
        if problem.contacts * problem.dimension <= SMALL or not is_singular(problem, deadline):
            return None
        loose = problem.loose_modes.shape[1] > 0
        if not loose and _blocked(problem):
            return None
    except (TimeUp, InvalidInput, SingularOperator):
        return None
    if solution is None or not solution.converged:
        say("a solution for this load")
        solution = drive(problem, time_limit=deadline.share(SOLVING))
    cause = "W is singular"
    if loose:
        cause = f"Contact alone holds {held}, so there is no W"
    nothing = _without_verdict(problem, f"{cause}.", now())
    if not solution.converged:
        why = f"No solution was found: {solution.convergence}."
        return replace(nothing, reason=f"{cause}. {why}")
    return with_indeterminacy(replace(nothing, solution=solution),
                              indeterminacy(problem, solution, deadline))  # fmt: skip


def quick_verdict(problem: FrictionProblem) -> Uniqueness | None:
    """The part of the verdict that costs next to nothing.

    None for problems too large for it, and where contact alone holds a body.
    Never condenses a problem that is not condensed for other reasons.
    """
    if problem.contacts * problem.dimension > QUICK:
        return None
    began, deadline = now(), Deadline.counted(QUICK_SECONDS)
    try:
        if not problem.condensing_is_cheap:
            return None
        local = problem.condensed()
    except SingularOperator:  # contact alone holds a body
        return None
    if _blocked(local):
        return _without_solution(local, began)
    if isinstance(problem.law, Tresca):
        return _given_friction(dense(local.W), local.contacts, began, deadline)
    if not isinstance(problem.law, Coulomb):
        return None
    scaled = Scaled.of(local)
    verdict = _by_energy(scaled, deadline)
    if verdict.verdict is Verdict.UNDECIDED and _is_small(local):
        verdict = _by_bounds(verdict, critical_friction(scaled, time_limit=deadline))
    return _finished(verdict, began)


def _finished(verdict: Uniqueness, began: float) -> Uniqueness:
    """With the time it took; what is proved for every load leaves no other solution at all."""
    every = verdict.verdict is Verdict.UNIQUE_EVERY_LOAD
    resolution = 0.0 if every else verdict.resolution
    return replace(verdict, resolution=resolution, seconds=now() - began)


def _is_small(local: FrictionProblem) -> bool:
    return local.dimension == 2 and 0 < local.contacts <= INSTANT


# --------------------------------------------------------------------- no solution
def _blocked(local: FrictionProblem) -> bool:
    """True where a contact penetrates that can not react; rounding of a gap does not count."""
    q, reacts = local.free_velocity, local.rho > 0
    return bool((q[~reacts, 0] < -PENETRATES * np.linalg.norm(q)).any())


def _not_known(law: Law) -> str:
    return f"Nothing is proved here of {law.name}, only of Coulomb's and of Tresca's."


def _without_solution(local: FrictionProblem, began: float) -> Uniqueness:
    reason = "There is no solution: a contact penetrates that can not react."
    return _without_verdict(local, reason, began)


def _without_verdict(problem: FrictionProblem, reason: str, began: float) -> Uniqueness:
    friction = problem.law.parameters[:, MU].max(initial=0.0)
    return Uniqueness(Verdict.UNDECIDED, float(friction), 0.0, np.inf, "none", reason,
                      seconds=now() - began)  # fmt: skip


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


def _every_load(scaled: Scaled, deadline: Deadline) -> Uniqueness:
    """The verdict of the bounds on the critical friction."""
    cheap = _by_energy(scaled, deadline)
    if cheap.lower > cheap.friction or not scaled.contacts or deadline.passed:
        return cheap
    above = cheap.friction * (1 + ABOVE)  # safe up to there means safe at the friction itself
    bounds = critical_friction(scaled, time_limit=deadline, first=above)
    return _by_bounds(cheap, bounds)


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
    deadline: Deadline,
) -> Uniqueness:  # fmt: skip
    """All solutions where they can be enumerated, else the certificate about one."""
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
        found = certify_load(scaled, solution, time_limit=deadline)
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
