"""What questions ask of a problem before they begin: its law, its W, its discrete form."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.clock import TimeLimit, deadline_of
from ..core.errors import InvalidInput, TimeUp, UnsupportedForm, UnsupportedLaw
from ..problem.friction import FrictionProblem
from ..problem.law import Coulomb, Tresca
from .api import checked

if TYPE_CHECKING:
    from ..mechanics.model import Model

HUGE = 1e12  # friction above which rounding hides what the law says


def begun(time_limit: TimeLimit) -> TimeLimit:
    """The limit as a deadline from now on, so that assembling counts too; None without one."""
    return None if time_limit is None else deadline_of(time_limit)


def check_searchable(problem: FrictionProblem) -> None:
    """Raise UnsupportedForm where there is no mu to search with."""
    if isinstance(problem.law, Tresca):
        raise UnsupportedLaw(
            "all solutions: expected Coulomb friction; with given bounds (Tresca) there is one "
            "motion, see uniqueness"
        )
    if not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(
            f"all solutions: expected Coulomb friction, got {problem.law.name}"
        )


def discrete_of(problem: FrictionProblem | Model) -> FrictionProblem:
    """The problem, or that of a model; raises InvalidInput for friction without limits."""
    problem = checked(problem)
    discrete = problem if isinstance(problem, FrictionProblem) else problem.assemble()
    mu = discrete.law.mu if isinstance(discrete.law, Coulomb) else np.zeros(1)
    if (largest := float(mu.max(initial=0.0))) > HUGE:
        raise InvalidInput(
            f"mu: expected friction of at most {HUGE:g} to ask for all solutions, got "
            f"{largest:g}; contacts that can not slip are bonded, hold them by supports"
        )
    return discrete


def check_followed(problem: Any, verb: str, limit: TimeLimit) -> None:
    """Raise where a problem is no PathProblem, and has no load and friction to follow."""
    from ..analysis.paths.path import PathProblem

    if isinstance(problem, PathProblem):
        return
    discrete = checked(problem)
    check_has_W(discrete, verb, limit)
    if not discrete.contacts:
        why = "the state is in proportion to the load, one solve is all"
        if discrete.kind is not FrictionProblem:
            why = "no path is followed; add one that stays open, with an obstacle far away"
        raise UnsupportedForm(f"{verb}: without contacts {why}")


def check_has_W(problem: FrictionProblem | Model, verb: str, limit: TimeLimit) -> None:
    """Raise SingularOperator where `verb` needs W and contact alone holds a body."""
    if problem.kind.has_q:  # others are followed in displacements
        from ..mechanics.model.diagnosis import check_has_W as check
        from ..mechanics.steps.timed import steady

        examined = problem if isinstance(problem, FrictionProblem) else steady(problem)
        with suppress(TimeUp):  # the verb says so
            check(examined, verb, deadline_of(limit))


def checked_base(base: Any) -> FrictionProblem | Model | None:
    """What a path begins from, checked, if it was given."""
    return None if base is None else checked(base, "base")


def with_W(problem: FrictionProblem | Model, verb: str, limit: TimeLimit) -> FrictionProblem:
    """The discrete problem, whose W `verb` can have."""
    discrete = discrete_of(problem)
    if isinstance(discrete.law, Coulomb):  # else the verb says so
        check_has_W(problem, verb, limit)
    return discrete
