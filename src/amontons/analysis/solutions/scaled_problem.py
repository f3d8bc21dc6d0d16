"""A 2D Coulomb problem in scaled variables: the box of its solutions, and its linear pieces.

Scaled variables: r sqrt|W_ii| and u / sqrt|W_ii|, divided by |q / sqrt|W_ii|| of the contacts
that q can press (`load_size`).  Every solution dissipates, r u <= 0, so r W r + q r <= 0: where
W is positive definite that ellipsoid bounds all reactions and velocities beforehand, and proofs
hold without further assumption; so they do where W is singular but no reaction in the cone has
W r = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from ...dense import dense
from ...problem import FrictionProblem
from ..multipliers.scales import contact_sizes, load_size
from . import pattern_search as search

Array = NDArray[np.float64]
States = NDArray[np.int8]
DEFINITE = 1e-10  # smallest eigenvalue of a positive definite scaled W, relative to the largest
REACH = 1e6  # size of scaled reactions up to which proofs hold where W is singular
SINGULAR = 1e-11  # smallest singular value of a piece that has an isolated solution, relative
SAME = 1e-8  # scaled distance of two solutions that count as one
SLACK = 1e-9  # violation of the law by a solution, in scaled variables, that counts as none


class ScaledProblem:
    """The problem in scaled variables, u = A x + c, and the box of all solutions."""

    def __init__(self, problem: FrictionProblem) -> None:
        assert problem.W is not None and problem.q is not None
        self.problem, self.mu = problem, problem.mu
        nc = self.contacts = problem.contacts
        W = dense(problem.W)
        size, self.reacts = contact_sizes(W, nc)
        root = np.repeat(np.sqrt(size), 2)
        self.unit = load_size(problem.q / root.reshape(nc, 2), self.mu, self.reacts)
        self.to_r, self.to_u = self.unit / root, self.unit * root
        self.W = W / root / root[:, None]
        self.c = problem.q.ravel() / self.to_u
        normal = self.c[0::2]  # a view: rounding of the gap of a contact that can not react
        normal[~self.reacts & (np.abs(normal) <= SLACK)] = 0.0
        generators = np.zeros((2 * nc, 2 * nc))  # r = generators x
        shrink = 1 / np.maximum(self.mu, 1.0)
        for i in range(nc):
            generators[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = shrink[i] * np.array(
                [[1.0, 1.0], [self.mu[i], -self.mu[i]]]
            )
        self.generators = generators
        self.A = self.W @ generators
        self.low, self.high = self._box(shrink)

    def _box(self, shrink: Array) -> tuple[Array, Array]:
        """Bounds of a, b, u_N, u_T of every contact, (4 nc,) each."""
        W = (self.W + self.W.T) / 2
        values = np.linalg.eigvalsh(W)
        if values[0] <= DEFINITE * values[-1]:
            semidefinite = values[0] >= -DEFINITE * values[-1]
            size = self._cone_bound(W) if semidefinite else np.inf
            self.bounded = size < REACH
            return self._wide_box(min(size, REACH))
        self.bounded = True
        inverse = np.linalg.inv(W)
        centre = -inverse @ self.c / 2
        radius = np.sqrt(-self.c @ centre / 2)
        mu = np.where(self.mu > 0, self.mu, np.inf)
        low, high = np.empty((2, self.contacts, 4))
        for i in range(self.contacts):
            part = slice(2 * i, 2 * i + 2)
            along = np.array([[0.5, 0.5 / mu[i]], [0.5, -0.5 / mu[i]]]) / shrink[i]
            if self.mu[i] == 0:
                along[0] = [1.0, 0.0]  # a is r_N, b is zero
            middle = along @ centre[part]
            reach = radius * np.sqrt(np.diag(along @ inverse[part, part] @ along.T))
            low[i, :2], high[i, :2] = middle - reach, middle + reach
        # u is bounded through r, whatever the symmetry of W
        centre_u = self.W @ centre + self.c
        root = np.linalg.cholesky(inverse)
        reach_u = radius * np.linalg.norm(self.W @ root, axis=1)
        low[:, 2:] = (centre_u - reach_u).reshape(-1, 2)
        high[:, 2:] = (centre_u + reach_u).reshape(-1, 2)
        room = 1e-5 * (np.abs(low) + np.abs(high))  # rounding of the inverse, by DEFINITE
        return (low - room).ravel(), (high + room).ravel()

    def _cone_bound(self, W: Array) -> float:
        """Bound of the sum of all a and b where no reaction in the cone has W r = 0, else inf.

        With A^T y >= 1/2 it is S <= 2 y W r <= 2 |y|_W |r|_W, and |r|_W^2 <= -q r <= Q S.
        """
        m = 2 * self.contacts
        able = np.repeat(self.reacts, 2)
        left = -np.hstack([self.A.T, -self.A.T])[able]
        answer = linprog(np.ones(2 * m), left, -np.ones(len(left)), method="highs")
        if not answer.success:
            return np.inf
        y = answer.x[:m] - answer.x[m:]
        if (self.A.T @ y)[able].min(initial=1.0) < 0.5 or np.abs(self.W - W).max() > 1e-12:
            return np.inf
        Q = max(0.0, -float((self.generators.T @ self.c)[able].min(initial=0.0)))
        return 4 * float(y @ W @ y) * Q * (1 + 1e-6) + 1e-6

    def _wide_box(self, size: float) -> tuple[Array, Array]:
        """Bounds of all variables where the reactions are bounded by their sum alone."""
        reach_u = np.abs(self.A).max(axis=1, initial=0.0) * size
        low, high = np.zeros((2, self.contacts, 4))
        high[:, :2] = size
        low[:, 2:] = (self.c - reach_u).reshape(-1, 2)
        high[:, 2:] = (self.c + reach_u).reshape(-1, 2)
        return low.ravel(), high.ravel()

    # ---------------------------------------------------------------- one pattern
    def system(self, states: States) -> tuple[Array, Array]:
        """(r = R y, rows E of u that vanish): the linear system E (W R y + c) = 0."""
        columns, rows = [], []
        for i, state in enumerate(states):
            n, t = 2 * i, 2 * i + 1
            slope = {search.SLIP_PLUS: self.mu[i], search.SLIP_MINUS: -self.mu[i]}
            if state == search.OPEN:
                continue
            rows.append(n)
            columns.append({n: 1.0, t: slope.get(state, 0.0)})
            if state == search.STICK:
                rows.append(t)
                columns.append({t: 1.0})
        R = np.zeros((2 * self.contacts, len(columns)))
        for k, column in enumerate(columns):
            R[list(column), k] = list(column.values())
        return R, np.array(rows, dtype=int)

    def slacks(self, states: States, r: Array, u: Array) -> Array:
        """What must be >= 0 on a piece, for r and u flat or with directions in columns."""
        rows = []
        for i, state in enumerate(states):
            n, t, mu = 2 * i, 2 * i + 1, self.mu[i]
            if state == search.OPEN:
                rows.append(u[n])
            elif state == search.STICK:
                rows += [mu * r[n] - r[t], mu * r[n] + r[t]]
            else:
                rows.append(r[n])
                if state == search.SLIP_PLUS:
                    rows.append(-u[t])
                elif state == search.SLIP_MINUS:
                    rows.append(u[t])
        return np.array(rows)

    def holds(self, states: States, r: Array, u: Array) -> bool:
        """True where r, u lie on the closed piece."""
        R, rows = self.system(states)
        outside = r - R @ np.linalg.lstsq(R, r, rcond=None)[0] if R.size else r
        off = max(np.abs(u[rows]).max(initial=0), np.abs(outside).max(initial=0))
        return off <= SAME and self.slacks(states, r, u).min() >= -SAME

    def solve(self, states: States) -> tuple[Array, int, int] | None:
        """(r, orientation, freedom) on the piece of a pattern, None without a solution."""
        R, rows = self.system(states)
        E = (self.W @ R)[rows]
        if not len(rows):
            r = np.zeros(2 * self.contacts)
            return (r, 1, 0) if self.slacks(states, r, self.c).min() >= -SLACK else None
        left, values, right = np.linalg.svd(E)
        rank = int((values > SINGULAR * max(values[0], 1.0)).sum())
        if rank == len(rows):
            r = R @ np.linalg.solve(E, -self.c[rows])
            sign = int(np.linalg.slogdet(E)[0])
            fits = self.slacks(states, r, self.W @ r + self.c).min() >= -SLACK
            return (r, sign, 0) if fits else None
        if np.abs(left[:, rank:].T @ self.c[rows]).max() > SLACK:
            return None
        y = -right[:rank].T @ ((left[:, :rank].T @ self.c[rows]) / values[:rank])
        return self._inside(states, R @ y, R @ right[rank:].T)

    def _inside(
        self, states: States, r: Array, directions: Array
    ) -> tuple[Array, int, int] | None:
        """A point inside the solutions r + directions t on a singular piece.

        Homogeneous in (t, scale), so that one linear program finds every slack that can be
        positive; those that can not reduce the dimension.
        """
        k = directions.shape[1]
        G = self.slacks(states, directions, self.W @ directions)
        g = self.slacks(states, r, self.W @ r + self.c)
        left = np.hstack([-G, -g[:, None], np.eye(len(g))])
        bounds = [(None, None)] * k + [(1, None)] + [(0, 1)] * len(g)
        cost = np.concatenate([np.zeros(k + 1), -np.ones(len(g))])
        answer = linprog(cost, left, np.full(len(g), SLACK), bounds=bounds, method="highs")
        if not answer.success:
            return None
        tight = answer.x[k + 1 :] < 0.5
        freedom = k - (np.linalg.matrix_rank(G[tight], tol=SAME) if tight.any() else 0)
        return r + directions @ (answer.x[:k] / answer.x[k]), 0, int(freedom)

    def excluded(self, states: States) -> bool:
        """True when a pattern has no solution by a margin far above rounding.

        Only for the few patterns that the search left: a well-conditioned system whose only
        solution violates the law.
        """
        R, rows = self.system(states)
        if not len(rows):
            return bool(self.slacks(states, 0 * self.c, self.c).min() < -SLACK)
        E = (self.W @ R)[rows]
        values = np.linalg.svd(E, compute_uv=False)
        if values[-1] <= SINGULAR * max(values[0], 1.0):
            return False
        r = R @ np.linalg.solve(E, -self.c[rows])
        rounding = len(rows) * np.finfo(float).eps * values[0] / values[-1] * np.abs(r).max()
        worst = -self.slacks(states, r, self.W @ r + self.c).min()
        return bool(worst > 100 * rounding * (1 + self.mu.max()) + SLACK)
