"""All solutions of a 2D Coulomb problem, with proof that there is no other.

Every contact is free, sticks, or slips in one of two directions; each of the 4^nc patterns
makes the problem linear.  `pattern_search` excludes most patterns in large groups; here the
problem is prepared for it, and what remains is solved pattern by pattern, with bounds of all
errors (`piece_solution`).  Solutions on borders of the law belong to several patterns
(`local_degree`); the degrees of all of them have to add up to one.

A complete list means: every solution of the problem with W, q and mu as given is within
`resolution` of one of the list, and has its pattern or one of those that touch it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline, TimeLimit, deadline_of, now
from ...core.errors import InvalidInput, TimeUp, UnsupportedForm
from ...core.faces import Shown
from ...core.onlookers import say
from ...problem.friction import FrictionProblem
from ..scaled import UNRESOLVED, Scaled
from ..statuses import STICK, word
from ..tolerances import DATA, RESOLVED, SLACK, SOLVED
from .local_degree import UNKNOWN, Degree, degree
from .pattern_leaves import NODE, Cut, leaves_of
from .piece_solution import Existence, PieceAnswer, examined
from .plane_problem import REACH, PlaneProblem

if TYPE_CHECKING:
    from .discs.proof import DiscProof

Array = NDArray[np.float64]
LEAF = 2e6  # the same of a complete one, besides its linear system
CONTACTS = 200  # up to which the dictionaries of all levels need less than 0.6 GB


@dataclass(frozen=True, eq=False)
class PieceSolution:
    """A solution, or a connected set of them on one linear piece of the law.

    pattern: status of every contact, f free, s stick, slip + (r_T = mu r_N) or -, in 3D l.
    touching: further patterns that the same solution has, being on their border.  r, u (nc, d).
    error: by the judge.  orientation: sign of the determinant of the piece, 1 as without
    friction, 0 where it is singular; on a border the sum of those of its pieces that have a
    solution for loads nearby, 0 also where that is not known.  energy: r W r / 2, the potential
    energy above that of the state without contact.  freedom: dimension of the set of solutions
    on this piece, 0 for an isolated one; r is then a point inside.  sole: exactly one solution
    is here, whatever rounding does; without it there may be two of different status within
    `distance`, or on a border none.  at_least: so many are here for W, q and mu as given, 2
    for a set, which is one within rounding.  distance: bound of how far the solutions that
    this one stands for are from r, relative to the largest reaction or, if that is larger, to
    what the load can make.  still: all of a set have the same motion.
    """

    pattern: str
    touching: tuple[str, ...]
    r: Array
    u: Array
    error: float
    orientation: int
    energy: float
    freedom: int = 0
    sole: bool = False
    at_least: int = 0
    distance: float = np.inf
    still: bool = False


@dataclass(frozen=True, eq=False)
class Proof:
    """Why the patterns that are no solutions are none; anyone can check it with W, q and mu.

    patterns: each excluded with all that it stands for, . for an undecided contact (not in
    tension, u_N >= 0) and c for a closed one (u_N = 0), else as in `PieceSolution`.
    multipliers (k, nc, 2): for the y of its pattern no r and u, with the signs of the pattern
    and in the ellipsoid r W r + q r <= 0, have y u - (W^T y) r = y q.
    """

    patterns: tuple[str, ...]
    multipliers: Array


@dataclass(frozen=True, eq=False, repr=False)
class Solutions(Shown):
    """What `all_solutions` found; complete: every other pattern was excluded by a proof.

    examined: partial patterns that were looked at.  reason: why complete, or why not.
    resolution: what is nearer to one of the solutions than this may be listed as the same,
    being on its border; relative to the largest reaction or, if that is larger, to what the
    load can make.  Where the list is complete, no solution is farther from all of them.
    """

    solutions: tuple[PieceSolution, ...]
    complete: bool
    reason: str
    examined: int
    seconds: float = 0.0
    proof: Proof | DiscProof | None = None
    resolution: float = np.inf
    unresolved: bool = False  # is it incomplete because loads differ too much?

    def __len__(self) -> int:
        return len(self.solutions)

    def __str__(self) -> str:
        lines = [
            f"{s.pattern}  error {s.error:.1e}  orientation {s.orientation:+d}"
            + (f"  a set of dimension {s.freedom}" if s.freedom else "")
            for s in self.solutions
        ]
        count = f"{len(self)} solution" + ("s" if len(self) != 1 else "")
        return "\n".join([f"{count}, {'complete' if self.complete else 'not complete'}: "
                          f"{self.reason}{self.resolved}", *lines])  # fmt: skip

    @property
    def resolved(self) -> str:
        """The resolution in words, to follow the reason."""
        if not np.isfinite(self.resolution):
            return ""
        if self.resolution == 0.0 and self.complete:
            return ", however near"
        differs = "any other differs" if self.complete else "solutions count as one that differ"
        return f"; {differs} by less than {self.resolution:.1e} of the largest reaction"

    @property
    def at_least(self) -> int:
        """So many solutions there are for W, q and mu as given."""
        return sum(s.at_least for s in self.solutions)

    @property
    def one(self) -> bool:
        """True where the list proves that there is exactly one solution."""
        return self.complete and len(self) == 1 and self.solutions[0].sole


def enumerate_solutions(
    problem: FrictionProblem | Scaled, *, time_limit: TimeLimit = None,
    tolerance: float = SOLVED, keep_proof: bool = False,
) -> Solutions:  # fmt: skip
    """All solutions of a 2D Coulomb problem; the global form is condensed.

    time_limit: seconds, after which the list is not complete.  tolerance: error by the judge
    that a solution may have.  keep_proof: fill `Solutions.proof`.  Raises
    UnsupportedForm in 3D and under Tresca's law.
    """
    deadline = deadline_of(time_limit)
    if problem.dimension != 2:
        raise UnsupportedForm("all solutions: expected a 2D problem, this one is in 3D")
    if problem.contacts > CONTACTS:
        raise InvalidInput(
            f"contacts: expected at most {CONTACTS}, got {problem.contacts}; the search grows "
            "exponentially, take a coarser mesh"
        )
    return searched(
        problem, deadline, lambda scaled: _all_of(scaled, deadline, tolerance, keep_proof)
    )


def _all_of(
    scaled: Scaled, deadline: Deadline, tolerance: float, keep_proof: bool
) -> Solutions:
    piece = PlaneProblem(scaled)
    cuts: list[Cut] | None = [] if keep_proof else None
    found, undecided, examined, stopped = _collect(piece, deadline, tolerance, cuts)
    entries = list(_merged(piece, found))
    solutions = tuple(solution for solution, _ in entries)
    doubt = _doubt(piece, solutions, [known for _, known in entries])
    if stopped:
        doubt = f"stopped after {deadline}"
    elif undecided:
        doubt = f"{undecided} patterns are too near to a solution to be excluded"
    elif not piece.box.bounded:
        doubt = f"W is singular: reactions above {REACH:g} times the size of q / W may exist"
    return Solutions(
        solutions, doubt is None, doubt or "every other pattern is excluded", examined,
        proof=_proof(piece, cuts), unresolved=doubt is UNRESOLVED,
        resolution=max((s.distance for s in solutions), default=np.inf if doubt else 0.0),
    )  # fmt: skip


def _doubt(
    piece: PlaneProblem, solutions: Sequence[PieceSolution], degrees: Sequence[int | None]
) -> str | None:
    """What speaks against a list that has everything that the search left."""
    for solution in solutions:
        share, terms = piece.scaled.load_shares(solution.r / piece.scaled.to_r)
        little, rests = share < RESOLVED, share <= DATA * terms
        if (little & ~(rests & (solution.sole or solution.freedom > 0))).any():
            return UNRESOLVED
    penetrates = bool((piece.c[0::2][~piece.reacts] < 0).any())
    known = [value for value in degrees if value is not None]
    if len(known) < len(degrees):
        return None
    return missing(sum(known), 0 if penetrates else 1)


def missing(total: int, expected: int = 1) -> str | None:
    """What a wrong sum of orientations says."""
    if total == expected:
        return None
    return f"orientations add up to {total}, not {expected}: one is missing or too many"


def searched(
    problem: FrictionProblem | Scaled, deadline: Deadline,
    search: Callable[[Scaled], Solutions],
) -> Solutions:  # fmt: skip
    """What a search finds; without one where W is not there in time, or q is zero."""
    began = now()
    try:
        scaled = Scaled.of(problem, deadline)
    except TimeUp as reason:
        return Solutions((), False, str(reason), 0, now() - began)
    found = search(scaled) if scaled.q.any() else _without_load(scaled)
    return replace(found, seconds=now() - began)


def _without_load(scaled: Scaled) -> Solutions:
    """What can be said where q is zero, or without contacts."""
    r = np.zeros(scaled.shape)
    rest = PieceSolution("f" * len(r), (), r, r.copy(), 0.0, 1, 0.0)
    if not len(r):
        return Solutions((rest,), True, "no contacts: what is linear has one solution", 0)
    reason = "q is zero: only r = 0 can be judged, others were not looked for"
    return Solutions((rest,), False, reason, 0)


# ------------------------------------------------------------------- the search
def _collect(
    piece: PlaneProblem,
    deadline: Deadline,
    tolerance: float,
    cuts: list[Cut] | None,
) -> tuple[list[PieceAnswer], int, int, bool]:
    """(pieces with solutions, undecided patterns, nodes, stopped by the clock?)."""
    found: list[PieceAnswer] = []
    undecided = nodes = 0
    node, leaf = NODE * (2.0 * piece.contacts) ** 2, LEAF + 10.0 * (2.0 * piece.contacts) ** 3
    box, problem = piece.box, piece.scaled.problem
    search_space = (box.A, box.spread, box.c, (box.low, box.high), piece.reacts, piece.mu > 0)
    for leaves, more, done in leaves_of(*search_space, cuts):
        nodes += more
        say(f"this load: {nodes} partial patterns, {len(found)} with solutions")
        deadline.spend(node * more)
        for k, states in enumerate(leaves):
            if k and deadline.passed:
                return found, undecided, nodes, True
            deadline.spend(leaf)
            answer = examined(piece, states)
            if answer.existence is Existence.UNKNOWN:
                undecided += 1
            elif answer.existence is not Existence.NONE:
                error = problem.error(answer.r.reshape(-1, 2) * piece.scaled.to_r)
                if error <= tolerance:
                    found.append(answer)
                else:
                    undecided += 1
        if not done and deadline.passed:
            return found, undecided, nodes, True
    return found, undecided, nodes, False


def _merged(
    piece: PlaneProblem, found: list[PieceAnswer]
) -> Iterator[tuple[PieceSolution, int | None]]:
    """Solutions with their degrees: sets first, then isolated ones that are not in them.

    Solutions that are sure of their status are never put together with each other.
    """
    groups: list[list[PieceAnswer]] = []
    for item in sorted(found, key=_rank):
        group = None
        if item.existence is Existence.NEAR:
            group = next((g for g in groups if _belongs(piece, item, g)), None)
        if group is None:
            groups.append([item])
        else:
            group.append(item)
    degrees = _disjoint(piece, groups)
    largest = piece.scaled.largest(*(group[0].r.reshape(-1, 2) for group in groups))
    for group, known in zip(groups, degrees, strict=True):
        yield _entry(piece, group, known, largest), known.value


def _disjoint(piece: PlaneProblem, groups: list[list[PieceAnswer]]) -> list[Degree]:
    """Degrees of groups, those put together whose pieces are partly the same.

    A solution on a piece that two of them have would count twice.
    """
    degrees = [degree(piece, group) for group in groups]
    while pair := _sharing(degrees):
        i, j = pair
        if groups[j][0].existence is Existence.SURE:
            degrees[max(pair, key=lambda k: len(degrees[k].pieces))] = UNKNOWN
            continue
        groups[i] += groups.pop(j)
        degrees.pop(j)
        degrees[i] = degree(piece, groups[i])
    return degrees


def _sharing(degrees: Sequence[Degree]) -> tuple[int, int] | None:
    """Two of them that have a piece in common, in order."""
    pairs = itertools.combinations(range(len(degrees)), 2)
    return next((p for p in pairs if degrees[p[0]].pieces & degrees[p[1]].pieces), None)


def _rank(answer: PieceAnswer) -> tuple[int, bool, int]:
    """Sets first, then what is sure, then what sticks most."""
    near = answer.existence is Existence.NEAR
    return -answer.freedom, near, -int((answer.states == STICK).sum())


def _belongs(piece: PlaneProblem, item: PieceAnswer, group: list[PieceAnswer]) -> bool:
    """True where a solution can not be told from one of a group, or lies in its set."""
    first = group[0]
    if first.freedom > item.freedom:
        P, Q = piece.slack_matrices(first.states)
        R, rows = piece.system(first.states)
        outside = item.r - R @ np.linalg.lstsq(R, item.r, rcond=None)[0]
        off = max(np.abs(item.u[rows]).max(initial=0), np.abs(outside).max(initial=0))
        size = max(1.0, float(np.abs(item.r).max(initial=0.0)))
        least = (P @ item.r + Q @ item.u).min(initial=0.0)
        return bool(max(off, -least) <= SLACK * size)
    return not item.freedom and any(
        float(np.abs(item.r - other.r).max(initial=0.0)) <= item.off + other.off
        for other in group
    )


def _entry(
    piece: PlaneProblem, group: list[PieceAnswer], known: Degree, largest: float
) -> PieceSolution:
    """What a group of answers stands for; largest: reaction of all that are listed."""
    first, value = group[0], known.value or 0
    least = max(abs(value), sum(a.exists for a in group), 2 if first.freedom else 0)
    apart = np.max([np.abs(a.r - first.r) + a.off_r
                    for a in group if not a.freedom or a is first], axis=0)  # fmt: skip
    distance = piece.scaled.relative(apart.reshape(-1, 2), largest=largest)
    problem, to_r = piece.scaled.problem, piece.scaled.to_r
    reaction = first.r.reshape(-1, 2) * to_r
    velocity = np.array(problem.velocity(reaction)[0])
    error = problem.error(reaction)
    unit = float(to_r[0, 0] * piece.scaled.to_u[0, 0])
    energy = float(first.r @ piece.W @ first.r) / 2 * unit
    return PieceSolution(
        word(first.states), tuple(word(a.states) for a in group[1:]), reaction, velocity,
        error, value, energy, first.freedom, known.sole, least, distance, first.still,
    )  # fmt: skip


def _proof(piece: PlaneProblem, cuts: list[Cut] | None) -> Proof | None:
    """What the search left, in the units of the problem."""
    if cuts is None:
        return None
    to_u = piece.scaled.to_u.repeat(2) / piece.box.u
    rows = [y / to_u for _, y in cuts]
    multipliers = np.array(rows).reshape(-1, piece.contacts, 2)
    return Proof(tuple(word(states) for states, _ in cuts), multipliers)
