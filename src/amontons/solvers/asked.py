"""What is asked of a solve: tolerances and limits, checked, with the defaults of `drive`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ..core.clock import Deadline, TimeLimit, deadline_of
from ..core.errors import InvalidInput, UnsupportedForm, shown
from ..problem.judge.measures import Criterion
from ..problem.protocol import Problem
from ..problem.solution import Step
from .contract import Iterate, check_goals

Callback = Callable[[Step, Iterate], bool | None]
PATIENCE = 500  # iterates without any progress before a solve counts as stagnated


@dataclass(eq=False, slots=True)
class Asked:
    """What `drive` is asked for, whose docstring tells what each field means; never changed.

    It is not frozen, as that sets every field by a call: 1 of the 47 us of a small solve.
    The time begins when it is made, so that what a solve needs first counts too.  Raises
    InvalidInput for what is no such option.
    """

    tolerance: float = 1e-8
    contact_tolerance: float | None = None
    max_iterations: int | None = None
    time_limit: TimeLimit = None
    callback: Callback | None = None
    criterion: Criterion = Criterion.JUDGE
    patience: int | None = PATIENCE
    condense: bool = False
    deadline: Deadline = field(init=False)  # when the time is over
    of_contacts: float = field(init=False)  # the contact tolerance that holds

    def __post_init__(self) -> None:
        if self.callback is not None and not callable(self.callback):
            raise InvalidInput(f"callback: expected a function, got {self.callback!r}")
        check_goals(self.tolerance, self.contact_tolerance, self.max_iterations)
        given = self.contact_tolerance
        self.deadline = self.time_limit = deadline_of(self.time_limit)
        self.of_contacts = self.tolerance**0.5 if given is None else given
        if not isinstance(self.criterion, Criterion):
            words = ", ".join(f"Criterion.{member.name}" for member in Criterion)
            got = shown(self.criterion)
            raise InvalidInput(f"criterion: expected one of {words}, got {got}")
        whole = isinstance(self.patience, int) and not isinstance(self.patience, bool)
        if self.patience is not None and not (whole and self.patience >= 1):
            raise InvalidInput(
                f"patience: expected a whole number >= 1, or None, got {shown(self.patience)}"
            )

    def check_fits(self, problem: Problem) -> None:
        """Raise UnsupportedForm where a problem has no such criterion."""
        if self.criterion is not Criterion.JUDGE and not problem.has_q:
            raise UnsupportedForm(
                f"criterion {self.criterion.value}: |F_nat(r)| / |q| needs a problem in r, "
                "with a q"
            )
