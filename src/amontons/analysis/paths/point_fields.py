"""What the points of a branch mean on its model: fields, and reasons to doubt them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.warned import ResultWarning
from ...mechanics.model.doubts import model_warnings
from ...mechanics.model.fields import ContactFields, by_body
from ...mechanics.model.large_deformation import LargeDeformation
from ...mechanics.steps.system import Motion
from ...mechanics.steps.timed import part_at, steady

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from ...problem.solution import FrictionSolution
    from .path import Branch, Point

ASKED = 20  # points of a branch whose fields are looked at


def fields_at(model: Model, branch: Branch, solution: Any, p: float) -> ContactFields:
    """Fields of a point: supports stand where the load, or the time, at that point has them."""
    body = steady(model)
    if branch.name != "load":
        return body.recover(solution)
    motion = Motion(model)
    if not motion.is_timed:
        return body.with_load(p).recover(solution)
    if model.kind is LargeDeformation:  # frames and areas are those of where supports stand
        return _at(model, p).recover(solution)
    parts = body.discretisation
    whole = parts.spread(solution.v, motion.applied(p)[1])
    return replace(body.recover(solution), displacement=by_body(body.bodies, parts, whole))


def _at(model: Model, t: float) -> Model:
    """The model with supports and loads as they are at a time."""
    return replace(
        model,
        supports=[part_at(part, t) for part in model.supports],
        loads=[part_at(part, t) for part in model.loads],
    )


def branch_warnings(model: Model, branch: Branch) -> tuple[ResultWarning, ...]:
    """Reasons to doubt states of a branch, each kind once, where it is met first.

    At most ASKED points are asked, evenly chosen, both ends among them.
    """
    problem: Any = branch.problem
    first: dict[str, ResultWarning] = {}
    for point in _some(branch.points):
        solution: FrictionSolution = problem.solution(point.state, point.parameter)
        fields = fields_at(model, branch, solution, point.parameter)
        if not any(moved.any() for moved in fields.displacement):
            continue  # where a path begins: no load is no fault there
        for doubt in (*solution.warnings, *model_warnings(steady(model), fields)):
            if doubt.name not in first:
                at = f"at {branch.name} {point.parameter:.5g}: {doubt.message}"
                first[doubt.name] = replace(doubt, message=at)
    return tuple(first.values())


def _some(points: Sequence[Point]) -> list[Point]:
    if len(points) <= ASKED:
        return list(points)
    kept = np.unique(np.rint(np.linspace(0, len(points) - 1, ASKED)).astype(np.int64))
    return [points[int(k)] for k in kept]
