"""All solutions in 3D, for one load or for all loads and friction between two: boxes that tell.

A tree divides what contacts may do (. all, c closed, f free, s stick, o closed without friction,
l slip with r_T = -mu r_N e, u_T = s e, s >= 0, e on the arc from a to b) and the time, q and mu
linear in it.  A box is excluded by a y whose side of y.(W r + q) no reaction and no velocity of
it reaches.  Else all is decided, and F(x) = 0 is quadratic in x: r_N, p = mu r_N, r_T or e, s
of contacts, the time t.  About c, along d, with P near the inverse of J without column k,

    x = c + d s + w,  |w| <= |P F(c)| + |P Q(h, h)| + |P J - 1| h,  |x - c| <= h <= |d s| + |w|.

Where the bound of |w| with 2 Q is below a z that h was made of, there is one x at each s, by
Brouwer and Banach.  Tubes about these lines that touch are one chain.
"""

import numpy as np

from .lists import reach
from .numbers import U, need

SIZES, STEPS, WIDE = {"f": 0, "o": 1, "s": 4, "l": 5}, 40, 1e-12
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
        self.rubs, S = self.mus.any(axis=0), (self.W + self.W.T) / 2
        self.most = reach(S, self.loads, np.arange(len(W)) % 3 == 0) * (1 + 1e-9)
        fast = [max(reach(S, self.loads, s * row) for s in (1, -1)) for row in self.W]
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
        turned, size = np.einsum("kit,kiat->kia", y[:, :, 1:], arcs), abs(y[:, :, 1:]).sum(2)
        lost = 1.5 * slips * self.fast * (np.maximum(turned.max(2), 0) + 8 * U * size)
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
        lack = np.maximum(np.where(letters == "f", 0.0, push), 0).max(axis=1)
        right = flat @ self.loads.T, round_ * (abs(flat) @ abs(self.loads).sum(axis=0))
        least = np.min([(1 - t) * right[0][:, 0] + t * right[0][:, 1] for t in spans.T], axis=0)
        reached = (lack * self.most + lost.sum(axis=1)) * self.part(spans) * (1 + WIDE)
        return fine.all(axis=1) & (least - right[1] > reached)

    def forms(self, letters):
        """(equations, slacks, r) as forms on (x, 1), (., 2, n + 2, n + 2), with their sizes."""
        place = np.cumsum([0, *[SIZES[x] for x in letters]])
        t, one, mus = place[-1], place[-1] + 1, self.mus

        def term(i, j, factor=1.0, size=None):
            pair = np.zeros((2, one + 1, one + 1))
            pair[:, i, j] = factor, abs(factor) if size is None else size
            return pair

        r, zero, slacks = np.zeros((len(self.W), 2, one + 1, one + 1)), [], []
        for i, (k, letter) in enumerate(zip(place, letters, strict=False)):
            if letter != "f":
                r[3 * i] = term(k, one)
            for j in (1, 2) if letter in "sl" else ():
                T = term(k + 1 + j, one) if letter == "s" else term(k + 1, k + 1 + j, -1.0)
                r[3 * i + j] = T
        u = np.stack([np.tensordot(W, r[:, j], 1) for j, W in enumerate((self.W, abs(self.W)))])
        u, (q, end) = u.swapaxes(0, 1), self.loads
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

    def tube(self, box, c, k):
        """What is in a decided box: None for nothing, else (is there surely, low, high, off).

        low, high (1 + m): of the time and r of all solutions in it, off: of r from a line;
        refused where there may be more than one curve.
        """
        low, high = self.ranges(box)
        n, margin, forms = len(low) - 1, 4 * U * (4 * len(self.W) + 40), self.forms(box[0])
        need(c.shape == low.shape and 0 <= k <= n, "no centre")
        M = np.concatenate(forms)
        x, M, count = np.append(c, 1.0), (M + M.swapaxes(2, 3)) / 2, len(forms[0])
        terms = [np.einsum("aij,j,i->a", M[:, 0], x, x), 2 * (M[:, 0] @ x)[:, :-1]]
        sizes = [np.einsum("aij,j,i->a", M[:, 1], abs(x), abs(x)), 2 * (M[:, 1] @ abs(x))[:, :-1]]
        F, J, Q = *terms, M[:, 0, :-1, :-1]
        dF, dJ, dQ = *[margin * size for size in sizes], margin * M[:, 1, :-1, :-1]
        others = np.delete(np.arange(n + 1), k)
        P = np.linalg.inv(J[:count, others]) if n else np.zeros((0, 0))
        d = np.zeros(n + 1)
        d[k], d[others] = 1.0, -P @ J[:count, k]
        off, size = P @ J[:count], abs(P)
        off[:, others] -= np.eye(n)
        off[:, k] += d[others]
        E = abs(off) + size @ (dJ[:count] + margin * abs(J[:count]))
        a = abs(P @ F[:count]) + size @ (dF[:count] + margin * abs(F[:count]))
        T = abs(np.tensordot(P, Q[:count], 1))
        T += np.tensordot(size, dQ[:count] + margin * abs(Q[:count]), 1)
        h, w = np.maximum(abs(high - c), abs(c - low)), np.zeros(n + 1)
        for _ in range(STEPS):
            w[others] = (a + T @ h @ h + E @ h) * (1 + WIDE)
            h[others] = np.minimum(h, (abs(d) * h[k] + w) * (1 + WIDE))[others]
        z = np.where(np.arange(n + 1) == k, 0.0, 3 * w)
        H = abs(d) * h[k] + z
        one = ((a + 2 * T @ H @ H + E @ H) * (1 + WIDE) < z[others]).all()

        def rows(w, h, which):  # value and slope along d, and a bound of what they are off by
            by = abs(J) @ w + dF + dJ @ (abs(d) * h[k] + w) + (abs(Q) + dQ) @ h @ h
            return F[which], (J @ d)[which], by[which] + margin * (abs(F) + abs(J) @ H)[which]

        last = count + len(forms[1])
        value, slope, bound = rows(w, h, slice(count, last))
        near = w + 4 * U * (abs(c) + np.maximum(abs(low), abs(high)))
        beside = [(c - low, d, near), (high - c, -d, near)]
        first, final = along(*[np.append(x, np.stack(y)) for x, y in
                               zip((value, slope, bound), zip(*beside, strict=True), strict=True)
                               ], 1, h[k])
        if first > final:
            return None
        need(one, "more than one curve")
        value, slope, bound = rows(z, H, slice(count, last))
        time = [(c - low)[-1:], (high - c)[-1:]], [d[-1:], -d[-1:]], [z[-1:], z[-1:]]
        sure = along(*[np.append(x, y) for x, y in zip((value, slope, bound), time)], -1, h[k])
        value, slope, bound = rows(w, h, slice(last, None))
        value, slope, bound = (np.append(x[-1], y) for x, y in
                               zip((c, d, w), (value, slope, bound)))
        ends = np.stack([value + s * slope for s in (first, final)])
        room = bound + WIDE * (abs(ends).max(axis=0) + 1)
        return sure[0] <= sure[1], ends.min(axis=0) - room, ends.max(axis=0) + room, bound[1:].max()


def along(value, slope, bound, sign, h):
    """The part of -h to h where no value + s slope + sign bound is negative; (1, -1): none."""
    value, moves = value + sign * bound, slope != 0
    if (value[~moves] < 0).any():
        return 1.0, -1.0
    zero = -value[moves] / slope[moves]
    low = max(zero[slope[moves] > 0].max(initial=-h) - sign * WIDE * h, -h)
    high = min(zero[slope[moves] < 0].min(initial=h) + sign * WIDE * h, h)
    return (low, high) if low <= high else (1.0, -1.0)


def chains(low, high):
    """The tubes (j) of every set of tubes whose ranges touch."""
    left, out = np.ones(len(low), dtype=bool), []
    while left.any():
        new = [int(np.argmax(left))]
        left[new[0]], chain = False, []
        while new:
            chain.append(new.pop())
            j = np.flatnonzero(left)
            met = ((low[j] <= high[chain[-1]]) & (high[j] >= low[chain[-1]])).all(axis=1)
            left[j[met]] = False
            new += [*j[met]]
        out.append(np.array(chain))
    return out


def curves(W, q, mu, tree, y, x, k, t, r, span, distance, end=None, mu_end=None):
    """All solutions in words; t (s,), r (s, nc, 3): one of every curve."""
    problem, nc = Problem(W, q, mu, end, mu_end), len(mu)
    first, last = (float(s) for s in span)
    need(0 <= first <= last <= (0 if end is None else 1), "no span of time")
    stack, boxes = [("." * nc, (ARCS[0],) * nc, (first, last))], {-1: [], -2: []}
    for node in tree:
        need(stack and -2 <= node <= nc, "no tree")
        box = stack.pop()
        if node < 0:
            boxes[int(node)].append(box)
        else:
            stack += reversed(divided(box, int(node), problem.rubs))
    need(not stack and len(y) == len(boxes[-1]) and len(x) == len(k) == len(boxes[-2]), "no tree")
    for j in range(0, len(y), 1000):
        need(problem.excluded(boxes[-1][j : j + 1000], y[j : j + 1000]).all(), "a box is left")
    need(all(set(box[0]) <= set(SIZES) for box in boxes[-2]), "a contact is not decided")
    tubes = [problem.tube(box, c[: 1 + sum(SIZES[x] for x in box[0])], int(j))
             for box, c, j in zip(boxes[-2], x, k, strict=True)]  # fmt: skip
    sure, low, high, off = (np.array(a) for a in zip(*[a for a in tubes if a], strict=True))
    found, at = chains(low, high), np.column_stack([t, r.reshape(len(r), -1) / problem.to_r])
    need(all(sure[chain].any() for chain in found), "there may be a solution, or none")
    beside = [((low[chain] <= at[:, None]) & (at[:, None] <= high[chain])).all(2).any(1)
              for chain in found]  # fmt: skip
    need(len(at) == len(found) and (np.sum(beside, axis=1) == 1).all(), "another list")
    need(off.max() * problem.to_r <= distance, "solutions are not that near")
    if end is None:
        return f"this load: all solutions are within {distance:.1e} of {len(found)}"
    ends = [(low[chain, 0].min(), high[chain, 0].max()) for chain in found]
    lonely = sum(a > first and b < last for a, b in ends)
    told = ", ".join(sorted(f"{max(a, first):.6f} to {min(b, last):.6f}" for a, b in ends))
    return (f"all loads from {first:g} to {last:g} between two: all solutions are within "
            f"{distance:.1e} of {len(found)} curves ({told}), {lonely} of them with neither end")
