"""Bifurcation diagrams: all branches found from all solutions, closed ones included."""

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
from .following import Limits, follow_path, track_both
from .friction_path import FrictionPath
from .path import Branch, EventKind, same, timed
from .straight import leaving
from .tangents import Tangent

if TYPE_CHECKING:
    from ...mechanics.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Diagram(Shown):
    """Branches of one problem, each line of the diagram in one of them only.

    complete: all solutions at every value in `at` were found, with proof, and lie on a branch.
    That is proved of these values, not of the interval: a closed branch, or one that turns back
    at both ends, that passes none of them is not seen.  lost: solutions, as (parameter,
    state), through which no branch could be followed; sets: points of connected sets of
    solutions at one parameter, which are no curves over it.
    """

    branches: tuple[Branch, ...]
    at: tuple[float, ...]
    complete: bool
    reason: str
    lost: tuple[tuple[float, Array], ...] = ()
    sets: tuple[tuple[float, Array], ...] = ()
    seconds: float = 0.0

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
        branches tell.
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
            "complete": self.complete,
            "reason": self.reason,
            "critical": self.critical,
        }

    def __str__(self) -> str:
        lines = [str(branch) for branch in self.branches]
        count = f"{len(self)} branch" + ("es" if len(self) != 1 else "")
        return "\n".join([f"{count}; {self.reason}", *lines])


def bifurcation_diagram(
    path: FrictionPath, limits: Limits, at: Sequence[float], *,
    options: Continuation | None = None,
) -> Diagram:  # fmt: skip
    """The branches through all solutions at the values `at`, and those that leave them.

    Solutions come from `enumerate_solutions`, which at each value has half of its share of the
    time.  options: those of step-by-step continuation, also where the curves are straight.
    """
    from ..solutions.enumerate import enumerate_solutions

    if not isinstance(path, FrictionPath):
        raise UnsupportedForm(
            "diagram: all solutions of a model with hyperelastic laws can not be searched for; "
            "use follow"
        )
    began, deadline = now(), limits.deadline
    path = timed(path, deadline)
    branches: list[Branch] = []
    lost: list[tuple[float, Array]] = []
    sets: list[tuple[float, Array]] = []
    doubts: list[str] = []
    for k, p in enumerate(at):
        search = deadline.share(0.5 / (len(at) - k))
        found = enumerate_solutions(path.at(p), time_limit=search)
        if not found.complete:
            doubts.append(f"at {p:g}: {found.reason}")
        for solution in found.solutions:
            y = path.state(solution.r)
            if solution.freedom:
                sets.append((p, y))
                continue
            try:
                if not _found_again(branches, path, y, p, limits, options):
                    lost.append((p, y))
            except TimeUp as reason:
                doubts.append(f"at {p:g}: {reason}")
                break
    if lost:
        doubts.append(f"{len(lost)} solutions lie on no branch")
    if sets:
        doubts.append(f"{len(sets)} sets of solutions are no curves")
    values = ", ".join(f"{p:g}" for p in at)
    reason = "; ".join(doubts) or (
        f"all solutions at {values} are on these branches; nothing is proved between these "
        "values, where a closed branch would not be seen"
    )
    return Diagram(tuple(branches), tuple(at), not doubts, reason, tuple(lost), tuple(sets),
                   now() - began)  # fmt: skip


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
