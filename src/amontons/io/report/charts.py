"""Curves of a page: convergence, counts over time, solution curves, profiles, reactions.

A chart is a dict: title, x and y axes {label, log}, series of points {name, colour, x, y} with
`step`, `dash` or `bars`, marks, and `states`, points (x, y, index of the state shown there).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...problem.solution import Convergence, FrictionSolution

MOST = 1500  # points of a series
STATUS = ("open", "slip", "stick")  # colours of that name


def chart(title: str, x: str, y: str, series: Iterable[dict[str, Any]],
          **more: Any) -> dict[str, Any]:  # fmt: skip
    """A chart; more: log (of y), logx, marks, states, lines."""
    return {"title": title, "x": x, "y": y, "series": list(series), **more}


def line(name: str, x: ArrayLike, y: ArrayLike, colour: int | str = 0,
         **more: Any) -> dict[str, Any]:  # fmt: skip
    """A series; colour: a number, or a status."""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if len(x) > MOST:
        kept = np.unique(np.rint(np.linspace(0, len(x) - 1, MOST)).astype(int))
        x, y = x[kept], y[kept]
    return {"name": name, "colour": colour, "x": rounded(x), "y": rounded(y), **more}


def rounded(values: ArrayLike) -> list[float]:
    """Numbers with six digits, as JSON is to hold them."""
    return [float(f"{value:.6g}") for value in np.asarray(values, dtype=float).ravel()]


def convergence_chart(record: Convergence) -> dict[str, Any] | None:
    """The error over the iterations, and its tolerance; None of nothing."""
    steps = [s for s in record.history if math.isfinite(s.error)]
    if len(steps) < 2:
        return None
    errors = [max(s.error, 1e-17) for s in steps]
    series = [line("error", [s.iteration for s in steps], errors)]
    level = [{"y": record.tolerance, "name": "tolerance"}]
    return chart("Convergence", "iteration", "error by the judge", series, log=True,
                 lines=level)  # fmt: skip


def reaction_chart(solution: FrictionSolution, name: str = "Reactions") -> dict[str, Any]:
    """Normal reactions as bars by status, sizes of the tangential ones as marks."""
    r, status = solution.r, solution.status
    number = np.arange(1, len(r) + 1)
    shear = np.linalg.norm(r[:, 1:], axis=1)
    order = number - 1
    if len(r) > MOST:
        order = np.sort(np.argsort(-r[:, 0], kind="stable")[:MOST])
        name = f"{name}, the {MOST} largest"
    series = [
        line(f"r_N, {STATUS[k]}", number[order][status[order] == k],
             r[order, 0][status[order] == k], STATUS[k], bars=True)
        for k in range(3)
    ]  # fmt: skip
    series.append(line("|r_T|", number[order], shear[order], 1, dots=True))
    return chart(name, "contact", "reaction", series)


def count_chart(x: Sequence[float], counts: Sequence[dict[str, int]], label: str,
                states: list[Any] | None = None) -> dict[str, Any]:  # fmt: skip
    """Numbers of contacts by status over time."""
    series = [line(name, x, [c[name] for c in counts], name, step=True) for name in STATUS]
    return chart("Contacts by status", label, "contacts", series, states=states or [])
