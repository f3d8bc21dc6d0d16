"""What the compiled first stage of `Auto` has found of a problem, as a solution of the driver.

It is judged by the same measures: a problem whose error, weakest contact or rounding will not
do has no solution here, and goes through the driver from its start.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.clock import compiling, now
from ..core.errors import InvalidInput, shown
from ..core.quick import made
from ..linear.blocks import spatial
from ..problem.friction import Form, FrictionProblem
from ..problem.judge.measures import Criterion, Measure
from ..problem.settling import Settled
from ..problem.solution import Convergence, FrictionSolution, Outcome, Step
from .asked import Asked
from .auto.first_stage import (
    CHANGED,
    CONTACT,
    ERROR,
    HIDDEN,
    START,
    SWEEPS,
    WORK,
    WORST,
    Together,
)
from .auto.state import Begun, Swept, is_light
from .first_iterate import first_iterate
from .judging import BLUR

Array = NDArray[np.float64]
STAGE = "Anderson Gauss-Seidel"  # as the first track of the race is called


def local_form(problem: FrictionProblem) -> FrictionProblem | None:
    """The Delassus form of a problem that the first stage takes; None of others.

    Those have no contacts or no load, a law that is another one in other variables, or a W that
    is dear.  Raises InvalidInput for what is no FrictionProblem.
    """
    if not isinstance(problem, FrictionProblem):
        raise InvalidInput(
            f"expected a FrictionProblem, got {shown(problem)}; a model has discrete_problem()"
        )
    law = problem.law
    if not problem.contacts or law.varies or law.plain is not law:
        return None
    if problem.form is Form.GLOBAL:
        if problem.measure is not Measure.EXACT:
            return None
        problem = problem.condensed()
    return problem if problem.q_norm > 0 else None


def at_once(problem: Any, asked: Asked, start: Any) -> FrictionSolution | Begun | None:
    """The solution of a problem in Delassus form that the first stage solves.

    Where it does not, what it has begun, for the race to go on from; None where it is not made:
    of what is no such problem or dear, or where every iterate is to be seen.
    """
    if not isinstance(problem, FrictionProblem) or problem.form is Form.GLOBAL:
        return None
    plain = asked.callback is None and asked.criterion is Criterion.JUDGE
    if not plain or asked.max_iterations is not None or not is_light(problem):
        return None
    began, compiled = now(), compiling()
    mine = local_form(problem)
    if mine is None or asked.deadline.work is not None or asked.deadline.passed:
        return None
    together = Together([mine], asked.tolerance, begin_of(mine, start), asked.of_contacts)
    chunks: list[Swept] = []
    for _ in together.chunks():
        found = told(together, 0, problem, asked, now() - began, compiling() - compiled)
        if found is not None:
            return found
        chunks.append(together.swept(chunks))
        if asked.deadline.passed:
            break
    return together.begun(begin_of(mine, start), chunks)


def begin_of(problem: FrictionProblem, start: Any) -> Array:
    """Reactions to start from, (nc, 3); start: None, an Iterate or a solution."""
    if start is None:
        return np.zeros((problem.contacts, 3))
    return spatial(first_iterate(problem, start).r)


def told(
    together: Together, p: int, problem: FrictionProblem, asked: Asked, seconds: float,
    compiled: float = 0.0,
) -> FrictionSolution | None:  # fmt: skip
    """The solution of problem p, given in the form `problem`; None where it has none."""
    row, mine = together.table[p].tolist(), together.problems[p]
    size, d, worst = mine.q_norm, mine.dimension, row[WORST]
    error, hidden = row[ERROR] / size, row[HIDDEN] / size
    if not (error <= asked.tolerance and worst <= asked.of_contacts):
        return None
    if not hidden <= BLUR * asked.tolerance:
        return None
    r, u, states = together.r, together.u, together.states
    status, sliding = states[0], states[1]  # a tuple of them takes longer
    if len(together.problems) > 1 or d == 2:
        a, b = together.sizes[p, 0], together.sizes[p + 1, 0]
        r, u = np.array(r[a:b, :d]), np.array(u[a:b, :d])
        status, sliding = np.array(status[a:b]), np.array(sliding[a:b])
    count = int(row[SWEEPS])
    settled = Settled(r, status, sliding.view(np.bool_), row[CHANGED] > 0)
    flops = mine.judge_flops
    history = (Step(0, row[START] / size, 0, 0.0, None, flops),)
    if count:
        flops += row[SWEEPS] * together.reads[p].flops + row[WORK] + mine.judge_flops
        history = (*history, Step(count, error, 0, seconds, None, flops, STAGE))
    record = made(
        Convergence, outcome=Outcome.CONVERGED, iterations=count, error=error,
        tolerance=asked.tolerance, history=history, linear_iterations=0, seconds=seconds,
        solver="Auto", measure=Measure.EXACT, detail=STAGE if count else "",
        contact_error=worst, contact_tolerance=asked.of_contacts,
        weakest=int(row[CONTACT]) if row[CONTACT] >= 0 else None, compiling=compiled,
        flops=flops,
    )  # fmt: skip
    if problem is not mine:
        of, u, v = problem.recover(r)
        return FrictionSolution(of, r, u, v, record, settled=settled)
    r.setflags(write=False)
    u.setflags(write=False)
    return made(
        FrictionSolution, problem=mine, r=r, u=u, v=None, convergence=record, settled=settled
    )
