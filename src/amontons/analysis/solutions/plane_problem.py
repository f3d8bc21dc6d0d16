"""A 2D Coulomb problem: the box of its solutions, and its linear pieces, scaled.

Every solution dissipates, r u <= 0, so r W r + q r <= 0: where W is positive definite that
ellipsoid bounds all reactions and velocities beforehand, and proofs hold without further
assumption; so they do where W is singular but no reaction in the cone has W r = 0.  Of loads
between several, the ellipsoids are about points between theirs, and none is larger.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from ..multipliers.rounding import EPSILON, gamma
from ..scaled import Scaled, load_size, power_of_two
from ..statuses import FREE, MINUS, PLUS, STICK, States
from ..tolerances import SLACK

Array = NDArray[np.float64]
REACH = 1e6  # size of scaled reactions up to which proofs hold where W is singular
SYMMETRIC = 1e-12  # of W where only a symmetric one is bounded


@dataclass(frozen=True, eq=False)
class Box:
    """u = A x + c and bounds of a, b, u_N, u_T of every contact, low and high (4 nc,).

    In units of |W_ii| and |q|, not rounded, with which the search needs fewest patterns; so A
    and c are.  spread (2 nc,): bound of the error of A x by that.  u, x (2 nc,): numbers here
    per unit of scaled ones, of velocities and of a and b.  bounded: every solution is in the
    box; otherwise there may be some with larger reactions.
    """

    A: Array
    c: Array
    low: Array
    high: Array
    spread: Array
    u: Array
    x: Array
    bounded: bool


class PlaneProblem:
    """u = W r + c in scaled variables, and the box of all solutions.

    loads (k, 2 nc), mu (nc,): the box holds the solutions of all c between these and with
    coefficients up to mu; by default those that are given.  shrink (nc,): factors of the
    generators, by default so that none is much longer than 1.
    """

    def __init__(
        self, scaled: Scaled, loads: Array | None = None, mu: Array | None = None,
        shrink: Array | None = None,
    ) -> None:  # fmt: skip
        self.scaled, self.W, self.reacts = scaled, scaled.W, scaled.reacts
        nc = self.contacts = scaled.contacts
        self.loads = np.array(scaled.q.reshape(1, -1) if loads is None else loads)
        self.mu = scaled.mu if mu is None else mu
        normal = self.loads[:, 0::2]  # a view: rounding of the gap of what can not react
        normal[:, ~self.reacts] *= np.abs(normal[:, ~self.reacts]) > SLACK
        self.c = self.loads[0]
        generators = np.zeros((2 * nc, 2 * nc))  # r = generators x
        self.shrink = 1 / power_of_two(np.maximum(self.mu, 1.0)) if shrink is None else shrink
        for i in range(nc):
            generators[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = self.shrink[i] * np.array(
                [[1.0, 1.0], [self.mu[i], -self.mu[i]]]
            )
        self.generators = generators
        self.A = self.W @ generators

    @cached_property
    def box(self) -> Box:
        """What bounds the solutions."""
        found = self.range_of(self._bounded)
        bounded = found is not None
        if found is None:
            size = self._cone_bound()
            bounded = size < REACH
            found = self._wide_box(min(size, REACH))
        low, high = found
        size = np.sqrt(self.scaled.size)
        sizes = (load_size(c.reshape(-1, 2), self.mu, self.reacts) for c in self.loads)
        load = max(sizes) or 1.0
        x = np.repeat(size / load * self.shrink * np.maximum(self.mu, 1.0), 2)
        u = np.repeat(1 / (load * size), 2)
        each = np.stack([x.reshape(-1, 2), u.reshape(-1, 2)], axis=1).ravel()
        room = 8 * EPSILON * (np.abs(low) + np.abs(high)) * each
        most = np.maximum(high.reshape(-1, 4)[:, :2].ravel(), 0.0)
        terms = u * (np.abs(self.W) @ (np.abs(self.generators) @ most))
        A = u[:, None] * (self.W @ self.generators) / x
        return Box(A, u * self.c, low * each - room, high * each + room,
                   gamma(2 * self.contacts + 12) * terms,
                   u, x, bounded)  # fmt: skip

    def range_of(self, G: Array) -> tuple[Array, Array] | None:
        """The range of G^T r, of u_N and u_T more than that, G (2 nc, 4 nc) in rows of four.

        Over r W r + c r <= 0, rounding included; None where W is not surely definite.
        """
        found = energy_range(self.W, self.loads, G)
        if found is None:
            return None
        middle, reach = found
        start = np.zeros((len(self.loads), self.contacts, 4))
        start[:, :, 2:] = self.loads.reshape(len(self.loads), -1, 2)
        start = start.reshape(len(self.loads), -1)
        reach = reach + 4 * EPSILON * (np.abs(start) + np.abs(middle))
        return (start + middle - reach).min(axis=0), (start + middle + reach).max(axis=0)

    @property
    def _bounded(self) -> Array:
        """What is bounded, as functions (2 nc, 4 nc) of r: a, b, u_N, u_T of every contact."""
        m = len(self.W)
        G = np.zeros((m, 2 * m))
        along = np.repeat(0.5 / self.shrink, 2)
        slope = np.where(self.mu > 0, self.mu, np.inf)
        for i, (n, t) in enumerate(np.arange(m).reshape(-1, 2)):
            G[n, 4 * i : 4 * i + 2] = along[n] if self.mu[i] > 0 else 2 * along[n]
            G[t, 4 * i : 4 * i + 2] = np.array([1.0, -1.0]) * along[t] / slope[i]
            G[:, 4 * i + 2 : 4 * i + 4] = self.W[[n, t]].T
        return G

    @property
    def most_pressed(self) -> Array:
        """Bounds of r_N / shrink, (nc,)."""
        m = len(self.W)
        G = np.zeros((m, 2 * m))
        G[np.arange(0, m, 2), np.arange(0, 2 * m, 4)] = 1 / self.shrink
        found = self.range_of(G)
        size = min(self._cone_bound(), REACH)
        return np.full(m // 2, size) if found is None else found[1][0::4]

    def _cone_bound(self) -> float:
        """Bound of the sum S of all a, b where no reaction in the cone has W r = 0, else inf.

        W + e is positive semidefinite.  With A^T y >= 1/2 it is S <= 2 y W r, hence
        (1 - 2 e |y| g) S <= 2 |y|_(W + e) |r|_(W + e), and |r|_(W + e)^2 <= Q S + e g^2 S^2
        by dissipation, g the largest |r| that S = 1 allows.
        """
        from scipy.optimize import linprog

        W = (self.W + self.W.T) / 2
        if not self.contacts or np.abs(self.W - W).max() > SYMMETRIC:
            return np.inf
        m = len(W)
        values = np.linalg.eigvalsh(W)
        indefinite = max(0.0, -float(values[0])) + 4 * m * EPSILON * float(np.abs(values).max())
        able = np.repeat(self.reacts, 2)
        left = -np.hstack([self.A.T, -self.A.T])[able]
        answer = linprog(np.ones(2 * m), left, -np.ones(len(left)), method="highs")
        if not answer.success:
            return np.inf
        y = answer.x[:m] - answer.x[m:]
        if (self.A.T @ y)[able].min(initial=1.0) < 0.5 + 1e-6:
            return np.inf
        g = float(np.linalg.norm(self.generators, axis=0).max())
        Q = max(0.0, -float((self.generators.T @ self.loads.T)[able].min(initial=0.0)))
        Y = 4 * float(y @ W @ y + indefinite * (y @ y)) * (1 + 1e-6) + 1e-6
        rest = max(0.0, 1 - 2 * indefinite * float(np.linalg.norm(y)) * g)
        rest = rest**2 - Y * indefinite * g**2
        return Y * Q / rest if rest > 0.1 else np.inf

    def _wide_box(self, size: float) -> tuple[Array, Array]:
        """Bounds of all variables where the reactions are bounded by their sum alone."""
        reach_u = np.abs(self.A).max(axis=1, initial=0.0) * size * (1 + 1e-12)
        reach_u += 1e-12 * np.abs(self.loads).max(axis=0)
        low, high = np.zeros((2, self.contacts, 4))
        high[:, :2] = size
        low[:, 2:] = (self.loads.min(axis=0) - reach_u).reshape(-1, 2)
        high[:, 2:] = (self.loads.max(axis=0) + reach_u).reshape(-1, 2)
        return low.ravel(), high.ravel()

    # ---------------------------------------------------------------- one pattern
    def system(self, states: States) -> tuple[Array, NDArray[np.int64]]:
        """(r = R y, rows of u that vanish): the linear system (W R y + c)[rows] = 0."""
        columns, rows = [], []
        for i, state in enumerate(states):
            n, t = 2 * i, 2 * i + 1
            slope = {PLUS: self.mu[i], MINUS: -self.mu[i]}
            if state == FREE:
                continue
            rows.append(n)
            unit = self.shrink[i] if state in slope else 1.0
            columns.append({n: unit, t: unit * slope.get(state, 0.0)})
            if state == STICK:
                rows.append(t)
                columns.append({t: 1.0})
        R = np.zeros((2 * self.contacts, len(columns)))
        for k, column in enumerate(columns):
            R[list(column), k] = list(column.values())
        return R, np.array(rows, dtype=int)

    def slack_matrices(self, states: States) -> tuple[Array, Array]:
        """(P, Q), each (s, 2 nc): on the piece of a pattern P r + Q u must be >= 0."""
        rows: list[tuple[dict[int, float], dict[int, float]]] = []
        for i, state in enumerate(states):
            n, t, mu = 2 * i, 2 * i + 1, float(self.mu[i])
            if state == FREE:
                rows.append(({}, {n: 1.0}))
            elif state == STICK:
                rows += [({n: mu, t: -1.0}, {}), ({n: mu, t: 1.0}, {})]
            else:
                rows.append(({n: 1.0}, {}))
                if state == PLUS:
                    rows.append(({}, {t: -1.0}))
                elif state == MINUS:
                    rows.append(({}, {t: 1.0}))
        P, Q = np.zeros((2, len(rows), 2 * self.contacts))
        for k, (on_r, on_u) in enumerate(rows):
            P[k, list(on_r)], Q[k, list(on_u)] = list(on_r.values()), list(on_u.values())
        return P, Q


def energy_range(W: Array, loads: Array, G: Array) -> tuple[Array, Array] | None:
    """(middles (k, n), half width (n,)) of G^T r over r W r + c r <= 0, c of loads (k, m).

    G (m, n).  For all loads between these the middles are between theirs and the half width
    holds.  Rounding included; None where W is not surely definite.

    L L^T <= W, for L is the factor of W less what rounding can do to it (`rounding`).  So
    x = L^T r lies in the ball about -p / 2 through 0, p = L^-1 c, and g r = (L^-1 g) x.
    With X the computed L^-1 and |X L - 1| <= rho, |L^-1 g - X g| <= rho / (1 - rho) |X g|
    in the maximum norm.
    """
    m = len(W)
    W = (W + W.T) / 2
    shift = 4 * (m + 3) * EPSILON * np.abs(np.diag(W)).sum()
    try:
        L = np.linalg.cholesky(W - shift * np.eye(m))
    except np.linalg.LinAlgError:
        return None
    X = solve_triangular(L, np.eye(m), lower=True)
    off = np.abs(X @ L - np.eye(m)) + gamma(m + 2) * (np.abs(X) @ np.abs(L))
    rho = float(off.sum(axis=1).max(initial=0.0))
    if not rho < 0.5:
        return None
    H, dH = _inverted(X, G, rho)
    p, dp = _inverted(X, loads.T, rho)
    size, dsize = np.linalg.norm(H, axis=0), np.linalg.norm(dH, axis=0)
    ball, dball = (float(np.linalg.norm(x, axis=0).max()) for x in (p, dp))
    middle, reach = -(p.T @ H) / 2, (size + dsize) * (ball + dball) / 2
    reach += (dsize * ball + size * dball + dsize * dball) / 2
    reach += 8 * gamma(m + 4) * (size + dsize) * (ball + dball)
    return middle, reach


def _inverted(X: Array, G: Array, rho: float) -> tuple[Array, Array]:
    """(X G, bound of its difference from L^-1 G), X being L^-1 within rho."""
    H = X @ G
    rounding = gamma(len(X) + 2) * (np.abs(X) @ np.abs(G))
    most = (np.abs(H) + rounding).max(axis=0, initial=0.0)
    return H, rounding + rho / (1 - rho) * most
