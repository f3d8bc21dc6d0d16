"""The linear pieces of a 2D Coulomb problem, and the friction at which one becomes singular.

A pattern of statuses makes the law linear, whatever the load:

    free   r = 0                     stick  u = 0
    slip   u_N = 0, r_T = m r_N with m = +mu or -mu

so that r = R x, E (W R x + q) = 0 with E the rows u_N of closed and u_T of sticking contacts.
With mu_p = t shape_p the matrix of a pattern is E W R = A + t C, and its determinant is
multi-affine in the m_p: what holds for m_p = +-mu_p holds for all |m_p| <= mu_p.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput
from ...problem.friction import FrictionProblem
from ..multipliers.rounding import EPSILON, determinant_sign
from ..scaled import Scaled
from ..statuses import FREE, MINUS, PLUS, STICK, TANGENT, States, word

Array = NDArray[np.float64]
REAL = 1e-7  # imaginary part of an eigenvalue that counts as real, relative


@dataclass(frozen=True, eq=False)
class Pieces:
    """W (d k, d k) and the shape (k,) of friction of the contacts that react.

    scale (d k,): powers of two, reactions are r scale and velocities u / scale here, so that
    the diagonal blocks have size one and W is still exact.  places (k,): the contacts in the
    problem, which has `total`.  In 3D there are no linear pieces; the rest is as in 2D.
    """

    W: Array
    shape: Array
    scale: Array
    places: NDArray[np.int64]
    total: int

    @classmethod
    def of(cls, problem: FrictionProblem | Scaled, deadline: Deadline = NEVER) -> Pieces:
        """The contacts of a Coulomb problem that react; the global form is condensed."""
        scaled = Scaled.of(problem, deadline)
        d, places = scaled.dimension, np.flatnonzero(scaled.reacts)
        rows = (d * places[:, None] + np.arange(d)).ravel()
        root = np.sqrt(scaled.to_u / scaled.to_r)[places, 0].repeat(d)
        shape = friction_shape(scaled.mu)[places]
        return cls(scaled.W[np.ix_(rows, rows)], shape, root, places, scaled.contacts)

    @cached_property
    def contacts(self) -> int:
        """Number of contacts that react."""
        return len(self.shape)

    @cached_property
    def coupling(self) -> Array:
        """Size of the blocks of W between contacts, (k, k)."""
        k = self.contacts
        blocks = self.W.reshape(k, 2, k, 2)
        return np.sqrt((blocks**2).sum(axis=(1, 3)))

    @cached_property
    def couples(self) -> bool:
        """False where no tangential force moves a contact along its normal: any mu is safe."""
        return bool((self.W[0::2, 1::2] != 0).any())

    def allowed(self, *, tangent: bool = False) -> NDArray[np.bool_]:
        """States that a contact may have, (k, 5); without friction it can not stick."""
        states = np.ones((self.contacts, 5), dtype=bool)
        states[:, TANGENT] = tangent
        states[np.ix_(self.shape == 0, [STICK, MINUS])] = False
        return states

    # ---------------------------------------------------------------- one pattern
    def rows(self, states: States) -> NDArray[np.int64]:
        """Closed directions of a pattern: the rows of E W."""
        closed = np.zeros((self.contacts, 2), dtype=bool)
        closed[:, 0] = (states != FREE) & (states != TANGENT)
        closed[:, 1] = (states == STICK) | (states == TANGENT)
        return np.flatnonzero(closed.ravel())

    def slipping(self, states: States) -> tuple[NDArray[np.int64], Array]:
        """Slipping contacts, and their m for t = 1."""
        slip = np.flatnonzero((states == PLUS) | (states == MINUS))
        return slip, np.where(states[slip] == PLUS, 1.0, -1.0) * self.shape[slip]

    def matrix(self, states: States, t: float) -> Array:
        """E W R of a pattern at friction t shape."""
        rows = self.rows(states)
        slip, m = self.slipping(states)
        E = self.W[np.ix_(rows, rows)]
        E[:, np.searchsorted(rows, 2 * slip)] += self.W[np.ix_(rows, 2 * slip + 1)] * (t * m)
        return E

    def sign(self, states: States, t: float) -> int:
        """Sign of the determinant of a pattern, 0 where rounding could change it."""
        rows = self.rows(states)
        slip, m = self.slipping(states)
        rounding = np.zeros((len(rows), len(rows)))
        rounding[:, np.searchsorted(rows, 2 * slip)] = (
            4
            * EPSILON
            * (
                np.abs(self.W[np.ix_(rows, 2 * slip)])
                + np.abs(self.W[np.ix_(rows, 2 * slip + 1)] * (t * m))
            )
        )
        return determinant_sign(self.matrix(states, t), rounding)

    def threshold(self, states: States) -> tuple[float, Array] | None:
        """(smallest t > 0 at which a pattern is singular, its null vector r), or None.

        det (A + t C) = 0 reads -A^-1 C x = x / t on the slipping contacts.  None too where A is
        singular: then friction is not what makes the pattern so.
        """
        rows = self.rows(states)
        slip, m = self.slipping(states)
        if not len(slip):
            return None
        try:
            columns = np.linalg.solve(
                self.W[np.ix_(rows, rows)], -self.W[np.ix_(rows, 2 * slip + 1)] * m
            )
        except np.linalg.LinAlgError:
            return None
        where = np.searchsorted(rows, 2 * slip)
        values, vectors = np.linalg.eig(columns[where])
        real = np.abs(values.imag) <= REAL * np.abs(values)
        real &= values.real > 0
        if not real.any():
            return None
        best = np.flatnonzero(real)[np.argmax(values.real[real])]
        t = 1 / float(values[best].real)
        x = t * columns @ vectors[:, best].real
        r = np.zeros(2 * self.contacts)
        r[rows] = x
        r[2 * slip + 1] = t * m * x[where]
        return t, r / np.abs(r).max()

    # ---------------------------------------------------------------- in words
    def word(self, states: States) -> str:
        """The pattern of all contacts of the problem; those that can not react are free."""
        whole = np.full(self.total, FREE)
        whole[self.places] = states
        return word(whole)

    def reaction(self, r: Array) -> Array:
        """r (nc, d) in the units of the problem, the largest entry being 1."""
        d = len(self.W) // len(self.shape)
        whole = np.zeros((self.total, d))
        whole[self.places] = (r.ravel() / self.scale).reshape(-1, d)
        return whole / max(np.abs(whole).max(initial=0.0), np.finfo(float).tiny)


def friction_shape(mu: Array) -> Array:
    """mu divided by its largest entry, (nc,); one everywhere where there is no friction."""
    if not np.isfinite(mu).all():
        raise InvalidInput(f"mu: expected finite numbers, got {mu}")
    largest = mu.max(initial=0.0)
    return mu / largest if largest > 0 else np.ones_like(mu)
