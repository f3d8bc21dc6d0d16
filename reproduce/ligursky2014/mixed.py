"""The function H of problem (P) in full, as a user writes it: displacements and multipliers.

Unknowns are the displacements u and the contact forces r; equilibrium, then two equations per
contact, those of the projections on the cone of friction.  It names the active selection
function by one number per contact, and nothing more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

import amontons as am

Array = NDArray[np.float64]
FREE, STICK, FORTH, BACK = range(4)


class FullProblem:
    """H(gamma, u, r) between the discrete problems `start` at gamma = 0 and `end` at 1."""

    def __init__(self, start: am.FrictionProblem, end: am.FrictionProblem) -> None:
        self.M, self.H, self.mu = sparse.csr_array(start.M), sparse.csr_array(start.H), start.mu
        self.loads = np.asarray(start.f), np.asarray(end.f)
        self.gaps = np.asarray(start.w).ravel(), np.asarray(end.w).ravel()
        self.n = self.M.shape[0]
        self.normal = 2 * np.arange(start.contacts)
        self.calls = 0

    def _contact(self, y: Array, p: float) -> tuple[Array, Array, Array]:
        """(velocities, forces, their difference z), (nc, 2) each."""
        first, last = self.gaps
        u = self.H.T @ y[: self.n] + first + p * (last - first)
        r = y[self.n :]
        return u.reshape(-1, 2), r.reshape(-1, 2), (r - u).reshape(-1, 2)

    def local(self, y: Array, p: float) -> tuple[Array, Array]:
        """Displacements and forces of the contacts, (nc, 2) each."""
        return self._contact(y, p)[:2]

    def piece(self, y: Array, p: float) -> NDArray[np.int64]:
        """One number per contact."""
        _, _, z = self._contact(y, p)
        bound = self.mu * np.maximum(z[:, 0], 0)
        slip = np.where(z[:, 1] > 0, FORTH, BACK)
        return np.where(z[:, 0] <= 0, FREE, np.where(np.abs(z[:, 1]) <= bound, STICK, slip))

    def residual(self, y: Array, p: float) -> Array:
        """Equilibrium, and the laws of normal contact and friction."""
        u, r, z = self._contact(y, p)
        state = self.piece(y, p)
        first, last = self.loads
        balance = self.M @ y[: self.n] - first - p * (last - first) - self.H @ y[self.n :]
        bound = np.where(state == FORTH, 1.0, -1.0) * self.mu * z[:, 0]
        normal = np.where(state == FREE, r[:, 0], u[:, 0])
        tangential = np.select([state == FREE, state == STICK], [r[:, 1], u[:, 1]],
                               r[:, 1] - bound)  # fmt: skip
        return np.concatenate([balance, np.column_stack([normal, tangential]).ravel()])

    def jacobian(self, y: Array, p: float) -> tuple[sparse.csc_array, Array]:
        """Derivatives by y and gamma of the active selection function."""
        self.calls += 1
        state = self.piece(y, p)
        free, stick = state == FREE, state == STICK
        slope = np.select([state == FORTH, state == BACK], [self.mu, -self.mu], 0.0)
        N, T = self.normal, self.normal + 1
        size = 2 * len(N)
        of_u = _matrix(size, (N, N, ~free), (T, T, stick), (T, N, slope))
        of_r = _matrix(size, (N, N, free), (T, T, ~stick), (T, N, -slope))
        J = sparse.block_array([[self.M, -self.H], [of_u @ self.H.T, of_r]])
        moved = self.gaps[1] - self.gaps[0]
        by_gamma = np.concatenate([self.loads[0] - self.loads[1], of_u @ moved])
        return sparse.csc_array(J), by_gamma


def _matrix(size: int, *entries: tuple[Array, Array, Array]) -> sparse.csr_array:
    rows, columns, values = (np.concatenate(part) for part in zip(*entries, strict=True))
    return sparse.csr_array((values.astype(float), (rows, columns)), shape=(size, size))


def full_problem(branch: am.Branch) -> tuple[FullProblem, Array]:
    """The problem of a branch over the load in full, and its solution at gamma = 0."""
    path = branch.problem
    solution = path.solution(branch.at(0.0)[0], 0.0)
    return FullProblem(path.start, path.end), np.concatenate([solution.v, solution.r.ravel()])
