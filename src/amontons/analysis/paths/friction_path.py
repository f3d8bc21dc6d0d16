"""A friction problem with a parameter, as a path problem: load or friction changes with p.

Unknowns are the scaled reactions y = r sqrt|W_ii| / unit, with powers of two for these
factors, so that y, u and p have a size near one in any units; with W and q scaled likewise,
u = W y + q0 + p q1 and z = y - u,

    normal:      y_N - max(z_N, 0) = 0
    tangential:  y_T - P(z_T) = 0,   P the projection onto |x| <= mu max(z_N, 0)

with mu = c0 + p c1 ([LR] problem (P) with our signs; Tresca's law has a given bound c0 + p c1
instead of mu max(z_N, 0)).
In 2D every piece is linear in y; under a load parameter it is linear in (y, p).

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline, now
from ...core.errors import InvalidInput, UnsupportedLaw
from ...linear.dense import dense
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Coulomb, Tresca
from ...problem.settling import settled
from ...problem.solution import FrictionSolution
from ..scaled import power_of_two, scaled_blocks
from ..tolerances import SLACK
from .index_sets import IndexSets, index_sets
from .path import judged

if TYPE_CHECKING:
    from .contact_rates import ContactRates

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class FrictionPath:
    """The problems `start` at p = 0 and `end` at p = 1, and all between and beyond.

    Both have the same M and H, or W; the loads f, w or q are interpolated, and the coefficients
    of the law.  A piece is named by the pattern of its statuses: f free, s stick, in 2D slip +
    (r_T = mu r_N) or -, in 3D l.  Under Tresca's law an open contact has a tangential status of
    its own: o open and sticking, p and m open and sliding, q in 3D.
    """

    start: FrictionProblem
    end: FrictionProblem
    name: str = "load"
    deadline: Deadline = NEVER  # of those who follow it, see `timed`

    def __post_init__(self) -> None:
        a, b = self.start, self.end
        if a.form is not b.form or (a.contacts, a.dimension) != (b.contacts, b.dimension):
            raise InvalidInput(
                f"end: expected form and size of start ({a.form.value}, {a.contacts} contacts "
                f"in {a.dimension}D), got {b.form.value}, {b.contacts} in {b.dimension}D"
            )
        if type(a.law) is not type(b.law):
            raise InvalidInput("end: expected the friction law of start, got the other one")
        if not isinstance(a.law, Coulomb | Tresca):
            raise UnsupportedLaw(
                f"path: expected Coulomb or Tresca friction, got {a.law.name}"
            )
        pairs = ((a.M, b.M), (a.H, b.H)) if a.form is Form.GLOBAL else ((a.W, b.W),)
        if not all(_equal(x, y) for x, y in pairs):
            raise InvalidInput("end: expected the same matrices as start; loads may differ")

    # ---------------------------------------------------------------- the family of problems
    @classmethod
    def friction(cls, problem: FrictionProblem) -> FrictionPath:
        """mu(p) = p shape, shape being the coefficients of the problem over the largest."""
        if not isinstance(problem.law, Coulomb):
            raise UnsupportedLaw(f"friction: expected Coulomb's, this is {problem.law.name}")
        largest = float(problem.mu.max(initial=0.0))
        shape = problem.mu / largest if largest > 0 else np.ones(problem.contacts)
        return cls(problem.with_mu(0.0), problem.with_mu(shape), "friction")

    @cached_property
    def straight(self) -> bool:
        """True when every piece is linear in (y, p): 2D, and only the load changes."""
        moves = bool(np.any(self.c1 != 0)) and not self.tresca
        return self.start.dimension == 2 and not moves

    def at(self, p: float) -> FrictionProblem:
        """The discrete problem at a value of the parameter."""
        a, b = self.start, self.end
        law = type(a.law)((1 - p) * a.law.coefficient + p * b.law.coefficient)
        changes: dict[str, Any] = {"law": law}
        for key in ("f", "w", "q"):
            x, y = getattr(a, key), getattr(b, key)
            if x is not None:
                changes[key] = x + p * (y - x)
                changes[key].flags.writeable = False
        return replace(a, **changes, guess=None)

    def solution(self, y: Array, p: float) -> FrictionSolution:
        """The point as a solution: reactions, velocities, status and the judge's error."""
        problem, began = self.at(p), now()
        r = (y * self.to_r).reshape(problem.contacts, problem.dimension)
        (u, v), told = settled(problem.law, problem.rho, r, problem.velocity)
        error = problem.error(told.r, v)
        record = judged(error, problem.measure, now() - began)
        return FrictionSolution(problem, told.r, np.array(u), v, record, settled=told)

    def reaction_rates(self, direction: Array) -> Array:
        """r', (nc, d), of a direction y' (m,)."""
        return (direction * self.to_r).reshape(self.start.contacts, -1)

    def state(self, r: Array) -> Array:
        """The unknowns y (m,) of reactions r, (nc, d)."""
        return np.asarray(r, dtype=float).ravel() / self.to_r

    # ---------------------------------------------------------------- scaled data
    @cached_property
    def _scaled(self) -> tuple[Array, Array, Array, Array]:
        a = self.start.condensed(self.deadline)
        W, root, _ = scaled_blocks(dense(a.W, 4), a.contacts)
        root = root.repeat(a.dimension)
        q0, q1 = (np.asarray(x.condensed().q).ravel() / root for x in (self.start, self.end))
        return W, q0, q1 - q0, root

    @cached_property
    def unit(self) -> float:
        """Size of scaled q over the first unit of the parameter, a power of two: y = 1."""
        _, q0, q1, _ = self._scaled
        size = float(max(np.linalg.norm(q0), np.linalg.norm(q1)))
        return float(power_of_two(size)) if size > 0 else 1.0

    @cached_property
    def W(self) -> Array:
        """Scaled W, (m, m): the block of every contact has a norm near 1."""
        return self._scaled[0]

    @cached_property
    def q0(self) -> Array:
        """Scaled q at p = 0, (m,)."""
        return self._scaled[1] / self.unit

    @cached_property
    def q1(self) -> Array:
        """Change of scaled q per unit of p, (m,)."""
        return self._scaled[2] / self.unit

    @cached_property
    def to_r(self) -> Array:
        """r = y to_r, (m,)."""
        return self.unit / self._scaled[3]

    @cached_property
    def to_u(self) -> Array:
        """Local velocities = scaled ones times to_u, (m,)."""
        return self.unit * self._scaled[3]

    @cached_property
    def tresca(self) -> bool:
        """True under Tresca's law."""
        return isinstance(self.start.law, Tresca)

    @cached_property
    def c0(self) -> Array:
        """mu, or the scaled bound, at p = 0, (nc,)."""
        return self._coefficient(self.start)

    @cached_property
    def c1(self) -> Array:
        """Change of c0 per unit of p, (nc,)."""
        return self._coefficient(self.end) - self.c0

    def _coefficient(self, problem: FrictionProblem) -> Array:
        d = problem.dimension
        scale = self.to_r[::d] if self.tresca else 1.0
        return np.array(problem.law.coefficient / scale)

    @cached_property
    def frictionless(self) -> Mask:
        """Contacts without friction at any p, (nc,): closed ones slip, by name to "+"."""
        return (self.c0 == 0) & (self.c1 == 0)

    def coefficient(self, p: float) -> Array:
        """mu, or the scaled bound, at p, (nc,); predictions may look beyond zero."""
        return self.c0 + p * self.c1

    def free(self, p: float) -> Array:
        """Scaled q at p, (m,)."""
        return self.q0 + p * self.q1

    def _rows(self, x: Array) -> tuple[Array, Array]:
        rows = x.reshape(self.start.contacts, -1)
        return rows[:, 0], rows[:, 1:]

    def _trial(self, y: Array, p: float) -> tuple[Array, Array, Array]:
        """(u, z_N, z_T): scaled velocities, and y - u in parts."""
        u = self.W @ y + self.free(p)
        return u, *self._rows(y - u)

    def _radius(self, z_N: Array, p: float) -> Array:
        """Bound of |y_T| as the active piece has it."""
        bound = np.maximum(self.coefficient(p), 0.0)
        return bound if self.tresca else bound * np.maximum(z_N, 0)

    # ---------------------------------------------------------------- path problem
    def residual(self, y: Array, p: float) -> Array:
        """The residual, (m,), scaled."""
        return self.residual_of(self.piece(y, p), y, p)

    def jacobian(self, y: Array, p: float) -> tuple[Array, Array]:
        """Derivatives by y (m, m) and p (m,) of the active piece."""
        return self.jacobian_of(self.piece(y, p), y, p)

    def piece(self, y: Array, p: float) -> str:
        """The pattern of the active piece, one letter per contact."""
        _, z_N, z_T = self._trial(y, p)
        radius = self._radius(z_N, p)
        closed, size = z_N > 0, np.linalg.norm(z_T, axis=1)
        sliding = size > radius
        letters = np.where(closed, "s", "o" if self.tresca else "f")
        if self.start.dimension == 2:
            up = z_T[:, 0] >= 0
            letters = np.where(closed & sliding, np.where(up, "+", "-"), letters)
            letters = np.where(closed & self.frictionless, "+", letters)
            if self.tresca:
                letters = np.where(~closed & sliding, np.where(up, "p", "m"), letters)
                letters = np.where(~closed & self.frictionless, "p", letters)
        else:
            letters = np.where(closed & (sliding | self.frictionless), "l", letters)
            if self.tresca:
                letters = np.where(~closed & (sliding | self.frictionless), "q", letters)
        return "".join(letters)

    def residual_of(self, piece: str, y: Array, p: float) -> Array:
        """The selection function of a piece, (m,), also outside of it."""
        u, z_N, z_T = self._trial(y, p)
        word, (y_N, y_T), (u_N, u_T) = Word(piece), self._rows(y), self._rows(u)
        radius = self.coefficient(p) if self.tresca else self.coefficient(p) * z_N
        bounded = np.where(word.sliding[:, None], radius[:, None] * word.direction(z_T), 0.0)
        normal = np.where(word.closed, u_N, y_N)
        tangential = np.where(word.sticking[:, None], u_T, y_T - bounded)
        return np.column_stack([normal, tangential]).ravel()

    def jacobian_of(self, piece: str, y: Array, p: float) -> tuple[Array, Array]:
        """Derivatives by y and p of the selection function of a piece."""
        self.deadline.check()
        nc, d = self.start.contacts, self.start.dimension
        _, z_N, z_T = self._trial(y, p)
        word, mu, m = Word(piece), self.coefficient(p), len(y)
        J, Jp = np.eye(m), np.zeros(m)
        normal = np.arange(nc) * d
        closed, stuck = normal[word.closed], np.flatnonzero(word.sticking)
        sticking = (normal[stuck][:, None] + np.arange(1, d)).ravel()
        for rows in (closed, sticking):
            J[rows], Jp[rows] = self.W[rows], self.q1[rows]
        toward = word.direction(z_T)
        size = np.maximum(np.linalg.norm(z_T, axis=1), 1e-300)
        for i in np.flatnonzero(word.sliding):
            N, T = normal[i], normal[i] + np.arange(1, d)
            s, radius, growth = toward[i], mu[i], self.c1[i]
            if not self.tresca:
                slope = -mu[i] * self.W[N]
                slope[N] += mu[i]
                J[T] -= np.outer(s, slope)
                radius, growth = mu[i] * z_N[i], self.c1[i] * z_N[i] - mu[i] * self.q1[N]
            Jp[T] -= growth * s
            if d == 3:
                across = radius / size[i] * (np.eye(2) - np.outer(s, s))
                turning = -self.W[T]
                turning[np.arange(2), T] += 1.0
                J[T] -= across @ turning
                Jp[T] += across @ self.q1[T]
        return J, Jp

    def margins(self, piece: str, y: Array, p: float) -> Array:
        """What is positive inside a piece, (3 nc,): infinite where nothing limits it."""
        _, z_N, z_T = self._trial(y, p)
        word, mu = Word(piece), self.coefficient(p)
        radius = mu if self.tresca else mu * z_N
        size = np.linalg.norm(z_T, axis=1)
        out = np.full((len(mu), 3), np.inf)
        out[:, 0] = np.where(word.closed, z_N, -z_N)
        lawful = ~self.frictionless & (word.closed | self.tresca)
        out[:, 1] = np.where(lawful & word.sliding, size - radius, out[:, 1])
        stick = lawful & word.sticking
        if self.start.dimension == 2:
            along = (word.direction(z_T) * z_T)[:, 0]
            out[:, 1] = np.where(lawful & word.sliding, along - radius, out[:, 1])
            out[:, 1] = np.where(stick, radius - z_T[:, 0], out[:, 1])
            out[:, 2] = np.where(stick, radius + z_T[:, 0], out[:, 2])
        else:
            out[:, 1] = np.where(stick, radius - size, out[:, 1])
        return out.ravel()

    def choices(self, y: Array, p: float, tolerance: float) -> list[str]:
        """The letters that each contact may have near a point: the index sets of [LR] (25).

        "f+" grazing with slip, "s+" strong contact with impending slip, "fs+-" grazing with
        impending slip (Coulomb's law).
        """
        _, z_N, z_T = self._trial(y, p)
        mu = self.coefficient(p)
        flat = self.start.dimension == 2
        out = []
        for k, (n, t, c) in enumerate(zip(z_N.tolist(), z_T, mu.tolist(), strict=True)):
            size = float(np.linalg.norm(t))
            slip = ("+" if t[0] >= 0 else "-") if flat else "l"
            radius = c if self.tresca else c * max(n, 0.0)
            normal = "f" * (n <= tolerance) + "c" * (n >= -tolerance)
            both = "s" * (size <= radius + tolerance) + slip * (size >= radius - tolerance)
            if flat and "s" in both and 2 * radius <= tolerance + tolerance * c:
                both = "s+-"  # the bounds on both sides are near
            if self.frictionless[k]:
                both = "+" if flat else "l"
            closed = both if "c" in normal else ""
            if not self.tresca:
                out.append("f" * ("f" in normal) + closed)
                continue
            apart = "".join({"s": "o", "+": "p", "-": "m", "l": "q"}[x] for x in both)
            out.append(apart * ("f" in normal) + closed)
        return out

    def index_sets(self, y: Array, p: float, tolerance: float = SLACK) -> IndexSets:
        """The sets of [LR] (25)."""
        _, z_N, z_T = self._trial(y, p)
        size, bound = np.linalg.norm(z_T, axis=1), self._radius(z_N, p)
        return index_sets(z_N, size, bound, self.frictionless, tolerance)

    def contact_rates(self, y: Array, p: float) -> ContactRates:
        """The first-order system as a complementarity problem, [LR] (35)."""
        from .contact_rates import contact_rates

        return contact_rates(self, y, p)

    def pieces(self, y: Array, p: float, tolerance: float) -> list[str]:
        """The patterns of all pieces that meet near a point."""
        return ["".join(word) for word in product(*self.choices(y, p, tolerance))]

    def describe(self, y: Array, p: float) -> dict[str, Any]:
        """Columns of the table: numbers of open, slipping, sticking contacts, |r|, pattern."""
        piece = self.piece(y, p)
        word = Word(piece)
        slip = word.closed & word.sliding
        counts = {
            "open": int((~word.closed).sum()),
            "slip": int(slip.sum()),
            "stick": int((word.closed & ~slip).sum()),
        }
        norm = float(np.linalg.norm(y * self.to_r))
        return {"contacts": counts, "norm": norm, "pattern": piece}


class Word:
    """The letters of a pattern as masks over the contacts, (nc,) each."""

    def __init__(self, piece: Sequence[str]) -> None:
        letters = np.array(list(piece))
        self.closed: Mask = np.isin(letters, ["s", "+", "-", "l"])
        self.sticking: Mask = np.isin(letters, ["s", "o"])
        self.sliding: Mask = np.isin(letters, ["+", "-", "l", "p", "m", "q"])
        self.sign: Array = np.isin(letters, ["+", "p"]) * 1.0 - np.isin(letters, ["-", "m"])

    def direction(self, z_T: Array) -> Array:
        """Unit vectors (nc, d - 1) along r_T of sliding contacts, zero for others."""
        if z_T.shape[1] == 1:
            return self.sign[:, None]
        size = np.linalg.norm(z_T, axis=1)
        unit = z_T / np.where(size > 0, size, 1.0)[:, None]
        return np.where(self.sliding[:, None], unit, 0.0)


def _equal(x: Any, y: Any) -> bool:
    """True for the same matrix, or one with the same entries."""
    if x is y:
        return True
    if isinstance(x, np.ndarray) or isinstance(y, np.ndarray) or not hasattr(x, "nnz"):
        return isinstance(y, np.ndarray) and bool(np.array_equal(x, y))
    return x.shape == y.shape and abs(x - y).max() == 0
