"""Bifurcation diagrams: all branches found from all solutions, closed ones included.

In 2D `interval_search`, in 3D `load_search` tells all pieces that have a solution anywhere on
the interval, with proof: every branch goes through the middle of some of them, so that none is
missed, wherever it begins and ends.  Otherwise branches go through all solutions at some values
of the parameter, and nothing is known of what passes none of these; where only parts of the
interval are undecided, these are named.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline, now
from ...core.errors import SingularOperator, TimeUp, UnsupportedForm
from ...core.faces import Shown
from ...core.files import write_bytes
from ..tolerances import SAME
from .continuation import Continuation
from .events import Stop
from .following import Limits, follow_path, track_both
from .friction_path import FrictionPath
from .path import Branch, EventKind, same, timed
from .straight import leaving
from .tangents import Tangent

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from ...problem.friction import FrictionProblem
    from ..solutions.load_interval import Pieces

Array = NDArray[np.float64]
SEARCH = 20.0  # seconds' work on the whole interval where no time is given
FEW = 0.5  # of the interval: undecided parts that are less are told in words
SPANS = 3  # of them
# ends of branches that hold some of a piece only, so that its middle does not stand for it
CUT = (Stop.MAX_POINTS, Stop.TIME_LIMIT, Stop.STOPPED, Stop.STEP_TOO_SMALL, Stop.LOST)


@dataclass(frozen=True, eq=False, repr=False)
class Diagram(Shown):
    """Branches of one problem, each line of the diagram in one of them only.

    complete: all solutions at every value in `at` were found, with proof, and lie on a branch.
    whole: the interval between whose ends the same is proved of every value; without it a
    closed branch, or one that turns back at both ends, that passes none of `at` is not seen.
    There is none where a limit or a failure ends a branch early.
    lost: solutions, as (parameter, state), through which no branch could be followed; sets:
    points of connected sets of solutions at one parameter, which are no curves over it.
    undecided: in 3D, where there is no `whole`, the parts of the interval to which that is due:
    at all other values the same is proved; empty where nothing is.
    """

    branches: tuple[Branch, ...]
    at: tuple[float, ...]
    complete: bool
    reason: str
    lost: tuple[tuple[float, Array], ...] = ()
    sets: tuple[tuple[float, Array], ...] = ()
    seconds: float = 0.0
    whole: tuple[float, float] | None = None
    undecided: tuple[tuple[float, float], ...] = ()

    def __len__(self) -> int:
        return len(self.branches)

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.branches)

    def solutions(self, parameter: float) -> list[Array]:
        """The states of all branches at a value of the parameter."""
        found: list[Array] = []
        for branch in self.branches:
            for y in branch.at(parameter):
                if not any(same(y, other, SAME) for other in found):
                    found.append(y)
        return found

    @property
    def folds(self) -> tuple[float, ...]:
        """Values of the parameter at all folds, ascending."""
        return tuple(sorted(e.parameter for b in self.branches for e in b.folds))

    @property
    def critical(self) -> float | None:
        """The smallest value at which a fold makes solutions appear or vanish.

        With friction as the parameter: the critical friction of that load, as far as the
        branches tell; where they are `whole`, for certain.
        """
        return min(self.folds, default=None)

    def to_csv(
        self, path: str | os.PathLike[str], *quantities: str, model: Model | None = None
    ) -> None:
        """Write the points of all branches, one row each, as `Branch.to_csv`."""
        from .quantities import csv_of

        write_bytes(path, csv_of(self.branches, quantities, model).encode("utf-8"))

    def record(self) -> dict[str, Any]:
        """What the JSON file holds."""
        return {
            "branches": [branch.record() for branch in self.branches],
            "at": list(self.at),
            "whole": None if self.whole is None else list(self.whole),
            "undecided": [list(span) for span in self.undecided],
            "complete": self.complete,
            "reason": self.reason,
            "critical": self.critical,
        }

    def __str__(self) -> str:
        lines = [str(branch) for branch in self.branches]
        count = f"{len(self)} branch" + ("es" if len(self) != 1 else "")
        return "\n".join([f"{count}; {self.reason}", *lines])


def bifurcation_diagram(
    path: FrictionPath, limits: Limits, at: Sequence[float] | None = None, *,
    options: Continuation | None = None,
) -> Diagram:  # fmt: skip
    """The branches through all solutions, and those that leave them.

    at: values of the parameter at which all solutions are searched for with
    `enumerate_solutions` or, in 3D, `enumerate_discs`, which at each has half of its share of
    the time.  Without them the whole interval, and both ends and the middle where that is not
    proved.
    options: those of step-by-step continuation, also where the curves are straight.
    """
    if not isinstance(path, FrictionPath):
        raise UnsupportedForm(
            "diagram: all solutions of a model with hyperelastic laws can not be searched for; "
            "use follow"
        )
    a, b = limits.interval
    drawn = _Drawn(timed(path, limits.deadline), limits, options)
    values = (a, (a + b) / 2, b) if at is None else tuple(at)
    whole = drawn.whole() if at is None and not path.tresca else None
    if whole is None:
        drawn.through(values)
    return drawn.diagram(values, whole)


class _Drawn:
    """The branches so far, and what speaks against their being all."""

    def __init__(
        self, path: FrictionPath, limits: Limits, options: Continuation | None
    ) -> None:
        self.began = now()
        self.path, self.limits, self.options = path, limits, options
        self.branches: list[Branch] = []
        self.lost: list[tuple[float, Array]] = []
        self.sets: list[tuple[float, Array]] = []
        self.doubts: list[str] = []
        self.why_not_whole = ""
        self.undecided: tuple[tuple[float, float], ...] = ()

    def whole(self) -> tuple[float, float] | None:
        """Branches through all pieces of the interval; where that is all proved, else None."""
        a, b = self.limits.interval
        deadline = self.limits.deadline
        search = deadline.share(0.25) if deadline.left < np.inf else Deadline.counted(SEARCH)
        try:
            found = _pieces(self.path.at(a), self.path.at(b), search)
        except TimeUp as reason:
            self.why_not_whole = str(reason)
            return None
        if isinstance(found, str):
            self.why_not_whole = found
            return None
        self.why_not_whole = found.doubt
        for piece in found.pieces:
            if not self._reached(a + (b - a) * piece.middle, self.path.state(piece.r)):
                return None
        cut = {stop for branch in self.branches for stop in branch.stops if stop in CUT}
        if cut and not self.why_not_whole:
            names = sorted(stop.name.lower().replace("_", " ") for stop in cut)
            self.why_not_whole = f"branches were not followed to their ends: {', '.join(names)}"
        if self.doubts or self.lost or cut:
            return None
        self.undecided = tuple((a + (b - a) * p, a + (b - a) * q) for p, q in found.undecided)
        low, high = (a + (b - a) * t for t in found.interval)
        return None if found.doubt else (low, high)

    def through(self, values: Sequence[float]) -> None:
        """Branches through all solutions at these values."""
        from ..solutions.discs.search import enumerate_discs
        from ..solutions.enumerate import enumerate_solutions

        listed = enumerate_discs if self.path.start.dimension == 3 else enumerate_solutions
        for k, p in enumerate(values):
            search = self.limits.deadline.share(0.5 / (len(values) - k))
            # without a limit the search has its own: in 3D it may not end
            found = listed(self.path.at(p), time_limit=search if search.left < np.inf else None)
            if not found.complete:
                self.doubts.append(f"at {p:g}: {found.reason}")
            for solution in found.solutions:
                y = self.path.state(solution.r)
                if solution.freedom:
                    self.sets.append((p, y))
                elif not self._reached(p, y):
                    break

    def _reached(self, p: float, y: Array) -> bool:
        """Put a solution on a branch, or note that there is none; False where time is up."""
        try:
            if not _found_again(self.branches, self.path, y, p, self.limits, self.options):
                self.lost.append((p, y))
        except TimeUp as reason:
            self.doubts.append(f"at {p:g}: {reason}")
            return False
        return True

    def diagram(self, at: tuple[float, ...], whole: tuple[float, float] | None) -> Diagram:
        """What was found, in words too."""
        doubts = list(self.doubts)
        if self.lost:
            doubts.append(f"{len(self.lost)} solutions lie on no branch")
        if self.sets:
            doubts.append(f"{len(self.sets)} sets of solutions are no curves")
        return Diagram(
            tuple(self.branches), at, not doubts, "; ".join(doubts) or self._why(at, whole),
            tuple(self.lost), tuple(self.sets), now() - self.began, whole, self.undecided,
        )  # fmt: skip

    def _why(self, at: tuple[float, ...], whole: tuple[float, float] | None) -> str:
        if whole is not None:
            return (
                f"all solutions from {whole[0]:g} to {whole[1]:g} are on these branches: no "
                "other pattern of statuses has one at any of these loads"
            )
        values = ", ".join(f"{p:g}" for p in at)
        wide = sum(q - p for p, q in self.undecided)
        if self.undecided and wide < FEW * np.ptp(self.limits.interval):
            spans = ", ".join(f"{p:.9g} to {q:.9g}" for p, q in self.undecided[:SPANS])
            more = len(self.undecided) - SPANS
            return (
                f"all solutions at {values} are on these branches, and all others but for "
                f"values from {spans}" + (f" and {more} more" if more > 0 else "")
                + f", where nothing is proved ({self.why_not_whole})"
            )
        tried = f" ({self.why_not_whole})" if self.why_not_whole else ""
        return (
            f"all solutions at {values} are on these branches; nothing is proved between these "
            f"values, where a closed branch would not be seen{tried}"
        )


def _pieces(start: FrictionProblem, end: FrictionProblem, search: Deadline) -> Pieces | str:
    """All pieces between two problems, or why none were looked for: too many contacts.

    Raises TimeUp where W is not there in time.
    """
    from ..solutions.discs.load_search import LARGEST, pieces_in_space
    from ..solutions.enumerate import CONTACTS
    from ..solutions.interval_search import pieces_between

    plane = start.dimension == 2
    most = CONTACTS if plane else LARGEST
    if start.contacts > most:
        return (f"{start.contacts} contacts: the search of an interval takes up to {most} in "
                f"{start.dimension}D")  # fmt: skip
    return (pieces_between if plane else pieces_in_space)(start, end, search)


def _found_again(
    branches: list[Branch], path: FrictionPath, y: Array, p: float, limits: Limits,
    options: Continuation | None,
) -> bool:  # fmt: skip
    """Whether a solution lies on a branch, after it was followed where that had to be."""
    limits.deadline.check()
    if _on_branches(branches, y, p, limits.deadline):
        return True
    with suppress(SingularOperator):
        _add(branches, path, y, p, limits, options)
    return _on_branches(branches, y, p, limits.deadline)


def _on_branches(branches: list[Branch], y: Array, p: float, deadline: Deadline) -> bool:
    return any(
        same(y, other, SAME)
        for branch in branches
        for other in (*_ends(branch, p), *branch.at(p, deadline))
    )


def _ends(branch: Branch, p: float) -> list[Array]:
    return [x.state for x in branch.points if abs(x.parameter - p) <= 1e-12 * max(1.0, abs(p))]


def _add(
    branches: list[Branch], path: FrictionPath, y: Array, p: float, limits: Limits,
    options: Continuation | None,
) -> None:  # fmt: skip
    """The branch through a solution, and those that leave its branch points."""
    new = follow_path(path, y, p, limits, options=options, known=branches)
    branches.append(new)
    if options is not None or not path.straight or path.tresca:
        return
    at_branch_points = [e for e in new.events if e.kind is EventKind.BRANCH]
    for event in at_branch_points:
        for tangent in leaving(path, event.state, event.parameter).tangents:
            if not _followed(branches, tangent):
                side = track_both(path, event.state, event.parameter, limits,
                                  known=branches, tangent=tangent)  # fmt: skip
                branches.append(replace(side, seconds=side.seconds))
                at_branch_points += [e for e in side.events if e.kind is EventKind.BRANCH]


def _patterns(branches: list[Branch]) -> set[str]:
    """Patterns of all lines that have been covered."""
    return {str(point.piece) for branch in branches for point in branch.points}


def _followed(branches: list[Branch], tangent: Tangent) -> bool:
    return not {str(tangent.piece), *map(str, tangent.touching)}.isdisjoint(_patterns(branches))
