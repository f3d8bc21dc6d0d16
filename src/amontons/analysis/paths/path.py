"""Solution curves of residual(y, p) = 0: what continuation follows, and what it returns.

y are n unknowns and p is one parameter; the residual is continuous and piecewise smooth: at
every (y, p) it agrees with one of finitely many smooth selection functions.  `piece` names the
one that is active.  Curves are measured in the weighted norm of [LR] section 2.2,

    |(y, p)|_w^2 = p^2 + weight |y|^2,   weight = 1 / n unless the problem says otherwise.

[LR] T. Ligurský, Y. Renard, "A continuation problem for computing solutions of discretised
evolution problems with application to plane quasi-static contact problems with friction",
Comput. Methods Appl. Mech. Engrg. 280 (2014).
"""

from __future__ import annotations

import os
from collections.abc import Hashable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.arrays import Matrix
from ...core.clock import NEVER, Deadline
from ...core.faces import Shown
from ...core.files import write_bytes
from ...core.warned import ResultWarning
from ...problem.judge.measures import Measure
from ...problem.solution import Convergence, Outcome, Step
from .events import Event, EventKind, Point, Stop

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from .quantities import Quantity

Array = NDArray[np.float64]
ROUNDING = 1e-12  # of a parameter, relative to one and itself
SOLVED = 1e-8  # error by the judge below which a point counts as a solution


def judged(error: float, measure: Measure, seconds: float) -> Convergence:
    """The record of a point of a curve as a solution."""
    outcome = Outcome.CONVERGED if error <= SOLVED else Outcome.STAGNATED
    step = Step(1, error, 0, seconds)
    return Convergence(outcome, 1, error, SOLVED, (step,), 0, seconds, "continuation", measure)


@runtime_checkable
class PathProblem(Protocol):
    """n equations in n unknowns y (n,) and a parameter p: what continuation follows.

    These three are all that is required.  Kinks are then located and passed by probes around
    them.  With these four as well, the first-order system tells all ways on from a kink, and
    events are zeros of smooth functions:
    - `residual_of(piece, y, p)`, (n,), and `jacobian_of(piece, y, p)`: a selection function and
      its derivatives by y and p, also beyond the border of its piece;
    - `margins(piece, y, p)`, (k,): smooth functions, positive inside of a piece and zero on its
      border, of the size of the unknowns; infinite where nothing limits it;
    - `pieces(y, p, tolerance)`: names of all pieces from which a point is no further.

    And, where it has them, continuation makes use of
    - `weight`, a float: kappa of the weighted norm, by default 1 / n;
    - `resolution`, a float: of the residual, below which Newton's steps may get no further;
    - `smooth`: True where there is one selection function, which allows for longer steps;
    - `start`, (n,): a solution with which `follow` begins, at the parameter `start_at` or else
      the lower end of the interval;
    - `describe(y, p)`, a dict of numbers and words: columns of the table of a branch;
    - `solution(y, p)`: what `Branch.solutions` holds instead of y;
    - `index_sets(y, p)`: what `Point.sets` and `Event.sets` are.

    A ball on a spring that meets a wall, y - p + max(0, y - 1) = 0:

    >>> import numpy as np
    >>> import amontons as am
    >>> class Wall:
    ...     def residual(self, y, p):
    ...         return y - p + np.maximum(0, y - 1)
    ...     def jacobian(self, y, p):
    ...         return np.array([[2.0 if y[0] > 1 else 1.0]]), np.array([-1.0])
    ...     def piece(self, y, p):
    ...         return "wall" if y[0] > 1 else "free"
    >>> branch = am.follow(Wall(), start=[0.0], at=0.0, interval=(0.0, 3.0))
    >>> [(round(e.parameter, 9), e.before, e.after) for e in branch.events[1:-1]]
    [(1.0, 'free', 'wall')]
    >>> [y.tolist() for y in branch.at(2.0)]
    [[1.5]]
    """

    def residual(self, y: Array, p: float) -> Array:
        """The residual, (n,)."""
        ...

    def jacobian(self, y: Array, p: float) -> tuple[Matrix, Array]:
        """Derivatives by y, (n, n) dense or sparse, and by p, (n,), of one active piece."""
        ...

    def piece(self, y: Array, p: float) -> Hashable | NDArray[Any]:
        """Which selection function is active: anything hashable, or an array of integers."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Branch(Shown):
    """A solution curve as a table: points in order, the events on it, and why it ends.

    states (points, n), parameter, arclength (points,): arclength is 0 at the start and negative
    before it.  linear: the curve is straight between two points, so that `at` is exact.
    model: whose solutions the points are, where that is known.
    """

    problem: PathProblem
    points: tuple[Point, ...]
    events: tuple[Event, ...]
    stops: tuple[Stop, Stop]
    linear: bool = False
    seconds: float = 0.0
    name: str = "parameter"
    closed: bool = field(default=False)
    model: Model | None = None

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[Point]:
        return iter(self.points)

    def __getitem__(self, index: int) -> Point:
        return self.points[index]

    @property
    def parameter(self) -> Array:
        """Values of the parameter, (points,)."""
        return np.array([point.parameter for point in self.points], dtype=float)

    @property
    def arclength(self) -> Array:
        """Distance along the branch from its start, (points,)."""
        return np.array([point.arclength for point in self.points], dtype=float)

    @property
    def states(self) -> Array:
        """The unknowns, (points, n)."""
        return np.array([point.state for point in self.points])

    @property
    def status(self) -> tuple[Hashable, ...]:
        """Names of the pieces at the points."""
        return tuple(point.piece for point in self.points)

    @property
    def solutions(self) -> list[Any]:
        """The points as solutions of the problem, where it knows what these are; else y."""
        made = getattr(self.problem, "solution", None)
        return [
            point.state if made is None else made(point.state, point.parameter)
            for point in self.points
        ]

    @cached_property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """Reasons to doubt points of it, with the first parameter; none without a model."""
        if self.model is None:
            return ()
        from .point_fields import branch_warnings

        return branch_warnings(self.model, self)

    @property
    def folds(self) -> tuple[Event, ...]:
        """The events where the parameter turns back, branch points among them."""
        return tuple(event for event in self.events if event.is_fold)

    def table(self) -> list[dict[str, Any]]:
        """One row per point: parameter, arclength, and what the problem tells of it."""
        tell = getattr(self.problem, "describe", None)
        return [
            {"parameter": point.parameter, "arclength": point.arclength,
             **({} if tell is None else tell(point.state, point.parameter))}
            for point in self.points
        ]  # fmt: skip

    @cached_property
    def orientation(self) -> NDArray[np.int8]:
        """Sign of det J_y on the line from every point to the next, (points - 1,).

        1 as without friction, -1 as between two folds, 0 where it is not defined.  It changes
        only where the parameter turns back, and at branch points inside of a piece.
        """
        from .corrector import determinant_sign

        sense = np.sign(np.diff(self.parameter)).astype(np.int8)
        found = np.zeros(len(sense), dtype=np.int8)
        met = [e.arclength for e in self.events if e.kind is EventKind.BRANCH]
        ends = {*(np.flatnonzero(np.diff(sense)) + 1).tolist(),
                *np.searchsorted(self.arclength, met).tolist()}  # fmt: skip
        inner = sorted(ends - {0, len(sense)})
        for run in np.split(np.arange(len(sense)), inner) if len(sense) else ():
            a, b = self.points[run[len(run) // 2]], self.points[run[len(run) // 2] + 1]
            y, p = (a.state + b.state) / 2, (a.parameter + b.parameter) / 2
            found[run] = determinant_sign(self.problem.jacobian(y, p)[0])
        return found

    def values(self, quantity: Quantity, model: Model | None = None) -> Array:
        """A quantity at the points, (points,): "sum r_N", "r_T 3", "displacement x top", ...

        See `analysis.paths.quantities` for all names; those of a model need it.  A function of
        a solution works too.  Raises InvalidInput for a name that there is not.
        """
        from .quantities import values_of

        return values_of(self, quantity, model)

    def to_csv(
        self, path: str | os.PathLike[str], *quantities: str, model: Model | None = None
    ) -> None:
        """Write the points, one row each: the table, the orientation, further quantities."""
        from .quantities import csv_of

        write_bytes(path, csv_of([self], quantities, model).encode("utf-8"))

    def at(self, parameter: float, deadline: Deadline = NEVER) -> list[Array]:
        """The states where the branch passes that value, in order along it.

        Exact on straight pieces; else a chord's point corrected by Newton steps at fixed
        parameter (a point where that fails is left out).  Ends count within rounding.  Raises
        TimeUp at the deadline.
        """
        found: list[Array] = []
        rounding = ROUNDING * max(1.0, abs(parameter))
        for a, b in zip(self.points, self.points[1:], strict=False):
            low, high = sorted((a.parameter - parameter, b.parameter - parameter))
            if low > rounding or high < -rounding:
                continue
            if a.parameter == b.parameter:
                continue
            deadline.check()
            t = (parameter - a.parameter) / (b.parameter - a.parameter)
            guess = a.state + t * (b.state - a.state)
            state = guess if self.linear else corrected(self.problem, guess, parameter)
            if state is not None and not any(same(state, other) for other in found):
                found.append(state)
        return found

    def record(self) -> dict[str, Any]:
        """What the JSON file holds: `points` and `events`."""
        return {
            "points": self.table(),
            "events": [event.record() for event in self.events],
            "stops": [stop.name.lower() for stop in self.stops],
            "closed": self.closed,
            "warnings": [warning.record for warning in self.warnings],
        }

    def __str__(self) -> str:
        low, high = self.parameter.min(initial=np.inf), self.parameter.max(initial=-np.inf)
        folds = ", ".join(f"{event.parameter:.10g}" for event in self.folds) or "none"
        changes = sum(event.kind is EventKind.STATUS for event in self.events)
        return (
            f"branch of {len(self)} points, {self.name} {low:.6g} … {high:.6g}; "
            f"folds: {folds}; {changes} changes of status; ends: "
            + ", ".join(stop.name.lower().replace("_", " ") for stop in self.stops)
            + "".join(f"\n{warning}" for warning in self.warnings)
        )


def weight_of(problem: PathProblem, n: int) -> float:
    """kappa of the weighted norm: the problem's, or 1 / n."""
    given = getattr(problem, "weight", None)
    return 1.0 / max(n, 1) if given is None else float(given)


def resolution_of(problem: PathProblem) -> float:
    """The problem's `resolution`, by default 0."""
    return float(getattr(problem, "resolution", 0.0))


def is_number(value: object) -> bool:
    """True for one finite or infinite real number that is no truth value."""
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def name_of(piece: Hashable | NDArray[Any]) -> Hashable:
    """A hashable name of a piece."""
    return piece.tobytes() if isinstance(piece, np.ndarray) else piece


def same(a: Array, b: Array, tolerance: float = 1e-9) -> bool:
    """True for states that differ by rounding only."""
    return bool(np.abs(a - b).max(initial=0) <= tolerance * max(1.0, np.abs(a).max(initial=0)))


def corrected(
    problem: PathProblem, y: Array, p: float, *, tolerance: float = 1e-12, steps: int = 25
) -> Array | None:
    """y after Newton steps at a fixed parameter, None where they do not converge.

    tolerance bounds the last step, relative to the size of y, with the problem's `resolution`.
    """
    tolerance = max(tolerance, resolution_of(problem))
    for _ in range(steps):
        try:  # a step may also lead to where there is no derivative, as in inverted cells
            jacobian, _ = problem.jacobian(y, p)
            change = solve_linear(jacobian, -problem.residual(y, p))
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(change).all():
            return None
        y = y + change
        if np.abs(change).max(initial=0) <= tolerance * max(1.0, np.abs(y).max(initial=0)):
            return y
    return None


def timed(problem: Any, deadline: Deadline) -> Any:
    """The same path, which raises TimeUp after a deadline where it knows of deadlines.

    What it has prepared stays; problems of a user are asked between two points only.
    """
    if not hasattr(problem, "deadline"):
        return problem
    other = copy(problem)
    object.__setattr__(other, "deadline", deadline)
    return other


def solve_linear(matrix: Matrix, right: Array) -> Array:
    """The solution of a dense or sparse system, raises LinAlgError where there is none."""
    if isinstance(matrix, np.ndarray):
        return np.linalg.solve(matrix, right)  # type: ignore[return-value]  # of float64
    from scipy.sparse.linalg import splu

    try:
        return splu(sparse.csc_array(matrix)).solve(right)
    except RuntimeError as reason:  # "Factor is exactly singular"
        raise np.linalg.LinAlgError(str(reason)) from reason


def joined(
    problem: PathProblem,
    back: tuple[Sequence[Point], Sequence[Event], Stop],
    forth: tuple[Sequence[Point], Sequence[Event], Stop],
    **options: Any,
) -> Branch:
    """One branch from its two halves, which share their first point; back is turned round.

    A closed one that began in the middle of a straight line ends with its first point.
    """
    points = [point.reversed() for point in list(back[0])[:0:-1]] + list(forth[0])
    if options.get("closed") and options.get("linear") and points[-1].piece == points[0].piece:
        points += _back_to(points[0], points[-1], weight_of(problem, len(points[0].state)))
    events = [turned(event) for event in list(back[1])[::-1]] + list(forth[1])
    return Branch(problem, tuple(points), tuple(events), (back[2], forth[2]), **options)


def _back_to(start: Point, last: Point, weight: float) -> list[Point]:
    """The start as the point after the last, unless that is where the last one lies."""
    way, change = start.state - last.state, start.parameter - last.parameter
    length = float(np.sqrt(weight * way @ way + change**2))
    if same(start.state, last.state) and abs(change) <= 1e-12:
        return []
    return [replace(start, arclength=last.arclength + length)]


def turned(event: Event) -> Event:
    """The event as seen when the branch is travelled the other way."""
    return replace(event, arclength=-event.arclength, before=event.after, after=event.before)
