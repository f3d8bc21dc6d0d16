"""`amontons bench`: times to reach a tolerance, side by side, and performance profiles."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import click
import numpy as np

from .. import api, output
from ..analysis.profiles import performance_profile
from ..case import Settings
from ..clock import compiling, now
from ..errors import InvalidInput, SingularOperator, UnsupportedForm
from ..problem import Form, FrictionProblem
from ..solution import TELLING, Convergence, Outcome
from .sources import open_source, with_flags
from .terminal import check_writable, deliver_json, show_table

SCHEMA = "amontons/bench/1"
REPEATS = 5
BUDGET = 2.0  # seconds after which a solve is not repeated again


@dataclass(frozen=True)
class Timing:
    """One method on one file to one tolerance; seconds is infinite when it failed.

    compiling: seconds of preparing compiled code, once, which no other time holds.
    """

    file: str
    method: str
    tolerance: float
    seconds: float
    outcome: str
    error: float
    iterations: int
    compiling: float = 0.0


def run(
    files: Sequence[str], methods: str, tolerances: str, time_limit: float,
    profile: str | None, json_copy: str | None,
) -> None:  # fmt: skip
    """Check all input, solve all, show."""
    check_writable(profile, "--profile", output.FIGURES)
    check_writable(json_copy, "--json")
    names = _words("methods", methods)
    goals = [_tolerance(text) for text in _words("tolerances", tolerances)]
    sources = {file: open_source(file) for file in files}
    for source in sources.values():
        for name in names:
            with_flags(source.settings, name, goals[0], time_limit=time_limit)
    timings = []
    for file, source in sources.items():
        problem = source.discrete()
        for goal in goals:
            for name in names:
                timings.append(_time(file, problem, name, goal, time_limit))
                _progress(f"{source.name}  {name}  {goal:g}")
    _progress("")
    if json_copy != "-":
        _show(timings, names, goals)
    if profile is not None:
        _draw(timings, names, goals, Path(profile))
    if json_copy is not None:
        rows = [asdict(timing) for timing in timings]
        data = {"schema": SCHEMA, "versions": output.versions(), "results": rows}
        deliver_json(output.to_json(data), json_copy)


def _progress(text: str) -> None:
    """What runs now, on one line that is overwritten; nothing where nobody looks."""
    if sys.stderr.isatty():
        click.echo(f"\r\x1b[K{text}", err=True, nl=False)


def _words(option: str, text: str) -> list[str]:
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words:
        raise InvalidInput(f"{option}: expected words with commas between them, got {text!r}")
    return words


def _tolerance(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < 1:
        raise InvalidInput(f"tolerances: expected numbers between 0 and 1, got {text!r}")
    return value


def _fresh(problem: FrictionProblem) -> FrictionProblem:
    """The problem as read: nothing factored or condensed; W is in blocks, as after reading."""
    fresh = replace(problem, _shared={})
    if fresh.form is Form.DELASSUS:
        _ = fresh.kernel_data
    return fresh


def _time(
    file: str, problem: FrictionProblem, method: str, tolerance: float, limit: float
) -> Timing:
    """Best time of some runs; the first one warms up, and counts where twice would be long."""
    best, spent, compiled = math.inf, 0.0, compiling()
    seconds, record = _once(problem, method, tolerance, limit)
    if isinstance(record, str):
        return Timing(file, method, tolerance, math.inf, record, math.inf, 0)
    if seconds > BUDGET:
        best = seconds if record.outcome is Outcome.CONVERGED else math.inf
        spent = seconds
    for _ in range(REPEATS):
        if spent > BUDGET:
            break
        seconds, record = _once(problem, method, tolerance, limit)
        assert not isinstance(record, str)
        spent += seconds
        if record.outcome is not Outcome.CONVERGED:
            break
        best = min(best, seconds)
    outcome = record.outcome.name.lower()
    return Timing(file, method, tolerance, best, outcome, record.error, record.iterations,
                  compiling() - compiled)  # fmt: skip


def _once(
    problem: FrictionProblem, method: str, tolerance: float, limit: float
) -> tuple[float, Convergence | str]:
    """Seconds and record of one solve, or why the method does not fit."""
    fresh, solver = _fresh(problem), Settings(method).solver()
    began = now()
    try:
        found = api.solve_any_form(
            fresh, solver, tolerance=tolerance, time_limit=limit,
            callback=lambda step, iterate: None,
        )  # fmt: skip
    except (UnsupportedForm, SingularOperator, InvalidInput) as reason:
        return math.inf, str(reason)
    if found.convergence.outcome is Outcome.STOPPED:
        raise KeyboardInterrupt
    return now() - began, found.convergence


# ------------------------------------------------------------------------------ showing
def _show(timings: list[Timing], names: list[str], goals: list[float]) -> None:
    """One line per file and tolerance, one column per method."""
    table = {(t.file, t.tolerance, t.method): t for t in timings}
    rows = []
    for file in dict.fromkeys(t.file for t in timings):
        for goal in goals:
            cells = [table[file, goal, name] for name in names]
            best = min(cell.seconds for cell in cells)
            rows.append([Path(file).stem, f"{goal:g}", *[_cell(cell, best) for cell in cells]])
    compiled = sum(timing.compiling for timing in timings)
    show_table("Time to solution", ["problem", "tolerance", *names], rows)
    solved = [
        f"{name} {sum(math.isfinite(t.seconds) for t in timings if t.method == name)}"
        for name in names
    ]
    click.echo(f"solved of {len(timings) // len(names)}: {', '.join(solved)}")
    if compiled >= TELLING:
        click.echo(f"compiling, once and not counted: {compiled:.2g} s")


def _cell(timing: Timing, best: float) -> str:
    if not math.isfinite(timing.seconds):
        failed = timing.outcome.replace("_", " ")
        return f"[red]{failed if len(failed) < 20 else 'does not fit'}[/red]"
    text = f"{1e3 * timing.seconds:.3g} ms" if timing.seconds < 1 else f"{timing.seconds:.3g} s"
    return f"[bold]{text}[/bold]" if timing.seconds == best else text


def _draw(timings: list[Timing], names: list[str], goals: list[float], path: Path) -> None:
    """One panel per tolerance."""
    from ..plots import profile_figure, save_figure

    profiles = {}
    for goal in goals:
        columns = [
            [t.seconds for t in timings if t.method == name and t.tolerance == goal]
            for name in names
        ]
        profiles[goal] = performance_profile(np.array(columns).T)
    save_figure(profile_figure(profiles, names), path)
