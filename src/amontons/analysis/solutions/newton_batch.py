"""Semismooth Newton from many starts at once, by stacked dense systems.

The Alart-Curnier function of `solvers.functions` on a problem in scaled variables,
u = W r + q with |W_ii| and |q| near 1: (A + B W) dr = -F for a whole stack of reactions, one
call of LAPACK for all.  There is no line search: steps are full, or shortened at random once
they did not converge at once, which leaves cycles.  A step near a known solution can be
deflated, [FBF] eq. (2.11): with m the product of 1 + 1 / |r - r_k|^2 over the known ones, the
Newton step of m F is dr / (1 - dm dr / m).

[FBF] P. Farrell, A. Birkisson, S. Funke, "Deflation techniques for finding distinct solutions
of nonlinear partial differential equations", SIAM J. Sci. Comput. 37 (2015).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...problem.law import Coulomb
from ...solvers.newton.functions import AlartCurnier
from ..scaled import Scaled
from ..statuses import FREE, SLIP, STICK, States

Array = NDArray[np.float64]
STEPS = 40  # Newton steps from a start
CONVERGED = 1e-12  # |F| relative to 1 + |r|, scaled
SYSTEM = 2e5  # operations that a linear system counts for, however small
STACK = 1.5e6  # the same of a stack of systems that are solved at once
LONGEST = 1e8  # scaled reactions that count as run away
WIDE = 4e6  # entries of a stack of matrices


def width(scaled: Scaled) -> int:
    """Starts that fit into one stack of matrices."""
    return max(1, int(WIDE / max(scaled.W.size, 1)))


def solve_work(scaled: Scaled, count: int) -> float:
    """Operations of a stack of so many linear systems."""
    n = float(scaled.W.shape[0])
    return STACK + count * (SYSTEM + n**3)


def _solve(scaled: Scaled, A: Array, B: Array, right: Array) -> Array:
    """Solutions of (A + B W) x = right, (k, nc, d); zero where the matrix is singular."""
    k, nc, d = right.shape
    matrix = B @ scaled.W.reshape(nc, d, nc * d)
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


def on_piece(scaled: Scaled, states: States, direction: Array) -> Array:
    """r of status patterns, (k, nc), slipping with u_T along `direction`, (k, nc, d - 1).

    The point where the linear conditions of the pattern hold, signs and cones disregarded.
    """
    nc, d = scaled.shape
    A, B = np.zeros((2, len(states), nc, d, d))
    states = np.where(scaled.reacts, states, FREE)
    free, stick, slip = (states == which for which in (FREE, STICK, SLIP))
    A[free], B[stick] = np.eye(d), np.eye(d)
    B[slip, 0, 0] = 1.0
    A[slip, 1:, 1:] = np.eye(d - 1)
    A[slip, 1:, 0] = (scaled.mu[:, None] * direction)[slip]
    return _solve(scaled, A, B, -np.einsum("knij,nj->kni", B, scaled.q))


def linearise(scaled: Scaled, r: Array, rho: Array) -> tuple[Array, Array, Array]:
    """(F, A, B) of a stack of reactions, rho (k, nc)."""
    k, nc, d = r.shape
    law = Coulomb(np.tile(scaled.mu, k))
    u = scaled.velocity(r)
    parts = AlartCurnier().linearise(
        r.reshape(-1, d), u.reshape(-1, d), law, np.ascontiguousarray(rho).ravel()
    )
    F, A, B = (part.reshape(k, nc, *part.shape[1:]) for part in parts)
    idle = ~scaled.reacts
    F[:, idle], A[:, idle], B[:, idle] = r[:, idle], np.eye(d), 0
    return F, A, B


def polished(scaled: Scaled, r: Array) -> tuple[Array, float]:
    """Reactions (nc, d) near a solution after two more steps, and the size of the last."""
    size, rho = np.inf, np.ones((1, scaled.shape[0]))
    for _ in range(3):
        F, A, B = linearise(scaled, r[None], rho)
        dr = _reduced(scaled, F[0], A[0], B[0])
        last, size = size, float(np.abs(dr).max(initial=0.0))
        if size > last:
            return r, last
        r = r + dr
    return r, size


def _reduced(scaled: Scaled, F: Array, A: Array, B: Array) -> Array:
    """dr of (A + B W) dr = -F; contacts with B = 0 change by -A^-1 F and leave first."""
    nc, d = scaled.shape
    alone = ~B.any(axis=(1, 2))
    dr = np.zeros((nc, d))
    dr[alone] = np.linalg.solve(A[alone], -F[alone, :, None])[..., 0]
    rest = np.flatnonzero(~alone)
    if not len(rest):
        return dr
    rows = (d * rest[:, None] + np.arange(d)).ravel()
    W = scaled.W[rows].reshape(len(rest), d, nc * d)
    right = -F[rest] - (B[rest] @ (W @ dr.ravel())[..., None])[..., 0]
    matrix = (B[rest] @ W[:, :, rows]).reshape(len(rest), d, len(rest), d)
    own = np.arange(len(rest))
    matrix[own, :, own] += A[rest]
    matrix = matrix.reshape(len(rows), len(rows))
    try:
        x = np.linalg.solve(matrix, right.ravel())
    except np.linalg.LinAlgError:
        x = _least_squares(matrix, right.reshape(-1, 1))[:, 0]
    dr[rest] = np.where(np.isfinite(x), x, 0.0).reshape(-1, d)
    return dr


def jacobian(scaled: Scaled, r: Array) -> Array:
    """A + B W, (nc d, nc d), at one (nc, d) of reactions."""
    nc, d = scaled.shape
    _, A, B = linearise(scaled, r[None], np.ones((1, nc)))
    matrix = (B[0] @ scaled.W.reshape(nc, d, nc * d)).reshape(nc, d, nc, d)
    own = np.arange(nc)
    matrix[own, :, own, :] += A[0]
    return matrix.reshape(nc * d, nc * d)


def newton(
    scaled: Scaled, starts: Array, random: np.random.Generator, known: Array | None = None,
    deadline: Deadline = NEVER,
) -> Array:  # fmt: skip
    """Solutions reached from starts, (k, nc, d) -> (j, nc, d) with repetitions.

    known, (s, nc, d): solutions to be deflated.  deadline: those reached until then.
    """
    reached = []
    for first in range(0, len(starts), width(scaled)):
        if deadline.passed:
            break
        some = starts[first : first + width(scaled)]
        reached.append(_newton(scaled, some, random, known, deadline))
    return np.concatenate(reached) if reached else np.zeros((0, *scaled.shape))


def _newton(
    scaled: Scaled, r: Array, random: np.random.Generator, known: Array | None,
    deadline: Deadline,
) -> Array:  # fmt: skip
    nc, d = scaled.shape
    rho = np.repeat(10.0 ** random.uniform(-1, 1, (len(r), 1)), nc, axis=1)
    reached = []
    for step in range(STEPS):
        F, A, B = linearise(scaled, r, rho)
        size = np.abs(r).max(axis=(1, 2), initial=0.0)
        value = np.abs(F / rho[:, :, None]).max(axis=(1, 2), initial=0.0)
        done = value <= CONVERGED * (1 + size)
        reached.append(r[done])
        going = ~done & (size < LONGEST)
        if not going.any() or deadline.passed:
            break
        r, rho = r[going], rho[going]
        deadline.spend(solve_work(scaled, len(r)))
        dr = _solve(scaled, A[going], B[going], -F[going])
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
    return np.linalg.lstsq(matrix, b, rcond=1e-12)[0]  # type: ignore[return-value]  # of float64
