"""Primal-dual interior-point steps for the semidefinite programs of `program`.

The direction is that of [HRVW] and [KSH], with Mehrotra's corrector.

[HRVW] C. Helmberg, F. Rendl, R. Vanderbei, H. Wolkowicz, SIAM J. Optim. 6 (1996).
[KSH] M. Kojima, S. Shindoh, S. Hara, SIAM J. Optim. 7 (1997).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from .normal import Normal
from .program import Blocks, Family, Point, Program

Array = NDArray[np.float64]
ROOM = 0.95  # part of the way to the boundary that a step takes at most


# --------------------------------------------------------------------- the beginning
def start(program: Program) -> Point:
    """W = -I with extras so small that all slacks are positive definite, X = lam I + D.

    Raises LinAlgError where there are none, friction being too large for rounding.
    """
    identity = [-np.tile(_identity(f.size), _unknown_sets(f)) for f in program.families]
    x = np.concatenate([*identity, np.zeros(program.unknowns - program.entries)])
    for f, own, part in zip(
        program.families, program.sets(x), program.extra_parts, strict=True
    ):
        x[part] = _small_extras(f, own).ravel()
    least = np.linalg.eigvalsh(program.matrix(x))[0]
    x[-1] = least - 0.5 * abs(least)
    x *= program.theta / (program.traces @ x)
    objective = np.zeros((program.unknowns, 1))
    objective[-1] = -1.0
    solve = Normal(program, program.identity, program.identity)
    D = program.blocks(solve(objective)[:, 0])  # tr A_i D = -[i is t]
    lam = 2 * max(-float(np.linalg.eigvalsh(B).min(initial=0.0)) for B in D)
    X = [lam * one + B for one, B in zip(program.identity, D, strict=True)]
    return Point(x, program.blocks(x), X, lam)


def _identity(k: int) -> Array:
    low, high = np.triu_indices(k)
    return np.where(low == high, 1.0, 0.0)


def _unknown_sets(family: Family) -> int:
    return len(family.rows) if family.share is None else family.share.shape[1]


def _small_extras(family: Family, sets: Array) -> Array:
    """(sets, extras): `feasible` times a power of 1/4 with which all slacks are positive."""
    size = np.ones((len(sets), 1))
    for _ in range(40):
        sets[:, family.entries :] = size * family.feasible
        bad = np.zeros(len(sets), dtype=bool)
        for slacks in family.slacks:
            bad[slacks.owner[np.linalg.eigvalsh(slacks.at(sets))[:, 0] <= 0]] = True
        if not bad.any():
            return sets[:, family.entries :] * 0.5
        size[bad] /= 4
    raise np.linalg.LinAlgError("with W = -I and small extras not all slacks are positive")


# --------------------------------------------------------------------------- one step
def advance(program: Program, point: Point) -> tuple[Point, float] | None:
    """(next point, shorter one of its two step lengths), None where rounding forbids."""
    try:
        return _advanced(program, point)
    except np.linalg.LinAlgError:
        return None


def _advanced(program: Program, point: Point) -> tuple[Point, float] | None:
    """`advance`, raising LinAlgError where a block is not definite, the first ones included."""
    inverse = [_inverse(B) for B in point.S]
    normal = Normal(program, point.X, inverse)
    objective = np.zeros(program.unknowns)
    objective[-1] = 1.0
    gradient = program.adjoint(inverse)
    steps = normal(np.stack([objective, gradient, program.traces], axis=1))
    mu = _inner(point.X, point.S) / program.theta
    path = _Path(program, point, inverse, steps)
    dx, dS, dX, _ = path(steps[:, 0], 0.0)
    primal, dual = _length(point.X, dX), _length(point.S, dS)
    after = [(X + primal * d, S + dual * e)
             for X, d, S, e in zip(point.X, dX, point.S, dS, strict=True)]  # fmt: skip
    left = sum(float(np.einsum("jab,jab->", X, S)) for X, S in after) / program.theta / mu
    sigma = min(1.0, max(left, 0.0) ** 2 if min(primal, dual) > 0.1 else 0.5)
    second = [d @ e @ i for d, e, i in zip(dX, dS, inverse, strict=True)]
    corrected = normal((objective - program.adjoint(second))[:, None])[:, 0]
    dx, dS, dX, lam = path(corrected, sigma * mu, second)
    primal, dual = ROOM * _length(point.X, dX), ROOM * _length(point.S, dS)
    primal, dual = min(primal, 1.0), min(dual, 1.0)
    X = [B + primal * d for B, d in zip(point.X, dX, strict=True)]
    x = point.x + dual * dx
    x *= program.theta / (program.traces @ x)
    new = Point(x, program.blocks(x), X, point.lam + primal * (lam - point.lam))
    if not all(_definite(B) for B in new.S) or not all(_definite(B) for B in new.X):
        return None
    return new, min(primal, dual)


class _Path:
    """Steps towards X S = sigma mu I, minus a second-order term, that keep the traces."""

    def __init__(self, program: Program, point: Point, inverse: Blocks, steps: Array) -> None:
        self.program, self.point, self.inverse, self.steps = program, point, inverse, steps

    def __call__(
        self, first: Array, target: float, second: Blocks | None = None
    ) -> tuple[Array, Blocks, Blocks, float]:
        """(dx, dS, dX, new lam) with `first` the solution for the objective and `second`."""
        traces = self.program.traces
        dx = first + target * self.steps[:, 1]
        lam = float((traces @ dx) / (traces @ self.steps[:, 2]))
        dx = dx - lam * self.steps[:, 2]
        dS, dX = self.program.blocks(dx), []
        for k, (X, inverse) in enumerate(zip(self.point.X, self.inverse, strict=True)):
            rest = X @ dS[k] @ inverse + (second[k] if second else 0.0)
            dX.append(target * inverse - X - (rest + np.swapaxes(rest, 1, 2)) / 2)
        return dx, dS, dX, lam


def _inverse(B: Array) -> Array:
    root = np.linalg.inv(np.linalg.cholesky(B))
    return np.swapaxes(root, 1, 2) @ root


def _inner(X: Blocks, S: Blocks) -> float:
    return sum(float(np.einsum("jab,jab->", A, B)) for A, B in zip(X, S, strict=True))


def _definite(B: Array) -> bool:
    if B.shape[1] == 1:
        return bool((B > 0).all())
    try:
        np.linalg.cholesky(B)
    except np.linalg.LinAlgError:
        return False
    return True


def _length(blocks: Blocks, change: Blocks) -> float:
    """Step at which the first block is no longer positive definite, 1 / ROOM at most."""
    fastest = ROOM
    for B, d in zip(blocks, change, strict=True):
        if B.shape[1] == 1:
            rate = -d / B
            fastest = max(fastest, float(rate.max(initial=0.0)))
            continue
        root = np.linalg.inv(np.linalg.cholesky(B))
        turned = root @ d @ np.swapaxes(root, 1, 2)
        if len(B) == 1:
            low = linalg.eigvalsh(turned[0], subset_by_index=[0, 0], check_finite=False)
        else:
            low = np.linalg.eigvalsh(turned)
        fastest = max(fastest, -float(low.min(initial=0.0)))
    return 1 / fastest
