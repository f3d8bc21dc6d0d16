"""Examples 3 to 5: tangents and curves by the library, beside the sets of the paper.

They have one contact node at the origin, the obstacle filling x_1 > 0.  The paper's
signs are nu = e_1 into the obstacle and lambda = force on the body; ours are u_N = -u_1,
r_N = -lambda_nu, u_T = u_2, r_T = lambda_tau.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import minimize_scalar

import amontons as am

from .scalar_examples import example1, example2

# a = (lambda + 3 mu) / 2, b = (lambda + mu) / 2 with lambda = 0, mu = 4/3 … any
A, B = 2.0, 1.0
STIFFNESS = np.array([[A, -B], [-B, A]])
H = sparse.csc_array(np.diag([-1.0, 1.0]))  # columns n = -e_1, t = e_2
CLOSE = 1e-12  # difference to a printed set, of size one, that is none
Row = dict[str, Any]


def triangle(
    friction: float, first: Sequence[float], last: Sequence[float],
    slip: Sequence[float] = (0.0, 0.0),
) -> tuple[am.FrictionProblem, am.FrictionProblem]:  # fmt: skip
    """Problem (27): its ends, with loads at p = 0 and 1; slip: -w_2 + (1 - p) V there."""
    one, other = (
        am.FrictionProblem.from_global(
            sparse.csc_array(STIFFNESS), H, np.array(load, dtype=float), [[0.0, w]], [friction]
        )
        for load, w in zip((first, last), slip, strict=True)
    )
    return one, other


def rates(system: am.FirstOrder, row: np.ndarray) -> np.ndarray:
    """(p', u_1', u_2', lambda_nu', lambda_tau') of a direction (y', p') of problem (27)."""
    path = system.problem
    r = path.reaction_rates(row[:-1])[0]
    load = (path.end.f - path.start.f) * row[-1]
    u = np.linalg.solve(STIFFNESS, load + H @ r)
    return np.array([row[-1], *u, -r[0], r[1]])


def off(found: np.ndarray, printed: Sequence[Sequence[float]]) -> float:
    """Distance of a direction of length 1 to the nearest of the printed ones."""
    units = [np.array(x, dtype=float) / np.linalg.norm(x) for x in printed]
    return float(min(np.abs(found / np.linalg.norm(found) - x).max() for x in units))


def example3() -> list[Row]:
    """The memory term keeps the node slipping: one equation instead of a complementarity."""
    F, before, now, next_ = 0.5, 1.0, 1.5, 2.0  # t_{k-1}, t_k, t_{k+1}
    u2 = [t / (A + F * B) for t in (before, now, next_)]
    V = (next_ - now) * (u2[1] - u2[0]) / (now - before)
    rows = []
    for memory in (V, 0.0):
        start, end = triangle(F, (0, now), (0, next_), (-u2[1] + memory, -u2[1]))
        begun: dict[str, Any] = {"base": start, "start": [[B * u2[1], -F * B * u2[1]]]}
        system = am.first_order(end, at=0.0, **begun)
        ahead = next(t for t in system.tangents if t.rate > 0)
        printed = np.array([A + F * B, 0, 1, -B, -F * B]) / [next_ - now, 1, 1, 1, 1]
        branch = am.follow(end, at=0.0, **begun)
        states = [
            [*s.v, -s.r[0, 0], s.r[0, 1]] for s in branch.solutions
        ]  # fmt: skip
        worst = off_the_set(states, now + branch.parameter * (next_ - now), F)
        sets = branch[0].sets
        kind = "slip (one equation)" if 0 in sets.slip else "impending slip (two)"
        slope = off(rates(system, np.append(ahead.direction, ahead.rate)), [printed])
        rows.append({
            "as": "friction problem", "V": memory, "at p = 0": kind,
            "paper": "slip, one equation" if memory else "slip or stick (rate problem)",
            "error of the tangent": slope, "largest error against the paper's set": worst,
            "agrees": max(worst, slope) < 1e-13 and (0 in sets.slip) == (memory > 0),
        })  # fmt: skip
    equation = am.RateEquation(**triangle_in_time(F))
    states = [exact_state(t, F) for t in (before, now)]
    path = am.StepPath(equation, tuple(states), (before, now, next_))
    branch = path.branch(back=0.0, ahead=0.0)
    worst = off_the_set(branch.states, now + branch.parameter * (next_ - now), F)
    rows.append({
        "as": "G(x, x') = F(t, x)", "V": V, "at p = 0": str(branch[0].piece),
        "paper": "one solution for gamma from 0 to 1",
        "largest error against the paper's set": worst, "agrees": worst < 1e-13,
    })  # fmt: skip
    return rows


def exact_state(t: float, F: float) -> np.ndarray:
    """The paper's solution (u_1, u_2, lambda_nu, lambda_tau) at a time."""
    return np.array([0, t, -B * t, -F * B * t]) / (A + F * B)


def off_the_set(states: Any, times: np.ndarray, F: float) -> float:
    """The largest difference to the paper's solutions."""
    return max(float(np.abs(np.array(x) - exact_state(t, F)).max())
               for x, t in zip(states, times, strict=True))  # fmt: skip


def triangle_in_time(F: float) -> dict[str, Any]:
    """The evolution problem of example 3 in (u_1, u_2, lambda_nu, lambda_tau)."""

    def piece(x, rate):
        c, z = x[2] - x[0], x[3] - rate[1]
        return "free" if c >= 0 else "stick" if abs(z) <= -F * c else "+" if z > 0 else "-"

    def slopes(x, rate):
        by_x, by_rate, word = np.zeros((4, 4)), np.zeros((4, 4)), piece(x, rate)
        by_x[:2, :2], by_x[0, 2], by_x[1, 3] = STIFFNESS, -1.0, -1.0
        if word == "free":
            by_x[2, 2] = by_x[3, 3] = 1.0
            return by_x, by_rate
        by_x[2, 0] = 1.0
        if word == "stick":
            by_rate[3, 1] = 1.0
            return by_x, by_rate
        s = 1.0 if word == "+" else -1.0
        by_x[3, [0, 2, 3]] = -s * F, s * F, 1.0
        return by_x, by_rate

    def left(x, rate):
        by_x, by_rate = slopes(x, rate)  # every piece is linear
        return by_x @ x + by_rate @ rate

    return {
        "G": left, "G_slopes": slopes, "G_piece": piece,
        "F": lambda t, x: np.array([0, t, 0, 0]), "F_slope": lambda t, x: np.zeros((4, 4)),
    }  # fmt: skip


def example4() -> list[Row]:
    """Large friction, F = a / b: no tangent for p' > 0, or infinitely many."""
    F = A / B
    start, end = triangle(F, (1, 0), (1, -1))
    slides = [0, 0, 1, -B, F * B]  # (p', u_1', u_2', lambda_nu', lambda_tau')
    against = [-x for x in slides]
    apart = [1, -B / (A**2 - B**2), -A / (A**2 - B**2), 0, 0]
    points = {
        "(i) impending slip": ([[1.0, F]], "p' <= 0 stick, p' = 0 slip",
                               [[-1, 0, 0, 0, -1], against]),
        "(i) slip": ([[0.5, 0.5 * F]], "p' = 0 only, both ways", [slides, against]),
        "(i) grazing with slip": ([[0.0, 0.0]], "p' = 0 slip, p' >= 0 free", [slides, apart]),
    }  # fmt: skip
    rows = [
        _compared(name, am.first_order(end, "load", (0, 2 * F), base=start, start=r, at=F),
                  paper, printed)
        for name, (r, paper, printed) in points.items()
    ]  # fmt: skip
    branch = am.follow(end, base=start, interval=(0.0, 2 * F))
    events = [e for e in branch.events if e.before and e.after]
    rows.append({
        "point": "(i) the curve from 0 to 2 F",
        "tangents": "; ".join(
            f"{e.before} -> {e.after} at {e.parameter:.12g}" for e in events),
        "paper": f"both at F = {F:g}", "off the printed set": max(
            abs(e.parameter - F) for e in events),
        "agrees": len(events) == 2 and all(abs(e.parameter - F) < CLOSE for e in events),
    })  # fmt: skip
    start, end = triangle(F, (0, 0), (B, -A))
    system = am.first_order(end, base=start, start=[[0.0, 0.0]], at=0.0)
    (cone,) = system.cones
    edges = [rates(system, row) for row in cone.edges]
    printed = [[1, 0, 0, -B, A], [1, 0, -1, 0, 0]]  # u_2' = 0 and -p'
    worst = max(off(edge, printed) for edge in edges) if len(edges) == 2 else np.inf
    rows.append({
        "point": "(ii) grazing with impending slip",
        "tangents": f"all between {', '.join(str(np.round(x / x[0], 9) + 0.0) for x in edges)} "
                    f"({cone.piece})",
        "paper": "a continuous branch for every p' > 0: u_2' in [-p', 0]",
        "off the printed set": worst,
        "agrees": worst < CLOSE and not len(cone.lines),
    })  # fmt: skip
    return rows


def _compared(
    name: str, system: am.FirstOrder, paper: str, printed: Sequence[Sequence[float]]
) -> Row:
    """The tangents at a point beside the printed directions."""
    signs = ("p' < 0", "p' = 0", "p' > 0")
    shown = [f"{signs[1 + _sign(t.rate)]} ({t.piece})" for t in system.tangents]
    found = [rates(system, np.append(t.direction, t.rate)) for t in system.tangents]
    worst = max(off(x, printed) for x in found)
    return {
        "point": name, "tangents": ", ".join(shown), "paper": paper,
        "off the printed set": worst,
        "agrees": worst < CLOSE and len(found) == len(printed),
    }  # fmt: skip


def _sign(rate: float) -> int:
    return 0 if abs(rate) < 1e-9 else int(np.sign(rate))


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


def second_fold(F: float, radius: float) -> float:
    """The least p of the branch in slip behind the first fold, by one scalar minimisation.

    On the circle at an angle s, u = r (1 - cos s, -sin s), with lambda_tau = -F lambda_nu the
    component of (27) across nu - F tau gives p.
    """

    def load(s: float) -> float:
        u = radius * np.array([1 - np.cos(s), -np.sin(s)])
        nu, tau = np.array([np.cos(s), np.sin(s)]), np.array([-np.sin(s), np.cos(s)])
        across = tau + F * nu
        force = STIFFNESS @ u - [1.0, 0.0]
        return float(-(across @ force) / across[1])

    return float(minimize_scalar(load, bounds=(0, 1.2), method="bounded",
                                 options={"xatol": 1e-12}).fun)  # fmt: skip


def example5() -> list[Row]:
    """A strongly curved obstacle: two tangents back, none forth."""
    rows = []
    for F, radius in ((0.5, 0.5), (0.5, 10.0)):
        problem = RoundObstacle(F, radius)
        y = np.array([0.0, 0.0, -1.0, F])
        bend = A - B * F - (1 + F**2) / radius
        system = am.first_order(problem, start=y, at=F)
        slip = next(t for t in system.tangents if t.piece != "s")
        expected = np.array([0, -1, B + F / radius, -F * (B + F / radius)]) / bend
        error = float(abs(slip.direction / slip.rate - expected).max())
        branch = am.follow(problem, start=[0.0, 0.0, -1.0, 0.0], at=0.0, interval=(0.0, 0.6))
        folds = [e.parameter for e in branch.folds]
        wanted = [F, second_fold(F, radius)] if bend < 0 else []
        missed = max((abs(x - z) for x, z in zip(folds, wanted, strict=False)), default=0.0)
        rows.append({
            "r": radius, "a - b F - (1 + F^2) / r": bend,
            "tangents": ", ".join(
                f"p' {'><'[t.rate < 0]} 0 ({t.piece})" for t in system.tangents),
            "error of slip / p'": error,
            "folds of the curve": [round(x, 12) for x in folds],
            "off the exact folds": missed,
            "paper": f"two with p' < 0, fold at F = {F}" if bend < 0 else "one each way",
            "agrees": error < CLOSE and len(folds) == len(wanted) and missed < 1e-10,
        })  # fmt: skip
    return rows


EXAMPLES = {"example1": example1, "example2": example2, "example3": example3,
            "example4": example4, "example5": example5}  # fmt: skip
