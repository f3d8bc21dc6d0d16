"""The one curve of solutions in a decided box, in 3D, or that there is none.

F(x) = 0 is quadratic in x: r_N, p = mu r_N, r_T or e, s of contacts, and the time.  About c,
along d, with P near the inverse of J without column k,

    x = c + d s + w,  |w| <= |P F(c)| + |P Q(h, h)| + |P J - 1| h,  |x - c| <= h <= |d s| + |w|.

Where the bound of |w| with 2 Q is below a z that h was made of, there is one x at each s, by
Brouwer and Banach.
"""

import numpy as np

from .boxes import WIDE
from .numbers import U, need

SIZES, STEPS = {"f": 0, "o": 1, "s": 4, "l": 5}, 40  # numbers of a contact; steps of h


def forms_of(problem, letters):
    """(equations, slacks, r) as forms on (x, 1), (., 2, n + 2, n + 2), with their sizes."""
    place = np.cumsum([0, *[SIZES[x] for x in letters]])
    t, one, mus = place[-1], place[-1] + 1, problem.mus

    def term(i, j, factor=1.0, size=None):
        pair = np.zeros((2, one + 1, one + 1))
        pair[:, i, j] = factor, abs(factor) if size is None else size
        return pair

    r, zero, slacks = np.zeros((len(problem.W), 2, one + 1, one + 1)), [], []
    for i, (k, letter) in enumerate(zip(place, letters, strict=False)):
        if letter != "f":
            r[3 * i] = term(k, one)
        for j in (1, 2) if letter in "sl" else ():
            sticks = letter == "s"
            r[3 * i + j] = term(k + 1 + j, one) if sticks else term(k + 1, k + 1 + j, -1.0)
    sizes = problem.W, abs(problem.W)
    u = np.stack([np.tensordot(W, r[:, j], 1) for j, W in enumerate(sizes)], axis=1)
    q, end = problem.loads
    u[:, :, one, one] += np.stack([q, abs(q)], axis=1)
    u[:, :, t, one] += np.stack([end - q, abs(end) + abs(q)], axis=1)
    for i, (k, letter) in enumerate(zip(place, letters, strict=False)):
        (slacks if letter == "f" else zero).append(u[3 * i])
        slacks += [] if letter == "f" else [term(k, one)]
        if letter in "sl":
            change = term(k, t, mus[0, i] - mus[1, i], mus[:, i].sum())
            zero.append(term(k + 1, one) + term(k, one, -mus[0, i]) + change)
            square = term(k + 2, k + 2) + term(k + 3, k + 3)
        if letter == "l":
            zero += [u[3 * i + j] + term(k + 4, k + 1 + j, -1.0) for j in (1, 2)]
            zero.append(square + term(one, one, -1.0))
            slacks.append(term(k + 4, one))
        elif letter == "s":
            zero += [u[3 * i + 1], u[3 * i + 2]]
            slacks.append(term(k + 1, k + 1) + square * [[[-1]], [[1]]])
    empty = np.zeros((0, 2, one + 1, one + 1))
    return [np.array([*x]) if len(x) else empty for x in (zero, slacks, r)]


class Expansion:
    """All forms about c: values F, slopes J and Q of each, and bounds of their rounding."""

    def __init__(self, M, c, margin):
        x, M = np.append(c, 1.0), (M + M.swapaxes(2, 3)) / 2
        at = M @ x, abs(M) @ abs(x)
        self.F, self.dF = at[0][:, 0] @ x, margin * (at[1][:, 1] @ abs(x))
        self.J, self.dJ = 2 * at[0][:, 0, :-1], 2 * margin * at[1][:, 1, :-1]
        self.Q, self.dQ = M[:, 0, :-1, :-1], margin * M[:, 1, :-1, :-1]
        self.dF += margin * abs(self.F)
        self.dJ += margin * abs(self.J)
        self.dQ += margin * abs(self.Q)

    def on_line(self, d, w, h, which):
        """Value, slope along d and what both are off by within w of a line, h of c."""
        off = abs(self.J) @ w + self.dF + self.dJ @ h + (abs(self.Q) + self.dQ) @ h @ h
        return self.F[which], (self.J @ d)[which], off[which] * (1 + WIDE)


def tube(problem, box, c, k):
    """What is in a decided box: None for nothing, else (is there surely, low, high, off).

    low, high (1 + m): of the time and r of all solutions in it, off: of r from a line;
    refused where there may be more than one curve.
    """
    low, high = problem.ranges(box)
    n, forms = len(low) - 1, forms_of(problem, box[0])
    need(c.shape == low.shape and 0 <= k <= n, "no centre")
    at = Expansion(np.concatenate(forms), c, 4 * U * (4 * len(problem.W) + 40))
    slacks = slice(n, n + len(forms[1]))
    a, E, T, d = preconditioned(at, n, k)
    others, h = np.delete(np.arange(n + 1), k), np.maximum(abs(high - c), abs(c - low))
    w = 0 * c
    for _ in range(STEPS):
        w[others] = (a + T @ h @ h + E @ h) * (1 + WIDE)
        h[others] = np.minimum(h, (abs(d) * h[k] + w) * (1 + WIDE))[others]
    sides = 4 * U * (abs(c) + np.maximum(abs(low), abs(high)))
    beside = np.stack([(c - low, d, w + sides), (high - c, -d, w + sides)])
    first, last = part_of(np.hstack([at.on_line(d, w, h, slacks), *beside]), 1, h[k])
    if first > last:
        return None
    z = np.where(np.arange(n + 1) == k, 0.0, 3 * w)
    H = (abs(d) * h[k] + z) * (1 + WIDE)
    need(((a + 2 * T @ H @ H + E @ H) * (1 + WIDE) < z[others]).all(), "more than one curve")
    beside[:, 2] = z + sides
    sure = part_of(np.hstack([at.on_line(d, z, H, slacks), *beside[:, :, -1:]]), -1, h[k])
    r = at.on_line(d, w, h, slice(slacks.stop, None))
    value, slope, off = np.hstack([[[c[-1]], [d[-1]], [w[-1]]], r])
    ends = np.stack([value + s * slope for s in (first, last)])
    off += WIDE * (abs(ends).max(axis=0) + 1)
    return sure[0] <= sure[1], ends.min(axis=0) - off, ends.max(axis=0) + off, off[1:].max()


def preconditioned(at, n, k):
    """|P F(c)|, |P J - 1|, |P Q| with their rounding, and d."""
    others, J, d = np.delete(np.arange(n + 1), k), at.J[:n], np.eye(n + 1)[k]
    P = np.linalg.inv(J[:, others])
    d[others] = -P @ J[:, k]
    off, size = P @ J, abs(P)
    off[:, others] -= np.eye(n)
    off[:, k] += d[others]
    a = abs(P @ at.F[:n]) + size @ at.dF[:n]
    T = abs(np.tensordot(P, at.Q[:n], 1)) + np.tensordot(size, at.dQ[:n], 1)
    return a, abs(off) + size @ at.dJ[:n], T, d


def part_of(lines, sign, h):
    """The part of -h to h where no value + s slope + sign off is negative; (1, -1): none."""
    need(np.isfinite(lines).all(), "numbers are too large")
    value, slope = lines[0] + sign * lines[2], lines[1]
    moves = slope != 0
    if (value[~moves] < 0).any():
        return 1.0, -1.0
    with np.errstate(over="ignore"):
        zero, slope = -value[moves] / slope[moves], slope[moves]
    low = max(zero[slope > 0].max(initial=-h) - sign * WIDE * h, -h)
    high = min(zero[slope < 0].min(initial=h) + sign * WIDE * h, h)
    return (low, high) if low <= high else (1.0, -1.0)
