"""Singular pieces of a 3D Coulomb problem: frictions that are not safe for every load.

A piece is linear: every contact is free (r = 0), sticks (u = 0), or slips along a direction t,

    u_N = 0,   r_T = -mu r_N t + rho p,  u_T = v t + w p,  p across t,  rho = -kappa w,

kappa from 0 (rho = 0) to infinity (w = 0: held across).  With the held components eliminated,
G = W_ss - W_sh W_hh^-1 W_hs, what is left on the slipping contacts reads

    (G_NN - mu G_Nt S) x = 0,   mu = t shape, S = diag(shape),

so that t is one over a real eigenvalue of G_NN^-1 G_Nt S.  The determinant of all equations
changes sign there: just above, a piece has the other orientation than without friction, an
open set of loads has it for a solution, and by degree these loads have others too.  kappa
finite and large is as good as infinite, so that the piece belongs to solutions.

Searched are changes of status or direction that make the determinant change its sign just
below the smallest t so far: the ratio of determinants is that of a 3 x 3 matrix for every
contact and every change.  The search begins with few contacts and what others take from them.
It finds upper bounds, not the least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from .status_pieces import REAL, Pieces
from .thinning import COARSEST, couplings, spread_out

Array = NDArray[np.float64]
States = NDArray[np.int64]
FREE, STICK, SLIP, HELD = 0, 1, 2, 3
LETTERS = "fslh"
DIRECTIONS = 16  # of slip that are tried
BELOW = (0.1, 0.03, 0.01, 0.003, 5e-4)  # parts of t by which it is below in a comparison
FALL = 1e-5  # relative, by which t must fall
STARTS = 24  # first patterns of few contacts
ROUNDS = 60  # of changes from one pattern
WORK = (3e7, 4.0)  # operations of a round, and per cube of the rows


@dataclass(frozen=True, eq=False)
class DiscPiece:
    """A singular piece: states (k,), directions (k, 2) of slip, t, null vector r (3 k,)."""

    t: float
    states: States
    directions: Array
    null: Array

    @property
    def pattern(self) -> str:
        """A letter of every contact: f free, s stick, l slip, h slip that is held across."""
        return "".join(LETTERS[int(state)] for state in self.states)


def singular_piece(pieces: Pieces, deadline: Deadline) -> DiscPiece | None:
    """The singular piece with the least t that a search finds, None for none in time."""
    form = _Form(pieces.W, pieces.shape)
    found = _searched(form, deadline)
    if found is None:
        return None
    states, directions = found
    pair = form.threshold(states, directions)
    return None if pair is None else DiscPiece(pair[0], states, directions, pair[1])


def _searched(form: _Form, deadline: Deadline) -> tuple[States, Array] | None:
    k = form.contacts
    if k <= COARSEST:
        starts = _first_patterns(k)
    else:
        near = couplings(form.W, k)
        chosen = spread_out(near, k // 4)
        rows = (3 * chosen[:, None] + np.arange(3)).ravel()
        coarse = _Form(form.W[np.ix_(rows, rows)], form.shape[chosen])
        found = _searched(coarse, deadline)
        if found is None:
            return None
        owner = np.argmax(near[:, chosen], axis=1)
        owner[chosen] = np.arange(len(chosen))
        starts = [(found[0][owner], found[1][owner])]
    best: tuple[States, Array] | None = None
    least = np.inf
    for begin, turned in starts:
        t, states, directions = form.descended(begin, turned, deadline)
        if t < least:
            best, least = (states, directions), t
        if deadline.passed:
            break
    return best


def _first_patterns(k: int) -> list[tuple[States, Array]]:
    """Patterns to begin with: slip in one direction, some contacts free, stuck or turned."""
    rng = np.random.default_rng(0)
    out = []
    for number in range(STARTS):
        angle = 2 * np.pi * number / STARTS
        turned = np.full(k, angle)
        states = np.full(k, SLIP)
        if number % 3 == 1:
            states = rng.choice([SLIP, SLIP, HELD, FREE], k)
        elif number % 3 == 2:
            states = rng.choice([SLIP, HELD, STICK, FREE], k)
            turned = rng.uniform(0, 2 * np.pi, k)
        out.append((states, np.stack([np.cos(turned), np.sin(turned)], axis=1)))
    return out


def equations(W: Array, shape: Array, states: States, directions: Array, t: float) -> Array:
    """J (3 k, 3 k) with J r = 0 in a pattern at friction t shape; its sign is the orientation.

    W (3 k, 3 k), shape (k,).
    """
    k = len(shape)
    blocks, rows = np.zeros((k, 3, 3 * k)), W.reshape(k, 3, 3 * k)
    free, stuck = np.flatnonzero(states == FREE), states == STICK
    slip, loose, held = (np.flatnonzero(x) for x in
                         (states >= SLIP, states == SLIP, states == HELD))  # fmt: skip
    for j in range(3):
        blocks[free, j, 3 * free + j] = 1.0
    blocks[stuck] = rows[stuck]
    blocks[slip, 0] = rows[slip, 0]
    blocks[slip, 1, 3 * slip] = t * shape[slip]
    blocks[slip, 1, 3 * slip + 1], blocks[slip, 1, 3 * slip + 2] = directions[slip].T
    blocks[loose, 2, 3 * loose + 1] = -directions[loose, 1]
    blocks[loose, 2, 3 * loose + 2] = directions[loose, 0]
    a, b = directions[held].T
    blocks[held, 2] = -b[:, None] * rows[held, 1] + a[:, None] * rows[held, 2]
    return blocks.reshape(3 * k, 3 * k)


def bases(
    shape: Array, states: States, directions: Array, t: float
) -> tuple[sparse.csc_array, sparse.csc_array, sparse.csc_array, States]:
    """(V, R, O, rest): what the `equations` of a pattern are made of, by contacts.

    V (3 k, n): the velocities that vanish, in the equations `rest` (n,); R (3 k, n): reactions
    that all other equations allow; O (3 k, 3 k): the reactions that these give outright.  The
    determinant of the equations is that of V^T W R.
    """
    size = 3 * len(shape)
    slip, loose, held, stuck = (np.flatnonzero(x) for x in (
        states >= SLIP, states == SLIP, states == HELD, states == STICK))  # fmt: skip
    free, rests = ((3 * x[:, None] + np.arange(3)).ravel()
                   for x in (np.flatnonzero(states == FREE), stuck))  # fmt: skip
    V = _columns(size, [(3 * slip, 3 * slip, np.ones(len(slip))),
                        (rests, rests, np.ones(len(rests))),
                        *_across(held, directions)])  # fmt: skip
    moved = (-t * shape[slip])[:, None] * directions[slip]
    along = [(3 * slip + 1 + j, 3 * slip, moved[:, j]) for j in range(2)]
    given = [(3 * slip + 1 + j, 3 * slip + 1, directions[slip, j]) for j in range(2)]
    O = _columns(size, [(free, free, np.ones(len(free))), *given,
                        *_across(loose, directions)])  # fmt: skip
    R = V + _columns(size, along)
    rest = np.flatnonzero(np.diff(V.indptr))
    return V[:, rest], R[:, rest], O, rest


def _columns(size: int, parts: list[tuple[States, States, Array]]) -> sparse.csc_array:
    """A square matrix from (rows, columns, numbers)."""
    rows, columns, numbers = (np.concatenate(x) for x in zip(*parts, strict=True))
    return sparse.csc_array((numbers, (rows, columns)), shape=(size, size))


def _across(contacts: States, directions: Array) -> list[tuple[States, States, Array]]:
    """The directions across slip, as entries in the third column of their contacts."""
    a, b = directions[contacts].T
    first, second, third = (3 * contacts + j for j in (1, 2, 2))
    return [(first, third, -b), (second, third, a)]


@dataclass(frozen=True, eq=False)
class _Form:
    """W (3 k, 3 k) of contacts that react, and the shape (k,) of friction."""

    W: Array
    shape: Array

    @property
    def contacts(self) -> int:
        return len(self.shape)

    def allowed(self, states: States) -> States:
        """Without friction nothing sticks or is held."""
        return np.where((self.shape == 0) & (states != FREE), SLIP, states)

    # ---------------------------------------------------------------- one pattern
    def threshold(self, states: States, directions: Array) -> tuple[float, Array] | None:
        """(least t > 0 at which a pattern is singular, its null vector r), or None."""
        slip = np.flatnonzero(states >= SLIP)
        if not len(slip):
            return None
        held = self._held(states, directions)
        column, count = np.arange(len(slip)), (len(self.W), len(slip))
        numbers = (directions[slip] * self.shape[slip, None]).T.ravel()
        places = np.tile(column, 2), np.concatenate([3 * slip + 1, 3 * slip + 2])
        along = sparse.csc_array((numbers, places[::-1]), shape=count)
        normal = self.W[:, 3 * slip]
        tangent = (along.T @ self.W.T).T
        try:
            if held.shape[1]:
                rows = held.T @ self.W
                hh = (held.T @ rows.T).T
                right = np.hstack([rows[:, 3 * slip], (along.T @ rows.T).T])
                back = np.linalg.solve(hh, right)
                onto = (held.T @ self.W[3 * slip].T).T
                m = len(slip)
                G = normal[3 * slip] - onto @ back[:, :m]
                C = tangent[3 * slip] - onto @ back[:, m:]
            else:
                back, G, C = np.zeros((0, 2 * len(slip))), normal[3 * slip], tangent[3 * slip]
            values, vectors = np.linalg.eig(np.linalg.solve(G, C))
        except np.linalg.LinAlgError:
            return None
        real = np.abs(values.imag) <= REAL * np.abs(values)
        real &= values.real > 0
        if not real.any():
            return None
        best = np.flatnonzero(real)[np.argmax(values.real[real])]
        t, x = 1 / float(values[best].real), vectors[:, best].real
        r = -t * (along @ x)
        r[3 * slip] += x
        m = len(slip)
        r -= held @ (back[:, :m] @ x - t * (back[:, m:] @ x))
        return t, r / np.abs(r).max()

    def _held(self, states: States, directions: Array) -> sparse.csc_array:
        """Directions (3 k, h) that do not move: all of stick, those across where it is held."""
        stuck, across = np.flatnonzero(states == STICK), np.flatnonzero(states == HELD)
        first = 3 * len(stuck)
        column = first + np.arange(len(across))
        rows = [(3 * stuck[:, None] + np.arange(3)).ravel(), 3 * across + 1, 3 * across + 2]
        numbers = [np.ones(first), -directions[across, 1], directions[across, 0]]
        places = np.concatenate(rows), np.concatenate([np.arange(first), column, column])
        shape = (len(self.W), first + len(across))
        return sparse.csc_array((np.concatenate(numbers), places), shape=shape)

    # ---------------------------------------------------------------- changes
    def responses(self, states: States, directions: Array, t: float) -> tuple[Array, Array]:
        """(r, u) of every contact, (k, 3, 3), to a unit on the right of its own `equations`.

        r = R y + O (`bases`) with V^T W (R y + O) given.
        """
        k, W = self.contacts, self.W
        V, R, O, rest = bases(self.shape, states, directions, t)
        WO, WR = (O.T @ W.T).T, (R.T @ W.T).T
        right = -(V.T @ WO)
        right[np.arange(len(rest)), rest] += 1.0
        y = np.linalg.solve(V.T @ WR, right) if len(rest) else right
        own = np.arange(k)
        r = ((R @ y) + O.toarray()).reshape(k, 3, k, 3)[own, :, own]
        mine = np.ascontiguousarray(y.reshape(len(rest), k, 3).transpose(1, 0, 2))
        return r, WR.reshape(k, 3, -1) @ mine + WO.reshape(k, 3, k, 3)[own, :, own]

    def changes(
        self, states: States, directions: Array, t: float
    ) -> tuple[Array, States, Array]:
        """(ratio of determinants of the best change of every contact, its state, direction)."""
        own = np.arange(self.contacts)
        E, F = self.responses(states, directions, t)
        angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        tried, state, direction = [np.linalg.det(E)], [FREE], [(1.0, 0.0)]
        stick = np.linalg.det(F)
        tried.append(np.where(self.shape > 0, stick, np.inf))
        state.append(STICK)
        direction.append((1.0, 0.0))
        for a, b in zip(np.cos(angle), np.sin(angle), strict=True):
            along = (t * self.shape)[:, None] * E[:, 0] + a * E[:, 1] + b * E[:, 2]
            for kind, base in ((SLIP, E), (HELD, F)):
                across = -b * base[:, 1] + a * base[:, 2]
                ratio = np.linalg.det(np.stack([F[:, 0], along, across], axis=1))
                tried.append(np.where((self.shape > 0) | (kind == SLIP), ratio, np.inf))
                state.append(kind)
                direction.append((float(a), float(b)))
        every = np.stack(tried)
        best = np.argmin(every, axis=0)
        return every[best, own], np.array(state)[best], np.array(direction)[best]

    def descended(
        self, states: States, directions: Array, deadline: Deadline
    ) -> tuple[float, States, Array]:
        """The pattern after changes that make t fall, one after another."""
        states, work = self.allowed(states), WORK[0] + WORK[1] * float(len(self.W)) ** 3
        first = self.threshold(states, directions)
        t = np.inf if first is None else first[0]
        if not np.isfinite(t):
            return t, states, directions
        for _ in range(ROUNDS):
            if not deadline.affords(work):
                break
            deadline.spend(work)
            better = self._round(states, directions, t)
            if better is None:
                break
            t, states, directions = better
        return t, states, directions

    def _round(
        self, states: States, directions: Array, t: float
    ) -> tuple[float, States, Array] | None:
        """A pattern with a smaller t, None where no change that was tried has one."""
        for below in BELOW:
            try:
                ratio, state, direction = self.changes(states, directions, t * (1 - below))
            except np.linalg.LinAlgError:
                continue
            wrong = np.flatnonzero(ratio < 0)
            wrong = wrong[np.argsort(ratio[wrong])]
            for count in sorted({len(wrong), len(wrong) // 4, 1} - {0}, reverse=True):
                if not len(wrong):
                    break
                new, turned = states.copy(), directions.copy()
                some = wrong[:count]
                new[some], turned[some] = state[some], direction[some]
                found = self.threshold(new, turned)
                if found is not None and found[0] < t * (1 - FALL):
                    return found[0], new, turned
        return None
