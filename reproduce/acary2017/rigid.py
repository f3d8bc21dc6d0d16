"""The same wall of rigid blocks: rank of H, existence, and both families of methods.

The paper motivates its comparison by rigid bodies: there H loses rank as soon as 3 nc > n, and
Newton's method with it what it needs.  It announces to show whether an elastic law pays in such
systems, and shows elastic ones only.  Here the wall of `wall` is made of rigid blocks, with the
contacts of a coarse, a medium and a fine mesh, beside the elastic ones.  A second part shows
how Newton converges in its last steps.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import amontons as am
from amontons.io.case import read_case
from amontons.linear.rank import matrix_rank
from amontons.problem.solution import Outcome

from .race import load, store
from .wall import CASE

STEPS = (6, 14)  # of the run, pressed and sheared
WORDS = {6: "pressed", 14: "sheared"}
TOLERANCE = 1e-6
LIMIT = 5.0  # seconds of the processor for one solve
WAITING = 20.0  # the clock on the wall may run so many times longer
TIGHT = 1e-14  # error down to which the steps of Newton are drawn
ROUNDING = 1e-13  # errors below do not tell an order
ASYMPTOTIC = 1e-2  # nor do errors above
FIGURE = "newton.png"
DRAWN = ("elastic, coarse", "elastic, medium", "rigid, coarse")
FULL = am.FullStep()
METHODS: dict[str, Any] = {
    "NSN-AC": am.SemismoothNewton(am.AlartCurnier(), line_search=FULL),
    "NSN-AC-HYBRID": am.Hybrid(
        first=am.GaussSeidel(local=am.LocalSolver.NEWTON, batch=100),
        main=am.SemismoothNewton(am.AlartCurnier(), line_search=FULL),
    ),
    "NSGS-AC": am.GaussSeidel(local=am.LocalSolver.NEWTON, batch=10),
    "Auto": am.Auto(),
}
FUNCTIONS: dict[str, Any] = {
    "NSN-AC": am.AlartCurnier(), "NSN-JM": am.JeanMoreau(), "NSN-NM": am.NaturalMap(),
}  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """A wall: cells of a block, rigid or not."""

    name: str
    cells: tuple[int, int, int]
    rigid: bool


KINDS = (
    Kind("elastic, coarse", (2, 1, 1), False), Kind("rigid, coarse", (2, 1, 1), True),
    Kind("elastic, medium", (4, 2, 2), False), Kind("rigid, medium", (4, 2, 2), True),
    Kind("elastic, fine", (8, 4, 4), False), Kind("rigid, fine", (8, 4, 4), True),
)  # fmt: skip
QUICK = KINDS[:2]


def measure(
    out: Path, machine: dict[str, str], kinds: Sequence[Kind] = KINDS,
    report: Callable[[str], None] = print,
) -> None:  # fmt: skip
    """Sizes, rank, existence and methods by wall and step, and the errors of Newton.

    Stored in rigid.json after every step; walls that are not asked for stay.
    """
    stored = load(out / "rigid.json")
    rows, errors = stored.get("rows", {}), stored.get("errors", {})
    for kind in kinds:
        for step, problem in problems(kind):
            name = f"{kind.name}, {WORDS[step]}"
            rows[name] = row = _row(problem)
            met = ", ".join(f"{who} {_cell(run)}" for who, run in row["methods"].items())
            report(f"{name}: rank {row['rank']} of {row['rows']}, {met}")
            if kind.name in DRAWN and step == STEPS[-1]:
                errors[kind.name] = newton_errors(problem)
            record = {"machine": machine, "limit": LIMIT, "tolerance": TOLERANCE,
                      "rows": rows, "errors": errors}  # fmt: skip
            store(out / "rigid.json", record)


def problems(kind: Kind) -> Iterator[tuple[int, am.FrictionProblem]]:
    """The discrete problems of the chosen steps of the run of a wall."""
    settings = [f"wall.cells={list(kind.cells)}", f"wall.rigid={str(kind.rigid).lower()}"]
    case = read_case(CASE, settings)
    assert case.evolution is not None
    method = case.evolution.method
    for done in am.evolve(case.model, method, until=STEPS[-1] * method.step,
                          tolerance=case.settings.tolerance):  # fmt: skip
        if done.state.index in STEPS:
            yield done.state.index, done.problem


def _row(problem: am.FrictionProblem) -> dict[str, Any]:
    assert problem.H is not None
    rank, verdict = matrix_rank(problem.H), am.existence(problem)
    local = problem.condensed()
    return {
        "contacts": problem.contacts, "unknowns": problem.unknowns,
        "rows": problem.H.shape[1], "rank": rank.value, "least rank": rank.least,
        "existence": verdict.verdict.value, "margin": verdict.margin,
        "methods": {name: _run(local, solver) for name, solver in METHODS.items()},
    }  # fmt: skip


def _run(local: am.FrictionProblem, solver: Any) -> dict[str, Any]:
    """Outcome, error, iterations and processor seconds of a solve from r = 0."""
    began = time.process_time()

    def watch(*_: object) -> bool:
        return time.process_time() - began > LIMIT

    found = am.drive(local, solver, tolerance=TOLERANCE, time_limit=WAITING * LIMIT,
                     callback=watch)  # fmt: skip
    end = found.convergence
    return {"outcome": end.outcome.name.lower(), "error": end.error,
            "iterations": end.iterations, "seconds": time.process_time() - began}  # fmt: skip


def newton_errors(problem: am.FrictionProblem) -> dict[str, list[float]]:
    """Errors after every full step of Newton from r = 0, by function."""
    local, out = problem.condensed(), {}
    for name, function in FUNCTIONS.items():
        solver = am.SemismoothNewton(function, line_search=FULL)
        found = am.drive(local, solver, tolerance=TIGHT, max_iterations=60,
                         contact_tolerance=math.inf, time_limit=WAITING * LIMIT)  # fmt: skip
        out[name] = [step.error for step in found.convergence.history]
    return out


def order(errors: list[float]) -> float:
    """Order p of the last three errors a, b, c above rounding; nan where they do not fall.

    p = log(c / b) / log(b / a), the exponent of c = C b^p where also b = C a^p.
    """
    good = [e for e in errors if e > ROUNDING]
    if len(good) < 3:
        return math.nan
    a, b, c = good[-3:]
    if not c < b < a < ASYMPTOTIC:
        return math.nan
    return math.log(c / b) / math.log(b / a)


# ----------------------------------------------------------------------------- the page
def section(record: dict[str, Any], out: Path) -> str:
    """Markdown: the table of both walls, and how Newton ends, with its figure in `out`."""
    draw(record, out / FIGURE)
    names = list(METHODS)
    head = " | ".join(names)
    lines = [
        "| wall | contacts | n | 3 nc | rank of H | degree of hyperstaticity | a solution for "
        f"every load | {head} |",
        "|---|" + "---|" * (6 + len(names)),
    ]
    for name, row in record["rows"].items():
        rank = row["rank"] if row["rank"] == row["least rank"] else f"{row['rank']} (doubtful)"
        exists = row["existence"].replace("_", " ")
        if row["margin"] is not None:
            exists += f", margin {row['margin']:.2g}"
        cells = " | ".join(_cell(row["methods"][who]) for who in names)
        lines.append(
            f"| {name} | {row['contacts']} | {row['unknowns']} | {row['rows']} | {rank} | "
            f"{row['rows'] - row['rank']} | {exists} | {cells} |"
        )
    return "\n".join([
        *lines, "",
        f"To {record['tolerance']:g} from r = 0, W given, in seconds of the processor and "
        f"iterations; at most {record['limit']:g} s. {_said(record)}", "",
        f"![Errors after every step of Newton]({FIGURE})", "",
        _orders(record["errors"]),
    ])  # fmt: skip


def _cell(run: dict[str, Any]) -> str:
    if run["outcome"] == Outcome.CONVERGED.name.lower():
        return f"{run['seconds']:.2g} s, {run['iterations']}"
    what = "over" if run["outcome"] in ("stopped", "time_limit") else "gave up after"
    return f"{what} {run['seconds']:.2g} s ({run['error']:.0e})"


def _said(record: dict[str, Any]) -> str:
    """How many problems of each kind both families solve."""
    parts = []
    for kind in ("elastic", "rigid"):
        rows = [row for name, row in record["rows"].items() if name.startswith(kind)]
        counts = ", ".join(
            f"{who} {sum(row['methods'][who]['outcome'] == 'converged' for row in rows)}"
            for who in METHODS
        )
        lost = [row["rows"] - row["rank"] for row in rows]
        many = "no" if not max(lost, default=0) else f"{min(lost)} to {max(lost)}"
        parts.append(f"Of {len(rows)} {kind} problems, with {many} columns of H that depend "
                     f"on others, solve: {counts}.")  # fmt: skip
    return " ".join(parts)


def _orders(errors: dict[str, dict[str, list[float]]]) -> str:
    lines = ["| last errors | " + " | ".join(FUNCTIONS) + " |",
             "|---|" + "---|" * len(FUNCTIONS)]  # fmt: skip
    for name, found in errors.items():
        cells = []
        for who in FUNCTIONS:
            last = found[who][-4:]
            p = order(found[who])
            power = "" if math.isnan(p) else f" (order {p:.2g})"
            cells.append(f"{', '.join(f'{e:.1e}' for e in last)}{power}")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join([
        *lines, "",
        "Errors of the last four steps, and the order by the last three above rounding: 2 for "
        "a quadratic method, 1 where each step gains the same. On a singular W the matrix of "
        "Newton is singular too, where all contacts of a block stick.",
    ])  # fmt: skip


def draw(record: dict[str, Any], path: Path) -> None:
    """The errors of Newton against its steps, one panel for each wall."""
    errors = record["errors"]
    figure = Figure(figsize=(3.6 * len(errors), 3.2), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    panels = np.atleast_1d(figure.subplots(1, len(errors), sharey=True))
    for axes, (name, found) in zip(panels, errors.items(), strict=True):
        for (who, values), mark in zip(found.items(), "os^", strict=True):
            steps = np.arange(1, len(values) + 1)
            axes.semilogy(steps, np.maximum(values, 1e-17), mark + "-", label=who,
                          markersize=3.5, linewidth=1)  # fmt: skip
        axes.set_ylim(1e-17, 1e3)  # what diverges leaves the panel
        axes.set_title(name, fontsize=10)
        axes.set_xlabel("step")
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("error")
    panels[-1].legend(fontsize=8, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
