"""Example 5 as a model: one linear elastic triangle against the printed curved g.

The obstacle is where g(x) = r^2 - (x_1 - r)^2 - x_2^2 > 0, a disc, and contact is found where
the corner is.  Lame constants 1 and 1 and the triangle (0, 0), (0, 1), (-1, 0) give a = 2 and
b = 1; the force on the corner is (1, -gamma).

While the corner slips along the disc its place is one angle, and gamma a function of it in
closed form (`force`): the first fold, where slip begins, is gamma = F, and the second the least
value of that function.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

import amontons as am
from amontons.mechanics.meshes import Cells, Facets

F, RADII = 0.5, (0.5, 10.0)
UNTIL = 0.6
STIFFNESS = np.array([[2.0, -1.0], [-1.0, 2.0]])
EIGHTH = (4 / 5, -1 / 5, 4 / 105, -1 / 280)  # central differences of order 8


def model(radius: float, friction: float = F) -> am.Model:
    """The triangle, held along its side off the origin."""
    mesh = am.Mesh(
        [[0.0, 0.0], [0.0, 1.0], [-1.0, 0.0]], (Cells("tri", [[0, 1, 2]]),),
        {"held": (Facets("line", [[1, 2]]),), "contact": (Facets("line", [[0, 1]]),)},
    )  # fmt: skip
    disc = am.LevelSet(
        lambda x: (x[:, 0] - radius) ** 2 + x[:, 1] ** 2 - radius**2,
        lambda x: 2 * (x - [radius, 0.0]),
        lambda x: np.broadcast_to(2 * np.eye(2), (len(x), 2, 2)),
    )
    return am.Model(
        [am.Body(mesh, am.LinearElastic(young=2.5, poisson=0.25))], [am.Fix("held", 0)],
        [am.Contact("contact", disc, mu=friction, configuration="current")],
        [am.BodyForce((6.0, lambda x, t: -6.0 * t))],
    )  # fmt: skip


def force(angle: float, radius: float, friction: float = F) -> float:
    """gamma at which the corner slips down, an angle along the disc: by hand."""
    nu = np.array([np.cos(angle), np.sin(angle)])
    push = nu - friction * np.array([-nu[1], nu[0]])  # lambda_tau = -F lambda_nu
    need = STIFFNESS @ (radius * (np.array([1.0, 0.0]) - nu)) - [1.0, 0.0]
    return float(need[0] / push[0] * push[1] - need[1])


def second_fold(radius: float, friction: float = F) -> tuple[float, float] | None:
    """(angle, gamma) where `force` is least, beyond the begin of slip; None where it grows."""

    def slope(angle: float, step: float = 1e-3) -> float:
        ends = [force(angle + k * step, radius, friction)
                - force(angle - k * step, radius, friction) for k in range(1, 5)]  # fmt: skip
        return float(np.dot(EIGHTH, ends)) / step

    if slope(0.0) >= 0:
        return None
    angle = float(brentq(slope, 0.0, 1.0, xtol=1e-14))
    return angle, force(angle, radius, friction)


def run(levels: Sequence[int], out: Path) -> list[dict[str, Any]]:
    """Both radii: folds of the curve beside those by hand, and how exact its points are."""
    rows = []
    for radius in RADII:
        branch = am.follow(model(radius), "load", (0.0, UNTIL))
        found = [fold.parameter for fold in branch.folds]
        turn = second_fold(radius)
        known = [] if turn is None else [F, turn[1]]
        gaps = [abs((x.state[0] - radius) ** 2 + x.state[1] ** 2 - radius**2) for x in branch]
        slipping = [x for x in branch if x.state[1] < -1e-6]
        off = [
            abs(force(np.arctan2(-x.state[1], radius - x.state[0]), radius) - x.parameter)
            for x in slipping
        ]
        same = len(found) == len(known)
        rows.append({
            "r": radius, "folds": ", ".join(f"{x:.12f}" for x in found) or "none",
            "by hand": ", ".join(f"{x:.12f}" for x in known) or "none",
            "off": max((abs(a - b) for a, b in zip(found, known, strict=True)), default=0.0)
            if same else float("inf"),
            "largest |g|": float(max(gaps)), "slip off its curve": float(max(off)),
            "solutions at 0.47": len(branch.at(0.47)),
        })  # fmt: skip
    return rows


def statements(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What the paper says of both radii."""
    return [
        {"where": f"example 5 as a model, r = {row['r']:g}",
         "claim": "a fold where slip begins" if row["r"] == min(RADII) else "no fold",
         "verdict": "agrees" if row["off"] <= 1e-10 else "ours"}
        for row in rows
    ]  # fmt: skip
