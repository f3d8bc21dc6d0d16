"""The first-order system of contact as a complementarity problem: [LR] (35) and (36).

At a solution of a path the rates along p' follow, contacts inside of their pieces eliminated,
from those at a border: with x the rates of slip of contacts in impending slip (against their
force) and of the forces of grazing ones, and y those of the slack of the former and of the
velocities of the latter,

    D x = y + p' b,   x, y >= 0, x y = 0   (slip, normal forces)                            (1)
                      x_T in -mu x_N Sgn(y_T)   (grazing contacts that do not move).

Rows come in the order of (35): contacts in strong contact and impending slip (ci), grazing
without friction (z0), grazing in slip (zl), normal and tangential rates of those at rest (zi).
By our signs x_N >= 0 and y_N >= 0 are the rates of r_N and u_N.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput, SingularOperator, UnsupportedForm
from .index_sets import IndexSets
from .rate_claims import Claim, all_pieces_regular, is_P_matrix, strictly_copositive
from .rate_search import RateSolutions, rate_solutions

if TYPE_CHECKING:
    from .friction_path import FrictionPath

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
SINGULAR = 1e-12  # reciprocal condition of what is eliminated that counts as zero
FACTORS = tuple(1e3 * 0.8**k for k in range(60, -1, -1))  # of friction, tried for a bound
HALVINGS = 40


@dataclass(frozen=True, eq=False)
class ContactRates:
    """(1): D (M, M), b (M,), and what existence and uniqueness results say of it.

    ci, z0, zl, zi: numbers of the contacts of each kind; mu (zi,): friction of the last.
    force, offset: rates of all scaled reactions, r' = force x + p' offset.  letters (nc,): of
    contacts that slip at their bound.  with_friction(factor): the same with other friction.
    """

    D: Array
    b: Array
    ci: Indices
    z0: Indices
    zl: Indices
    zi: Indices
    mu: Array
    sets: IndexSets
    force: Array
    offset: Array
    letters: NDArray[np.str_]
    with_friction: Callable[[float], ContactRates]

    @property
    def pairs(self) -> int:
        """How many of the first rows are scalar complementarity conditions."""
        return len(self.ci) + len(self.z0) + len(self.zl)

    @cached_property
    def existence(self) -> Claim:
        """[LR] proposition 7: D is strictly copositive, so every p' and load has a tangent."""
        return strictly_copositive(self.D, self.pairs, self.mu)

    @cached_property
    def uniqueness(self) -> Claim:
        """[LR] proposition 8: every p' and load has at most one tangent.

        Like `existence` sufficient only: REFUTED says that the condition does not hold.
        """
        return is_P_matrix(self.D, self.pairs, self.mu)

    @cached_property
    def full_rank(self) -> Claim:
        """[LR] proposition 9: gradients of all selection functions have full rank."""
        if self.uniqueness is Claim.PROVED:
            return Claim.PROVED  # their determinants are the minors of proposition 8
        return all_pieces_regular(self.D, self.b, self.pairs, self.mu)

    def solutions(
        self, sense: float, *, nodes: int = 200_000, deadline: Deadline = NEVER
    ) -> RateSolutions:
        """All x for p' = sense, by a tree search that cuts what linear bounds exclude."""
        return rate_solutions(self.D, sense * self.b, self.pairs, self.mu, nodes, deadline)

    def tangents(
        self, sense: float, deadline: Deadline = NEVER, *, nodes: int = 200_000
    ) -> tuple[list[tuple[Array, str]], RateSolutions]:
        """Rates r' (2 nc,) for p' = sense with the piece into which they lead; the search."""
        found = self.solutions(sense, nodes=nodes, deadline=deadline)
        out = [
            (self.force @ x + sense * self.offset, self.piece(word))
            for x, word in zip(found.solutions, found.patterns, strict=True)
        ]
        return out, found

    def piece(self, word: str) -> str:
        """The pattern of all contacts for one of the contacts at a border."""
        s, letters = self.sets, self.letters.copy()
        letters[s.free] = "f"
        letters[np.intersect1d(s.closed, s.stick)] = "s"
        letters[np.intersect1d(s.closed, s.frictionless)] = "+"
        order = np.concatenate([self.ci, self.z0, self.zl, self.zi])
        for k, (i, letter) in enumerate(zip(order, word, strict=True)):
            if letter == "o":
                letters[i] = "s" if k < len(self.ci) else "f"
            elif letter != "c":
                letters[i] = letter
        return "".join(letters)

    def friction_bound(self, claim: str) -> float:
        """The factor of friction up to which a claim is proved, with all sets as they are.

        claim: "existence", "uniqueness" or "full_rank"; [LR] corollaries 1 and 2 say that it
        is positive in small deformations.  inf where it is proved up to a thousand times the
        friction, 0 where it is not without any.  Factors are tried in steps of a quarter.
        """
        if claim not in ("existence", "uniqueness", "full_rank"):
            raise InvalidInput(
                f"claim: expected existence, uniqueness or full_rank, got {claim!r}"
            )
        low = 0.0
        for factor in (0.0, *FACTORS):
            if not self._proved(claim, factor):
                break
            low = factor
        else:
            return np.inf
        high = factor
        if high == 0:
            return 0.0
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if self._proved(claim, middle) else (low, middle)
        return float(low)

    def _proved(self, claim: str, factor: float) -> bool:
        try:
            return getattr(self.with_friction(factor), claim) is Claim.PROVED
        except SingularOperator:
            return False

    def __str__(self) -> str:
        return (
            f"{len(self.b)} rates of {self.pairs + len(self.zi)} contacts at a border; "
            f"existence {self.existence.name.lower()}, uniqueness "
            f"{self.uniqueness.name.lower()}, full rank {self.full_rank.name.lower()}"
        )


def contact_rates(
    path: FrictionPath, y: Array, p: float, *, tolerance: float = 1e-9
) -> ContactRates:
    """The problem (1) at a solution of a path, in its scaled unknowns.

    tolerance: distance to a border that counts as none.  Raises SingularOperator where the
    contacts inside of their pieces can not be eliminated ([LR] assumption 4), UnsupportedForm
    in 3D and under Tresca's law.
    """
    if path.start.dimension != 2 or path.tresca:
        raise UnsupportedForm("rates: expected a problem in 2D with Coulomb friction")
    sets = path.index_sets(y, p, tolerance)

    return _eliminated(path, y, p, sets, 1.0)


def _eliminated(
    path: FrictionPath, y: Array, p: float, sets: IndexSets, factor: float
) -> ContactRates:
    """(1) with all friction times a factor, the sets as they are."""
    closed, grazing = set(sets.closed.tolist()), set(sets.grazing.tolist())
    groups = [
        np.array([i for i in kind if i in where], dtype=np.int64)
        for kind, where in ((sets.impending, closed), (sets.frictionless, grazing),
                            (sets.slip, grazing), (sets.impending, grazing))
    ]  # fmt: skip
    system = _System(path, y, p, sets, factor, groups)
    A, a = system.eliminated()
    D, b = system.Y @ A, -(system.Y @ a + system.known)
    mu = factor * np.maximum(path.coefficient(p), 0.0)
    letters = np.where(system.sign > 0, "+", "-")
    letters[sets.frictionless] = "+"
    again = partial(_eliminated, path, y, p, sets)
    return ContactRates(D, b, *groups, mu[groups[3]], sets, A, a, letters, again)


class _System:
    """The equations of all contacts: L r' = R x + p' e, y = Y r' + p' known."""

    def __init__(
        self, path: FrictionPath, y: Array, p: float, sets: IndexSets, factor: float,
        groups: list[Indices],
    ) -> None:  # fmt: skip
        self.W, self.q1 = path.W, path.q1
        self.mu = factor * np.maximum(path.coefficient(p), 0.0)
        self.growth = factor * path.c1 * y[0::2]  # of the bounds, with mu
        z = (y - (path.W @ y + path.free(p))).reshape(-1, 2)
        self.sign = np.where(z[:, 1] >= 0, 1.0, -1.0)
        m, rows = len(y), sum(map(len, groups)) + len(groups[3])
        self.L, self.R, self.e = np.eye(m), np.zeros((m, rows)), np.zeros(m)
        self.Y, self.known = np.zeros((rows, m)), np.zeros(rows)
        for i in sets.closed:
            self._moves(2 * i)
        for i in np.intersect1d(sets.closed, sets.stick):
            self._moves(2 * i + 1)
        for i in np.intersect1d(sets.closed, sets.slip):
            self._at_bound(i)
        ci, z0, zl, zi = groups
        for k, i in enumerate(ci):
            self._impending(k, i)
        for k, i in enumerate(np.concatenate([z0, zl, zi]), len(ci)):
            self.R[2 * i, k] = 1.0
            self.Y[k], self.known[k] = self.W[2 * i], self.q1[2 * i]
        for i in zl:
            self._at_bound(i)
        for k, i in enumerate(zi, rows - len(zi)):
            T = 2 * i + 1
            self.R[T, k] = 1.0
            self.Y[k], self.known[k] = self.W[T], self.q1[T]

    def _moves(self, row: int) -> None:
        """The velocity of that row is zero."""
        self.L[row], self.e[row] = self.W[row], -self.q1[row]

    def _at_bound(self, i: int) -> None:
        """r_T' = s (mu r_N' + p' mu' r_N)."""
        self.L[2 * i + 1, 2 * i] = -self.sign[i] * self.mu[i]
        self.e[2 * i + 1] = self.sign[i] * self.growth[i]

    def _impending(self, k: int, i: int) -> None:
        """x = -s u_T', y = mu r_N' + p' mu' r_N - s r_T'."""
        s, N, T = self.sign[i], 2 * i, 2 * i + 1
        self.L[T], self.e[T], self.R[T, k] = -s * self.W[T], s * self.q1[T], 1.0
        self.Y[k, N], self.Y[k, T], self.known[k] = self.mu[i], -s, self.growth[i]

    def eliminated(self) -> tuple[Array, Array]:
        """(A, a) of r' = A x + p' a."""
        values = np.linalg.svd(self.L, compute_uv=False)
        if len(values) and values[-1] <= SINGULAR * values[0]:
            raise SingularOperator(
                "rates: the contacts inside of their pieces can not be eliminated"
            )
        found: Any = np.linalg.solve(self.L, np.column_stack([self.R, self.e]))
        return found[:, :-1], found[:, -1]
