"""Sections 4 and 5: the cube on a rigid plane, with Tresca and with Coulomb friction."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import amontons as am
from amontons.solvers import Iterate

from .runs import INEXACT, NESTED, Run, fixed_point, run

MODIFICATIONS = (am.Modification.FIRST, am.Modification.SECOND, am.Modification.THIRD)
NODE = (0.0625, 1.0, 0.0)  # of figure 4.3


@cache
def model(level: int) -> am.Model:
    """The cube with 2^level elements an edge, friction 1."""
    block = am.Body(am.box((1, 1, 1), cells=2**level), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


@cache
def coulomb(level: int) -> am.FrictionProblem:
    """Section 5.1."""
    return model(level).assemble()


@cache
def tresca(level: int) -> am.FrictionProblem:
    """Section 4.1: g = 800 x y (1 - x) (1 - y).

    The bound of a node is the integral of g times its dual basis function, as mortar contact
    takes it; with the nodal basis function, as the paper's formula has it, Table 4.1 does not
    come out (`nodal_bound`).
    """
    bound = am.Contact(
        "bottom", am.Plane(normal=(0, 0, 1)), method="mortar",
        tresca=lambda x: 800 * (x[:, :2] * (1 - x[:, :2])).prod(axis=1),
    )  # fmt: skip
    given = model(level)
    law = am.Model(given.bodies, given.supports, [bound]).assemble().law
    return replace(coulomb(level), law=law)  # one factor for both


def nodal_bound(level: int) -> am.FrictionProblem:
    """The same with g_p = integral of g phi_p, the formula at the end of section 2."""
    x, h = contact_points(level), 0.5**level
    force = 800 * _moments(x[:, 0], h) * _moments(x[:, 1], h)
    return replace(coulomb(level), law=am.Tresca(force))


def _moments(x: np.ndarray, h: float) -> np.ndarray:
    """Integral of t (1 - t) over [0, 1] times the hat functions at the nodes x of a mesh h."""
    whole = h * x * (1 - x) - h**3 / 6
    return np.where((x < h / 2) | (x > 1 - h / 2), h**2 / 6 - h**3 / 12, whole)


def contact_points(level: int) -> np.ndarray:
    """Points of the contacts, (nc, 3), in the order of the problem."""
    return np.concatenate([p.rows.points for p in model(level).discretisation.placed])


def node(level: int) -> int:
    """The contact that figure 4.3 shows."""
    return int(np.argmin(np.linalg.norm(contact_points(level) - NODE, axis=1)))


def corner_traction(level: int, solution: am.FrictionSolution) -> float:
    """|lambda| at the node (1, 1, 0), where section 5.1 sees a singularity."""
    k = int(np.argmin(np.linalg.norm(contact_points(level) - (1, 1, 0), axis=1)))
    (placed,) = model(level).discretisation.placed
    return float(np.linalg.norm(solution.r[k]) / placed.rows.weights[k])


def table41(levels: list[int]) -> dict[str, Run]:
    """Exact Algorithm 1 from zero with (3.11), tolerance 1e-9."""
    return {str(k): run(tresca(k), fixed_point(), 1e-9) for k in levels}


def readings(levels: list[int]) -> dict[str, dict[str, Run]]:
    """Table 4.1 by the other modifications, and with the bound as section 2 has it."""
    chosen = [k for k in levels if 0 < k < 5]
    kinds = {
        kind.value: {
            str(k): run(tresca(k), fixed_point(modification=kind), 1e-9) for k in chosen
        }
        for kind in MODIFICATIONS[1:]
    }
    return kinds | {
        "nodal bound": {str(k): run(nodal_bound(k), fixed_point(), 1e-9) for k in chosen}
    }


def robust(levels: list[int]) -> dict[str, dict[str, dict[str, dict]]]:
    """What the modifications are for: {method: {start: {level and c: run}}}, Tresca, exact.

    The Robin condition (3.5b) as it stands and Newton's method on (3.14), from zero and from
    the start of figure 4.3, tolerance 1e-9, at most 60 steps.
    """
    methods = {
        "(3.5b) as it stands": {"modification": "unmodified"},
        "(3.14)": {"function": "quotient"}, "(3.11)": {},
    }  # fmt: skip
    out: dict = {}
    for name, option in methods.items():
        starts = out.setdefault(name, {"zero": {}, "far": {}})
        for k in (k for k in levels if 0 < k < 4):
            for c in (100.0, 1e4):
                solver = am.ActiveSet(
                    bound="fixed-point", c_normal=c, c_tangential=c, **option
                )
                for start, runs in starts.items():
                    first = far(k) if start == "far" else None
                    found = run(tresca(k), solver, 1e-9, start=first, limit=60)
                    runs[f"{k}, c = {c:g}"] = found.record()
    return out


def table42(levels: list[int]) -> dict[str, dict[str, Run]]:
    """Exact, inexact and nested strategy, tolerance 1e-10."""
    options = {"exact": {}, "inexact": INEXACT, "nested": NESTED}
    return {
        name: {str(k): run(tresca(k), fixed_point(**given), 1e-10) for k in levels if k}
        for name, given in options.items()
    }


def table43(levels: list[int]) -> dict[str, dict[str, Run]]:
    """Inexact strategy for c_tau from 1 to 10 000, tolerance 1e-10."""
    return {
        str(c): {
            str(k): run(tresca(k), fixed_point(c_tangential=float(c), **INEXACT), 1e-10)
            for k in levels
            if k
        }
        for c in (1, 10, 100, 1000, 10000)
    }


def parameters(level: int) -> dict[str, Run]:
    """Table 4.3 beyond its range, on one level: c_n too, and what is taken unless told."""
    tractions = 100 * 4.0**-level  # c = 100 for tractions is c D_p for forces
    options = {
        "c_tau = 0.01": {"c_tangential": 0.01}, "c_n = 0.01": {"c_normal": 0.01},
        "c_n = 1": {"c_normal": 1.0}, "c_n = 100": {}, "c_n = 10000": {"c_normal": 1e4},
        "c = 100 D_p": {"c_normal": tractions, "c_tangential": tractions},
        "c from the stiffness": {"c_normal": None, "c_tangential": None},
    }  # fmt: skip
    return {
        name: run(tresca(level), fixed_point(**INEXACT, **option), 1e-10)
        for name, option in options.items()
    }


def strategies(levels: list[int]) -> dict[str, dict[str, Run]]:
    """Algorithm 2 with other m and k_f than Table 5.1, tolerance 1e-10."""
    options = {
        "m = k_f = 1": INEXACT, "m = 1, k_f = 5": {**INEXACT, "bound_steps": 5},
        "m = inf, k_f = 1": {}, "m = inf, k_f = 5": {"bound_steps": 5},
        "m = k_f = inf": {"bound_steps": None},
    }  # fmt: skip
    return {
        name: {
            str(k): run(coulomb(k), fixed_point(**option), 1e-10, limit=400)
            for k in levels if 0 < k < 4
        }
        for name, option in options.items()
    }  # fmt: skip


def table51(levels: list[int]) -> dict[str, dict[str, Run]]:
    """Algorithm 2 with m = k_f = 1 for Coulomb friction, tolerance 1e-10.

    There is nothing below level 0 to start from.
    """
    return {
        name: {
            str(k): run(coulomb(k), fixed_point(**(given if k else INEXACT)), 1e-10)
            for k in levels
        }
        for name, given in (("zero", INEXACT), ("nested", NESTED))
    }


def newton(levels: list[int]) -> dict[str, Run]:
    """The full Newton method of section 7 on the Coulomb cube, direct solver."""
    return {
        str(k): run(coulomb(k), am.ActiveSet(c_normal=100.0, c_tangential=100.0), 1e-10)
        for k in levels
    }


def far(level: int) -> Iterate:
    """u = (1, 1, 0) and lambda = (-1, -1, 0) in all nodes.

    lambda is a traction: the force at a node is D_p times as large.
    """
    v = np.tile([1.0, 1.0, 0.0], tresca(level).unknowns // 3)
    (placed,) = model(level).discretisation.placed
    r = -np.einsum("kij,j->ki", placed.rows.frames, [-1.0, -1.0, 0.0])
    return Iterate(placed.rows.weights[:, None] * r, v)


def figure43(level: int) -> dict[str, Run]:
    """The three modifications from far away, tolerance 1e-14."""
    problem, start = tresca(level), far(level)
    return {
        kind.value: run(problem, fixed_point(modification=kind), 1e-14, start=start, limit=40)
        for kind in MODIFICATIONS
    }
