"""All solutions of a 2D Coulomb problem, with proof that there is no other.

Every contact is free, sticks, or slips in one of two directions; each of the 4^nc patterns
makes the problem linear.  `pattern_search` excludes most patterns in large groups; here the
problem is prepared for it, and what remains is solved pattern by pattern.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...clock import Deadline, TimeLimit, deadline_of, now
from ...errors import InvalidInput, TimeUp, UnsupportedForm
from ...problem import FrictionProblem
from ..multipliers.scales import UNRESOLVED, resolves
from . import pattern_search as search
from .scaled_problem import REACH, SAME, ScaledProblem, States

if TYPE_CHECKING:
    from .disc_search import DiscProof

Array = NDArray[np.float64]
LETTERS = {search.OPEN_OR_CLOSED: ".", search.CLOSED: "c", search.OPEN: "f",
           search.STICK: "s", search.SLIP_PLUS: "+", search.SLIP_MINUS: "-",
           search.FRICTIONLESS: "+"}  # fmt: skip
NODES = 2000  # patterns between two looks at the clock, up to 20 contacts
NODE = 10.0  # operations of a pattern per square of the reactions
LEAF = 2e6  # the same of a complete one, besides its linear system
CONTACTS = 200  # up to which the dictionaries of all levels need less than 0.6 GB


@dataclass(frozen=True, eq=False)
class PieceSolution:
    """A solution, or a connected set of them on one linear piece of the law.

    pattern: status of every contact, f free, s stick, slip + (r_T = mu r_N) or -, in 3D l.
    touching: further patterns that the same solution has, being on their border.  r, u (nc, d).
    error: by the judge.  orientation: sign of the determinant of the piece, 1 as without
    friction, 0 where it is singular.  energy: r W r / 2, the potential energy above that of
    the state without contact.  freedom: dimension of the set of solutions on this piece, 0 for
    an isolated one; r is then a point inside.
    """

    pattern: str
    touching: tuple[str, ...]
    r: Array
    u: Array
    error: float
    orientation: int
    energy: float
    freedom: int = 0


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


@dataclass(frozen=True, eq=False)
class Solutions:
    """What `all_solutions` found; complete: every other pattern was excluded by a proof.

    examined: partial patterns that were looked at.  reason: why complete, or why not.
    """

    solutions: tuple[PieceSolution, ...]
    complete: bool
    reason: str
    examined: int
    seconds: float
    proof: Proof | DiscProof | None = None

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
                          f"{self.reason}", *lines])  # fmt: skip


def enumerate_solutions(
    problem: FrictionProblem, *, time_limit: TimeLimit = None, tolerance: float = 1e-8,
    keep_proof: bool = False,
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
    _ = problem.mu
    began = now()
    try:
        local = problem.condensed(deadline)
    except TimeUp as reason:
        return Solutions((), False, str(reason), 0, now() - began)
    if local.q_norm == 0:
        r = np.zeros((local.contacts, 2))
        rest = PieceSolution("f" * local.contacts, (), r, r.copy(), 0.0, 1, 0.0)
        reason = "q is zero: only r = 0 can be judged, others were not looked for"
        return Solutions((rest,), local.contacts == 0, reason, 0, 0.0)
    piece = ScaledProblem(local)
    cuts: list[Cut] | None = [] if keep_proof else None
    found, undecided, examined, stopped = _collect(piece, deadline, tolerance, cuts)
    reason = "every other pattern is excluded"
    if stopped:
        reason = f"stopped after {deadline}"
    elif undecided:
        reason = f"{undecided} patterns are too near to a solution to be excluded"
    elif not piece.bounded:
        reason = f"W is singular: reactions above {REACH:g} times the size of q / W may exist"
    solutions = tuple(_merged(piece, found))
    resolved = all(resolves(local, s.r) for s in solutions)
    if not resolved:
        reason = UNRESOLVED
    complete = not stopped and not undecided and piece.bounded and resolved
    return Solutions(
        solutions, complete, reason, examined, now() - began, _proof(piece, cuts)
    )


# ------------------------------------------------------------------- the search
Found = tuple[States, Array, Array, float, int, int]
Cut = tuple[States, Array]  # pattern and multipliers


def _collect(
    piece: ScaledProblem,
    deadline: Deadline,
    tolerance: float,
    cuts: list[Cut] | None,
) -> tuple[list[Found], int, int, bool]:
    """(solutions with their patterns, undecided patterns, nodes, stopped by the clock?)."""
    found: list[Found] = []
    undecided = examined = 0
    node, leaf = NODE * (2.0 * piece.contacts) ** 2, LEAF + 10.0 * (2.0 * piece.contacts) ** 3
    for leaves, nodes, done in _leaves(piece, cuts):
        examined += nodes
        deadline.spend(node * nodes)
        for k, states in enumerate(leaves):
            if k and deadline.passed:
                return found, undecided, examined, True
            deadline.spend(leaf)
            answer = piece.solve(states)
            if answer is None:
                undecided += not piece.excluded(states)
                continue
            r, orientation, freedom = answer
            u = piece.W @ r + piece.c
            error = piece.problem.error((r * piece.to_r).reshape(-1, 2))
            if error <= tolerance:
                found.append((states, r, u, error, orientation, freedom))
            else:
                undecided += 1
        if not done and deadline.passed:
            return found, undecided, examined, True
    return found, undecided, examined, False


def _leaves(piece: ScaledProblem, cuts: list[Cut] | None) -> Iterator[tuple[States, int, bool]]:
    """(complete patterns that the search could not exclude, nodes, done?) in turns."""
    nc = piece.contacts
    m, levels = 2 * nc, 2 * nc + 2
    D = np.empty((levels, m, m + 1))
    basic, nonbasic = np.empty((2, levels, m), dtype=np.int64)
    states, turn = np.empty((levels, nc), dtype=np.int8), np.zeros((levels, 3), dtype=np.int64)
    nodes = max(20, NODES * 20**2 // max(20, nc) ** 2)  # a node costs some nc^2 and more
    leaves, cut = np.empty((2, nodes, nc), dtype=np.int8)
    proofs = np.empty((nodes, m))
    search.start_inplace(D, basic, nonbasic, states, piece.A, piece.c)
    done, level = False, 0
    while not done:
        done, level, nodes, count, excluded = search.search_inplace(
            piece.A, piece.c, piece.low, piece.high, piece.reacts, piece.mu > 0,
            D, basic, nonbasic, states, turn, level, leaves, cut, proofs,
        )  # fmt: skip
        if cuts is not None:
            cuts += zip(cut[:excluded].copy(), proofs[:excluded].copy(), strict=True)
        yield leaves[:count].copy(), nodes, done


def _merged(piece: ScaledProblem, found: list[Found]) -> Iterator[PieceSolution]:
    """One entry per solution: sets first, then isolated ones that are not in them."""
    kept: list[tuple[Found, list[str]]] = []
    for item in sorted(found, key=lambda f: (-f[5], -int((f[0] == search.STICK).sum()))):
        states, r, u = item[:3]
        for other, touching in kept:
            size = max(1.0, float(np.abs(r).max()))
            near = np.abs(r - other[1]).max() <= SAME * size and item[5] == 0
            if near or (other[5] > item[5] and piece.holds(other[0], r, u)):
                touching.append(_word(states))
                break
        else:
            kept.append((item, []))
    for (states, r, _, error, orientation, freedom), touching in kept:
        reaction = (r * piece.to_r).reshape(-1, 2)
        velocity = piece.problem.velocity(reaction)[0]
        energy = float(r @ piece.W @ r) / 2 * piece.unit**2
        yield PieceSolution(_word(states), tuple(touching), reaction, np.array(velocity), error,
                            orientation, energy, freedom)  # fmt: skip


def _proof(piece: ScaledProblem, cuts: list[Cut] | None) -> Proof | None:
    """What the search left, in the units of the problem."""
    if cuts is None:
        return None
    rows = [y / piece.to_u for _, y in cuts]
    multipliers = np.array(rows).reshape(-1, piece.contacts, 2)
    return Proof(tuple(_word(states) for states, _ in cuts), multipliers)


def _word(states: States) -> str:
    return "".join(LETTERS[int(state)] for state in states)
