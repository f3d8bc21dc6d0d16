"""Is there a solution on one linear piece of the law?  What computed numbers prove about it.

On the piece of a pattern u = W R y + c vanishes in some rows, E y = -c[rows], and the slacks
L y + l of its inequalities must be >= 0.  With X near E^-1 and |1 - X E'| <= rho < 1 in the
maximum norm for every E' that the data may mean, the exact y' of these data has

    |y' - y| <= |X| |E' y + c'| + rho / (1 - rho) max |X| |E' y + c'|,

residuals being summed in extended precision where the machine has one.  The data W, q and mu
are taken to be known up to DATA of themselves first.  A slack that keeps its sign for all of
these decides for the piece; a piece that is nearly singular is judged by the data as given.
Where even that is too much, the piece has a solution for a change of W by its rounding, and so
a set of them: found within tolerances.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..multipliers.rounding import EPSILON, gamma
from ..statuses import States
from ..tolerances import DATA, SLACK
from .plane_problem import PlaneProblem

Array = NDArray[np.float64]
REGULAR = 0.5  # largest rho
SINGULAR = 4 * EPSILON  # smallest singular value of a regular piece, per row and relative
CONSISTENT = 1e-12  # what a singular system may miss, scaled
TIGHT = 1e-11  # a slack that counts as zero in all of a set
STILL = 1e-12  # change of u along a set relative to that of r, scaled, that counts as none


class Existence(Enum):
    """Of a solution on a piece."""

    SURE = "sure"  # inside, by more than the data are uncertain
    NEAR = "near"  # on its border, as far as the data tell; or a set of solutions
    NONE = "none"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class PieceAnswer:
    """What is known about one piece; r, u (2 nc,) scaled, the errors off_r and off_u bounds.

    exists: a solution is there for the data as given.  sign: of the determinant, 0 where the
    piece is singular.  freedom: dimension of a set of
    solutions, of which r is one inside.  still: all of them have the same u.
    """

    states: States
    existence: Existence
    r: Array
    u: Array
    off_r: Array
    off_u: Array
    exists: bool = False
    sign: int = 0
    freedom: int = 0
    still: bool = False

    @property
    def off(self) -> float:
        """The largest error."""
        return float(max(self.off_r.max(initial=0.0), self.off_u.max(initial=0.0)))


@dataclass(frozen=True, eq=False)
class PieceSystem:
    """The matrices of one piece: r = R y, u = WR y + c, slacks P r + Q u, E = WR[rows]."""

    plane: PlaneProblem
    states: States
    R: Array
    rows: NDArray[np.int64]
    P: Array
    Q: Array

    @classmethod
    def of(cls, plane: PlaneProblem, states: States) -> PieceSystem:
        """Those of a pattern."""
        return cls(plane, states, *plane.system(states), *plane.slack_matrices(states))

    @property
    def L(self) -> Array:
        """Slacks as functions of y, (s, k)."""
        return self.P @ self.R + self.Q @ (self.plane.W @ self.R)

    @property
    def sign(self) -> int:
        """Of the determinant."""
        E = (self.plane.W @ self.R)[self.rows]
        return int(np.linalg.slogdet(E)[0]) if len(E) else 1

    def inverse(self, data: float) -> tuple[Array, float] | None:
        """(X, rho), None where the piece may be singular for data that are off so much."""
        E = (self.plane.W @ self.R)[self.rows]
        k = len(E)
        try:
            X: Any = np.linalg.inv(E)
        except np.linalg.LinAlgError:
            return None
        terms = np.abs(self.plane.W)[self.rows] @ np.abs(self.R)
        spread = (2 * data + gamma(k + len(self.plane.W) + 4)) * (np.abs(X) @ terms)
        rho = float((np.abs(X @ E - np.eye(k)) + spread).sum(axis=1).max(initial=0.0))
        return (X, rho) if rho < REGULAR else None


def examined(plane: PlaneProblem, states: States) -> PieceAnswer:
    """What is known about the piece of a pattern."""
    system = PieceSystem.of(plane, states)
    for data in (DATA, 0.0):
        found = system.inverse(data)
        if found is not None:
            answer = _judged(system, *found, data)
            if answer.existence is not Existence.NEAR or not data:
                return answer
            return replace(answer, exists=_exists_as_given(system))
    return _singular(system)


def _exists_as_given(system: PieceSystem) -> bool:
    found = system.inverse(0.0)
    return found is not None and _judged(system, *found, 0.0).exists


@dataclass(frozen=True, eq=False)
class Located:
    """The solution of the equations of a piece, its slacks, and bounds of all errors."""

    r: Array
    u: Array
    slack: Array
    off_r: Array
    off_u: Array
    off_slack: Array


def located(system: PieceSystem, X: Array, rho: float, data: float) -> Located:
    """Where the equations of a regular piece hold, for data that are off so much."""
    plane, R, rows = system.plane, system.R, system.rows
    y = -(X @ plane.c[rows])
    for _ in range(2):
        y = y - X @ _exact(system, y)[1][rows]
    r, u, slack = _exact(system, y)
    y_size = np.abs(R) @ np.abs(y)
    terms = np.abs(plane.W) @ y_size + np.abs(plane.c)
    fine = (2 * len(plane.W) + 8) * float(np.finfo(np.longdouble).eps)
    error = np.abs(u[rows]) * (1 + EPSILON) + (fine + 2 * data) * terms[rows]
    lead = (np.abs(X) @ error) * (1 + gamma(len(y) + 4))
    rest = rho / (1 - rho) * float(lead.max(initial=0.0))
    size = np.abs(system.P) @ np.abs(R)
    size = size + np.abs(system.Q) @ (np.abs(plane.W) @ np.abs(R))
    through = np.abs(system.L @ X) + gamma(2 * len(plane.W) + 4) * (size @ np.abs(X))
    off = through @ error + size.sum(axis=1) * rest + EPSILON * np.abs(slack)
    off += (2 * fine + 3 * data) * (np.abs(system.P) @ y_size + np.abs(system.Q) @ terms)
    off_r = np.abs(R) @ (lead + rest) + (data + 2 * EPSILON) * y_size
    off_u = np.abs(plane.W @ R) @ (lead + rest) + EPSILON * np.abs(u)
    off_u += (fine + data + gamma(len(y) + 4) * rho) * terms
    return Located(r, u, slack, off_r, off_u, off)


def _judged(system: PieceSystem, X: Array, rho: float, data: float) -> PieceAnswer:
    """The answer about a regular piece."""
    at = located(system, X, rho, data)
    existence = Existence.NEAR
    if (at.slack < -at.off_slack).any():
        existence = Existence.NONE
    elif (at.slack > at.off_slack).all():
        existence = Existence.SURE
    exists = existence is Existence.SURE
    return PieceAnswer(system.states, existence, at.r, at.u, at.off_r, at.off_u, exists,
                       system.sign)  # fmt: skip


def _exact(system: PieceSystem, y: Array) -> tuple[Array, Array, Array]:
    """(r, u, slacks) at y, each of them rounded once where the machine has a wider type."""
    wide = np.longdouble
    r = system.R.astype(wide) @ y.astype(wide)
    u = system.plane.W.astype(wide) @ r + system.plane.c.astype(wide)
    slack = system.P.astype(wide) @ r + system.Q.astype(wide) @ u
    return r.astype(float), u.astype(float), slack.astype(float)


# ------------------------------------------------------------------ singular pieces
def _singular(system: PieceSystem) -> PieceAnswer:
    """A set of solutions on a piece that is singular within rounding, or nothing known."""
    plane, R, rows = system.plane, system.R, system.rows
    none = np.zeros(len(plane.W))
    unknown = PieceAnswer(system.states, Existence.UNKNOWN, none, none, none, none)
    left, values, right = np.linalg.svd((plane.W @ R)[rows])
    rank = int((values > SINGULAR * len(values) * max(values[0], 1.0)).sum())
    c = plane.c[rows]
    if rank == len(rows) or np.abs(left[:, rank:].T @ c).max() > CONSISTENT:
        return unknown
    y = -right[:rank].T @ ((left[:, :rank].T @ c) / values[:rank])
    found = _inside(system, y, right[rank:].T)
    if found is None:
        return unknown
    r, directions = found
    motion, terms = plane.W @ directions, np.abs(directions).sum(axis=0)
    off = np.full(len(r), SLACK) * max(1.0, float(np.abs(r).max(initial=0.0)))
    still = bool((np.abs(motion) <= STILL * terms).all())
    u = plane.W @ r + plane.c
    return PieceAnswer(system.states, Existence.NEAR, r, u, off, off,
                       freedom=directions.shape[1], still=still)  # fmt: skip


def _inside(system: PieceSystem, y: Array, kernel: Array) -> tuple[Array, Array] | None:
    """(a point inside the solutions y + kernel t as r, directions in which they go on as r).

    Homogeneous in (t, scale), so that one linear program finds every slack that can be
    positive; those that can not reduce the dimension.
    """
    from scipy.optimize import linprog

    plane = system.plane
    k = kernel.shape[1]
    G = system.L @ kernel
    g = system.L @ y + system.Q @ plane.c
    left = np.hstack([-G, -g[:, None], np.eye(len(g))])
    bounds = [(None, None)] * k + [(1, None)] + [(0, 1)] * len(g)
    cost = np.concatenate([np.zeros(k + 1), -np.ones(len(g))])
    answer = linprog(cost, left, np.full(len(g), SLACK), bounds=bounds, method="highs")
    if not answer.success:
        return None
    t, tight, along = answer.x[:k] / answer.x[k], answer.x[k + 1 :] < 0.5, kernel
    if tight.any():  # exactly on them
        t = t - np.linalg.lstsq(G[tight], g[tight] + G[tight] @ t, rcond=SLACK)[0]
        _, values, right = np.linalg.svd(G[tight])
        along = kernel @ right[int((values > SLACK).sum()) :].T
    slack = g + G @ t
    size = max(1.0, float(np.abs(t).max(initial=0.0)))
    if np.abs(slack[tight]).max(initial=0.0) > TIGHT * size or (slack[~tight] <= 0).any():
        return None
    return system.R @ (y + kernel @ t), system.R @ along
