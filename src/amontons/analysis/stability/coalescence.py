"""Flutter and divergence over the friction, without a sweep.

Let p scale all friction and l = -s^2.  Without damping Q(l, p) = [[K, -F_0 - p F_1], [B, D]] -
l [[M, 0], [0, 0]] is singular for modes.  Two of them meet where, with the bordered system

    [ Q   b ] [x]   [0]
    [ c^T 0 ] [g] = [1],

g = 0 and dg/dl = 0 ([G]): two equations for l and p, solved by Newton's method on the whole
sparse system; all derivatives of g come from solves with the same matrix and its transpose.
Near the point g = g_ll (l - l_0)^2 / 2 + g_p (p - p_0): l is complex beyond it, and one of the
modes grows, where g_p g_ll > 0; such points are told.

Starts are those of the slowest modes without friction, dense (`reduced`): where the eigenvalues
of this small problem, followed over p, leave the real axis.  A pair that is still wide at its
start has no g without poles nearby.  Where Newton's method ends nowhere or far from the start
the pair is followed: with X, Y (n, 2) of its right and left motions, by inverse iteration at l,
Y^T Q X and its derivative by p are two by two, the discriminant is a quadratic in p, and its
next zero the next p.  What is not found even so is said in `warnings`.

Divergence, l = 0, is an eigenvalue problem in p.  Damping shifts both; then `modes` tells.

[G] W. Govaerts, "Numerical Methods for Bifurcations of Dynamical Equilibria", SIAM (2000).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator
from ...core.warned import ResultWarning
from .bordered import Point, Sparse, iterate, same
from .reduced import LARGEST, Reduced, starts
from .sliding import SlidingState, factor

Array = NDArray[np.float64]
SAME = 1e-7
AHEAD = 1.2  # of the last point that is wanted: starts up to there are tried, too
NEAR = 0.05  # relative distance from a start up to which a point is the one meant
FOLLOWED = 40  # steps with a pair of modes
LONGEST = 0.3  # such a step, relative
CLOSE = 1e-6  # such a step at which Newton's method takes over


@dataclass(frozen=True)
class Flutter:
    """Two modes meet at a friction mu (the largest of the contacts), with this frequency."""

    mu: float
    frequency: float


class FlutterPoints(tuple[Flutter, ...]):
    """Points, friction ascending; warnings: those that could not be made precise, in words.

    `up_to`: the frequency up to which was looked; points of higher ones are not told.
    """

    warnings: tuple[ResultWarning, ...]
    up_to: float

    def __new__(
        cls,
        points: Iterable[Flutter] = (),
        warnings: tuple[ResultWarning, ...] = (),
        up_to: float = np.inf,
    ) -> FlutterPoints:
        """With warnings."""
        made = super().__new__(cls, points)
        made.warnings = warnings
        made.up_to = up_to
        return made


def flutter_points(state: SlidingState, count: int, most: int) -> FlutterPoints:
    """Frictions at which modes begin to grow, ascending; see the module."""
    state = replace(state, C=None)
    if not state.mu > 0 or not state.F_1.nnz:
        return FlutterPoints()
    small = Reduced.of(state, max(count, 2))
    known: list[Point] = []
    failed: list[Point] = []
    out: list[Flutter] = []
    for start in starts(small, state.mu):
        if len(out) >= most and start.p > AHEAD * out[most - 1].mu / state.mu:
            break
        found = _points(state, small, start)
        for point in found:
            if any(same(point, other, SAME) for other in known):
                continue
            known.append(point)
            if point.begins:
                frequency = float(np.sqrt(point.l) / (2 * np.pi))
                out.append(Flutter(float(point.p * state.mu), frequency))
                out.sort(key=lambda each: each.mu)
        if not any(same(point, start, NEAR) for point in found):
            failed.append(start)
    last = out[most - 1].mu if len(out) >= most else np.inf
    up_to = np.inf if small.every else float(np.sqrt(small.reach) / (2 * np.pi))
    return FlutterPoints(out[:most], _doubts(state, failed, known, last), up_to)


def _doubts(
    state: SlidingState, failed: list[Point], known: list[Point], last: float
) -> tuple[ResultWarning, ...]:
    """Of starts up to the last point told near which there is none."""
    return tuple(
        ResultWarning(
            "flutter-not-found",
            f"near friction {start.p * state.mu:.4g} two modes seem to meet at a frequency of "
            f"{np.sqrt(start.l) / (2 * np.pi):.4g}, but the point was not found; ask for modes "
            "at frictions around it",
        )
        for start in failed
        if start.p * state.mu <= last and not any(same(p, start, NEAR) for p in known)
    )


def divergence_points(state: SlidingState) -> Array:
    """Frictions > 0 at which the stiffness with contact is singular, ascending."""
    if not state.mu > 0 or not state.F_1.nnz:
        return np.zeros(0)
    from scipy.sparse.linalg import LinearOperator, eigs

    K, slope = state.stiffness(0.0), -state.by_friction
    solve = factor(K).solve
    n = state.size
    if n <= 400:
        values = np.linalg.eigvals(solve(slope.toarray()))
    else:
        inverse = LinearOperator((n, n), lambda x: solve(slope @ x), dtype=float)  # type: ignore[call-arg]
        start = np.cos(np.arange(1.0, n + 1.0))
        values = eigs(inverse, k=min(6, n - 2), v0=solve(slope @ start), tol=0,
                      return_eigenvectors=False)  # fmt: skip
    values = np.asarray(values)
    size = np.abs(values).max(initial=0.0)
    real: Any = values[(np.abs(values.imag) <= 1e-9 * np.abs(values)) & (values.real > 0)].real
    real = real[real > max(1 / LARGEST, 1e-12 * size)]
    return np.sort(state.mu / real)


def _points(state: SlidingState, small: Reduced, start: Point) -> list[Point]:
    """Points of the whole problem that a start leads to, the nearest one last."""
    found = _newton(state, start.l, start.p)
    out = [] if found is None else [found]
    if not any(same(point, start, NEAR) for point in out):
        nearer = _by_pair(state, start.l, start.p, *small.pair(start.l, start.p))
        found = None if nearer is None else _newton(state, *nearer)
        out += [] if found is None else [found]
    return out


def _newton(state: SlidingState, l: float, p: float) -> Point | None:
    """The point near (l, p) of the whole problem."""
    M, slope = state.wide(state.M), state.by_friction
    n = state.size
    b = c = np.cos(np.arange(1.0, n + 1.0))

    def solver(l: float, p: float) -> Any:
        nonlocal b, c
        made = Sparse(sparse.csc_array(state.stiffness(p) - l * M), b, c)
        b, c = made.b, made.c
        return made

    products = lambda x: -(M @ x), lambda x: slope @ x, lambda x: slope.T @ x
    return iterate(solver, *products, l, p)


def _by_pair(
    state: SlidingState, l: float, p: float, right: Array, left: Array
) -> tuple[float, float] | None:
    """(l, p) where the pair of modes with motions right, left (n, 2) meets, nearly."""
    M, slope = state.wide(state.M), state.by_friction
    zero = np.zeros((state.B.shape[0], 2))
    X, Y = np.vstack([right, zero]), np.vstack([left, zero])
    for _ in range(FOLLOWED):
        Q = sparse.csc_array(state.stiffness(p) - l * M)
        try:
            ahead, back = factor(Q).solve, factor(sparse.csc_array(Q.T)).solve
            for _ in range(2):
                X = np.linalg.qr(np.asarray(ahead(M @ X)))[0]
                Y = np.linalg.qr(np.asarray(back(M.T @ Y)))[0]
            T, S = (np.linalg.solve(Y.T @ (M @ X), Y.T @ (A @ X)) for A in (Q, slope))
        except (SingularOperator, np.linalg.LinAlgError):
            return l, p  # an eigenvalue: Newton's method tells which
        dp = _to_meet(T, S)
        if not np.isfinite(dp):
            return None
        dp = float(np.clip(dp, -LONGEST * p, LONGEST * p))
        dl = float(np.trace(T + dp * S)) / 2
        if abs(dl) > LONGEST * l:
            dp, dl = dp * LONGEST * l / abs(dl), np.copysign(LONGEST * l, dl)
        l, p = l + float(dl), p + dp
        if abs(dp) <= CLOSE * p and abs(dl) <= CLOSE * l:
            return l, p
    return None


def _to_meet(T: Array, S: Array) -> float:
    """The smallest step x at which T + x S, two by two, has a double eigenvalue; nan: none."""
    T, S = (A - 0.5 * np.trace(A) * np.eye(2) for A in (T, S))
    mixed = T[0, 0] * S[1, 1] + T[1, 1] * S[0, 0] - T[0, 1] * S[1, 0] - T[1, 0] * S[0, 1]
    found = np.roots([np.linalg.det(S), mixed, np.linalg.det(T)])
    return float(found[np.argmin(np.abs(found))].real) if len(found) else float("nan")
