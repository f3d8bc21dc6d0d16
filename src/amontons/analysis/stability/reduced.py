"""The problem of some modes, dense: where in it modes meet is where the whole is looked at.

Modes phi_i of p = 0 with l_i = -s_i^2 and forces rho_i of the contacts (K phi - F_0 rho =
l M phi).  Under friction p F_1 r, with v = phi a + what the other modes give,

    l_i a_i - p (phi_i^T F_1) r = l a_i,       (1 - p G) r = rho a,                          (1)
    G = R(l_c) - sum_i rho_i phi_i^T F_1 / (l_i - l_c),

R(l_c) F the forces of the contacts by which the body, shaken at l_c, answers a force F: the
friction changes the pressure that it follows also where no mode kept moves.  So A(p) = diag(l)
- p phi^T F_1 (1 - p G)^-1 rho is exact with all modes, whatever l_c, and else what is left
out of the other modes is their inertia beyond that at l_c (static correction, or mode
acceleration: R. R. Craig, A. J. Kurdila, "Fundamentals of Structural Dynamics" (2006)).
Without G, friction at which modes meet is wrong by parts of itself, and Newton's method of the
whole ends elsewhere or nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ...core.errors import SingularOperator
from .bordered import Point, iterate, same
from .modes import modes_of
from .sliding import SlidingState, factor

Array = NDArray[np.float64]
MODES = 24  # of p = 0 that are kept
FORCES = 100  # sliding contacts up to which G is formed: a solve of its size at every step
TRUSTED = 0.25  # part of the largest l: half the frequency, as in component mode synthesis
INDEPENDENT = 1e-6  # part of a mode, squared, that those before do not have
EPSILON = float(np.finfo(float).eps)
ROUNDED = 1e-11  # imaginary part, relative to the largest eigenvalue, that rounding makes
LEAST = 1e-4  # friction from which on A(p) is followed
LARGEST = 1e3  # friction beyond which nothing is looked for
WALK = 700  # steps of that to LARGEST, in equal ratios
HALVINGS = 8  # of such a step
NARROWED = 14  # halvings around a point where modes meet, before Newton's method
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Reduced:
    """(1): l (k,), phi (n, k), force (k, m) = phi^T F_1, rho (m, k), G (m, m)."""

    l: Array
    phi: Array
    force: Array
    rho: Array
    G: Array
    reach: float  # l up to which it is to be trusted
    every: bool  # no mode is left out

    @classmethod
    def of(cls, state: SlidingState, count: int) -> Reduced:
        """With the slowest modes without friction."""
        still = replace(state, F_1=sparse.csc_array(state.F_1.shape), mu=0.0)
        modes = modes_of(still, min(max(count, MODES), state.K.shape[0]))
        l = -(modes.s**2).real
        phi = modes.shapes.real.copy()
        turned = np.abs(modes.shapes.imag).max(axis=0) > np.abs(phi).max(axis=0)
        phi[:, turned] = modes.shapes.imag[:, turned]
        l, phi = _normal(l, phi, state.M)
        force = state.K @ phi - (state.M @ phi) * l
        F = state.F_0
        weight: Any = sparse.csc_array(F.T @ F)
        columns = np.flatnonzero(np.diff(state.F_1.indptr))
        rho = np.asarray(factor(weight).solve(F.T @ force))[columns]
        F_1 = np.asarray((state.F_1[:, columns]).toarray())
        along = phi.T @ F_1
        G = _left_out(state, F_1, columns, l, along, rho)
        every = len(l) >= state.K.shape[0] - state.F_0.shape[1]  # some may give way
        top = float(l.max(initial=0.0))
        return cls(l, phi, along, rho, G, (LARGEST if every else TRUSTED) * top, every)

    def matrix(self, p: float) -> Array:
        """A(p) (k, k)."""
        return np.diag(self.l) - p * self.force @ self._pressure(p, self.rho)

    def slope(self, p: float) -> Array:
        """Its derivative."""
        return -self.force @ self._pressure(p, self._pressure(p, self.rho))

    def _pressure(self, p: float, of: Array) -> Array:
        if not self.G.any():
            return of
        found: Any = np.linalg.solve(np.eye(len(self.G)) - p * self.G, of)
        return found

    def pair(self, l: float, p: float) -> tuple[Array, Array]:
        """Motions (n, 2) of the two modes next to l, right and left ones."""
        out = []
        for A in (self.matrix(p), self.matrix(p).T):
            values, vectors = np.linalg.eig(A)
            near = vectors[:, np.argsort(np.abs(values - l), kind="stable")[:2]]
            both = np.hstack([near.real, near.imag])
            out.append(self.phi @ np.linalg.svd(both)[0][:, :2])
        return out[0], out[1]

    def newton(self, l: float, p: float) -> Point | None:
        """The point of A near (l, p)."""
        n, at = len(self.l), p

        def solver(l: float, p: float) -> Any:
            nonlocal at
            at = p
            return _Dense(self.matrix(p) - l * np.eye(n))

        return iterate(solver, lambda x: -x, lambda x: self.slope(at) @ x,
                       lambda x: self.slope(at).T @ x, l, p)  # fmt: skip


def _normal(l: Array, phi: Array, M: Any) -> tuple[Array, Array]:
    """Modes with phi^T M phi = 1, those that others contain left out."""
    kept: list[int] = []
    basis = np.zeros((len(phi), 0))
    for k in range(len(l)):
        x = phi[:, k]
        size = float(x @ (M @ x))
        for _ in range(2):
            x = x - basis @ (basis.T @ (M @ x))
        rest = float(x @ (M @ x))
        if size > 0 and rest > INDEPENDENT * size:
            basis = np.column_stack([basis, x / np.sqrt(rest)])
            kept.append(k)
    return l[kept], basis


def _left_out(
    state: SlidingState, F_1: Array, columns: Any, l: Array, along: Array, rho: Array
) -> Array:
    """G of (1); zero for more contacts than FORCES."""
    m = len(columns)
    shaken = -1e-3 * float(np.abs(l).max(initial=0.0))
    if m > FORCES or not shaken:
        return np.zeros((m, m))
    whole = state.stiffness(0.0) - shaken * state.wide(state.M)
    right = np.vstack([F_1, np.zeros((state.B.shape[0], m))])
    try:
        found = np.asarray(factor(sparse.csc_array(whole)).solve(right))
    except SingularOperator:
        return np.zeros((m, m))
    answer = state.scale * found[state.K.shape[0] :][columns]
    return answer - (rho / (l - shaken)) @ along


def starts(of: Reduced, mu: float) -> list[Point]:
    """Points of A(p) at which modes begin to grow, p ascending.

    Looked for where A(p), followed, has more complex eigenvalues than before, and where pairs
    of modes would meet alone: steps may hide that two meet while two others part.
    """
    l, P = of.l, of.force @ of.rho
    pairs: list[tuple[float, float]] = []
    for i in range(len(l)):
        for j in range(i + 1, len(l)):
            # (l_i - x - p P_ii)(l_j - x - p P_jj) = p^2 P_ij P_ji
            a, b = l[i] - l[j], P[i, i] - P[j, j]
            for p in np.roots([b * b + 4 * P[i, j] * P[j, i], -2 * a * b, a * a]):
                if abs(p.imag) <= 1e-2 * abs(p) and 0 < p.real < LARGEST / mu:
                    x = 0.5 * (l[i] + l[j] - p.real * (P[i, i] + P[j, j]))
                    pairs.append((float(x), float(p.real)))
    found = [of.newton(*one) or Point(*one, True) for one in
             _followed(of, LEAST / mu, LARGEST / mu)]  # fmt: skip
    pairs.sort(key=lambda point: point[1])
    better = [of.newton(*one) for one in pairs[: 4 * MODES]]
    found += [one for one in better if one is not None and one.p < LARGEST / mu]
    out: list[Point] = []
    for one in found:
        if one.begins and one.p > 0 and 0 < one.l <= of.reach and not any(
            same(one, other, SAME) for other in out
        ):  # fmt: skip
            out.append(one)
    return sorted(out, key=lambda point: point.p)


class _Spectrum:
    """Eigenvalues of A(p): real ones (k,), ascending, their slopes; complex pairs."""

    def __init__(self, of: Reduced, p: float) -> None:
        self.p = p
        found: Any = linalg.eig(of.matrix(p), left=True, right=True)
        values, left, right = found
        noise = ROUNDED * np.abs(values).max(initial=0.0)  # splits double ones
        real = np.flatnonzero(np.abs(values.imag) <= noise)
        real = real[np.argsort(values.real[real], kind="stable")]
        turning = values.imag > noise
        self.pairs = values[turning]
        self.real = values.real[real]
        y, x = left.real[:, real], right.real[:, real]
        size = np.einsum("nk,nk->k", y, x)
        size = np.where(np.abs(size) > EPSILON, size, EPSILON)  # 0 of a double one: steep
        self.slope = np.einsum("nk,nk->k", y, of.slope(p) @ x) / size

        y, x = left[:, turning].conj(), right[:, turning]
        size = np.einsum("nk,nk->k", y, x)
        size = np.where(np.abs(size) > EPSILON, size, EPSILON)
        self.turn = (np.einsum("nk,nk->k", y, of.slope(p) @ x) / size).imag

    def may_meet(self, p: float) -> bool:
        """Whether two neighbours or a pair, squared distances linear in p, meet before p."""
        gap = np.concatenate([np.diff(self.real), self.pairs.imag])
        rate = np.concatenate([np.diff(self.slope), self.turn])
        return bool((gap + 2 * rate * (p - self.p) < 0).any())


def _followed(of: Reduced, least: float, largest: float) -> list[tuple[float, float]]:
    """(l, p), p from least to largest, near which eigenvalues of A(p) leave the real axis."""
    out = []
    places = np.geomspace(least, largest, WALK + 1)
    last = _Spectrum(of, 0.0)
    for place in places:
        ahead = [(_Spectrum(of, float(place)), 0)]
        while ahead:
            there, depth = ahead[-1]
            more = len(there.pairs) - len(last.pairs)
            unclear = more > 1 or (
                more <= 0 and (last.may_meet(there.p) or there.may_meet(last.p))
            )
            if unclear and depth < HALVINGS:
                ahead[-1] = there, depth + 1
                ahead.append((_Spectrum(of, 0.5 * (last.p + there.p)), depth + 1))
                continue
            if more > 0:
                before, after = last, there
                for _ in range(NARROWED):
                    between = _Spectrum(of, 0.5 * (before.p + after.p))
                    if len(between.pairs) > len(last.pairs):
                        after = between
                    else:
                        before = between
                new = after.pairs[np.argmin(after.pairs.imag)]
                out.append((float(new.real), after.p))
            last = there
            ahead.pop()
    return out


class _Dense:
    def __init__(self, Q: Array) -> None:
        left, values, right = np.linalg.svd(Q)
        self.b, self.c = left[:, -1], right[-1]
        whole = np.block([[Q, self.b[:, None]], [self.c[None], np.zeros((1, 1))]])
        self.whole = whole

    def solve(self, b: Array, *, transposed: bool) -> Array:
        found: Any = np.linalg.solve(self.whole.T if transposed else self.whole, b)
        return found
