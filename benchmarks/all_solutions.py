"""All solutions from many starts and in 3D: are they found, and what does it cost.

    python benchmarks/all_solutions.py [triangle] [loads] [discs] [cube] [--problems 100]

Each name is one table (all of them without a name); results/all_solutions.json keeps the rows,
results/all_solutions.md is written from all of them.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from machine import describe

import amontons as am
from amontons.analysis.certificates.one_load.certificate import certify_load
from amontons.mechanics.ready.hild import hild_triangle
from amontons.problem.friction import FrictionProblem

RESULTS = Path(__file__).parent / "results"
sys.path.append(str(Path(__file__).parents[1] / "tests" / "unit"))
Row = dict[str, object]
LIMIT = 60.0  # seconds of a search in 3D


def compare(exact: list[np.ndarray], found: list[np.ndarray]) -> tuple[int, int]:
    """(solutions of the first list that are in the second, those that only the second has)."""

    def same(r: np.ndarray, other: np.ndarray) -> bool:
        return bool(np.abs(r - other).max() <= 1e-5 * (1 + np.abs(r).max()))

    shared = sum(any(same(r, other) for other in found) for r in exact)
    return shared, sum(not any(same(r, other) for other in exact) for r in found)


# ------------------------------------------------------------------ many starts, 2D
def searched(problems: list[FrictionProblem], starts: int) -> Row:
    """The exact lists beside those of `multistart`."""
    total = shared = more = complete = 0
    spent = []
    for problem in problems:
        exact = am.all_solutions(problem, time_limit=LIMIT)
        began = time.process_time()
        found = am.multistart(problem, starts=starts)
        spent.append(time.process_time() - began)
        both, others = compare([s.r for s in exact.solutions], [s.r for s in found.solutions])
        total, shared, more = total + len(exact), shared + both, more + others
        complete += exact.complete
    return {"problems": len(problems), "exact lists complete": complete, "solutions": total,
            "found": shared, "not in the exact list": more,
            "CPU s, mean": round(float(np.mean(spent)), 3)}  # fmt: skip


def triangle(arguments: argparse.Namespace) -> list[Row]:
    """Structured meshes, mu = 0.5, 0.6, ..., 5."""
    rows = []
    for n in range(1, 11):
        local = hild_triangle(n).assemble().condensed()
        row = searched([local.with_mu(mu) for mu in np.arange(5, 51) / 10], 500)
        rows.append({"contacts": n, **row})
    return rows


def loads(arguments: argparse.Namespace) -> list[Row]:
    """Random loads on triangles of 4 to 10 contacts, mu from 0.3 to 5."""
    random, problems = np.random.default_rng(1), []
    for k in range(60):
        n, mu = int(random.integers(4, 11)), random.uniform(0.3, 5)
        local = hild_triangle(n, mu=mu).assemble().condensed()
        size = np.abs(local.q).max()
        q = size * random.standard_normal(local.q.shape) * [1, 2]
        if k % 2 == 0:
            q = local.q + size * random.standard_normal(local.q.shape) * [0.3, 1]
        problems.append(FrictionProblem.from_delassus(local.W, q, local.mu))
    return [searched(problems, 500)]


# ------------------------------------------------------------------ three dimensions
def discs(arguments: argparse.Namespace) -> list[Row]:
    """Random problems with friction discs; each proof is checked by other code."""
    from brute_force_3d import random_problem_3d, solutions_by_brute_force
    from disc_checker import accepted

    rows = []
    for contacts in (2, 3, 4, 5, 6):
        row: Row = {"contacts": contacts, "problems": 0, "complete": 0, "solutions": 0,
                    "missed": 0, "proofs refused": 0, "regions, most": 0}  # fmt: skip
        spent = []
        for seed in range(arguments.problems // (1 if contacts < 4 else 5)):
            W, q, mu = random_problem_3d(seed, contacts)
            mu = mu if contacts < 4 else 0.6 * mu
            began = time.process_time()
            found = am.all_solutions(
                FrictionProblem.from_delassus(W, q, mu), time_limit=LIMIT, keep_proof=True
            )
            spent.append(time.process_time() - began)
            listed = [s.r for s in found.solutions]
            truth = solutions_by_brute_force(W, q, mu, angles=12, most=600)
            both, _ = compare([r for _, r in truth], listed)
            refused = found.complete and not accepted(W, q, mu, found.proof, listed)
            for name, value in (("problems", 1), ("complete", int(found.complete)),
                                ("solutions", len(found)), ("missed", len(truth) - both),
                                ("proofs refused", int(refused))):  # fmt: skip
                row[name] += value  # type: ignore[operator]
            row["regions, most"] = max(row["regions, most"], found.examined)  # type: ignore[type-var]
        row["CPU s, median"] = round(float(np.median(spent)), 2)
        rows.append({**row, "longest": round(max(spent), 1)})
    return rows


def cube(arguments: argparse.Namespace) -> list[Row]:
    """The cube of hueeber2008 with 2^level elements an edge."""
    rows = []
    for level in (1, 2, 3):
        body = am.Body(
            am.box((1, 1, 1), cells=2**level), am.LinearElastic(young=200, poisson=0.3)
        )
        model = am.Model(
            [body],
            supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
            contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
        )
        local = model.assemble().condensed()
        for mu in (0.3, 1.0):
            problem = local.with_mu(mu)
            solution = am.solve(problem, tolerance=1e-10)
            began = time.process_time()
            answer = certify_load(problem, solution, time_limit=600)
            spent = round(time.process_time() - began, 1)
            status = {name: int((solution.status == k).sum())
                      for k, name in ((0, "open"), (2, "stick"), (1, "slip"))}  # fmt: skip
            rows.append({"level": level, "contacts": problem.contacts, "mu": mu, **status,
                         "verdict": answer.outcome.value, "regions": answer.examined,
                         "CPU s": spent})  # fmt: skip
    return rows


TABLES: dict[str, tuple[str, Callable[[argparse.Namespace], list[Row]]]] = {
    "triangle": ("Many starts: Hild's triangle, mu = 0.5, 0.6, ..., 5, 500 starts", triangle),
    "loads": ("Many starts: random loads on the triangle with 4 to 10 contacts, mu 0.3 to 5,"
              " open, sticking and slipping contacts", loads),
    "discs": ("3D: random problems, every third with many solutions, against a fine search; "
              "every proof is checked by separate code. mu 0.2 to 3, from four contacts on "
              f"0.6 of that; {LIMIT:.0f} s each", discs),
    "cube": ("3D, this load: the cube pressed and dragged on a plane", cube),
}  # fmt: skip


def page(kept: dict[str, list[Row]]) -> str:
    """results/all_solutions.md."""
    machine = describe()
    lines = ["# All solutions", "", f"`python benchmarks/all_solutions.py`, {machine['cpu']}, "
             f"Python {machine['python']}, numpy {machine['numpy']}; CPU seconds on one "
             "thread.", ""]  # fmt: skip
    for name, (title, _) in TABLES.items():
        if name not in kept:
            continue
        heads = list(kept[name][0])
        lines += [f"## {title}", "", "| " + " | ".join(heads) + " |",
                  "|" + " --- |" * len(heads)]  # fmt: skip
        lines += ["| " + " | ".join(str(row[head]) for head in heads) + " |"
                  for row in kept[name]] + [""]  # fmt: skip
    return "\n".join(lines)


def main() -> None:
    """Run the tables that are asked for, write all that are known."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[*TABLES, []])
    parser.add_argument("--problems", type=int, default=100)
    arguments = parser.parse_args()
    store = RESULTS / "all_solutions.json"
    kept = json.loads(store.read_text()) if store.exists() else {}
    for name in arguments.tables or TABLES:
        kept[name] = TABLES[name][1](arguments)
        store.write_text(json.dumps(kept, indent=1) + "\n")
        (RESULTS / "all_solutions.md").write_text(page(kept))
        print(name, *kept[name], sep="\n", flush=True)


if __name__ == "__main__":
    main()
