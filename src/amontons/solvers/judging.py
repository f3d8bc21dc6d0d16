"""One solve as the driver sees it: judge every iterate, know the best one, stop, record.

An iterate has converged when its error is below the tolerance and so is, on its own scale, that
of its weakest contact (`judge`).  Where only the first holds, the solver is started again from
there with a tolerance that promises the second; where that does not come about, the outcome is
WEAK_CONTACTS.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..core.clock import compiling, now
from ..core.errors import SingularOperator, TimeUp
from ..core.interrupts import Watching
from ..problem.judge.measures import EPSILON, Criterion, Measure, Weakest
from ..problem.law.law import MU
from ..problem.protocol import Problem
from ..problem.settling import Accepted
from ..problem.solution import Convergence, FrictionSolution, Outcome, Step, StoppedBy
from .asked import Asked
from .contract import Breakdown, Iterate, Judgement, Solver, Target, taken_by
from .first_iterate import own_motion, with_motion

Array = NDArray[np.float64]
Taken = Callable[[Problem, Iterate], Iterate]
MEMORY = 64  # iterates among which a repetition counts as a cycle
AT_REST = 1e-10  # relative change of r below which an iterate has not moved
PROGRESS = 0.99  # the best error must fall at least by this factor within PATIENCE
BLUR = 1e-2  # rounding, relative to the tolerance, above which an error is evaluated sharply
BLURRED = 20  # iterates that would do if rounding could hide no error in them
TIGHTER = 0.3  # goal of a second start, relative to what would just do
TIGHTEST = 1e-300  # smallest goal: contacts far smaller than others need tiny sums
NOT_HELD = ("M has no inverse, something moves without a strain: a mechanism, or elements "
            "whose reduced integration feels no bending")  # fmt: skip
CONTENT = 5  # iterates with which a solver is content before its goal is tightened: Newton is
# there with one more, and keeps its history
EARLY = 20  # iterates after which a problem that no method is made for is given up
GAVE_UP = (Outcome.STAGNATED, Outcome.BREAKDOWN, Outcome.CYCLED, Outcome.NON_FINITE)


@dataclass
class Watch:
    """The driver's memory of one solve."""

    problem: Problem
    asked: Asked
    method: str  # name of the solver
    taken: Taken = own_motion  # what of an iterate is judged
    started: float = field(default_factory=now)
    compiled: float = field(default_factory=compiling)  # until then
    best: Iterate | None = None
    told: Accepted | None = None  # of the best iterate where it is good enough
    error: float = np.inf
    weakest: Weakest | None = None  # contact of the best iterate, once its error will do
    last: Weakest | None = None  # that of the last iterate
    iterations: int = 0
    linear_iterations: int = 0
    flops: float | None = 0.0  # None from the first iterate on that does not count its own
    history: list[Step] = field(default_factory=list)
    seen: list[tuple[float, Array]] = field(default_factory=list)
    cycled: bool = False  # the last iterate was here before
    goal: float = 0.0  # error that the solver is asked for, perhaps below the tolerance
    content: int = 0  # iterates in a row that the judge would take, but not the criterion
    blurred: int = 0  # iterates whose error rounding hides
    mark: tuple[int, float] = (0, np.inf)  # iterate and error of the last real progress
    stopped_by: StoppedBy | None = None  # who has asked for the end

    def judge(self, iterate: Iterate) -> Step:
        """Judge an iterate, note it, and remember it if it is the best."""
        judged = self.taken(self.problem, iterate)
        error, weakest, told = self._measured(judged.r, judged.v)
        self.cycled = error > self.goal and self._was_here(iterate.r, error)
        if told is not None and told.r is not judged.r:
            judged = replace(judged, r=told.r, v=told.v)
        return self._noted(judged, error, weakest, told)

    def _measured(
        self, r: Array, v: Array | None
    ) -> tuple[float, Weakest | None, Accepted | None]:
        """The error by the criterion; where it will do, the weakest contact and the state."""
        error = self.problem.error(r, v)
        if self.asked.criterion is Criterion.NATURAL:
            self.content = self.content + 1 if error <= self.goal else 0
            return self.problem.natural_error(r, v), None, None
        if not error <= self.asked.tolerance:
            return error, None, None
        told = self.problem.accepted(r, v, error, self.asked.tolerance)
        error, weakest = told.error, told.weakest
        if weakest is not None and weakest.hidden > BLUR * self.asked.tolerance:
            error = self.problem.certain_error(told.r, told.v)
            if error > self.asked.tolerance:
                weakest = None
                self.blurred += 1
        return error, weakest, told

    def _noted(
        self, iterate: Iterate, error: float, weakest: Weakest | None,
        told: Accepted | None,
    ) -> Step:  # fmt: skip
        """The line of the history about an iterate that has been judged."""
        self.iterations += iterate.iterations
        self.linear_iterations += iterate.linear_iterations
        seconds = now() - self.started
        self.flops = self._counted(iterate)
        step = Step(
            self.iterations, error, self.linear_iterations, seconds, iterate.sets, self.flops,
            iterate.stage, iterate.own,
        )  # fmt: skip
        self.history.append(step)
        self.last = weakest
        if self.best is None or self._better(error, weakest):
            self.best, self.error, self.weakest = iterate, error, weakest
            self.told = told
        if error < PROGRESS * self.mark[1]:
            self.mark = (len(self.history), error)
        return step

    @property
    def judgement(self) -> Judgement:
        """What a solver is told of its last iterate."""
        weakest = None if self.last is None else self.last.error
        return Judgement(self.history[-1].error, weakest, self.asked.deadline, self.goal)

    def late(self, iterations: int) -> bool:
        """True when the time is over, of which the last iterate took so many iterations."""
        deadline = self.asked.deadline
        if deadline.work is not None:  # it counts operations, no seconds
            deadline.spend(iterations * self.problem.operations)
        return deadline.passed

    def _counted(self, iterate: Iterate) -> float | None:
        """Floating point operations so far, judgements among them; None if not counted."""
        if self.flops is None or (iterate.flops is None and iterate.iterations):
            return None
        return self.flops + (iterate.flops or 0.0) + self.problem.judge_flops

    def _better(self, error: float, weakest: Weakest | None) -> bool:
        """True for an error below the best; of those that will do, for the better contacts."""
        if weakest is None or self.weakest is None:
            return error < self.error
        return weakest.error < self.weakest.error

    @property
    def converged(self) -> bool:
        """True when the best iterate will do in the sum and at every contact."""
        good = self.error <= self.asked.tolerance
        return good and (self.weakest is None or self.weakest.error <= self.asked.of_contacts)

    @property
    def weak(self) -> bool:
        """True when the best iterate will do in the sum alone."""
        return self.error <= self.asked.tolerance and not self.converged

    @property
    def in_words(self) -> str:
        """Why the best iterate will not do though its error is small; "" where it would."""
        if self.asked.criterion is Criterion.NATURAL:
            return ""
        if self.best is not None and not self.converged:
            hidden = self.problem.rounding(self.best.r)
            mu = self.problem.law.parameters[:, MU].max(initial=0.0)
            if mu * EPSILON > self.asked.tolerance:
                return (
                    f"rounding of the slip, times friction of {mu:.0e}, is above the "
                    "tolerance: hold contacts that can not slip by supports, or take mu below "
                    "1e7"
                )
            if hidden > self.asked.tolerance:
                return (
                    f"rounding alone may hide an error of {hidden:.1e}: reactions are huge "
                    "beside what loads the contacts"
                )
        if not self.weak or self.weakest is None:
            return ""
        return (
            f"contact {self.weakest.contact} misses its law by {self.weakest.error:.1e} on its "
            f"own scale, {self.asked.of_contacts:.0e} is allowed"
        )

    def tighten(self) -> None:
        """Choose the next goal for the error, so that the weakest contact will do too."""
        self.goal = self._tighter(self.goal)
        self.content = 0

    def _tighter(self, goal: float) -> float:
        if self.asked.criterion is Criterion.NATURAL:
            return TIGHTER * goal * min(self.asked.tolerance / self.error, 1.0)
        assert self.weakest is not None
        share = TIGHTER * self.asked.of_contacts / self.weakest.error
        return max(min(self.error * share, TIGHTER * goal), np.finfo(float).tiny)

    def _was_here(self, r: Array, error: float) -> bool:
        """True when this iterate was here before, with other iterates in between.

        One that hardly moves does not come back: its method may wait for something else.
        """
        near = 1e-12 * error
        alike = [not abs(old_error - error) > near for old_error, _ in self.seen]
        earlier = self.seen.copy()
        self.seen.append((error, r))
        del self.seen[:-MEMORY]
        if not any(alike):
            return False
        size = np.abs(r).max(initial=0.0)
        same = [
            like and bool(np.abs(old - r).max(initial=0.0) <= 1e-13 * size)
            for like, (_, old) in zip(alike, earlier, strict=True)
        ]
        if not any(same) or same[-1]:
            return False
        return bool(np.abs(earlier[-1][1] - r).max(initial=0.0) > AT_REST * size)

    @property
    def stagnated(self) -> bool:
        """True when the best error has not moved for `patience` iterates.

        Or when rounding has hidden that of BLURRED ones: more of them will not be known better.
        """
        if self.asked.patience is None:
            return False
        return len(self.history) - self.mark[0] > self.asked.patience or self.blurred > BLURRED


def sent(iterates: Iterator[Iterate], judgement: Judgement | None) -> Iterate | None:
    """The next iterate of a solver that is told of its last one; None at the end.

    judgement: None for the first.  An iterator that is no generator is not told.
    """
    send = getattr(iterates, "send", None)
    try:
        return next(iterates) if send is None else send(judgement)
    except StopIteration:
        return None


def first_of(
    iterates: Iterator[Iterate], count: float = np.inf
) -> Generator[Iterate, Judgement | None, Iterate | None]:
    """The first `count` iterates of a solver, told what is sent; returns the last of them."""
    last, judged = None, None
    while count > 0 and (iterate := sent(iterates, judged)) is not None:
        judged = yield iterate
        last, count = iterate, count - 1
    return last


def run(
    watching: Watching,
    watch: Watch,
    solver: Solver,
    start: Iterate,
) -> tuple[Outcome, str]:
    """Start the solver, and again with a tighter goal while only contacts are not settled."""
    asked = watch.asked
    try:
        watch.problem.prepare(asked.deadline)
        watch.judge(with_motion(watch.problem, start))
        if watch.converged:
            return Outcome.CONVERGED, ""
        known = start.v is not None or watch.problem.measure is Measure.EXACT
        error = watch.error if known else np.inf
        target = Target(asked.tolerance, asked.deadline, asked.criterion, error)
        watch.goal = asked.tolerance
        ended: tuple[Outcome, str] | None = (Outcome.STAGNATED, "")
        while watch.goal >= TIGHTEST:
            if watch.weak or ended is None:
                watch.tighten()
                start = watch.best or start
                target = replace(target, tolerance=watch.goal, start_error=watch.error)
            ended = _once(watching, watch, solver, start, target)
            if ended is not None:
                break
        outcome, detail = ended or (Outcome.STAGNATED, "")
    except TimeUp:
        outcome, detail = Outcome.TIME_LIMIT, ""
    except KeyboardInterrupt:
        return _stopped(watch, StoppedBy.USER)
    if outcome is Outcome.CONVERGED:
        return outcome, detail
    if watch.weak and outcome in GAVE_UP:
        return Outcome.WEAK_CONTACTS, watch.in_words
    return outcome, "; ".join(text for text in (detail, watch.in_words) if text)


def _once(
    watching: Watching,
    watch: Watch,
    solver: Solver,
    start: Iterate,
    target: Target,
) -> tuple[Outcome, str] | None:
    """The loop over the iterates of one start.

    Returns why it ended; None when the error is below the target, but not that of contacts.
    A method with a stopping rule of its own (`Iterate.ends`) is not stopped before that holds.
    """
    callback, limit = watch.asked.callback, watch.asked.max_iterations or np.inf
    cycles_end = not taken_by(solver).changes_method
    try:
        iterates, judged = iter(solver.iterates(watch.problem, start, target)), None
        while (iterate := sent(iterates, judged)) is not None:
            step = watch.judge(iterate)
            converged = watch.converged
            if not converged:
                watching.begin()
            stop = callback is not None and callback(step, iterate)
            if converged and iterate.ends != "":
                return Outcome.CONVERGED, iterate.stage or iterate.ends or ""
            if iterate.ends:
                return _stopped(watch, StoppedBy.RULE, f": {iterate.ends}")
            if stop:
                return _stopped(watch, StoppedBy.CALLBACK)
            if not np.isfinite(step.error):
                return Outcome.NON_FINITE, ""
            if watch.iterations >= limit:
                return Outcome.MAX_ITERATIONS, ""
            if watch.late(iterate.iterations):
                return Outcome.TIME_LIMIT, ""
            if watch.weak and step.error <= watch.goal and iterate.ends is None:
                if not iterate.goes_on or watch.goal < TIGHTEST:
                    return None
                watch.tighten()
            if watch.content > CONTENT:
                return None
            if len(watch.history) == EARLY and watch.problem.gains_energy:
                return Outcome.BREAKDOWN, "stopped early"
            if cycles_end and watch.cycled:
                return Outcome.CYCLED, ""
            if watch.stagnated:
                return Outcome.STAGNATED, ""
            judged = watch.judgement
        if watch.content:
            return None
        nothing = "the method has nothing left to try"
        return Outcome.STAGNATED, nothing if watch.problem.contacts else NOT_HELD
    except Breakdown as reason:
        late = target.deadline.passed
        return Outcome.TIME_LIMIT if late else Outcome.BREAKDOWN, str(reason)
    except TimeUp:
        return Outcome.TIME_LIMIT, ""
    except SingularOperator as reason:
        return Outcome.BREAKDOWN, str(reason)
    except ArithmeticError as reason:
        return Outcome.NON_FINITE, str(reason)


def _stopped(watch: Watch, by: StoppedBy, why: str = "") -> tuple[Outcome, str]:
    """The end on request, noted with who asked for it."""
    watch.stopped_by = by
    return Outcome.STOPPED, f"{by.value}{why}"


def finished(
    watch: Watch, whole: Problem, outcome: Outcome, detail: str = ""
) -> FrictionSolution:
    """The record and the best state; whole: the problem that was given, perhaps condensed."""
    problem, told, best = watch.problem, watch.told, watch.best
    measure = problem.measure if best is not None else Measure.EXACT
    natural = watch.asked.criterion is Criterion.NATURAL
    if told is not None and told.motion is not None and whole is problem and not problem.has_v:
        of, r, (u, v) = whole, told.r, told.motion
    elif best is None:  # stopped in the first factorisation: do not start it again
        r = whole.start()[0]
        of, u, v = whole.recover(r, np.zeros(whole.unknowns) if whole.has_v else None)
    else:
        r = best.r
        given = best.v if measure is not Measure.EXACT and problem.has_v else None
        of, u, v = whole.recover(r, given)
    error, weakest = watch.error, watch.weakest
    if weakest is None and best is not None and not natural:
        weakest = problem.weakest(best.r, best.v)
        if weakest is not None and weakest.hidden > BLUR * error:
            error = max(error, problem.certain_error(best.r, best.v))
    found = None
    if outcome not in (Outcome.CONVERGED, Outcome.STOPPED) and best is not None:
        found, text = problem.obstruction(u)
        detail = "; ".join(part for part in (detail, text) if part)
    seconds = now() - watch.started
    record = Convergence(
        outcome, watch.iterations, error, watch.asked.tolerance, tuple(watch.history),
        watch.linear_iterations, seconds, watch.method,
        Measure.NATURAL if natural else measure, detail,
        contact_error=None if weakest is None else weakest.error,
        contact_tolerance=watch.asked.of_contacts,
        weakest=None if weakest is None else weakest.contact,
        compiling=compiling() - watch.compiled,
        flops=watch.flops,
        stopped_by=watch.stopped_by,
        obstruction=found,
    )  # fmt: skip
    settled = None if told is None else told.settled
    return FrictionSolution(of, r, u, v, record, settled=settled)
