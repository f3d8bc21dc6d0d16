"""The contract of a solver: a frozen dataclass whose one method yields iterates.

A solver never stops itself and never judges itself; the driver in `driver.py` does both, and
sends its judgement into the generator: a solver that wants to know reads `judged = yield
iterate`.  What a published stopping rule asks for it tells in `Iterate.ends`.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.clock import NEVER, Deadline
from ..core.errors import InvalidInput, UnsupportedForm, UnsupportedLaw, shown
from ..core.words import near
from ..problem.friction import Form, FrictionProblem
from ..problem.judge.measures import Criterion
from ..problem.law import Coulomb
from ..problem.nitsche import NitscheProblem
from ..problem.protocol import Problem
from ..problem.status import ActiveSets

Array = NDArray[np.float64]


class Breakdown(Exception):
    """A solver can not go on; the reason becomes the detail of the outcome."""


@dataclass(frozen=True, eq=False)
class Iterate:
    """One state of a solver: reactions r, (nc, d), and v, (n,), if the solver has it.

    ends: None where the judge alone decides; of a method with a stopping rule of its own, ""
    while that asks for more, then the reason why it ends here.
    goes_on: where its error will do but not its weakest contact, the method goes on to the
    tighter goal that it is told; others are started again from here.
    """

    r: Array
    v: Array | None = None
    iterations: int = 1  # how many iterations this state is ahead of the one before
    linear_iterations: int = 0
    stage: str = ""  # which stage of a portfolio made it
    sets: ActiveSets | None = None  # of a method that decides by sets of contacts
    ends: str | None = None
    flops: float | None = None  # floating point operations since the last; None: not counted
    own: tuple[float, ...] = ()  # own measure of each iteration since the last, where known
    goes_on: bool = False


class Judgement(NamedTuple):
    """What the driver tells a solver of the iterate that it has just handed out.

    error: by the criterion of the target; contact_error: of the weakest contact on its own
    scale, None while the error alone will not do; deadline: at which the driver will stop;
    goal: the error that will do, at most that of the target.
    """

    error: float
    contact_error: float | None = None
    deadline: Deadline = NEVER
    goal: float = np.inf

    @property
    def seconds_left(self) -> float:
        """Time until the deadline, 0 when it has passed."""
        return self.deadline.left


Iterates = Generator[Iterate, Judgement | None, None]


@dataclass(frozen=True)
class Target:
    """What the driver will ask for: a hint for stages that run inside one compiled call."""

    tolerance: float
    deadline: Deadline = NEVER  # at which the driver will stop
    criterion: Criterion = Criterion.JUDGE  # what the tolerance is for
    start_error: float = np.inf  # of the start, infinite where its motion is not known

    @property
    def seconds_left(self) -> float:
        """Time until the deadline, 0 when it has passed."""
        return self.deadline.left

    def error(
        self, problem: Problem, iterate: Iterate, judged: Judgement | None = None
    ) -> float:
        """The error that the driver sees: what it has told, evaluated where nobody told."""
        if judged is not None:
            return judged.error
        if self.criterion is Criterion.JUDGE:
            return problem.error(iterate.r, iterate.v)
        return problem.natural_error(iterate.r, iterate.v)


@dataclass
class Patience:
    """Notices that errors no longer fall.

    It is over after more than `most` errors in a row none of which was below `factor` times the
    last one that counted, `mark`.
    """

    most: int
    factor: float = 0.5
    mark: float = np.inf
    waited: int = 0

    def over(self, error: float) -> bool:
        """Take note of the next error."""
        if error < self.factor * self.mark:
            self.mark, self.waited = error, 0
        else:
            self.waited += 1
        return self.waited > self.most


class Solver(Protocol):
    """Options as fields; `iterates` yields until the driver stops asking.

    It is a generator, which is sent a `Judgement` of each iterate, or a plain iterator.  Class
    variables say what it takes, see `Takes`.
    """

    def iterates(self, problem: Any, start: Iterate, target: Target) -> Iterator[Iterate]:
        """Iterates from `start`; raises Breakdown with a reason when there is no next one."""
        ...


class Takes(NamedTuple):
    """What a solver takes: class variables of these names, or the defaults here.

    solves: types of problems, of one's own too; FrictionProblem by default, and NitscheProblem
    of a solver with nitsche = True.  form: which one of a FrictionProblem.  matrix_free: True
    where its M may be an operator (`GridMatrix`); else the driver assembles it.  needs_cone:
    True where it takes Coulomb's law alone, not all laws of `problem.law`; changes of variables
    are none of a solver's business, see `solvers.changed_law`.  changes_method: True where it
    goes on with another method when one stalls, so that a repeated iterate is not the end.
    """

    solves: tuple[type, ...] = (FrictionProblem,)
    form: Form = Form.ANY
    matrix_free: bool = False
    needs_cone: bool = False
    changes_method: bool = False


def taken_by(solver: Any) -> Takes:
    """What a solver, or a class of solvers, takes."""
    return _taken(solver if isinstance(solver, type) else type(solver))


@cache
def _taken(kind: Any) -> Takes:
    also = (NitscheProblem,) if getattr(kind, "nitsche", False) else ()
    return Takes(
        getattr(kind, "solves", (FrictionProblem, *also)),
        getattr(kind, "form", Form.ANY),
        getattr(kind, "matrix_free", False),
        getattr(kind, "needs_cone", False),
        getattr(kind, "changes_method", False),
    )


def check_solver(solver: Solver) -> None:
    """Raise InvalidInput for what is no solver."""
    if isinstance(solver, type) or not hasattr(solver, "iterates"):
        raise InvalidInput(
            f"solver: expected an instance such as GaussSeidel(), got {_written(solver)}"
        )


def _written(solver: object) -> str:
    """What was given for a solver, and what is to be written for it."""
    if isinstance(solver, type):
        return f"the class; write {solver.__name__}()"
    if isinstance(solver, str):
        from . import METHODS

        meant = near(solver, METHODS)
        return f"{solver!r}" + (f"; write {METHODS[meant].__name__}()" if meant else "")
    return shown(solver)


def fitted(problem: Problem, solver: Solver, deadline: Deadline | None) -> Problem:
    """The problem as the solver takes it; raises UnsupportedForm where it does not.

    deadline: of condensing it where need be; None to raise UnsupportedForm instead.
    """
    takes = taken_by(solver)
    if not isinstance(problem, takes.solves):
        check_solves(solver, type(problem))
    if takes.needs_cone and not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(
            f"{type(solver).__name__} needs Coulomb's cone, the problem has "
            f"{problem.law.name}; use Auto, SemismoothNewton or GaussSeidel", ("solver",), "",
        )  # fmt: skip
    if takes.form is Form.DELASSUS and deadline is not None:
        problem = problem.condensed(deadline)
    if Form.ANY not in (takes.form, problem.form) and takes.form is not problem.form:
        local = takes.form is Form.DELASSUS
        hint = "problem.condensed()" if local else "Auto or a solver of the local form"
        raise UnsupportedForm(
            f"{type(solver).__name__} needs the {takes.form.value} form, the problem is "
            f"{problem.form.value}; use {hint}", ("solver",), "",
        )  # fmt: skip
    return problem if takes.matrix_free else problem.assembled()


def check_solves(solver: Any, kind: type[Problem]) -> None:
    """Raise UnsupportedForm where a solver does not take problems of that class."""
    if not issubclass(kind, taken_by(solver).solves):
        why = getattr(kind, "unfit", f"expected a discrete problem, got a {kind.__name__}")
        raise UnsupportedForm(why, ("solver",), type(solver).__name__)


def check_positive(**fields: float) -> None:
    """Raise InvalidInput for the first option that is not a positive finite number."""
    for name, value in fields.items():
        if not (value > 0 and np.isfinite(value)):
            raise InvalidInput(f"expected a positive number, got {value}", (name,))


def check_at_least(minimum: int, **fields: int) -> None:
    """Raise InvalidInput for the first option below `minimum`."""
    for name, value in fields.items():
        if value < minimum:
            raise InvalidInput(f"expected at least {minimum}, got {value}", (name,))


NUMBERS = int | float | np.number


def _check_number(name: str, value: object) -> None:
    if not isinstance(value, NUMBERS) or isinstance(value, bool):
        raise InvalidInput(f"{name}: expected a number, got {shown(value)}")
    if isinstance(value, int) and value.bit_length() > 1000:  # more than a float can hold
        raise InvalidInput(f"{name}: expected a number that floats can hold, got a larger one")


def check_goals(
    tolerance: float, contact_tolerance: float | None, max_iterations: int | None
) -> None:
    """Raise InvalidInput for what are no tolerances or no number of iterations."""
    _check_number("tolerance", tolerance)
    if contact_tolerance is not None:
        _check_number("contact_tolerance", contact_tolerance)
        if not contact_tolerance > 0:
            raise InvalidInput(
                f"contact_tolerance: expected a number > 0, got {contact_tolerance}"
            )
    if max_iterations is not None:
        _check_number("max_iterations", max_iterations)
    if not (0 < tolerance < 1):
        raise InvalidInput(f"tolerance: expected between 0 and 1, got {tolerance}")
    if max_iterations is not None and max_iterations < 1:
        raise InvalidInput(f"max_iterations: expected at least 1, got {max_iterations}")
