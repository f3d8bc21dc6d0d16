"""The contract of a solver: a frozen dataclass whose one method yields iterates.

A solver never stops itself and never judges itself; the driver in `driver.py` does both.  What
a published stopping rule asks for it tells in `Iterate.ends`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.clock import NEVER, Deadline
from ..core.errors import InvalidInput
from ..problem.friction import Form, FrictionProblem
from ..problem.judge.measures import Criterion, published_natural_error
from ..problem.status import ActiveSets

Array = NDArray[np.float64]


class Breakdown(Exception):
    """A solver can not go on; the reason becomes the detail of the outcome."""


@dataclass(frozen=True, eq=False)
class Iterate:
    """One state of a solver: reactions r, (nc, d), and v, (n,), if the solver has it.

    ends: None where the judge alone decides; of a method with a stopping rule of its own, ""
    while that asks for more, then the reason why it ends here.
    """

    r: Array
    v: Array | None = None
    iterations: int = 1  # how many iterations this state is ahead of the one before
    linear_iterations: int = 0
    stage: str = ""  # which stage of a portfolio made it
    sets: ActiveSets | None = None  # of a method that decides by sets of contacts
    ends: str | None = None
    flops: float | None = None  # floating point operations since the last; None: not counted


@dataclass(frozen=True)
class Target:
    """What the driver will ask for: a hint for stages that run inside one compiled call."""

    tolerance: float
    deadline: Deadline = NEVER  # at which the driver will stop
    criterion: Criterion = Criterion.JUDGE  # what the tolerance is for

    @property
    def seconds_left(self) -> float:
        """Time until the deadline, 0 when it has passed."""
        return self.deadline.left

    def error(self, problem: FrictionProblem, iterate: Iterate) -> float:
        """The error that the driver will see."""
        if self.criterion is Criterion.JUDGE:
            return problem.error(iterate.r, iterate.v)
        return natural_error_of(problem, iterate.r, iterate.v)


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


def natural_error_of(problem: FrictionProblem, r: Array, v: Array | None = None) -> float:
    """[ABD] eq. (13) of reactions r, (nc, d), with v, (n,), if it is known."""
    if v is not None and problem.form is Form.GLOBAL:
        u = problem.local_velocity(v)
    else:
        u = problem.velocity(r)[0]
    return published_natural_error(r, u, problem.free_velocity, problem.law)


class Solver(Protocol):
    """Options as fields; `iterates` yields until the driver stops asking.

    A solver with a class variable matrix_free = True also takes problems whose M is an operator
    (`GridMatrix`); for others the driver assembles it.  One with nitsche = True also takes a
    `NitscheProblem`, where v alone is unknown and r follows from it.
    """

    form: ClassVar[Form]

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Iterates from `start`; raises Breakdown with a reason when there is no next one."""
        ...


def check_positive(**fields: float) -> None:
    """Raise InvalidInput for the first option that is not a positive finite number."""
    for name, value in fields.items():
        if not (value > 0 and np.isfinite(value)):
            raise InvalidInput(f"{name}: expected a positive number, got {value}")


def check_at_least(minimum: int, **fields: int) -> None:
    """Raise InvalidInput for the first option below `minimum`."""
    for name, value in fields.items():
        if value < minimum:
            raise InvalidInput(f"{name}: expected at least {minimum}, got {value}")
