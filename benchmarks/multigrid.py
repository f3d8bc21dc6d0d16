"""Contact multigrid on the problems of hueeber2008, against one linear elasticity solve.

    python benchmarks/multigrid.py [--levels 3,4,5,6,7] [--repeats 3] [--only mortar,shell]
    python benchmarks/multigrid.py --only unstructured [--sizes 0.036,0.024,0.0128]

Linear solve: the same bodies with their contact faces clamped, conjugate gradients with one
V(1,1) cycle of `GeometricMultigrid`, zero start, to the same relative residual.  Contact: the
whole of `drive(problem, ContactMultigrid())`, cold start, the nested start and all evaluations
of the judge included.  Levels, node blocks and what else depends on the matrices alone are
prepared before on both sides; compiled code is warm.  Both sides use the same engine: stored
blocks and block Gauss-Seidel, from 50 000 dofs on no matrix and Chebyshev smoothing.  CPU
seconds of one thread, best of the repeats.  Two bodies are judged by their residual: forming W
for the judge would take many times as long as the solve.  Unstructured: the cube in tetrahedra
of gmsh (not installed by default), with set-up: what depends on the matrices alone.  What is
aimed at: `ratio` at most 1.1 on cubes of levels 5 to 7 and 1.5 on the shell; on tetrahedra at
most 1.3 in the last column, set-up counted on both sides.
Pairs and kinds (`multigrid_models`): one run each, whose times to 1e-8 are first ones with all
preparation in them, so look at cycles.

Writes results/multigrid.md and results/multigrid.json beside this file; with --only, parts that
are not named stay as stored.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import importlib.util
import json
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import multigrid_models as models
import numpy as np
from machine import describe

sys.path.insert(0, str(Path(__file__).parents[1]))  # for reproduce/

import amontons as am
from amontons.mechanics.model import assembly
from amontons.problem import matrices
from amontons.solvers.driver import drive
from amontons.solvers.multigrid.levels import ContactLevels
from reproduce.hueeber2008.shell import model as shell

HERE = Path(__file__).parent
REFERENCE = json.loads((HERE.parent / "tests/data/cube.json").read_text())
TOLERANCES = (1e-8, 1e-10)
FRICTION = (0.1, 0.3, 1.0, 3.0)


def cube(level, mu=1.0, clamped=False):
    """The model with 2^level elements an edge; clamped: the contact face held too."""
    supports = [am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))]
    if clamped:  # a contact that never closes, for the model to have one
        supports.append(am.Fix("bottom", (0, 0, 0)))
    on, below = ("left", -10) if clamped else ("bottom", 0)
    obstacle = am.Plane((0, 0, 1), (0, 0, below))
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=2**level), am.LinearElastic(young=200, poisson=0.3))],
        supports=supports,
        contacts=[am.Contact(on, obstacle, mu=mu)],
    )


def stacked(cells, method="mortar"):
    """Two blocks whose meshes do not match, pressed and dragged."""
    lower = am.box((1, 1, 0.5), cells=(6 * cells, 6 * cells, 2 * cells))
    upper = am.box((0.8, 0.8, 0.5), (4 * cells, 4 * cells, 2 * cells), origin=(0.1, 0.1, 0.5))
    return am.Model(
        [am.Body(lower, am.LinearElastic(80, 0.3), "lower"),
         am.Body(upper, am.LinearElastic(50, 0.2), "upper")],
        supports=[am.Fix("lower.bottom", (0, 0, 0)), am.Fix("upper.top", (0.02, 0, -0.03))],
        contacts=[am.Contact("upper.bottom", master="lower.top", mu=0.3, method=method)],
    )  # fmt: skip


def best(repeats, run):
    """(CPU seconds, result) of the quickest of some runs; one more before warms up.

    repeats 0: of one run alone.
    """
    if repeats:
        run()
    times = []
    for _ in range(max(repeats, 1)):
        started = time.process_time()
        result = run()
        times.append(time.process_time() - started)
    return min(times), result


def linear(problem, levels, repeats):
    """Seconds and iterations to every tolerance of one linear solve."""
    factor = am.GeometricMultigrid(levels, dimension=problem.dimension).factor(
        problem.M, problem.near_nullspace
    )
    out = {}
    for tolerance in TOLERANCES:
        factor.options = am.GeometricMultigrid(tolerance=tolerance)
        before = factor.iterations
        seconds, _ = best(repeats, lambda: factor.solve(problem.f))
        out[tolerance] = (seconds, (factor.iterations - before) // (repeats + 1))
    return out


def contact(problem, tolerance, repeats, **options):
    """Seconds and solution of the whole contact solve, from matrices prepared before."""
    solver = am.ContactMultigrid(**options)
    return best(repeats, lambda: drive(replace(problem), solver, tolerance=tolerance))


def cube_row(level, repeats, algebraic=False):
    """Everything on one level; algebraic: without the levels of the mesh."""
    clamped = cube(level, clamped=True).assemble()
    reference = linear(clamped, () if algebraic else clamped.levels, repeats)
    del clamped
    model = cube(level)
    problem = model.assemble()
    if algebraic:
        problem = replace(problem.fresh(), levels=(), guess=None)
    row = {"level": level, "unknowns": problem.unknowns, "contacts": problem.contacts}
    for tolerance in TOLERANCES:
        seconds, solution = contact(problem, tolerance, repeats)
        linear_seconds, iterations = reference[tolerance]
        row[f"{tolerance:.0e}"] = {
            "linear_seconds": linear_seconds, "linear_iterations": iterations,
            "seconds": seconds, "cycles": solution.convergence.iterations,
            "ratio": seconds / linear_seconds, "error": solution.convergence.error,
            "outcome": solution.convergence.outcome.name.lower(),
        }  # fmt: skip
    slip, stick = solution.counts["slip"], solution.counts["stick"]
    row |= {"contact": slip + stick, "slip": slip}
    row["resultant"] = [float(x) for x in model.recover(solution).resultant]
    row["peak_gb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return row


def other_engine_rows(levels, repeats, grid_from, **kind):
    """The same with a matrix that is stored, or not, on both sides."""
    usual, assembly.GRID_FROM = assembly.GRID_FROM, grid_from
    rows = [cube_row(level, repeats, **kind) for level in levels]
    assembly.GRID_FROM = usual
    return rows


def clamped(problem):
    """The linear problem with all nodes in contact held, and its levels."""
    free = np.asarray(abs(problem.H).sum(axis=1)).ravel() == 0
    out = SimpleNamespace(
        M=problem.M[free][:, free], f=problem.f[free], dimension=problem.dimension,
        near_nullspace=problem.near_nullspace[free], levels=[],
    )  # fmt: skip
    for P in problem.levels:
        same, place = (P == 1).nonzero()
        rest = np.ones(P.shape[1], dtype=bool)
        rest[place[~free[same]]] = False
        out.levels.append(P[free][:, rest])
        free = rest
    return out


def two_bodies_row(model, repeats):
    """Two bodies against a linear solve of both, contact faces clamped or free."""
    problem = model.assemble().fresh()
    apart = linear(problem, problem.levels, repeats)
    held = clamped(problem)
    reference = linear(held, held.levels, repeats)
    row = {"unknowns": problem.unknowns, "contacts": problem.contacts}
    for tolerance in TOLERANCES:
        seconds, solution = contact(problem, tolerance, repeats)
        row[f"{tolerance:.0e}"] = {
            "linear_seconds": reference[tolerance][0],
            "linear_iterations": reference[tolerance][1],
            "free_seconds": apart[tolerance][0], "free_iterations": apart[tolerance][1],
            "seconds": seconds, "cycles": solution.convergence.iterations,
            "ratio": seconds / reference[tolerance][0],
            "outcome": solution.convergence.outcome.name.lower(),
        }  # fmt: skip
    row["counts"] = solution.counts
    return row


def unstructured(size, mu=0.3):
    """The cube in tetrahedra with edges of about `size`."""
    whole = cube(1, mu)
    body = am.Body(models.generated(models.unit_cube, size), am.LinearElastic(200, 0.3))
    return am.Model([body], supports=whole.supports, contacts=whole.contacts)


def row_with_setup(model, repeats):
    """One body's contact against a linear solve, both with their set-up, all stored."""
    problem = model.assemble().assembled()
    held = clamped(problem)
    solver = am.GeometricMultigrid(held.levels)
    setup, _ = best(1, lambda: solver.factor(held.M, held.near_nullspace))
    reference = linear(held, held.levels, repeats)
    prepare, _ = best(1, lambda: ContactLevels.of(problem.fresh()))
    row = {"unknowns": problem.unknowns, "contacts": problem.contacts,
           "linear_setup": setup, "setup": prepare}  # fmt: skip
    for tolerance in TOLERANCES:
        seconds, solution = contact(problem, tolerance, repeats)
        linear_seconds, iterations = reference[tolerance]
        row[f"{tolerance:.0e}"] = {
            "linear_seconds": linear_seconds, "linear_iterations": iterations,
            "seconds": seconds, "cycles": solution.convergence.iterations,
            "ratio": seconds / linear_seconds,
            "whole_ratio": (prepare + seconds) / (setup + linear_seconds),
            "outcome": solution.convergence.outcome.name.lower(),
        }  # fmt: skip
    row["counts"] = solution.counts
    return row


def pair_rows(sizes, repeats):
    """Rows of all pairs without friction and with it, sizes doubling."""
    rows = []
    for name, make in models.PAIRS.items():
        for mu in (0.0, 0.3):
            found = two_bodies_rows(lambda n, make=make, mu=mu: make(n, mu), sizes, repeats)
            rows += [{"what": f"{name}, mu = {mu:g}", **row} for row in found]
            print(json.dumps(rows[-len(sizes) :]), file=sys.stderr, flush=True)
    return rows


def kind_rows(sizes, repeats):
    """Rows of one body of each kind."""
    return [
        {"what": name, **row_with_setup(make(size), repeats)}
        for name, make in models.KINDS.items()
        for size in sizes
    ]


def two_bodies_rows(model, sizes, repeats):
    """Rows of the sizes of a model; the judge reads residuals and forms no W."""
    usual, matrices.CHEAP = matrices.CHEAP, 0.0
    usual_work, matrices.EXACT_WORK = matrices.EXACT_WORK, 0.0
    rows = [two_bodies_row(model(size), repeats) for size in sizes]
    matrices.CHEAP, matrices.EXACT_WORK = usual, usual_work
    return rows


def friction_rows(level):
    """Cycles for some friction coefficients."""
    problem = cube(level).assemble()
    rows = []
    for mu in FRICTION:
        found = [
            drive(problem.with_mu(mu), am.ContactMultigrid(), tolerance=t) for t in TOLERANCES
        ]
        rows.append({
            "mu": mu, "counts": found[-1].counts,
            "cycles": [s.convergence.iterations for s in found],
            "outcomes": [s.convergence.outcome.name.lower() for s in found],
        })  # fmt: skip
    return rows


def page(record):
    """The results as Markdown."""
    machine = "; ".join(f"{k} {v}" for k, v in record["machine"].items())
    lines = ["# Contact multigrid against one linear solve", ""]
    lines += [f"Regenerate: `python benchmarks/multigrid.py`.  {machine}.", "", _text(), ""]
    for name, title in (
        ("cube", "The Coulomb cube, levels of the mesh"),
        ("stored", "The same, the matrix stored on both sides"),
        ("unstored", "The same, the matrix stored on neither side"),
        ("algebraic", "Without levels: smoothed aggregation"),
    ):
        lines += [f"## {title}", "", *_table(record[name], CUBE)]
    lines += [f"## Friction, level {record['friction_level']}", ""]
    lines += ["| mu | open / slip / stick | cycles to 1e-8 | to 1e-10 |", "|---|---|---|---|"]
    for row in record["friction"]:
        counts = " / ".join(str(row["counts"][k]) for k in ("open", "slip", "stick"))
        cycles = " | ".join(
            f"{c}" if o == "converged" else o
            for c, o in zip(row["cycles"], row["outcomes"], strict=True)
        )
        lines.append(f"| {row['mu']} | {counts} | {cycles} |")
    lines += [""]
    for name, title, columns in (
        ("mortar", "Two blocks, dual mortar on meshes that do not match", PAIR),
        ("unstructured", "Tetrahedra of a mesh generator, mu = 0.3", SINGLE),
        ("shell", "The body in the spherical shell, mu = 0.5, levels 2 to 4", PAIR),
        ("pairs", "Pairs, every size twice as fine as the one before", WHAT | PAIR),
        ("kinds", "Plates, flat cells, layers, second order, mu = 0.3", WHAT | SINGLE),
    ):
        if name in record:
            lines += [f"## {title}", "", *_table(record[name], columns)]
    return "\n".join(lines) + "\n"


def _text():
    return " ".join(__doc__.split("\n\n")[2].split())


def _table(rows, columns):
    """Lines of a table: a line for every row and tolerance, columns {title: what is in it}."""
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for row in rows:
        for tolerance in TOLERANCES:
            part = row[f"{tolerance:.0e}"] | {"to": f"{tolerance:.0e}"}
            cells = [str(column(row, part)) for column in columns.values()]
            lines.append(f"| {' | '.join(cells)} |")
    return [*lines, ""]


def _counts(row):
    return " / ".join(str(row["counts"][k]) for k in ("open", "slip", "stick"))


def _cycles(part):
    """Cycles, or why there is no solution."""
    return part["cycles"] if part["outcome"] == "converged" else part["outcome"]


SIZES = {
    "unknowns": lambda row, part: row["unknowns"],
    "contacts": lambda row, part: row["contacts"],
    "open / slip / stick": lambda row, part: _counts(row),
    "to": lambda row, part: part["to"],
}
WHAT = {"what": lambda row, part: row["what"]}
RATIO = {"ratio": lambda row, part: f"{part['ratio']:.2f}"}
CONTACT = {"contact: cycles, s": lambda row, part: f"{_cycles(part)}, {part['seconds']:.3g}"}
PAIR = SIZES | {
    "linear, clamped: iterations, s":
        lambda row, part: f"{part['linear_iterations']}, {part['linear_seconds']:.3g}",
    "linear, free: iterations, s":
        lambda row, part: f"{part['free_iterations']}, {part['free_seconds']:.3g}",
} | CONTACT | RATIO  # fmt: skip
SINGLE = SIZES | {
    "linear: set-up, iterations, s":
        lambda row, part: f"{row['linear_setup']:.3g}, {part['linear_iterations']}, "
                          f"{part['linear_seconds']:.3g}",
    "contact: set-up, cycles, s":
        lambda row, part: f"{row['setup']:.3g}, {_cycles(part)}, {part['seconds']:.3g}",
} | RATIO | {"with set-up": lambda row, part: f"{part['whole_ratio']:.2f}"}  # fmt: skip
CUBE = {
    "level": lambda row, part: row["level"],
    "unknowns": lambda row, part: row["unknowns"],
    "contact / slip": lambda row, part: f"{row['contact']} / {row['slip']}",
    "reference": lambda row, part: _expected(row)[0],
    "resultant off": lambda row, part: _expected(row)[1],
    "to": lambda row, part: part["to"],
    "linear: iterations, s":
        lambda row, part: f"{part['linear_iterations']}, {part['linear_seconds']:.3g}",
} | CONTACT | RATIO  # fmt: skip


def _expected(row):
    """Contacts of the published solution, and how far the resultant is off."""
    reference = REFERENCE.get(f"level{row['level']}")
    if not reference:
        return "-", "-"
    plane = np.array(reference["resultant"])
    off = np.abs(np.array(row["resultant"]) - plane).max() / np.abs(plane).max()
    return f"{reference['contact']} / {reference['slip']}", f"{off:.0e}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--levels", default="1,2,3,4,5,6,7")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--friction-level", type=int, default=5)
    parser.add_argument("--sizes", default="0.036,0.024,0.0128", help="edges of tetrahedra")
    parser.add_argument("--only", help="parts to measure again, with commas")
    given = parser.parse_args()
    levels = [int(x) for x in given.levels.split(",")]
    repeats = given.repeats
    cube_row(2, 1)  # compile
    parts = {
        "cube": lambda: [cube_row(level, repeats) for level in levels],
        "stored": lambda: other_engine_rows([k for k in levels if k in (5, 6)], repeats, 1e12),
        "unstored": lambda: other_engine_rows([k for k in levels if k == 4], repeats, 1),
        "algebraic": lambda: other_engine_rows(
            [k for k in levels if 3 <= k <= 5], repeats, 1e12, algebraic=True
        ),
        "friction": lambda: friction_rows(given.friction_level),
        "mortar": lambda: two_bodies_rows(stacked, (2, 4, 8), repeats),
        "shell": lambda: two_bodies_rows(lambda k: shell(k, 0.5), (2, 3, 4), repeats),
        "kinds": lambda: kind_rows((1, 2, 4), 0),
    }
    if importlib.util.find_spec("gmsh"):
        sizes = map(float, given.sizes.split(","))
        parts["unstructured"] = lambda: [
            row_with_setup(unstructured(size), repeats) for size in sizes
        ]
        parts["pairs"] = lambda: pair_rows((1, 2, 4, 8), 0)  # cycles count
    record = {"friction_level": given.friction_level}
    if given.only:
        record = json.loads((HERE / "results/multigrid.json").read_text())
    for name in given.only.split(",") if given.only else parts:
        record[name] = parts[name]()
        print(name, json.dumps(record[name]), file=sys.stderr, flush=True)
    record["machine"] = describe()
    (HERE / "results/multigrid.json").write_text(json.dumps(record, indent=1) + "\n")
    text = page(record)
    (HERE / "results/multigrid.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
