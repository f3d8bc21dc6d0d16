"""The curve of solutions of one pattern in a box of slip directions and load, with proof.

With the derivatives J of the equations F (`curve_equations`) over a box about x_c, one of the
angles or t as the parameter k, d their kernel with d_k = 1, and P near the inverse of J without
column k, all x of the box with F = 0 have, [Neumaier] section 5.1,

    x - x_c - d s = w,   |w| <= |P F(x_c)| + |P (J - J_c)| |d| h + |1 - P J| |w|,   |s| <= h,

s being x_k less that of x_c, h its range.  A bound z with |w| < z proves by Brouwer that there
is exactly one solution at every s, in the tube |w| <= z.  The box is one around the centre,
found by Newton's method, that holds the given one.  Every inequality of the pattern is
s_0 + s s_1 up to a bound along the curve, which says where it surely holds and where possibly.

[Neumaier] A. Neumaier, "Interval methods for systems of equations" (1990).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .curve_equations import (
    EPSILON,
    UP,
    Local,
    Mask,
    Pattern,
    Spread,
    bend,
    fixed_point,
    inverses,
)  # fmt: skip

Array = NDArray[np.float64]
Index = NDArray[np.int64]
NEWTON = 10  # steps to the centre
FAR = 4.0  # times the box, and what the curve moves in it, that these may go
END = 1e-13  # of the last one, relative to 1 + |x|
CUT = 0.9  # of a width: a range that leaves more changes nothing


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes of one pattern: x (B, n + 1) their middles, half (B, n + 1); y is not used."""

    x: Array
    half: Array

    def part(self, which: Any) -> Boxes:
        """Some of them."""
        return Boxes(self.x[which], self.half[which])


@dataclass(frozen=True, eq=False)
class Curves:
    """What `traced` tells of boxes.

    known (B,): those with at most one curve.  x, d, z (B, n + 1): its centre, direction and
    bound; k (B,): its parameter.  possible, sure (B, 2): where along it solutions in the box
    may be, and where there is one; (1, -1) for nowhere.
    """

    known: Mask
    x: Array
    d: Array
    z: Array
    k: Index
    possible: Array
    sure: Array


def _others(n: int, k: Index) -> Index:
    """Columns (B, n) of all unknowns but k."""
    j = np.arange(n)
    return j + (j >= k[:, None])


def _preconditioner(at: Local, k: Index) -> tuple[Array, Array, Mask]:
    """(P, d with d_k = 1, where there are)."""
    n, each = at.J.shape[1], np.arange(len(k))
    others = _others(n, k)
    P, fine = inverses(np.take_along_axis(at.J, others[:, None, :], 2))
    d = np.zeros_like(at.x)
    step = -(P @ at.J[each, :, k][:, :, None])[:, :, 0]
    np.put_along_axis(d, others, step, 1)
    d[each, k] = 1.0
    return P, d, fine


def _change(pattern: Pattern, at: Local, by: Spread, P: Array, k: Index) -> Array:
    """Bounds of |P J - (1, -d)| over boxes, (B, n, n + 1), columns in the order of x."""
    n, each = at.J.shape[1], np.arange(len(k))
    off = P @ at.J
    off[each[:, None], np.arange(n), _others(n, k)] -= 1.0
    off[each, :, k] = 0.0  # d is what column k gives
    return pattern.change(P, at, by) + np.abs(off)


def _breaks_a_sign(pattern: Pattern, at: Local, by: Spread, half: Array) -> Mask:
    """Where an inequality of the pattern surely fails in all of a box."""
    free, A, B = 3 * pattern.free, pattern.A, pattern.B
    du = by.du + at.rounding
    fails = (at.u[:, free] + du[:, free] < 0).any(axis=1)
    ny = pattern.ny
    normal = at.x[:, :ny] + half[:, :ny]
    fails |= (normal[:, pattern.pressed] < 0).any(axis=1)
    c, s = bend(half[:, pattern.turn])
    most = at.u[:, A] + du[:, A] + c * (np.abs(at.u[:, A]) + du[:, A])
    fails |= (most + s * (np.abs(at.u[:, B]) + du[:, B]) < 0).any(axis=1)
    k, mu = pattern.first, pattern.stick_mu
    friction = np.abs(mu[0] + at.x[:, -1:] * mu[1]) + np.abs(mu[1]) * half[:, -1:]
    least = np.hypot(at.x[:, k + 1], at.x[:, k + 2])
    least -= np.hypot(half[:, k + 1], half[:, k + 2])
    fails |= (normal[:, k] < 0).any(axis=1)
    return fails | (friction * normal[:, k] < least).any(axis=1)


def _with_y(pattern: Pattern, boxes: Boxes) -> tuple[Local, Array, Mask]:
    """(the middles with some y, how far y is from it in the boxes, where that is known)."""
    x, fine = pattern.with_y(boxes.x, few=True)
    dy, small = pattern.range_of_y(pattern.local(x), boxes.half, few=True)
    fine &= small
    if not fine.all():
        rest = np.flatnonzero(~fine)
        x[rest], also = pattern.with_y(boxes.x[rest], few=False)
        dy[rest], small = pattern.range_of_y(
            pattern.local(x[rest]), boxes.half[rest], few=False
        )
        fine[rest] = also & small
    return pattern.local(x), dy, fine


def narrowed(pattern: Pattern, boxes: Boxes) -> tuple[Mask, Boxes, Index]:
    """(which boxes surely hold nothing, all of them narrowed, the parameter k or -1)."""
    at, dy, fine = _with_y(pattern, boxes)
    x, half, ny = at.x, boxes.half.copy(), pattern.ny
    half[:, :ny] = dy
    by = pattern.spread(at, half)
    empty = fine & _breaks_a_sign(pattern, at, by, half)
    weight = half.copy()
    weight[:, :ny] += 1e-12 * (1 + np.abs(x[:, :ny]))
    d = np.linalg.svd(np.where(fine[:, None, None], at.J * weight[:, None, :], 0.0))[2][:, -1]
    k = ny + np.argmax(np.abs(d[:, ny:]), axis=1)
    P, _, regular = _preconditioner(at, k)
    each = np.arange(len(k))
    reach = (_change(pattern, at, by, P, k) @ half[:, :, None])[:, :, 0]
    reach += np.abs((P @ at.J[each, :, k][:, :, None])[:, :, 0]) * half[each, k][:, None]
    reach += (np.abs(P) @ at.rounding[:, pattern.rows, None])[:, :, 0]
    shift, wide = np.zeros_like(x), np.full_like(x, np.inf)
    np.put_along_axis(shift, _others(pattern.n, k), -(P @ at.F[:, :, None])[:, :, 0], 1)
    np.put_along_axis(wide, _others(pattern.n, k), reach * UP, 1)
    wide[~(fine & regular)] = np.inf
    low, high = np.maximum(-half, shift - wide), np.minimum(half, shift + wide)
    low[:, :ny] = high[:, :ny] = 0.0
    empty |= (low > high).any(axis=1)
    cut = (high - low < 2 * CUT * half) & ~empty[:, None]
    cut[:, :ny] = False
    middle = np.where(cut, x + (low + high) / 2, x)
    half = np.where(cut, (high - low) / 2 + 4 * EPSILON * (1 + np.abs(middle)), boxes.half)
    return empty, Boxes(middle, half), np.where(fine & regular, k, -1)


def on_curve(pattern: Pattern, x: Array, k: Index) -> tuple[Array, Mask]:
    """(the solutions of the equations with x_k by Newton's method, where it converges)."""
    x, done, lost = x.copy(), np.zeros(len(x), dtype=bool), np.zeros(len(x), dtype=bool)
    others = _others(pattern.n, k)
    for _ in range(NEWTON):
        left = np.flatnonzero(~(done | lost))
        if not len(left):
            break
        at = pattern.local(x[left])
        P, _, fine = _preconditioner(at, k[left])
        step = -(P @ at.F[:, :, None])[:, :, 0]
        size = np.abs(step).max(axis=1, initial=0.0)
        fine &= size < 1e6
        x[left[:, None], others[left]] += np.where(fine[:, None], step, 0.0)
        lost[left] = ~fine
        done[left] = fine & (size <= END * (1 + np.abs(x[left]).max(axis=1)))
    return x, done


def traced(pattern: Pattern, boxes: Boxes, k: Index, whole: tuple[float, float]) -> Curves:
    """The curve in every box, with parameters k (B,); whole: the values of t."""
    ny, each = pattern.ny, np.arange(len(k))
    start, known = pattern.with_y(boxes.x, few=False)
    x, converged = on_curve(pattern, start, k)
    wide = boxes.half.copy()
    known &= converged
    x = np.where(known[:, None], x, start)
    at = pattern.local(x)
    P, d, fine = _preconditioner(at, k)
    h = wide[each, k]
    off = np.abs(x - boxes.x)
    far = FAR * (wide + np.abs(d) * h[:, None]) + 1e-9
    known &= (off[:, ny:] <= far[:, ny:]).all(axis=1)
    half = np.maximum(wide + off, 1.1 * np.abs(d) * h[:, None] + 0.05 * wide)
    half = half * UP + 1e-13
    half[each, k] = h
    dy, small = pattern.best_range_of_y(at, half)
    known &= fine & small
    half[:, :ny] = np.maximum(1.1 * dy, 1.2 * np.abs(d[:, :ny]) * h[:, None]) + 1e-13
    half[~known] = 1.0
    by = pattern.spread(at, half)
    change = _change(pattern, at, by, P, k)
    b = np.abs((P @ at.F[:, :, None])[:, :, 0])
    b += (change @ np.abs(d[:, :, None]))[:, :, 0] * h[:, None]
    b += (np.abs(P) @ at.rounding[:, pattern.rows, None])[:, :, 0]
    others, z = _others(pattern.n, k), np.zeros_like(x)
    w, small = fixed_point(np.take_along_axis(change, others[:, None, :], 2), b)
    np.put_along_axis(z, others, w, 1)
    inside = np.abs(d) * h[:, None] + z <= half
    inside[each, k] = True
    known &= small & inside.all(axis=1)
    slacks = _slacks(pattern, at, by, d, z, h, whole)
    sure = _not_negative(slacks, -1.0, h)
    turn = np.append(pattern.turn, pattern.n)  # within the given box
    shift = (x - boxes.x)[:, turn]
    room = np.where(turn == k[:, None], np.inf, wide[:, turn] * UP)
    beside = [np.stack([room + sign * shift, sign * d[:, turn], z[:, turn]], axis=2)
              for sign in (1.0, -1.0)]  # fmt: skip
    possible = _not_negative(np.concatenate([slacks, *beside], axis=1), 1.0, h)
    return Curves(known, x, d, z, k, possible, sure)


def _slacks(
    pattern: Pattern, at: Local, by: Spread, d: Array, z: Array, h: Array,
    whole: tuple[float, float],
) -> Array:  # fmt: skip
    """s_0, s_1 and bounds, (B, s, 3), of the inequalities of a pattern along its tubes."""
    x, far = at.x, np.abs(d) * h[:, None] + z
    slope = (at.Cu @ d[:, :, None])[:, :, 0]
    bound = (np.abs(at.Cu) @ z[:, :, None])[:, :, 0] + at.rounding
    bound += ((by.dU + at.rounding_of_Cu) @ far[:, :, None])[:, :, 0]
    free, A, B, turn = 3 * pattern.free, pattern.A, pattern.B, pattern.turn
    out = [(at.u[:, free], slope[:, free], bound[:, free])]
    pressed = np.concatenate([pattern.pressed, pattern.first])
    out.append((x[:, pressed], d[:, pressed], z[:, pressed]))
    more = (by.along @ far[:, :, None])[:, :, 0] + np.abs(at.u[:, B]) * z[:, turn]
    more += at.rounding[:, B] * far[:, turn]
    out.append((at.u[:, A], slope[:, A] + at.u[:, B] * d[:, turn], bound[:, A] + more))
    k, mu, t = pattern.first, pattern.stick_mu, slice(-1, None)
    m, T = mu[0] + x[:, t] * mu[1], np.hypot(x[:, k + 1], x[:, k + 2])
    D, e = np.hypot(far[:, k + 1], far[:, k + 2]), np.hypot(z[:, k + 1], z[:, k + 2])
    bent = D < 2 * T  # else |T| is only known to change by D
    size = np.where(T > 0, T, 1.0)
    radial = (x[:, k + 1] * d[:, k + 1] + x[:, k + 2] * d[:, k + 2]) / size
    off = np.abs(m) * z[:, k]
    off += np.abs(mu[1]) * (z[:, t] * np.abs(x[:, k]) + far[:, t] * far[:, k])
    off += np.where(bent, e + D**2 / (2 * size), D) + 16 * EPSILON * (np.abs(m * x[:, k]) + T)
    along = m * d[:, k] + mu[1] * d[:, t] * x[:, k] - np.where(bent, radial, 0.0)
    out.append((m * x[:, k] - T, along, off))
    out.append((x[:, t] - whole[0], d[:, t], z[:, t]))
    out.append((whole[1] - x[:, t], -d[:, t], z[:, t]))
    return np.concatenate([np.stack(part, axis=2) for part in out], axis=1)


def _not_negative(slacks: Array, sign: float, h: Array) -> Array:
    """The part (B, 2) of -h to h where no s_0 + s s_1 + sign bound is negative, or (1, -1)."""
    value, slope = slacks[:, :, 0] + sign * slacks[:, :, 2], slacks[:, :, 1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        zero = -value / slope
    low = np.where(slope > 0, zero, -np.inf).max(axis=1, initial=-np.inf)
    high = np.where(slope < 0, zero, np.inf).min(axis=1, initial=np.inf)
    low, high = np.maximum(low, -h), np.minimum(high, h)
    none = ((slope == 0) & (value < 0)).any(axis=1) | ~(low <= high)
    return np.where(none[:, None], [1.0, -1.0], np.stack([low, high], axis=1))
