"""Beams of `modes.py` with their closed forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import Legendre
from scipy import sparse
from scipy.optimize import brentq, minimize_scalar

import amontons as am
from amontons.analysis.stability.modes import DENSE

Array = np.ndarray
DEGREE = 21
COUNTED = 6  # modes of a beam that are compared
RESOLVED, POINTS = 16.0, 6  # waves along a beam, in radians, and points of flutter asked for


def products(given: list[tuple[int, int]], derivative: int) -> Array:
    """Integrals of products of derivatives, by Gauss's rule."""
    x, weight = np.polynomial.legendre.leggauss(DEGREE + 2)
    x, weight = (x + 1) / 2, weight / 2
    values = np.array([values_at(f, derivative, x) for f in given])
    return (values * weight) @ values.T


def values_at(function: tuple[int, int], derivative: int, x: Array) -> Array:
    """Of x^p P_k(2 x - 1) or of its derivative, without powers of x."""
    p, k = function
    z = Legendre.basis(k)
    y = 2 * x - 1
    parts = [z(y), 2 * z.deriv(1)(y), 4 * z.deriv(2)(y)]
    if p == 0:
        return parts[derivative]
    if p == 1:
        return (x * parts[0], parts[0] + x * parts[1], 2 * parts[1] + x * parts[2])[derivative]
    return (x * x * parts[0], 2 * x * parts[0] + x * x * parts[1],
            2 * parts[0] + 4 * x * parts[1] + x * x * parts[2])[derivative]  # fmt: skip


def functions(p: int) -> list[tuple[int, int]]:
    """x^p P_k up to DEGREE: free at 0 (p = 0), held (1), clamped (2)."""
    return [(p, k) for k in range(DEGREE - p + 1)]


def ends(p: int, x: float) -> Array:
    """Their values at an end."""
    return np.array([values_at(f, 0, np.array([x]))[0] for f in functions(p)])


def sliding(K: Array, H: Array, law: Any) -> am.FrictionSolution:
    """Pressed onto the supports, which move along."""
    nc = H.shape[1] // 2
    f = -H[:, ::2].sum(axis=1)
    problem = am.FrictionProblem.from_global(
        sparse.csc_array(K), sparse.csc_array(H), f, [[0.0, 1e3]] * nc, law
    )
    return am.solve(problem, tolerance=1e-12)


def held_along(K: Array, M: Array, columns: list[Array]) -> tuple[Array, Array, Array]:
    """(K, M, H) with one stiff unknown along the beam more, which the supports rub."""
    n, m = len(K), len(columns)
    K, M = (np.pad(x, ((0, 1), (0, 1))) for x in (K, M))
    K[n, n], M[n, n] = 1e6, 1.0
    H = np.zeros((n + 1, 2 * m))
    H[:n, ::2] = np.array(columns).T
    H[n, 1::2] = 1.0
    return K, M, H


def roots(function: Callable[[Any], Any], least: float, largest: float) -> Array:
    """All places where a smooth function changes its sign."""
    x = np.linspace(least, largest, 40_000)
    y = function(x)
    places = np.flatnonzero(np.sign(y[1:]) != np.sign(y[:-1]))
    return np.array([brentq(function, x[k], x[k + 1], xtol=1e-15, rtol=1e-15) for k in places])


def off(found: Array, wanted: Array) -> float:
    """The largest error of the first COUNTED."""
    return float(np.abs(found[:COUNTED] / wanted[:COUNTED] - 1).max())


# ------------------------------------------------------------------------------- beams
def beam_rows() -> list[str]:
    """Beams whose supports do not couple them with anything."""
    clamped = roots(lambda b: np.sin(b) - np.tanh(b) * np.cos(b), 1, 24)
    out = [
        beam_row("two supports", 0, (0.0, 1.0), None, (np.pi * np.arange(1, COUNTED + 1)) ** 2),
        beam_row("clamped and supported", 2, (1.0,), None, clamped**2),
    ]
    for k in (1.0, 50.0, 1e4):
        on_spring = roots(lambda b, k=k: spring(b, k), 0.5, 24)
        out.append(beam_row(f"clamped, support of stiffness {k:g}", 2, (1.0,), k, on_spring**2))
    return out


def spring(b: Any, k: float) -> Any:
    """Zero for a clamped beam on a spring of stiffness k, over cosh b."""
    return b**3 * (1 / np.cosh(b) + np.cos(b)) + k * (np.sin(b) - np.cos(b) * np.tanh(b))


def beam_row(
    name: str, p: int, places: tuple[float, ...], k: float | None, wanted: Array
) -> str:
    """Modes with friction, and with damping where that is known too; k: of the support."""
    K, M, H = held_along(
        products(functions(p), 2), products(functions(p), 0), [ends(p, x) for x in places]
    )
    friction: Any = am.Coulomb([0.3] * len(places))
    law = friction if k is None else am.Compliant(friction, [1 / k] * len(places))
    found = sliding(K, H, law)
    plain = am.modes(found, COUNTED, mass=sparse.csc_array(M))
    with_damping = "not known"
    if k is None:
        a, b = 0.3, 1e-4
        damped = am.modes(found, COUNTED, mass=sparse.csc_array(M),
                          damping=sparse.csc_array(a * M + b * K))  # fmt: skip
        half = (a + b * wanted[:COUNTED] ** 2) / 2
        s = -half + 1j * np.sqrt(wanted[:COUNTED] ** 2 - half**2)
        with_damping = f"{np.abs(damped.s / s - 1).max():.0e}"
    return f"| {name} | {COUNTED} | {off(plain.s.imag, wanted):.0e} | {with_damping} |"


# ------------------------------------------------------------------- inclined support
def receptances(omega: Any, e: float) -> tuple[Any, Any]:
    """(G_w, G_u)."""
    b, g = np.sqrt(omega), omega / np.sqrt(e)
    above = np.sin(b) - np.cos(b) * np.tanh(b)
    return above / (b**3 * (1 / np.cosh(b) + np.cos(b))), np.tan(g) / (g * e)


def friction_at(omega: Any, normal: tuple[float, float], e: float) -> Any:
    """(2)."""
    a, b = normal
    G_w, G_u = receptances(omega, e)
    return (a * a * G_w + b * b * G_u) / (a * b * (G_w - G_u))


def without_poles(omega: Any, mu: float, normal: tuple[float, float], e: float) -> Any:
    """Zero at the frequencies of a friction."""
    a, b = normal
    x, g = np.sqrt(omega), omega / np.sqrt(e)
    N_w, D_w = np.sin(x) - np.cos(x) * np.tanh(x), x**3 * (1 / np.cosh(x) + np.cos(x))
    N_u, D_u = np.sin(g), g * e * np.cos(g)
    return (a * a - mu * a * b) * N_w * D_u + (b * b + mu * a * b) * N_u * D_w


def inclined_rows() -> list[str]:
    """Several inclinations, either way, and stiffnesses along the beam."""
    cases = (20, 30.0), (20, 400.0), (45, 30.0), (70, 30.0), (-30, 30.0), (-60, 400.0)
    return [inclined_row(degrees, e) for degrees, e in cases]


def inclined_row(degrees: float, e: float) -> str:
    """Frequencies at three frictions, flutter and divergence."""
    normal = (float(np.cos(np.radians(degrees))), float(np.sin(np.radians(degrees))))
    K = sparse.block_diag([products(functions(2), 2), e * products(functions(1), 1)]).toarray()
    M = sparse.block_diag([products(functions(2), 0), products(functions(1), 0)]).toarray()
    w, u = ends(2, 1.0), ends(1, 1.0)
    axes = normal, (normal[1], -normal[0])
    H = np.array([np.concatenate([x * w, y * u]) for x, y in axes]).T

    def at(mu: float) -> am.Modes:
        found = sliding(K, H, am.Coulomb([mu]))
        return am.modes(found, COUNTED, mass=sparse.csc_array(M))

    worst, frictions = 0.0, (0.1, 0.3, 0.6)
    for mu in frictions:
        wanted = roots(lambda x, mu=mu: without_poles(x, mu, normal, e), 0.5, 2000)
        found = at(mu)
        steady = np.abs(found.s.real) <= 1e-9 * np.abs(found.s)
        near = np.abs(found.s.imag[steady][:, None] / wanted - 1).min(axis=1)
        worst = max(worst, float(near.max(initial=0.0)))
        count = min(int(steady.sum()), COUNTED)
        missed = [x for x in wanted[:count] if x < found.s.imag[steady].max() * 0.999
                  and np.abs(found.s.imag[steady] / x - 1).min() > 1e-6]  # fmt: skip
        worst = np.inf if missed else worst
    a, b = normal
    divergence = (a * a / 3 + b * b / e) / (a * b * (1 / 3 - 1 / e))
    told = at(0.3).divergence
    last = "none, rightly" if divergence < 0 and not len(told) else (
        f"{np.abs(told / divergence - 1).min():.0e}" if len(told) else "missed")  # fmt: skip
    most = RESOLVED * min(RESOLVED, float(np.sqrt(e)))
    points = [(p.mu, p.frequency * 2 * np.pi) for p in at(0.3).flutter(POINTS)]
    reach = points[-1][0] if len(points) == POINTS else np.inf
    points = [one for one in points if one[1] < most]
    reach = min(reach * (1 + 1e-9), 1e2)
    wanted = [one for one in meetings(normal, e, most) if one[0] <= reach]
    apart = [f"{len(wanted)}, {len(points)} told", ""]
    if len(points) == len(wanted):
        near = np.abs(np.array(points) / np.array(wanted) - 1) if wanted else np.zeros((1, 2))
        apart = [f"{x:.0e}" for x in near.max(axis=0)]
    at_these = ", ".join(f"{one[0]:.6g}" for one in wanted)
    return (f"| {degrees} | {e:g} | {len(frictions)} | {worst:.0e} | {at_these} | {apart[0]} | "
            f"{apart[1]} | {last} |")  # fmt: skip


def meetings(normal: tuple[float, float], e: float, most: float) -> list[tuple[float, float]]:
    """(friction, omega) of all maxima > 0 of (2) below a frequency, by friction."""
    x = np.linspace(0.5, most, 400_000)
    y = friction_at(x, normal, e)
    top = (y[1:-1] > 0) & (y[1:-1] >= y[:-2]) & (y[1:-1] > y[2:])
    top &= np.abs(y[2:] - y[:-2]) < 1e-2 * y[1:-1]  # no poles
    out = []
    for k in 1 + np.flatnonzero(top):
        around = float(x[k - 1]), float(x[k + 1])
        found = minimize_scalar(lambda v: -friction_at(v, normal, e), bounds=around,
                                method="bounded", options={"xatol": 1e-12})  # fmt: skip
        out.append((float(friction_at(found.x, normal, e)), float(found.x)))
    return sorted(out)


# ---------------------------------------------------------------------------- elements
def element_rows() -> list[str]:
    """Few and many elements."""
    return [element_row(n) for n in (20, 60, 100, 190, 300)]


def element_row(n: int) -> str:
    """Cubic elements, as many as lie on the beam."""
    h = 1 / n
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])
    K, M = np.zeros((2, 2 * n + 2, 2 * n + 2))
    for i in range(n):
        part = slice(2 * i, 2 * i + 4)
        K[part, part] += k
        M[part, part] += m * h / 420
    one = np.eye(2 * n + 2)
    K, M, H = held_along(K, M, [one[0], one[2 * n]])
    modes = am.modes(sliding(K, H, am.Coulomb([0.3] * 2)), 4, mass=sparse.csc_array(M))
    found = modes.s.imag
    discrete = np.array([discrete_frequency(j, n) for j in range(1, 5)])
    exact = (np.pi * np.arange(1, 5)) ** 2
    beam = np.abs(found / exact - 1)
    system = "whole" if len(K) <= DENSE else "sparse"
    condition = 8400 * n**4 / np.pi**4 * np.finfo(float).eps
    return (f"| {n} | {system} | {np.abs(found / discrete - 1).max():.0e} | {beam[0]:.0e}, "
            f"{beam[1]:.0e} | {condition:.0e} |")  # fmt: skip


def discrete_frequency(j: int, n: int) -> float:
    """Of w = A sin(i p), slope B cos(i p) at the nodes i, p = j pi / n: of two by two.

    The differences of K cancel to the fourth power of p: numbers of more digits.
    """
    p, h = np.longdouble(j) * np.arccos(np.longdouble(-1)) / n, np.longdouble(1) / n
    c, s = np.cos(p), np.sin(p)
    a, b, d = 24 * (1 - c) / h**3, -12 * s / h**2, (8 + 4 * c) / h
    A, B, D = (312 + 108 * c) * h / 420, 26 * s * h**2 / 420, (8 - 6 * c) * h**3 / 420
    two, one, none = A * D - B * B, a * D + d * A - 2 * b * B, a * d - b * b
    return float(np.sqrt(2 * none / (one + np.sqrt(one**2 - 4 * two * none))))
