"""What users give to `follow` and `diagram`, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ...core.errors import InvalidInput
from .continuation import Continuation
from .friction_path import FrictionPath
from .large_path import LargePath
from .path import PathProblem, is_number, name_of, weight_of

Array = NDArray[np.float64]
LIMITS = ("max_points", "time_limit", "callback")


def checked_interval(interval: Any) -> tuple[float, float]:
    """Two finite numbers a < b."""
    try:
        low, high = interval
    except (TypeError, ValueError):
        low = high = np.nan
    if not (is_number(low) and is_number(high) and -np.inf < low < high < np.inf):
        raise InvalidInput(f"interval: expected two numbers a < b, got {interval!r}")
    return float(low), float(high)


def checked_limits(limits: Mapping[str, Any]) -> dict[str, Any]:
    """max_points, time_limit and callback, where they are given."""
    for name, value in limits.items():
        if name not in LIMITS:
            raise InvalidInput(f"{name}: expected one of {', '.join(LIMITS)}")
        number = is_number(value) and not np.isnan(value)
        if name == "max_points" and not number:
            raise InvalidInput(f"max_points: expected a number of points, got {value!r}")
        limit = number or value is None or isinstance(value, Deadline)
        if name == "time_limit" and not limit:
            raise InvalidInput(f"time_limit: expected seconds, got {value!r}")
        if name == "callback" and not (value is None or callable(value)):
            raise InvalidInput(
                f"callback: expected a function of a point and an event, got {value!r}"
            )
    return dict(limits)


def checked_value(name: str, value: Any, interval: tuple[float, float]) -> float:
    """A value of the parameter in the interval."""
    low, high = interval
    if not (is_number(value) and low <= value <= high):
        raise InvalidInput(f"{name}: expected a number in {low:g} … {high:g}, got {value!r}")
    return float(value)


def checked_values(at: Any, interval: tuple[float, float]) -> tuple[float, ...]:
    """Values of the parameter in the interval, one at least."""
    if isinstance(at, str) or not isinstance(at, Sequence | np.ndarray) or not len(at):
        raise InvalidInput(f"at: expected a list of numbers, got {at!r}")
    return tuple(checked_value("at", value, interval) for value in at)


def check_options(options: object) -> None:
    """None, or a Continuation."""
    if options is not None and not isinstance(options, Continuation):
        raise InvalidInput(f"options: expected a Continuation, got {options!r}")


def check_size(path: FrictionPath | LargePath, y: Array) -> None:
    """Raise InvalidInput for unknowns that a problem at finite strains does not have."""
    if isinstance(path, LargePath) and len(y) != path.step.unknowns:
        raise InvalidInput(
            f"start: expected a solution, or its v of {path.step.unknowns} entries, "
            f"got {len(y)} numbers"
        )
    if not np.isfinite(y).all():
        raise InvalidInput("start: expected finite numbers")


def check_start(problem: PathProblem, y: Array, p: float) -> None:
    """Raise InvalidInput where a problem of the user's does not fit its start or the protocol.

    residual and jacobian are called once.
    """
    n = len(y)
    if not n or not np.isfinite(y).all():
        raise InvalidInput(f"start: expected finite unknowns, got {y}")
    if isinstance(problem, type):
        raise InvalidInput(f"problem: expected an object, got the class {problem.__name__}")
    weight = weight_of(problem, n)
    if not (weight > 0 and np.isfinite(weight)):
        raise InvalidInput(f"weight: expected a number > 0, got {weight!r}")
    _check_array("residual", problem.residual(y, p), (n,), p)
    derivatives = problem.jacobian(y, p)
    if not (isinstance(derivatives, tuple) and len(derivatives) == 2):
        raise InvalidInput("jacobian: expected two arrays, the derivatives by y and by p")
    _check_array("jacobian by y", derivatives[0], (n, n), p)
    _check_array("jacobian by p", derivatives[1], (n,), p)
    name = name_of(problem.piece(y, p))
    if not isinstance(name, Hashable):
        raise InvalidInput(f"piece: expected a name or an array, got {name!r}")


def _check_array(name: str, value: Any, shape: tuple[int, ...], p: float) -> None:
    found = getattr(value, "shape", None)
    if found != shape:
        got = type(value).__name__ if found is None else f"shape {found}"
        raise InvalidInput(f"{name}: expected an array of shape {shape}, got {got}")
    entries = value.tocsr().data if hasattr(value, "tocsr") else value
    if not np.isfinite(entries).all():
        raise InvalidInput(f"{name}: expected finite numbers, got others at the start ({p:g})")
