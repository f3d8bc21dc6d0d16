"""The page of solution curves, with the bodies at points of them where a model is known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.paths.events import EventKind
from ...analysis.paths.large_path import LargePath
from ...analysis.paths.path import Branch
from ...analysis.paths.point_fields import fields_at
from ..units import Units
from .charts import chart, line, rounded
from .page import Page, Table
from .skin import Skin
from .states import Stage, State, chosen
from .words import version_rows

if TYPE_CHECKING:
    from ...mechanics.model import Model

MOST_POINTS = 120  # of all branches together, at which the bodies are shown
MOST_EVENTS = 300
UNFINISHED = ("SINGULAR", "STEP_TOO_SMALL", "LOST", "MAX_POINTS", "TIME_LIMIT", "STOPPED")
MARKS = {EventKind.FOLD: "fold", EventKind.BRANCH: "branch point"}


def curves_page(
    branches: Sequence[Branch], title: str, units: Units, model: Model | None = None,
    reason: str = "",
) -> Page:  # fmt: skip
    """Branches over their parameter; a point on them shows the bodies there."""
    name = branches[0].name if branches else "parameter"
    series, marks, points = [], [], []
    stage = None if model is None or not branches else Stage(Skin(model))
    most = MOST_POINTS if stage is None else stage.most(MOST_POINTS)
    most = max(2, most // max(len(branches), 1))
    states: list[State] = []
    for k, branch in enumerate(branches):
        heights = np.array(_heights(branch))
        series.append(line(f"branch {k + 1}", branch.parameter, heights, k))
        for event in branch.events:
            if event.kind in MARKS:
                y = float(np.interp(event.arclength, branch.arclength, heights))
                marks.append({"x": event.parameter, "y": y, "name": MARKS[event.kind]})
        if stage is None or model is None:
            continue
        for i in chosen(len(branch), most):
            state = _state(stage, model, branch, int(i), f"branch {k + 1}, ")
            points.append([*rounded([branch.parameter[i], heights[i]]), len(states)])
            states.append(state)
    note = _unfinished(branches)
    curve = chart("Solution curve", name, _height_name(branches), series, marks=marks,
                  states=points, curve=True)  # fmt: skip
    folds = [f"{e.parameter:.10g}" for b in branches for e in b.folds]
    facts = [["branches", str(len(branches))], ["folds at", ", ".join(folds) or "none"],
             ["changes of status", str(sum(e.kind is EventKind.STATUS
                                           for b in branches for e in b.events))],
             ["ends", ", ".join(s.name.lower().replace("_", " ")
                                for b in branches for s in b.stops)],
             ["time", f"{sum(b.seconds for b in branches):.3g} s"]]  # fmt: skip
    return Page(
        "follow", title, headline=f"{len(branches)} branch{'es' if len(branches) != 1 else ''} "
        f"over the {name}", outcome="Not finished" if note else "Followed to the ends",
        stamp=note, verdict=_verdict(branches, reason, name),
        facts=[Table("Curves", ("", ""), facts),
               Table("How it was solved", ("", ""), version_rows())],
        tables=[_events(branches, name)], charts=[curve], stage=stage, states=states,
        by=name, units=units, warnings=_warnings(branches),
    )  # fmt: skip


def _warnings(branches: Sequence[Branch]) -> tuple[str, ...]:
    """Those of all branches, each kind once."""
    told = {w.name: f"{w.message} [{w.name}]" for b in reversed(branches) for w in b.warnings}
    return tuple(told.values())


def _heights(branch: Branch) -> list[float]:
    rows = branch.table()
    if rows and "norm" in rows[0]:
        return [row["norm"] for row in rows]
    return [float(np.linalg.norm(point.state)) for point in branch.points]


def _height_name(branches: Sequence[Branch]) -> str:
    rows = branches[0].table() if branches else []
    return "size of the reactions" if rows and "norm" in rows[0] else "size of the unknowns"


def _state(stage: Stage, model: Model, branch: Branch, index: int, prefix: str) -> State:
    point = branch[index]
    problem: Any = branch.problem
    solution = problem.solution(point.state, point.parameter)
    fields = fields_at(model, branch, solution, point.parameter)
    return stage.state(
        fields, solution, parameter=point.parameter,
        label=f"{prefix}{branch.name} = {point.parameter:.5g}",
    )  # fmt: skip


def _verdict(branches: Sequence[Branch], reason: str, name: str) -> tuple[str, str]:
    folds = sum(len(b.folds) for b in branches)
    met = sum(e.kind is EventKind.BRANCH and not e.is_fold for b in branches for e in b.events)
    large = any(isinstance(b.problem, LargePath) for b in branches)
    ask = "am.multistart(model) looks for others" if large else "“--all” asks for them"
    text = reason or f"Closed branches that pass none of these points are not seen; {ask}."
    if folds:
        return f"No: {folds} folds, so some values of the {name} have several solutions", text
    if len(branches) > 1:
        return f"No: {len(branches)} branches over the same {name}", text
    if met:
        points = "a branch point" if met == 1 else f"{met} branch points"
        return f"No: other curves leave this one at {points}", text
    return "No second solution on this curve", text


def _events(branches: Sequence[Branch], name: str) -> Table:
    rows = [
        [f"branch {k + 1}", event.kind.name.lower(), f"{event.parameter:.10g}", _way(event)]
        for k, branch in enumerate(branches) for event in branch.events
    ]  # fmt: skip
    title = "Events"
    if len(rows) > MOST_EVENTS:
        title, rows = f"Events, the first {MOST_EVENTS} of {len(rows)}", rows[:MOST_EVENTS]
    return Table(title, ("", "event", name, ""), rows)


def _way(event: Any) -> str:
    if event.stop is not None:
        return f"{event.stop.advice} {event.detail}".strip()
    words = [str(w) for w in (event.before, event.after) if w is not None]
    return " → ".join(w if len(w) <= 40 else f"{w[:39]}…" for w in words)


def _unfinished(branches: Sequence[Branch]) -> str:
    stops = [s.name for b in branches for s in b.stops if s.name in UNFINISHED]
    if not stops:
        return ""
    reasons = ", ".join(dict.fromkeys(stops)).lower().replace("_", " ")
    count = f"{len(stops)} end" + ("s" if len(stops) > 1 else "")
    return f"NOT FINISHED ({count} of a branch: {reasons})"
