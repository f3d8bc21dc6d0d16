"""Lists of all 2D solutions, and all branches over a load, as files for `certificate_checker`.

    all solutions   patterns (k,) that have none, with multipliers y (k, nc, 2) of u each; left:
                    the others; r (s, nc, 2): the solutions, each to `distance`
    all branches    the same of all loads between q and end (nc, 2); r: the middles of the lines

Whoever checks solves the patterns that are left in rational numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.solutions.enumerate import Solutions, enumerate_solutions
from ..analysis.solutions.interval_exclusions import exclusions_between
from ..analysis.solutions.interval_search import Pieces
from ..core.clock import Deadline
from ..core.errors import InvalidInput
from ..problem.friction import FrictionProblem

Array = NDArray[np.float64]
CLOSED = {".": "fs+-", "c": "s+-"}  # what an undecided contact stands for
ROOM = 1e-9  # relative to the largest reaction: how near the solutions of a file are


def all_solutions_of(local: FrictionProblem, found: Solutions, deadline: Deadline) -> Any:
    """Arrays that prove a complete list of a 2D problem in Delassus form.

    Raises InvalidInput where the list is not complete, or in 3D.
    """
    if local.dimension != 2 or not found.complete:
        why = "3D" if local.dimension != 2 else found.reason
        raise InvalidInput(f"certificate: expected a complete list in 2D, got {why}")
    if found.proof is None:
        found = enumerate_solutions(local, time_limit=deadline, keep_proof=True)
    proof: Any = found.proof
    if proof is None or not found.complete:
        raise InvalidInput("certificate: there was no time for the proof of the list")
    left = list(uncovered(list(proof.patterns), "", np.array(local.mu)))
    return _arrays(proof.patterns, proof.multipliers, left, [s.r for s in found.solutions])


def all_branches_between(
    start: FrictionProblem, end: FrictionProblem, found: Pieces, deadline: Deadline
) -> Any:
    """Arrays that prove all pieces between two loads of a 2D problem in Delassus form.

    Raises InvalidInput where these were not proved to be all, or friction differs.
    """
    if found.doubt:
        raise InvalidInput(f"certificate: these may not be all branches: {found.doubt}")
    by = exclusions_between(start, end, found.pieces, deadline)
    arrays = _arrays(by.excluded, by.multipliers, by.left, by.middles)
    return {**arrays, "q": by.loads[0], "end": by.loads[1]}


def _arrays(
    excluded: Sequence[str], y: Array, left: Sequence[str], solutions: Sequence[Array] | Array
) -> dict[str, Any]:
    r = np.array(solutions)
    return {
        "patterns": np.array(excluded, dtype="S"), "y": y, "left": np.array(left, dtype="S"),
        "r": r, "distance": ROOM * float(np.abs(r).max(initial=0.0)),
    }  # fmt: skip


def uncovered(patterns: list[str], begun: str, mu: Array) -> Iterator[str]:
    """Complete patterns that begin so and that none of `patterns`, which allow that, holds."""
    if len(begun) == len(mu):
        if not patterns:
            yield begun
        return
    i = len(begun)
    if any(set(p[i:]) <= {"."} for p in patterns):
        return
    for letter in "fs+-" if mu[i] > 0 else "f+":
        rest = [p for p in patterns if letter in CLOSED.get(p[i], p[i])]
        yield from uncovered(rest, begun + letter, mu)
