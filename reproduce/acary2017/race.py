"""Every method on every problem, once, to the tightest tolerance.

The history of the one run tells when each tolerance was met, by our unit-free judge and by the
paper's (13): in processor seconds of one thread, which other work on the machine does not
stretch, and in floating point operations, which the solvers count.  The clock starts with the
problem as a file gives it: with W for the methods of the Delassus form (the time to form it is
measured apart), with M and H for those of the global form.

One limit holds for all, and no run is ended because it makes no progress; one that ends before
the limit (a cycle, a breakdown) is stored with the seconds and operations that it really took,
and bounds rest on those.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import amontons as am
from amontons.core.files import replacing
from amontons.linear.blocks import spatial
from amontons.problem.judge.measures import natural_error
from amontons.problem.solution import Outcome, Step
from amontons.solvers.contract import Iterate
from amontons.solvers.driver import drive

from .methods import METHODS, Method

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6)  # the paper's; the first is read only
GOAL = 1e-7  # of the driver, so that (13), which is some times the judge's error, is met too
SHORT, REPEATS = 0.05, 3  # seconds below which a solve is repeated, and how often
WAITING = 30.0  # the clock on the wall may run so many times longer than the processor's
CRITERIA = ("judge", "13")
Runs = dict[str, dict[str, Any]]  # by problem; "methods" by name


@dataclass(frozen=True)
class Cost:
    """What is compared: "seconds" or "flops", to tolerances on the "judge" or on "13"."""

    by: str
    criterion: str

    def met(self, run: dict[str, Any], tolerance: float) -> float:
        """To reach the tolerance; infinite where it was not, NaN where it is not counted."""
        found = run.get("met", {}).get(self.criterion, {}).get(key(tolerance))
        if found is None:
            return math.inf
        value = found[0] if self.by == "seconds" else found[2]
        return math.nan if value is None else value

    def spent(self, run: dict[str, Any]) -> float:
        """What the whole run took, however it ended."""
        value = run.get(self.by)
        return math.nan if value is None else value


PAPER = Cost("flops", "13")  # as the paper measures
CLOCK = Cost("seconds", "judge")


def key(tolerance: float) -> str:
    """How a tolerance is written in the files of results."""
    return f"{tolerance:g}"


def best_run(problem: am.FrictionProblem, method: Method, limit: float) -> dict[str, Any]:
    """`one_run` from the problem as read; the quickest of some where it is short."""
    seen = problem.condensed()
    found = one_run(fresh(problem), method, limit, seen)
    for _ in range(REPEATS if found["seconds"] < SHORT else 0):
        again = one_run(fresh(problem), method, limit, seen)
        found = min(found, again, key=lambda run: run["seconds"])
    return found


def one_run(
    problem: am.FrictionProblem, method: Method, limit: float, condensed: am.FrictionProblem
) -> dict[str, Any]:
    """Outcome, last errors, and by tolerance seconds, iterations, operations to meet it.

    condensed: the same problem with W, on which (13) is evaluated while the clock stands still.
    """
    ones = np.ones(problem.contacts)
    rows: list[tuple[float, int, float | None, float, float]] = []
    began, watched = time.process_time(), 0.0

    def watch(step: Step, iterate: Iterate) -> bool:
        nonlocal watched
        now = time.process_time()
        seconds = now - began - watched
        # the sum of the paper's (13), by the compiled judge with rho = 1
        r = spatial(iterate.r)
        indptr, indices, data, q, kind, parameters, _ = condensed.kernel_data
        natural = natural_error(indptr, indices, data, q, kind, parameters, ones, r)
        natural /= condensed.q_norm
        rows.append((seconds, step.iteration, step.flops, step.error, natural))
        done = max(step.error, natural) <= TOLERANCES[-1]
        watched += time.process_time() - now
        return done or seconds > limit

    found = drive(problem, method.solver, tolerance=GOAL, time_limit=WAITING * limit,
                  callback=watch, patience=None)  # fmt: skip
    record = found.convergence
    if not rows:  # r = 0 solves it
        rows.append((time.process_time() - began, 0, record.flops, record.error, 0.0))
    met: dict[str, dict[str, list[float | None]]] = {name: {} for name in CRITERIA}
    for column, name in enumerate(CRITERIA, start=3):
        for tolerance in TOLERANCES:
            first = next((row for row in rows if row[column] <= tolerance), None)
            if first is not None and first[0] <= limit:
                met[name][key(tolerance)] = list(first[:3])
    done = any(key(TOLERANCES[-1]) in found for found in met.values())
    late = rows[-1][0] > limit or record.outcome is Outcome.TIME_LIMIT
    outcome = Outcome.CONVERGED if done else Outcome.TIME_LIMIT if late else record.outcome
    return {
        "outcome": outcome.name.lower(),
        "error": record.error,
        "error_13": min(row[4] for row in rows),
        "iterations": rows[-1][1],
        "seconds": rows[-1][0],
        "flops": rows[-1][2],
        "limit": limit,
        "counts": found.counts,
        "met": met,
    }


def fresh(problem: am.FrictionProblem) -> am.FrictionProblem:
    """The problem as read: nothing factored; W is in blocks, as after reading."""
    fresh = problem.fresh()
    if fresh.form is am.Form.DELASSUS:
        _ = fresh.kernel_data
    return fresh


def race(
    paths: Iterable[Path], methods: Sequence[str], limit: float, runs: Runs,
    report: Callable[[str], None] = print,
) -> Runs:  # fmt: skip
    """Run the named methods on all files; `runs` is completed and returned.

    limit: seconds for one solve, the same for all.  A method of the global form is left out
    where a file has W.
    """
    chosen = [method for method in METHODS if method.name in methods]
    warmed = False
    for path in paths:
        problem = am.read_fclib(path)
        began = time.process_time()
        condensed = problem.condensed()
        condensing = time.process_time() - began
        if not warmed:  # the first calls compile
            _compile(chosen)
            warmed = True
        entry = runs.setdefault(path.stem, {"methods": {}})
        entry |= {"contacts": problem.contacts, "unknowns": problem.unknowns,
                  "density": condensed.blocks.density, "q": condensed.q_norm}  # fmt: skip
        if problem.form is am.Form.GLOBAL:
            entry.setdefault("condensing", condensing)
        for method in chosen:
            if not method.on_global:
                entry["methods"][method.name] = best_run(condensed, method, limit)
            elif problem.form is am.Form.GLOBAL:
                entry["methods"][method.name] = best_run(problem, method, limit)
        report(f"{path.stem}: " + ", ".join(
            f"{method.name} {_short(entry['methods'].get(method.name))}" for method in chosen
        ))  # fmt: skip
    return runs


def _compile(methods: Iterable[Method]) -> None:
    """Let every method meet a small problem first."""
    from amontons.mechanics.ready.gallery import random_delassus

    small = random_delassus(0, 4)
    for method in methods:
        if not method.on_global:
            drive(small, method.solver, tolerance=1e-6, time_limit=60)
    for solver in (am.SmoothingNewton(), am.ProximalPoint()):  # stages of Auto
        drive(small, solver, tolerance=1e-6, time_limit=60)


def _short(run: dict[str, Any] | None) -> str:
    if run is None:
        return "-"
    seconds = CLOCK.met(run, TOLERANCES[-1])
    if math.isfinite(seconds):
        return f"{seconds:.3g} s"
    return f"{run['outcome'].replace('_', ' ')} ({run['error']:.0e})"


def costs_to(
    runs: Runs, names: Sequence[str], tolerance: float, cost: Cost = CLOCK
) -> list[list[float]]:
    """Costs to a tolerance, (problems, methods); infinite where it was not met."""
    return [
        [cost.met(entry["methods"].get(name, {}), tolerance) for name in names]
        for entry in runs.values()
    ]


def costs_spent(runs: Runs, names: Sequence[str], cost: Cost = CLOCK) -> list[list[float]]:
    """Costs of the whole runs, (problems, methods): bounds where a tolerance was not met."""
    return [
        [cost.spent(entry["methods"].get(name, {})) for name in names]
        for entry in runs.values()
    ]


def iterations(
    runs: Runs, name: str, tolerance: float, criterion: str = "judge"
) -> list[float]:
    """Iterations to a tolerance, one number for each problem; infinite where it was not met."""
    return [
        entry["methods"].get(name, {}).get("met", {}).get(criterion, {})
        .get(key(tolerance), [0, math.inf])[1]
        for entry in runs.values()
    ]  # fmt: skip


def load(path: Path) -> dict[str, Any]:
    """What is stored, or an empty record."""
    return json.loads(path.read_text()) if path.is_file() else {"runs": {}}


def store(path: Path, record: dict[str, Any]) -> None:
    """Write a record of runs; nothing on failure."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(_rounded(record), indent=1) + "\n")


def _rounded(value: Any) -> Any:
    """Numbers to six digits, so that files of results stay small."""
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    if isinstance(value, dict):
        return {name: _rounded(part) for name, part in value.items()}
    return [_rounded(part) for part in value] if isinstance(value, list | tuple) else value
