"""What a solve returns: reactions, velocities, a status for every contact, and the record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.clock import duration
from ..core.errors import SingularOperator
from ..core.faces import Differentiated, Shown
from ..core.locks import KeepsLocks
from ..core.warned import ResultWarning
from .judge import measures as judge
from .judge.measures import Measure
from .law import Law
from .law.states import ContactStatus
from .protocol import Problem
from .settling import Settled
from .status import ActiveSets, classify, margins

Array = NDArray[np.float64]
TELLING = 0.1  # seconds of compiling from which the record says so


class Outcome(Enum):
    """How a solve ended; the value is a sentence of advice."""

    CONVERGED = "The independent error measure is below the tolerance."
    MAX_ITERATIONS = "Allow more iterations, or try method 'auto', which changes methods."
    TIME_LIMIT = "Allow more time, start from this solution, or loosen the tolerance."
    STAGNATED = (
        "The error no longer falls: try method 'auto' or 'proximal-point', loosen the "
        "tolerance, or check whether the problem has a solution."
    )
    CYCLED = (
        "The iterates repeat: use a line search, start from 'gauss-seidel', "
        "or try method 'auto'."
    )
    NON_FINITE = "The iterates overflowed: check units and friction, or try method 'auto'."
    BREAKDOWN = "The method can not go on here: see the detail, and try method 'auto'."
    WEAK_CONTACTS = (
        "The sum of all errors is below the tolerance, but single contacts with small loads "
        "are not settled: see `weakest`; allow more time, or raise contact_tolerance where "
        "only the sum matters."
    )
    STOPPED = "Stopped on request; the best iterate so far is kept."

    @property
    def advice(self) -> str:
        """What the user can do about it."""
        return self.value


HAS_TRIED = {  # where the method is 'auto' already
    Outcome.MAX_ITERATIONS: "Allow more iterations.",
    Outcome.STAGNATED: "The error no longer falls: loosen the tolerance, or check the problem.",
    Outcome.NON_FINITE: "The iterates overflowed: check units and friction.",
    Outcome.BREAKDOWN: "The methods can not go on here: see the detail.",
}
IN_STEPS = {  # of large deformations, where no other method is
    Outcome.MAX_ITERATIONS: "Allow more iterations, or go there in smaller steps.",
    Outcome.STAGNATED: "The error no longer falls: go there in smaller steps, or loosen the "
    "tolerance.",
    Outcome.NON_FINITE: "The iterates overflowed: check units and friction.",
    Outcome.BREAKDOWN: "See the detail; go there in smaller steps (evolve), or where a body "
    "jumps with NonlinearNewton(crossing=PathCrossing()).",
}


class StoppedBy(Enum):
    """Who ended a solve with the outcome STOPPED."""

    USER = "by the user"  # Ctrl-C
    CALLBACK = "by the callback"
    RULE = "by its own rule"  # a stopping rule that belongs to the method


class Obstruction(Enum):
    """What in the problem itself keeps methods from a solution; the value is advice."""

    NO_SOLUTION = "Hold what gives way by a support, or change loads or friction."
    INDEFINITE = (
        "No body stores negative energy: check the signs and the order of the rows of the "
        "matrices."
    )
    UNREACTING = "No reaction can open that contact: check its rows of H or W, and its gap."


class Step(NamedTuple):
    """One line of the history: what the driver saw after an iterate."""

    iteration: int
    error: float
    linear_iterations: int
    seconds: float
    sets: ActiveSets | None = None  # of an active set method
    flops: float | None = None  # floating point operations so far; None: not counted
    stage: str = ""  # which method of a combination made it
    own: tuple[float, ...] = ()  # errors since the last, by the method's own measure; unjudged


@dataclass(frozen=True, eq=False, repr=False)
class Convergence(Shown):
    """The record of a solve."""

    outcome: Outcome
    iterations: int
    error: float  # of the returned iterate, by the judge
    tolerance: float
    history: tuple[Step, ...]
    linear_iterations: int
    seconds: float
    solver: str
    measure: Measure
    detail: str = ""
    contact_error: float | None = None  # of the weakest contact on its own scale
    contact_tolerance: float = np.inf
    weakest: int | None = None  # that contact; None where all obey their laws exactly
    compiling: float = 0.0  # seconds of preparing compiled code, which no other time holds
    flops: float | None = None  # floating point operations, judgements among them; see docs
    stopped_by: StoppedBy | None = None  # of the outcome STOPPED
    obstruction: Obstruction | None = None  # what was found of one where a solve failed

    @property
    def sets_settled(self) -> int | None:
        """The first iteration with the final active sets, kept from then on; None without."""
        last = self.history[-1] if self.history else None
        return None if last is None or last.sets is None else last.iteration - last.sets.kept

    @property
    def by_user(self) -> bool:
        """True where Ctrl-C ended the solve."""
        return self.stopped_by is StoppedBy.USER

    @property
    def advice(self) -> str:
        """What the user can do about it, knowing what was found and what was tried."""
        if self.obstruction is not None:
            return self.obstruction.value
        known = {"Auto": HAS_TRIED, "NonlinearNewton": IN_STEPS}.get(self.solver, {})
        return known.get(self.outcome, self.outcome.advice)

    @property
    def stamp(self) -> str:
        """What figures and files show of what has not converged; "" of what has."""
        if self.outcome is Outcome.CONVERGED:
            return ""
        return f"NOT CONVERGED ({self.outcome.name.lower().replace('_', ' ')}, {self.errors})"

    @property
    def errors(self) -> str:
        """The error beside its tolerance, and that of the weakest contact where it decides."""
        sign = "<=" if self.error <= self.tolerance else ">"
        text = f"error {self.error:.1e} {sign} {self.tolerance:.0e}"
        of_contact = self.contact_error if self.weakest is not None else None
        if of_contact is None or of_contact <= self.contact_tolerance:
            return text
        return (
            f"{text}, contact {self.weakest} {of_contact:.1e} > "
            f"{self.contact_tolerance:.0e} of its own scale"
        )

    def __str__(self) -> str:
        text = (
            f"{self.outcome.name.lower().replace('_', ' ')} with {self.solver}: {self.errors} "
            f"after {self.iterations} iterations in {self.seconds:.3g} s"
        )
        if self.compiling >= TELLING:
            text += f", after {duration(self.compiling)} of compiling"
        return f"{text} ({self.detail})" if self.detail else text


@dataclass(frozen=True, eq=False, repr=False)
class FrictionSolution(Differentiated, KeepsLocks):
    """Reactions and velocities of a discrete problem, and what they mean.

    r, u: (nc, d) in the local frames; v: (n,) or None in the Delassus form; warnings: reasons
    to doubt a result that has converged; settled: the statuses that a converged r keeps to,
    told in the form in which it was solved, so that another form does not tell others.
    follows: the law of which that of the problem has the coefficients at this state, None where
    they are given.
    """

    problem: Problem
    r: Array
    u: Array
    v: Array | None
    convergence: Convergence
    warnings: tuple[ResultWarning, ...] = ()
    settled: Settled | None = None
    follows: Law | None = None

    @cached_property
    def _classified(self) -> tuple[NDArray[np.int8], NDArray[np.bool_], Array]:
        problem = self.problem
        if self.settled is not None:
            status = self.settled.status
            return status, self.settled.sliding, margins(problem, self.r, self.u, status)
        return classify(problem, self.r, problem.lawful(self.u, self.v))

    @property
    def status(self) -> NDArray[np.int8]:
        """ContactStatus of every contact, (nc,)."""
        return self._classified[0]

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """True where the law lets a contact slide, (nc,): with Tresca friction also if open."""
        return self._classified[1]

    @property
    def margin(self) -> Array:
        """Distance of every contact to its next status, (nc,), in the unit of r_N."""
        return self._classified[2]

    def __post_init__(self) -> None:
        for array in (self.r, self.u, self.v):
            if array is not None:
                array.flags.writeable = False

    @property
    def converged(self) -> bool:
        """True when the judge agrees with the tolerance."""
        return self.convergence.outcome is Outcome.CONVERGED

    @property
    def pattern(self) -> str:
        """Status of all contacts in order: f free, s stick, slip is + or - (2D) or l (3D)."""
        letters = np.array(["f", "l", "s"])[self.status]
        if self.r.shape[1] == 2:
            slip = self.status == ContactStatus.SLIP
            letters[slip] = np.where(self.r[slip, 1] >= 0, "+", "-")
        return "".join(letters)

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of open, slipping and sticking contacts."""
        return {s.name.lower(): int((self.status == s).sum()) for s in ContactStatus}

    @property
    def fclib_error(self) -> float | None:
        """The published FCLib error, for comparison only: it depends on the units.

        None where it is not defined: M is singular and there is no q, the solve was stopped
        before M was factorised, or Nitsche's method has no q at all.
        """
        return self._published(judge.published_fclib_error)

    @property
    def natural_error(self) -> float | None:
        """|r - P_K(r - û)| / |q|, for comparison only; None as `fclib_error`.

        V. Acary, M. Brémond, F. Dubois, CSMA 2017, eq. (13).
        """
        return self._published(judge.published_natural_error)

    def _published(self, measure: Callable[[Array, Array, Array, Law], float]) -> float | None:
        p = self.problem
        if not p.has_q or not self.convergence.history:
            return None
        try:
            q = p.free_velocity
        except SingularOperator:
            return None
        return measure(self.r, self.u, q, p.law)

    @property
    def max_penetration(self) -> float:
        """Largest -u_N, unit of u."""
        return judge.max_penetration(self.u)

    @property
    def max_cone_violation(self) -> float:
        """Largest excess of |r_T| over its bound, unit of r."""
        return judge.max_cone_violation(self.r, self.problem.law)

    @property
    def headline(self) -> str:
        """The problem and its numbers of contacts by status, in words."""
        c = self.counts
        name = self.problem.name or "friction problem"
        if not self.problem.contacts:
            return f"{name}: no contacts in {self.problem.dimension}D"
        return (
            f"{name}: {self.problem.contacts} contacts in {self.problem.dimension}D: "
            f"{c['open']} open, {c['slip']} slip, {c['stick']} stick"
        )

    def __str__(self) -> str:
        return f"{self.headline}\n{self.convergence}"
