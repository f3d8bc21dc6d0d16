"""The Coulomb cube of hueeber2008: counts, resultants, and the price against one linear solve.

    python benchmarks/cube.py [--levels 1,2,3,4,5]

One linear solve is the factorisation of the stiffness and one back substitution by the same
solver (`amontons.Direct`); the nonlinear time is the whole of `drive(problem)` on a fresh
problem: its own factorisation, judge and status included.  Best of three (one at level 5),
compiled code warm; the factorisation takes its default number of threads on both sides, all
else one.

Writes results/cube.md and results/cube.json beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import time
from pathlib import Path

import numpy as np
from machine import describe

import amontons as am
from amontons.solvers.driver import drive

HERE = Path(__file__).parent
REFERENCE = HERE.parent / "tests/data/cube.json"


def cube(level):
    """Model with 2^level elements an edge."""
    block = am.Body(am.box((1, 1, 1), cells=2**level), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


def linear_seconds(problem):
    """Factor and solve once."""
    started = time.perf_counter()
    am.Direct().factor(problem.M).solve(problem.f)
    return time.perf_counter() - started


def measure(level):
    """One row: sizes, counts, resultant and the two times."""
    repeats = 3 if level < 5 else 1
    linear, whole = [], []
    for _ in range(repeats):
        model = cube(level)
        problem = model.assemble()
        linear.append(linear_seconds(problem))
        started = time.perf_counter()
        solution = drive(problem)
        whole.append(time.perf_counter() - started)
    fields = model.recover(solution)
    return {
        "level": level,
        "unknowns": problem.unknowns,
        "contacts": problem.contacts,
        "counts": solution.counts,
        "converged": solution.converged,
        "error": solution.convergence.error,
        "measure": solution.convergence.measure.value,
        "resultant": [float(x) for x in fields.resultant],
        "linear_seconds": min(linear),
        "whole_seconds": min(whole),
        "ratio": min(whole) / min(linear),
        "iterations": solution.convergence.iterations,
    }


def table(rows, machine):
    """The result as a Markdown page."""
    lines = ["# The Coulomb cube: counts, resultants and cost", ""]
    lines += ["Regenerate: `python benchmarks/cube.py`.", ""]
    lines += ["; ".join(f"{k} {v}" for k, v in machine.items()) + ".", ""]
    lines += [
        "| level | unknowns | in contact / slip | reference | resultant, largest relative "
        "difference | linear solve s | whole solve s | ratio |",
        "|---|---|---|---|---|---|---|---|",
    ]
    reference = json.loads(REFERENCE.read_text()) if REFERENCE.exists() else {}
    for row in rows:
        lines.append(_line(row, reference.get(f"level{row['level']}")))
    return "\n".join(lines) + "\n"


def _line(row, reference):
    counts = row["counts"]
    closed = counts["slip"] + counts["stick"]
    expected, difference = "-", "-"
    if reference:
        expected = f"{reference['contact']} / {reference['slip']}"
        plane = np.array(reference["resultant"])
        off = np.abs(np.array(row["resultant"]) - plane).max() / np.abs(plane).max()
        difference = f"{off:.1e}"
    return (
        f"| {row['level']} | {row['unknowns']} | {closed} / {counts['slip']} | {expected} | "
        f"{difference} | {row['linear_seconds']:.3g} | {row['whole_seconds']:.3g} | "
        f"{row['ratio']:.2f} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--levels", default="1,2,3,4,5")
    levels = [int(x) for x in parser.parse_args().levels.split(",")]
    for level in (2, 4):
        drive(cube(level).assemble())  # compile what both paths use
    rows = [measure(level) for level in levels]
    machine = describe()
    (HERE / "results").mkdir(exist_ok=True)
    record = {"machine": machine, "rows": rows}
    (HERE / "results/cube.json").write_text(json.dumps(record, indent=1))
    text = table(rows, machine)
    (HERE / "results/cube.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
