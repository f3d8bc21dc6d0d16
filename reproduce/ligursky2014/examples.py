"""Examples 1 to 5: tangents and curves by the library, beside the sets of the paper.

Example 3 to 5 have one contact node at the origin, the obstacle filling x_1 > 0.  The paper's
signs are nu = e_1 into the obstacle and lambda = force on the body; ours are u_N = -u_1,
r_N = -lambda_nu, u_T = u_2, r_T = lambda_tau.
"""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy import sparse

import amontons as am
from amontons.analysis.paths.continuation import Continuation
from amontons.analysis.paths.first_order import first_order
from amontons.analysis.paths.following import Limits, continue_both
from amontons.analysis.paths.friction_path import FrictionPath
from amontons.analysis.paths.path import EventKind

A, B = (
    2.0,
    1.0,
)  # a = (lambda + 3 mu) / 2, b = (lambda + mu) / 2 with lambda = 0, mu = 4/3 … any
H = sparse.csc_array(np.diag([-1.0, 1.0]))  # columns n = -e_1, t = e_2
Row = dict[str, Any]


class Quadrants:
    """A scalar function given on the four quadrants of (p, y): example 1."""

    def __init__(self, functions: dict[tuple[int, int], Any]) -> None:
        self.functions = functions  # (sign of p, sign of y) -> function and derivatives

    def piece(self, y, p):
        """The quadrant, (sign of p, sign of y)."""
        return (1 if p >= 0 else -1, 1 if y[0] >= 0 else -1)

    def pieces(self, y, p, tolerance):
        """All quadrants that touch a point."""
        return [
            (i, j) for i, j in product((-1, 1), (-1, 1))
            if i * p >= -tolerance and j * y[0] >= -tolerance
        ]  # fmt: skip

    def residual_of(self, q, y, p):
        """The selection function of a quadrant."""
        return np.array([self.functions[q](y[0], p)[0]])

    def jacobian_of(self, q, y, p):
        """Its derivatives."""
        _, by_y, by_p = self.functions[q](y[0], p)
        return np.array([[by_y]]), np.array([by_p])

    def margins(self, q, y, p):
        """Positive inside of a quadrant."""
        return np.array([q[0] * p, q[1] * y[0]])

    def residual(self, y, p):
        """The function."""
        return self.residual_of(self.piece(y, p), y, p)

    def jacobian(self, y, p):
        """The derivatives of the active selection function."""
        return self.jacobian_of(self.piece(y, p), y, p)


G1 = Quadrants({
    (-1, -1): lambda x, p: (-x + p, -1.0, 1.0), (1, -1): lambda x, p: (-x + p**2, -1.0, 2 * p),
    (1, 1): lambda x, p: (x + p**2, 1.0, 2 * p), (-1, 1): lambda x, p: (x + p, 1.0, 1.0),
})  # fmt: skip
H1 = Quadrants({
    (-1, -1): lambda x, p: (x + p**2, 1.0, 2 * p), (1, -1): lambda x, p: (x, 1.0, 0.0),
    (1, 1): lambda x, p: (-x, -1.0, 0.0), (-1, 1): lambda x, p: (-x + p**2, -1.0, 2 * p),
})  # fmt: skip


def branches_on_circle(problem: Quadrants, radius: float = 1e-2, points: int = 4001) -> list:
    """Directions (p, y) in which zeros lie on a small circle: what really leaves the origin."""
    angles = np.linspace(-np.pi, np.pi, points) + 1e-9
    values = [
        problem.residual(np.array([radius * np.sin(a)]), radius * np.cos(a))[0] for a in angles
    ]
    found = [
        (round(float(np.cos(a)), 1) + 0.0, round(float(np.sin(a)), 1) + 0.0, a > 0)
        for (a, u), (_, v) in pairwise(zip(angles, values, strict=True))
        if u * v < 0 or abs(u) < 1e-9
    ]
    return [[p, y] for p, y, _ in dict.fromkeys(found)]  # once, above and below the axis


def example1() -> list[Row]:
    """First order alone decides neither existence nor number of branches."""
    rows = []
    for name, problem, expected in (("G", G1, "(1, 0): none"),
                                    ("H", H1, "(1, 0): one, (-1, 0): two")):  # fmt: skip
        system = first_order(problem, np.zeros(1), 0.0)
        tangents = [
            f"({t.rate:+.0f}, {t.direction[0]:+.0f})" + " not strict" * (not t.strict)
            for t in system.tangents
        ]
        rows.append({
            "function": name, "null directions (p', x')": ", ".join(tangents),
            "zeros around the origin (p, x)": str(branches_on_circle(problem)),
            "paper, along": expected,
        })  # fmt: skip
    return rows


class Pitchfork:
    """x (x^2 - p): example 2."""

    def residual(self, y, p):
        """The function."""
        return y * (y**2 - p)

    def jacobian(self, y, p):
        """Its derivatives."""
        return np.diag(3 * y**2 - p), -y

    def piece(self, y, p):
        """One piece."""
        return "all"


def example2() -> list[Row]:
    """A smooth bifurcation, where the gradient vanishes."""
    limits = Limits((-1.0, 1.0))
    trivial = continue_both(Pitchfork(), np.zeros(1), -1.0, limits)
    (event,) = [e for e in trivial.events if e.kind is EventKind.BRANCH]
    other = continue_both(Pitchfork(), np.ones(1), 1.0, limits)
    error = max(abs(x.state[0] ** 2 - x.parameter) for x in other)
    fold = [e.parameter for e in other.folds]
    return [
        {"curve": "x = 0", "branch point at": event.parameter,
         "one-sided branches there": len(event.directions),
         "paper": "two curves cross in (0, 0)"},
        {"curve": "x^2 = p", "largest |x^2 - p|": error, "turns at": fold[0], "paper": "0"},
    ]  # fmt: skip


def triangle(
    friction: float, first: tuple[float, float], last: tuple[float, float],
    slip: tuple[float, float] = (0.0, 0.0),
) -> FrictionPath:  # fmt: skip
    """Problem (27): loads at p = 0 and 1; slip: -w_2 + (1 - p) V there."""
    M = sparse.csc_array([[A, -B], [-B, A]])
    return FrictionPath(*(
        am.FrictionProblem.from_global(M, H, load, [[0.0, w]], [friction])
        for load, w in zip((first, last), slip, strict=True)
    ))  # fmt: skip


def paper_state(path: FrictionPath, y: np.ndarray, p: float) -> np.ndarray:
    """(u_1, u_2, lambda_nu, lambda_tau)."""
    solution = path.solution(y, p)
    return np.array([*solution.v, -solution.r[0, 0], solution.r[0, 1]])


def example3() -> list[Row]:
    """The memory term keeps the node slipping: one equation instead of a complementarity."""
    F, before, now, next_ = 0.5, 1.0, 1.5, 2.0  # t_{k-1}, t_k, t_{k+1}
    u2 = [t / (A + F * B) for t in (before, now, next_)]
    V = (next_ - now) * (u2[1] - u2[0]) / (now - before)
    rows = []
    for memory in (V, 0.0):
        path = triangle(F, (0, now), (0, next_), (-u2[1] + memory, -u2[1]))
        y = path.state([[B * u2[1], -F * B * u2[1]]])
        branch = continue_both(path, y, 0.0, Limits((0.0, 1.0)))
        worst = 0.0
        for point in branch:
            t = now + point.parameter * (next_ - now)
            exact = np.array([0, t, -B * t, -F * B * t]) / (A + F * B)
            worst = max(
                worst, abs(paper_state(path, point.state, point.parameter) - exact).max()
            )
        rows.append({
            "V": memory, "pieces at p = 0": path.choices(y, 0.0, 1e-10)[0],
            "largest error against the paper's set": worst,
        })  # fmt: skip
    return rows


def example4() -> list[Row]:
    """Large friction, F = a / b: no tangent for p' > 0, or infinitely many."""
    F = A / B
    path = triangle(F, (1, 0), (1, -1))
    rows = []
    at_force = {
        "impending slip": (0.0, [-1.0, F]), "slip": (-0.5 / B, [-0.5, 0.5 * F]),
        "grazing with slip": (-1 / B, [0.0, 0.0]),
    }  # fmt: skip
    for name, (_, (nu, tau)) in at_force.items():
        y = path.state([[-nu, tau]])
        system = first_order(path, y, F, tolerance=1e-10)
        shown = ", ".join(f"p' {'=' if abs(t.rate) < 1e-9 else '><'[t.rate < 0]} 0 ({t.piece})"
                          for t in system.tangents)  # fmt: skip
        rows.append({"point": name, "tangents": shown})
    rows[0]["paper"] = "p' <= 0 stick, p' = 0 slip"
    rows[1]["paper"] = "p' = 0 only, both ways"
    rows[2]["paper"] = "p' = 0 slip, p' >= 0 free"
    branch = am.follow(path.end, base=path.start, interval=(0.0, 2 * F))
    events = [
        f"{e.before} -> {e.after} at {e.parameter:.12g}" for e in branch.events if e.after
    ]
    rows.append({"point": "the curve from 0 to 2 F", "tangents": "; ".join(events),
                 "paper": f"both at F = {F:g}"})  # fmt: skip
    second = triangle(F, (0, 0), (B, -A))
    system = first_order(second, np.zeros(2), 0.0, tolerance=1e-10)
    rows.append({"point": "(ii) grazing with impending slip",
                 "tangents": f"sets on {', '.join(map(str, system.sets))}",
                 "paper": "a continuous branch for every p' > 0"})  # fmt: skip
    return rows


class RoundObstacle:
    """Example 5: unknowns (u_1, u_2, lambda_nu, lambda_tau), a disc of radius r as obstacle."""

    weight = 0.25

    def __init__(self, friction: float, radius: float) -> None:
        self.F, self.r = friction, radius

    def _geometry(self, u):
        d = np.array([u[0] - self.r, u[1]])
        size = np.linalg.norm(d)
        nu, tau = -d / size, np.array([d[1], -d[0]]) / size
        across = (np.eye(2) - np.outer(d, d) / size**2) / size
        return self.r - size, nu, tau, -across, np.array([[0, 1], [-1, 0]]) @ across

    def piece(self, y, p):
        """f, s, + or -: by lambda_nu - g and lambda_tau - v."""
        g, _, tau, *_ = self._geometry(y[:2])
        c, t = y[2] - g, y[3] - tau @ y[:2]
        if c >= 0:
            return "f"
        return "s" if abs(t) <= -self.F * c else ("-" if t > 0 else "+")

    def pieces(self, y, p, tolerance):
        """All that meet near a point."""
        return [q for q in "fs+-" if self.margins(q, y, p).min() >= -tolerance]

    def margins(self, q, y, p):
        """Positive inside of a piece."""
        g, _, tau, *_ = self._geometry(y[:2])
        c, t = y[2] - g, y[3] - tau @ y[:2]
        return np.array({
            "f": [c], "s": [-c, -self.F * c - t, -self.F * c + t],
            "-": [-c, t + self.F * c], "+": [-c, -t + self.F * c],
        }[q])  # fmt: skip

    def residual_of(self, q, y, p):
        """Equilibrium, normal and tangential law on a piece."""
        g, nu, tau, *_ = self._geometry(y[:2])
        force = np.array([A * y[0] - B * y[1] - 1, -B * y[0] + A * y[1] + p])
        slip = y[3] - {"-": -1, "+": 1}.get(q, 0) * self.F * (y[2] - g)
        law = {"f": (y[2], y[3]), "s": (g, tau @ y[:2])}.get(q, (g, slip))
        return np.array([*(force - y[2] * nu - y[3] * tau), *law])

    def jacobian_of(self, q, y, p):
        """Its derivatives."""
        g, nu, tau, dnu, dtau = self._geometry(y[:2])
        J = np.zeros((4, 4))
        J[:2, :2] = np.array([[A, -B], [-B, A]]) - y[2] * dnu - y[3] * dtau
        J[:2, 2], J[:2, 3] = -nu, -tau
        if q == "f":
            J[2, 2] = J[3, 3] = 1
        else:
            J[2, :2] = nu  # g = r - |x - centre|
            if q == "s":
                J[3, :2] = tau + dtau.T @ y[:2]
            else:
                s = -1 if q == "-" else 1
                J[3, 3], J[3, 2], J[3, :2] = 1, -s * self.F, s * self.F * nu
        return J, np.array([0.0, 1.0, 0.0, 0.0])

    def residual(self, y, p):
        """The function."""
        return self.residual_of(self.piece(y, p), y, p)

    def jacobian(self, y, p):
        """The derivatives of the active selection function."""
        return self.jacobian_of(self.piece(y, p), y, p)


def example5() -> list[Row]:
    """A strongly curved obstacle: two tangents back, none forth."""
    rows = []
    for F, radius in ((0.5, 0.5), (0.5, 10.0)):
        problem = RoundObstacle(F, radius)
        y = np.array([0.0, 0.0, -1.0, F])
        bend = A - B * F - (1 + F**2) / radius
        system = first_order(problem, y, F, tolerance=1e-9)
        slip = next(t for t in system.tangents if t.piece != "s")
        expected = np.array([0, -1, B + F / radius, -F * (B + F / radius)]) / bend
        ratio = slip.direction / slip.rate
        branch = continue_both(
            problem, np.array([0.0, 0.0, -1.0, 0.0]), 0.0, Limits((0.0, 0.6)), Continuation()
        )
        rows.append({
            "r": radius, "a - b F - (1 + F^2) / r": bend,
            "tangents": ", ".join(
                f"p' {'><'[t.rate < 0]} 0 ({t.piece})" for t in system.tangents),
            "error of slip / p'": float(abs(ratio - expected).max()),
            "folds of the curve": [round(e.parameter, 12) for e in branch.folds],
            "paper": f"two with p' < 0, fold at F = {F}" if bend < 0 else "one each way",
        })  # fmt: skip
    return rows


EXAMPLES = {"example1": example1, "example2": example2, "example3": example3,
            "example4": example4, "example5": example5}  # fmt: skip
