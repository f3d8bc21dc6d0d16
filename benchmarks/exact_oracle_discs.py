"""All solutions of 3D Coulomb problems with one or two contacts, by exact arithmetic.

Contacts that are open, stick or have no friction are linear and are eliminated.  A contact that
slips has r_T = -mu r_N e, u_T parallel to e = ((1 - t^2), 2 t) / (1 + t^2), and u_N = 0.  With
r_N from u_N = 0 by Cramer's rule, cross(e, u_T) = 0 is a polynomial in t with rational
coefficients: of degree 4 for one contact; two contacts give two polynomials, of degrees (4, 2)
and (2, 4), and their resultant has degree 20, of which 4 are spurious.  Sturm's theorem
isolates all real roots, exact bisection narrows them, and the signs of the law are read where
they are far from zero.

Nothing of the package is used.  What is zero to DIGITS binary digits is reported as `singular`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from fractions import Fraction
from math import gcd, isqrt, lcm

import numpy as np
from exact_oracle import Answer, Array, Exact

Poly = list[Fraction]  # coefficients, ascending
DIGITS = 300  # binary, to which roots are narrowed, relative
SURE = Fraction(1, 2**100)  # a sign that is nearer to zero is not read


class Degenerate(ArithmeticError):
    """Something is zero, or too near to it, that is not in general."""


def all_exact(W: Array, q: Array, mu: Array) -> Answer:
    """Every solution; W (3 nc, 3 nc), q (nc, 3), mu (nc,), nc at most 2."""
    nc = len(mu)
    root = [_power(W[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]) for i in range(nc)]
    load = max(float(np.abs(q[i]).max()) / root[i] for i in range(nc))
    unit = Fraction(2.0 ** np.round(np.log2(load)))
    size = [Fraction(x) for x in root for _ in range(3)]
    exact_W = [[Fraction(float(x)) / a / b for x, b in zip(row, size, strict=True)]
               for row, a in zip(W, size, strict=True)]  # fmt: skip
    exact_q = [Fraction(float(x)) / a / unit for x, a in zip(q.ravel(), size, strict=True)]
    exact_mu = [Fraction(float(x)) for x in mu]
    found, singular = [], []
    for pattern in itertools.product(*["fsl" if m > 0 else "fl" for m in mu]):
        word = "".join(pattern)
        try:
            for r in _on_pattern(word, exact_W, exact_q, exact_mu):
                back = [float(x * unit / a) for x, a in zip(r, size, strict=True)]
                found.append(Exact(word, np.array(back), False))
        except Degenerate:
            singular.append(word)
    return Answer(tuple(found), tuple(singular))


def _power(block: Array) -> float:
    size = float(np.sqrt(np.linalg.norm(block, 2)))
    return float(2.0 ** np.round(np.log2(size))) if size > 0 else 1.0


# ---------------------------------------------------------------- one pattern
def _on_pattern(word: str, W: list, q: list, mu: list) -> list[list[Fraction]]:
    """Reactions of the solutions of a pattern."""
    slips = [i for i, x in enumerate(word) if x == "l" and mu[i] > 0]
    linear = [k for i, x in enumerate(word) for k in _unknowns(i, x, mu[i])]
    keep = [k for i in slips for k in range(3 * i, 3 * i + 3)]
    inverse = _inverse([[W[a][b] for b in linear] for a in linear])
    # r_linear = -inverse (q + W r_keep); u_keep = small r_keep + load
    toward = [[-sum(inverse[a][k] * W[linear[k]][b] for k in range(len(linear)))
               for b in keep] for a in range(len(linear))]  # fmt: skip
    fixed = [-sum(inverse[a][k] * q[linear[k]] for k in range(len(linear)))
             for a in range(len(linear))]  # fmt: skip
    small = [[W[a][b] + sum(W[a][linear[k]] * toward[k][j] for k in range(len(linear)))
              for j, b in enumerate(keep)] for a in keep]  # fmt: skip
    load = [q[a] + sum(W[a][linear[k]] * fixed[k] for k in range(len(linear))) for a in keep]
    out = []
    for slip in _slipping(small, load, [mu[i] for i in slips]):
        r = [Fraction(0)] * len(q)
        for k, value in zip(keep, slip, strict=True):
            r[k] = value
        for a, k in enumerate(linear):
            r[k] = fixed[a] + sum(c * x for c, x in zip(toward[a], slip, strict=True))
        u = [sum(w * x for w, x in zip(row, r, strict=True)) + c
             for row, c in zip(W, q, strict=True)]  # fmt: skip
        if all(_holds(x, r[3 * i : 3 * i + 3], u[3 * i : 3 * i + 3], mu[i])
               for i, x in enumerate(word)):  # fmt: skip
            out.append(r)
    return out


def _unknowns(i: int, letter: str, mu: Fraction) -> list[int]:
    if letter == "s":
        return [3 * i, 3 * i + 1, 3 * i + 2]
    return [3 * i] if letter == "l" and mu == 0 else []


def _holds(letter: str, r: list, u: list, mu: Fraction) -> bool:
    """The inequalities of one contact; those of slip are those of r_N and of e u_T."""
    if letter == "f":
        return _sign(u[0]) > 0
    if _sign(r[0]) <= 0:
        return False
    if letter == "s":
        return _sign(mu**2 * r[0] ** 2 - r[1] ** 2 - r[2] ** 2) > 0
    return mu == 0 or _sign(-(r[1] * u[1] + r[2] * u[2])) > 0


def _sign(x: Fraction) -> int:
    if abs(x) <= SURE:
        raise Degenerate
    return 1 if x > 0 else -1


def _inverse(matrix: list) -> list:
    """By elimination; Degenerate where there is none."""
    n = len(matrix)
    rows = [row[:] + [Fraction(int(i == j)) for j in range(n)]
            for i, row in enumerate(matrix)]  # fmt: skip
    for j in range(n):
        k = next((k for k in range(j, n) if rows[k][j] != 0), None)
        if k is None:
            raise Degenerate
        rows[j], rows[k] = rows[k], rows[j]
        rows[j] = [x / rows[j][j] for x in rows[j]]
        for k in range(n):
            if k != j and rows[k][j] != 0:
                rows[k] = [a - rows[k][j] * b for a, b in zip(rows[k], rows[j], strict=True)]
    return [row[n:] for row in rows]


# ---------------------------------------------------------------- slip
def _slipping(W: list, q: list, mu: list) -> list[list[Fraction]]:
    """r of all contacts that slip where their equations hold, signs disregarded."""
    if not mu:
        return [[]]
    if len(mu) == 1:
        return [_reaction(W, q, mu, [t]) for t in _roots(_across(W, q, mu, 0, []))]
    return _two_slipping(W, q, mu)


def _direction() -> tuple[Poly, Poly, Poly]:
    """(e_1, e_2, 1) times 1 + t^2."""
    one = Fraction(1)
    return [one, Fraction(0), -one], [Fraction(0), 2 * one], [one, Fraction(0), one]


def _across(W: list, q: list, mu: list, i: int, others: Sequence[Fraction]) -> Poly:
    """cross(e_i, u_T) r_N det = 0 as a polynomial in t_i, for given t of the other contact."""
    e1, e2, norm = _direction()
    nc, own = len(mu), slice(3 * i, 3 * i + 3)
    columns: list[list[Poly]] = []  # of r_N of every contact: u (three polynomials) times norm
    for j in range(nc):
        part = [row[3 * j : 3 * j + 3] for row in W]
        if j == i:
            columns.append([_add(_times(norm, [w[0]]), _times(e1, [-mu[j] * w[1]]),
                                 _times(e2, [-mu[j] * w[2]])) for w in part])  # fmt: skip
        else:
            c, s = _unit(others[0])
            columns.append([[w[0] - mu[j] * (c * w[1] + s * w[2])] for w in part])
    normal = [3 * j for j in range(nc)]
    if nc == 1:
        den = columns[0][0]
        r = [[-q[0]]]  # times norm / den
    else:
        a, b = columns[i], columns[1 - i]
        n, o = normal[i], normal[1 - i]
        # (a, b) (x, y) = -(q_n, q_o): a carries norm, so x carries norm / den, y 1 / den
        den = _add(_times(a[n], b[o]), _times(a[o], b[n], [Fraction(-1)]))
        x = _add(_times([-q[n]], b[o]), _times([q[o]], b[n]))
        y = _add(_times(a[o], [q[n]]), _times(a[n], [-q[o]]))
        r, columns = [x, y], [a, b]
    u = []
    for row in range(own.start + 1, own.stop):
        total = _times(den, [q[row]])
        total = _add(total, _times(columns[0][row], r[0]))  # the norms cancel
        if nc == 2:
            total = _add(total, _times(columns[1][row], r[1]))
        u.append(total)
    return _add(_times(e1, u[1]), _times(e2, u[0], [Fraction(-1)]))


def _reaction(W: list, q: list, mu: list, t: Sequence[Fraction]) -> list[Fraction]:
    """r with u_N = 0 for given directions of slip."""
    unit = [_unit(x) for x in t]
    columns = [[w[3 * j] - mu[j] * (c * w[3 * j + 1] + s * w[3 * j + 2]) for w in W]
               for j, (c, s) in enumerate(unit)]  # fmt: skip
    nc = len(mu)
    A = [[columns[j][3 * i] for j in range(nc)] for i in range(nc)]
    det = A[0][0] if nc == 1 else A[0][0] * A[1][1] - A[0][1] * A[1][0]
    _sign(det)
    inverse = _inverse(A)
    normal = [-sum(inverse[i][k] * q[3 * k] for k in range(nc)) for i in range(nc)]
    return [x for n, m, (c, s) in zip(normal, mu, unit, strict=True)
            for x in (n, -m * c * n, -m * s * n)]  # fmt: skip


def _unit(t: Fraction) -> tuple[Fraction, Fraction]:
    return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)


def _two_slipping(W: list, q: list, mu: list) -> list[list[Fraction]]:
    """Both directions by the resultant of the two conditions in t_2."""
    values = {Fraction(k): _pair(W, q, mu, Fraction(k)) for k in range(-10, 11)}
    eliminated = _interpolated([(t, _resultant(*pair)) for t, pair in values.items()])
    spurious = _without_reaction(W, q, mu)
    for _ in range(2):  # where both reactions are 0 / 0, two t_2 for each t_1
        eliminated = _divided(eliminated, spurious)
    out = []
    for t in _roots(eliminated):
        first, second = _pair(W, q, mu, t)
        size = max(abs(c) for c in second)
        scale = Fraction(0)
        candidates = []
        for s in _near_roots(first, t):
            value = _value(second, s) / size / max(1, abs(s)) ** 4
            candidates.append((abs(value), s))
            scale = max(scale, abs(value))
        for value, s in candidates:
            if value <= SURE:
                out.append(_reaction(W, q, mu, [t, s]))
            elif value <= Fraction(1, 2**40):
                raise Degenerate
    return out


def _without_reaction(W: list, q: list, mu: list) -> Poly:
    """The numerator of r_N2, a polynomial in t_1."""
    e1, e2, norm = _direction()
    own = [_add(_times(norm, [w[0]]), _times(e1, [-mu[0] * w[1]]), _times(e2, [-mu[0] * w[2]]))
           for w in (W[0], W[3])]  # fmt: skip
    return _add(_times(own[1], [q[0]]), _times(own[0], [-q[3]]))


def _divided(p: Poly, by: Poly) -> Poly:
    """The exact quotient."""
    p, out = p[:], []
    if by[-1] == 0:
        raise Degenerate
    while len(p) >= len(by):
        factor = p[-1] / by[-1]
        out.append(factor)
        for k, x in enumerate(reversed(by)):
            p[-1 - k] -= factor * x
        p.pop()
    assert not any(p), "the numerator does not divide"
    return out[::-1]


def _pair(W: list, q: list, mu: list, t: Fraction) -> tuple[Poly, Poly]:
    """Both conditions as polynomials in t_2 (degrees 2 and 4), t_1 being given.

    That of contact 1 is interpolated: times 1 + t_2^2 it has degree 2.  Both are polynomials
    in t_1 too, of degrees 4 and 2.
    """
    second = _times(_across(W, q, mu, 1, [t]), [1 + t * t])
    points = [Fraction(k) for k in (-1, 0, 1)]
    samples = []
    for s in points:
        at = _value(_across(W, q, mu, 0, [s]), t)
        samples.append((s, at * (1 + s * s)))
    return _padded(_interpolated(samples), 2), _padded(second, 4)


def _padded(p: Poly, degree: int) -> Poly:
    if len(p) > degree + 1 and any(p[degree + 1 :]):
        raise AssertionError("degree")
    return (p + [Fraction(0)] * (degree + 1))[: degree + 1]


def _near_roots(p: Poly, t: Fraction) -> list[Fraction]:
    """Real roots of a quadratic whose coefficients are known to DIGITS, as good as that."""
    c, b, a = p
    size = max(abs(x) for x in p)
    if size == 0 or abs(a) <= SURE * size:
        raise Degenerate
    square = (b * b - 4 * a * c) / size**2
    if abs(square) <= SURE:
        raise Degenerate
    if square < 0:
        return []
    shift = 2 * DIGITS
    root = Fraction(isqrt(square.numerator * 2 ** (2 * shift) // square.denominator), 2**shift)
    far = -(b / size + (root if b >= 0 else -root)) / 2
    return [far / (a / size), (c / size) / far]


def _resultant(p: Poly, s: Poly) -> Fraction:
    """Of degrees 2 and 4: Sylvester's determinant."""
    m, n = len(p) - 1, len(s) - 1
    rows = [[Fraction(0)] * i + p[::-1] + [Fraction(0)] * (n - 1 - i) for i in range(n)]
    rows += [[Fraction(0)] * i + s[::-1] + [Fraction(0)] * (m - 1 - i) for i in range(m)]
    sign = det = Fraction(1)
    for j in range(m + n):
        k = next((k for k in range(j, m + n) if rows[k][j] != 0), None)
        if k is None:
            return Fraction(0)
        if k != j:
            rows[j], rows[k], sign = rows[k], rows[j], -sign
        det *= rows[j][j]
        for k in range(j + 1, m + n):
            if rows[k][j] != 0:
                f = rows[k][j] / rows[j][j]
                rows[k] = [a - f * b for a, b in zip(rows[k], rows[j], strict=True)]
    return sign * det


# ---------------------------------------------------------------- polynomials
def _add(*terms: Poly) -> Poly:
    out = [Fraction(0)] * max(len(p) for p in terms)
    for p in terms:
        for k, x in enumerate(p):
            out[k] += x
    return out


def _times(*factors: Poly) -> Poly:
    out = [Fraction(1)]
    for p in factors:
        new = [Fraction(0)] * (len(out) + len(p) - 1)
        for i, a in enumerate(out):
            for j, b in enumerate(p):
                new[i + j] += a * b
        out = new
    return out


def _value(p: Sequence, t: Fraction) -> Fraction:
    out = Fraction(0)
    for c in reversed(p):
        out = out * t + c
    return out


def _interpolated(samples: list[tuple[Fraction, Fraction]]) -> Poly:
    """Newton's divided differences."""
    x = [t for t, _ in samples]
    c = [v for _, v in samples]
    for level in range(1, len(x)):
        for k in range(len(x) - 1, level - 1, -1):
            c[k] = (c[k] - c[k - 1]) / (x[k] - x[k - level])
    out: Poly = [c[-1]]
    for k in range(len(x) - 2, -1, -1):
        out = _add(_times(out, [-x[k], Fraction(1)]), [c[k]])
    return out


def _integers(p: Sequence[Fraction]) -> list[int]:
    """The same roots: integer coefficients without a common factor."""
    p = list(p)
    while p and p[-1] == 0:
        p.pop()
    den = lcm(*[Fraction(x).denominator for x in p]) if p else 1
    out = [int(x * den) for x in p]
    common = gcd(*out) if out else 1
    return [x // (common or 1) for x in out]


def _chain(p: list[int]) -> list[list[int]]:
    """Sturm's sequence, primitive."""
    chain = [p, _integers([Fraction(k * c) for k, c in enumerate(p)][1:])]
    while len(chain[-1]) > 1:
        a, b = chain[-2][:], chain[-1]
        while len(a) >= len(b):
            lead = abs(b[-1])
            factor = a[-1] * (1 if b[-1] > 0 else -1)
            shift = len(a) - len(b)
            a = [x * lead for x in a]
            for k, x in enumerate(b):
                a[k + shift] -= factor * x
            while a and a[-1] == 0:
                a.pop()
        if not a:
            raise Degenerate  # a double root
        chain.append(_integers([Fraction(-x) for x in a]))
    return chain


def _changes(chain: list[list[int]], t: Fraction) -> int:
    signs = [_int_sign(p, t) for p in chain]
    signs = [s for s in signs if s]
    return sum(a != b for a, b in itertools.pairwise(signs))


def _int_sign(p: list[int], t: Fraction) -> int:
    """Sign of p(n / d), by integers."""
    n, d = t.numerator, t.denominator
    total, power = 0, 1
    for c in reversed(p):
        total = total * n + c * power
        power *= d
    return (total > 0) - (total < 0)


def _roots(p: Sequence[Fraction]) -> list[Fraction]:
    """All real roots, each to DIGITS; Degenerate where one is double or at infinity."""
    size = max((abs(x) for x in p), default=Fraction(0))
    if size == 0 or abs(p[-1]) <= SURE * size:
        raise Degenerate
    whole = _integers(p)
    chain = _chain(whole)
    bound = Fraction(2) ** (1 + int(np.ceil(float(np.log2(float(1 + max(
        abs(Fraction(c, whole[-1])) for c in whole)))))))  # fmt: skip
    out, stack = [], [(-bound, bound, _changes(chain, -bound), _changes(chain, bound))]
    while stack:
        low, high, a, b = stack.pop()
        if a == b:
            continue
        if a - b == 1 and _int_sign(whole, low) * _int_sign(whole, high) < 0:
            out.append(_bisected(whole, low, high))
            continue
        middle = (low + high) / 2
        if _int_sign(whole, middle) == 0:
            middle += (high - low) / 1000
        c = _changes(chain, middle)
        stack += [(low, middle, a, c), (middle, high, c, b)]
    return out


def _bisected(p: list[int], low: Fraction, high: Fraction) -> Fraction:
    sign = _int_sign(p, low)
    while high - low > Fraction(1, 2**DIGITS) * max(Fraction(1, 2**60), abs(low), abs(high)):
        middle = (low + high) / 2
        if _int_sign(p, middle) == sign:
            low = middle
        else:
            high = middle
    return (low + high) / 2
