"""Contact multigrid on the problems of hueeber2008, against one linear elasticity solve.

    python benchmarks/multigrid.py [--levels 3,4,5,6,7] [--repeats 3] [--only mortar,shell]
    python benchmarks/multigrid.py --only unstructured [--sizes 0.033,0.0145]

Linear solve: the same bodies with their contact faces clamped, conjugate gradients with one
V(1,1) cycle of `GeometricMultigrid`, zero start, to the same relative residual.  Contact: the
whole of `drive(problem, ContactMultigrid())`, cold start, the nested start and all evaluations
of the judge included.  Levels, node blocks and what else depends on the matrices alone are
prepared before on both sides; compiled code is warm.  Both sides use the same engine: stored
blocks and block Gauss-Seidel, from 50 000 dofs on no matrix and Chebyshev smoothing.  CPU
seconds of one thread, best of the repeats.  Two bodies are judged by their residual: forming W
for the judge would take many times as long as the solve.  Unstructured: the cube in tetrahedra
of gmsh (not installed by default), with set-up: what depends on the matrices alone.

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
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

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
    """(CPU seconds, result) of the quickest of some runs; one more run before warms up."""
    run()
    times = []
    for _ in range(repeats):
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


def unstructured(size, mu):
    """The cube in tetrahedra with edges of about `size`."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Algorithm3D", 10)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        box = gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [box], name="body")
        for name, z in (("bottom", 0.0), ("top", 1.0)):
            corner = (-0.1, -0.1, z - 0.1), (1.1, 1.1, z + 0.1)
            found = gmsh.model.getEntitiesInBoundingBox(*corner[0], *corner[1], dim=2)
            gmsh.model.addPhysicalGroup(2, [tag for _, tag in found], name=name)
        gmsh.model.mesh.generate(3)
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "cube.msh")
            gmsh.write(path)
            mesh = am.read_mesh(path)
    finally:
        gmsh.finalize()
    whole = cube(1, mu)
    body = am.Body(mesh, am.LinearElastic(young=200, poisson=0.3))
    return am.Model([body], supports=whole.supports, contacts=whole.contacts)


def unstructured_row(size, repeats, mu=0.3):
    """Contact against a linear solve, both with algebraic levels and with their set-up."""
    problem = unstructured(size, mu).assemble()
    held = clamped(problem)
    setup, _ = best(1, lambda: am.GeometricMultigrid().factor(held.M, held.near_nullspace))
    reference = linear(held, (), repeats)
    prepare, _ = best(1, lambda: ContactLevels.of(problem.fresh()))
    row = {"unknowns": problem.unknowns, "contacts": problem.contacts, "mu": mu,
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
    lines += _cube_table(record["cube"], "## The Coulomb cube, levels of the mesh")
    lines += _cube_table(record["stored"], "## The same, the matrix stored on both sides")
    lines += _cube_table(record["unstored"], "## The same, the matrix stored on neither side")
    lines += _cube_table(record["algebraic"], "## Without levels: smoothed aggregation")
    lines += [f"## Friction, level {record['friction_level']}", ""]
    lines += ["| mu | open / slip / stick | cycles to 1e-8 | to 1e-10 |", "|---|---|---|---|"]
    for row in record["friction"]:
        counts = " / ".join(str(row["counts"][k]) for k in ("open", "slip", "stick"))
        cycles = " | ".join(
            f"{c}" if o == "converged" else o
            for c, o in zip(row["cycles"], row["outcomes"], strict=True)
        )
        lines.append(f"| {row['mu']} | {counts} | {cycles} |")
    lines += ["", "## Two blocks, dual mortar on meshes that do not match", ""]
    lines += _two_bodies_table(record["mortar"])
    if "unstructured" in record:
        lines += ["", "## Tetrahedra of a mesh generator, mu = 0.3", ""]
        lines += _unstructured_table(record["unstructured"])
    lines += ["", "## The body in the spherical shell, mu = 0.5, levels 2 to 4", ""]
    lines += _two_bodies_table(record["shell"])
    return "\n".join(lines) + "\n"


def _two_bodies_table(rows):
    lines = ["| unknowns | contacts | open / slip / stick | to | linear, clamped: iterations, "
             "s | linear, free: iterations, s | contact: cycles, s | ratio |",
             "|" + "---|" * 8]  # fmt: skip
    for row in rows:
        counts = " / ".join(str(row["counts"][k]) for k in ("open", "slip", "stick"))
        for tolerance in TOLERANCES:
            part = row[f"{tolerance:.0e}"]
            lines.append(
                f"| {row['unknowns']} | {row['contacts']} | {counts} | {tolerance:.0e} | "
                f"{part['linear_iterations']}, {part['linear_seconds']:.3g} | "
                f"{part['free_iterations']}, {part['free_seconds']:.3g} | "
                f"{part['cycles']}, {part['seconds']:.3g} | {part['ratio']:.2f} |"
            )
    return lines


def _unstructured_table(rows):
    lines = ["| unknowns | contacts | open / slip / stick | to | linear: set-up, iterations, "
             "s | contact: set-up, cycles, s | ratio | with set-up |",
             "|" + "---|" * 8]  # fmt: skip
    for row in rows:
        counts = " / ".join(str(row["counts"][k]) for k in ("open", "slip", "stick"))
        for tolerance in TOLERANCES:
            part = row[f"{tolerance:.0e}"]
            lines.append(
                f"| {row['unknowns']} | {row['contacts']} | {counts} | {tolerance:.0e} | "
                f"{row['linear_setup']:.3g}, {part['linear_iterations']}, "
                f"{part['linear_seconds']:.3g} | {row['setup']:.3g}, {part['cycles']}, "
                f"{part['seconds']:.3g} | {part['ratio']:.2f} | {part['whole_ratio']:.2f} |"
            )
    return lines


def _text():
    return " ".join(__doc__.split("\n\n")[2].split())


def _cube_table(rows, title):
    lines = [title, "",
             "| level | unknowns | contact / slip | reference | resultant off | to | linear: "
             "iterations, s | contact: cycles, s | ratio |", "|" + "---|" * 9]  # fmt: skip
    for row in rows:
        reference = REFERENCE.get(f"level{row['level']}")
        expected, off = "-", "-"
        if reference:
            expected = f"{reference['contact']} / {reference['slip']}"
            plane = np.array(reference["resultant"])
            off = (
                f"{np.abs(np.array(row['resultant']) - plane).max() / np.abs(plane).max():.0e}"
            )
        for tolerance in TOLERANCES:
            part = row[f"{tolerance:.0e}"]
            lines.append(
                f"| {row['level']} | {row['unknowns']} | {row['contact']} / {row['slip']} | "
                f"{expected} | {off} | {tolerance:.0e} | {part['linear_iterations']}, "
                f"{part['linear_seconds']:.3g} | {part['cycles']}, {part['seconds']:.3g} | "
                f"{part['ratio']:.2f} |"
            )
    return [*lines, ""]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--levels", default="1,2,3,4,5,6,7")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--friction-level", type=int, default=5)
    parser.add_argument("--sizes", default="0.033,0.0145", help="edges of tetrahedra")
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
    }
    if importlib.util.find_spec("gmsh"):
        sizes = [float(x) for x in given.sizes.split(",")]
        parts["unstructured"] = lambda: [unstructured_row(size, repeats) for size in sizes]
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
