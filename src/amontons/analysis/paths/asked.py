"""What the verbs on solution curves are asked: a path, a solution on it, a direction."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import real
from ...core.errors import InvalidInput
from ...problem.friction import FrictionProblem
from . import checks
from .continuation import Continuation
from .corrector import Curve
from .first_order import first_order
from .following import Limits, continue_both, follow_along
from .friction_path import FrictionPath
from .large_path import LargePath
from .parametrised import first_state, path_of, state_of
from .path import Branch, Event, PathProblem, Point, timed
from .probes import by_probes
from .starting import polished
from .tangents import FirstOrder, Tangent

if TYPE_CHECKING:
    from ...mechanics.model import Model

Array = NDArray[np.float64]


def on_path(
    problem: Model | FrictionProblem | PathProblem, parameter: str, limits: Limits,
    base: Model | FrictionProblem | None, start: object, at: float | None,
) -> tuple[PathProblem, Array, float]:  # fmt: skip
    """(path, state, parameter): where following begins; raises InvalidInput with the name.

    start: also a point or an event of a branch, which has its parameter.
    """
    interval = limits.interval
    if isinstance(start, Point | Event):
        at, start = start.parameter if at is None else at, start.state
        known = True
    else:
        known = isinstance(problem, PathProblem) and np.ndim(cast(Any, start)) == 1
    if start is None and at is None and isinstance(getattr(problem, "start", None), np.ndarray):
        at, start = getattr(problem, "start_at", interval[0]), problem.start
    p = interval[0] if at is None else checks.checked_value("at", at, interval)
    if not isinstance(problem, PathProblem):
        path = timed(path_of(problem, parameter, interval, base), limits.deadline)
    elif base is not None:
        raise InvalidInput("base: expected none, a PathProblem has a parameter of its own")
    else:
        path = problem
    own = isinstance(path, FrictionPath | LargePath)
    if start is None and not own:
        raise InvalidInput("start: a PathProblem needs the unknowns of a solution at `at`")
    if start is None:
        assert isinstance(path, FrictionPath | LargePath)
        y = first_state(path, p)
    else:
        y = real("start", start).ravel() if known else state_of(path, start)
    if isinstance(path, FrictionPath) and len(y) != path.start.contacts * path.start.dimension:
        raise InvalidInput(
            f"start: expected {path.start.contacts * path.start.dimension} unknowns, "
            f"got {len(y)}"
        )
    if isinstance(path, LargePath):
        checks.check_size(path, y)
    else:
        checks.check_start(path, y, p)
    return path, y, p


def tangents_at(path: PathProblem, y: Array, p: float, tolerance: float) -> FirstOrder:
    """All one-sided tangents at a solution, by probes where the problem tells no pieces."""
    if not tolerance > 0:
        raise InvalidInput(f"tolerance: expected a number > 0, got {tolerance!r}")
    y = polished(path, y, p)
    if Continuation().knows_pieces(path):
        found = first_order(path, y, p, tolerance=tolerance)
    else:
        found = by_probes(Curve(path, len(y)), y, p, Continuation())
    return replace(found, problem=path)


def followed_along(
    path: PathProblem, y: Array, p: float, limits: Limits, options: Continuation | None,
    along: Tangent,
) -> Branch:  # fmt: skip
    """The branch from a solution along one tangent only."""
    if not isinstance(along, Tangent) or along.direction.shape != y.shape:
        raise InvalidInput(
            f"along: expected one of the tangents of first_order at the start, got {along!r}"
        )
    y = polished(path, y, p)
    if options is None:
        return follow_along(path, y, p, limits, along)
    return continue_both(path, y, p, limits, options, tangent=along)
