"""Exact solutions to begin a path with: from nothing, or beside an approximate one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, SingularOperator
from ...problem.friction import FrictionProblem
from ..tolerances import SLACK
from .event_tracking import track
from .friction_path import FrictionPath
from .path import PathProblem, Stop, corrected, timed
from .straight import leaving

Array = NDArray[np.float64]


def exact_state(path: FrictionPath, p: float) -> Array:
    """One exact solution at a parameter, by event tracking from a state without contact.

    All contacts are lifted off and let down again.  Raises SingularOperator where that path
    ends before it comes down (W is not positive definite).
    """
    problem = path.at(p).condensed(path.deadline)
    W, q = problem.W, np.asarray(problem.q)
    assert W is not None
    size = float(np.abs(path.free(p)).max(initial=0)) or 1.0
    lift = np.zeros_like(q)
    lift[:, 0] = (2 * size * path.to_u.reshape(q.shape))[:, 0]
    lifted = FrictionProblem.from_delassus(W, q + lift, problem.mu)
    down = FrictionPath(lifted, FrictionProblem.from_delassus(W, q, problem.mu))
    down = timed(down, path.deadline)
    tangent = next(t for t in leaving(down, np.zeros(q.size), 0.0).tangents if t.rate > 0)
    *_, (point, event) = track(down, np.zeros(q.size), 0.0, tangent, (-1.0, 1.0))
    assert event is not None
    if event.stop is not Stop.INTERVAL or point.parameter < 1:
        raise SingularOperator(
            f"start: no solution was found at {p:g}: {event.stop.advice if event.stop else ''}"
        )
    return path.state((point.state * down.to_r).reshape(q.shape))


def polished(path: PathProblem, y: Array, p: float) -> Array:
    """The exact solution next to an approximate one, by Newton steps at fixed parameter.

    At a fold these do not converge: there a state is taken as it is if its residual is small.
    Raises InvalidInput where the state is no solution to within some per mille.
    """
    found = corrected(path, y, p)
    if found is None and np.abs(path.residual(y, p)).max(initial=0) <= SLACK:
        return y
    if found is None or np.abs(found - y).max(initial=0) > 1e-3 * max(1.0, np.abs(y).max()):
        rest = float(np.abs(path.residual(y, p)).max(initial=0))
        raise InvalidInput(
            f"start: expected a solution at {p:g}, got a state with residual {rest:.1e}"
        )
    return found
