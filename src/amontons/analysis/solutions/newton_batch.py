"""Semismooth Newton from many starts at once, by stacked dense systems.

The Alart-Curnier function of `solvers.functions` on a problem in scaled variables,
u = W r + c with |W_ii| and |c| near 1: (A + B W) dr = -F for a whole stack of reactions, one
call of LAPACK for all.  There is no line search: steps are full, or shortened at random once
they did not converge at once, which leaves cycles.  A step near a known solution can be
deflated, [FBF] eq. (2.11): with m the product of 1 + 1 / |r - r_k|^2 over the known ones, the
Newton step of m F is dr / (1 - dm dr / m).

[FBF] P. Farrell, A. Birkisson, S. Funke, "Deflation techniques for finding distinct solutions
of nonlinear partial differential equations", SIAM J. Sci. Comput. 37 (2015).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...linear.dense import dense
from ...problem.friction import FrictionProblem
from ...problem.law.cones import Coulomb
from ...solvers.newton.functions import AlartCurnier
from ..multipliers.scales import contact_sizes, load_size, power_of_two

Array = NDArray[np.float64]
FREE, STICK, SLIP = 0, 1, 2
STEPS = 40  # Newton steps from a start
CONVERGED = 1e-12  # |F| relative to 1 + |r|, scaled
SYSTEM = 2e5  # operations that a linear system counts for, however small
LONGEST = 1e8  # scaled reactions that count as run away
WIDE = 4e6  # entries of a stack of matrices


@dataclass(frozen=True, eq=False)
class Stack:
    """A problem in scaled variables, r * to_r being reactions in their unit.

    W (nc d, nc d), c (nc, d), mu (nc,), able (nc,): contacts that can react.  The scales are
    powers of two, so that nothing is rounded: |W_ii| and |c| are 1 within factors of 2.
    """

    problem: FrictionProblem
    W: Array
    c: Array
    mu: Array
    able: NDArray[np.bool_]
    to_r: Array
    to_u: Array

    @classmethod
    def of(cls, problem: FrictionProblem) -> Stack:
        """The scaled form of a problem in Delassus form with q != 0."""
        assert problem.W is not None and problem.q is not None
        W = dense(problem.W, 4)
        nc, d = problem.q.shape
        size, reacts = contact_sizes(W, nc)
        root = power_of_two(np.sqrt(size))[:, None]
        unit = float(power_of_two(load_size(problem.q / root, problem.mu, reacts)))
        each = np.repeat(root[:, 0], d)
        return cls(problem, W / each / each[:, None], problem.q / (unit * root), problem.mu,
                   reacts, unit / root, unit * root)  # fmt: skip

    @property
    def shape(self) -> tuple[int, int]:
        """(nc, d)."""
        return self.c.shape  # type: ignore[return-value]

    @property
    def width(self) -> int:
        """Starts that fit into one stack of matrices."""
        return max(1, int(WIDE / max(self.W.size, 1)))

    @property
    def solve_work(self) -> float:
        """Operations of a linear system."""
        n = float(self.W.shape[0])
        return SYSTEM + n**3

    def velocity(self, r: Array) -> Array:
        """u of a stack of reactions, (k, nc, d)."""
        return (r.reshape(len(r), -1) @ self.W.T).reshape(r.shape) + self.c

    # ---------------------------------------------------------------- linear systems
    def _solve(self, A: Array, B: Array, right: Array) -> Array:
        """Solutions of (A + B W) x = right, (k, nc, d); zero where the matrix is singular."""
        k, nc, d = right.shape
        matrix = B @ self.W.reshape(nc, d, nc * d)
        matrix = matrix.reshape(k, nc, d, nc, d)
        own = np.arange(nc)
        matrix[:, own, :, own, :] += A.transpose(1, 0, 2, 3)
        matrix = matrix.reshape(k, nc * d, nc * d)
        b = right.reshape(k, nc * d, 1)
        try:
            x = np.linalg.solve(matrix, b)
        except np.linalg.LinAlgError:
            x = np.stack([_least_squares(*pair) for pair in zip(matrix, b, strict=True)])
        return np.where(np.isfinite(x), x, 0.0).reshape(right.shape)

    def on_piece(self, states: NDArray[np.int64], direction: Array) -> Array:
        """r of status patterns, (k, nc), slipping with u_T along `direction`, (k, nc, d - 1).

        The point where the linear conditions of the pattern hold, signs and cones disregarded.
        """
        nc, d = self.shape
        A, B = np.zeros((2, len(states), nc, d, d))
        states = np.where(self.able, states, FREE)
        free, stick, slip = (states == which for which in (FREE, STICK, SLIP))
        A[free], B[stick] = np.eye(d), np.eye(d)
        B[slip, 0, 0] = 1.0
        A[slip, 1:, 1:] = np.eye(d - 1)
        A[slip, 1:, 0] = (self.mu[:, None] * direction)[slip]
        return self._solve(A, B, -np.einsum("knij,nj->kni", B, self.c))

    def linearise(self, r: Array, rho: Array) -> tuple[Array, Array, Array]:
        """(F, A, B) of a stack of reactions, rho (k, nc)."""
        k, nc, d = r.shape
        law = Coulomb(np.tile(self.mu, k))
        u = self.velocity(r)
        parts = AlartCurnier().linearise(
            r.reshape(-1, d), u.reshape(-1, d), law, np.ascontiguousarray(rho).ravel()
        )
        F, A, B = (part.reshape(k, nc, *part.shape[1:]) for part in parts)
        F[:, ~self.able], A[:, ~self.able], B[:, ~self.able] = r[:, ~self.able], np.eye(d), 0
        return F, A, B

    def polished(self, r: Array) -> tuple[Array, float]:
        """Reactions (nc, d) near a solution after two more steps, and the size of the last."""
        size, rho = np.inf, np.ones((1, self.shape[0]))
        for _ in range(3):
            F, A, B = self.linearise(r[None], rho)
            dr = self._solve(A, B, -F)[0]
            last, size = size, float(np.abs(dr).max(initial=0.0))
            if size > last:
                return r, last
            r = r + dr
        return r, size

    def jacobian(self, r: Array) -> Array:
        """A + B W, (nc d, nc d), at one (nc, d) of reactions."""
        nc, d = self.shape
        _, A, B = self.linearise(r[None], np.ones((1, nc)))
        matrix = (B[0] @ self.W.reshape(nc, d, nc * d)).reshape(nc, d, nc, d)
        own = np.arange(nc)
        matrix[own, :, own, :] += A[0]
        return matrix.reshape(nc * d, nc * d)

    # ---------------------------------------------------------------- Newton
    def newton(
        self, starts: Array, random: np.random.Generator, known: Array | None = None,
        deadline: Deadline = NEVER,
    ) -> Array:  # fmt: skip
        """Solutions reached from starts, (k, nc, d) -> (j, nc, d) with repetitions.

        known, (s, nc, d): solutions to be deflated.  deadline: those reached until then.
        """
        reached = []
        for first in range(0, len(starts), self.width):
            if deadline.passed:
                break
            some = starts[first : first + self.width]
            reached.append(self._newton(some, random, known, deadline))
        return np.concatenate(reached) if reached else np.zeros((0, *self.shape))

    def _newton(
        self, r: Array, random: np.random.Generator, known: Array | None, deadline: Deadline
    ) -> Array:
        nc, d = self.shape
        rho = np.repeat(10.0 ** random.uniform(-1, 1, (len(r), 1)), nc, axis=1)
        reached = []
        for step in range(STEPS):
            F, A, B = self.linearise(r, rho)
            size = np.abs(r).max(axis=(1, 2), initial=0.0)
            value = np.abs(F / rho[:, :, None]).max(axis=(1, 2), initial=0.0)
            done = value <= CONVERGED * (1 + size)
            reached.append(r[done])
            going = ~done & (size < LONGEST)
            if not going.any() or deadline.passed:
                break
            r, rho = r[going], rho[going]
            deadline.spend(len(r) * self.solve_work)
            dr = self._solve(A[going], B[going], -F[going])
            if known is not None and len(known):
                dr = dr * deflation(r, dr, known)[:, None, None]
            r = r + dr * _lengths(random, step, len(r))[:, None, None]
        return np.concatenate(reached)


def _lengths(random: np.random.Generator, step: int, count: int) -> Array:
    """Step lengths: full at first, then now and then shorter, at random."""
    full = random.random(count) < (1.0 if step < 8 else 0.6)
    return np.where(full, 1.0, random.uniform(0.1, 1.0, count))


def deflation(r: Array, dr: Array, known: Array) -> Array:
    """Factor of the Newton steps dr, (k,), that deflates known solutions; at most 10."""
    apart = r[:, None] - known
    square = np.maximum((apart**2).sum(axis=(2, 3)), 1e-30)
    along = -2 * np.einsum("ksij,kij->ks", apart, dr) / (square * (1 + square))
    rest = 1 - along.sum(axis=1)
    rest = np.where(np.isfinite(rest), rest, 0.0)
    return 1 / np.where(np.abs(rest) < 0.1, np.copysign(0.1, rest), rest)


def _least_squares(matrix: Array, b: Array) -> Array:
    return np.linalg.lstsq(matrix, b, rcond=1e-12)[0]
