"""Every method on every problem, once, to the tightest tolerance.

The history of the one run tells when each tolerance was met.  Times are processor seconds of
one thread, which other work on the machine does not stretch.  The clock starts with the
problem as a file gives it: with W for the methods of the Delassus form (the time to form it is
measured apart), with M and H for those of the global form.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import amontons as am
from amontons.files import replacing
from amontons.solution import Outcome, Step
from amontons.solve import drive
from amontons.solvers.base import Iterate

from .methods import METHODS, Method

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6)  # the paper's; the first is read only
SHORT, REPEATS = 0.05, 3  # seconds below which a solve is repeated, and how often
WAITING = 4.0  # the clock on the wall may run so many times longer than the processor's
NOBODY: Mapping[str, float] = MappingProxyType({})
Runs = dict[str, dict[str, Any]]  # by problem; "methods" by name


def key(tolerance: float) -> str:
    """How a tolerance is written in the files of results."""
    return f"{tolerance:g}"


def best_run(problem: am.FrictionProblem, method: Method, limit: float) -> dict[str, Any]:
    """`one_run` from the problem as read; the quickest of some where it is short."""
    found = one_run(_fresh(problem), method, limit)
    for _ in range(REPEATS if found["seconds"] < SHORT else 0):
        again = one_run(_fresh(problem), method, limit)
        found = min(found, again, key=lambda run: run["seconds"])
    return found


def one_run(problem: am.FrictionProblem, method: Method, limit: float) -> dict[str, Any]:
    """Outcome, last errors, and by tolerance processor seconds and iterations to meet it."""
    clock = []
    began = time.process_time()

    def watch(step: Step, iterate: Iterate) -> bool:
        clock.append(time.process_time() - began)
        return clock[-1] > limit

    found = drive(
        problem,
        method.solver,
        tolerance=TOLERANCES[-1],
        time_limit=WAITING * limit,
        callback=watch,
    )
    if len(clock) < len(found.convergence.history):  # nobody watches the one that converged
        clock.append(time.process_time() - began)
    met, history = {}, found.convergence.history
    for tolerance in TOLERANCES:
        first = next((k for k, s in enumerate(history) if s.error <= tolerance), None)
        if first is not None and clock[first] <= limit:
            met[key(tolerance)] = [clock[first], history[first].iteration]
    outcome = found.convergence.outcome
    stopped = outcome is Outcome.STOPPED or clock[-1] > limit if clock else False
    published = found.natural_error
    return {
        "outcome": (Outcome.TIME_LIMIT if stopped else outcome).name.lower(),
        "error": found.convergence.error,
        "error_13": published if published is not None else math.nan,
        "iterations": found.convergence.iterations,
        "seconds": clock[-1] if clock else 0.0,
        "limit": limit,
        "counts": found.counts,
        "met": met,
    }


def _fresh(problem: am.FrictionProblem) -> am.FrictionProblem:
    """The problem as read: nothing factored; W is in blocks, as after reading."""
    fresh = replace(problem, _shared={})
    if fresh.form is am.Form.DELASSUS:
        _ = fresh.kernel_data
    return fresh


def race(
    paths: Iterable[Path], methods: Sequence[str], limit: float, runs: Runs,
    report: Callable[[str], None] = print, longer: Mapping[str, float] = NOBODY,
) -> Runs:  # fmt: skip
    """Run the named methods on all files; `runs` is completed and returned.

    limit: seconds for one solve; longer: factors on it by method.  A method of the global form
    is left out where a file has W.
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
            allowed = limit * longer.get(method.name, 1.0)
            if not method.on_global:
                entry["methods"][method.name] = best_run(condensed, method, allowed)
            elif problem.form is am.Form.GLOBAL:
                entry["methods"][method.name] = best_run(problem, method, allowed)
        report(f"{path.stem}: " + ", ".join(
            f"{method.name} {_short(entry['methods'].get(method.name))}" for method in chosen
        ))  # fmt: skip
    return runs


def _compile(methods: Iterable[Method]) -> None:
    """Let every method meet a small problem first."""
    from amontons.gallery import random_delassus

    small = random_delassus(0, 4)
    for method in methods:
        if not method.on_global:
            drive(small, method.solver, tolerance=1e-6, time_limit=60)
    for solver in (am.SmoothingNewton(), am.ProximalPoint()):  # stages of Auto
        drive(small, solver, tolerance=1e-6, time_limit=60)


def _short(run: dict[str, Any] | None) -> str:
    if run is None:
        return "-"
    met = run["met"].get(key(TOLERANCES[-1]))
    return (
        f"{met[0]:.3g} s" if met else f"{run['outcome'].replace('_', ' ')} ({run['error']:.0e})"
    )


def seconds(runs: Runs, names: Sequence[str], tolerance: float) -> list[list[float]]:
    """Times to a tolerance, (problems, methods); infinite where it was not met."""
    return [
        [entry["methods"].get(name, {}).get("met", {}).get(key(tolerance), [math.inf])[0]
         for name in names]
        for entry in runs.values()
    ]  # fmt: skip


def limits(runs: Runs, names: Sequence[str], limit: float) -> list[list[float]]:
    """Limits that the runs had, (problems, methods); `limit` where none is stored."""
    return [
        [entry["methods"].get(name, {}).get("limit", limit) for name in names]
        for entry in runs.values()
    ]


def iterations(runs: Runs, name: str, tolerance: float) -> list[float]:
    """Iterations to a tolerance, one number for each problem; infinite where it was not met."""
    return [
        entry["methods"].get(name, {}).get("met", {}).get(key(tolerance), [0, math.inf])[1]
        for entry in runs.values()
    ]


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
