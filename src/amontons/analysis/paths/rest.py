"""Tangents where contacts are at rest: closed by chance, without force, without motion.

There the law of friction is its own derivative: with r', u' the rates along a curve, p' = +-1,

    u' = W r' + p' q1,   r' in the friction cone, u' and r' as r and u,

so the rates of these contacts solve a friction problem, W and q1 being reduced by the contacts
inside of a piece.  All of a body's contacts rest where a load grows from zero and the gaps are
closed; the pieces that meet there are too many to be looked at one by one, and in 3D the slip
has any direction.

Contacts without friction are at rest where they graze, whatever their motion.  So are those
under Tresca's law, whose tangential part does not depend on the normal one: only r_N' and u_N'
are left in the problem.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...problem.friction import FrictionProblem
from ...problem.solution import Outcome
from ...solvers.driver import drive
from .friction_path import FrictionPath

Array = NDArray[np.float64]
RATES = 1e-10  # error of the rates
CLOSED = {"o": "s", "p": "+", "m": "-", "q": "l"}  # open and closed, under Tresca's law
SYMMETRIC = 1e-9  # relative difference of the reduced W and its transpose that is rounding
REASON = "several contacts are at rest here: one way on was looked for per sense"


def resting(path: FrictionPath, choices: list[str]) -> list[int]:
    """The contacts at rest, of the letters that each may have."""
    if path.tresca:
        return [i for i, letters in enumerate(choices) if len(letters) == 2 and _opens(letters)]
    return [
        i for i, letters in enumerate(choices)
        if "f" in letters and ("s" in letters or (path.frictionless[i] and len(letters) > 1))
    ]  # fmt: skip


def _opens(letters: str) -> bool:
    """True for an open and a closed letter of Tresca's law with the same tangential part."""
    return CLOSED.get(letters[0]) == letters[1]


def rates_from_rest(
    path: FrictionPath, y: Array, p: float, choices: list[str], rest: list[int]
) -> Iterator[tuple[str, Array, float]]:
    """(piece, y' (m,), p') for p' = +-1 and all letters of the other contacts.

    The conditions of these others are left to the caller.
    """
    others = [c[0] if i in rest else c for i, c in enumerate(choices)]
    for word in product(*others):
        for sense in (1.0, -1.0):
            rates = _rates(path, y, p, "".join(word), np.array(rest), sense)
            if rates is not None:
                yield _named(path, word, rest, rates, sense, p), rates, sense


def _rates(
    path: FrictionPath, y: Array, p: float, word: str, rest: NDArray[np.int64], sense: float
) -> Array | None:
    """y' with the rates of contacts at rest from a solver; None where it finds none."""
    d = path.start.dimension
    J, Jp = path.jacobian_of(word, y, p)
    mine = (rest[:, None] * d + np.arange(1 if path.tresca else d)).ravel()
    rows = np.setdiff1d(np.arange(len(y)), mine)
    change = -sense * Jp[rows]
    try:
        of_mine = -np.linalg.solve(J[np.ix_(rows, rows)], J[np.ix_(rows, mine)])
        alone = np.linalg.solve(J[np.ix_(rows, rows)], change)
    except np.linalg.LinAlgError:
        return None
    W = path.W[np.ix_(mine, mine)] + path.W[np.ix_(mine, rows)] @ of_mine
    q = path.W[np.ix_(mine, rows)] @ alone + sense * path.q1[mine]
    if np.abs(W - W.T).max() > SYMMETRIC * np.abs(W).max():
        return None  # others slide: no friction problem
    mu = None if path.tresca else np.maximum(path.coefficient(p)[rest], 0.0)
    solved = _solved((W + W.T) / 2, q, mu, d, path.deadline)
    if solved is None:
        return None
    out = np.empty(len(y))
    out[mine] = solved
    out[rows] = of_mine @ solved + alone
    return out


def _solved(
    W: Array, q: Array, mu: Array | None, d: int, deadline: Deadline
) -> Array | None:
    """Reactions of a friction problem, of one of normal components where mu is None."""
    if mu is None:
        normal, k = np.arange(len(q)) * d, len(q)
        whole, free = np.trace(W) / k * np.eye(k * d), np.zeros(k * d)
        whole[np.ix_(normal, normal)], free[normal] = W, q
        r = _solved(whole, free, np.zeros(k), d, deadline)
        return None if r is None else r[normal]
    problem = FrictionProblem.from_delassus(W, q.reshape(len(mu), d), mu)
    found = drive(problem, tolerance=RATES, time_limit=deadline)
    return found.r.ravel() if found.convergence.outcome is Outcome.CONVERGED else None


def _named(
    path: FrictionPath, word: tuple[str, ...], rest: list[int], rates: Array, sense: float,
    p: float,
) -> str:  # fmt: skip
    """The piece into which rates lead."""
    d = path.start.dimension
    z = (rates - path.W @ rates - sense * path.q1).reshape(-1, d)
    out = list(word)
    for i in rest:
        if path.tresca:
            out[i] = CLOSED[word[i]] if z[i, 0] > 0 else word[i]
            continue
        bound = max(float(path.coefficient(p)[i]), 0.0) * z[i, 0]
        size = float(np.linalg.norm(z[i, 1:]))
        slip = "l" if d == 3 else "+" if z[i, 1] >= 0 or path.frictionless[i] else "-"
        slides = size > bound or path.frictionless[i]
        out[i] = "f" if z[i, 0] <= 0 else slip if slides else "s"
    return "".join(out)
