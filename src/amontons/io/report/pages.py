"""Pages of results: a solve, steps in time, all solutions, solution curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.certificates.uniqueness import quick_verdict
from ...analysis.quick import operations_of
from ...mechanics.steps import TimeStep
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers import Iterate
from ...solvers.driver import drive
from ..results import Output, method_name
from ..units import Units
from .charts import STATUS, chart, convergence_chart, count_chart, line, reaction_chart
from .page import Page, Table
from .skin import Skin
from .states import Stage, State
from .words import (
    UNPROVED,
    cost_table,
    judged_table,
    outcome_words,
    pairs_table,
    result_table,
    verdict_words,
    version_rows,
)

if TYPE_CHECKING:
    from ...analysis.solutions.enumerate import Solutions
    from ...mechanics.model import Model

MOST_SHOWN = 6  # solutions side by side
MOST_ROWS = 400  # of a table of steps
MOST_STEPS = 200  # steps that a page can show


# ------------------------------------------------------------------------------ one solve
def solve_page(output: Output, units: Units, title: str = "") -> Page:
    """One solution of a model or of a discrete problem."""
    found, record = output.solution, output.solution.convergence
    charts = [convergence_chart(record)]
    stage = states = None
    if output.model is not None and output.fields is not None and len(found.status):
        stage = Stage(Skin(output.model))
        states = [stage.state(output.fields, found)]
    else:
        charts.insert(0, reaction_chart(found))
    return Page(
        "solve", title or output.title or found.problem.name or "friction problem",
        headline=_counted(found),
        outcome=outcome_words(record), stamp=record.stamp, verdict=_verdict(output),
        facts=[result_table(output, units), judged_table(output), cost_table(output)],
        warnings=(*(f"{w.message} [{w.name}]" for w in output.warnings), *output.notes),
        tables=pairs_table(output, units),
        charts=[c for c in charts if c], stage=stage, states=states or [], units=units,
    )  # fmt: skip


def _verdict(output: Output) -> tuple[str, str]:
    """What is known of other solutions; the tangent problem of large strains says little."""
    found, verdict = output.solution, output.uniqueness
    if output.model is not None and output.model.kind is not FrictionProblem:
        return "Not examined", UNPROVED
    if verdict is None and isinstance(found.problem, FrictionProblem):
        verdict = quick_verdict(found.problem, operations_of(found.convergence), found)
    return verdict_words(verdict)


def _counted(found: FrictionSolution) -> str:
    counts = found.counts
    told = ", ".join(f"{counts[name]} {name}" for name in STATUS)
    word = "contact" if found.problem.contacts == 1 else "contacts"
    return f"{found.problem.contacts} {word} in {found.problem.dimension}D: {told}"


# ------------------------------------------------------------------------------ in time
@dataclass
class Film:
    """The states of an evolution as they come: at most `most`, evenly, the last included."""

    model: Model
    most: int = MOST_STEPS
    stage: Stage = field(init=False)
    steps: list[tuple[int, State]] = field(default_factory=list)
    every: int = 1
    _last: TimeStep | None = None

    def __post_init__(self) -> None:
        self.stage = Stage(Skin(self.model))
        self.most = self.stage.most(self.most)

    def add(self, step: TimeStep) -> None:
        """Take a step, unless so many are kept that only every other one counts."""
        self._last = step
        if step.state.index % self.every:
            return
        self.steps.append((step.state.index, self._state(step)))
        if len(self.steps) > self.most:
            self.every *= 2
            self.steps = [item for item in self.steps if item[0] % self.every == 0]

    def states(self) -> list[State]:
        """What is kept, and the last step."""
        kept = list(self.steps)
        if self._last is not None and (not kept or kept[-1][0] != self._last.state.index):
            kept.append((self._last.state.index, self._state(self._last)))
        return [state for _, state in kept]

    def _state(self, step: TimeStep) -> State:
        return self.stage.state(
            step.fields, step, label=f"step {step.state.index}, t = {step.time:.6g}",
            parameter=step.time,
        )  # fmt: skip


def run_page(
    film: Film, table: Any, title: str, units: Units, note: str = "",
    warnings: Sequence[str] = (),
) -> Page:  # fmt: skip
    """Steps in time; table: the rows of steps.csv, with named columns.  note: a stamp."""
    states = film.states()
    times = table["time"]
    at = [[s.parameter, None, k] for k, s in enumerate(states)]
    counts = [{name: int(row[name]) for name in STATUS} for row in table]
    stamp = note or (states[-1].stamp if states else "")
    rows = [_step_row(row) for row in table[-MOST_ROWS:]]
    shown = f", every {film.every} steps" if film.every > 1 else ""
    title_of_rows = f"Steps, the last {MOST_ROWS}" if len(table) > MOST_ROWS else "Steps"
    jumps = [f"{t:.6g}" for t in table["jump"] if t == t]
    facts = [["steps", str(len(table))], ["time", f"{times[-1]:.6g} {units.time}".strip()],
             ["largest error", f"{table['error'].max():.1e}"],
             ["solving, all steps", f"{table['seconds'].sum():.3g} s"],
             ["shown", f"{_number(len(states), 'state')}{shown}: {_span(states)}"]]  # fmt: skip
    if jumps:
        facts.append(["jumps at t", ", ".join(jumps)])
    return Page(
        "run", title, headline=f"{_number(len(table), 'step')} to t = {times[-1]:.6g}",
        outcome="Not finished" if note else "All steps made", stamp=stamp,
        verdict=("Not asked", "Every step may have several solutions; “amontons follow” traces "
                 "how they change."),
        facts=[Table("Evolution", ("", ""), facts),
               Table("How it was solved", ("", ""), version_rows())],
        warnings=tuple(warnings),
        charts=[count_chart(times, counts, _label("time", units.time), at),
                *_work_charts(table, units, at)],
        tables=[Table(title_of_rows, ("step", "time", *STATUS, "iterations", "error"), rows)],
        stage=film.stage if states else None, states=states, by="time", units=units,
    )  # fmt: skip


def _span(states: Sequence[State]) -> str:
    """Of which steps states are; those before a restart are gone."""
    return " to ".join(dict.fromkeys(s.label for s in (states[0], states[-1])))


def _step_row(row: Any) -> list[str]:
    return [str(row["index"]), f"{row['time']:.6g}", *(str(row[name]) for name in STATUS),
            str(row["iterations"]), f"{row['error']:.1e}"]  # fmt: skip


def _work_charts(table: Any, units: Units, at: list[Any]) -> list[dict[str, Any]]:
    """Where the work went since the first step."""
    sums = {"work of loads and supports": table["loads"] + table["supports"],
            "dissipated by contact and friction": -table["contact"],
            "lost in time scheme and damping": table["damping"] + table["numerical"],
            }  # fmt: skip
    series = [line(name, table["time"], np.cumsum(values), k)
              for k, (name, values) in enumerate(sums.items())]  # fmt: skip
    work = f"{units.force} {units.length}" if units.force and units.length else ""
    return [chart("Energy", _label("time", units.time), _label("work", work), series,
                  states=at)]  # fmt: skip


def _label(name: str, unit: str) -> str:
    return f"{name} in {unit}" if unit else name


# ------------------------------------------------------------------------ all solutions
def solutions_page(
    found: Solutions, title: str, units: Units, problem: FrictionProblem | None = None,
    model: Model | None = None,
) -> Page:  # fmt: skip
    """All solutions side by side; problem: what they solve, needed for bodies and charts."""
    several = list(found.solutions)
    names = [f"{k}: orientation {s.orientation:+d}" for k, s in enumerate(several, 1)]
    count = f"{len(found)} solution" + ("s" if len(found) != 1 else "")
    sure = "There is no other" if found.complete else "There may be others"
    columns = ("", "pattern", "open", "stick", "slip", "orientation", "energy", "error", "")
    rows = [
        [str(k), _short(s.pattern), *(str(sum(s.pattern.count(c) for c in part))
                                      for part in ("f", "s", "+-l")),
         f"{s.orientation:+d}", f"{s.energy:.5g}", f"{s.error:.1e}",
         "isolated" if s.freedom == 0 else f"a set of dimension {s.freedom}"]
        for k, s in enumerate(several, 1)
    ]  # fmt: skip
    stage, states, charts = None, [], []
    if problem is not None:
        solved = [drive(problem, start=Iterate(np.array(s.r))) for s in several[:MOST_SHOWN]]
        if model is not None and solved:
            stage = Stage(Skin(model))
            states = [
                stage.state(model.recover(one), one, label=name, parameter=float(k + 1))
                for k, (one, name) in enumerate(zip(solved, names, strict=False))
            ]
        else:
            charts = [reaction_chart(one, f"Solution {name}")
                      for one, name in zip(solved, names, strict=False)]  # fmt: skip
    stamps = [s.stamp for s in states if s.stamp]
    more = len(several) - MOST_SHOWN
    return Page(
        "enumerate", title, headline=f"{count}. {sure}.",
        outcome="Complete, with proof" if found.complete else "Not complete",
        stamp=stamps[0] if stamps else "",
        verdict=(f"{count}; {sure[0].lower()}{sure[1:]}", f"{found.reason}{found.resolved}"),
        facts=[Table("How it was found", ("", ""), [
            ["partial patterns examined", str(found.examined)],
            ["time", f"{found.seconds:.3g} s"], *version_rows()])],
        tables=[Table("Solutions", columns, rows)], charts=charts, stage=stage, states=states,
        by="solution", note=f"{more} more are in the table" if more > 0 and states else "",
        units=units,
    )  # fmt: skip


def _short(pattern: str, letters: int = 60) -> str:
    return pattern if len(pattern) <= letters else f"{pattern[: letters - 1]}…"


def _number(count: int, word: str) -> str:
    return f"{count} {word}" + ("s" if count != 1 else "")


# ------------------------------------------------------------------------------- a race
def bench_page(
    title: str, columns: Sequence[str], rows: list[list[str]],
    profiles: dict[float, tuple[Any, Any]], names: Sequence[str], facts: list[list[str]],
    what: str = "time",
) -> Page:  # fmt: skip
    """Times of methods side by side, and their performance profiles by tolerance."""
    charts = []
    for tolerance, (tau, rho) in profiles.items():
        last = 1.5 * max(float(tau[-1]), 1.1)
        series = [line(method_name(name), np.append(tau, last),
                       np.append(rho[k], rho[k, -1]), k, step=True)
                  for k, name in enumerate(names)]  # fmt: skip
        charts.append(chart(f"Within a factor of the best, tolerance {tolerance:g}",
                            f"{what} / best {what}", "share of problems solved", series,
                            logx=True, top=1.0))  # fmt: skip
    return Page(
        "bench", title, headline=f"{_number(len(rows), 'race')} of "
        f"{_number(len(columns) - 2, 'method')}",
        facts=[Table("How it was measured", ("", ""), [*facts, *version_rows()])],
        tables=[Table(f"{what.capitalize()} to solution", tuple(columns), rows)], charts=charts,
    )  # fmt: skip
