"""The law of every contact linearised at the status that it has: A dr + B du + N dp = 0.

Reactions and velocities of a solution keep to one piece of the law, and where every contact is
strictly inside of its piece all solutions near by are on the same one (the implicit function
theorem, [BHKO] section 3).  With t = u_T / |u_T|, g the bound of friction and dp the
change of its numbers, mu or a bound tau, the pieces are

    open          dr = 0
    stick         du = 0, the gap too, which is part of u
    slip          du_N = 0,  dr_T + t (mu dr_N + r_N dmu) + (g / |u_T|) (1 - t t^T) du_T = 0
    slip, given   the same with t dtau in the place of t (mu dr_N + r_N dmu)

where a bound is given under Tresca's law and at a cap (`Law.given`); under Tresca's law an open
contact sticks or slips as well.  Ties stick.  A law that is another one in other variables
(`problem.law.changed`) obeys these in s = T^-1 (r + c n) and u' = T (u + C r + o n).

[BHKO] P. Beremlijski, J. Haslinger, M. Kočvara, J. Outrata, "Shape optimization in contact
problems with Coulomb friction", SIAM J. Optim. 13 (2002) 561-587.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, UnsupportedForm, UnsupportedLaw
from ...problem.friction import FrictionProblem
from ...problem.law.law import MU, TRESCA
from ...problem.law.states import ContactStatus
from ...problem.solution import FrictionSolution

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
WEAK = 1e-7  # margin, relative to what a contact moves and carries, that counts as none


@dataclass(frozen=True, eq=False)
class Linearised:
    """The pieces of a solution: A, B (nc, d, d) and the slopes of the law in its numbers.

    by_mu, by_bound (nc, d): columns of N.  weak (k,): contacts at the border of their piece;
    slope (nc, d - 1): t of contacts that slide, else zero; curvature (nc,): g / |u_T|.
    """

    solution: FrictionSolution
    A: Array
    B: Array
    by_mu: Array
    by_bound: Array
    weak: Index
    slope: Array
    curvature: Array

    @property
    def problem(self) -> FrictionProblem:
        """The problem that is solved."""
        return self.solution.problem  # type: ignore[return-value]  # as `of` has checked

    @classmethod
    def of(cls, solution: FrictionSolution) -> Linearised:
        """The pieces of a solution that has converged.

        Raises InvalidInput for one that has not, UnsupportedForm where r and M or W do not
        make the problem, UnsupportedLaw where coefficients follow the state.
        """
        problem: Any = solution.problem
        if not isinstance(problem, FrictionProblem):
            raise UnsupportedForm(
                f"gradient: {type(problem).__name__} has no reactions of a linear problem to "
                "differentiate; expected a FrictionProblem, of small strains and contact of "
                "method 'nodal' or 'mortar'"
            )
        law = problem.law if solution.follows is None else solution.follows
        if law.varies:
            raise UnsupportedLaw(
                f"gradient: {law.name} has coefficients that follow the state, and "
                "their slopes are not known; expected Coulomb's, Tresca's, capped or tied "
                "contacts, also with cohesion, orthotropic or compliant"
            )
        if not solution.converged:
            raise InvalidInput(
                f"solution: it has not converged ({solution.convergence.errors}); there is "
                "nothing to differentiate"
            )
        return _linearised(solution, problem)


def _linearised(solution: FrictionSolution, problem: FrictionProblem) -> Linearised:
    law, plain = problem.law, problem.law.plain
    s, u = law.pressed(solution.r), law.stretched(solution.u, solution.r)
    nc, d = s.shape
    closed = (solution.status != ContactStatus.OPEN) | law.tied
    slides = solution.sliding & (closed | (law.kind == TRESCA)) & ~law.tied
    holds = (closed | (law.kind == TRESCA)) & ~slides
    given, bound, rho = plain.given(s), plain.bound(s), problem.plain.rho
    toward = _direction(s, u, rho)
    size = np.linalg.norm(u[:, 1:], axis=1)
    A, B = np.zeros((2, nc, d, d))
    A[~closed, 0, 0], B[closed, 0, 0] = 1.0, 1.0
    tangents = np.arange(1, d)
    A[np.ix_(~holds, tangents, tangents)] = np.eye(d - 1)
    B[np.ix_(holds, tangents, tangents)] = np.eye(d - 1)
    rubs = slides & ~given
    A[rubs, 1:, 0] = plain.parameters[rubs, MU][:, None] * toward[rubs]
    moves = slides & (size > 0)
    curvature = np.where(moves, bound / np.where(moves, size, 1.0), 0.0)
    across = np.eye(d - 1) - toward[:, :, None] * toward[:, None, :]
    B[:, 1:, 1:] += (curvature * slides)[:, None, None] * across
    by_mu, by_bound = np.zeros((2, nc, d))
    by_mu[rubs, 1:] = s[rubs, :1] * toward[rubs]
    by_bound[slides & given, 1:] = toward[slides & given]
    A, B = _in_given_variables(problem, A, B)
    return Linearised(solution, A, B, by_mu, by_bound, _weak(solution, problem, closed),
                      toward * slides[:, None], curvature * slides)  # fmt: skip


def _direction(s: Array, u: Array, rho: Array) -> Array:
    """t (nc, d - 1), against s_T - rho u_T: near a border the better known of both counts."""
    z = rho[:, None] * u[:, 1:] - s[:, 1:]
    size = np.linalg.norm(z, axis=1)
    return z / np.where(size > 0, size, 1.0)[:, None]


def _in_given_variables(
    problem: FrictionProblem, A: Array, B: Array
) -> tuple[Array, Array]:
    """A dr + B du of A ds + B du', s and u' those of the plain law."""
    law, d = problem.law, problem.dimension
    if law.plain is law:
        return A, B
    if law.stretch is not None:
        T = np.tile(np.eye(d), (len(law), 1, 1))
        T[:, 1:, 1:] = law.stretch
        A, B = A @ np.linalg.inv(T), B @ T
    if law.give is not None:
        A = A + B * law.give[:, None, :d]
    return A, B


def _weak(solution: FrictionSolution, problem: FrictionProblem, closed: Mask) -> Index:
    """Contacts nearer to a border than a solution can tell."""
    margin = solution.margin.copy()
    without = (problem.law.plain.parameters[:, MU] == 0) & ~problem.law.tied
    without &= (problem.law.kind != TRESCA) & closed
    margin[without] = (solution.r[:, 0] + problem.law.cohesion)[without]  # no slip to lose
    apart = ~closed & (problem.law.kind == TRESCA)  # shear may be held or slide there, too
    if apart.any():
        shear, slip = (np.linalg.norm(x[:, 1:], axis=1) for x in (solution.r, solution.u))
        held = problem.law.bound(solution.r) - shear
        slack = np.where(solution.sliding, problem.rho * slip, held)
        margin[apart] = np.minimum(margin, slack)[apart]
    scale = np.linalg.norm(solution.r, axis=1)
    scale += problem.rho * np.linalg.norm(solution.u, axis=1)
    whole = np.sqrt(np.mean(scale**2)) if len(scale) else 0.0
    return np.flatnonzero(margin <= WEAK * np.maximum(scale, whole))


__all__ = ["Linearised"]
