"""Examples 1 and 2: scalar functions of two variables whose zeros meet in the origin."""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any

import numpy as np

import amontons as am

CLOSE = 1e-12  # distance to what is printed, of size one, that is none
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
    """First order alone decides neither existence nor number of branches; curves do."""
    rows = []
    printed = {"G": ("none along (1, 0)", [[-1, -1], [-1, 1]], am.EventKind.FOLD),
               "H": ("one along (1, 0), two along (-1, 0)", [[-1, 0], [-1, 0], [1, 0]],
                     am.EventKind.BRANCH)}  # fmt: skip
    for name, problem in (("G", G1), ("H", H1)):
        words, directions, kind = printed[name]
        tangents = am.first_order(problem, start=[0.0], at=0.0, interval=(-1, 1)).tangents
        found = sorted([round(t.rate), round(float(t.direction[0]) / abs(t.rate))]
                       for t in tangents)  # fmt: skip
        branch = am.follow(problem, start=[-1.0], at=-1.0, interval=(-1.0, 1.0))
        (event,) = branch.events[1:-1]
        rows.append({
            "function": name, "one-sided branches (p', x')": str(found),
            "zeros around the origin (p, x)": str(branches_on_circle(problem)),
            "event of the curve from p = -1": event.kind.name.lower(), "at": event.parameter,
            "ends": ", ".join(stop.name.lower() for stop in branch.stops),
            "paper": words,
            "agrees": found == directions and event.kind is kind
            and abs(event.parameter) < CLOSE,
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
    limits: dict[str, Any] = {"interval": (-1.0, 1.0)}
    trivial = am.follow(Pitchfork(), start=[0.0], at=-1.0, **limits)
    (event,) = [e for e in trivial.events if e.kind is am.EventKind.BRANCH]
    other = am.follow(Pitchfork(), start=[1.0], at=1.0, **limits)
    error = max(abs(x.state[0] ** 2 - x.parameter) for x in other)
    fold = [e.parameter for e in other.folds]
    return [
        {"curve": "x = 0", "branch point at": event.parameter,
         "one-sided branches there": len(event.directions),
         "paper": "two curves cross in (0, 0)",
         "agrees": abs(event.parameter) < CLOSE and len(event.directions) == 4},
        {"curve": "x^2 = p", "largest |x^2 - p|": error, "turns at": fold[0], "paper": "0",
         "agrees": error < CLOSE and abs(fold[0]) < 1e-10},
    ]  # fmt: skip
