"""The methods of the paper within Siconos, by whose authors it is, on some of its problems.

From r = 0, given W, one call of Siconos after another, each asked for less.  Siconos stops on
its own error; for each tolerance of (13) the quickest call that meets it counts.  What is
stored looks like our own runs, so the same claims are drawn from it.

Siconos counts no operations.  A Newton step of it is a sparse LU of MUMPS, which tells what its
elimination takes; a sweep takes what one of ours does.  Its iterations times these are its cost
by operations; what judging and forming matrices takes is left out.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

import amontons as am
from amontons.problem.judge.measures import published_natural_error
from amontons.solvers.driver import drive

from .claims import HYBRID_SWEEPS
from .methods import HYBRID, METHODS, SWEEPING
from .race import TOLERANCES, Cost, Runs, best_run, key
from .ratios import cost_text, number, solved
from .step import calls, write_problem

SOLVERS = {
    "NSN-AC": "NLS_AC",
    "NSN-JM": "NLS_JM",
    "NSN-NM": "NLS_NM",
    HYBRID: "NLS_HYBRID",
    "NSGS-AC": "NSGS",
    "NSGS-FP-VI-UPK": "NSGS_UPK",
    "NSN-FB": "NSN_FB",
}
ASKED = (1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # of Siconos, on its own error
COST = Cost("seconds", "13")
BESIDE = ("NSN-AC", "NSN-FB")  # ours, measured in the same run


def race(
    paths: Sequence[Path], python: str, limit: float, runs: dict[str, Runs],
    report: Callable[[str], None] = print,
) -> dict[str, Runs]:  # fmt: skip
    """"siconos" and "ours" by problem; limit: processor seconds for a call."""
    for path in paths:
        problem = am.read_fclib(path)
        condensed = problem.condensed()
        theirs = {}
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "problem.npz"
            write_problem(file, problem, condensed, np.zeros((problem.contacts, 3)))
            for name, solver in SOLVERS.items():
                theirs[name] = _run(condensed, python, file, solver, limit)
        ours = {m.name: best_run(condensed, m, limit) for m in METHODS if m.name in BESIDE}
        sizes = {"contacts": problem.contacts, "density": condensed.blocks.density}
        runs.setdefault("siconos", {})[path.stem] = sizes | {"methods": theirs}
        runs.setdefault("ours", {})[path.stem] = sizes | {"methods": ours}
        report(f"{path.stem}: Siconos " + ", ".join(
            f"{name} {cost_text(COST.met(run, TOLERANCES[-1]))}" for name, run in theirs.items()
        ))  # fmt: skip
    return runs


def _run(
    condensed: am.FrictionProblem, python: str, file: Path, solver: str, limit: float
) -> dict[str, Any]:
    """A run as `race.one_run` has it; tolerances beyond one that was missed are missed."""

    def measure(r: np.ndarray) -> float:
        u = condensed.velocity(r)[0]
        return published_natural_error(r, u, condensed.free_velocity, condensed.law)

    found, why, spent = calls(python, file, solver, limit, ASKED, measure, TOLERANCES[-1])
    met: dict[str, list[float | None]] = {}
    for tolerance in TOLERANCES:
        passing = [x for x in found if x["error"] <= tolerance and x["seconds"] <= limit]
        if passing:
            best = min(passing, key=lambda x: x["seconds"])
            met[key(tolerance)] = [best["seconds"], best["iterations"], None]
    done = key(TOLERANCES[-1]) in met
    longest = max((x["seconds"] for x in found), default=0.0)
    return {
        "outcome": "converged" if done else why if len(found) < len(ASKED) else "missed",
        "error": min((x["error"] for x in found), default=np.inf),
        "seconds": longest if done else max(spent, longest),
        "flops": None,
        "limit": limit,
        "met": {"13": met},
    }


def elimination_flops(problem: am.FrictionProblem) -> float | None:
    """Operations of MUMPS in an LU of Newton's matrix on W at the solution; None without it.

    Rows of open contacts are those of the identity, as in (8) to (10); where the others are
    scaled does not matter to the count.
    """
    try:
        import mumps
    except ImportError:
        return None
    found = drive(problem, tolerance=TOLERANCES[-1])
    closed = np.repeat(found.status != am.ContactStatus.OPEN, problem.dimension)
    weights = np.where(closed, np.repeat(problem.rho, problem.dimension), 0.0)
    matrix = sparse.diags_array(weights) @ sparse.csr_array(problem.W)
    matrix += sparse.diags_array(np.where(closed, 1e-3, 1.0))
    context = mumps.Context()
    context.set_matrix(sparse.csc_matrix(matrix))
    context.factor()
    return float(context.mumps_instance.rinfog[3])


def with_operations(theirs: Runs, ours: Runs, steps: dict[str, float | None]) -> Runs | None:
    """Runs of Siconos with operations, from our sweeps and the LU of MUMPS; None if unknown.

    ours: runs of both sweeping methods on the same problems; steps: of `elimination_flops`.
    """
    out: Runs = {}
    for stem, entry in theirs.items():
        step, mine = steps.get(stem), ours.get(stem, {"methods": {}})["methods"]
        if step is None or not all(mine.get(name, {}).get("flops") for name in SWEEPING):
            return None
        sweep = {name: mine[name]["flops"] / mine[name]["iterations"] for name in SWEEPING}
        methods = {
            name: _counted(run, name, sweep, step) for name, run in entry["methods"].items()
        }
        out[stem] = entry | {"methods": methods}
    return out


def _counted(
    run: dict[str, Any], name: str, sweep: dict[str, float], step: float
) -> dict[str, Any]:
    """A run with the operations of its iterations."""

    def flops(iterations: float) -> float:
        if name in sweep:
            return sweep[name] * iterations
        first = min(HYBRID_SWEEPS, iterations) if name == HYBRID else 0
        return sweep[SWEEPING[0]] * first + step * (iterations - first)

    met = {key: [*found[:2], flops(found[1])] for key, found in run["met"]["13"].items()}
    last = next(reversed(met.values()), None)
    rate = last[2] / last[0] if last else math.nan  # of a run that ended at the limit
    return run | {"met": {"13": met}, "flops": rate * run["seconds"]}


def table(runs: dict[str, Runs]) -> str:
    """Markdown: solved and median seconds of Siconos by method and tolerance of (13)."""
    theirs = runs["siconos"]
    head = [f"to {t:g}: solved, median" for t in TOLERANCES]
    rows = ["| Siconos | " + " | ".join(head) + " |", "|---|" + "---|" * len(head)]
    for name, solver in SOLVERS.items():
        if not all(name in entry["methods"] for entry in theirs.values()):
            continue
        cells = []
        for t in TOLERANCES:
            costs = [COST.met(entry["methods"][name], t) for entry in theirs.values()]
            middle = cost_text(float(np.median(costs)))
            cells.append(f"{solved(theirs, name, t, COST)}, {middle}")
        rows.append(f"| {name} ({solver}) | {' | '.join(cells)} |")
    return "\n".join(rows)


def steps_table(runs: dict[str, Runs]) -> str:
    """Markdown: what a Newton step takes, ours and theirs in one run, and their number."""
    rows = [
        "| problem | contacts | a step, ours | Siconos | ratio | steps, ours | Siconos |",
        "|---|---|---|---|---|---|---|",
    ]
    for stem, entry in runs["siconos"].items():
        found = [
            _each(each["methods"]["NSN-AC"]) for each in (runs["ours"][stem], entry)
        ]
        (mine, k), (theirs, n) = found
        cells = [str(entry["contacts"]), cost_text(mine), cost_text(theirs),
                 number(mine / theirs), f"{k:g}", f"{n:g}"]  # fmt: skip
        rows.append(f"| {stem} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _each(run: dict[str, Any]) -> tuple[float, float]:
    """Seconds of a step and their number, to the tightest tolerance that was met."""
    found = [value for value in run["met"]["13"].values() if value[1]]
    return (found[-1][0] / found[-1][1], found[-1][1]) if found else (np.nan, np.nan)
