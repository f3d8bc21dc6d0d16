"""Quadratic multipliers: a structured linear matrix inequality, solved by a barrier method.

Uniqueness proofs look for symmetric W_c, one for every set c of variables (a contact with
z = (r_N, r_T, u_N, u_T), a pair of contacts, ...), such that

    M = sum_c Z_c^T W_c Z_c           is positive definite, and
    S_j = sum_i x_i A_ji              is positive definite for every slack j of every set,

x the unknowns of the set: the entries of W_c and extra ones (the nonnegative part of a
copositive matrix, the multiplier of the S-lemma).  The slacks say that z_c^T W_c z_c < 0 for
all that the friction law allows, M that the sum is positive for all that balance allows; both
together leave only z = 0.

How to state a problem
    Z (rows, N): all variables as functions of N coordinates y in which the energy r W r is
    |y|^2 (`energy_rows`); in r itself the answer takes several times as long.
    `Family(rows, slacks, feasible, share)`: sets of equal size k; rows (sets, k) says which
    rows of Z they see, sets may overlap.  The unknowns of a set are the m = k (k + 1) / 2
    entries W_ab, a <= b, row by row (`symmetric_basis`), then the extras.
    `Slacks(owner, tensor)`: small matrices of equal size s, owner (J,) the set of each, tensor
    (J, m + extras, s, s) with S_j = sum_i x_i tensor[j, i]: `restricted` makes -G^T W G, and a
    number that must be positive is a slack with s = 1.  No constants: all is homogeneous.
    `feasible` (extras,) or (sets, extras): extras with which, times any small positive number
    and with W_c = -I, all slacks are positive definite; that is where the method begins.
    `share` (sets, K): ties the sets of a family, W_c = sum_k share[c, k] V_k with K unknown
    V_k; share >= 0 and no empty row.  Fewer unknowns, weaker proofs.

How it is solved.  max t with M - t I >= 0, all S_j >= 0 and the sum of all their traces fixed
(without it multipliers run to infinity), by primal-dual steps (`steps`), whose dual
values bound t from above.  It ends as soon as M is positive definite, and when the bound is
negative or too small for any proof.  All of it is floating point: the caller's `accept`
has to prove what it needs from the multipliers as they are, rounding included
(`slacks_are_positive`, `rounding.is_positive_definite`).

S. Boyd, L. Vandenberghe, "Convex Optimization" (2004), sections 4.6.2 and 11.8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ...core.clock import TimeLimit, deadline_of
from .program import Family, Point, Program, Slacks
from .rounding import are_positive_definite, gamma
from .steps import advance, start

Array = NDArray[np.float64]
SHORTEST = 1e-6  # step length below which rounding stands in the way
STEPS = 200  # far more than a well-posed problem takes
SMALLEST = 1e-9  # eigenvalue of M that could be told from rounding, the mean of all being 1
OVERHEAD = 5e7  # operations that a step counts for, however small
REFUSALS = 12  # of multipliers by the caller


class LmiOutcome(Enum):
    """How the search for multipliers ended."""

    FOUND = "M and all slacks are positive definite, and the caller accepted the multipliers"
    NONE = "there are no multipliers with a margin above rounding"
    STALLED = "rounding stands in the way: undecided"
    TIME_LIMIT = "stopped by the clock: undecided"


@dataclass(frozen=True, eq=False)
class Multipliers:
    """What the search found.

    W, extras: of every family (sets, k, k) and (sets, extras).  t: smallest eigenvalue of M.
    bound: none of the same trace has a larger one.  lowest (N,): where y M y / |y|^2 is
    smallest, for branching.  moments: the dual matrices X of M and of all slacks in order,
    (1, N, N) and (J, s, s); those of slacks weigh the states of a set against each other.
    """

    outcome: LmiOutcome
    W: tuple[Array, ...]
    extras: tuple[Array, ...]
    t: float
    bound: float
    lowest: Array
    steps: int
    moments: tuple[Array, ...] = ()


Parts = tuple[Array, ...]  # one array per family
Accept = Callable[[Parts, Parts], bool]


# ------------------------------------------------------------------- stating a problem
def symmetric_basis(k: int) -> Array:
    """(k (k + 1) / 2, k, k): W = sum_i x_i basis[i] with x the entries W_ab, a <= b."""
    a, b = np.triu_indices(k)
    basis = np.zeros((len(a), k, k))
    basis[np.arange(len(a)), a, b] = basis[np.arange(len(a)), b, a] = 1.0
    return basis


def symmetric(entries: Array, k: int) -> Array:
    """The matrices (..., k, k) whose entries W_ab, a <= b, are given, (..., k (k + 1) / 2)."""
    return np.einsum("...i,iab->...ab", entries, symmetric_basis(k))


def restricted(G: Array, extras: int = 0) -> Array:
    """Tensor of -G_j^T W G_j for G (J, k, s), zero for `extras` further unknowns."""
    low, high = np.triu_indices(G.shape[1])
    product = G[:, low, :, None] * G[:, high, None, :]
    product = -np.where((low == high)[:, None, None], 0.5, 1.0) * product
    tensor = product + np.swapaxes(product, 2, 3)
    return np.concatenate([tensor, np.zeros((len(G), extras, *tensor.shape[2:]))], axis=1)


def energy_rows(W: Array) -> Array:
    """Z (4 nc, 2 nc): rows r_N, r_T, u_N, u_T of every contact in coordinates y, r W r = |y|^2.

    Only the symmetric part of W (2 nc, 2 nc) makes energy; LinAlgError unless it is definite.
    """
    L = np.linalg.cholesky((W + W.T) / 2)
    r = linalg.solve_triangular(L, np.eye(len(W)), lower=True, trans=1)
    Z = np.empty((len(W) // 2, 4, len(W)))
    Z[:, :2], Z[:, 2:] = r.reshape(-1, 2, len(W)), (W @ r).reshape(-1, 2, len(W))
    return Z.reshape(-1, len(W))


def slacks_are_positive(families: Sequence[Family], W: Parts, extras: Parts) -> bool:
    """True only when all slacks are positive definite, rounding included.

    Tensors may be off by a dozen roundings, as those of `restricted` with normalised G.
    """
    for family, own, more in zip(families, W, extras, strict=True):
        low, high = np.triu_indices(family.size)
        x = np.hstack([own[:, low, high], more])
        for slacks in family.slacks:
            y = x[slacks.owner]
            S = np.einsum("ji,jiab->jab", y, slacks.tensor)
            size = np.einsum("ji,jiab->jab", np.abs(y), np.abs(slacks.tensor))
            if not are_positive_definite(S, gamma(x.shape[1] + 14) * size):
                return False
    return True


# ------------------------------------------------------------------- solving it
def find_multipliers(
    Z: Array, families: Sequence[Family], *, accept: Accept | None = None,
    time_limit: TimeLimit = None, smallest: float = SMALLEST,
    margin: float = 0.0,
) -> Multipliers:  # fmt: skip
    """Multipliers with M and all slacks positive definite, or why there are none.

    accept(W, extras): the last word on multipliers with M > 0, each from a later step than the
    one before; without it they are taken as they are.  smallest: give up as soon as no
    eigenvalue of M above this is possible, the mean of all being 1.  margin: ask only when
    this part of the largest possible eigenvalue is reached.
    """
    deadline = deadline_of(time_limit)
    each = step_operations(Z, families)
    if not deadline.affords(each):
        return _not_begun(Z, families, LmiOutcome.TIME_LIMIT)
    deadline.spend(each)  # the beginning takes a step
    program = Program(Z, tuple(families))
    try:
        point = start(program)
    except np.linalg.LinAlgError:  # Z has rows of very different size
        return _not_begun(Z, families, LmiOutcome.STALLED)
    refused, steps, outcome = 0, 0, LmiOutcome.STALLED
    while steps < STEPS and refused < REFUSALS:
        if _positive(point) and (not margin or point.t > margin * program.theta * point.lam):
            if accept is None or accept(*multipliers_at(program, point)):
                outcome = LmiOutcome.FOUND
                break
            refused += 1
        if program.theta * point.lam < smallest:
            outcome = LmiOutcome.NONE
            break
        if not deadline.affords(each):
            outcome = LmiOutcome.TIME_LIMIT
            break
        deadline.spend(each)
        following = advance(program, point)
        if following is None or following[1] < SHORTEST:
            break
        point, steps = following[0], steps + 1
    W, extras = multipliers_at(program, point)
    values, vectors = linalg.eigh(point.S[0][0], subset_by_index=[0, 0])
    least, bound = float(values[0]) + point.t, program.theta * point.lam
    return Multipliers(outcome, W, extras, least, bound, vectors[:, 0], steps, tuple(point.X))


def step_operations(Z: Array, families: Sequence[Family]) -> float:
    """Of one step, roughly: the linear system formed and factorised, inverses of M."""
    unknowns, entries, slacks = 0, 0, 0.0
    for f in families:
        sets = len(f.rows)
        entries += f.entries * sets
        unknowns += f.entries * (sets if f.share is None else f.share.shape[1])
        slacks += sum(float(np.prod(s.tensor.shape)) * s.tensor.shape[1] for s in f.slacks)
    N = Z.shape[1]
    form = min(4.0 * len(Z) ** 2 * N + 15.0 * entries**2,
               4.0 * unknowns * N**3 + 2.0 * (unknowns * N) ** 2)  # fmt: skip
    return OVERHEAD + form + unknowns**3 / 3 + 40.0 * N**3 + 25.0 * slacks


def _not_begun(Z: Array, families: Sequence[Family], outcome: LmiOutcome) -> Multipliers:
    """The answer where no step was made: nothing is known."""
    W = tuple(-np.tile(np.eye(f.size), (len(f.rows), 1, 1)) for f in families)
    extras = tuple(np.zeros((len(f.rows), f.extras)) for f in families)
    nothing = np.zeros(Z.shape[1])
    return Multipliers(outcome, W, extras, -np.inf, np.inf, nothing, 0)


def multipliers_at(
    program: Program, point: Point
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """(W, extras) of every family."""
    families, sets = program.families, program.sets(point.x)
    W = tuple(symmetric(x[:, : f.entries], f.size) for x, f in zip(sets, families, strict=True))
    return W, tuple(x[:, f.entries :] for x, f in zip(sets, families, strict=True))


def _positive(point: Point) -> bool:
    """True when M itself is positive definite."""
    M = point.S[0][0].copy()
    M[np.diag_indices(len(M))] += point.t
    try:
        np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        return False
    return True


__all__ = [
    "Family",
    "LmiOutcome",
    "Multipliers",
    "Slacks",
    "energy_rows",
    "find_multipliers",
    "restricted",
    "slacks_are_positive",
    "symmetric",
    "symmetric_basis",
]
