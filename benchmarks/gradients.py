"""Gradients of verified contact: against differences, one-sided ones, and their price.

    python benchmarks/gradients.py [--strict 1000] [--weak 200] [--levels 4,5,6]

Strict: random problems W, q, mu in 2D and 3D with 1 to 5 contacts, solved to 1e-13; the change
of r along a random change of q and mu against differences of fourth order, relative to the
larger of both changes.  Weak: problems built about a state in which contacts graze or begin to
slip; all one-sided changes against all solutions of the problem a step away, by the complete
list of `all_solutions` (2D).  Price: processor seconds of `vjp` on the cube of `cube.py`, the
first of a solution with all that it prepares and a second one, beside one solve with the
stiffness and one forward solve of the same linearised problem with what it prepares; medians
of five turns, each of which times all of them.

Writes results/gradients.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
from pathlib import Path

import numpy as np
from cube import cube
from machine import describe

import amontons as am
from amontons.analysis.gradients.cycles import TOLERANCE, CycleSystem
from amontons.analysis.gradients.gradient import Differentiable
from amontons.analysis.gradients.systems import system_of
from amontons.solvers.driver import drive

HERE = Path(__file__).parent
STENCIL = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
TURNS = 5  # of a price
APART = 1e-6  # the step to the problem beside a weak one


def random_matrix(rng, m):
    A = rng.standard_normal((m, m))
    return A @ A.T / m + 0.2 * np.eye(m)


def strict_error(seed):
    """Relative error of one problem; None where it is not strict or not solved."""
    rng = np.random.default_rng(seed)
    d, nc = 2 + seed % 2, 1 + seed % 5
    W, q = random_matrix(rng, nc * d), rng.standard_normal((nc, d))
    q[:, 0] -= 0.8
    mu = rng.uniform(0.1, 0.6, nc)
    dq, dmu = rng.standard_normal((nc, d)), 0.1 * rng.standard_normal(nc)

    def solved(e, start=None):
        problem = am.FrictionProblem.from_delassus(W, q + e * dq, mu + e * dmu)
        return drive(problem, tolerance=1e-13, start=start)

    s = solved(0.0)
    if not s.converged or len(Differentiable(s).at.weak):
        return None
    change = s.jvp(load=dq, mu=dmu).r
    for step in (1e-4, 1e-5, 1e-6):
        near = [(share, solved(k * step, am.Iterate(s.r))) for k, share in STENCIL]
        if all(x.converged and x.pattern == s.pattern for _, x in near):
            found = sum(share * x.r for share, x in near) / step
            size = max(np.abs(found).max(), np.abs(change).max(), 1e-300)
            return float(np.abs(found - change).max() / size)
    return None


def weak_state(rng, nc, mu):
    """r, u (nc, 2) with at least one contact on a border, and what they are."""
    kinds = rng.choice(["open", "stick", "slip", "graze", "impend"], nc)
    kinds[0] = rng.choice(["graze", "impend"])
    r, u = np.zeros((2, nc, 2))
    for i, kind in enumerate(kinds):
        sign, n = rng.choice([-1.0, 1.0]), rng.uniform(0.5, 2)
        slip = sign * rng.uniform(0.3, 1)
        if kind == "open":
            u[i] = rng.uniform(0.3, 1), rng.standard_normal()
        elif kind == "graze":
            u[i, 1] = slip
        elif kind == "stick":
            r[i] = n, sign * mu[i] * n * rng.uniform(0.1, 0.7)
        else:
            r[i] = n, -sign * mu[i] * n
            u[i, 1] = slip if kind == "slip" else 0.0
    return r, u


def weak_case(seed):
    """(right?, number of sides) of one weak problem; None where a check can not decide."""
    rng = np.random.default_rng(seed)
    nc = 1 + seed % 4
    W, mu = random_matrix(rng, 2 * nc), rng.uniform(0.1, 2.5, nc)
    r, u = weak_state(rng, nc, mu)
    q = u - (W @ r.ravel()).reshape(nc, 2)
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    s = drive(problem, tolerance=1e-12, start=am.Iterate(r))
    if not s.converged or np.abs(s.r - r).max() > 1e-9:
        return None
    dq, dmu = rng.standard_normal((nc, 2)), 0.1 * rng.standard_normal(nc)
    change = s.jvp(load=dq, mu=dmu)
    assert len(change.weak), "not seen as weak"
    beside = am.FrictionProblem.from_delassus(W, q + APART * dq, mu + APART * dmu)
    listed = am.all_solutions(beside)
    if not listed.complete:
        return None
    near = [(x.r - s.r) / APART for x in listed.solutions if np.abs(x.r - s.r).max() < 1e-3]
    sides = [side.r for side in change.sides]
    size = max([1.0, *(np.abs(x).max() for x in near)])
    missing = [min([np.abs(a - b).max() for b in sides], default=np.inf) for a in near]
    extra = [min([np.abs(a - b).max() for b in near], default=np.inf) for a in sides]
    return max(missing + extra, default=0.0) <= 1e-3 * size, len(sides)


def price(level):
    """Sizes and processor seconds at one level of the cube."""
    problem = cube(level).assemble()
    s = drive(problem, tolerance=1e-10)
    rng = np.random.default_rng(0)
    of_v, of_r = rng.standard_normal(problem.unknowns), rng.standard_normal(s.r.shape)
    at, zero = Differentiable(s).at, np.zeros(s.r.shape)
    make = CycleSystem if problem.unknowns > 60_000 else system_of
    actions = {
        "stiffness": lambda _: problem.solve_M(problem.f),
        "forward": lambda _: make(at).change(of_v, zero, zero),
        "vjp": lambda one: one.vjp(r=of_r, v=of_v),
        "again": lambda one: one.vjp(r=of_r, v=of_v),
    }
    if make is CycleSystem:
        b = problem.hierarchy.nodes.spread(problem.f)
        actions["equal"] = lambda _: problem.hierarchy.solve(0, b, TOLERANCE, 200)
    seconds = {name: [] for name in actions}
    for turn in range(1 + TURNS):
        one = Differentiable(s)
        for name, action in actions.items():
            began = time.process_time()
            action(one)
            if turn:  # the first one prepares the stiffness and compiles
                seconds[name].append(time.process_time() - began)
    found = {name: float(np.median(values)) for name, values in seconds.items()}
    return {"unknowns": problem.unknowns, "contacts": problem.contacts, **found}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--strict", type=int, default=1000)
    parser.add_argument("--weak", type=int, default=200)
    parser.add_argument("--levels", default="4,5,6")
    given = parser.parse_args()
    rows = []
    for level in given.levels.split(","):
        rows.append(price(int(level)))
        print(rows[-1], flush=True)
    errors, seed = [], 0
    while len(errors) < given.strict:
        error = strict_error(seed)
        errors += [] if error is None else [error]
        seed += 1
    left_out, cases, tried = seed - len(errors), [], 0
    while len(cases) < given.weak:
        case = weak_case(10_000 + tried)
        cases += [] if case is None else [case]
        tried += 1
    text = page(errors, left_out, cases, tried, rows)
    (HERE / "results" / "gradients.md").write_text(text)
    print(text)


def page(errors, left_out, cases, tried, rows):
    """The result as a Markdown page."""
    sides = np.bincount([count for _, count in cases])
    lines = [
        "# Gradients of verified contact", "", "Regenerate: `python benchmarks/gradients.py`.",
        "", "; ".join(f"{k} {v}" for k, v in describe().items()) + ".", "",
        "## Strict statuses",
        f"{len(errors)} random problems ({left_out} more were weak, not solved to 1e-13, or "
        f"changed a status within the step): largest difference {max(errors, default=0):.1e}, "
        f"median {np.median(errors) if errors else 0:.1e}, relative; "
        f"{sum(e > 1e-7 for e in errors)} above 1e-7.", "",
        "## Weak ones",
        f"{len(cases)} problems ({tried - len(cases)} more could not be compared): "
        f"{sum(ok for ok, _ in cases)} with all one-sided derivatives and no other. Sides: "
        + ", ".join(f"{n} in {count}" for n, count in enumerate(sides) if count) + ".", "",
        "## Price of a vjp", "",
        "| unknowns | contacts | stiffness s | the same to 1e-9 s | forward s | first vjp s | "
        "second vjp s | first / stiffness | second / stiffness | first / forward |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for row in rows:
        stiffness, equal, first = row["stiffness"], row.get("equal"), row["vjp"]
        lines.append(
            f"| {row['unknowns']} | {row['contacts']} | {stiffness:.3g} | "
            f"{'-' if equal is None else f'{equal:.3g}'} | {row['forward']:.3g} | "
            f"{first:.3g} | {row['again']:.3g} | {first / stiffness:.2f} | "
            f"{row['again'] / stiffness:.2f} | {first / row['forward']:.2f} |"
        )
    lines += ["", "Up to 60 000 unknowns the first vjp and the forward solve factorise the "
              "system, and the stiffness has its factor; beyond, all are multigrid: a solve "
              "with the stiffness (`solve_M`) to 1e-11 by its recurrence, the forward solve "
              "and both vjp to 1e-9 by the residual itself. The first vjp of a solution "
              "prepares the statuses and the coarse levels and keeps them."]  # fmt: skip
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
