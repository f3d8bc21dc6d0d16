"""Where Newton's method begins a load step of `NonlinearNewton`.

The tangent predictor solves

    dF/dv dv = -(F(v) + dF/dload dload),

which also moves the prescribed displacements: cells would be inverted by moving these alone.
Another predictor is the solution of the tangent problem with contact: contacts that change
find their statuses together, where Newton's steps change them ring by ring, the more steps the
more contacts, and may go round in circles.  It comes first between bodies that slide, of LARGE
ones by some cycles of contact multigrid, and where cells can be inverted, as nothing else keeps
such bodies from passing through obstacles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvertedCells, SingularOperator, UnsupportedForm
from ...problem.friction import FrictionProblem
from ..contract import Breakdown, Iterate, Judgement, Target
from ..judging import EARLY, first_of, sent
from .linear_steps import LARGE, LinearSteps, newton_step
from .step_lengths import Failed

if TYPE_CHECKING:
    from .nonlinear import NonlinearProblem

Array = NDArray[np.float64]
Predictor = Callable[..., Array]
STATUSES = 1e-8  # error of a tangent problem with contact
CONTACT_STEPS = 300  # iterates in which it has to be reached
ROUGH = 1e-4  # the same where cycles solve it: what the tangent leaves out is more
CYCLES = 30  # most of them


def predictors(problem: NonlinearProblem) -> Sequence[Predictor]:
    """In the order in which they are tried."""
    if problem.shortest > 0 and not problem.meets_first:
        if problem.unknowns >= LARGE[problem.dimension]:
            return by_cycles, by_tangent, by_contact
        return by_contact, by_tangent
    return (by_contact, by_tangent) if problem.meets_first else (by_tangent, by_contact)


def by_tangent(
    problem: NonlinearProblem, share: float, goal: float, v: Array, target: Target,
    linear: LinearSteps,
) -> Array:  # fmt: skip
    """The state (n,) to first order, from v at one share of the load to another."""
    try:
        here, change = problem.predicted(share, goal, v)
        return v + newton_step(problem.at_share(share), v, here, here.residual + change,
                               linear)[0]  # fmt: skip
    except (InvertedCells, SingularOperator) as reason:
        raise Failed(str(reason)) from reason


def by_contact(
    problem: NonlinearProblem, share: float, goal: float, v: Array, target: Target,
    linear: LinearSteps,
) -> Array:  # fmt: skip
    """The same of the tangent problem with contact, by factors: cheaper where they fit."""
    from ..auto.hybrid import Auto  # which takes Newton's method, too

    tangent, start = _tangent_problem(problem, share, goal, v, by_factors=True)
    # Another way is next, or a shorter step: a body about to come loose has no such state.
    is_last = problem.meets_first or (problem.shortest == 0 and goal - share == 1.0)
    most = CONTACT_STEPS if is_last and not tangent.gains_energy else EARLY

    def states() -> Iterator[tuple[Array | None, bool]]:
        iterates = first_of(Auto().iterates(tangent, start, target), most)
        iterate = sent(iterates, None)
        while iterate is not None:
            state = iterate.v if iterate.v is not None else tangent.velocity(iterate.r)[1]
            error = tangent.error(iterate.r, state)
            yield state, error <= STATUSES
            iterate = sent(iterates, Judgement(error, None, target.deadline))

    return _first_good(states(), problem, target)


def by_cycles(
    problem: NonlinearProblem, share: float, goal: float, v: Array, target: Target,
    linear: LinearSteps,
) -> Array:  # fmt: skip
    """The same to ROUGH, for about the price of one Newton step whatever the size."""
    from ..multigrid.cycles import ContactMultigrid  # as above

    tangent, start = _tangent_problem(problem, share, goal, v)

    def states() -> Iterator[tuple[Array | None, bool]]:
        cycles, rough = 0, Target(ROUGH, target.deadline)
        for iterate in ContactMultigrid().iterates(tangent, start, rough):
            cycles += iterate.iterations
            yield iterate.v, iterate.own[-1] <= ROUGH
            if cycles >= CYCLES:
                return

    return _first_good(states(), problem, target)


def _tangent_problem(
    problem: NonlinearProblem, share: float, goal: float, v: Array, by_factors: bool = False
) -> tuple[FrictionProblem, Iterate]:
    """The tangent problem with contact, springs of varying laws behind v, and its start."""
    whole = problem.towards(share, goal, v)
    if by_factors:
        whole = replace(whole, near_nullspace=None)
    tangent = whole if whole.law.varies else whole.plain
    return tangent, Iterate(np.zeros((tangent.contacts, tangent.dimension)))


def _first_good(
    states: Iterator[tuple[Array | None, bool]], problem: NonlinearProblem, target: Target
) -> Array:
    """The first state (n,) that is good enough; raises Failed where none is."""
    try:
        for state, is_good in states:
            if is_good and state is not None:
                return state[: problem.unknowns]
            if target.deadline.passed:
                break
    except (Breakdown, SingularOperator, UnsupportedForm) as reason:
        raise Failed(str(reason)) from reason
    raise Failed("the tangent problem with contact was not solved")
