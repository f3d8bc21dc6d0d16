"""Certificates of uniqueness: how far they reach, what they cost, and whether they are right.

    python benchmarks/certificates.py [small] [hild] [mixed] [large] [cube] [body]
                                      [--problems 500] [--levels 2,3,4,5]

Each name is one table (all of them without a name); results/certificates.json keeps the rows,
so that tables can be made one at a time; results/certificates.md is written from all of them.
A table is a function that returns rows, with its heading in TABLES: add others there.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from machine import describe

import amontons as am
from amontons.analysis.certificates.one_load.answer import LoadOutcome
from amontons.analysis.certificates.one_load.certificate import certify_load
from amontons.mechanics.ready.hild import hild_triangle
from amontons.problem.friction import FrictionProblem

RESULTS = Path(__file__).parent / "results"
sys.path.append(str(Path(__file__).parents[1] / "tests" / "unit"))
Row = dict[str, object]


# ------------------------------------------------------------------ small problems
def small_problem(seed: int) -> FrictionProblem:
    """One to seven contacts, mu from 0.5 to 4, four kinds of W and of loads in turn."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 8))
    A = random.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / (2 * nc) + 0.05 * np.eye(2 * nc)
    mu = np.full(nc, random.uniform(0.5, 4.0))
    q = random.standard_normal((nc, 2)) * [1, 2]
    if seed % 4 == 1:  # contacts with three solutions each, weakly coupled
        W = np.kron(np.eye(nc), [[1.0, 0.8], [0.8, 1.0]]) + 0.1 * A @ A.T / (2 * nc)
        q = np.abs(q)
    elif seed % 4 == 2:
        mu = random.uniform(0.5, 4.0, nc)
    elif seed % 4 == 3:
        W = dense(hild_triangle(nc).assemble().condensed())
        q = q * np.sqrt(W[0, 0])
    return FrictionProblem.from_delassus(W, q, mu)


def dense(problem: FrictionProblem) -> np.ndarray:
    """W as an array."""
    return problem.W if isinstance(problem.W, np.ndarray) else problem.W.toarray()


def small(arguments: argparse.Namespace) -> list[Row]:
    """Every problem from one of its enumerated solutions; certificates are checked again."""
    from load_certificate_checker import check_load

    count, seconds, wrong = Counter(), [], []
    for seed in range(arguments.problems):
        problem = small_problem(seed)
        truth = am.all_solutions(problem)
        if not truth.complete or not len(truth):
            count["not enumerated"] += 1
            continue
        alone = len(truth) == 1 and not truth.solutions[0].freedom
        began = time.process_time()
        answer = certify_load(problem, truth.solutions[seed % len(truth)], time_limit=300)
        seconds.append(time.process_time() - began)
        count["one" if alone else "several", answer.outcome] += 1
        ok = answer.outcome is (LoadOutcome.CERTIFIED if alone else LoadOutcome.REFUTED)
        if answer.outcome is LoadOutcome.CERTIFIED:
            branches = [(b.pattern, b.multipliers) for b in answer.branches]
            check_load(problem.W, problem.q, problem.mu, answer.r0, branches)
        if answer.outcome is LoadOutcome.REFUTED:
            pattern = answer.other.pattern
            ok &= any(pattern in (s.pattern, *s.touching) for s in truth.solutions)
        if not ok:
            wrong.append(seed)
            print("seed", seed, answer, "of", [s.pattern for s in truth.solutions])
    rows = []
    for kind in ("one", "several"):
        row: Row = {"solutions": kind}
        row |= {outcome.value: count[kind, outcome] for outcome in LoadOutcome}
        rows.append(row)
    rows[0]["CPU s, median"] = f"{np.median(seconds):.3f}"
    rows[0]["longest"] = f"{max(seconds):.1f}"
    rows[0]["not as enumerated"] = str(wrong or "none")
    rows[0]["not enumerated"] = count["not enumerated"]
    return rows


# ------------------------------------------------------------------ the triangle
def certified(problem: FrictionProblem, solution: object, limit: float) -> Row:
    """Outcome, inequalities, CPU seconds."""
    began = time.process_time()
    answer = certify_load(problem, solution, time_limit=limit)
    seconds = time.process_time() - began
    return {
        "outcome": answer.outcome.value, "inequalities": answer.examined,
        "distance": f"{answer.distance:.1e}", "CPU s": f"{seconds:.2f}",
    }  # fmt: skip


class Rest:
    """r = 0, which solves Hild's problem for every mu."""

    def __init__(self, contacts: int) -> None:
        self.r = np.zeros((contacts, 2))


def triangle(sizes: dict[int, tuple[float, ...]], limit: float) -> list[Row]:
    """The solution without contact, on structured meshes."""
    rows = []
    for n, values in sizes.items():
        problem = hild_triangle(n).assemble().condensed()
        for mu in values:
            row = certified(problem.with_mu(mu), Rest(n), limit)
            rows.append({"contacts": n, "mu": mu, **row})
            print(rows[-1], flush=True)
    return rows


def hild(arguments: argparse.Namespace) -> list[Row]:
    """Where one inequality is enough, where branches are needed, where others exist."""
    values = (0.3, 0.6, 1.0, 2.0, 2.5, 2.9, 3.5)
    sizes = {10: values, 25: values, 50: (*values[:5], 3.5), 100: (*values[:4], 3.5)}
    return triangle(sizes, arguments.limit)


def half_plane(strips: int) -> np.ndarray:
    """W of a half plane under strips of traction, whose normal and tangential sides couple.

    Unit modulus E*, Dundurs' constant 0.3; K. L. Johnson, "Contact Mechanics" (1985), (2.24).
    """
    x, h = np.linspace(-0.2, 0.2, strips, retstep=True)

    def logarithm(s: np.ndarray) -> np.ndarray:
        return s * (1 + np.log(10 / np.abs(s)))

    distance = x[:, None] - x
    own = 2 / (np.pi * h) * (logarithm(distance + h / 2) - logarithm(distance - h / 2))
    across = 0.3 * np.clip(2 * distance / h, -1, 1)
    W = np.zeros((strips, 2, strips, 2))
    W[:, 0, :, 0] = W[:, 1, :, 1] = own
    W[:, 0, :, 1], W[:, 1, :, 0] = across, -across
    return W.reshape(2 * strips, -1)


def large(arguments: argparse.Namespace) -> list[Row]:
    """Many contacts: the triangle, and mixed statuses on a half plane."""
    rows: list[Row] = [
        {"problem": "triangle", **row} for row in triangle({400: (0.3, 0.6)}, arguments.limit)
    ]
    W = half_plane(1000)
    problem = FrictionProblem.from_delassus(W, mixed_load(W, 0), np.full(1000, 0.3))
    solution = am.solve(problem, tolerance=1e-10)
    counts = "/".join(str(k) for k in solution.counts.values())
    row = certified(problem, solution, arguments.limit)
    rows.append({"problem": f"half plane, {counts}", "contacts": 1000, "mu": 0.3, **row})
    print(rows[-1], flush=True)
    return rows


def mixed_load(W: np.ndarray, seed: int) -> np.ndarray:
    """q (nc, 2): random waves along the contact, the short ones smaller."""
    random = np.random.default_rng(seed)
    x = np.linspace(0, 1, len(W) // 2, endpoint=False)
    q = np.zeros((len(x), 2))
    for j in range(1, 9):
        phase = random.uniform(0, 2 * np.pi)
        q += random.standard_normal(2) / j * np.cos(np.pi * j * x + phase)[:, None]
    return q


def mixed(arguments: argparse.Namespace) -> list[Row]:
    """Loads whose solutions have open, sticking and slipping contacts, n = 100."""
    W = dense(hild_triangle(100).assemble().condensed())
    rows = []
    for mu in (0.3, 0.6, 1.0):
        count, seconds, inequalities, seed = Counter(), [], [], 0
        while sum(count.values()) < arguments.loads:
            q, seed = mixed_load(W, seed), seed + 1
            problem = FrictionProblem.from_delassus(W, q, np.full(100, mu))
            solution = am.solve(problem, tolerance=1e-10, check=False)
            if not solution.converged or not min(solution.counts.values()):
                continue
            row = certified(problem, solution, arguments.limit)
            print(mu, seed - 1, solution.counts, row, flush=True)
            count[row["outcome"]] += 1
            seconds.append(float(str(row["CPU s"])))
            inequalities.append(row["inequalities"])
        rows.append({
            "mu": mu, **{o.value: count[o.value] for o in LoadOutcome},
            "inequalities, most": max(inequalities), 
            "CPU s, median": f"{np.median(seconds):.2f}", "longest": f"{max(seconds):.2f}",
        })  # fmt: skip
    return rows


# ------------------------------------------------------------------ bodies in space
def block(cells: int) -> FrictionProblem:
    """The cube of `example:cube`, W formed."""
    body = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))
    model = am.Model(
        [body],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )
    local = model.assemble().condensed()
    assert local.q is not None
    return FrictionProblem.from_delassus(dense(local), local.q, local.mu)


def cube(arguments: argparse.Namespace) -> list[Row]:
    """The verdict of `am.uniqueness`, and the certificate of this load alone."""
    rows = []
    am.uniqueness(block(2))  # compiles
    for level in map(int, arguments.levels.split(",")):
        given = block(2**level)
        for mu in (0.3, 1.0):
            problem = given.with_mu(mu)
            solution = am.solve(problem, tolerance=1e-10)
            began = time.process_time()
            verdict = am.uniqueness(problem, solution)
            whole = time.process_time() - began
            own = certified(problem, solution, arguments.limit)
            rows.append({
                "contacts": problem.contacts, "mu": mu,
                "open/slip/stick": "/".join(str(k) for k in solution.counts.values()),
                "verdict": verdict.verdict.value, "s": f"{whole:.1f}",
                "this load alone": own["outcome"], "distance": own["distance"],
                "CPU s": own["CPU s"],
            })  # fmt: skip
            print(rows[-1], flush=True)
    return rows


def waves(seed: int, side: int, rough: int) -> np.ndarray:
    """q (side^2, 3): random waves over a square, those of wave number k as k^-rough."""
    random = np.random.default_rng(seed)
    x = np.linspace(0, 1, side)
    X, Y = (part.ravel() for part in np.meshgrid(x, x, indexing="ij"))
    q = np.zeros((side * side, 3))
    for i in range(5):
        for j in range(5):
            size = random.standard_normal(3) / (1 + i * i + j * j) ** (rough / 2)
            a, b = random.uniform(0, 2 * np.pi, 2)
            q += size * (np.cos(np.pi * i * X + a) * np.cos(np.pi * j * Y + b))[:, None]
    return 1e-3 * q


def body(arguments: argparse.Namespace) -> list[Row]:
    """400 contacts under random loads: how many are decided."""
    W = dense(block(19))
    rows = []
    for mu in (0.3, 0.6, 1.0):
        count: Counter[LoadOutcome] = Counter()
        reached, seconds, seed = [], [], 0
        while sum(count.values()) < arguments.loads:
            q, seed = waves(seed, 20, 1 + seed % 2), seed + 1
            problem = FrictionProblem.from_delassus(W, q, np.full(400, mu))
            solution = am.solve(problem, tolerance=1e-10, check=False)
            if not solution.converged:
                count["not solved"] += 1  # type: ignore[index]
                continue
            began = time.process_time()
            answer = certify_load(problem, solution, time_limit=arguments.limit, brief=True)
            seconds.append(time.process_time() - began)
            count[answer.outcome] += 1
            if answer.multipliers is not None and not answer.multipliers.proved:
                reached.append(answer.multipliers.reached)
            print(mu, seed - 1, solution.counts, answer.outcome.value, flush=True)
        rows.append({
            "mu": mu, **{o.value: count[o] for o in LoadOutcome},
            "friction reached by the undecided, least": f"{min(reached, default=1.0):.2f}",
            "CPU s, median": f"{np.median(seconds):.2f}", "longest": f"{max(seconds):.1f}",
        })  # fmt: skip
        print(rows[-1], flush=True)
    return rows


# ------------------------------------------------------------------ the page
Table = Callable[[argparse.Namespace], list[Row]]
TABLES: dict[str, tuple[Table, str]] = {
    "small": (small, "This load: random problems of up to seven contacts, mu 0.5 to 4. All "
              "solutions are known from enumeration; each certificate is checked again in the "
              "rational numbers (above four contacts partly in floating point)"),
    "hild": (hild, "This load: Hild's triangle, the solution without contact, 120 s at most "
             "(`--limit 120`)"),
    "mixed": (mixed, "This load: 100 contacts of the triangle, random loads whose solutions "
              "have open, sticking and slipping contacts"),
    "large": (large, "This load: many contacts; on the half plane a random load, and how many "
              "are open, slip and stick"),
    "cube": (cube, "The cube, W given: the verdict of `am.uniqueness` with its CPU seconds, "
             "and the certificate of this load alone (multipliers of every contact)"),
    "body": (body, "A block of 400 contacts under random waves of load, 20 for each friction: "
             "multipliers of every contact alone"),
}  # fmt: skip


def table(rows: list[Row]) -> str:
    """Rows as markdown."""
    heads = list(dict.fromkeys(key for row in rows for key in row))
    lines = [heads, ["---"] * len(heads)]
    lines += [[str(row.get(head, "")) for head in heads] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> None:
    """Make the tables asked for, and the page of all."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("tables", nargs="*", choices=[[], *TABLES], default=[])
    parser.add_argument("--problems", type=int, default=500)
    parser.add_argument("--loads", type=int, default=20, help="mixed loads per friction")
    parser.add_argument("--levels", default="2,3,4,5", help="of the cube; 5: W in a minute")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds per certificate")
    arguments = parser.parse_args()
    kept = RESULTS / "certificates.json"
    results = json.loads(kept.read_text()) if kept.exists() else {}
    for name in arguments.tables or TABLES:
        results[name] = TABLES[name][0](arguments)
        kept.write_text(json.dumps(results, indent=1, default=str) + "\n")
    write_page(results)


def write_page(results: dict[str, list[Row]]) -> None:
    """results/certificates.md."""
    where = describe()
    parts = [
        "# Certificates of uniqueness",
        f"`python benchmarks/certificates.py`, {where['cpu']}, Python {where['python']}, "
        f"numpy {where['numpy']}; CPU seconds on one thread.",
        "Inequalities: linear matrix inequalities that were solved. Distance: bound of what "
        "another solution can differ, relative to the largest reaction. Undecided: stopped by "
        "the clock, after 300 s unless said; the clock also counts what others run.",
    ]
    for name, (_, title) in TABLES.items():
        if name in results:
            parts += [f"## {title}", table(results[name])]
    (RESULTS / "certificates.md").write_text("\n\n".join(parts) + "\n")


if __name__ == "__main__":
    main()
