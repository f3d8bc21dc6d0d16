"""Boxes of what contacts may do and of the time, in 3D, and those without a solution.

Letters: . any, c closed, f free, s stick, o closed without friction, l slip with
r_T = -mu r_N e, u_T = s e, s >= 0, e on the arc from a to b, which is within a quadrant.  q and
mu are linear in the time, from 0 to 1.  A y excludes a box where no reaction and no velocity
that it allows reaches y.(W r + q) = y.u.
"""

import numpy as np

from .lists import reach
from .numbers import TINY, U, need

WIDE = 1e-12  # by which ranges are wider, relative: rounding of sums of bounds
ARCS = [((1.0, 0.0), (0.0, 1.0)), ((0.0, 1.0), (-1.0, 0.0)),
        ((-1.0, 0.0), (0.0, -1.0)), ((0.0, -1.0), (1.0, 0.0))]  # fmt: skip


def divided(box, i, rubs):
    """Parts of a box by contact i, or by the time for i = nc."""
    letters, arcs, (first, last) = box
    if i == len(letters):
        middle = (first + last) / 2
        return [(letters, arcs, (first, middle)), (letters, arcs, (middle, last))]
    letter, (a, b) = letters[i], arcs[i]
    need(letter in ".cl", "a contact is decided twice")
    parts = [("f", ARCS[0]), ("c" if rubs[i] else "o", ARCS[0])]
    if letter == "c":
        parts = [("s", ARCS[0]), *[("l", arc) for arc in ARCS]]
    elif letter == "l":
        length = np.hypot(a[0] + b[0], a[1] + b[1])
        middle = (a[0] + b[0]) / length, (a[1] + b[1]) / length
        parts = [("l", (a, middle)), ("l", (middle, b))]
    return [(letters[:i] + x + letters[i + 1 :], (*arcs[:i], arc, *arcs[i + 1 :]),
             (first, last)) for x, arc in parts]  # fmt: skip


class Problem:
    """Scaled by powers of two: W, loads (2, m), mus (2, nc), and bounds of all solutions."""

    def __init__(self, W, q, mu, end=None, mu_end=None, **_):
        need(q.shape[1] == 3, "curves in 2D")
        loads = np.stack([x.ravel() for x in (q, q if end is None else end)])
        self.mus = np.stack([mu, mu if mu_end is None else mu_end])
        need(loads.shape == (2, len(W)) and self.mus.shape == (2, len(mu)), "shapes differ")
        need((self.mus >= 0).all() and loads.any() and W.any(), "no load, or friction below 0")
        self.unit = 2.0 ** np.round(np.log2(abs(loads).max()))
        stiff = 2.0 ** np.round(np.log2(abs(W).max()))
        self.to_r, self.W, self.loads = self.unit / stiff, W / stiff, loads / self.unit
        need((self.W.diagonal() > 1e-99).all(), "W is not definite, or too small")
        self.rubs, S = self.mus.any(axis=0), (self.W + self.W.T) / 2
        ends = [q for q in self.loads if q.any()]
        self.most = max(reach(S, q, np.arange(len(W)) % 3 == 0) for q in ends) * (1 + 1e-9)
        fast = [max(reach(S, q, s * row) for q in ends for s in (1, -1)) for row in self.W]
        fast = (np.array(fast) + abs(self.loads).max(axis=0)).reshape(-1, 3)
        self.fast = np.hypot(fast[:, 1], fast[:, 2]) * (1 + 1e-9)

    def part(self, spans):
        """Solutions are smaller by this, where one end has no load."""
        zero = ~self.loads.any(axis=1)
        return spans[:, 1] if zero[0] else 1 - spans[:, 0] if zero[1] else 1 + 0 * spans[:, 0]

    def excluded(self, boxes, y):
        """Which boxes (k) the y (k, nc, 3) exclude."""
        letters = np.array([list(box[0]) for box in boxes])
        arcs, spans = np.array([box[1] for box in boxes]), np.array([box[2] for box in boxes])
        m, mus, slips, opened = len(self.W), self.mus, letters == "l", np.isin(letters, [*"f."])
        fine = ((y[:, :, 0] <= 0) | ~opened) & (np.isin(letters, [*"sl"]) | ~y[:, :, 1:].any(2))
        fine &= abs(y).max(axis=2) < 1e30
        turned, size = np.einsum("kit,kiat->kia", y[:, :, 1:], arcs), abs(y[:, :, 1:]).sum(2)
        lost = 1.5 * slips * self.fast * (np.maximum(turned.max(2), 0) + 8 * U * size + TINY)
        flat = y.reshape(len(y), m)
        g, terms = (x.reshape(y.shape) for x in (flat @ self.W, abs(flat) @ abs(self.W)))
        along, round_ = np.einsum("kit,kiat->kia", g[:, :, 1:], arcs), 8 * U * (m + 20)
        a, b, v = arcs[:, :, 0], arcs[:, :, 1], g[:, :, 1:]
        cross = a[..., 0] * v[..., 1] - a[..., 1] * v[..., 0], v[..., 0] * b[..., 1] - (
            v[..., 1] * b[..., 0])  # fmt: skip
        disc = np.hypot(v[..., 0], v[..., 1])
        push = np.where(slips & (np.minimum(*cross) < 0), along.max(axis=2), disc)
        mu = [(1 - t)[:, None] * mus[0] + t[:, None] * mus[1] for t in spans.T]
        push = np.maximum(mu[0] * push, mu[1] * push) - g[:, :, 0]
        push += round_ * (terms[:, :, 0] + mus.sum(axis=0) * terms[:, :, 1:].sum(axis=2))
        push += TINY * (1 + mus.sum(axis=0))
        lack = np.maximum(np.where(letters == "f", 0.0, push), 0).max(axis=1)
        right = flat @ self.loads.T, round_ * (abs(flat) @ abs(self.loads).sum(axis=0))
        least = np.min([(1 - t) * right[0][:, 0] + t * right[0][:, 1] for t in spans.T], axis=0)
        reached = (lack * self.most + lost.sum(axis=1)) * self.part(spans) * (1 + WIDE)
        return fine.all(axis=1) & (least - right[1] > reached + TINY)

    def ranges(self, box):
        """(low, high) of x of all solutions in a box; an arc is within a quadrant."""
        (letters, arcs, span), ends = box, [[], []]
        part = float(self.part(np.array([span]))[0])
        for i, letter in enumerate(letters):
            r, s, e = self.most * part, self.fast[i] * part, np.array(arcs[i])
            p = r * self.mus[:, i].max()
            tell = {"f": [[], []], "o": [[0], [r]], "s": [[0, 0, -p, -p], [r, p, p, p]],
                    "l": [[0, 0, *e.min(axis=0) - WIDE, 0], [r, p, *e.max(axis=0) + WIDE, s]]}
            ends = [x + y for x, y in zip(ends, tell[letter], strict=True)]
        return np.array([*ends[0], span[0]]), np.array([*ends[1], span[1]])
