"""The equations of one pattern with slip directions as unknowns, their derivatives and ranges.

Unknowns x of a pattern are the reactions y that it leaves, the angles a of slip, and t:

    stick y = r (3),   slip y = r_N, r = y (1, -mu e(a)),   without friction y = r_N,

u = W r + q(t), q and mu linear in t; equations F = 0, as many as unknowns without t:

    stick u = 0,   slip u_N = 0 and n u_T = 0, n = e turned by 90 degrees,   else u_N = 0.

Contacts are turned so that e = (1, 0) at the centre of a box.  Ranges bound by how much r, u,
F and their derivatives differ from those at the centre over a box of angles, t and y.  For
given angles and t the equations are linear in y, so that its range follows from the others.

All is done for a stack of boxes at a time, the first axis of every array.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...statuses import FREE, SLIP, STICK, States

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
EPSILON = float(np.finfo(float).eps)
WIDENED = 1.05  # a bound that is tried, in what the last step gave
TURNS = 12  # steps towards such a bound
REGULAR = 1e13  # largest entry of an inverse
UP = 1 + 1e-12  # rounding of sums of bounds


def inverses(A: Array) -> tuple[Array, Mask]:
    """(the inverses of a stack, zero where there is none, and where there is one)."""
    fine: Any = np.isfinite(A).all(axis=(1, 2))
    try:
        X = np.linalg.inv(np.where(fine[:, None, None], A, np.eye(A.shape[1])))
    except np.linalg.LinAlgError:
        X = np.zeros_like(A)
        for k in np.flatnonzero(fine):
            try:
                X[k] = np.linalg.inv(A[k])
            except np.linalg.LinAlgError:
                fine[k] = False
    fine &= (np.abs(X) < REGULAR).all(axis=(1, 2))
    return np.where(fine[:, None, None], X, 0.0), fine


def fixed_point(D: Array, b: Array) -> tuple[Array, Mask]:
    """(e, where b + D e < e, so that |x| <= e for every |x| <= b + D |x|)."""
    e, out, fine = b, np.zeros_like(b), np.zeros(len(b), dtype=bool)
    for step in range(TURNS):
        trial = (b + (D @ e[:, :, None])[:, :, 0]) * UP
        less = (trial < e).all(axis=1) & (step > 0)
        new = less & ~fine
        out[new], fine = e[new], fine | less
        if fine.all():
            break
        most = trial.max(axis=1, initial=0.0)[:, None]
        e = np.minimum(WIDENED * trial + 1e-16 * most + 1e-300, 1e30)
    return out, fine | (b.shape[1] == 0)


def bend(half: Array) -> tuple[Array, Array]:
    """(most of 1 - cos x, of |sin x|) for |x| <= half."""
    return 2 * np.sin(np.minimum(half, np.pi) / 2) ** 2, np.sin(np.minimum(half, np.pi / 2))


def _mixed(x: Array) -> Array:
    """Sizes of x (B, m, k); tangents of a contact have those of both, which turning mixes."""
    sizes = np.abs(x).reshape(len(x), x.shape[1] // 3, 3, x.shape[2])
    sizes[:, :, 1:] = sizes[:, :, 1:].sum(axis=2, keepdims=True)
    return sizes.reshape(x.shape)


@dataclass(frozen=True, eq=False)
class Local:
    """At the centres of boxes: V, p (B, m, 2) turned, x (B, n + 1), r, u (B, m), F (B, n).

    Cr, Cu (B, m, n + 1): derivatives of r and u; J (B, n, n + 1): those of F.  rounding (B, m),
    rounding_of_Cu (B, m, n + 1): bounds of what u and Cu are off by, turning included.
    """

    V: Array
    p: Array
    x: Array
    r: Array
    u: Array
    F: Array
    Cr: Array
    Cu: Array
    J: Array

    @cached_property
    def rounding(self) -> Array:
        """See the class."""
        terms = np.abs(self.V) @ _mixed(self.r[:, :, None])
        terms[:, :, 0] += np.abs(self.p[:, :, 0]) + np.abs(self.x[:, -1:] * self.p[:, :, 1])
        return self._relative * _mixed(terms)[:, :, 0]

    @cached_property
    def rounding_of_Cu(self) -> Array:
        """See the class: terms cancel, so that the size of Cu says little."""
        terms = np.abs(self.V) @ _mixed(self.Cr)
        terms[:, :, -1] += np.abs(self.p[:, :, 1])
        return self._relative * _mixed(terms)

    @property
    def _relative(self) -> float:
        return 4 * EPSILON * (self.u.shape[1] + 16)


@dataclass(frozen=True, eq=False)
class Spread:
    """By how much numbers differ from `Local` over boxes: du (B, m), dC, dU (B, m, n + 1).

    across (B, n, n + 1): what turning e adds in F; along (B, ns, n + 1): in e u_T.
    """

    du: Array
    dC: Array
    dU: Array
    across: Array
    along: Array


class Pattern:
    """A pattern of decided statuses, with W (m, m), q (2, m), mu (2, nc): at t = 0, change."""

    def __init__(self, states: States, W: Array, q: Array, mu: Array) -> None:
        self.states, self.W, self.q = states, W, q
        stick, slip = states == STICK, states == SLIP
        held = np.stack([states != FREE, stick, stick], axis=1).ravel()
        self.of_y = np.flatnonzero(held)  # components of r that are y, and of u that vanish
        self.slip, self.stick = np.flatnonzero(slip), np.flatnonzero(stick)
        self.free = np.flatnonzero(states == FREE)
        place = np.cumsum(held) - 1  # of a component of r in y
        self.normal, self.first = place[3 * self.slip], place[3 * self.stick]
        self.pressed = place[3 * np.flatnonzero((states != FREE) & ~stick)]
        self.A, self.B = 3 * self.slip + 1, 3 * self.slip + 2
        self.ny, ns = len(self.of_y), len(self.slip)
        self.n = self.ny + ns
        self.turn = self.ny + np.arange(ns)
        self.rows = np.concatenate([self.of_y, self.B])
        self.mu = mu[:, self.slip]
        self.stick_mu = mu[:, self.stick]

    def local(self, x: Array) -> Local:
        """Equations and derivatives at the centres of boxes."""
        B, m, ny = len(x), len(self.W), self.ny
        c, s = np.cos(x[:, self.turn]), np.sin(x[:, self.turn])
        Q = np.zeros((B, m, m))
        Q[:] = np.eye(m)
        Q[:, self.A, self.A], Q[:, self.A, self.B] = c, s
        Q[:, self.B, self.A], Q[:, self.B, self.B] = -s, c
        V, p = Q @ self.W @ Q.transpose(0, 2, 1), Q @ self.q.T
        y, t = x[:, self.normal], x[:, -1:]
        friction = self.mu[0] + t * self.mu[1]
        Cr, r = np.zeros((B, m, self.n + 1)), np.zeros((B, m))
        Cr[:, self.of_y, np.arange(ny)] = 1.0
        Cr[:, self.A, self.normal], Cr[:, self.B, self.turn] = -friction, -friction * y
        Cr[:, self.A, -1] = -self.mu[1] * y
        r[:, self.of_y], r[:, self.A] = x[:, :ny], -friction * y
        u = (V @ r[:, :, None])[:, :, 0] + p[:, :, 0] + t * p[:, :, 1]
        Cu = V @ Cr
        Cu[:, :, -1] += p[:, :, 1]
        J = Cu[:, self.rows]
        J[:, self.turn, self.turn] -= u[:, self.A]
        return Local(V, p, x, r, u, u[:, self.rows], Cr, Cu, J)

    def reactions(self, x: Array) -> Array:
        """r (B, m) in the tangents of the problem."""
        r, y = np.zeros((len(x), len(self.W))), x[:, self.normal]
        r[:, self.of_y] = x[:, : self.ny]
        push = (self.mu[0] + x[:, -1:] * self.mu[1]) * y
        r[:, self.A] = -push * np.cos(x[:, self.turn])
        r[:, self.B] = -push * np.sin(x[:, self.turn])
        return r

    def _y_from(self, at: Local, few: bool) -> tuple[Array, Mask]:
        """X (B, ny, n) with y = -X F(0): of the linear equations alone, or least squares."""
        B, ny = len(at.x), self.ny
        X = np.zeros((B, ny, self.n))
        if few:
            X[:, :, :ny], fine = inverses(at.J[:, :ny, :ny])
            return X, fine
        J = at.J[:, :, :ny]
        inverse, fine = inverses(J.transpose(0, 2, 1) @ J)
        return inverse @ J.transpose(0, 2, 1), fine

    def with_y(self, x: Array, *, few: bool) -> tuple[Array, Mask]:
        """(x with the y that its angles and t give, where they do)."""
        x, ny = x.copy(), self.ny
        x[:, :ny] = 0.0
        at = self.local(x)
        X, fine = self._y_from(at, few)
        x[:, :ny] = -(X @ at.F[:, :, None])[:, :, 0]
        return x, fine

    # ------------------------------------------------------------------ ranges
    def range_of_y(self, at: Local, half: Array, *, few: bool) -> tuple[Array, Mask]:
        """(bound of |y - y_c| for all that solves the equations in a box, where there is one).

        half (B, n + 1): of boxes; that of y is not used.  few: by the linear equations alone,
        which tells most, but for where they are singular for some angles.
        """
        ny = self.ny
        X, fine = self._y_from(at, few)
        fixed = half.copy()
        fixed[:, :ny] = 0.0
        by = self.spread(at, fixed)  # F is linear in y: about y_c all that matters
        change = self.change(X, at, by)
        off = X @ at.J
        D = change[:, :, :ny] + np.abs(off[:, :, :ny] - np.eye(ny))
        b = (D @ np.abs(at.x[:, :ny, None]))[:, :, 0] if few else np.zeros((len(X), ny))
        if few:  # the turning of contacts is all in D, and the load is linear in t
            b += np.abs((X @ at.p[:, self.rows, 1:])[:, :, 0]) * half[:, -1:]
        else:
            b += ((np.abs(off) + change) @ fixed[:, :, None])[:, :, 0]
        b += np.abs((X @ at.F[:, :, None])[:, :, 0])
        b += (np.abs(X) @ at.rounding[:, self.rows, None])[:, :, 0]
        e, small = fixed_point(D, b)
        return e, fine & small

    def best_range_of_y(self, at: Local, half: Array) -> tuple[Array, Mask]:
        """`range_of_y` by the linear equations, and by all where these are singular."""
        dy, fine = self.range_of_y(at, half, few=True)
        if not fine.all():
            other, also = self.range_of_y(at, half, few=False)
            dy, fine = np.where(fine[:, None], dy, other), fine | also
        return dy, fine

    def change(self, X: Array, at: Local, by: Spread) -> Array:
        """Bounds (B, k, n + 1) of |X J - X J_c| over boxes, X (B, k, n), rounding included."""
        size = np.abs(at.J) + by.dU[:, self.rows]
        more = by.across + at.rounding_of_Cu[:, self.rows] + 4 * EPSILON * (self.n + 4) * size
        more[:, self.turn, self.turn] += at.rounding[:, self.A]
        return np.abs(X @ at.V[:, self.rows]) @ by.dC + np.abs(X) @ more

    def _spread_of_reactions(self, at: Local, half: Array) -> tuple[Array, Array]:
        """(bounds of |r - r_c|, of the change of its derivatives) over boxes."""
        B, m = at.r.shape
        dr, dC = np.zeros((B, m)), np.zeros((B, m, self.n + 1))
        dr[:, self.of_y] = half[:, : self.ny]
        c, s = bend(half[:, self.turn])
        slope = np.abs(self.mu[1])
        dm = slope * half[:, -1:]
        M = np.abs(self.mu[0] + at.x[:, -1:] * self.mu[1]) + dm
        y, dy = np.abs(at.x[:, self.normal]), half[:, self.normal]
        Y, product = y + dy, M * dy + dm * y  # of mu y
        dr[:, self.A], dr[:, self.B] = M * Y * c + product, M * Y * s
        dC[:, self.A, self.normal], dC[:, self.B, self.normal] = dm + M * c, M * s
        dC[:, self.A, self.turn], dC[:, self.B, self.turn] = M * Y * s, M * Y * c + product
        dC[:, self.A, -1], dC[:, self.B, -1] = slope * (Y * c + dy), slope * Y * s
        return dr, dC

    def spread(self, at: Local, half: Array) -> Spread:
        """All ranges over boxes, half (B, n + 1) with y."""
        dr, dC = self._spread_of_reactions(at, half)
        size = np.abs(at.V)
        du = (size @ dr[:, :, None])[:, :, 0] + np.abs(at.p[:, :, 1]) * half[:, -1:]
        dU = size @ dC
        c, s = (x[:, :, None] for x in bend(half[:, self.turn]))
        first, second = (np.abs(at.Cu[:, k]) + dU[:, k] for k in (self.A, self.B))
        across = np.zeros((len(du), self.n, self.n + 1))
        across[:, self.turn] = c * second + s * first
        along = c * first + s * second
        first, second = (np.abs(at.u[:, k]) + du[:, k] for k in (self.A, self.B))
        c, s = c[:, :, 0], s[:, :, 0]
        across[:, self.turn, self.turn] += du[:, self.A] + c * first + s * second
        along[:, np.arange(len(self.slip)), self.turn] += du[:, self.B] + c * second + s * first
        return Spread(du, dC, dU, across, along)
