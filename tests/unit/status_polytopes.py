"""All motions and reactions of small plane problems, by linear programs over the statuses.

In 2D every pattern of free, stick, slip to either side leaves a polytope of (r, v): its
extremes in any direction are linear programs.  Shares nothing with the package.
"""

from itertools import product

import numpy as np
from scipy.optimize import linprog


class Polytopes:
    """M v = H r + f, u = H^T v + w, Coulomb friction mu (nc,), two components a contact."""

    def __init__(self, M, H, f, w, mu, most=None):
        self.n, self.m = H.shape[0], H.shape[1]
        self.M, self.H, self.f, self.w, self.mu = M, H, f, w.ravel(), mu
        self.most = most
        self.patterns = [p for p in product("fs+-", repeat=len(mu)) if self._is_possible(p)]

    def _rows(self, pattern):
        """(A, b, E, e) of A x <= b, E x = e in x = (r, v)."""
        n, m = self.n, self.m
        u = np.hstack([np.zeros((m, m)), self.H.T])
        r = np.eye(m, m + n)
        A, b = [], []
        E, e = [*np.hstack([-self.H, self.M])], [*self.f]
        for i, status in enumerate(pattern):
            N, T, mu = 2 * i, 2 * i + 1, self.mu[i]
            if self.most is not None:
                A.append(r[N])
                b.append(self.most)
            if status == "f":
                E += [r[N], r[T]]
                e += [0.0, 0.0]
                A.append(-u[N])
                b.append(self.w[N])
                continue
            E.append(u[N])
            e.append(-self.w[N])
            A.append(-r[N])
            b.append(0.0)
            if status == "s":
                E.append(u[T])
                e.append(-self.w[T])
                A += [r[T] - mu * r[N], -r[T] - mu * r[N]]
                b += [0.0, 0.0]
            else:
                sign = 1.0 if status == "+" else -1.0
                E.append(r[T] + sign * mu * r[N])
                e.append(0.0)
                A.append(-sign * u[T])
                b.append(sign * self.w[T])
        return np.array(A), np.array(b), np.array(E), np.array(e)

    def _program(self, c, pattern):
        return linprog(c, *self._rows(pattern), bounds=(None, None))

    def _is_possible(self, pattern):
        return self._program(np.zeros(self.m + self.n), pattern).status == 0

    def extremes(self, c):
        """(least, largest) of c . (r, v) over all solutions; infinite where unbounded."""
        ends = []
        for pattern in self.patterns:
            for sign in (1.0, -1.0):
                found = self._program(sign * c, pattern)
                assert found.status in (0, 3), found.message
                ends.append(sign * (found.fun if found.status == 0 else -np.inf))
        return min(ends), max(ends)

    def motions(self):
        """(least, largest) of every velocity, (n,) each."""
        each = np.eye(self.m + self.n)[self.m :]
        return np.array([self.extremes(c) for c in each]).T
