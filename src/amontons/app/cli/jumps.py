"""`amontons run --rates`: in which steps a body can jump, told as it goes and at the end."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from ...analysis.certificates.rates import Rates, RateVerdict, rates
from ...core.errors import InvalidInput, SingularOperator, TimeUp, UnsupportedLaw
from ...io.readers import Case
from ...mechanics.steps import State, TimeStep
from ...mechanics.steps.moreau_jean import MoreauJean
from ...problem.friction import FrictionProblem

Array = NDArray[np.float64]
SHOWN = 12  # times that a line names


def check_rates(case: Case) -> None:
    """Raise InvalidInput where rates say nothing of a case: dynamics, large deformations."""
    assert case.evolution is not None
    if isinstance(case.evolution.method, MoreauJean):
        raise InvalidInput("--rates: expected quasi-static steps; in dynamics nothing jumps")
    if case.model.kind is not FrictionProblem:
        raise InvalidInput("--rates: expected small strains with contact in Delassus form")


@dataclass
class Jumps:
    """The verdicts of the steps so far; last (nc, d): reactions of the step before."""

    last: Array | None = None
    times: dict[str, list[float]] = field(default_factory=dict)
    why: str = ""  # of the last step of which nothing is known

    @classmethod
    def after(cls, start: State) -> Jumps:
        """Going on from a state; at rest nothing is known of a step before."""
        return cls(start.force if start.index else None)

    def note(self, step: TimeStep, *, quiet: bool) -> dict[str, Any]:
        """Ask of a step, say so where it can jump; what solution.json holds of it."""
        found = self._asked(step)
        self.last = step.state.force
        if not isinstance(found, Rates):
            verdict, record = "undecided", {"jump_possible": None, "reason": found}
        else:
            verdict, record = found.verdict.value, found.record
        self.why = str(record["reason"]) if record["jump_possible"] is None else self.why
        self.times.setdefault(verdict, []).append(step.time)
        if record["jump_possible"] and not quiet:
            click.echo(f"t = {step.time:.6g}: {found}")
        return record

    def _asked(self, step: TimeStep) -> Rates | str:
        problem, known = step.problem, self.last
        if not isinstance(problem, FrictionProblem):
            return "only small strains are examined"
        if known is not None and known.shape != step.solution.r.shape:
            known = None  # other contacts than before
        try:
            return rates(problem, step.solution, known)
        except (InvalidInput, SingularOperator, TimeUp, UnsupportedLaw) as reason:
            return str(reason)

    def lines(self) -> list[str]:
        """For the closing summary."""
        out = []
        for verdict, times in self.times.items():
            if verdict == RateVerdict.IMPOSSIBLE.value:
                out.append(f"{verdict}: proved of {len(times)} steps")
                continue
            named = ", ".join(f"{time:.6g}" for time in times[:SHOWN])
            more = ", …" if len(times) > SHOWN else ""
            why = f"; the last: {self.why}" if verdict == "undecided" else ""
            out.append(f"{verdict}: in the steps to t = {named}{more}{why}")
        return out
