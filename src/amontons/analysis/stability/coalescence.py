"""Flutter and divergence over the friction, without a sweep.

Let p scale all friction and l = -s^2.  Without damping Q(l, p) = [[K, -F_0 - p F_1], [B, D]] -
l [[M, 0], [0, 0]] is singular for modes.  Two of them meet where, with the bordered system

    [ Q   b ] [x]   [0]
    [ c^T 0 ] [g] = [1],

g = 0 and dg/dl = 0 ([G]): two equations for l and p, solved by Newton's method on the whole
sparse system; all derivatives of g come from solves with the same matrix and its transpose.
Starts: the modes of p = 0, phi_i with forces rho_i, couple by P_ij = phi_i^T F_1 rho_j; each
pair meets where the discriminant of its two by two problem is zero, a quadratic in p.  Where
three modes take part that is far off, so that the small problem diag(l_i) - p P of all these
modes is also followed over p: where more of its eigenvalues are complex than before, two have
met.  Steps are divided where slopes tell that two would meet and part again within them.
Newton's method on the small problem improves all starts.  A point is kept if the modes of the
whole grow beyond it and not before.

Divergence, l = 0, is an eigenvalue problem in p.  Damping shifts both; then `modes` tells.

[G] W. Govaerts, "Numerical Methods for Bifurcations of Dynamical Equilibria", SIAM (2000).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ...core.errors import SingularOperator
from .modes import modes_of
from .sliding import SlidingState, factor

Array = NDArray[np.float64]
STEPS = 40  # of Newton's method
DONE = 1e-13  # relative step at which it ends
MODES = 24  # of p = 0 whose pairs are looked at
CHECKED = 1e-3  # relative distance before and beyond a point at which modes are looked at
SAME = 1e-7
EPSILON = float(np.finfo(float).eps)
LARGEST = 1e3  # friction beyond which nothing is looked for
AHEAD = 1.2  # of the last point that is wanted: starts up to there are tried, too
LEAST = 1e-4  # friction from which on the small problem is followed
WALK = 280  # steps of that to LARGEST, in equal ratios
HALVINGS = 8  # of such a step
NARROWED = 14  # halvings around a point where modes meet, before Newton's method


@dataclass(frozen=True)
class Flutter:
    """Two modes meet at a friction mu (the largest of the contacts), with this frequency."""

    mu: float
    frequency: float


def flutter_points(state: SlidingState, count: int, most: int) -> tuple[Flutter, ...]:
    """Frictions at which modes begin to grow, ascending; see the module."""
    state = replace(state, C=None)
    if not state.mu > 0 or not state.F_1.nnz:
        return ()
    known: list[float] = []
    out: list[Flutter] = []
    for l, p in _starts(state, max(count, 2)):
        if len(out) >= most and p > AHEAD * out[most - 1].mu / state.mu:
            break
        point = _newton(state, l, p)
        if point is None or any(abs(point[1] - q) <= SAME * q for q in known):
            continue
        known.append(point[1])
        if _begins(state, *point):
            frequency = float(np.sqrt(point[0]) / (2 * np.pi))
            out.append(Flutter(float(point[1] * state.mu), frequency))
            out.sort(key=lambda each: each.mu)
    return tuple(out[:most])


def divergence_points(state: SlidingState) -> Array:
    """Frictions > 0 at which the stiffness with contact is singular, ascending."""
    if not state.mu > 0 or not state.F_1.nnz:
        return np.zeros(0)
    from scipy.sparse.linalg import LinearOperator, eigs

    K, slope = state.stiffness(0.0), -state.by_friction
    solve = factor(K).solve
    n = state.size
    if n <= 400:
        values = np.linalg.eigvals(solve(slope.toarray()))
    else:
        inverse = LinearOperator((n, n), lambda x: solve(slope @ x), dtype=float)  # type: ignore[call-arg]
        start = np.cos(np.arange(1.0, n + 1.0))
        values = eigs(inverse, k=min(6, n - 2), v0=solve(slope @ start), tol=0,
                      return_eigenvectors=False)  # fmt: skip
    values = np.asarray(values)
    size = np.abs(values).max(initial=0.0)
    real: Any = values[(np.abs(values.imag) <= 1e-9 * np.abs(values)) & (values.real > 0)].real
    real = real[real > max(1 / LARGEST, 1e-12 * size)]
    return np.sort(state.mu / real)


def _starts(state: SlidingState, count: int) -> list[tuple[float, float]]:
    """(l, p) near which two modes meet, ascending in p."""
    still = replace(state, F_1=sparse.csc_array(state.F_1.shape), mu=0.0)
    modes = modes_of(still, min(max(count, MODES), state.K.shape[0]))
    l = -(modes.s**2).real
    phi = modes.shapes.real.copy()
    turned = np.abs(modes.shapes.imag).max(axis=0) > np.abs(phi).max(axis=0)
    phi[:, turned] = modes.shapes.imag[:, turned]
    norm = np.sqrt(np.einsum("nk,nk->k", phi, state.M @ phi))
    keep = norm > 0
    l, phi = l[keep], phi[:, keep] / norm[keep]
    force = state.K @ phi - (state.M @ phi) * l
    F = state.F_0
    weight: Any = sparse.csc_array(F.T @ F)
    rho = factor(weight).solve(F.T @ force)
    P = phi.T @ (state.F_1 @ rho)
    out: list[tuple[float, float]] = []
    for i in range(len(l)):
        for j in range(i + 1, len(l)):
            # (l_i - x - p P_ii)(l_j - x - p P_jj) = p^2 P_ij P_ji
            a, b = l[i] - l[j], P[i, i] - P[j, j]
            for p in np.roots([b * b + 4 * P[i, j] * P[j, i], -2 * a * b, a * a]):
                if abs(p.imag) <= 1e-2 * abs(p) and 0 < p.real < LARGEST / state.mu:
                    x = 0.5 * (l[i] + l[j] - p.real * (P[i, i] + P[j, j]))
                    out.append((float(x), float(p.real)))
    out += _followed(l, P, LEAST / state.mu, LARGEST / state.mu)
    dense = _Small(np.diag(l), P)
    better = [dense.newton(*start) for start in out]
    out = [b if b is not None else a for a, b in zip(out, better, strict=True)]
    unique: list[tuple[float, float]] = []
    for x, p in sorted(out, key=lambda point: point[1]):
        if x > 0 and p > 0 and all(abs(p - q) > 1e-6 * q for _, q in unique):
            unique.append((x, p))
    return unique[: 4 * MODES]


class _Spectrum:
    """Eigenvalues of diag(l) - p P: real ones (k,), ascending, their slopes; complex pairs."""

    def __init__(self, l: Array, P: Array, p: float) -> None:
        self.p = p
        found: Any = linalg.eig(np.diag(l) - p * P, left=True, right=True)
        values, left, right = found
        real = np.flatnonzero(values.imag == 0.0)
        real = real[np.argsort(values.real[real], kind="stable")]
        self.pairs = values[values.imag > 0]
        self.real = values.real[real]
        y, x = left.real[:, real], right.real[:, real]
        size = np.einsum("nk,nk->k", y, x)
        size = np.where(np.abs(size) > EPSILON, size, EPSILON)  # 0 of a double one: steep
        self.slope = -np.einsum("nk,nk->k", y, P @ x) / size

    def may_meet(self, p: float) -> bool:
        """Whether two neighbours, with squared distances linear in p, meet before p."""
        gap, rate = np.diff(self.real), np.diff(self.slope)
        return bool((gap + 2 * rate * (p - self.p) < 0).any())


def _followed(l: Array, P: Array, least: float, largest: float) -> list[tuple[float, float]]:
    """(l, p), p ascending, near which eigenvalues of diag(l) - p P leave the real axis.

    l (k,), P (k, k); p from least to largest.
    """
    out = []
    places = np.geomspace(least, largest, WALK + 1)
    last = _Spectrum(l, P, 0.0)
    for place in places:
        ahead = [(_Spectrum(l, P, float(place)), 0)]
        while ahead:
            there, depth = ahead[-1]
            more = len(there.pairs) - len(last.pairs)
            unclear = more > 1 or (
                more <= 0 and (last.may_meet(there.p) or there.may_meet(last.p))
            )
            if unclear and depth < HALVINGS:
                ahead[-1] = there, depth + 1
                ahead.append((_Spectrum(l, P, 0.5 * (last.p + there.p)), depth + 1))
                continue
            if more > 0:
                before, after = last, there
                for _ in range(NARROWED):
                    between = _Spectrum(l, P, 0.5 * (before.p + after.p))
                    if len(between.pairs) > len(last.pairs):
                        after = between
                    else:
                        before = between
                new = after.pairs[np.argmin(after.pairs.imag)]
                out.append((float(new.real), after.p))
            last = there
            ahead.pop()
    return out


@dataclass(frozen=True, eq=False)
class _Small:
    """(A - p P) - l: the problem of some modes, dense."""

    A: Array
    P: Array

    def newton(self, l: float, p: float) -> tuple[float, float] | None:
        n = len(self.A)

        def solver(l: float, p: float) -> Any:
            return _Dense(self.A - p * self.P - l * np.eye(n))

        return _iterate(solver, lambda x: -x, lambda x: -(self.P @ x),
                        lambda x: -(self.P.T @ x), l, p)  # fmt: skip


class _Dense:
    def __init__(self, Q: Array) -> None:
        left, values, right = np.linalg.svd(Q)
        self.b, self.c = left[:, -1], right[-1]
        whole = np.block([[Q, self.b[:, None]], [self.c[None], np.zeros((1, 1))]])
        self.whole = whole

    def solve(self, b: Array, *, transposed: bool) -> Array:
        found: Any = np.linalg.solve(self.whole.T if transposed else self.whole, b)
        return found


def _newton(state: SlidingState, l: float, p: float) -> tuple[float, float] | None:
    """The point near (l, p) of the whole problem."""
    M, slope = state.wide(state.M), state.by_friction
    n = state.size
    b = c = np.cos(np.arange(1.0, n + 1.0))

    def solver(l: float, p: float) -> Any:
        nonlocal b, c
        made = _Sparse(sparse.csc_array(state.stiffness(p) - l * M), b, c)
        b, c = made.b, made.c
        return made

    products = lambda x: -(M @ x), lambda x: slope @ x, lambda x: slope.T @ x
    return _iterate(solver, *products, l, p)


class _Sparse:
    """The bordered matrix, with borders near the null vectors of Q."""

    def __init__(self, Q: sparse.csc_array, b: Array, c: Array) -> None:
        n = Q.shape[0]
        for _ in range(1 if b is not c else 2):  # the solutions are better borders
            self.b, self.c = b / np.linalg.norm(b), c / np.linalg.norm(c)
            whole = sparse.block_array(
                [[Q, self.b[:, None]], [self.c[None], None]], format="csc"
            )
            self.forward = factor(sparse.csc_array(whole))
            self.backward = factor(sparse.csc_array(whole.T))
            e = np.zeros(n + 1)
            e[n] = 1.0
            c, b = self.forward.solve(e)[:n], self.backward.solve(e)[:n]

    def solve(self, b: Array, *, transposed: bool) -> Array:
        return (self.backward if transposed else self.forward).solve(b)


def _iterate(
    solver: Any, by_l: Any, by_p: Any, by_p_transposed: Any, l: float, p: float
) -> tuple[float, float] | None:
    """Newton's method for g = 0, dg/dl = 0; by_l, by_p: products with derivatives of Q."""
    size = np.inf
    for _ in range(STEPS):
        try:
            system = solver(l, p)
        except (SingularOperator, np.linalg.LinAlgError):
            return None
        n = len(system.b)
        e = np.zeros(n + 1)
        e[n] = 1.0
        x, y = system.solve(e, transposed=False), system.solve(e, transposed=True)
        g, x, y = x[n], x[:n], y[:n]

        def shifted(of: Any, vector: Array, *, transposed: bool, system: Any = system) -> Array:
            right = np.append(-of(vector), 0.0)
            return system.solve(right, transposed=transposed)[: len(vector)]

        x_l, y_l = shifted(by_l, x, transposed=False), shifted(by_l, y, transposed=True)
        x_p, y_p = shifted(by_p, x, transposed=False), shifted(
            by_p_transposed, y, transposed=True
        )
        g_l, g_p = -y @ by_l(x), -y @ by_p(x)
        g_ll = -(y_l @ by_l(x) + y @ by_l(x_l))
        g_lp = -(y_p @ by_l(x) + y @ by_l(x_p))
        J = np.array([[g_l, g_p], [g_ll, g_lp]])
        scale = np.array([max(abs(l), 1e-300), max(abs(p), 1e-300)])
        try:
            step = -np.linalg.solve(J * scale, np.array([g, g_l]))
        except np.linalg.LinAlgError:
            return None
        size = float(np.abs(step).max())
        if not np.isfinite(size):
            return None
        step *= min(1.0, 0.3 / size) if size > 0 else 1.0
        l, p = l * (1 + step[0]), p * (1 + step[1])
        if size <= DONE:
            break
    else:
        if size > 1e-8:  # rounding ends it before DONE
            return None
    return (l, p) if l > 0 and p > 0 else None


def _begins(state: SlidingState, l: float, p: float) -> bool:
    """Whether a mode near sqrt(l) grows beyond p and does not before."""
    near = float(np.sqrt(l) / (2 * np.pi))
    grows = []
    for share in (1 - CHECKED, 1 + CHECKED):
        q = p * share
        there = replace(state, F_1=sparse.csc_array(q * state.F_1), mu=q * state.mu)
        modes = modes_of(there, 4, near)
        close = np.abs(modes.frequency - near) <= 0.2 * near
        grows.append(int((modes.s.real[close] > 1e-6 * np.abs(modes.s[close])).sum()))
    return grows[1] > grows[0]
