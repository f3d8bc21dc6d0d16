"""What a notebook shows of problems and results: a small table, every word of it escaped.

A new class is registered here; `core.faces.Told` has the method that notebooks call.
"""

from __future__ import annotations

import html as markup
from collections.abc import Iterable, Sequence
from functools import singledispatch
from typing import Any

import numpy as np

from ...analysis.basins.study import Basins
from ...analysis.certificates.critical_friction import CriticalFriction
from ...analysis.certificates.opening import Opening
from ...analysis.certificates.verdict import Uniqueness
from ...analysis.paths.diagram import Diagram
from ...analysis.paths.path import Branch
from ...analysis.solutions.enumerate import Solutions
from ...core.warned import ResultWarning
from ...mechanics.model import Model
from ...problem.friction import FrictionProblem
from ...problem.solution import Convergence, FrictionSolution
from ..results import Output

MOST = 12  # rows of a table; the rest is counted
LETTERS = 40  # of a pattern of statuses
Row = tuple[str, object]


def html(result: Any) -> str:
    """The HTML of a result; the words of its repr for a class that has none."""
    return face(result)


@singledispatch
def face(result: Any) -> str:
    """A table of names and values under a title."""
    output = getattr(result, "output", None)  # of a solved model
    return face(output) if isinstance(output, Output) else f"<pre>{escaped(repr(result))}</pre>"


def escaped(words: object) -> str:
    """Words as they are, whatever signs they have."""
    return markup.escape(str(words))


def listing(title: str, rows: Iterable[Row], notes: Sequence[str] = ()) -> str:
    """Names beside values; notes below, in red."""
    body = "".join(
        f'<tr><th style="text-align:left">{escaped(name)}</th>'
        f'<td style="text-align:left">{escaped(value)}</td></tr>'
        for name, value in rows
    )
    red = "".join(f'<div style="color:#b00020">{escaped(note)}</div>' for note in notes)
    return f"<div><strong>{escaped(title)}</strong>{red}<table>{body}</table></div>"


def table(
    title: str, names: Sequence[str], rows: Sequence[Sequence[object]],
    notes: Sequence[str] = (),
) -> str:  # fmt: skip
    """Columns with names, the first rows of many."""
    head = "".join(f"<th>{escaped(name)}</th>" for name in names)
    body = "".join(
        "<tr>" + "".join(f"<td>{escaped(value)}</td>" for value in row) + "</tr>"
        for row in rows[:MOST]
    )
    more = f"<div>… {len(rows) - MOST} more</div>" if len(rows) > MOST else ""
    text = "".join(f"<div>{escaped(note)}</div>" for note in notes)
    return (f"<div><strong>{escaped(title)}</strong>{text}"
            f"<table><tr>{head}</tr>{body}</table>{more}</div>")  # fmt: skip


def shortened(pattern: str) -> str:
    """A pattern of statuses, its end left out where it is long."""
    return pattern if len(pattern) <= LETTERS else f"{pattern[: LETTERS - 1]}…"


@face.register
def _(result: FrictionProblem) -> str:
    numbers = getattr(result.law, "mu", None)
    rows: list[Row] = [
        ("contacts", f"{result.contacts} in {result.dimension}D"),
        ("form", result.form.name.lower()),
        ("unknowns", result.unknowns),
        ("law", result.law.name),
    ]
    if numbers is not None and np.size(numbers):
        low, high = float(np.min(numbers)), float(np.max(numbers))
        rows.append(("friction", f"{low:g}" if low == high else f"{low:g} to {high:g}"))
    return listing(result.name or "friction problem", rows)


@face.register
def _(result: Model) -> str:
    rows: list[Row] = [
        (f"body {body.name or k + 1}", f"{len(body.mesh.points)} nodes, "
         f"{body.mesh.cell_count} cells, {type(body.material).__name__}")
        for k, body in enumerate(result.bodies)
    ]  # fmt: skip
    rows += [(f"held: {support.on}", "") for support in result.supports[:MOST]]
    rows += [("load", f"{type(load).__name__} {getattr(load, 'on', '')}")
             for load in result.loads[:MOST]]  # fmt: skip
    for contact in result.contacts[:MOST]:
        against = ", ".join(contact.masters) or type(contact.obstacle).__name__
        rows.append((f"contact {contact.slave}", f"with {against}"))
    return listing(result.name or "model", rows)


def _record_rows(record: Convergence) -> list[Row]:
    return [("outcome", record.outcome.name.lower().replace("_", " ")),
            ("error", record.errors), ("iterations", record.iterations),
            ("seconds", f"{record.seconds:.3g}"), ("solver", record.solver)]  # fmt: skip


def _notes(record: Convergence, warnings: Iterable[ResultWarning]) -> list[str]:
    stamp = [f"{record.stamp}. {record.advice}"] if record.stamp else []
    return stamp + [str(warning) for warning in warnings]


@face.register
def _(result: Convergence) -> str:
    return listing("convergence", _record_rows(result), _notes(result, ()))


@face.register
def _(result: FrictionSolution) -> str:
    record = result.convergence
    return listing(result.headline, _record_rows(record), _notes(record, result.warnings))


@face.register
def _(result: Output) -> str:
    solution, fields = result.solution, result.fields
    record = solution.convergence
    rows = _record_rows(record)
    if fields is not None:
        force = ", ".join(f"{value:.6g}" for value in fields.resultant)
        rows.append(("resultant on the slaves", force))
        rows.append(("largest pressure", f"{fields.pressure.max(initial=0.0):.6g}"))
    return listing(solution.headline, rows, _notes(record, result.warnings))


@face.register
def _(result: Solutions) -> str:
    rows = [(shortened(s.pattern), f"{s.error:.1e}", f"{s.orientation:+d}", f"{s.energy:.6g}",
             s.freedom) for s in result.solutions]  # fmt: skip
    count = f"{len(result)} solution" + "s" * (len(result) != 1)
    note = "complete: " if result.complete else "not complete: "
    return table(count, ("pattern", "error", "orientation", "energy", "freedom"), rows,
                 [note + result.reason + result.resolved])  # fmt: skip


def _branch_row(branch: Branch) -> tuple[object, ...]:
    values = branch.parameter
    folds = ", ".join(f"{fold.parameter:.6g}" for fold in branch.folds) or "none"
    ends = ", ".join(stop.name.lower().replace("_", " ") for stop in branch.stops)
    reach = f"{values.min():.6g} … {values.max():.6g}" if len(values) else "nothing"
    return len(branch), reach, folds, len(branch.events), ends


BRANCH = ("points", "parameter", "folds", "events", "ends")


@face.register
def _(result: Branch) -> str:
    return table(f"branch over {result.name}", BRANCH, [_branch_row(result)])


@face.register
def _(result: Diagram) -> str:
    count = f"{len(result)} branch" + "es" * (len(result) != 1)
    return table(count, BRANCH, [_branch_row(branch) for branch in result], [result.reason])


@face.register
def _(result: Uniqueness) -> str:
    rows: list[Row] = [
        ("friction", f"{result.friction:g}"),
        ("critical friction", f"{result.lower:.6g} to {result.upper:.6g}"),
    ]
    if result.other is not None:
        rows.append(("another solution", shortened(result.other.pattern)))
    rows.append(("why", result.reason))
    return listing(result.verdict.name.lower().replace("_", " "), rows)


@face.register
def _(result: CriticalFriction) -> str:
    rows: list[Row] = [("at least", f"{result.lower:.6g}"), ("at most", f"{result.upper:.6g}"),
                       ("proved by", result.criterion)]  # fmt: skip
    rows += [("why no closer", result.reason)] if result.reason else []
    return listing("critical friction", rows)


@face.register
def _(result: Opening) -> str:
    return listing(result.verdict.meaning, [("why", result.reason)])


@face.register
def _(result: Basins) -> str:
    counts = result.counts
    names = sorted({name for row in counts.values() for name in row})
    rows = [(label, *(row.get(name, 0) for name in names)) for label, row in counts.items()]
    return table("runs that end at each solution", ("method", *names), rows)
