"""`amontons bench`: times to reach a tolerance, side by side, and performance profiles.

A race has one limit for all and no other end: no method is given up because it makes no
progress, so a time without a solution is the time that was really spent.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from ...analysis.profiles import performance_profile
from ...core.clock import compiling, duration, now
from ...core.errors import InvalidInput, SingularOperator, UnsupportedForm
from ...io import results as output
from ...problem.friction import Form, FrictionProblem
from ...problem.judge.measures import Criterion
from ...problem.solution import TELLING, Convergence, Outcome
from .. import api
from .contestants import Contestant, contestants
from .sources import open_source
from .terminal import check_writable, deliver_json, report_folder, show_table, write_report

if TYPE_CHECKING:
    from ...io.report import Page

SCHEMA = "amontons/bench/1"
REPEATS = 5
BUDGET = 2.0  # seconds after which a solve is not repeated again


@dataclass(frozen=True)
class Stop:
    """How every run ends: seconds for each solve, and what the tolerances are for."""

    seconds: float
    criterion: Criterion


@dataclass(frozen=True)
class Timing:
    """One method on one file to one tolerance; seconds is infinite when it failed.

    flops: floating point operations to get there, None where the method does not count its own;
    spent: seconds of the run, whatever its end: at least so many a failure would have taken;
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
    flops: float | None = None
    spent: float = 0.0

    def cost(self, by: str) -> float:
        """Seconds or operations, infinite when it failed, NaN where they are not counted."""
        if not math.isfinite(self.seconds):
            return math.inf
        flops = math.nan if self.flops is None else self.flops
        return self.seconds if by == "time" else flops


def run(
    files: Sequence[str], methods: Sequence[str], tolerances: str, time_limit: float,
    profile: str | None, json_copy: str | None, by: str = "time", criterion: str = "judge",
    report: bool = False, folder: str | None = None,
) -> None:  # fmt: skip
    """Check all input, solve all, show."""
    check_writable(profile, "--profile", output.FIGURES)
    check_writable(json_copy, "--json")
    place = report_folder(report, folder, "bench-results")
    racing = contestants(methods)
    goals = [_tolerance(text) for text in _words("tolerances", tolerances)]
    if not time_limit > 0:
        raise InvalidInput(f"time-limit: expected seconds > 0, got {time_limit}")
    stop = Stop(time_limit, Criterion(criterion))
    sources = {file: open_source(file) for file in files}
    timings = []
    for file, source in sources.items():
        problem = source.discrete()
        for goal in goals:
            for method in racing:
                timings.append(_time(file, problem, method, goal, stop))
                _progress(f"{source.name}  {method.name}  {goal:g}")
    _progress("")
    names = [method.name for method in racing]
    if json_copy != "-":
        _show(timings, names, goals, by)
    if profile is not None:
        _draw(timings, names, goals, Path(profile), by)
    if place is not None:
        write_report(_page(timings, names, goals, by, stop), place)
    if json_copy is not None:
        rows = [asdict(timing) for timing in timings]
        data = {"schema": SCHEMA, "versions": output.versions(), "time_limit": time_limit,
                "criterion": criterion, "results": rows}  # fmt: skip
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
    fresh = problem.fresh()
    if fresh.form is Form.DELASSUS:
        _ = fresh.kernel_data
    return fresh


def _time(
    file: str, problem: FrictionProblem, method: Contestant, tolerance: float, stop: Stop
) -> Timing:
    """Best time of some runs; the first one warms up, and counts where twice would be long."""
    best, spent, compiled = math.inf, 0.0, compiling()
    seconds, record = _once(problem, method, tolerance, stop)
    if isinstance(record, str):
        return Timing(file, method.name, tolerance, math.inf, record, math.inf, 0)
    if seconds > BUDGET:
        best = seconds if record.outcome is Outcome.CONVERGED else math.inf
        spent = seconds
    for _ in range(REPEATS):
        if spent > BUDGET:
            break
        seconds, record = _once(problem, method, tolerance, stop)
        assert not isinstance(record, str)
        spent += seconds
        if record.outcome is not Outcome.CONVERGED:
            break
        best = min(best, seconds)
    outcome = record.outcome.name.lower()
    return Timing(file, method.name, tolerance, best, outcome, record.error, record.iterations,
                  compiling() - compiled, record.flops, spent=seconds)  # fmt: skip


def _once(
    problem: FrictionProblem, method: Contestant, tolerance: float, stop: Stop
) -> tuple[float, Convergence | str]:
    """Seconds and record of one solve, or why the method does not fit."""
    fresh, solver = _fresh(problem), method.settings.solver()
    began = now()
    try:
        found = api.solve_any_form(
            fresh, solver, tolerance=tolerance, time_limit=stop.seconds,
            criterion=stop.criterion, patience=None,
            callback=lambda step, iterate: None,
        )  # fmt: skip
    except (UnsupportedForm, SingularOperator, InvalidInput) as reason:
        return math.inf, str(reason)
    if found.convergence.by_user:
        raise KeyboardInterrupt
    return now() - began, found.convergence


# ------------------------------------------------------------------------------ showing
def _show(timings: list[Timing], names: list[str], goals: list[float], by: str) -> None:
    """One line per file and tolerance, one column per method."""
    compiled = sum(timing.compiling for timing in timings)
    title = "Time to solution" if by == "time" else "Floating point operations to solution"
    show_table(title, ["problem", "tolerance", *names], _rows(timings, names, goals, by))
    solved = [
        f"{name} {sum(math.isfinite(t.seconds) for t in timings if t.method == name)}"
        for name in names
    ]
    click.echo(f"solved of {len(timings) // len(names)}: {', '.join(solved)}")
    if compiled >= TELLING:
        click.echo(f"compiling, once and not counted: {duration(compiled)}")


def _rows(
    timings: list[Timing], names: list[str], goals: list[float], by: str
) -> list[list[str]]:
    """The cells of the table, the best of each line in bold."""
    table = {(t.file, t.tolerance, t.method): t for t in timings}
    rows = []
    for file in dict.fromkeys(t.file for t in timings):
        for goal in goals:
            cells = [table[file, goal, name] for name in names]
            best = np.nanmin([math.inf, *(cell.cost(by) for cell in cells)])
            texts = [_cell(cell, by, best) for cell in cells]
            rows.append([Path(file).stem, f"{goal:g}", *texts])
    return rows


def _cell(timing: Timing, by: str, best: float) -> str:
    if not math.isfinite(timing.seconds):
        failed = timing.outcome.replace("_", " ")
        return f"[red]{failed if len(failed) < 20 else 'does not fit'}[/red]"
    cost = timing.cost(by)
    text = _seconds(cost) if by == "time" else _operations(cost)
    return f"[bold]{text}[/bold]" if cost == best else text


def _seconds(value: float) -> str:
    return f"{1e3 * value:.3g} ms" if value < 1 else f"{value:.3g} s"


def _operations(value: float) -> str:
    if math.isnan(value):
        return "not counted"
    return f"{value / 1e6:.3g} M" if value < 1e9 else f"{value / 1e9:.3g} G"


def _profiles(
    timings: list[Timing], names: list[str], goals: list[float], by: str
) -> tuple[dict[float, Any], list[str]]:
    """Performance profiles by tolerance, and the methods in them: those that count the cost."""
    shown = [
        name for name in names
        if not any(math.isnan(t.cost(by)) for t in timings if t.method == name)
    ]  # fmt: skip
    profiles = {}
    for goal in goals if shown else ():
        columns = [
            [t.cost(by) for t in timings if t.method == name and t.tolerance == goal]
            for name in shown
        ]
        profiles[goal] = performance_profile(np.array(columns).T)
    return profiles, shown


def _page(
    timings: list[Timing], names: list[str], goals: list[float], by: str, stop: Stop
) -> Page:
    """The report of a race."""
    from ...io.report import bench_page

    rows = [[re.sub(r"\[/?\w+\]", "", cell) for cell in row]
            for row in _rows(timings, names, goals, by)]  # fmt: skip
    profiles, shown = _profiles(timings, names, goals, by)
    facts = [["criterion", stop.criterion.value], ["time limit", f"{stop.seconds:g} s"],
             ["compiling, not counted", duration(sum(t.compiling for t in timings))]]
    what = "time" if by == "time" else "operations"
    return bench_page("Methods compared", ("problem", "tolerance", *names), rows, profiles,
                      shown, facts, what)  # fmt: skip


def _draw(
    timings: list[Timing], names: list[str], goals: list[float], path: Path, by: str
) -> None:
    """One panel per tolerance; methods that do not count operations are not in theirs."""
    from ...io.plots import profile_figure, save_figure

    profiles, shown = _profiles(timings, names, goals, by)
    if not shown:
        raise InvalidInput("--by flops: no method here counts its operations")
    what = "time" if by == "time" else "operations"
    save_figure(profile_figure(profiles, shown, what), path)
