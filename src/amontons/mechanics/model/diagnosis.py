"""Why a model may have no solution, in the same words for every verb."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.errors import SingularOperator
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution, Obstruction, Outcome

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
NO_W = "so there is no W to work with; hold it by supports"
STEPS = ", or take steps in time, which need none: evolve with QuasiStatic (amontons run)"


def with_diagnosis(
    found: FrictionSolution, model: Model, load: Array | None = None
) -> FrictionSolution:
    """The same record, whose detail names the bodies that contact can not hold.

    load (n,): forces on the free dofs, by default those of the model; only where it failed.
    """
    record = found.convergence
    if record.outcome in (Outcome.CONVERGED, Outcome.STOPPED):
        return found
    reason = model.imbalance(load)
    if reason is None:
        return found
    detail = "; ".join(text for text in (record.detail, reason.reason) if text)
    known = Obstruction.NO_SOLUTION if reason.is_proved else record.obstruction
    return replace(found, convergence=replace(record, detail=detail, obstruction=known))


def check_has_W(
    problem: FrictionProblem | Model, verb: str, deadline: Deadline = NEVER
) -> None:
    """Raise SingularOperator, naming the bodies, where contact alone holds one.

    Then M is singular, and W = H^T M^-1 H, which `verb` works with, does not exist.  Raises
    TimeUp where forming W takes longer than the deadline.
    """
    if isinstance(problem, FrictionProblem):
        try:
            problem.condensed(deadline)
        except SingularOperator as reason:
            raise SingularOperator(f"{verb}: contact alone holds a body, {NO_W}") from reason
        return
    names = problem.held_by_contact
    if not names:
        return
    reason = problem.imbalance()
    if reason is not None and reason.is_proved:  # at the whole load
        raise SingularOperator(f"{verb}: {reason}")
    raise SingularOperator(f"{verb}: contact alone holds {names}, {NO_W}{STEPS}")
