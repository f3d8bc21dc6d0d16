"""All solutions of small 2D Coulomb problems in rational arithmetic: W, q and mu as they are.

Every float is a rational number, so that each of the patterns (open, stick, slip either way,
per contact) is a linear system with an exact solution, and its inequalities hold or not.
Nothing of the package is used.  Floating point only sorts out patterns whose solution violates
the law by far more than the condition of their system explains.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SORTED_OUT = 1e6  # times eps times the condition: a violation that is certain


@dataclass(frozen=True)
class Exact:
    """A solution: its pattern, r (2 nc,) rounded, and whether a slack is exactly zero."""

    pattern: str
    r: Array
    border: bool


@dataclass(frozen=True)
class Answer:
    """All isolated solutions, equal ones once; singular: patterns that may hold a set."""

    solutions: tuple[Exact, ...]
    singular: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.solutions)


def all_exact(W: Array, q: Array, mu: Array) -> Answer:
    """Every solution of a 2D problem with few contacts; W (2 nc, 2 nc), q (nc, 2), mu (nc,)."""
    nc = len(mu)
    letters = ["fs+-" if m > 0 else "f+" for m in mu]
    patterns = ["".join(p) for p in itertools.product(*letters)]
    exact_W = [[Fraction(float(x)) for x in row] for row in W]
    exact_q = [Fraction(float(x)) for x in np.ravel(q)]
    exact_mu = [Fraction(float(x)) for x in mu]
    found: dict[tuple[Fraction, ...], Exact] = {}
    singular = []
    for pattern in _candidates(patterns, W, np.ravel(q), mu):
        system = _system(pattern, exact_W, exact_mu)
        x = _solved(system, exact_q)
        if x is None:
            if _consistent(system, exact_q):
                singular.append(pattern)
            continue
        slacks = _slacks(pattern, x, exact_mu)
        if min(slacks) >= 0:
            r = tuple(_reactions(pattern, x, exact_mu))
            value = Exact(pattern, np.array([float(v) for v in r]), min(slacks) == 0)
            found.setdefault(r, value)
    assert nc
    return Answer(tuple(found.values()), tuple(singular))


# ---------------------------------------------------------------- one pattern
# unknowns of a contact: (u_N, u_T) free; (r_N, r_T) stick; (r_N, u_T) slip
def _columns(letter: str, i: int, W: list, mu: list) -> tuple[list, list]:
    """Columns of u - W r = q that belong to the two unknowns of contact i."""
    m = range(len(W))
    n, t = 2 * i, 2 * i + 1
    unit_n, unit_t = [int(k == n) for k in m], [int(k == t) for k in m]
    if letter == "f":
        return unit_n, unit_t
    if letter == "s":
        return [-W[k][n] for k in m], [-W[k][t] for k in m]
    slope = mu[i] if letter == "+" else -mu[i]
    return [-(W[k][n] + slope * W[k][t]) for k in m], unit_t


def _system(pattern: str, W: list, mu: list) -> list[list]:
    columns = [c for i, x in enumerate(pattern) for c in _columns(x, i, W, mu)]
    return [list(row) for row in zip(*columns, strict=True)]


def _eliminated(rows: list[list[Fraction]]) -> tuple[list[list[Fraction]], list[int]]:
    """Row echelon form of an augmented matrix, and the columns of its pivots."""
    rows = [row[:] for row in rows]
    width, done, pivots = len(rows[0]) - 1, 0, []
    for j in range(width):
        k = next((k for k in range(done, len(rows)) if rows[k][j] != 0), None)
        if k is None:
            continue
        rows[done], rows[k] = rows[k], rows[done]
        for k in range(len(rows)):
            if k != done and rows[k][j] != 0:
                factor = rows[k][j] / rows[done][j]
                rows[k] = [a - factor * b for a, b in zip(rows[k], rows[done], strict=True)]
        pivots.append(j)
        done += 1
    return rows, pivots


def _augmented(system: list, q: list) -> list[list[Fraction]]:
    return [[Fraction(x) for x in row] + [b] for row, b in zip(system, q, strict=True)]


def _solved(system: list, q: list[Fraction]) -> list[Fraction] | None:
    rows, pivots = _eliminated(_augmented(system, q))
    if len(pivots) < len(q):
        return None
    return [row[-1] / row[j] for row, j in zip(rows, pivots, strict=True)]


def _consistent(system: list, q: list[Fraction]) -> bool:
    rows, pivots = _eliminated(_augmented(system, q))
    return all(row[-1] == 0 for row in rows[len(pivots):])


def _slacks(pattern: str, x: list, mu: list) -> list:
    out = []
    for i, letter in enumerate(pattern):
        a, b = x[2 * i], x[2 * i + 1]
        if letter == "f":
            out.append(a)
        elif letter == "s":
            out.append(mu[i] * a - abs(b))
        elif mu[i] == 0:
            out.append(a)
        else:
            out.append(min(a, -b if letter == "+" else b))
    return out


def _reactions(pattern: str, x: list, mu: list) -> list:
    out = []
    for i, letter in enumerate(pattern):
        a, b = x[2 * i], x[2 * i + 1]
        out += {"f": [0, 0], "s": [a, b], "+": [a, mu[i] * a], "-": [a, -mu[i] * a]}[letter]
    return out


# ---------------------------------------------------------------- sorting out
def _candidates(patterns: list[str], W: Array, q: Array, mu: Array) -> list[str]:
    """Patterns that floating point does not surely exclude, by batches of systems."""
    root = np.repeat(np.sqrt(np.abs(np.diag(W)).reshape(-1, 2).max(axis=1)), 2)
    root = np.where(root > 0, root, 1.0)
    scaled, load = W / root / root[:, None], q / root
    A = np.array([_system(p, scaled.tolist(), mu.tolist()) for p in patterns], dtype=float)
    size = np.maximum(np.abs(A).max(axis=1, keepdims=True), 1e-300)  # columns of size 1
    with np.errstate(all="ignore"):
        condition = np.linalg.cond(A / size)
        regular = np.isfinite(condition) & (condition < 1e9)
        A[~regular] = np.eye(len(q))
        right = np.broadcast_to(load, (len(A), len(q)))
        x = np.linalg.solve(A / size, right[..., None])[..., 0]
    terms = np.abs(x).max(axis=1) + np.abs(load).max()
    sure = SORTED_OUT * np.finfo(float).eps * condition * terms
    keep = []
    for pattern, good, own, unit, bound in zip(
        patterns, regular, x, size[:, 0], sure, strict=True
    ):
        if good:
            worst = min(_scaled_slacks(pattern, own, unit, mu))
            if worst < -bound:
                continue
        keep.append(pattern)
    return keep


def _scaled_slacks(pattern: str, x: Array, unit: Array, mu: Array) -> list[float]:
    """Slacks in unknowns x = unit * true, each relative to what its terms can be."""
    out = []
    for i, letter in enumerate(pattern):
        a, b = x[2 * i], x[2 * i + 1]
        if letter == "s":
            a, b = a / unit[2 * i], b / unit[2 * i + 1]
            room = max(mu[i] / unit[2 * i], 1 / unit[2 * i + 1])
            out.append((mu[i] * a - abs(b)) / room)
        elif letter == "f" or mu[i] == 0:
            out.append(a)
        else:
            out.append(min(a, -b if letter == "+" else b))
    return out
